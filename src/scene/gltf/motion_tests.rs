//! Animations, skins and motions, against brute force in the file's own axes.

use super::tests::{encode, import_text, soup};
use super::*;
use crate::base::frames::Pose;
use crate::scene::motion::{Channel, Interpolation, Joint, Motion};
use crate::scene::turn::Turn;
use crate::scene::{Mesh, Object, Shape, material};
use glam::{DAffine3, DQuat, DVec3};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::sync::Arc;

/// A document that grows accessor by accessor.
struct Doc {
    v: Value,
    bin: Vec<u8>,
}

impl Doc {
    /// With one triangle as mesh 0, no nodes.
    fn new(corners: &[[f32; 3]]) -> Doc {
        let v = json!({
            "asset": {"version": "2.0"}, "bufferViews": [], "accessors": [],
            "materials": [{"name": "steel"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
            "nodes": [],
        });
        let mut doc = Doc { v, bin: Vec::new() };
        doc.floats(corners);
        doc
    }

    fn accessor(
        &mut self,
        component: u32,
        kind: &str,
        count: usize,
        bytes: &[u8],
        normalized: bool,
    ) -> usize {
        let at = self.bin.len();
        self.bin.extend(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let list = |v: &mut Value, key: &str, item: Value| -> usize {
            let list = v[key].as_array_mut().unwrap();
            list.push(item);
            list.len() - 1
        };
        let view = list(
            &mut self.v,
            "bufferViews",
            json!({"buffer": 0, "byteOffset": at, "byteLength": bytes.len()}),
        );
        let a = json!({"bufferView": view, "componentType": component, "type": kind, "count": count, "normalized": normalized});
        list(&mut self.v, "accessors", a)
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let kind = match N {
            1 => "SCALAR",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.accessor(5126, kind, rows.len(), &bytes, false)
    }

    /// A sampler and channel of animation `a`, which is made when it is not there.
    fn channel<const N: usize>(
        &mut self,
        a: usize,
        node: usize,
        path: &str,
        between: &str,
        times: &[f32],
        rows: &[[f32; N]],
    ) {
        let times: Vec<[f32; 1]> = times.iter().map(|t| [*t]).collect();
        let (input, output) = (self.floats(&times), self.floats(rows));
        if self.v["animations"].is_null() {
            self.v["animations"] = json!([]);
        }
        let all = self.v["animations"].as_array_mut().unwrap();
        while all.len() <= a {
            all.push(json!({"channels": [], "samplers": []}));
        }
        let samplers = all[a]["samplers"].as_array_mut().unwrap();
        samplers.push(json!({"input": input, "output": output, "interpolation": between}));
        let sampler = samplers.len() - 1;
        let channels = all[a]["channels"].as_array_mut().unwrap();
        channels.push(json!({"sampler": sampler, "target": {"node": node, "path": path}}));
    }

    fn value(&self) -> Value {
        let mut v = self.v.clone();
        let uri = format!("data:application/gltf-buffer;base64,{}", encode(&self.bin));
        v["buffers"] = json!([{"byteLength": self.bin.len(), "uri": uri}]);
        v
    }

    fn scene(&self) -> Scene {
        self.with(&ImportOptions::default()).unwrap()
    }

    fn with(&self, options: &ImportOptions) -> Result<Scene> {
        import_text(&self.value().to_string(), options)
    }

    fn complaint(&self) -> String {
        let e = self.with(&ImportOptions::default()).unwrap_err();
        assert_eq!(e.exit_code(), 2, "{e}");
        let e = e.to_string();
        assert!(e.starts_with("t.gltf: ") && !e.contains('\n'), "{e}");
        e
    }
}

const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]];

/// The rows of a sampler at a time as section 3.11 and appendix C of the glTF 2.0 specification say.
fn rows_at<const N: usize>(between: &str, times: &[f32], rows: &[[f32; N]], t: f64) -> [f64; N] {
    let wide = |r: [f32; N]| r.map(f64::from);
    let value = |k: usize| wide(rows[if between == "CUBICSPLINE" { 3 * k + 1 } else { k }]);
    let n = times.len();
    if t <= times[0] as f64 {
        return value(0);
    }
    if t >= times[n - 1] as f64 {
        return value(n - 1);
    }
    let k = (0..n - 1).rfind(|k| times[*k] as f64 <= t).unwrap();
    let (t0, t1) = (times[k] as f64, times[k + 1] as f64);
    let u = (t - t0) / (t1 - t0);
    let (a, b) = (value(k), value(k + 1));
    let mut out = [0.0; N];
    match between {
        "STEP" => return a,
        "LINEAR" if N == 4 => {
            let q = |v: [f64; N]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]).normalize();
            out.copy_from_slice(&q(a).slerp(q(b), u).to_array());
        }
        "LINEAR" => (0..N).for_each(|j| out[j] = a[j] * (1.0 - u) + b[j] * u),
        _ => {
            let (leaves, comes) = (wide(rows[3 * k + 2]), wide(rows[3 * (k + 1)]));
            let (u2, u3, d) = (u * u, u * u * u, t1 - t0);
            for j in 0..N {
                out[j] = (2.0 * u3 - 3.0 * u2 + 1.0) * a[j]
                    + d * (u3 - 2.0 * u2 + u) * leaves[j]
                    + (-2.0 * u3 + 3.0 * u2) * b[j]
                    + d * (u3 - u2) * comes[j];
            }
        }
    }
    out
}

/// Interpolation, times and rows.
type Sampler<const N: usize> = (&'static str, Vec<f32>, Vec<[f32; N]>);

/// A node with its animation, for brute force.
#[derive(Debug, Clone)]
struct Node {
    translation: [f64; 3],
    rotation: [f64; 4],
    scale: [f64; 3],
    moves: Option<Sampler<3>>,
    turns: Option<Sampler<4>>,
}

impl Node {
    fn at(&self, t: f64) -> DAffine3 {
        let place = match &self.moves {
            Some((b, times, rows)) => rows_at(b, times, rows, t),
            None => self.translation,
        };
        let turn = match &self.turns {
            Some((b, times, rows)) => rows_at(b, times, rows, t),
            None => self.rotation,
        };
        let turn = DQuat::from_array(turn).normalize();
        DAffine3::from_scale_rotation_translation(self.scale.into(), turn, place.into())
    }
}

fn unit4() -> impl Strategy<Value = [f64; 4]> {
    prop::array::uniform4(-1.0f64..1.0).prop_filter_map("no direction", |q| {
        let q = DQuat::from_array(q);
        (q.length() > 0.2).then(|| q.normalize().to_array())
    })
}

fn between() -> impl Strategy<Value = &'static str> {
    prop_oneof![Just("STEP"), Just("LINEAR"), Just("CUBICSPLINE")]
}

fn times() -> impl Strategy<Value = Vec<f32>> {
    prop::collection::vec(0.1f32..1.0, 2..5).prop_map(|steps| {
        steps
            .iter()
            .scan(0.0, |t, s| {
                *t += s;
                Some(*t)
            })
            .collect()
    })
}

fn node() -> impl Strategy<Value = Node> {
    let v3 = || prop::array::uniform3(-2.0f64..2.0);
    let signs = prop::array::uniform3(prop::bool::ANY).prop_map(|s| s.map(|b| if b { 1.0 } else { -1.0 }));
    let moves = prop::option::of((between(), times(), prop::collection::vec(v3(), 12))).prop_map(|m| {
        m.map(|(b, t, rows)| {
            let n = t.len() * if b == "CUBICSPLINE" { 3 } else { 1 };
            (b, t, rows[..n].iter().map(|r| r.map(|x| x as f32)).collect::<Vec<_>>())
        })
    });
    let turns = prop::option::of((between(), times(), prop::collection::vec(unit4(), 12))).prop_map(|m| {
        m.map(|(b, t, rows)| {
            let n = t.len() * if b == "CUBICSPLINE" { 3 } else { 1 };
            (b, t, rows[..n].iter().map(|r| r.map(|x| x as f32)).collect::<Vec<_>>())
        })
    });
    (v3(), unit4(), 0.5f64..2.0, signs, moves, turns).prop_map(
        |(translation, rotation, size, signs, moves, turns)| Node {
            translation,
            rotation,
            scale: signs.map(|s| s * size),
            moves,
            turns,
        },
    )
}

fn document(chain: &[Node]) -> Doc {
    let mut doc = Doc::new(&CORNERS);
    let mut nodes = Vec::new();
    for (i, n) in chain.iter().enumerate() {
        let mut node = json!({"name": format!("n{i}"), "translation": n.translation, "rotation": n.rotation, "scale": n.scale});
        if i + 1 < chain.len() {
            node["children"] = json!([i + 1]);
        } else {
            node["mesh"] = json!(0);
        }
        nodes.push(node);
        if let Some((b, times, rows)) = &n.moves {
            doc.channel(0, i, "translation", b, times, rows);
        }
        if let Some((b, times, rows)) = &n.turns {
            doc.channel(0, i, "rotation", b, times, rows);
        }
    }
    doc.v["nodes"] = json!(nodes);
    doc
}

/// World corners of an object's triangles.
fn corners_at(s: &Scene, o: &Object, t: f64) -> Vec<DVec3> {
    let Shape::Mesh(m) = o.shape else { panic!() };
    let pose = o.at(t).pose();
    s.meshes[m].triangles.iter().flatten().map(|c| pose.point(s.meshes[m].positions_m[*c as usize])).collect()
}

fn iso(up: Up, p: DVec3) -> DVec3 {
    if up == Up::Y { DVec3::new(p.z, p.x, p.y) } else { p }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    /// Hierarchies with mirrors and sizes move as the products of their matrices, and velocities are derivatives.
    #[test]
    fn animated_chains_are_matrix_products(
        chain in prop::collection::vec(node(), 1..5), up in prop_oneof![Just(Up::Y), Just(Up::Z)], unit in prop_oneof![Just(1.0), Just(0.01)],
    ) {
        let doc = document(&chain);
        let s = doc.with(&ImportOptions { up, unit_m: unit, ..Default::default() }).unwrap();
        let o = &s.objects[0];
        let moving = chain.iter().any(|n| n.moves.is_some() || n.turns.is_some());
        prop_assert_eq!(o.motion.is_some(), moving);
        for k in 0..40 {
            let t = 0.1137 * k as f64 - 0.3;
            let product = chain.iter().fold(DAffine3::IDENTITY, |m, n| m * n.at(t));
            let mut expected: Vec<DVec3> = CORNERS.iter()
                .map(|p| iso(up, product.transform_point3(DVec3::from(p.map(f64::from)))) * unit)
                .collect();
            if product.matrix3.determinant() < 0.0 {
                expected.swap(1, 2);
            }
            let got = corners_at(&s, o, t);
            // Scales within 2e-6 of one are taken as one; the file has single precision.
            for (a, b) in got.iter().zip(&expected) {
                prop_assert!((*a - *b).length() < 1e-5 * unit * (1.0 + b.length() / unit), "{} {} at {}", a, b, t);
            }
            let (h, now) = (1e-6, o.at(t));
            let near_key = chain.iter().flat_map(|n| {
                let a = n.moves.iter().flat_map(|m| m.1.iter().copied());
                a.chain(n.turns.iter().flat_map(|m| m.1.iter().copied())).collect::<Vec<f32>>()
            }).any(|key| (key as f64 - t).abs() < 1e-4);
            if !near_key {
                for (a, (b, c)) in got.iter().zip(corners_at(&s, o, t + h).into_iter().zip(corners_at(&s, o, t - h))) {
                    let (slope, rate) = ((b - c) / (2.0 * h), now.velocity_at(*a));
                    prop_assert!((slope - rate).length() < 1e-4 * unit * (1.0 + rate.length() / unit), "{} {} at {}", slope, rate, t);
                }
            }
        }
    }
}

#[test]
fn what_stands_still_has_no_motion_and_what_drifts_drifts_on_top() {
    let mut doc = Doc::new(&CORNERS);
    doc.v["nodes"] = json!([
        {"mesh": 0, "translation": [9, 9, 9], "extras": {"catseye": {"velocity_mps": [2, 0, 0]}}},
        {"mesh": 0, "extras": {"catseye": {"velocity_mps": [0, 3, 0]}}},
    ]);
    // Constant: it says where the node is, and its scale; nothing moves.
    doc.channel(0, 0, "translation", "LINEAR", &[0.0, 1.0], &[[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]);
    doc.channel(0, 0, "scale", "STEP", &[0.0], &[[2.0, 2.0, 2.0]]);
    doc.channel(0, 1, "translation", "LINEAR", &[0.5, 1.5], &[[0.0, 0.0, 0.0], [0.0, 0.0, 10.0]]);
    let s = doc.scene();
    assert_eq!(s.objects[0].motion, None);
    assert_eq!(s.objects[0].pose.translation_m, DVec3::new(3.0, 1.0, 2.0));
    assert_eq!(s.objects[0].velocity_mps, DVec3::X * 2.0);
    assert!((corners_at(&s, &s.objects[0], 0.0)[1] - DVec3::new(3.5, 3.0, 2.0)).length() < 1e-12);
    let o = &s.objects[1];
    for (t, x, rate) in
        [(0.0, 0.0, 0.0), (0.5, 0.0, 10.0), (1.0, 5.0, 10.0), (2.0, 10.0, 0.0), (99.0, 10.0, 0.0)]
    {
        let now = o.at(t);
        assert!((now.translation_m - DVec3::new(x, 3.0 * t, 0.0)).length() < 1e-12, "{t}");
        assert_eq!(now.velocity_mps, DVec3::new(rate, 3.0, 0.0), "{t}");
    }
    assert_eq!(o.velocity_mps, DVec3::new(0.0, 3.0, 0.0), "that of time zero");
    // Over and over, with the period of the whole animation.
    doc.v["animations"][0]["extras"] = json!({"catseye": {"repeat": true}});
    let s = doc.scene();
    for (t, x) in [(1.0, 5.0), (2.5, 5.0), (2.0, 0.0), (-0.5, 5.0)] {
        assert!((s.objects[1].at(t).translation_m.x - x).abs() < 1e-12, "{t}");
    }
    // None of it.
    let none = ImportOptions { animations: Animations::from_name("none"), ..Default::default() };
    let s = doc.with(&none).unwrap();
    assert_eq!(s.objects[0].pose.translation_m, DVec3::splat(9.0));
    assert!(s.import.notes[0].contains("1 animations are left out, as requested"), "{:?}", s.import.notes);
}

#[test]
fn animations_that_contradict_each_other_are_chosen_from() {
    let mut doc = Doc::new(&CORNERS);
    doc.v["nodes"] = json!([{"mesh": 0, "name": "fox"}, {"mesh": 0, "name": "bird"}]);
    for (a, x) in [(0, 1.0), (1, 2.0)] {
        doc.channel(a, 0, "translation", "LINEAR", &[0.0, 1.0], &[[0.0; 3], [0.0, 0.0, x]]);
    }
    doc.channel(2, 1, "translation", "LINEAR", &[0.0, 1.0], &[[0.0; 3], [0.0, 0.0, 3.0]]);
    doc.v["animations"][0]["name"] = json!("Walk");
    doc.v["animations"][1]["name"] = json!("Run");
    let speeds = |name: &str| {
        let o = ImportOptions { animations: Animations::from_name(name), ..Default::default() };
        doc.with(&o)
            .map(|s| (s.objects.iter().map(|o| o.at(0.5).velocity_mps.x).collect::<Vec<_>>(), s.import.notes))
    };
    let (all, notes) = speeds("all").unwrap();
    assert_eq!(all, [1.0, 3.0]);
    assert!(
        notes[0].contains("animation 'Run' is left out: another one moves node 0 ('fox') already"),
        "{notes:?}"
    );
    assert_eq!(speeds("Run").unwrap().0, [2.0, 0.0]);
    assert_eq!(speeds("2").unwrap().0, [0.0, 3.0]);
    let e = speeds("Runn").unwrap_err().to_string();
    assert!(e.contains("allowed: Walk, Run, 2; did you mean 'Run'?"), "{e}");
}

/// Rotations as normalised integers, and keys interleaved in one buffer view.
#[test]
fn integer_and_interleaved_keys() {
    let h = std::f64::consts::FRAC_1_SQRT_2;
    for (component, max) in [(5120, 127.0), (5122, 32767.0)] {
        let mut doc = Doc::new(&CORNERS);
        doc.v["nodes"] = json!([{"mesh": 0}]);
        doc.channel(0, 0, "rotation", "LINEAR", &[0.0, 1.0], &[[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]);
        // A quarter turn about glTF Y, to the left.
        let bytes: Vec<u8> = [[0.0, 0.0, 0.0, 1.0], [0.0, h, 0.0, h]]
            .iter()
            .flatten()
            .flat_map(|x| {
                let n = (x * max).round() as i16;
                if component == 5120 { vec![n as u8] } else { n.to_le_bytes().to_vec() }
            })
            .collect();
        let a = doc.accessor(component, "VEC4", 2, &bytes, true);
        doc.v["animations"][0]["samplers"][0]["output"] = json!(a);
        let s = doc.scene();
        let now = s.objects[0].at(0.5);
        let expected = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_4);
        assert!(now.rotation.angle_between(expected) < 1.0 / max, "{component}: {}", now.rotation);
        assert!((now.spin_rad_per_s - DVec3::Z * std::f64::consts::FRAC_PI_2).length() < 1e-3);
    }
    let mut doc = Doc::new(&CORNERS);
    doc.v["nodes"] = json!([{"mesh": 0}]);
    // Rows of time, x, y, z.
    doc.channel(0, 0, "translation", "LINEAR", &[0.0], &[[0.0; 3]]);
    let a = doc.floats(&[[0.0, 0.0, 0.0, 1.0], [2.0, 0.0, 0.0, 5.0f32]]);
    let view = doc.v["accessors"][a]["bufferView"].clone();
    doc.v["bufferViews"][view.as_u64().unwrap() as usize]["byteStride"] = json!(16);
    for (a, kind, offset) in [(1, "SCALAR", 0), (2, "VEC3", 4)] {
        doc.v["accessors"][a] = json!({"bufferView": view, "byteOffset": offset, "componentType": 5126, "type": kind, "count": 2});
    }
    let now = doc.scene().objects[0].at(1.0);
    assert_eq!((now.translation_m, now.velocity_mps), (DVec3::X * 3.0, DVec3::X * 2.0));
}

#[test]
fn broken_animations_and_skins_are_named() {
    let mut doc = Doc::new(&CORNERS);
    doc.v["nodes"] = json!([{"mesh": 0, "name": "arm"}, {"name": "hand"}]);
    doc.channel(0, 0, "translation", "LINEAR", &[0.0, 1.0], &[[0.0; 3], [0.0, 0.0, 1.0]]);
    doc.channel(0, 1, "rotation", "LINEAR", &[0.0, 1.0], &[[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]);
    let check = |edit: &dyn Fn(&mut Doc), expect: &str| {
        let mut broken = Doc { v: doc.v.clone(), bin: doc.bin.clone() };
        edit(&mut broken);
        let e = broken.complaint();
        assert!(e.contains(expect), "{e}\nnot: {expect}");
    };
    let times = |t: &'static [f32]| {
        move |d: &mut Doc| {
            let rows: Vec<[f32; 1]> = t.iter().map(|t| [*t]).collect();
            let a = d.floats(&rows);
            d.v["animations"][0]["samplers"][0]["input"] = json!(a);
        }
    };
    check(
        &times(&[0.0]),
        "animations[0].channels[0] of node 0 ('arm'): 2 values for 1 times; allowed: 1 for each time",
    );
    check(
        &times(&[0.0, f32::NAN]),
        "of node 0 ('arm') = NaN: key 1 has no time; allowed: 0 s or more, finite",
    );
    check(&times(&[-1.0, 1.0]), "of node 0 ('arm') = -1: key 0 has no time");
    check(&times(&[1.0, 0.5]), "= 0.5 s after 1 s: key 1 is not later than the one before");
    check(&times(&[]), "has no keys");
    let set = |place: &'static str, value: Value| {
        move |d: &mut Doc| *d.v.pointer_mut(place).unwrap() = value.clone()
    };
    check(
        &set("/animations/0/samplers/0/interpolation", json!("CUBICSPLINE")),
        "2 values for 2 times; allowed: 3 for each time",
    );
    check(
        &set("/animations/0/samplers/0/interpolation", json!("SINE")),
        "has an unknown interpolation; allowed: STEP, LINEAR, CUBICSPLINE",
    );
    check(
        &set("/animations/0/channels/0/sampler", json!(7)),
        "node 0 ('arm'): sampler = 7: is out of range; allowed: 0..=1",
    );
    check(
        &set("/animations/0/channels/0/target/node", json!(9)),
        "channels[0].target.node = 9: is out of range; allowed: 0..=1",
    );
    check(&set("/animations/0/samplers/0/output", json!(0)), "3 values for 2 times");
    check(&set("/animations/0/samplers/0/output", json!(4)), "has elements of type Vec4; allowed: Vec3");
    check(&set("/animations/0/samplers/0/output", json!(99)), "is out of range");
    check(
        &set("/animations/0/channels/1/target", json!({"node": 0, "path": "translation"})),
        "moves node 0 ('arm') a second time",
    );
    check(
        &|d| {
            let a = d.floats(&[[0.0; 3], [f32::INFINITY, 0.0, 0.0]]);
            d.v["animations"][0]["samplers"][0]["output"] = json!(a);
        },
        "of node 0 ('arm') = [inf, 0.0, 0.0]: value 1 is not finite",
    );
    check(
        &|d| {
            let a = d.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]]);
            d.v["animations"][0]["samplers"][1]["output"] = json!(a);
        },
        "of node 1 ('hand').rotation = [0.0, 0.0, 0.0, 0.0]: is not a unit quaternion",
    );
    check(
        &|d| {
            d.v["animations"][0]["channels"][0]["target"]["path"] = json!("scale");
            let a = d.floats(&[[1.0; 3], [1.0, 1.0, 1.1]]);
            d.v["animations"][0]["samplers"][0]["output"] = json!(a);
        },
        "of node 0 ('arm'): changes a scale, but bodies are rigid",
    );
    check(
        &|d| d.v["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        "nodes[0].matrix: node 0 ('arm') is animated and has a matrix",
    );
    check(
        &|d| {
            d.v["nodes"] = json!([{"children": [1], "scale": [1, 2, 1]}, {"mesh": 0, "name": "hand"}]);
        },
        "node 1 ('hand') rotates under a node whose scale differs between directions",
    );
    check(
        &|d| d.v["animations"][0]["extras"] = json!({"catseye": {"repeats": true}}),
        "animations[0].extras.catseye.repeats: unknown key; allowed: repeat, shows_extras; did you mean 'repeat'?",
    );
    check(
        &|d| d.v["animations"][0]["extras"] = json!({"catseye": {"repeat": 1}}),
        "repeat = 1: is not true or false",
    );
    check(
        &|d| d.v["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [0]}]),
        "nodes[0]: is its own ancestor",
    );
    // Motions in extras.
    let motion = |joints: Value| {
        move |d: &mut Doc| d.v["nodes"][0]["extras"] = json!({"catseye": {"motion": joints.clone()}})
    };
    check(&motion(json!({})), "nodes[0].extras.catseye.motion = {}: is not a list of joints");
    check(
        &motion(json!([{"kind": "jump"}])),
        "motion[0] = {\"kind\":\"jump\"}: is not a joint: unknown variant `jump`",
    );
    check(&motion(json!([{"kind": "line", "velocity": [1, 0, 0]}])), "unknown field `velocity`");
    check(
        &motion(json!([{"kind": "spin", "axis": [1, 1, 0], "rate_rad_per_s": 1, "angle_rad": 0}])),
        "its axis is not a unit vector",
    );
    check(
        &motion(json!([{"kind": "fixed", "rotation": [0, 0, 0, 2], "translation_m": [0, 0, 0]}])),
        "its rotation is not a unit quaternion",
    );
    check(
        &motion(json!([{"kind": "track", "position": 3}])),
        "names a channel that is not in extras.catseye.channels of the file",
    );
    check(
        &|d| d.v["extras"] = json!({"catseye": {"channels": {"positions_m": [{"interpolation": "linear", "times_s": [0, 0], "values": [[0, 0, 0], [1, 0, 0]]}]}}}),
        "extras.catseye.channels.positions_m[0] = 0 s, 0 s at 0: the times of a motion do not increase",
    );
    check(
        &|d| d.v["extras"] = json!({"catseye": {"channels": {"places": []}}}),
        "are not the channels of motions: a value has a key that is not known ('places')",
    );
    check(
        &|d| d.v["nodes"] = json!([{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "name": "hand", "extras": {"catseye": {"motion": [{"kind": "line", "velocity_mps": [1, 0, 0]}]}}}]),
        "node 1 ('hand') has a parent node that is scaled or mirrored",
    );
}

/// An arm of two bones along glTF +Y, bent in the scene as it stands, with vertices of all kinds.
fn arm(weights: &[[f32; 4]]) -> (Doc, Vec<[f32; 3]>) {
    let points: Vec<[f32; 3]> =
        (0..weights.len()).map(|k| [0.1 * (k % 3) as f32, k as f32 / 4.0, 0.1 * (k % 2) as f32]).collect();
    let mut doc = Doc::new(&points);
    let joints: Vec<u8> = weights.iter().flat_map(|_| [0u8, 1, 0, 0]).collect();
    let joints = doc.accessor(5121, "VEC4", weights.len(), &joints, false);
    let weights = doc.floats(weights);
    let corners: Vec<u16> = (0..points.len() as u16 - 2).flat_map(|k| [k, k + 1, k + 2]).collect();
    let bytes: Vec<u8> = corners.iter().flat_map(|c| c.to_le_bytes()).collect();
    let indices = doc.accessor(5123, "SCALAR", corners.len(), &bytes, false);
    // Bound straight: the shoulder in the origin, the elbow a metre up.
    let mut bind = [[0.0f32; 16]; 2];
    for (k, m) in bind.iter_mut().enumerate() {
        (m[0], m[5], m[10], m[15], m[13]) = (1.0, 1.0, 1.0, 1.0, -(k as f32));
    }
    let bind = doc.floats(&bind);
    doc.v["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": bind}]);
    doc.v["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    doc.v["meshes"][0]["primitives"][0]["attributes"] =
        json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights});
    doc.v["nodes"] = json!([
        // Its own place does not count, as the specification has it.
        {"name": "arm", "mesh": 0, "skin": 0, "translation": [7, 7, 7], "extras": {"catseye": {"class": "limb"}}},
        {"name": "upper", "children": [2], "translation": [0.5, 0, 2], "scale": [1.5, 1.5, 1.5]},
        {"name": "lower", "translation": [0, 1, 0], "rotation": [0.6, 0, 0, 0.8]},
    ]);
    (doc, points)
}

const BENDS: [[f32; 4]; 9] = [
    [1.0, 0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 0.0],
    [0.75, 0.25, 0.0, 0.0],
    [0.5, 0.5, 0.0, 0.0],
    [0.25, 0.75, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
];

/// Linear blending in glTF's axes, then in ours, where the joints are at these transforms.
fn blended(points: &[[f32; 3]], upper: DAffine3, lower: DAffine3) -> Vec<DVec3> {
    let lower = upper * lower * DAffine3::from_translation(-DVec3::Y);
    let at = |(p, w): (&[f32; 3], &[f32; 4])| {
        let p = DVec3::from(p.map(f64::from));
        let p = w[0] as f64 * upper.transform_point3(p) + w[1] as f64 * lower.transform_point3(p);
        DVec3::new(p.z, p.x, p.y)
    };
    points.iter().zip(&BENDS).map(at).collect()
}

#[test]
fn skins_are_cut_into_rigid_parts() {
    let (mut doc, points) = arm(&BENDS);
    let upper = DAffine3::from_scale_rotation_translation(
        DVec3::splat(1.5),
        DQuat::IDENTITY,
        DVec3::new(0.5, 0.0, 2.0),
    );
    let lower = |q: DQuat| DAffine3::from_rotation_translation(q, DVec3::Y);
    let bent = DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8);
    let rest = blended(&points, upper, lower(bent));

    // Nothing moves: one body, the blended mesh.
    let s = doc.scene();
    assert_eq!(s.objects.len(), 1);
    assert_eq!((s.objects[0].name.as_str(), s.objects[0].class.as_str()), ("arm", "limb"));
    let expected: Vec<DVec3> = (0..7).flat_map(|k| [rest[k], rest[k + 1], rest[k + 2]]).collect();
    for (a, b) in corners_at(&s, &s.objects[0], 0.0).iter().zip(&expected) {
        assert!((*a - *b).length() < 1e-6, "{a} {b}");
    }
    assert!(s.import.notes.is_empty(), "{:?}", s.import.notes);

    // The elbow turns, from where it stands.
    let h = std::f32::consts::FRAC_1_SQRT_2;
    doc.channel(0, 2, "rotation", "LINEAR", &[1.0, 2.0], &[[0.6, 0.0, 0.0, 0.8], [h, 0.0, 0.0, h]]);
    let s = doc.scene();
    assert_eq!(
        s.objects.iter().map(|o| (o.name.as_str(), o.class.as_str())).collect::<Vec<_>>(),
        [("arm/upper", "limb"), ("arm/lower", "limb")]
    );
    assert!(s.objects[0].motion.is_none() && s.objects[1].motion.is_some());
    // Triangles 0 to 2 hang more on the upper arm, 3 (weights 0.25, 0.5, 0.75 of the lower) and the rest on the lower:
    // 1/2 of the weight decides for the first.
    let parts: Vec<Vec<DVec3>> = s.objects.iter().map(|o| corners_at(&s, o, 0.0)).collect();
    assert_eq!((parts[0].len(), parts[1].len()), (4 * 3, 3 * 3));
    for (a, b) in parts.concat().iter().zip(&expected) {
        assert!((*a - *b).length() < 1e-6, "at rest the parts are the blended mesh: {a} {b}");
    }
    let note = &s.import.notes[0];
    assert!(note.contains("node 0 ('arm') has a skin and is cut into 2 rigid parts; the minimum share of a triangle's weight in its part is 50 %, at 'upper'"), "{note}");
    // In motion what hangs on one joint alone is exact.
    for t in [1.0, 1.3, 1.8, 5.0] {
        let u = (t - 1.0f64).clamp(0.0, 1.0);
        let now =
            blended(&points, upper, lower(bent.slerp(DQuat::from_xyzw(h as f64, 0.0, 0.0, h as f64), u)));
        let got = [corners_at(&s, &s.objects[0], t), corners_at(&s, &s.objects[1], t)].concat();
        for (k, p) in got.iter().enumerate() {
            let v = k / 3 + k % 3;
            let own = BENDS[v][usize::from(k >= 12)] == 1.0;
            if own {
                assert!((*p - now[v]).length() < 1e-6, "{t} vertex {v}: {p} {}", now[v]);
            }
        }
    }

    // All of it moves as one when only the shoulder does.
    doc.v["animations"] = Value::Null;
    doc.v.as_object_mut().unwrap().remove("animations");
    doc.channel(0, 1, "translation", "LINEAR", &[0.0, 1.0], &[[0.5, 0.0, 2.0], [0.5, 0.0, 5.0]]);
    let s = doc.scene();
    assert_eq!((s.objects.len(), s.objects[0].at(0.5).velocity_mps), (1, DVec3::X * 3.0));
    let moved = corners_at(&s, &s.objects[0], 1.0);
    for (a, b) in moved.iter().zip(&expected) {
        assert!((*a - *b - DVec3::X * 3.0).length() < 1e-6, "{a} {b}");
    }
}

#[test]
fn skins_with_integers_and_wrong_skins() {
    let (doc, _) = arm(&BENDS);
    let plain = doc.scene();
    let again = |edit: &dyn Fn(&mut Doc)| {
        let mut d = Doc { v: doc.v.clone(), bin: doc.bin.clone() };
        edit(&mut d);
        d
    };
    // Bytes for weights, words for joints, and a second set that says nothing.
    let integers = again(&|d| {
        let bytes: Vec<u8> = BENDS.iter().flatten().map(|w| (w * 252.0) as u8).collect();
        let weights = d.accessor(5121, "VEC4", 9, &bytes, true);
        let bytes: Vec<u8> =
            BENDS.iter().flat_map(|_| [0u16, 1, 0, 0]).flat_map(|j| j.to_le_bytes()).collect();
        let joints = d.accessor(5123, "VEC4", 9, &bytes, false);
        let nothing = d.floats(&[[0.0f32; 4]; 9]);
        let a = &mut d.v["meshes"][0]["primitives"][0]["attributes"];
        (a["WEIGHTS_0"], a["JOINTS_0"]) = (json!(weights), json!(joints));
        (a["WEIGHTS_1"], a["JOINTS_1"]) = (json!(nothing), json!(joints));
    });
    for (a, b) in soup(&integers.scene()).iter().zip(soup(&plain)) {
        assert!(a.0.iter().zip(b.0).all(|(p, q)| (*p - q).length() < 1e-6));
    }
    let set = |place: &'static str, value: Value| {
        move |d: &mut Doc| *d.v.pointer_mut(place).unwrap() = value.clone()
    };
    let check = |edit: &dyn Fn(&mut Doc), expect: &str| {
        let e = again(edit).complaint();
        assert!(e.contains(expect), "{e}\nnot: {expect}");
    };
    check(
        &set("/skins/0/joints", json!([1, 9])),
        "skins[0].joints[1] = 9: the skin of node 0 ('arm') has a joint that is not in the scene",
    );
    check(&set("/skins/0/joints", json!([])), "the skin of node 0 ('arm') has no joints");
    check(
        &set("/skins/0/joints", json!([1])),
        "vertex 3 of node 0 ('arm') names a joint that the skin does not have; allowed: 0..=0",
    );
    check(
        &set("/skins/0/joints", json!([1, 2, 1])),
        "2 matrices for the 3 joints of the skin of node 0 ('arm')",
    );
    check(&set("/skins", json!([])), "skin of node 0 ('arm') = 0: is out of range");
    check(
        &|d| {
            d.v["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
        },
        "JOINTS_0: is missing, and node 0 ('arm') has a skin",
    );
    check(
        &|d| {
            let weights = d.floats(&[[0.0f32; 4]; 9]);
            d.v["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
        },
        "vertex 0 of node 0 ('arm') has no joint",
    );
    check(
        &|d| {
            let weights = d.floats(&[[f32::NAN; 4]; 9]);
            d.v["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
        },
        "vertex 0 of node 0 ('arm') has a weight that is not 0 or more",
    );
    check(&set("/nodes/1/scale", json!([0, 0, 0])), "has the joint node 1 ('upper'), whose scale is zero");
    check(
        &|d| d.v["nodes"][0]["extras"] = json!({"catseye": {"id": 3}}),
        "an id is only allowed on a node that is one object",
    );
    check(&|d| d.v["scenes"] = json!([{"nodes": [0]}]), "has a joint that is not in the scene");
}

/// A scene with every kind of joint and turn.
fn moving() -> Scene {
    let mut s = Scene::default();
    let steel = s.material_index(&material::by_name("steel").unwrap());
    let positions_m = CORNERS.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    let mesh = Mesh { positions_m, triangles: vec![[0, 1, 2]], material: vec![steel], normals: vec![] };
    let first = s.add_mesh("straight", "car", mesh, Pose::from_yaw_pitch_roll(DVec3::X, 0.3, 0.1, 0.0));
    s.objects[0].velocity_mps = DVec3::new(3.0, 0.1, 0.0);
    assert_eq!(first, 1);
    let p = DVec3::new;
    let q = |yaw: f64, pitch: f64| DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch);
    let channel = |values: Vec<DVec3>, between| {
        let tangents = match between {
            Interpolation::Cubic => values.iter().map(|v| (*v * 0.1, *v * -0.2)).collect(),
            _ => vec![],
        };
        Channel::new(vec![0.0, 1.0 / 3.0, 2.5], values, tangents, between).unwrap()
    };
    let places = vec![p(0.1, 0.2, 0.3), p(10.0, 1.0 / 7.0, 0.2), p(20.0, -3.0, 0.0)];
    let turns = vec![q(0.1, 0.0), q(1.0, 0.3), q(-0.4, 0.1)];
    let linear = Arc::new(channel(places.clone(), Interpolation::Linear));
    let cubic = Arc::new(channel(places.clone(), Interpolation::Cubic));
    let step = Arc::new(channel(places.clone(), Interpolation::Step));
    let again = Arc::new(channel(places, Interpolation::Linear).repeated(2.5).unwrap());
    let turn = |between| {
        let tangents = match between {
            Interpolation::Cubic => turns.iter().map(|q| (*q * 0.1, *q * 0.3)).collect(),
            _ => vec![],
        };
        Arc::new(Channel::new(vec![0.0, 1.2, 2.5], turns.clone(), tangents, between).unwrap())
    };
    let way = Arc::new(
        Channel::new(vec![-1.0, 0.5, 2.5], vec![0.0, 7.7, 31.0], vec![], Interpolation::Linear)
            .unwrap()
            .going_on(),
    );
    let hub = Joint::Fixed(q(0.02, 0.4), p(1.3, 0.8, 1.0 / 3.0));
    let hinge = |turn| Joint::Hinge {
        at_m: p(0.1, 0.2, 0.9),
        axis: DVec3::Y,
        turn,
        speed_mps: 1.4,
        clock_s: 0.21,
        way_m: None,
    };
    let crank_m = p(0.1, 0.0, -0.7);
    let pedal = |half, knee| Turn::Pedal {
        crank_m,
        arm_m: 0.17,
        thigh_m: 0.42,
        shank_m: 0.46,
        development_m: 5.0,
        half,
        knee,
    };
    let track = |position_m: Option<&Arc<Channel<DVec3>>>, rotation| Joint::Track {
        position_m: position_m.cloned(),
        rotation,
    };
    let chains: Vec<Vec<Joint>> = vec![
        vec![track(Some(&linear), Some(turn(Interpolation::Linear)))],
        vec![track(Some(&cubic), Some(turn(Interpolation::Cubic)))],
        vec![track(Some(&step), Some(turn(Interpolation::Step)))],
        vec![track(Some(&again), None)],
        vec![track(None, Some(turn(Interpolation::Linear)))],
        vec![
            Joint::Roll { axis: DVec3::Y, radius_m: 0.31, distance_m: way.clone() },
            hub.clone(),
            hub.clone(),
            track(Some(&cubic), None),
        ],
        vec![
            Joint::Spin { axis: DVec3::Z, rate_rad_per_s: -3.0, angle_rad: 1.0 },
            Joint::Line(p(0.1, 0.2, 0.3)),
        ],
        vec![
            Joint::Swing { axis: DVec3::X, amplitude_rad: 0.6, rate_rad_per_s: 7.0, phase_rad: 0.4 },
            hub.clone(),
        ],
        vec![
            hinge(Turn::Roll { radius_m: 0.33 }),
            hinge(Turn::Crank { development_m: 5.0 }),
            hinge(Turn::Level { development_m: 5.0 }),
        ],
        vec![
            hinge(Turn::Knee { leg_m: 0.9, phase: 0.3 }),
            hinge(Turn::Hip { leg_m: 0.9, phase: 0.3 }),
            hinge(Turn::Shoulder { leg_m: 0.9, phase: 0.8 }),
            hub.clone(),
        ],
        vec![hinge(pedal(true, true)), hinge(pedal(false, false)), hub.clone(), Joint::Line(DVec3::X)],
        vec![
            Joint::Hinge {
                at_m: p(0.1, 0.2, 0.9),
                axis: DVec3::Y,
                turn: Turn::Crank { development_m: 5.0 },
                speed_mps: 10.0,
                clock_s: 0.21,
                way_m: Some(way),
            },
            hub,
        ],
    ];
    for (k, joints) in chains.into_iter().enumerate() {
        let shape = if k == 4 { Shape::Point { rcs_dbsm: 3.0 } } else { Shape::Mesh(0) };
        let id = s.add_object(&format!("o{k}"), "car", shape, Pose::IDENTITY, DVec3::ZERO);
        s.move_by(id, Motion { joints });
    }
    s
}

#[test]
fn motions_come_back_exactly() {
    let a = moving();
    let bytes = to_glb(&a).unwrap();
    // Other axes and units are those of the file; what is said in extras is in ours whatever they are.
    let b = import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
    assert!(b.import.notes.is_empty(), "{:?}", b.import.notes);
    assert_eq!(a.meshes, b.meshes);
    assert_eq!(a.objects.len(), b.objects.len());
    for (x, y) in a.objects.iter().zip(&b.objects) {
        assert_eq!((x.id, &x.name, &x.class, x.shape), (y.id, &y.name, &y.class, y.shape));
        assert_eq!(x.motion.is_some(), y.motion.is_some());
        for t in [-2.0, -0.3, 0.0, 0.2, 0.9, 1.7, 2.5, 3.1, 40.0] {
            let (p, q) = (x.at(t), y.at(t));
            assert!((p.translation_m - q.translation_m).length() < 1e-9, "{} {t}", x.name);
            assert!((p.velocity_mps - q.velocity_mps).length() < 1e-9, "{} {t}", x.name);
            assert!((p.spin_rad_per_s - q.spin_rad_per_s).length() < 1e-9, "{} {t}", x.name);
            assert!((p.rotation.dot(q.rotation).abs() - 1.0).abs() < 1e-12, "{} {t}", x.name);
        }
    }
    // What is shared stays shared: 4 channels of places, 3 kinds of turns (twice linear), 1 of distances.
    let root = json_of(&bytes);
    let channels = &root["extras"]["catseye"]["channels"];
    let count = |key: &str| channels[key].as_array().unwrap().len();
    assert_eq!((count("positions_m"), count("rotations"), count("distances_m")), (4, 4, 1));
    // And again, the same bytes but for the last digits of numbers.
    let c = import_bytes(&to_glb(&b).unwrap(), Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
    assert_eq!(b.objects.len(), c.objects.len());
    let mut s = moving();
    let nan = Motion { joints: vec![Joint::Line(DVec3::new(0.0, f64::NAN, 0.0))] };
    s.objects[2].motion = Some(Arc::new(nan));
    assert!(to_glb(&s).unwrap_err().to_string().contains("'o1': a motion is not finite"));
}

fn json_of(glb: &[u8]) -> Value {
    let n = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&glb[20..20 + n]).unwrap()
}

/// What another program makes of the file: the animation alone, read by the specification, shows the scene.
#[test]
fn other_programs_see_it_move() {
    let s = moving();
    let bytes = to_glb(&s).unwrap();
    let root = json_of(&bytes);
    let n = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let bin = &bytes[20 + n + 8..];
    fn rows<const N: usize>(root: &Value, bin: &[u8], a: &Value) -> Vec<[f32; N]> {
        let a = &root["accessors"][a.as_u64().unwrap() as usize];
        let at = root["bufferViews"][a["bufferView"].as_u64().unwrap() as usize]["byteOffset"]
            .as_u64()
            .unwrap() as usize;
        let x = |k: usize| f32::from_le_bytes(bin[at + 4 * k..at + 4 * k + 4].try_into().unwrap());
        (0..a["count"].as_u64().unwrap() as usize).map(|i| std::array::from_fn(|j| x(i * N + j))).collect()
    }
    let animation = &root["animations"][0];
    let mut seen = std::collections::HashSet::new();
    for c in animation["channels"].as_array().unwrap() {
        let o = &s.objects[c["target"]["node"].as_u64().unwrap() as usize];
        let sampler = &animation["samplers"][c["sampler"].as_u64().unwrap() as usize];
        let between = sampler["interpolation"].as_str().unwrap();
        seen.insert(between);
        let times: Vec<f32> = rows::<1>(&root, bin, &sampler["input"]).iter().map(|t| t[0]).collect();
        assert!(times.windows(2).all(|w| w[0] < w[1]) && times[0] >= 0.0);
        let bounds = &root["accessors"][sampler["input"].as_u64().unwrap() as usize];
        assert_eq!(
            (bounds["min"][0].as_f64().unwrap() as f32, bounds["max"][0].as_f64().unwrap() as f32),
            (times[0], times[times.len() - 1])
        );
        for k in 0..250 {
            let t = 0.01 * k as f64 + 0.0033;
            let now = o.at(t);
            if c["target"]["path"] == "translation" {
                let p = rows_at(between, &times, &rows::<3>(&root, bin, &sampler["output"]), t);
                let off = (DVec3::new(p[2], p[0], p[1]) - now.translation_m).length();
                let jump = o.name == "o3";
                assert!(off < 1.2 * show::OFF_M || jump, "{} {t}: {off} m", o.name);
            } else {
                let q = rows_at(between, &times, &rows::<4>(&root, bin, &sampler["output"]), t);
                let q = DQuat::from_xyzw(q[2], q[0], q[1], q[3]).normalize();
                let off = q.angle_between(now.rotation);
                assert!(off < 1.2 * show::OFF_RAD, "{} {t}: {off} rad", o.name);
            }
        }
    }
    assert_eq!(seen.len(), 3, "all three interpolations");
    // A program that loses the mark of the animation does not make a body move twice.
    let mut v = root.clone();
    v["animations"][0].as_object_mut().unwrap().remove("extras");
    v["buffers"][0]["uri"] = json!(format!("data:;base64,{}", encode(bin)));
    let again = import_text(&v.to_string(), &ImportOptions::default()).unwrap();
    for (a, b) in s.objects.iter().zip(&again.objects).filter(|(a, _)| a.motion.is_some()) {
        assert!((a.at(0.7).translation_m - b.at(0.7).translation_m).length() < 1e-9, "{}", a.name);
    }
    assert!(again.import.notes.iter().any(|n| n.contains("follows its extras.catseye.motion")));
}

/// Children of a node that moves by its extras move with it, and lists may stand in files by hand.
#[test]
fn motions_by_hand() {
    let mut doc = Doc::new(&CORNERS);
    doc.v["nodes"] = json!([
        {"children": [1], "translation": [0, 0, 100], "extras": {"catseye": {"motion": [
            {"kind": "spin", "axis": [0, 0, 1], "rate_rad_per_s": 2, "angle_rad": 0},
            {"kind": "fixed", "rotation": [0, 0, 0, 1], "translation_m": [5, 0, 0]},
        ]}}},
        {"mesh": 0, "translation": [0, 0, 3]},
    ]);
    let s = doc.scene();
    // Three metres ahead of what turns about the place five metres ahead; the node's own place is not asked.
    let now = s.objects[0].at(0.0);
    assert!((now.translation_m - DVec3::X * 8.0).length() < 1e-12);
    assert!((now.velocity_mps - DVec3::Y * 6.0).length() < 1e-12);
    assert!((now.spin_rad_per_s - DVec3::Z * 2.0).length() < 1e-12);
}

/// Files as others write them.
#[test]
fn files_of_others() {
    // Cameras, lights, textures, morphs, pointers, extras of others, no names, no scene.
    let mut doc = Doc::new(&CORNERS);
    doc.v["extensionsUsed"] =
        json!(["KHR_texture_transform", "KHR_lights_punctual", "KHR_animation_pointer", "VENDOR_thing"]);
    doc.v["extensionsRequired"] = json!(["KHR_texture_transform"]);
    doc.v["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.01}}]);
    doc.v["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    doc.v["images"] = json!([{"uri": "a.png"}]);
    doc.v["samplers"] = json!([{}]);
    doc.v["textures"] = json!([{"source": 0, "sampler": 0}]);
    doc.v["materials"] = json!([{"name": "steel", "pbrMetallicRoughness": {"baseColorTexture":
        {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}}, "extras": "blue"}]);
    doc.v["extras"] = json!(5);
    let morph = doc.floats(&[[0.0f32; 3]; 3]);
    doc.v["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": morph}]);
    doc.v["meshes"][0]["weights"] = json!([0.5]);
    doc.v["nodes"] = json!([
        {"camera": 0, "extras": [1, 2]},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"mesh": 0, "matrix": [0,0,-2,0, 0,2,0,0, 2,0,0,0, 1,0,3,1]},
    ]);
    doc.channel(0, 2, "weights", "LINEAR", &[0.0, 1.0], &[[0.0], [1.0]]);
    doc.channel(0, 2, "translation", "LINEAR", &[0.0], &[[0.0; 3]]);
    doc.v["animations"][0]["channels"][1]["target"] = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}}});
    let s = doc.scene();
    let expected = [DVec3::new(3.0, 1.0, 0.0), DVec3::new(1.0, 1.5, 0.0), DVec3::new(3.0, 2.0, 2.0)];
    for (a, b) in corners_at(&s, &s.objects[0], 0.0).iter().zip(expected) {
        assert!((*a - b).length() < 1e-12, "{a} {b}");
    }
    let notes = s.import.notes.join("\n");
    for expect in [
        "has morph targets",
        "node 2 has animated morph targets, which are left out",
        "animations that move more than nodes",
    ] {
        assert!(notes.contains(expect), "{notes}");
    }
    doc.v["extensionsRequired"] = json!(["VENDOR_thing"]);
    assert!(doc.complaint().contains("requires the extension VENDOR_thing, which is not supported"));
    // Keys in a file of their own beside the document, and in sparse accessors without a view.
    let dir = tempfile::tempdir().unwrap();
    let mut doc = Doc::new(&CORNERS);
    doc.v["nodes"] = json!([{"mesh": 0}]);
    doc.channel(0, 0, "translation", "LINEAR", &[0.0, 2.0], &[[0.0, 0.0, 8.0]]);
    let bytes = [1u8, 0];
    let index = doc.accessor(5121, "SCALAR", 1, &bytes[..1], false);
    let views: Vec<Value> = [2, index].map(|a| doc.v["accessors"][a]["bufferView"].clone()).to_vec();
    doc.v["accessors"][2] = json!({"componentType": 5126, "type": "VEC3", "count": 2, "sparse": {"count": 1,
        "indices": {"bufferView": views[1], "componentType": 5121}, "values": {"bufferView": views[0]}}});
    let mut v = doc.value();
    v["buffers"] = json!([{"byteLength": doc.bin.len(), "uri": "its%20data.bin"}]);
    std::fs::write(dir.path().join("its data.bin"), &doc.bin).unwrap();
    std::fs::write(dir.path().join("a.gltf"), v.to_string()).unwrap();
    let s = import(&dir.path().join("a.gltf"), &ImportOptions::default()).unwrap();
    assert_eq!(s.objects[0].at(1.0).velocity_mps, DVec3::X * 4.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// Whatever is broken in a file with animations, a skin or motions: a scene, or one line.
    #[test]
    fn broken_files_never_panic(
        which in 0usize..3, edits in prop::collection::vec((0.0f64..1.0, prop::num::u8::ANY, 0usize..3), 1..6),
    ) {
        let mut bytes = match which {
            0 => to_glb(&moving()).unwrap(),
            1 => {
                let (mut doc, _) = arm(&BENDS);
                doc.channel(0, 2, "rotation", "LINEAR", &[1.0, 2.0], &[[0.6, 0.0, 0.0, 0.8], [0.0, 0.0, 0.0, 1.0]]);
                doc.value().to_string().into_bytes()
            }
            _ => {
                let mut doc = Doc::new(&CORNERS);
                doc.v["nodes"] = json!([{"mesh": 0}]);
                doc.channel(0, 0, "translation", "CUBICSPLINE", &[0.0, 1.0], &[[0.5; 3]; 6]);
                doc.value().to_string().into_bytes()
            }
        };
        for (at, byte, kind) in edits {
            let at = (at * bytes.len() as f64) as usize;
            match (kind, bytes[at]) {
                // A digit for a digit keeps the document readable and breaks what it says.
                (0 | 1, old) if old.is_ascii_digit() => bytes[at] = b'0' + byte % 10,
                (0, _) => bytes[at] = byte,
                (1, _) => {}
                _ => {
                    if let Some(k) = (at..bytes.len()).find(|k| bytes[*k].is_ascii_digit()) {
                        bytes[k] = b'0' + byte % 10;
                    }
                }
            }
        }
        match import_bytes(&bytes, Path::new("t.gltf"), None, &ImportOptions::default()) {
            Ok(s) => {
                for o in &s.objects {
                    let now = o.at(0.7);
                    prop_assert!(now.translation_m.is_finite() && now.velocity_mps.is_finite(), "{:?}", o);
                }
            }
            Err(e) => prop_assert!(e.exit_code() == 2 && !e.to_string().contains('\n'), "{}", e),
        }
    }
}
