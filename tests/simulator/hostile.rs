//! Files of meshes that are broken, absurd or hostile: each gives one line and exit code 2, none a panic,
//! a large allocation or a file from elsewhere.

use catseye::base::frames::Pose;
use catseye::scene::gltf::{self, ImportOptions, import, import_bytes};
use catseye::scene::{Mesh, Scene, Shape, material, mesh_file};
use glam::DVec3;
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::Path;

fn sheet() -> Scene {
    let mut s = Scene::default();
    s.materials.push(material::by_name("steel").unwrap());
    let positions_m = vec![DVec3::ZERO, DVec3::Y, DVec3::new(0.0, 1.0, 1.0), DVec3::Z];
    let mesh = Mesh {
        positions_m,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: vec![0, 0],
        ..Default::default()
    };
    s.add_mesh("sheet", "wall", mesh, Pose::IDENTITY);
    s.add_object("lamp", "", Shape::Point { rcs_dbsm: 1.0 }, Pose::IDENTITY, DVec3::X);
    s
}

fn glb() -> Vec<u8> {
    gltf::to_glb(&sheet()).unwrap()
}

/// JSON and binary part of a GLB.
fn parts(glb: &[u8]) -> (Value, Vec<u8>) {
    let n = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&glb[20..20 + n]).unwrap(), glb[28 + n..].to_vec())
}

fn join(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut text = json.to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + text.len() + bin.len()) as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(&text);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

fn read(bytes: &[u8]) -> catseye::Result<Scene> {
    import_bytes(bytes, Path::new("h.glb"), None, &ImportOptions::default())
}

fn complaint_of(bytes: &[u8]) -> String {
    let e = read(bytes).unwrap_err();
    assert_eq!(e.exit_code(), 2, "{e}");
    let e = e.to_string();
    assert!(e.starts_with("h.glb: ") && !e.contains('\n'), "{e}");
    e
}

/// The complaint about the file after one change of its JSON.
fn changed(change: impl FnOnce(&mut Value)) -> String {
    let (mut json, bin) = parts(&glb());
    change(&mut json);
    complaint_of(&join(json.to_string().as_bytes(), &bin))
}

#[test]
fn the_file_that_the_others_break_is_whole() {
    let (json, bin) = parts(&glb());
    let s = read(&join(json.to_string().as_bytes(), &bin)).unwrap();
    assert_eq!((s.triangle_count(), s.objects.len()), (2, 2));
}

#[test]
fn broken_containers() {
    let whole = glb();
    for (bytes, expect) in [
        (&b""[..], "the file is empty"),
        (b"hello", "is neither binary glTF"),
        (b"\x89PNG\r\n", "is a PNG image, not glTF"),
        (b"glTF", "is cut off after 4 bytes"),
        (b"glTF\x01\0\0\0\x0c\0\0\0", "of version 1, not 2"),
        (b"glTF\x02\0\0\0\x00\0\0\0", "without a JSON chunk"),
        (b"glTF\x02\0\0\0\x0c\0\0\0", "without a JSON chunk"),
        (&whole[..whole.len() - 1], "is cut off"),
        (&whole[..40], "is cut off"),
        (b"{", "is not glTF JSON: line 1 column 1"),
        (b"{}", "is not glTF JSON"),
        (b"[1, 2]", "is neither binary glTF"),
        (br#"{"asset": {"version": "1.0"}}"#, "asset.version = 1.0: is not glTF 2"),
        (br#"{"asset": {"version": "2.0"}}"#, "the scene has no triangles and no point targets"),
        (
            b"{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"translation\": [1e999, 0, 0]}]}",
            "is not glTF JSON",
        ),
    ] {
        let e = complaint_of(bytes);
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
    // Nested beyond reason.
    let deep = [b"{\"asset\":".to_vec(), b"[".repeat(100_000)].concat();
    assert!(complaint_of(&deep).contains("is not glTF JSON"));
}

#[test]
fn absurd_documents() {
    for (e, expect) in [
        (
            changed(|v| v["accessors"][0]["count"] = json!(1_000_000_000_000u64)),
            "1000000000000 elements need 12000000000000 bytes, but the buffer view holds 48",
        ),
        (changed(|v| v["accessors"][0]["count"] = json!(u64::MAX)), "elements need"),
        (changed(|v| v["accessors"][0]["byteOffset"] = json!(u64::MAX)), "elements need"),
        (
            changed(|v| {
                v["accessors"][0].as_object_mut().unwrap().remove("bufferView");
                v["accessors"][0]["count"] = json!(1_000_000_000_000u64)
            }),
            "claims elements that no bytes back",
        ),
        (changed(|v| v["accessors"][0]["componentType"] = json!(1)), "unknown component type"),
        (changed(|v| v["accessors"][0]["type"] = json!("VEC2")), "has elements of type Vec2; allowed: Vec3"),
        (changed(|v| v["accessors"][0]["bufferView"] = json!(9)), "is out of range; allowed: 0..="),
        (
            changed(|v| v["accessors"][1]["componentType"] = json!(5126)),
            "has components of type F32; allowed: U8, U16, U32",
        ),
        (changed(|v| v["accessors"][1]["count"] = json!(7)), "7 elements need 28 bytes"),
        (changed(|v| v["accessors"][0]["count"] = json!(3)), "index 5 points past the 3 vertices"),
        (changed(|v| v["bufferViews"][0]["byteLength"] = json!(1u64 << 60)), "lie outside the buffer"),
        (changed(|v| v["bufferViews"][0]["byteOffset"] = json!(u64::MAX)), "lie outside the buffer"),
        (changed(|v| v["bufferViews"][0]["byteStride"] = json!(8)), "is less than an element of 12 bytes"),
        (changed(|v| v["bufferViews"][0]["buffer"] = json!(3)), "bufferViews[0].buffer = 3: is out of range"),
        (changed(|v| v["buffers"][0]["byteLength"] = json!(1u64 << 50)), "the buffer holds only"),
        (
            changed(|v| v["buffers"] = json!([{"byteLength": 0}, {"byteLength": 4}])),
            "buffers[1]: has neither a URI nor a binary chunk",
        ),
        (
            changed(|v| v["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(77)),
            "is out of range",
        ),
        (changed(|v| v["meshes"][0]["primitives"][0]["indices"] = json!(77)), "is out of range"),
        (
            changed(|v| v["meshes"][0]["primitives"][0]["material"] = json!(77)),
            "primitives[0].material = 77: is out of range",
        ),
        (changed(|v| v["meshes"][0]["primitives"][0]["mode"] = json!(99)), "is not a primitive mode"),
        (changed(|v| v["nodes"][0]["mesh"] = json!(4)), "nodes[0].mesh = 4: is out of range; allowed: 0..=0"),
        (changed(|v| v["nodes"][0]["children"] = json!([9])), "nodes[0].children = 9: is out of range"),
        (changed(|v| v["nodes"][0]["children"] = json!([0])), "nodes[0]: is its own ancestor"),
        (
            changed(|v| {
                v["nodes"][0]["children"] = json!([1]);
                v["nodes"][1]["children"] = json!([0])
            }),
            "is its own ancestor",
        ),
        (changed(|v| v["nodes"][0]["children"] = json!([1])), "node 1 is in the scene twice"),
        (changed(|v| v["nodes"][0]["children"] = json!([1, 1])), "lists a child twice"),
        (
            changed(|v| {
                v["nodes"] = json!([{"children": [2]}, {"children": [2]}, {}]);
                v["scenes"] = json!([{"nodes": [0]}])
            }),
            "node 2 has two parents, 0 and 1",
        ),
        (changed(|v| v["scenes"][0]["nodes"] = json!([0, 8])), "scenes[0].nodes = 8: is out of range"),
        (changed(|v| v["scene"] = json!(5)), "scene = 5: is out of range"),
        (changed(|v| v["nodes"][0]["rotation"] = json!([0, 0, 0, 0])), "nodes[0].rotation"),
        (
            changed(|v| v["nodes"][0] = json!({"mesh": 0, "matrix": [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]})),
            "is not affine",
        ),
        (
            changed(|v| {
                v["nodes"][0] =
                    json!({"mesh": 0, "scale": [1, 1, 1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]})
            }),
            "has a matrix and translation, rotation or scale",
        ),
        (changed(|v| v["nodes"][0]["translation"] = json!([1e300, 0, 0])), "number out of range"),
        (
            changed(|v| v["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])),
            "requires the extension KHR_draco_mesh_compression",
        ),
        (changed(|v| v["materials"][0]["name"] = json!("line\nbreak")), "no material is named"),
        (
            changed(|v| {
                v["nodes"] = json!([]);
                v["scenes"][0]["nodes"] = json!([])
            }),
            "no triangles and no point targets",
        ),
    ] {
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
}

#[test]
fn positions_that_are_not_numbers() {
    let (json, bin) = parts(&glb());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        let mut bin = bin.clone();
        bin[16..20].copy_from_slice(&bad.to_le_bytes());
        let e = complaint_of(&join(json.to_string().as_bytes(), &bin));
        assert!(
            e.contains("meshes[0].primitives[0].attributes.POSITION")
                && e.contains("vertex 1 is not a finite position"),
            "{e}"
        );
    }
}

/// Repetition must not multiply memory without bound.
#[test]
fn a_small_file_cannot_claim_a_large_scene() {
    let (mut v, bin) = parts(&glb());
    // Four million corners that no bytes back, in a hundred primitives of their own positions.
    let n = 1 << 22;
    let many: Vec<Value> =
        (0..100).map(|_| json!({"componentType": 5126, "type": "VEC3", "count": n})).collect();
    let primitives: Vec<Value> =
        (0..100).map(|k| json!({"attributes": {"POSITION": k}, "material": 0})).collect();
    v["accessors"] = json!(many);
    v["meshes"][0]["primitives"] = json!(primitives);
    let e = complaint_of(&join(v.to_string().as_bytes(), &bin));
    assert!(e.contains("too many vertices; allowed: up to 50000000 in all"), "{e}");
}

#[test]
fn buffers_come_only_from_the_folder() {
    let dir = tempfile::tempdir().unwrap();
    let inside = dir.path().join("inside");
    std::fs::create_dir_all(inside.join("sub dir")).unwrap();
    let (mut v, bin) = parts(&glb());
    std::fs::write(dir.path().join("secret.bin"), &bin).unwrap();
    std::fs::write(inside.join("b.bin"), &bin).unwrap();
    std::fs::write(inside.join("sub dir/b.bin"), &bin).unwrap();
    std::fs::write(inside.join("short.bin"), &bin[..8]).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(dir.path().join("secret.bin"), inside.join("link.bin")).unwrap();
    let path = inside.join("m.gltf");
    let mut attempt = |uri: &str| {
        v["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, v.to_string()).unwrap();
        import(&path, &ImportOptions::default()).map(|s| s.triangle_count()).map_err(|e| {
            assert_eq!(e.exit_code(), 2, "{e}");
            e.to_string()
        })
    };
    assert_eq!(attempt("b.bin"), Ok(2));
    assert_eq!(attempt("./sub%20dir/b.bin"), Ok(2));
    let absolute = dir.path().join("secret.bin");
    for (uri, expect) in [
        ("../secret.bin", "leaves the folder"),
        ("sub dir/../../secret.bin", "leaves the folder"),
        ("%2e%2e/secret.bin", "leaves the folder"),
        ("..%2fsecret.bin", "leaves the folder"),
        ("..\\secret.bin", "leaves the folder"),
        (absolute.to_str().unwrap(), "leaves the folder"),
        ("file:///etc/passwd", "leaves the folder"),
        ("https://example.org/b.bin", "leaves the folder"),
        ("C:/b.bin", "leaves the folder"),
        ("b.bin%00", "leaves the folder"),
        ("", "leaves the folder"),
        ("b.bin%zz", "the file is missing"),
        ("gone.bin", "the file is missing"),
        ("sub dir", "is not a file"),
        ("short.bin", "the buffer holds only 8 bytes"),
        ("data:application/octet-stream;base64,AA*A", "is not base64"),
        ("data:text/plain,hello", "is a data URI without base64"),
        ("data:;base64,AAAA", "the buffer holds only 3 bytes"),
        #[cfg(unix)]
        ("link.bin", "leaves the folder"),
    ] {
        let e = attempt(uri).unwrap_err();
        assert!(
            e.contains(expect) && e.contains("m.gltf:") && e.contains(": buffers[0]") && !e.contains('\n'),
            "{uri}: {e}"
        );
    }
    // Bytes alone have no folder.
    let mut v = parts(&glb()).0;
    v["buffers"][0]["uri"] = json!("b.bin");
    assert!(complaint_of(v.to_string().as_bytes()).contains("no folder in which to look"));
    let e = import(dir.path(), &ImportOptions::default()).unwrap_err();
    assert!(e.to_string().ends_with("is a directory; give a .glb or .gltf file"), "{e}");
    let e = import(&dir.path().join("gone.glb"), &ImportOptions::default()).unwrap_err();
    assert!(e.to_string().contains("no such file") && e.exit_code() == 2);
}

#[test]
fn scattering_tables_of_nodes() {
    let dir = tempfile::tempdir().unwrap();
    let head = "frequency_hz,azimuth_deg,elevation_deg,vv_dbsm,vh_dbsm,hv_dbsm,hh_dbsm,\
                vv_re_m,vv_im_m,vh_re_m,vh_im_m,hv_re_m,hv_im_m,hh_re_m,hh_im_m\n";
    let write =
        |name: &str, text: &str| std::fs::write(dir.path().join(name), format!("{head}{text}")).unwrap();
    write("good.csv", "77e9,0,0,,,,,1,0,0,0,0,0,1,0\n");
    write("twice.csv", &"77e9,0,0,,,,,1,0,0,0,0,0,1,0\n".repeat(2));
    write("nan.csv", "77e9,0,0,,,,,NaN,0,0,0,0,0,1,0\n");
    write("empty.csv", "");
    std::fs::write(dir.path().join("binary.csv"), [0xff, 0xfe, 0x00]).unwrap();
    let node = |extras: Value, more: Value| {
        let (mut v, bin) = parts(&glb());
        // The material is unknown: of a mesh that does not scatter it does not matter.
        v["materials"][0] = json!({"name": "unobtainium"});
        v["nodes"][0]["extras"]["catseye"] = extras;
        for (k, x) in more.as_object().unwrap() {
            v["nodes"][0][k] = x.clone();
        }
        let bytes = join(v.to_string().as_bytes(), &bin);
        import_bytes(&bytes, Path::new("h.glb"), Some(dir.path()), &ImportOptions::default())
    };
    let s = node(json!({"rcs_table": "good.csv", "id": 9}), json!({"translation": [1, 2, 3]})).unwrap();
    assert_eq!((s.objects[0].shape, s.objects[0].id, s.triangle_count()), (Shape::Table(0), 9, 0));
    assert_eq!(s.objects[0].pose.translation_m, DVec3::new(3.0, 1.0, 2.0));
    assert!(s.import.notes.iter().any(|n| n.contains("its mesh does not")), "{:?}", s.import.notes);
    for (extras, more, expect) in [
        (json!({"rcs_table": 3}), json!({}), "is not the path of a file"),
        (json!({"rcs_table": "gone.csv"}), json!({}), "the file is missing"),
        (json!({"rcs_table": "../good.csv"}), json!({}), "leaves the folder"),
        (json!({"rcs_table": "/etc/passwd"}), json!({}), "leaves the folder"),
        (json!({"rcs_table": "."}), json!({}), "is not a file"),
        (json!({"rcs_table": "twice.csv"}), json!({}), "twice.csv:3: azimuth 0 deg"),
        (json!({"rcs_table": "nan.csv"}), json!({}), "nan.csv:2: vv_re_m = NaN"),
        (json!({"rcs_table": "empty.csv"}), json!({}), "the table has no rows"),
        (json!({"rcs_table": "binary.csv"}), json!({}), "is UTF-16 text, not a CSV table"),
        (json!({"rcs_table": "good.csv"}), json!({"scale": [2, 1, 1]}), "is scaled or mirrored"),
        (json!({"rcs_table": "good.csv"}), json!({"scale": [-1, 1, 1]}), "is scaled or mirrored"),
        (json!({"rcs_table": "good.csv", "rcs_dbsm": 1}), json!({}), "rcs_dbsm"),
    ] {
        let e = node(extras, more).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert!(e.to_string().contains(expect) && !e.to_string().contains('\n'), "{e}\n not {expect}");
    }
    // Bytes alone have no folder.
    let (mut v, bin) = parts(&glb());
    v["nodes"][0]["extras"]["catseye"] = json!({"rcs_table": "good.csv"});
    assert!(complaint_of(&join(v.to_string().as_bytes(), &bin)).contains("no folder in which to look"));
}

/// A value that stands for anything in a JSON document.
fn hostile_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(json!(null)),
        Just(json!(-1)),
        Just(json!(0)),
        Just(json!(1)),
        Just(json!(4294967295u32)),
        Just(json!(4294967296u64)),
        Just(json!(u64::MAX)),
        Just(json!(1e308)),
        Just(json!(-0.5)),
        Just(json!("x")),
        Just(json!([])),
        Just(json!({})),
        Just(json!([0, 0, 0])),
        Just(json!([0, 0, 0, 0])),
        Just(
            json!({"count": 3, "indices": {"bufferView": 1, "componentType": 5125}, "values": {"bufferView": 0}})
        ),
        Just(json!({"catseye": {"id": 1}})),
        (0u64..9).prop_map(|n| json!(n)),
    ]
}

/// The `k`-th value of the document, counted depth first.
fn nth<'a>(v: &'a mut Value, k: &mut usize) -> Option<&'a mut Value> {
    if *k == 0 {
        return Some(v);
    }
    *k -= 1;
    match v {
        Value::Array(a) => a.iter_mut().find_map(|x| nth(x, k)),
        Value::Object(o) => o.values_mut().find_map(|x| nth(x, k)),
        _ => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn flipped_and_cut_bytes_never_panic(flips in prop::collection::vec((0usize..2000, any::<u8>()), 1..8), cut in 0usize..2500) {
        let mut bytes = glb();
        let n = bytes.len();
        for (at, with) in flips {
            bytes[at % n] = with;
        }
        bytes.truncate(cut.max(1));
        if let Err(e) = read(&bytes) {
            prop_assert!(!e.to_string().contains('\n'), "{}", e);
        }
    }

    #[test]
    fn changed_values_never_panic(changes in prop::collection::vec((0usize..120, hostile_value()), 1..5)) {
        let (mut v, bin) = parts(&glb());
        for (k, with) in changes {
            let mut k = k;
            if let Some(place) = nth(&mut v, &mut k) {
                *place = with;
            }
        }
        if let Err(e) = read(&join(v.to_string().as_bytes(), &bin)) {
            prop_assert!(!e.to_string().contains('\n'), "{}", e);
        }
    }

    #[test]
    fn added_keys_never_panic(place in 0usize..120, key in prop_oneof![Just("sparse"), Just("byteStride"), Just("byteOffset"),
        Just("children"), Just("matrix"), Just("scale"), Just("extras"), Just("uri"), Just("normalized"), Just("mode"), Just("extensions")],
        with in hostile_value())
    {
        let (mut v, bin) = parts(&glb());
        let mut k = place;
        if let Some(Value::Object(o)) = nth(&mut v, &mut k) {
            o.insert(key.into(), with);
        }
        if let Err(e) = read(&join(v.to_string().as_bytes(), &bin)) {
            prop_assert!(!e.to_string().contains('\n'), "{}", e);
        }
    }
}

/// What a file of this name with these bytes is read as, in millimetres with z up.
fn mesh_of(name: &str, bytes: &[u8]) -> Result<Scene, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let options = ImportOptions {
        unit_m: 1e-3,
        unit_given: true,
        up: gltf::Up::Z,
        up_given: true,
        default_material: name.ends_with(".stl").then(|| "steel".into()),
        ..Default::default()
    };
    mesh_file::import(&path, &options).map_err(|e| {
        assert_eq!(e.exit_code(), 2, "{e}");
        let e = e.to_string();
        assert!(e.contains(name) && !e.contains('\n'), "{e}");
        e
    })
}

fn binary_stl(head: &str, count: u32, corners: &[[f32; 9]]) -> Vec<u8> {
    let mut out = head.as_bytes().to_vec();
    out.resize(80, 0);
    out.extend(count.to_le_bytes());
    for facet in corners {
        out.extend([0; 12]);
        out.extend(facet.iter().flat_map(|x| x.to_le_bytes()));
        out.extend([0, 0]);
    }
    out
}

#[test]
fn stl_is_read_whole_or_refused() {
    let square =
        [[0.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 5.0, 5.0], [0.0, 0.0, 0.0, 0.0, 5.0, 5.0, 0.0, 0.0, 5.0]];
    // A binary file may begin like an ASCII one.
    for head in ["", "solid of a CAD program"] {
        let s = mesh_of("a.stl", &binary_stl(head, 2, &square)).unwrap();
        assert_eq!((s.triangle_count(), s.meshes[0].positions_m.len()), (2, 4), "equal vertices are one");
        assert_eq!(s.bounds_m(0.0).unwrap().1, DVec3::new(0.0, 5e-3, 5e-3));
        assert_eq!((s.materials[0].name.as_str(), s.objects[0].name.as_str()), ("steel", "a"));
    }
    let text = "Solid lid\r\n facet normal 1 0 0\r\n outer loop\r\n vertex 0 0 0\r\n vertex 0 5 0\r\n VERTEX 0 0 5e0\r\n \
                endloop\r\n endfacet\r\nendsolid lid\r\n";
    let s = mesh_of("a.stl", text.as_bytes()).unwrap();
    assert_eq!((s.triangle_count(), s.objects[0].name.as_str()), (1, "lid"));
    let two = mesh_of("a.stl", format!("{text}{}", text.replace(" lid", " box")).as_bytes()).unwrap();
    assert_eq!(two.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["lid", "box"]);

    let mut nan = square;
    nan[1][4] = f32::NAN;
    let whole = binary_stl("", 2, &square);
    let longer = [&whole[..], &[1; 7]].concat();
    for (bytes, expect) in [
        (Vec::new(), "the file is empty"),
        (whole[..whole.len() - 1].to_vec(), "2 triangles are 184 bytes, and the file has 183"),
        (longer, "2 triangles, and 7 bytes follow them, no whole triangles"),
        (binary_stl("", u32::MAX, &square), "4294967295, was never filled in"),
        (binary_stl("solid", u32::MAX, &square), "4294967295, was never filled in"),
        (binary_stl("", 0, &[]), "the file has no triangles"),
        (binary_stl("", 2, &nan), "facet 1 has a vertex that is not finite"),
        (binary_stl("", 1, &[[1.0; 9]]), "no triangles (1 had no area)"),
        (vec![0; 50], "is not STL"),
        (b"root:x:0".to_vec(), "is not STL"),
        (text.as_bytes()[..100].to_vec(), "is cut off"),
        (text.replace("0 5 0", "0 nan 0").into(), "a.stl:5: nan: a vertex is not three finite numbers"),
        (text.replace("0 5 0", "0 5").into(), "a.stl:5: VERTEX: a vertex is not three finite numbers"),
        (text.replace(" vertex 0 5 0\r\n", "").into(), "a.stl:7: a facet has fewer than three vertices"),
        (text.replace("outer loop", "vertex 1 2 3").into(), "a.stl:6: a facet has more than three vertices"),
        (
            text.replace("outer", "inner").into(),
            "a.stl:3: inner: is not a keyword of ASCII STL at this point",
        ),
        (b"solid x\nendsolid x\n".to_vec(), "the file has no triangles"),
    ] {
        let e = mesh_of("a.stl", &bytes).unwrap_err();
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
}

#[test]
fn obj_is_read_whole_or_refused() {
    let square = "mtllib gone.mtl\nv 0 0 0\nv 0 5 0 1\nv 0 5 5 0.1 0.2 0.3\nv 0 0 5\nvn 1 0 0\nvt 0 0\n";
    let area = |s: &Scene| -> f64 {
        let m = |o: &catseye::scene::Object| match o.shape {
            Shape::Mesh(m) => &s.meshes[m],
            _ => panic!("{o:?}"),
        };
        let of = |m: &Mesh| -> f64 {
            let p = |i: u32| m.positions_m[i as usize];
            m.triangles.iter().map(|t| (p(t[1]) - p(t[0])).cross(p(t[2]) - p(t[0])).x / 2.0).sum()
        };
        s.objects.iter().map(|o| of(m(o))).sum()
    };
    for faces in [
        "f 1 2 3 4",
        "f -4 -3 -2 -1",
        "f 1/1/1 2/1/1 3/1/1 4/1/1",
        "f 1//1 2//1 3//1 4//1",
        "f 1 2 3\nf 1/ 3/ 4/",
        "g a b\ns off\nf 1 2 \\\n3 4",
        "o one\nf 1 2 3\no two\nf 1 3 4",
    ] {
        let s = mesh_of("a.obj", format!("{square}usemtl steel\n{faces}\n").as_bytes()).unwrap();
        assert!(s.triangle_count() == 2 && (area(&s) - 25e-6).abs() < 1e-15, "{faces}");
        assert_eq!(s.materials[0].name, "steel");
    }
    let two = format!("{square}usemtl steel\no one\nf 1 2 3\no two\nusemtl concrete\nf 1 3 4\nl 1 2\n");
    let s = mesh_of("a.obj", two.as_bytes()).unwrap();
    assert_eq!(s.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["one", "two"]);
    assert_eq!((s.materials.len(), s.meshes[1].material[0], s.import.notes.len()), (2, 1, 1));
    // A hollow polygon is not filled.
    let ell = "v 0 0 0\nv 0 2 0\nv 0 2 1\nv 0 1 1\nv 0 1 2\nv 0 0 2\nusemtl steel\nf 2 3 4 5 6 1\n";
    assert!((area(&mesh_of("a.obj", ell.as_bytes()).unwrap()) - 3e-6).abs() < 1e-15);
    for (faces, expect) in [
        ("", "the file has no triangles"),
        ("usemtl steel\nf 1 2 9", "a.obj:9: f = 9: is not the index of a vertex; allowed: 1..=4, or -4..=-1"),
        ("f 0 1 2", "f = 0: is not the index of a vertex"),
        ("f -5 1 2", "f = -5: is not the index"),
        ("f -9223372036854775808 1 2", "is not the index"),
        ("f 1 2 99999999999999999999", "is not the index"),
        ("f 1//2 2//1 3//1", "is not the index of a normal; allowed: 1..=1"),
        ("f 1 2", "a face has fewer than three corners"),
        ("f 1 x 2", "f = x: is not the index"),
        ("v nan 0 0", "a.obj:8: v = nan: is not three finite numbers"),
        ("vn 1 inf 0", "vn = inf: is not three finite numbers"),
        ("v 1 2", "v = 1 2: is not three finite numbers"),
        ("surf 0 1 0 1 1 2 3", "surf: freeform curves and surfaces are not supported"),
        ("root:x:0:0", "a.obj:8: is not a line of an OBJ file; allowed: v"),
        ("usemtl nonsense\nf 1 2 3", "usemtl = nonsense: no material is named"),
        ("f 1 2 3", "a surface has no material"),
        ("v 1e300 0 0\nusemtl steel\nf 1 2 5", "is not a finite position"),
        ("f 1 1 1", "no triangles (1 had no area)"),
    ] {
        let e = mesh_of("a.obj", format!("{square}{faces}\n").as_bytes()).unwrap_err();
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
    assert!(mesh_of("a.obj", b"f 1 2 3\n").unwrap_err().contains("none before this line"));
    assert!(mesh_of("a.obj", b"").unwrap_err().contains("the file is empty"));
}
