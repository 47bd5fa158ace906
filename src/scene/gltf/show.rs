//! What moves in a scene as an animation for other programs. Our own importer passes it over and reads
//! `extras.catseye.motion` and `velocity_mps`, which are exact.
//!
//! A single track is written key by key with its interpolation. Everything else is sampled as finely as straight
//! interpolation needs to stay within [`OFF_M`] and [`OFF_RAD`], but within [`SHORTEST_S`] of a jump.

use super::buffer::Buffer;
use crate::scene::motion::{Channel, Interpolation, Joint, Moving};
use crate::scene::{Object, Scene};
use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};
use std::collections::HashMap;

/// How far a sampled motion may be from the exact one.
pub(super) const OFF_M: f64 = 0.005;
pub(super) const OFF_RAD: f64 = 0.01;
/// Keys do not lie closer than that.
const SHORTEST_S: f64 = 1e-3;
/// Between two keys a body turns by less than half a turn, or it would be shown turning back.
const TURN_RAD: f64 = 2.5;
/// Length of the animation when no motion has keys, and at most.
const SHOWN_S: f64 = 10.0;
const LONGEST_S: f64 = 60.0;

/// The animation of a scene whose objects are the nodes of the file in the same order; None where nothing moves.
pub(super) fn animation(scene: &Scene, out: &mut Buffer, axes: DMat3) -> Option<Value> {
    let ends = scene.objects.iter().filter_map(|o| o.motion.as_ref()?.span_s());
    let last_s = ends.map(|(_, end)| end).fold(0.0, f64::max);
    let end_s = if last_s > 0.0 { last_s.min(LONGEST_S) } else { SHOWN_S };
    let mut writer = Writer { out, axes, samplers: Vec::new(), known: HashMap::new(), channels: Vec::new() };
    for (node, o) in scene.objects.iter().enumerate() {
        if o.motion.is_none() && o.velocity_mps == DVec3::ZERO {
            continue;
        }
        if let Some((position, rotation)) = single_track(o) {
            if let Some(c) = position {
                let rows = keyed(c, |v| (axes * v).as_vec3().to_array());
                writer.channel(node, "translation", c.times_s(), &rows, c.interpolation());
            }
            if let Some(c) = rotation {
                let rows = keyed(c, |q| turned(axes, q));
                writer.channel(node, "rotation", c.times_s(), &rows, c.interpolation());
            }
            continue;
        }
        writer.sampled(node, o, end_s);
    }
    if writer.channels.is_empty() {
        return None;
    }
    Some(json!({
        "name": "motion",
        "channels": writer.channels,
        "samplers": writer.samplers,
        "extras": {"catseye": {"shows_extras": true}},
    }))
}

type Track<'a> = (Option<&'a Channel<DVec3>>, Option<&'a Channel<DQuat>>);

/// The channels of a motion that is one track, where single precision and the format can hold them.
fn single_track(o: &Object) -> Option<Track<'_>> {
    let [Joint::Track { position_m, rotation }] = o.motion.as_ref()?.joints.as_slice() else { return None };
    fn holds<T: Copy>(c: &Channel<T>) -> bool {
        let times: Vec<f32> = c.times_s().iter().map(|t| *t as f32).collect();
        // The format wants two keys of a cubic.
        let enough = c.interpolation() != Interpolation::Cubic || times.len() > 1;
        c.repeat_s().is_none()
            && !c.goes_on()
            && times[0] >= 0.0
            && times.windows(2).all(|w| w[0] < w[1])
            && enough
    }
    let (p, r) = (position_m.as_deref(), rotation.as_deref());
    (p.is_none_or(holds) && r.is_none_or(holds)).then_some((p, r))
}

fn turned(axes: DMat3, q: DQuat) -> [f32; 4] {
    let v = axes * DVec3::new(q.x, q.y, q.z);
    [v.x as f32, v.y as f32, v.z as f32, q.w as f32]
}

/// Rows of a sampler: values, for cubics each between its tangents.
fn keyed<T: Copy, const N: usize>(c: &Channel<T>, row: impl Fn(T) -> [f32; N]) -> Vec<[f32; N]> {
    match c.interpolation() {
        Interpolation::Cubic => {
            let keys = c.values().iter().zip(c.tangents());
            keys.flat_map(|(v, (into, out))| [row(*into), row(*v), row(*out)]).collect()
        }
        _ => c.values().iter().map(|v| row(*v)).collect(),
    }
}

struct Writer<'a> {
    out: &'a mut Buffer,
    axes: DMat3,
    samplers: Vec<Value>,
    /// (input, output, interpolation) to sampler.
    known: HashMap<(usize, usize, &'static str), usize>,
    channels: Vec<Value>,
}

impl Writer<'_> {
    fn channel<const N: usize>(
        &mut self,
        node: usize,
        path: &str,
        times_s: &[f64],
        rows: &[[f32; N]],
        interpolation: Interpolation,
    ) {
        let times: Vec<[f32; 1]> = times_s.iter().map(|t| [*t as f32]).collect();
        let input = self.out.shared_floats(&times, true);
        let output = self.out.shared_floats(rows, false);
        let name = match interpolation {
            Interpolation::Step => "STEP",
            Interpolation::Linear => "LINEAR",
            Interpolation::Cubic => "CUBICSPLINE",
        };
        let samplers = &mut self.samplers;
        let sampler = *self.known.entry((input, output, name)).or_insert_with(|| {
            samplers.push(json!({"input": input, "output": output, "interpolation": name}));
            samplers.len() - 1
        });
        self.channels.push(json!({"sampler": sampler, "target": {"node": node, "path": path}}));
    }

    fn sampled(&mut self, node: usize, o: &Object, end_s: f64) {
        let axes = self.axes;
        let places = samples(o, end_s, |a, b, between, u| {
            a.translation_m.lerp(b.translation_m, u).distance(between.translation_m) <= OFF_M
        });
        let rows: Vec<[f32; 3]> =
            places.iter().map(|(_, m)| (axes * m.translation_m).as_vec3().to_array()).collect();
        if rows.iter().any(|r| r != &rows[0]) {
            let times: Vec<f64> = places.iter().map(|p| p.0).collect();
            self.channel(node, "translation", &times, &rows, Interpolation::Linear);
        }
        let turns = samples(o, end_s, |a, b, between, u| {
            a.rotation.slerp(b.rotation, u).angle_between(between.rotation) <= OFF_RAD
        });
        let mut last = DQuat::IDENTITY;
        let mut rows: Vec<[f32; 4]> = Vec::with_capacity(turns.len());
        for (_, m) in &turns {
            last = if m.rotation.dot(last) < 0.0 { -m.rotation } else { m.rotation };
            rows.push(turned(axes, last));
        }
        if rows.iter().any(|r| r != &rows[0]) {
            let times: Vec<f64> = turns.iter().map(|p| p.0).collect();
            self.channel(node, "rotation", &times, &rows, Interpolation::Linear);
        }
    }
}

/// Times from zero to `end_s` between which `fits(from, to, between, share)` holds, with where the object is.
fn samples(
    o: &Object,
    end_s: f64,
    fits: impl Fn(&Moving, &Moving, &Moving, f64) -> bool,
) -> Vec<(f64, Moving)> {
    let straight = o
        .motion
        .as_ref()
        .is_none_or(|m| m.joints.iter().all(|j| matches!(j, Joint::Fixed(..) | Joint::Line(_))));
    // A second at most before the next look, so that no swing falls between looks.
    let steps = if straight { 1 } else { end_s.ceil() as usize };
    let mut stack: Vec<(f64, Moving)> = Vec::new();
    for k in (0..=steps).rev() {
        let t = end_s * k as f64 / steps as f64;
        stack.push((t, o.at(t)));
    }
    let mut done: Vec<(f64, Moving)> = stack.pop().into_iter().collect();
    while let (Some((a, at_a)), Some((b, at_b))) = (done.last().copied(), stack.last().copied()) {
        // Shares that no common period hits twice in the same phase.
        let good = [0.236, 0.5, 0.618, 0.854].iter().all(|u| {
            let between = o.at(a + (b - a) * u);
            let spin = between.spin_rad_per_s.length().max(at_a.spin_rad_per_s.length());
            spin * (b - a) <= TURN_RAD && fits(&at_a, &at_b, &between, *u)
        });
        if good || b - a <= SHORTEST_S {
            done.push((b, at_b));
            stack.pop();
        } else {
            let t = 0.5 * (a + b);
            stack.push((t, o.at(t)));
        }
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::scene::Shape;
    use crate::scene::motion::Motion;
    use crate::scene::turn::Turn;

    /// Between the keys, at many times, straight interpolation is as near as it says.
    #[test]
    fn sampled_motions_are_near() {
        let mut scene = Scene::default();
        let hinge = |turn| Joint::Hinge {
            at_m: DVec3::Z,
            axis: DVec3::Y,
            turn,
            speed_mps: 1.4,
            clock_s: 0.2,
            way_m: None,
        };
        let forth = Joint::Line(DVec3::new(1.4, 0.3, 0.0));
        for joints in [
            vec![
                hinge(Turn::Knee { leg_m: 0.9, phase: 0.1 }),
                hinge(Turn::Hip { leg_m: 0.9, phase: 0.1 }),
                forth,
            ],
            vec![Joint::Spin { axis: DVec3::Z, rate_rad_per_s: 130.0, angle_rad: 0.3 }],
            vec![
                Joint::Fixed(DQuat::IDENTITY, DVec3::X * 4.0),
                Joint::Swing { axis: DVec3::Z, amplitude_rad: 0.8, rate_rad_per_s: 12.566, phase_rad: 0.0 },
            ],
        ] {
            let id = scene.add_object("o", "", Shape::Point { rcs_dbsm: 0.0 }, Pose::IDENTITY, DVec3::ZERO);
            scene.move_by(id, Motion { joints });
            let o = scene.object_by_id(id).unwrap();
            let places = samples(o, 5.0, |a, b, c, u| {
                a.translation_m.lerp(b.translation_m, u).distance(c.translation_m) <= OFF_M
            });
            let turns = samples(o, 5.0, |a, b, c, u| {
                a.rotation.slerp(b.rotation, u).angle_between(c.rotation) <= OFF_RAD
            });
            assert_eq!((places[0].0, turns[turns.len() - 1].0), (0.0, 5.0));
            let around = |list: &[(f64, Moving)], t: f64| {
                let k = list.partition_point(|p| p.0 <= t).clamp(1, list.len() - 1);
                let (a, b) = (list[k - 1], list[k]);
                (a.1, b.1, (t - a.0) / (b.0 - a.0))
            };
            for k in 0..5000 {
                let t = 0.001 * k as f64 + 0.0003;
                let now = o.at(t);
                let (a, b, u) = around(&places, t);
                let off = a.translation_m.lerp(b.translation_m, u).distance(now.translation_m);
                assert!(off < 1.2 * OFF_M, "{t}: {off} m");
                let (a, b, u) = around(&turns, t);
                let off = a.rotation.slerp(b.rotation, u).angle_between(now.rotation);
                assert!(off < 1.2 * OFF_RAD, "{t}: {off} rad");
            }
            assert!(turns.len() < 1000 && places.len() < 1000, "{} {}", turns.len(), places.len());
        }
    }
}
