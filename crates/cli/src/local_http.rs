//! HTTP for pages that this program serves to its own machine: one request for each connection, each on a thread of its own with limits of
//! size and time, so that who sends nothing, or too much, holds nobody up.

use catseye::base::error::{Error, Result};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread;
use std::time::{Duration, Instant};

/// A request is there as a whole after this time, and its answer is taken.
const PATIENCE: Duration = Duration::from_secs(10);
/// The listener looks so often for who asks.
const HEED: Duration = Duration::from_millis(5);
/// Connections at a time; more are closed at once.
const MOST_AT_ONCE: usize = 64;
/// Longest head of a request, bytes, and most headers.
const MOST_HEAD: usize = 32 << 10;
const MOST_HEADERS: usize = 64;

/// What is asked for.
pub struct Request {
    /// `GET`, `POST` and so on.
    pub method: String,
    /// The path with what follows it.
    pub path: String,
    /// The header `Host`.
    pub host: Option<String>,
    /// What was sent with it.
    pub body: Vec<u8>,
}

/// What is answered.
pub struct Answer {
    /// Status, as 200.
    pub status: u16,
    /// Media type of the body.
    pub kind: &'static str,
    pub body: Vec<u8>,
}

impl Answer {
    /// A line for who asked for what is not there.
    pub fn refused(status: u16, text: &str) -> Answer {
        Answer { status, kind: "text/plain; charset=utf-8", body: text.into() }
    }
}

/// Answers requests with bodies of up to `most_body` bytes until `is_over` says so.
///
/// # Errors
/// Returns an error if the listener fails.
pub fn serve(
    listener: &TcpListener,
    most_body: usize,
    is_over: &(dyn Fn() -> bool + Sync),
    answer: &(dyn Fn(&Request) -> Answer + Sync),
) -> Result<()> {
    let failed = |e: std::io::Error| Error::Failed(format!("the server: {e}"));
    listener.set_nonblocking(true).map_err(failed)?;
    let open = AtomicUsize::new(0);
    thread::scope(|scope| {
        while !is_over() {
            match listener.accept() {
                Ok((stream, _)) if open.load(Relaxed) < MOST_AT_ONCE => {
                    open.fetch_add(1, Relaxed);
                    let open = &open;
                    scope.spawn(move || {
                        // Who has gone needs no answer.
                        let _ = attend(stream, most_body, answer);
                        open.fetch_sub(1, Relaxed);
                    });
                }
                Ok(_) => {}
                Err(e) if e.kind() == ErrorKind::WouldBlock => thread::sleep(HEED),
                // A connection that broke before it was taken.
                Err(e) if matches!(e.kind(), ErrorKind::ConnectionAborted | ErrorKind::Interrupted) => {}
                Err(e) => return Err(failed(e)),
            }
        }
        Ok(())
    })
}

fn attend(
    mut stream: TcpStream,
    most_body: usize,
    answer: &(dyn Fn(&Request) -> Answer + Sync),
) -> std::io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let made = match request(&mut stream, most_body)? {
        Ok(request) => answer(&request),
        Err((status, text)) => Answer::refused(status, text),
    };
    // A page of another origin may not read, frame or keep any of it.
    write!(
        stream,
        "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\r\n",
        made.status,
        reason(made.status),
        made.kind,
        made.body.len()
    )?;
    stream.write_all(&made.body)?;
    stream.flush()
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        411 => "Length Required",
        413 => "Content Too Large",
        _ => "Request Header Fields Too Large",
    }
}

/// Reads a request, or what is wrong with it. Errors: the connection breaks or takes too long.
fn request(
    stream: &mut TcpStream,
    most_body: usize,
) -> std::io::Result<std::result::Result<Request, (u16, &'static str)>> {
    let end = Instant::now() + PATIENCE;
    let mut bytes = Vec::new();
    let head = loop {
        if let Some(at) = bytes.windows(4).position(|w| w == b"\r\n\r\n") {
            break at + 4;
        }
        if bytes.len() > MOST_HEAD {
            return Ok(Err((431, "the header of the request is too long")));
        }
        more(stream, &mut bytes, end)?;
    };
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let is_whole = parsed.parse(&bytes[..head]).is_ok_and(|s| s.is_complete());
    let (Some(method), Some(path), true) = (parsed.method, parsed.path, is_whole) else {
        return Ok(Err((400, "this is not an HTTP request")));
    };
    let header = |name: &str| {
        let found = parsed.headers.iter().find(|h| h.name.eq_ignore_ascii_case(name));
        found.map(|h| String::from_utf8_lossy(h.value).trim().to_string())
    };
    if header("Transfer-Encoding").is_some() {
        return Ok(Err((411, "the request does not state its Content-Length")));
    }
    let length = match header("Content-Length").map(|l| l.parse::<u64>()) {
        None => 0,
        Some(Ok(length)) if length <= most_body as u64 => length as usize,
        Some(Ok(_)) => return Ok(Err((413, "the body of the request is too long"))),
        Some(Err(_)) => return Ok(Err((400, "Content-Length is not a number"))),
    };
    let (method, path, host) = (method.to_string(), path.to_string(), header("Host"));
    let mut body = bytes.split_off(head);
    while body.len() < length {
        more(stream, &mut body, end)?;
    }
    body.truncate(length);
    Ok(Ok(Request { method, path, host, body }))
}

/// Reads what is there. Errors: nothing comes until `end`, or nothing any more.
fn more(stream: &mut TcpStream, bytes: &mut Vec<u8>, end: Instant) -> std::io::Result<()> {
    let left = end.saturating_duration_since(Instant::now());
    if left.is_zero() {
        return Err(ErrorKind::TimedOut.into());
    }
    stream.set_read_timeout(Some(left))?;
    let mut some = [0; 16 << 10];
    match stream.read(&mut some)? {
        0 => Err(ErrorKind::UnexpectedEof.into()),
        n => {
            bytes.extend_from_slice(&some[..n]);
            Ok(())
        }
    }
}
