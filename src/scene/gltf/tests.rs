use super::material::GIVEN;
use super::*;
use crate::base::error::Result;
use crate::base::frames::Pose;
use crate::scene::backscatter::Backscatter;
use crate::scene::material::{self, Layer, Material, MaterialKind};
use crate::scene::{Mesh, Shape};
use glam::{DAffine3, DQuat, DVec3};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::collections::HashSet;

pub(super) fn encode(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |w, b| w << 8 | *b as u32) << (8 * (3 - chunk.len()));
        for k in 0..4 {
            let c = ALPHABET[(word >> (18 - 6 * k) & 63) as usize] as char;
            out.push(if k > chunk.len() { '=' } else { c });
        }
    }
    out
}

/// A document with one buffer view and accessor for each list.
fn document(floats: &[&[[f32; 3]]], indices: &[(u32, &[u32])]) -> Value {
    let mut bin: Vec<u8> = Vec::new();
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    for list in floats {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": list.len() * 12}));
        accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "type": "VEC3", "count": list.len()}));
        bin.extend(list.iter().flatten().flat_map(|x| x.to_le_bytes()));
    }
    for (component, list) in indices {
        let size = match component {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": list.len() * size}));
        accessors.push(json!({"bufferView": views.len() - 1, "componentType": component, "type": "SCALAR", "count": list.len()}));
        bin.extend(list.iter().flat_map(|x| x.to_le_bytes()[..size].to_vec()));
        bin.resize(bin.len().next_multiple_of(4), 0);
    }
    json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": bin.len(), "uri": format!("data:application/octet-stream;base64,{}", encode(&bin))}],
        "bufferViews": views, "accessors": accessors,
        "materials": [{"name": "steel"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "nodes": [{"mesh": 0, "name": "n"}],
    })
}

fn read_with(v: &Value, options: &ImportOptions) -> Result<Scene> {
    import_text(&v.to_string(), options)
}
pub(super) fn import_text(text: &str, options: &ImportOptions) -> Result<Scene> {
    import_bytes(text.as_bytes(), Path::new("t.gltf"), None, options)
}
fn read(v: &Value) -> Scene {
    read_with(v, &ImportOptions::default()).unwrap()
}
fn complaint(v: &Value) -> String {
    let e = read_with(v, &ImportOptions::default()).unwrap_err();
    assert_eq!(e.exit_code(), 2);
    let e = e.to_string();
    assert!(e.starts_with("t.gltf: ") && !e.contains('\n'), "{e}");
    e
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// World corners of every triangle, with its material's name.
pub(super) fn soup(s: &Scene) -> Vec<([DVec3; 3], String)> {
    let mut out = Vec::new();
    for o in &s.objects {
        let Shape::Mesh(m) = o.shape else { continue };
        let m = &s.meshes[m];
        for (t, k) in m.triangles.iter().zip(&m.material) {
            let corners = t.map(|c| o.pose.point(m.positions_m[c as usize]));
            out.push((corners, s.materials[*k as usize].name.clone()));
        }
    }
    out
}
fn area(t: &[DVec3; 3]) -> DVec3 {
    0.5 * (t[1] - t[0]).cross(t[2] - t[0])
}

#[test]
fn axes_unit_and_names() {
    let v = document(&[&[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [1.0, 4.0, 3.0]]], &[]);
    let s = read(&v);
    assert_eq!(s.meshes[0].positions_m[0], DVec3::new(3.0, 1.0, 2.0));
    assert_eq!((s.objects[0].name.as_str(), s.objects[0].id), ("n", 1));
    assert_eq!(s.import.triangles, 1);
    // The normal of glTF +Z is forward.
    assert_eq!(area(&soup(&s)[0].0), DVec3::new(1.0, 0.0, 0.0));
    let o = ImportOptions { unit_m: unit_m("mm").unwrap(), up: Up::Z, ..Default::default() };
    let s = read_with(&v, &o).unwrap();
    assert!((s.meshes[0].positions_m[0] - DVec3::new(0.001, 0.002, 0.003)).length() < 1e-12);
    assert!(unit_m("furlong").unwrap_err().to_string().contains("m, cm, mm, in, ft"));
}

#[test]
fn indices_of_every_kind_strips_and_fans() {
    let square: &[[f32; 3]] = &SQUARE;
    let strip: [[f32; 3]; 4] = [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]];
    for (component, mode, points, corners) in [
        (5121, 4, square, &[0u32, 1, 2, 0, 2, 3][..]),
        (5123, 4, square, &[0, 1, 2, 0, 2, 3]),
        (5125, 4, square, &[0, 1, 2, 0, 2, 3]),
        (5123, 5, square, &[0, 1, 3, 2]),
        (5125, 6, square, &[0, 1, 2, 3]),
        (0, 5, &strip[..], &[]),
        (0, 6, square, &[]),
    ] {
        let mut v = if component == 0 {
            document(&[points], &[])
        } else {
            document(&[points], &[(component, corners)])
        };
        let p = &mut v["meshes"][0]["primitives"][0];
        p["mode"] = json!(mode);
        if component != 0 {
            p["indices"] = json!(1);
        }
        let s = read(&v);
        let t = soup(&s);
        assert_eq!(t.len(), 2, "{component} {mode}");
        for (t, _) in &t {
            assert_eq!(area(t), DVec3::new(0.5, 0.0, 0.0), "{component} {mode}");
        }
        assert_eq!(s.meshes[0].positions_m.len(), 4);
    }
}

#[test]
fn stride_sparse_and_quantised_positions() {
    // Position and normal interleaved.
    let rows: Vec<[f32; 3]> = SQUARE[..3].iter().flat_map(|p| [*p, [9.0, 9.0, 9.0]]).collect();
    let mut v = document(&[&rows], &[]);
    v["bufferViews"][0]["byteStride"] = json!(24);
    v["accessors"][0]["count"] = json!(3);
    assert_eq!(area(&soup(&read(&v))[0].0), DVec3::new(0.5, 0.0, 0.0));

    // Corner 2 of the triangle is replaced; then all come from the replacement, over zeros.
    let mut v = document(&[&SQUARE[..3], &[[0.0, 2.0, 0.0]]], &[(5123, &[2])]);
    let sparse =
        json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 1}});
    v["accessors"][0]["sparse"] = sparse;
    assert_eq!(area(&soup(&read(&v))[0].0), DVec3::new(1.0, 0.0, 0.0));
    let mut v = document(&[&SQUARE[..3]], &[(5121, &[1, 2, 3])]);
    let a = &mut v["accessors"][0];
    a["count"] = json!(4);
    a.as_object_mut().unwrap().remove("bufferView");
    a["sparse"] =
        json!({"count": 3, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0}});
    v["meshes"][0]["primitives"][0]["mode"] = json!(5);
    // Vertices 0, S0 = 0, S1, S2: the first triangle has no area, the second is S0, S2, S1.
    let s = read(&v);
    assert_eq!(s.import.degenerate_triangles_dropped, 1);
    assert_eq!(area(&soup(&s)[0].0), DVec3::new(-0.5, 0.0, 0.0));

    // Bytes: 127 is 1 when normalised.
    let bytes: Vec<u32> = vec![0, 0, 0, 0, 127, 0, 0, 0, 127, 127, 0, 0];
    let mut v = document(&[], &[(5121, &bytes)]);
    v["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    v["bufferViews"][0]["byteStride"] = json!(4);
    v["accessors"][0] =
        json!({"bufferView": 0, "componentType": 5120, "normalized": true, "type": "VEC3", "count": 3});
    assert_eq!(area(&soup(&read(&v))[0].0), DVec3::new(0.5, 0.0, 0.0));
}

#[test]
fn hierarchy_scale_and_mirror() {
    let mut v = document(&[&SQUARE], &[(5123, &[0, 1, 2, 0, 2, 3])]);
    v["meshes"][0]["primitives"][0]["indices"] = json!(1);
    let h = std::f64::consts::FRAC_1_SQRT_2;
    // 90 degrees about glTF Y (up), that is a yaw of 90 degrees to the left.
    v["nodes"] = json!([
        {"children": [1, 2, 3], "rotation": [0, h, 0, h], "translation": [0, 0, 10.000000001]},
        {"mesh": 0, "name": "plain"},
        {"mesh": 0, "name": "twice", "scale": [2, 2, 2], "translation": [5, 0, 0]},
        {"mesh": 0, "name": "mirrored", "matrix": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]},
    ]);
    let s = read(&v);
    assert_eq!(s.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["plain", "twice", "mirrored"]);
    assert_eq!(s.meshes.len(), 3, "scaled and mirrored copies");
    let t = soup(&s);
    // +Z of glTF (forward) turned left is +y; the translation keeps its double precision.
    for (k, normal) in [(0, 0.5), (2, 2.0), (4, 0.5)] {
        assert!((area(&t[k].0) - DVec3::new(0.0, normal, 0.0)).length() < 1e-12, "{k} {:?}", t[k]);
    }
    assert_eq!(s.objects[0].pose.translation_m.x, 10.000000001);
    // glTF +X is left; turned left it points back.
    let at = s.objects[1].pose.translation_m;
    assert!((at - DVec3::new(10.000000001 - 5.0, 0.0, 0.0)).length() < 1e-12, "{at}");
    // Left of the node is behind it in the world; the mirrored one reaches to the other side.
    let reach = |k: usize| {
        let x: Vec<f64> = t[k..k + 2].iter().flat_map(|(c, _)| c.map(|p| p.x - 10.0)).collect();
        (x.iter().copied().fold(f64::INFINITY, f64::min), x.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    };
    assert!((reach(0).0 + 1.0).abs() < 1e-8 && reach(0).1.abs() < 1e-8, "{:?}", reach(0));
    assert!((reach(4).1 - 1.0).abs() < 1e-8 && reach(4).0.abs() < 1e-8, "{:?}", reach(4));
    for o in &s.objects {
        assert!((o.pose.rotation.length() - 1.0).abs() < 1e-12);
    }
}

/// A chain of arbitrary transforms gives the same points as the product of their 4x4 matrices.
fn transform() -> impl Strategy<Value = (Value, DAffine3)> {
    let v = || prop::array::uniform3(-3.0f64..3.0);
    (v(), prop::array::uniform4(-1.0f64..1.0), v(), prop::bool::ANY).prop_filter_map(
        "degenerate",
        |(t, q, s, scaled)| {
            let q = DQuat::from_array(q);
            if q.length() < 0.1 || s.iter().any(|x| x.abs() < 0.1) {
                return None;
            }
            let (q, s) = (q.normalize(), if scaled { s } else { [1.0; 3] });
            let m = DAffine3::from_scale_rotation_translation(s.into(), q, t.into());
            Some((json!({"translation": t, "rotation": q.to_array(), "scale": s}), m))
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn chains_of_nodes_are_matrix_products(chain in prop::collection::vec(transform(), 1..5)) {
        let mut v = document(&[&SQUARE[..3]], &[]);
        let mut product = DAffine3::IDENTITY;
        let mut nodes = Vec::new();
        for (i, (node, m)) in chain.iter().enumerate() {
            let mut node = node.clone();
            if i + 1 < chain.len() { node["children"] = json!([i + 1]); } else { node["mesh"] = json!(0); }
            nodes.push(node);
            product *= *m;
        }
        v["nodes"] = json!(nodes);
        let s = read(&v);
        let expected: Vec<DVec3> = SQUARE[..3].iter().map(|p| {
            let p = product.transform_point3(DVec3::new(p[0] as f64, p[1] as f64, p[2] as f64));
            DVec3::new(p.z, p.x, p.y)
        }).collect();
        let mut got = soup(&s)[0].0;
        if product.matrix3.determinant() < 0.0 {
            got.swap(1, 2);
        }
        // Rotations within 2e-6 of rigid are made rigid, so single-precision tolerance.
        for (a, b) in got.iter().zip(&expected) {
            prop_assert!((*a - *b).length() < 1e-5 * (1.0 + b.length()), "{a} {b}");
        }
    }
}

#[test]
fn instances_share_their_mesh() {
    let mut v = document(&[&SQUARE[..3], &[[0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [1.0, 0.0, 8.0]]], &[]);
    v["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    v["nodes"] = json!([
        {"mesh": 0, "name": "post", "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}},
        {"mesh": 0, "name": "other"},
    ]);
    let s = read(&v);
    assert_eq!((s.meshes.len(), s.objects.len()), (1, 4));
    assert_eq!(s.objects[2].name, "post 2");
    assert_eq!(s.objects[2].pose.translation_m, DVec3::new(8.0, 1.0, 0.0));
    let ids: HashSet<u32> = s.objects.iter().map(|o| o.id).collect();
    assert_eq!(ids.len(), 4);
}

#[test]
fn extras_of_nodes() {
    let mut v = document(&[&SQUARE[..3]], &[]);
    v["nodes"] = json!([
        {"children": [1, 2, 3], "extras": {"catseye": {"class": "car", "velocity_mps": [10, 0.5, 0]}, "other": 1}},
        {"mesh": 0, "extras": {"catseye": {"class": "wheel", "id": 1}}},
        {"mesh": 0},
        {"name": "lamp", "translation": [1, 2, 3], "extras": {"catseye": {"rcs_dbsm": -3.5, "id": 7}}},
    ]);
    let s = read(&v);
    let got: Vec<_> = s.objects.iter().map(|o| (o.id, o.class.as_str())).collect();
    assert_eq!(got, [(1, "wheel"), (2, "car"), (7, "car")]);
    assert!(s.objects.iter().all(|o| o.velocity_mps == DVec3::new(10.0, 0.5, 0.0)));
    assert_eq!(s.objects[2].shape, Shape::Point { rcs_dbsm: -3.5 });
    assert_eq!(s.objects[2].pose.translation_m, DVec3::new(3.0, 1.0, 2.0));
    for (extras, expect) in [
        (
            json!({"clas": "x"}),
            "nodes[0].extras.catseye.clas: unknown key; allowed: class, velocity_mps, id, rcs_dbsm, rcs_table, motion, radar; did you mean 'class'?",
        ),
        (json!({"id": 0}), "is not an id; allowed: 1..=4294967295"),
        (json!({"velocity_mps": [1, 2]}), "is not 3 numbers"),
        (json!({"velocity_mps": [1, 2, "3"]}), "is not 3 numbers"),
        (json!({"rcs_dbsm": 3}), "a mesh and rcs_dbsm exclude each other"),
        (json!({"radar": 0}), "is not true or false; allowed: true, false"),
        (json!({"class": 3}), "is not a class name"),
        (json!([]), "is not an object"),
    ] {
        v["nodes"] = json!([{"mesh": 0, "extras": {"catseye": extras}}]);
        let e = complaint(&v);
        assert!(e.contains(expect), "{e}");
    }
    v["nodes"] =
        json!([{"mesh": 0, "extras": {"catseye": {"id": 3}}}, {"mesh": 0, "extras": {"catseye": {"id": 3}}}]);
    assert!(complaint(&v).contains("nodes[1].extras.catseye.id = 3: another node has this id"));
}

#[test]
fn materials() {
    let mut v = document(&[&SQUARE[..3]], &[]);
    let given = |v: &Value| read(v).materials[0].clone();
    v["materials"] = json!([{"name": "steel.002"}]);
    assert_eq!(given(&v).name, "steel");
    v["materials"] = json!([{"name": "asphalt", "extras": {"catseye": {"roughness_rms_m": 0.0005}}}]);
    let m = given(&v);
    assert_eq!((m.roughness_rms_m, m.kind), (0.0005, material::by_name("asphalt").unwrap().kind));
    v["materials"] =
        json!([{"name": "mud", "extras": {"catseye": {"eps_r": [9, 2.5], "correlation_length_m": 0.01}}}]);
    let m = given(&v);
    let eps = m.eps_r(24e9).unwrap().unwrap();
    assert_eq!((eps.re, eps.im, m.correlation_length_m), (9.0, -2.5, 0.01));
    for (extras, expect) in [
        (json!({"eps_r": [3, -0.1]}), "eps_r = [3,-0.1]: eps'' is negative, which is gain"),
        (json!({"eps_r": [0, 0.1]}), "eps' is not positive"),
        (json!({"eps_r": 3}), "is not 2 numbers"),
        (json!({"eps": [3, 1]}), "materials[0].extras.catseye.eps: unknown key; allowed: like, eps_r"),
        (json!({"layers": []}), "does not state what 'mud' is made of"),
        (json!({"like": "steel", "layers": 3}), "extras.catseye.layers = 3: is not a list of layers"),
        (json!({"like": "steel", "layers": [{"material": "water"}]}), "layers[0].thickness_m: is missing"),
        (
            json!({"like": "steel", "layers": [{"material": "water", "thickness_m": -1}]}),
            "layers[0].thickness_m = -1: is not a number in range; allowed: 0.000000001..=10",
        ),
        (
            json!({"like": "steel", "layers": [{"material": "watre", "thickness_m": 1e-4}]}),
            "layers[0].material: no material is named 'watre'",
        ),
        (
            json!({"like": "steel", "layers": [{"material": "water", "thickness_m": 1e-4, "wet": 1}]}),
            "layers[0].wet: unknown key",
        ),
        (
            json!({"like": "steel", "layers": [{"material": "pec", "thickness_m": 1e-4}]}),
            "layers[0] = 0.0001: a perfect conductor hides the layers under it",
        ),
        (
            json!({"like": "steel", "layers": vec![json!({"material": "ice", "thickness_m": 1e-4}); 17]}),
            "too many layers; allowed: at most 16",
        ),
        (json!({"like": "stell"}), "did you mean 'steel'?"),
        (json!({"conductivity_s_per_m": -1}), "is not a number in range; allowed: 0..="),
        (json!({}), "does not state what 'mud' is made of"),
    ] {
        v["materials"] = json!([{"name": "mud", "extras": {"catseye": extras}}]);
        let e = complaint(&v);
        assert!(e.contains(expect), "{e}");
    }
    v["materials"] = json!([{"name": "Stahl"}]);
    let e = complaint(&v);
    assert!(
        e.contains("materials[0].name = Stahl: no material is named")
            && e.contains("asphalt")
            && e.contains("--default-material"),
        "{e}"
    );
    let mut o = ImportOptions { default_material: Some("copper".into()), ..Default::default() };
    let s = read_with(&v, &o).unwrap();
    assert_eq!(s.materials[0].name, "copper");
    assert!(s.import.notes[0].contains("'Stahl' is replaced by copper"));
    o.material_map = vec![("Stahl".into(), "steel".into())];
    assert_eq!(read_with(&v, &o).unwrap().materials[0].name, "steel");
    o.material_map = vec![("Stahll".into(), "steel".into())];
    assert!(read_with(&v, &o).unwrap_err().to_string().contains("did you mean 'Stahl'?"));
    o.material_map = vec![("Stahl".into(), "stee".into())];
    assert!(read_with(&v, &o).unwrap_err().to_string().contains("did you mean 'steel'?"));
    v["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    assert!(complaint(&v).contains("a surface has no material"));
    o.material_map.clear();
    assert_eq!(read_with(&v, &o).unwrap().materials[0].name, "copper");
}

#[test]
fn degenerate_triangles_are_dropped_and_counted() {
    let mut v = document(&[&SQUARE], &[(5123, &[0, 1, 2, 0, 0, 1, 0, 1, 1, 0, 2, 3])]);
    v["meshes"][0]["primitives"][0]["indices"] = json!(1);
    let s = read(&v);
    assert_eq!((s.import.triangles, s.import.degenerate_triangles_dropped), (2, 2));
    v["nodes"][0]["scale"] = json!([1, 0, 1]);
    assert!(complaint(&v).contains("the scene has no triangles (4 had no area) and no point targets"));
    v["nodes"][0] = json!({"mesh": 0});
    v["meshes"][0]["primitives"][0]["mode"] = json!(1);
    assert!(complaint(&v).contains("no triangles"));
}

fn example() -> Scene {
    let mut s = Scene::default();
    for name in ["steel", "asphalt", "water", "pec"] {
        s.materials.push(material::by_name(name).unwrap());
    }
    s.materials.push(Material {
        name: "mud".into(),
        kind: MaterialKind::Dielectric { eps_real: 9.5, eps_loss: 2.25, conductivity_s_per_m: 0.125 },
        roughness_rms_m: 0.001,
        correlation_length_m: 0.02,
        backscatter: Some(Backscatter::parse("gamma:-18.5,cross_db=-9").unwrap()),
        valid_hz: (76e9, 81e9),
        source: "a guess".into(),
        layers: Vec::new(),
    });
    let snow = Some(Backscatter::parse("kulemin:snow").unwrap());
    s.materials.push(Material { backscatter: snow, ..material::by_name("ice").unwrap() });
    s.materials.push(Material { name: "puddle".into(), ..material::by_name("water").unwrap() });
    s.materials.push(Material { roughness_rms_m: 0.0004, ..material::by_name("concrete").unwrap() });
    s.materials.push(material::parse_spec("air+glass:0.004").unwrap());
    let wet =
        Material { name: "wet paint".into(), ..material::parse_spec("steel+paint-white:0.0003").unwrap() };
    let brine = Material {
        name: "brine".into(),
        kind: MaterialKind::Dielectric { eps_real: 8.0, eps_loss: 15.0, conductivity_s_per_m: 5.0 },
        valid_hz: (70e9, 80e9),
        source: "a test".into(),
        ..Material::pec()
    };
    let mut layers = wet.layers.clone();
    layers.insert(0, Layer { material: brine, thickness_m: 1e-4 });
    layers.insert(
        0,
        Layer {
            material: Material { roughness_rms_m: 1e-4, ..material::by_name("ice").unwrap() },
            thickness_m: 2e-4,
        },
    );
    s.materials.push(wet.with_layers(layers).unwrap());
    s.materials.push(Material {
        name: "tin".into(),
        kind: MaterialKind::Conductor { conductivity_s_per_m: 8.7e6 },
        roughness_rms_m: 0.0,
        correlation_length_m: 0.0,
        backscatter: None,
        valid_hz: (0.0, f64::INFINITY),
        source: GIVEN.into(),
        layers: Vec::new(),
    });
    let n = s.materials.len() as u32;
    let points = (0..n + 2).map(|k| DVec3::new((k * k) as f64, k as f64, (k % 3) as f64 * 0.5)).collect();
    let triangles: Vec<[u32; 3]> = (0..n).map(|k| [k, k + 1, k + 2]).collect();
    let pose = Pose::from_yaw_pitch_roll(DVec3::new(12.345678901234, -3.5, 0.25), 0.7, -0.1, 0.05);
    let mesh = Mesh { positions_m: points, triangles, material: (0..n).collect(), normals: Vec::new() };
    let shared = s.add_mesh("body \"x\"", "car", mesh, pose);
    s.add_object("again", "", Shape::Mesh(0), Pose::IDENTITY, DVec3::new(1.0, -2.0, 0.5));
    s.add_object("lamp", "pole", Shape::Point { rcs_dbsm: -12.5 }, pose, DVec3::ZERO);
    s.objects[0].id = shared + 40;
    s
}

#[test]
fn export_reads_back_to_the_same_scene() {
    let a = example();
    let bytes = to_glb(&a).unwrap();
    let b = import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
    assert_eq!(a.materials, b.materials);
    assert_eq!(a.meshes, b.meshes, "these vertices are exact in single precision");
    assert_eq!(a.objects.len(), b.objects.len());
    for (x, y) in a.objects.iter().zip(&b.objects) {
        assert_eq!(
            (x.id, &x.name, &x.class, x.shape, x.velocity_mps),
            (y.id, &y.name, &y.class, y.shape, y.velocity_mps)
        );
        assert_eq!(x.pose.translation_m, y.pose.translation_m);
        let (p, q) = (x.pose.rotation, y.pose.rotation);
        assert!((p.dot(q).abs() - 1.0).abs() < 1e-15, "{p} {q}");
    }
    // And what is read writes the same bytes but for the last digit of rotations.
    let c = import_bytes(&to_glb(&b).unwrap(), Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
    assert_eq!(b.meshes, c.meshes);
}

#[test]
fn export_refuses_what_cannot_be_read() {
    let mut s = example();
    s.objects[0].pose.translation_m.x = f64::NAN;
    assert!(to_glb(&s).unwrap_err().to_string().contains("not finite"));
    let mut s = example();
    s.meshes[0].positions_m[1].z = 1e300;
    assert!(to_glb(&s).unwrap_err().to_string().contains("has a vertex at inf"));
    let mut s = example();
    s.meshes[0].triangles[0][0] = 99;
    assert!(to_glb(&s).is_err());
}
