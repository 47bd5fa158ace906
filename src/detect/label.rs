//! Which object a point came from, by what the radar's own windows and array make of the frame's echoes, and whether it
//! stands where that object is (CONVENTIONS eq. 160). What no echo explains is leakage or noise.

use super::points::Point;
use super::response::{EchoPlace, Response};
use crate::adc::front_end::Chain;
use crate::adc::synthesis::{Levels, passes};
use crate::base::error::Result;
use crate::base::frames::{Pose, Sensor, Target, World, angles_from_direction, direction_from_angles};
use crate::base::tasks::Tasks;
use crate::base::units::{C0, w_from_dbm, wavenumber};
use crate::road::actors::{actor_boxes, is_ground};
use crate::scene::Scene;
use crate::scene::radar::Radar;
use crate::trace::{Echo, Echoes, MAX_BOUNCES};
use glam::{DMat3, DVec3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Classes of what stands along the road and mirrors the traffic.
pub const MIRRORS: [&str; 5] = ["guard_rail", "post", "wall", "kerb", "fence"];

/// The object that a chain of bounces is an echo of: the first in it that is neither ground nor a [mirror](MIRRORS) along the
/// road, else the first that is not ground, else the first; 0 for an empty chain. A path and the same path backwards
/// thus belong to the same object when one of the two that it touches is a mirror.
pub fn object_of<'a>(r: &Echo, class: impl Fn(u32) -> &'a str) -> u32 {
    let chain = || r.chain.iter().copied().take_while(|id| *id != 0);
    let stands = |id: &u32| !is_ground(class(*id));
    chain()
        .find(|id| stands(id) && !MIRRORS.contains(&class(*id)))
        .or_else(|| chain().find(stands))
        .or_else(|| chain().next())
        .unwrap_or(0)
}

/// What labels need to know of a scene: classes, which objects are parts of one actor, and where actors stand.
#[derive(Debug, Clone, Default)]
pub struct Bodies {
    objects: HashMap<u32, Body>,
    boxes: Vec<BodyBox>,
}

#[derive(Debug, Clone)]
struct Body {
    class: String,
    /// Index into the boxes.
    actor: usize,
}

/// A box in the sensor's frame.
#[derive(Debug, Clone, Copy)]
struct BodyBox {
    pose: Pose<Target, Sensor>,
    lower_m: DVec3,
    upper_m: DVec3,
}

impl Bodies {
    /// The scene at `time_s`, seen from a radar.
    pub fn new(scene: &Scene, time_s: f64, radar: &Pose<Sensor, World>) -> Bodies {
        let to_sensor = radar.inverse();
        let mut objects = HashMap::with_capacity(scene.objects.len());
        let boxes = actor_boxes(scene, time_s).into_iter().enumerate().map(|(actor, b)| {
            for part in b.parts.iter().map(|i| &scene.objects[*i]) {
                objects.insert(part.id, Body { class: part.class.clone(), actor });
            }
            BodyBox { pose: b.pose.then(&to_sensor), lower_m: b.lower_m, upper_m: b.upper_m }
        });
        Bodies { boxes: boxes.collect(), objects }
    }

    /// The object's class; "" when it has none.
    pub fn class(&self, object: u32) -> &str {
        self.objects.get(&object).map_or("", |b| b.class.as_str())
    }

    /// Whether a point stands off every actor of a chain that names more than one, ground among them. Ground itself is
    /// no place to stand: it is everywhere.
    fn is_ghost(&self, point: &Point, chain: &[u32], least_m: f64) -> bool {
        let known = || chain.iter().take_while(|id| **id != 0).filter_map(|id| self.objects.get(id));
        let Some(first) = known().next() else { return false };
        if known().all(|b| b.actor == first.actor) {
            return false;
        }
        let mut standing = known().filter(|b| !is_ground(&b.class)).peekable();
        standing.peek().is_some() && standing.all(|b| self.boxes[b.actor].is_off(point, least_m))
    }
}

impl BodyBox {
    /// Whether the box lies outside the point's ellipsoid, whose half axes along range, azimuth and elevation are three
    /// standard deviations and at least `least_m`.
    fn is_off(&self, point: &Point, least_m: f64) -> bool {
        let half = |std: Option<f64>| {
            std.map_or(FRAC_PI_2 * point.range_m, |s| 3.0 * s * point.range_m).max(least_m)
        };
        let (mut azimuth, mut elevation) = (point.azimuth_rad, point.elevation_rad);
        if point.std.elevation_rad.is_none() {
            // What was measured is u_y, whatever the height.
            let sine = direction_from_angles(azimuth, elevation).y;
            elevation = angles_from_direction(self.pose.point(0.5 * (self.lower_m + self.upper_m))).1;
            azimuth = (sine / elevation.cos()).clamp(-1.0, 1.0).asin();
            if point.azimuth_rad.abs() > FRAC_PI_2 {
                azimuth = PI.copysign(point.azimuth_rad) - azimuth;
            }
        }
        let (sin, cos) = (azimuth.sin(), azimuth.cos());
        let along = direction_from_angles(azimuth, elevation);
        let left = DVec3::new(-sin, cos, 0.0);
        let axes = [
            along / (3.0 * point.std.range_m).max(least_m),
            left / half(point.std.azimuth_rad),
            along.cross(left) / half(point.std.elevation_rad),
        ];
        // To the box's frame: |A q - b|² over the box.
        let turn = DMat3::from_quat(self.pose.rotation);
        let a = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose() * turn;
        let b = a * self.pose.inverse().point(along * point.range_m);
        least_over_box(&a, b, self.lower_m, self.upper_m) > 1.0
    }
}

/// min |A q − b| over lower ≤ q ≤ upper: one of the 27 ways for each coordinate to be free or at a bound is the
/// minimum's, and every other way gives a point of the box that is no nearer.
fn least_over_box(a: &DMat3, b: DVec3, lower: DVec3, upper: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for way in 0..27usize {
        let state = [way % 3, way / 3 % 3, way / 9];
        let mut q = DVec3::ZERO;
        let mut rest = b;
        // Bound coordinates stand in the system as q_i = bound.
        let mut columns = [DVec3::ZERO; 3];
        for i in 0..3 {
            match state[i] {
                0 => columns[i] = a.col(i),
                s => {
                    q[i] = if s == 1 { lower[i] } else { upper[i] };
                    rest -= q[i] * a.col(i);
                }
            }
        }
        let free: Vec<usize> = (0..3).filter(|i| state[*i] == 0).collect();
        let mut normal = DMat3::IDENTITY;
        let mut right = DVec3::ZERO;
        for &i in &free {
            right[i] = columns[i].dot(rest);
            for &j in &free {
                normal.col_mut(j)[i] = columns[i].dot(columns[j]);
            }
        }
        let solved = normal.inverse() * right;
        for &i in &free {
            q[i] = solved[i];
        }
        let q = q.clamp(lower, upper);
        let distance = (*a * q - b).length();
        if distance < least {
            least = distance;
        }
    }
    least
}

/// One echo, reduced to what labelling needs.
struct LabelEcho {
    place: EchoPlace,
    object: u32,
    /// Conjugate of a e^{−jkL} of eq. 9, as a mixer delivers it, behind the filters.
    amplitude: Complex64,
    chain: [u32; MAX_BOUNCES],
    bounces: u8,
}

/// What made a point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Cause {
    /// Nothing is known of the scene: the samples came from elsewhere.
    #[default]
    Unknown,
    /// Echoes of an object.
    Object,
    /// Echoes of what fills the air.
    Weather,
    /// What goes from transmitter to receiver inside the radar or by its cover.
    Leakage,
    /// No echo explains its power: thermal noise, other radars, spurious lines of the front end.
    Noise,
}

impl Cause {
    /// The class of a point without an object.
    pub fn class(self) -> &'static str {
        match self {
            Cause::Unknown | Cause::Object => "",
            Cause::Weather => "weather",
            Cause::Leakage => "leakage",
            Cause::Noise => "noise",
        }
    }
}

/// What is known of a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Label {
    /// What made the point.
    pub cause: Cause,
    /// The object that the point came from, 0 when no object made it.
    pub object_id: u32,
    /// Reflections of that object's echo that contributes most.
    pub bounces: u8,
    /// Whether that echo touched several actors and the point stands off all of them, in the echo's main lobe (eq. 160).
    pub ghost: bool,
    /// Whether the point lies in a side lobe of that echo: in range, range rate or direction it is not where the echo is.
    pub side_lobe: bool,
    /// The object's share of the point's power, 0 to 1 (eq. 160).
    pub share: f64,
}

/// Least share of a point's power that echoes have to bring so that the point is not noise.
const LEAST_EXPLAINED: f64 = 0.1;
/// Echoes that can bring less than this share of a point's power are not followed through the array.
const LEAST_ECHO: f64 = 1e-6;

/// Labels the points of one frame. An object's part in a point is the power of the coherent sum of its echoes as the
/// radar's own windows and array deliver them to the point's cell and direction, departure and arrival each at their
/// own antennas (eq. 160). A flat road that sums to little there thus does not outweigh a car.
pub struct Labeller<'a> {
    echoes: Vec<LabelEcho>,
    bodies: &'a Bodies,
    response: Arc<Response>,
    chain: Chain,
}

/// An object's echoes in one point.
#[derive(Default)]
struct Part<'e> {
    sum: Complex64,
    /// The strongest.
    most: f64,
    echo: Option<&'e LabelEcho>,
}

impl<'a> Labeller<'a> {
    /// Gathers a frame's echoes, with the bodies that they come from.
    ///
    /// # Errors
    /// Returns an error if a window of the radar's settings cannot be computed.
    pub fn new(radar: &Radar, echoes: &Echoes, bodies: &'a Bodies) -> Result<Labeller<'a>> {
        let k = wavenumber(radar.carrier_hz);
        let levels = Levels::new(radar);
        let chain = Chain::new(radar, &radar.front_end);
        let echoes: Vec<LabelEcho> = echoes
            .list
            .par_iter()
            .filter(|r| passes(radar, r))
            .map_tasks(|r| LabelEcho {
                place: EchoPlace {
                    range_m: r.range_m(),
                    range_rate_mps: r.range_rate_mps(),
                    departure: r.departure,
                    arrival: r.arrival,
                },
                object: object_of(r, |id| bodies.class(id)),
                amplitude: levels.amplitude(r).conj()
                    * Complex64::cis(k * r.path_length_m)
                    * filters(&chain, r.path_length_m / C0),
                chain: r.chain,
                bounces: r.bounces,
            })
            .collect();
        Ok(Labeller { echoes, bodies, response: Response::of(radar)?, chain })
    }

    /// What the echoes of this frame say of a point.
    pub fn label(&self, point: &Point) -> Label {
        if self.echoes.is_empty() && self.bodies.objects.is_empty() {
            return Label::default();
        }
        let response = self.response.to(point);
        let measured_w = w_from_dbm(point.power_dbm);
        let mut parts = BTreeMap::<u32, Part>::new();
        for e in &self.echoes {
            let in_cell = e.amplitude * response.cell(e.place.range_m, e.place.range_rate_mps);
            if in_cell == Complex64::ZERO || in_cell.norm_sqr() < LEAST_ECHO * measured_w {
                continue;
            }
            let amplitude = in_cell * response.array(&e.place);
            let part = parts.entry(e.object).or_default();
            part.sum += amplitude;
            if amplitude.norm_sqr() > part.most {
                (part.most, part.echo) = (amplitude.norm_sqr(), Some(e));
            }
        }
        let total: f64 = parts.values().map(|p| p.sum.norm_sqr()).sum();
        let inside = |delay_s: f64| filters(&self.chain, delay_s);
        let leaked =
            self.chain.spills.iter().map(|s| response.spill(s, inside)).sum::<Complex64>().norm_sqr();
        if total.max(leaked) < LEAST_EXPLAINED * measured_w || total.max(leaked) == 0.0 {
            return Label { cause: Cause::Noise, ..Label::default() };
        }
        if leaked > total {
            return Label { cause: Cause::Leakage, ..Label::default() };
        }
        let mut best: Option<(u32, &Part)> = None;
        for (id, part) in &parts {
            if part.sum.norm_sqr() > best.map_or(0.0, |b| b.1.sum.norm_sqr()) {
                best = Some((*id, part));
            }
        }
        let Some((object_id, part)) = best else { return Label::default() };
        let Some(echo) = part.echo else { return Label::default() };
        let side_lobe = response.is_side_lobe(&echo.place);
        let off = || self.bodies.is_ghost(point, &echo.chain, 0.5 * self.response.range_cell_m());
        Label {
            cause: if object_id == 0 { Cause::Weather } else { Cause::Object },
            object_id,
            bounces: echo.bounces,
            ghost: !side_lobe && off(),
            side_lobe,
            share: part.sum.norm_sqr() / total,
        }
    }
}

/// Gain of the front end's filters at the beat of a delay.
fn filters(chain: &Chain, delay_s: f64) -> Complex64 {
    let f = &chain.settings.filters;
    if f.is_off() { Complex64::ONE } else { f.gain(chain.timing.beat_hz(delay_s)) }
}

/// Labels points: `bodies` gives classes and places; `echoes` are those of this frame. Without both the samples came
/// from elsewhere, and labels stay empty.
///
/// # Errors
/// Returns an error if a window of the radar's settings cannot be computed.
pub fn label(radar: &Radar, points: &mut [Point], echoes: &Echoes, bodies: &Bodies) -> Result<()> {
    let labeller = Labeller::new(radar, echoes, bodies)?;
    points.par_iter_mut().for_each_tasks(|p| {
        let label = labeller.label(p);
        p.object_id = label.object_id;
        p.class = match label.cause {
            Cause::Object => bodies.class(label.object_id),
            other => other.class(),
        }
        .to_string();
        (p.bounces, p.ghost, p.side_lobe, p.share) =
            (label.bounces, label.ghost, label.side_lobe, label.share);
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a search over a fine grid of the box.
    #[test]
    fn the_nearest_place_of_a_box() {
        let (lower, upper) = (DVec3::new(-2.0, -1.0, 0.0), DVec3::new(2.0, 1.0, 1.5));
        let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.3);
        let a = DMat3::from_diagonal(DVec3::new(9.0, 1.5, 0.4)) * turn;
        for (i, p) in
            [[0.5, 0.5, 0.5], [4.0, 0.0, 1.0], [3.0, 3.0, -2.0], [-2.5, 0.2, 4.0], [-9.0, -8.0, 0.0]]
                .into_iter()
                .enumerate()
        {
            let b = a * DVec3::from_array(p);
            let got = least_over_box(&a, b, lower, upper);
            let n = 60;
            let mut want = f64::INFINITY;
            for k in 0..(n + 1) * (n + 1) * (n + 1) {
                let at = DVec3::new(
                    (k % (n + 1)) as f64,
                    (k / (n + 1) % (n + 1)) as f64,
                    (k / (n + 1) / (n + 1)) as f64,
                );
                want = want.min((a * (lower + at / n as f64 * (upper - lower)) - b).length());
            }
            assert!(got <= want + 1e-9, "{got} {want}");
            assert!(i > 0 || got < 1e-12, "a place inside");
            // One step of the grid is at most |A| times its diagonal.
            assert!(want - got < 9.0 * (upper - lower).length() / n as f64, "{got} {want}");
        }
    }
}
