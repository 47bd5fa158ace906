//! Bytes of a file and of what lies beside it.

use crate::base::error::{BadInput, Error, Result};
use crate::formats::input;
use crate::scene::toml_file::clip;
use std::path::{Component, Path, PathBuf};

/// JSON and binary chunk; plain JSON is returned as it is.
pub(super) fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    const HEADER: usize = 12;
    if !bytes.starts_with(b"glTF") {
        let first = bytes.iter().find(|b| !b.is_ascii_whitespace());
        // A byte-order mark is allowed by some writers.
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return match first {
            Some(b'{') | Some(0xef) => Ok((text, None)),
            _ => Err("is neither binary glTF (it does not begin with 'glTF') nor JSON".into()),
        };
    }
    let word = |at: usize| -> Option<usize> {
        Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize)
    };
    let cut = || format!("is cut off after {} bytes", bytes.len());
    let (version, length) = (word(4).ok_or_else(cut)?, word(8).ok_or_else(cut)?);
    if version != 2 {
        return Err(format!("is binary glTF of version {version}, not 2"));
    }
    if length > bytes.len() {
        return Err(format!("is cut off: {} bytes of {length}", bytes.len()));
    }
    let (mut json, mut blob) = (None, None);
    let mut at = HEADER;
    while at + 8 <= length {
        let (size, kind) = (word(at).ok_or_else(cut)?, &bytes[at + 4..at + 8]);
        let Some(data) = bytes.get(at + 8..at + 8 + size) else {
            return Err(format!("has a chunk of {size} bytes that reaches past its end"));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(data),
            b"BIN\0" if blob.is_none() => blob = Some(data),
            _ => {} // The specification: clients ignore chunks of unknown types.
        }
        at += 8 + size.next_multiple_of(4);
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => Err("is binary glTF without a JSON chunk".into()),
    }
}

/// The bytes behind a buffer's URI: data in base64, or a file in or below the folder.
pub(super) fn load_uri(file: &Path, folder: Option<&Path>, index: usize, uri: &str) -> Result<Vec<u8>> {
    let bad = |problem: String| {
        BadInput::new(problem).file(file).key(format!("buffers[{index}].uri")).value(clip(uri))
    };
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err(bad("is a data URI without base64".into()).remedy("export as .glb").into());
        };
        return base64(text)
            .ok_or_else(|| bad("is not base64".into()).remedy("export the file again").into());
    }
    let path = beside(file, folder, &format!("buffers[{index}].uri"), uri)?;
    input::read(&path, "a buffer", super::options::MAX_BYTES)
}

/// The file behind a URI, which lies in or below the folder.
pub(super) fn beside(file: &Path, folder: Option<&Path>, key: &str, uri: &str) -> Result<PathBuf> {
    let bad = |problem: String| BadInput::new(problem).file(file).key(key).value(clip(uri));
    let outside = || {
        bad("leaves the folder of the file".into())
            .allowed("a relative path in or below that folder, or a data URI")
            .remedy("put it beside the file")
    };
    let name = percent_decoded(uri)
        .ok_or_else(|| bad("is not a valid URI".into()).remedy("export the file again"))?;
    let relative = PathBuf::from(&name);
    let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if name.is_empty() || name.contains([':', '\\', '\0']) || !inside {
        return Err(outside().into());
    }
    let Some(folder) = folder else {
        return Err(bad("is a file, and there is no folder to look in".into())
            .remedy("give a .glb file")
            .into());
    };
    let path = folder.join(&relative);
    let missing = |e: std::io::Error| -> Error {
        if e.kind() == std::io::ErrorKind::NotFound {
            let missing = bad("the file is missing".into()).remedy("put it beside the .gltf file");
            // A .glb is no text and has no lines.
            let text = std::fs::read_to_string(file).unwrap_or_default();
            match text.find(&format!("\"{uri}\"")) {
                Some(at) => missing.line(text[..at].matches('\n').count() + 1).into(),
                None => missing.into(),
            }
        } else {
            Error::io(&path, e)
        }
    };
    // A link may lead anywhere: compare what the names resolve to.
    let real = path.canonicalize().map_err(missing)?;
    let real_folder = folder.canonicalize().map_err(|e| Error::io(folder, e))?;
    if !real.starts_with(&real_folder) {
        return Err(outside().into());
    }
    if !real.is_file() {
        return Err(bad("is not a file".into()).remedy("put it beside the .gltf file").into());
    }
    Ok(real)
}

pub(super) fn percent_decoded(s: &str) -> Option<String> {
    let mut out = Vec::with_capacity(s.len());
    let mut bytes = s.bytes();
    while let Some(b) = bytes.next() {
        out.push(match b {
            b'%' => {
                let digit = |b: Option<u8>| (b? as char).to_digit(16);
                (digit(bytes.next())? * 16 + digit(bytes.next())?) as u8
            }
            b => b,
        });
    }
    String::from_utf8(out).ok()
}

pub(super) fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0);
    let text = text.trim_end_matches('=');
    for c in text.bytes() {
        let v = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | v as u32;
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    // A single character left over holds no whole byte.
    (held != 6).then_some(out)
}
