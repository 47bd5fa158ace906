//! Text of files that a user brings, decoded in one way for all formats: a byte-order mark is dropped, other encodings and files of
//! another kind are refused by name, and lines that end in CR alone end in LF.

use super::input;
use crate::base::error::{BadInput, Result};
use std::borrow::Cow;
use std::path::Path;

const BOM: &[u8] = b"\xef\xbb\xbf";

const UNPACK: &str = "unpack it first";
const EXPORT: &str = "export or choose the right file";

/// First bytes of files of other kinds: (bytes, kind, hint).
const MAGIC: [(&[u8], &str, &str); 15] = [
    (b"\x1f\x8b", "compressed (gzip)", UNPACK),
    (b"\xfd7zXZ\0", "compressed (xz)", UNPACK),
    (b"\x28\xb5\x2f\xfd", "compressed (zstd)", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    (b"PK\x03\x04", "a ZIP archive or a spreadsheet", "unpack it, or save the sheet as CSV"),
    (b"%PDF-", "a PDF document", EXPORT),
    (b"\x89PNG", "a PNG image", EXPORT),
    (b"\xff\xd8\xff", "a JPEG image", EXPORT),
    (b"glTF\x02\0\0\0", "binary glTF", "name it .glb"),
    (b"\x93NUMPY", "a NumPy array", EXPORT),
    (b"\x89HDF", "an HDF5 file", EXPORT),
    (b"ISO-10303-21", "a STEP file", "export it as .stl, .obj or .glb"),
    (b"version https://git-lfs", "a pointer of Git LFS without the contents", "fetch them: git lfs pull"),
    (b"\xff\xfe", "UTF-16 text", "save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text", "save it as UTF-8"),
];

/// The kind of file that these bytes begin, where it is one that is given by mistake, and a hint.
fn other_kind(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    if let Some((_, kind, hint)) = MAGIC.iter().find(|m| bytes.starts_with(m.0)) {
        return Some((kind, hint));
    }
    // UTF-16 without a mark: every other byte of ASCII text is zero.
    let ascii = |b: u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    if let Some([a, b, c, d]) = bytes.first_chunk()
        && ((ascii(*a) && *b == 0 && ascii(*c) && *d == 0) || (*a == 0 && ascii(*b) && *c == 0 && ascii(*d)))
    {
        return Some(("UTF-16 text", "save it as UTF-8"));
    }
    let start = bytes.strip_prefix(BOM).unwrap_or(bytes).trim_ascii_start();
    let begins = |tag: &str| start.get(..tag.len()).is_some_and(|s| s.eq_ignore_ascii_case(tag.as_bytes()));
    let page = begins("<!doctype html") || begins("<html");
    page.then_some(("a web page (HTML)", "download the file itself, for example by its raw link"))
}

/// The error about a file of another kind than `what` ("a CSV table"), where its first bytes give that away.
pub fn of_other_kind(bytes: &[u8], file: &Path, what: &str) -> Option<BadInput> {
    let (kind, hint) = other_kind(bytes)?;
    Some(BadInput::new(format!("is {kind}, not {what}")).file(file).remedy(hint))
}

/// Line of a byte, from 1.
fn line_of(bytes: &[u8], at: usize) -> usize {
    bytes[..at].iter().filter(|b| **b == b'\n').count() + 1
}

/// The text of a file's bytes; `what` it should be is named in errors.
///
/// # Errors
/// Returns `BadInput` for files of another kind (compressed, an image, a web page), UTF-16, and bytes that are not UTF-8 or are NUL,
/// with the line.
pub fn decode(mut bytes: Vec<u8>, file: &Path, what: &str) -> Result<String> {
    if let Some(other) = of_other_kind(&bytes, file, what) {
        return Err(other.into());
    }
    if bytes.starts_with(BOM) {
        bytes.drain(..BOM.len());
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = line_of(e.as_bytes(), e.utf8_error().valid_up_to());
        BadInput::new("is not UTF-8 text").file(file).line(line).remedy("save the file as UTF-8")
    })?;
    if let Some(at) = text.find('\0') {
        return Err(BadInput::new("contains a NUL byte: it is binary or damaged")
            .file(file)
            .line(line_of(text.as_bytes(), at))
            .allowed(what)
            .remedy("export it again")
            .into());
    }
    // Only where no line ends otherwise: a quoted cell may hold a CR.
    Ok(if text.contains('\r') && !text.contains('\n') { text.replace('\r', "\n") } else { text })
}

/// Text of which only names are not ASCII, as of OBJ and STL: what is not UTF-8 is read as Latin-1, so that two names stay two.
pub fn with_names(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(BOM).unwrap_or(bytes);
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect()),
    };
    if text.contains('\r') && !text.contains('\n') { text.replace('\r', "\n").into() } else { text }
}

/// Reads the text of a regular file of at most `most` bytes.
///
/// # Errors
/// Returns the errors of [`input::read`] and [`decode`].
pub fn read(path: &Path, what: &str, most: u64) -> Result<String> {
    decode(input::read(path, what, most)?, path, what)
}

/// A line and its comment: a `#` at its beginning or after white space begins one.
pub fn split_comment(line: &str) -> (&str, Option<&str>) {
    let bytes = line.as_bytes();
    let begins = |i: &usize| bytes[*i] == b'#' && (*i == 0 || bytes[*i - 1].is_ascii_whitespace());
    match (0..bytes.len()).find(begins) {
        Some(at) => (&line[..at], Some(&line[at + 1..])),
        None => (line, None),
    }
}

/// A hint about a word that should be a number, where the mistake is a common one.
pub fn number_hint(word: &str) -> Option<&'static str> {
    let digits = |s: &str| s.bytes().any(|b| b.is_ascii_digit());
    match word {
        w if w.parse::<f64>().is_ok() => None,
        w if w.contains(',') && w.replace(',', ".").parse::<f64>().is_ok() => {
            Some("write the decimal mark as a point")
        }
        w if w.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && digits(w) => {
            let number = w.trim_end_matches(|c: char| !c.is_ascii_digit());
            number.parse::<f64>().is_ok().then_some("leave out the unit")
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_text_in_many_encodings() {
        let text = "a,b\n1,ä # c\n";
        let utf16 = |big: bool, mark: bool| -> Vec<u8> {
            let units = mark.then_some(0xfeff).into_iter().chain("a,b\n1,2\n".encode_utf16());
            units.flat_map(|u: u16| if big { u.to_be_bytes() } else { u.to_le_bytes() }).collect()
        };
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let with = |magic: &[u8]| [magic, &[0, 1, 2]].concat();
        // (bytes, text or a part of the error)
        let cases: [(&str, Vec<u8>, Result<&str, &str>); 14] = [
            ("plain", text.into(), Ok(text)),
            ("mark", format!("\u{feff}{text}").into(), Ok(text)),
            ("CRLF stays", text.replace('\n', "\r\n").into(), Ok("a,b\r\n1,ä # c\r\n")),
            ("CR alone", text.replace('\n', "\r").into(), Ok(text)),
            ("empty", Vec::new(), Ok("")),
            ("UTF-16 LE", utf16(false, true), Err("is UTF-16 text, not a CSV table; save it as UTF-8")),
            ("UTF-16 BE", utf16(true, true), Err("UTF-16")),
            ("UTF-16 without a mark", utf16(false, false), Err("UTF-16")),
            ("UTF-16 BE without a mark", utf16(true, false), Err("UTF-16")),
            ("Latin-1", latin, Err("a.csv:2: is not UTF-8 text; save the file as UTF-8")),
            ("NUL", b"a,b\n1,2\0\0".to_vec(), Err("a.csv:2: contains a NUL byte")),
            (
                "page",
                b"\r\n<!DOCTYPE HTML>\n".to_vec(),
                Err("is a web page (HTML), not a CSV table; download"),
            ),
            ("gzip", with(b"\x1f\x8b"), Err("is compressed (gzip), not a CSV table; unpack it first")),
            ("sheet", with(b"PK\x03\x04"), Err("save the sheet as CSV")),
        ];
        for (name, bytes, want) in cases {
            match (decode(bytes, Path::new("a.csv"), "a CSV table"), want) {
                (Ok(got), Ok(want)) => assert_eq!(got, want, "{name}"),
                (Err(e), Err(part)) => {
                    assert!(e.to_string().contains(part) && e.exit_code() == 2, "{name}: {e}");
                }
                (got, want) => panic!("{name}: {got:?}, not {want:?}"),
            }
        }
        assert_eq!(with_names(b"\xef\xbb\xbfo gr\xfcn\ro b"), "o grün\no b");
    }

    #[test]
    fn comments_begin_after_white_space() {
        for (line, want) in [
            ("# all", ("", Some(" all"))),
            ("  # all", ("  ", Some(" all"))),
            ("v 1 2 3 # top", ("v 1 2 3 ", Some(" top"))),
            ("v 1 2 3\t#", ("v 1 2 3\t", Some(""))),
            ("usemtl paint#2", ("usemtl paint#2", None)),
            ("ä#", ("ä#", None)),
            ("", ("", None)),
        ] {
            assert_eq!(split_comment(line), want);
        }
    }

    #[test]
    fn hints_name_common_mistakes() {
        for (word, hint) in [
            ("1,5", Some("point")),
            ("12ms", Some("unit")),
            ("-3.5 m", Some("unit")),
            ("car", None),
            ("nan", None),
            ("5", None),
            ("-", None),
            ("1.2.3", None),
        ] {
            assert_eq!(number_hint(word).is_some(), hint.is_some(), "{word}");
            assert!(hint.is_none_or(|h| number_hint(word).is_some_and(|n| n.contains(h))), "{word}");
        }
    }
}
