//! Bytes of a file and of what lies beside it.

use crate::base::error::{BadInput, Error, Result};
use crate::formats::input;
use crate::scene::toml_file::clip;
use std::path::{Component, Path, PathBuf};

/// JSON and binary chunk; plain JSON is returned as it is.
pub(super) fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    const HEADER: usize = 12;
    if !bytes.starts_with(b"glTF") {
        // A byte-order mark is allowed by some writers.
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return match text.trim_ascii_start().first() {
            Some(b'{') => Ok((text, None)),
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
    // Not all exporters escape a per cent: where there is no file of the decoded name, that of the name as it is.
    let decoded = percent_decoded(uri).unwrap_or_else(|| uri.into());
    let mut path = PathBuf::new();
    for name in [&*decoded, uri] {
        let relative = Path::new(name);
        let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if name.is_empty() || name.contains([':', '\\', '\0']) || !inside {
            return Err(outside().into());
        }
        let Some(folder) = folder else {
            return Err(bad("names a file, but there is no folder in which to look for it".into())
                .remedy("give a .glb file")
                .into());
        };
        path = folder.join(relative);
        if path.exists() {
            break;
        }
    }
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
    let folder = folder.unwrap_or(Path::new(""));
    let real_folder = folder.canonicalize().map_err(|e| Error::io(folder, e))?;
    if !real.starts_with(&real_folder) {
        return Err(outside().into());
    }
    if !real.is_file() {
        return Err(bad("is not a file".into()).remedy("put it beside the .gltf file").into());
    }
    Ok(real)
}

/// The text with each `%` and two hexadecimal digits replaced by their byte; any other `%` stays. None where that is not UTF-8.
pub(super) fn percent_decoded(s: &str) -> Option<String> {
    let bytes = s.as_bytes();
    let digit = |i: usize| bytes.get(i).and_then(|b| char::from(*b).to_digit(16));
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(b) = bytes.get(at) {
        match (digit(at + 1), digit(at + 2)) {
            (Some(high), Some(low)) if *b == b'%' => {
                out.push((high * 16 + low) as u8);
                at += 3;
            }
            _ => {
                out.push(*b);
                at += 1;
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_buffers_with_per_cents() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("m.gltf");
        std::fs::create_dir(dir.path().join("sub")).unwrap();
        for name in
            ["a b.bin", "100%.bin", "50%25.bin", "c%20d.bin", "sub/%.bin", "%zz%", "both.bin", "bo%74h.bin"]
        {
            std::fs::write(dir.path().join(name), name).unwrap();
        }
        for (uri, name) in [
            ("a%20b.bin", "a b.bin"),
            ("a b.bin", "a b.bin"),
            ("100%.bin", "100%.bin"),
            ("100%25.bin", "100%.bin"),
            ("50%2525.bin", "50%25.bin"),
            ("50%25.bin", "50%25.bin"),
            ("c%20d.bin", "c%20d.bin"),
            ("sub/%.bin", "sub/%.bin"),
            ("sub%2F%.bin", "sub/%.bin"),
            ("%zz%", "%zz%"),
            // The specification escapes names: the decoded one comes first.
            ("bo%74h.bin", "both.bin"),
        ] {
            let found = load_uri(&file, Some(dir.path()), 0, uri).unwrap();
            assert_eq!(String::from_utf8(found).unwrap(), name, "{uri}");
        }
        for (uri, part) in [
            ("gone%.bin", "the file is missing"),
            ("gone%20.bin", "the file is missing"),
            ("%ff.bin", "the file is missing"),
            ("%2e%2e/m.bin", "leaves the folder"),
            ("..%/../m.bin", "leaves the folder"),
            ("a%00", "leaves the folder"),
            ("sub%", "the file is missing"),
        ] {
            let e = load_uri(&file, Some(dir.path()), 0, uri).unwrap_err();
            assert!(e.to_string().contains(part) && e.exit_code() == 2, "{uri}: {e}");
        }
    }
}
