//! A road scene as one binary glTF file, its labels in the extras of the asset, where other programs leave them
//! alone.

use crate::base::error::{BadInput, Error, Result};
use crate::road::labels::RoadTruth;
use crate::scene::{Scene, gltf};
use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Value, json};

const HEAD: usize = 12;
const CHUNK: usize = 8;

/// Writes a scene as binary glTF, with the labels in `asset.extras.catseye.road_truth` of the file.
///
/// # Errors
/// Returns the errors of [`gltf::to_glb`].
pub fn to_glb(scene: &Scene, truth: &RoadTruth) -> Result<Vec<u8>> {
    let failed = |what: String| Error::Failed(format!("cannot write glTF: {what}"));
    let plain = gltf::to_glb(scene)?;
    let (text, rest) = split(&plain).ok_or_else(|| failed("no JSON chunk".into()))?;
    let mut root: Value = serde_json::from_slice(text).map_err(|e| failed(e.to_string()))?;
    root["asset"]["extras"] = json!({"catseye": {"road_truth": null}});
    let root = serde_json::to_vec(&root).map_err(|e| failed(e.to_string()))?;
    // Labels go in as text: a tree of JSON values takes ten times as much memory as they do. No name can look like this place, for
    // quotes within a name are escaped.
    let (before, after) = halves(&root, b"\"road_truth\":null").ok_or_else(|| failed("no extras".into()))?;
    let mut text = before.to_vec();
    text.extend(b"\"road_truth\":");
    serde_json::to_writer(&mut text, truth).map_err(|e| failed(e.to_string()))?;
    text.extend(after);
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = |n: usize| u32::try_from(n).map_err(|_| failed("more than 4 GiB".into()));
    let mut out = Vec::with_capacity(HEAD + CHUNK + text.len() + rest.len());
    out.extend(&plain[..8]);
    out.extend(length(HEAD + CHUNK + text.len() + rest.len())?.to_le_bytes());
    out.extend(length(text.len())?.to_le_bytes());
    out.extend(b"JSON");
    out.extend(text);
    out.extend(rest);
    Ok(out)
}

/// What lies before and behind the first place where `bytes` hold `part`.
fn halves<'a>(bytes: &'a [u8], part: &[u8]) -> Option<(&'a [u8], &'a [u8])> {
    let at = bytes.windows(part.len()).position(|w| w == part)?;
    Some((&bytes[..at], &bytes[at + part.len()..]))
}

/// The labels that [`to_glb`] wrote; None when the file has none.
///
/// # Errors
/// Returns an error if the file has labels of another shape.
pub fn truth_of(glb: &[u8]) -> Result<Option<RoadTruth>> {
    let Some((text, _)) = split(glb) else { return Ok(None) };
    // The way to the labels; whatever else the file holds is passed over and not kept.
    #[derive(Deserialize)]
    struct Root<'a> {
        #[serde(borrow)]
        asset: Asset<'a>,
    }
    #[derive(Deserialize)]
    struct Asset<'a> {
        #[serde(borrow)]
        extras: Extras<'a>,
    }
    #[derive(Deserialize)]
    struct Extras<'a> {
        #[serde(borrow)]
        catseye: Ours<'a>,
    }
    #[derive(Deserialize)]
    struct Ours<'a> {
        #[serde(borrow)]
        road_truth: &'a RawValue,
    }
    let Ok(root) = serde_json::from_slice::<Root>(text) else { return Ok(None) };
    serde_json::from_str(root.asset.extras.catseye.road_truth.get()).map(Some).map_err(|e| {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::scene::Mesh;
    use glam::DVec3;

    /// The labels come back whole and as text in their place, whatever names hold: no other place looks like theirs.
    #[test]
    fn labels_are_written_in_their_place_whatever_names_hold() {
        let hostile = "\"road_truth\":null, \\\"road_truth\\\":null ä";
        let mut scene = Scene::default();
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let material = scene.material_index(&crate::scene::material::by_name("asphalt").unwrap());
        let mesh = Mesh {
            positions_m: corners.to_vec(),
            triangles: vec![[0, 1, 2]],
            material: vec![material],
            ..Mesh::default()
        };
        scene.add_mesh(hostile, hostile, mesh, Pose::IDENTITY);
        let truth = RoadTruth { name: hostile.into(), ..RoadTruth::default() };
        let made = to_glb(&scene, &truth).unwrap();
        assert_eq!(truth_of(&made).unwrap(), Some(truth.clone()));
        let (text, _) = split(&made).unwrap();
        // As a tree of values would be written.
        let root: Value = serde_json::from_slice(text).unwrap();
        assert_eq!(root["asset"]["extras"]["catseye"]["road_truth"], serde_json::to_value(&truth).unwrap());
        assert_eq!(std::str::from_utf8(text).unwrap().trim_end(), serde_json::to_string(&root).unwrap());
        // A file without labels, and one whose labels are none.
        assert_eq!(truth_of(&gltf::to_glb(&scene).unwrap()).unwrap(), None);
        let wrong = String::from_utf8_lossy(text).replacen("\"marker_rows\":[]", "\"marker_rows\":71", 1);
        let mut glb = made.clone();
        glb[HEAD + CHUNK..][..text.len()].copy_from_slice(wrong.as_bytes());
        assert!(truth_of(&glb).unwrap_err().to_string().contains("road_truth: are not the labels"));
    }
}
