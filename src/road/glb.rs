//! A road scene as one binary glTF file, its labels in the extras of the asset, where other programs leave them
//! alone.

use crate::error::{BadInput, Error, Result};
use crate::road::labels::RoadTruth;
use crate::scene::{Scene, gltf};
use serde_json::{Value, json};

const HEAD: usize = 12;
const CHUNK: usize = 8;

/// `asset.extras.catseye.road_truth` of the file holds the labels.
///
/// # Errors
/// Those of [`gltf::to_glb`].
pub fn to_glb(scene: &Scene, truth: &RoadTruth) -> Result<Vec<u8>> {
    let failed = |what: String| Error::Failed(format!("cannot write glTF: {what}"));
    let plain = gltf::to_glb(scene)?;
    let (text, rest) = split(&plain).ok_or_else(|| failed("no JSON chunk".into()))?;
    let mut root: Value = serde_json::from_slice(text).map_err(|e| failed(e.to_string()))?;
    let truth = serde_json::to_value(truth).map_err(|e| failed(e.to_string()))?;
    root["asset"]["extras"] = json!({"catseye": {"road_truth": truth}});
    let mut text = serde_json::to_vec(&root).map_err(|e| failed(e.to_string()))?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = |n: usize| u32::try_from(n).map_err(|_| failed("more than 4 GiB".into()));
    let mut out = plain[..8].to_vec();
    out.extend(length(HEAD + CHUNK + text.len() + rest.len())?.to_le_bytes());
    out.extend(length(text.len())?.to_le_bytes());
    out.extend(b"JSON");
    out.extend(text);
    out.extend(rest);
    Ok(out)
}

/// The labels that [`to_glb`] wrote; None when the file has none.
///
/// # Errors
/// Labels of another shape.
pub fn truth_of(glb: &[u8]) -> Result<Option<RoadTruth>> {
    let Some((text, _)) = split(glb) else { return Ok(None) };
    let Ok(mut root) = serde_json::from_slice::<Value>(text) else { return Ok(None) };
    let Some(truth) = root.pointer_mut("/asset/extras/catseye/road_truth").map(Value::take) else {
        return Ok(None);
    };
    serde_json::from_value(truth).map(Some).map_err(|e| {
        BadInput::new(format!("are not the labels of a road scene: {e}"))
            .key("asset.extras.catseye.road_truth")
            .remedy("write the file again with catseye scene")
            .into()
    })
}

/// The JSON of a binary glTF file, and what follows it.
fn split(glb: &[u8]) -> Option<(&[u8], &[u8])> {
    let head = glb.get(..HEAD + CHUNK)?;
    let n = u32::from_le_bytes(head[HEAD..HEAD + 4].try_into().ok()?) as usize;
    (head.starts_with(b"glTF") && &head[HEAD + 4..] == b"JSON").then_some(())?;
    glb[HEAD + CHUNK..].split_at_checked(n)
}
