//! Labels of points: the object that a point came from, by the response of the radar's own windows and array to the frame's
//! echoes, and whether the point is where that object is (CONVENTIONS eq. 160):
//!
//! 1. the echoes of each object are summed as the map and the array sum them, and the object with the largest sum owns the point;
//! 2. the point's cell and direction are compared with those of the object's strongest echo there: side lobe, aliased;
//! 3. with wrong Doppler ambiguity intervals taken out, the point is compared with the object's box or surface: ghost;
//! 4. what is left out of place for an ambiguity is folded. A point that no echo explains is leakage or noise.

use super::bodies::{Bodies, Place};
use super::points::Point;
use super::response::{EchoPath, Offset, PointResponse, Response};
use crate::adc::front_end::Chain;
use crate::adc::synthesis::{Levels, passes};
use crate::base::error::Result;
use crate::base::tasks::Tasks;
use crate::base::units::{C0, w_from_dbm};
use crate::road::actors::is_ground;
use crate::scene::radar::Radar;
use crate::trace::{Echo, Echoes};
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Classes of structures along the road that reflect the traffic.
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

/// One echo, reduced to what labelling needs.
struct LabelEcho {
    path: EchoPath,
    object: u32,
    /// Conjugate of a e^{−jkL} of eq. 9, as a mixer delivers it, behind the filters, in the middle of the chirps.
    amplitude: Complex64,
    bounces: u8,
}

impl LabelEcho {
    fn power_w(&self) -> f64 {
        self.amplitude.norm_sqr()
    }
}

/// The cause of a point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Cause {
    /// Nothing is known of the scene: the samples came from elsewhere.
    #[default]
    Unknown,
    /// Echoes of an object.
    Object,
    /// Echoes of rain or fog.
    Weather,
    /// The path from transmitter to receiver inside the radar or by its cover.
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

/// The label of a point. At most one of `side_lobe`, `aliased`, `ghost` and `folded` is set: the first that applies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Label {
    /// The cause of the point.
    pub cause: Cause,
    /// The object that the point came from, 0 when no object made it.
    pub object_id: u32,
    /// Reflections of that object's echo that contributes most.
    pub bounces: u8,
    /// Whether that echo is of several reflections and the point is off the object, in the echo's main lobe (eq. 160).
    pub ghost: bool,
    /// Whether the point is in a side lobe of that echo: in range, range rate or direction it is not where the echo is.
    pub side_lobe: bool,
    /// Whether the point is out of place by a whole ambiguity: its range rate is in a wrong Doppler ambiguity interval, which
    /// moves its range by more than half a resolution cell and off its object, its range is beyond the period of pulses or
    /// codes, or its direction is a grating lobe of the array (eq. 160a).
    pub folded: bool,
    /// Whether the echo's beat frequency is outside of the sampled band, into which it is aliased (eq. 160a).
    pub aliased: bool,
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

/// What all objects and the leakage bring to a place of the map.
#[derive(Default)]
struct Parts<'e> {
    parts: BTreeMap<u32, Part<'e>>,
    /// Sum of the powers of the objects, W.
    total_w: f64,
    leaked_w: f64,
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
        let response = Response::of(radar)?;
        let levels = Levels::new(radar);
        let chain = Chain::new(radar, &radar.front_end);
        let mut echoes: Vec<LabelEcho> = echoes
            .list
            .par_iter()
            .filter(|r| passes(radar, r))
            .map_tasks(|r| {
                let [acceleration, jerk] = r.path_acceleration_and_jerk;
                let path = response.path(
                    [r.path_length_m, r.path_rate_mps, acceleration, jerk],
                    r.departure,
                    r.arrival,
                );
                let filtered = levels.amplitude(r).conj() * filters(&chain, r.path_length_m / C0);
                LabelEcho {
                    path,
                    object: object_of(r, |id| bodies.class(id)),
                    amplitude: filtered * response.phase(&path),
                    bounces: r.bounces,
                }
            })
            .collect();
        if response.has_images() {
            let images: Vec<LabelEcho> = echoes
                .iter()
                .map(|e| LabelEcho { path: e.path.image(), amplitude: e.amplitude.conj(), ..*e })
                .collect();
            echoes.extend(images);
        }
        // The strongest first, so that those too weak for a point are skipped at once.
        echoes.par_sort_by(|a, b| b.power_w().total_cmp(&a.power_w()));
        Ok(Labeller { echoes, bodies, response, chain })
    }

    /// Labels a point by the echoes of this frame.
    pub fn label(&self, point: &Point) -> Label {
        if self.echoes.is_empty() && self.bodies.is_empty() {
            return Label::default();
        }
        let response = self.response.to(point);
        let measured_w = w_from_dbm(point.power_dbm);
        let mut parts = self.parts(&response, measured_w);
        let least_w = LEAST_EXPLAINED * measured_w;
        if parts.total_w.max(parts.leaked_w) < least_w {
            // The place between cells is that of a lone tone's peak; among side lobes it may be at a null beside the cell.
            let around = [(-0.5, 0.0), (0.5, 0.0), (0.0, -0.5), (0.0, 0.5)];
            let beside = around.map(|(r, v)| self.parts(&response.beside(r, v), measured_w));
            let largest = |p: &Parts<'_>| p.total_w.max(p.leaked_w);
            let most = beside.into_iter().max_by(|a, b| largest(a).total_cmp(&largest(b)));
            parts = most.filter(|p| largest(p) >= least_w).unwrap_or_default();
        }
        let Parts { parts, total_w: total, leaked_w: leaked } = parts;
        if total.max(leaked) == 0.0 {
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
        let offset = response.offset(&echo.path);
        let Flags { side_lobe, aliased, ghost, folded } = self.flags(point, object_id, echo, &offset);
        Label {
            cause: if object_id == 0 { Cause::Weather } else { Cause::Object },
            object_id,
            bounces: echo.bounces,
            ghost,
            side_lobe,
            folded,
            aliased,
            share: part.sum.norm_sqr() / total,
        }
    }

    fn parts(&self, response: &PointResponse<'_>, measured_w: f64) -> Parts<'_> {
        let mut parts = BTreeMap::<u32, Part>::new();
        let least_w = LEAST_ECHO * measured_w;
        let strong = self.echoes.partition_point(|e| e.power_w() >= least_w);
        for e in &self.echoes[..strong] {
            if e.power_w() * response.bound(&e.path).powi(2) < least_w {
                continue;
            }
            let in_cell = e.amplitude * response.cell(&e.path);
            if in_cell.norm_sqr() < least_w {
                continue;
            }
            let amplitude = in_cell * response.array(&e.path);
            let part = parts.entry(e.object).or_default();
            part.sum += amplitude;
            if amplitude.norm_sqr() > part.most {
                (part.most, part.echo) = (amplitude.norm_sqr(), Some(e));
            }
        }
        let inside = |delay_s: f64| filters(&self.chain, delay_s);
        let leaked = self.chain.spills.iter().map(|s| response.spill(s, inside)).sum::<Complex64>();
        Parts { total_w: parts.values().map(|p| p.sum.norm_sqr()).sum(), leaked_w: leaked.norm_sqr(), parts }
    }

    fn flags(&self, point: &Point, object: u32, echo: &LabelEcho, offset: &Offset) -> Flags {
        let none = Flags::default();
        if offset.side_lobe {
            return Flags { side_lobe: true, ..none };
        }
        if offset.aliased {
            return Flags { aliased: true, ..none };
        }
        let half_cell_m = 0.5 * self.response.range_cell_m();
        // By how much a wrong Doppler ambiguity interval moves the point outwards.
        let excess_m = offset.doppler_intervals * self.response.ambiguity_mps() * self.response.coupling_s();
        let place = match offset.grating_lobe || offset.beyond_period {
            true => Place::of_echo(&echo.path, point, half_cell_m),
            false => Place::of(point, excess_m, half_cell_m),
        };
        if echo.bounces > 1 && object != 0 && self.bodies.is_off(object, &place) {
            return Flags { ghost: true, ..none };
        }
        // The direction is that of the search's edge, and the object beyond it.
        if point.at_search_edge && self.bodies.is_off(object, &Place::as_stated(point, half_cell_m)) {
            return Flags { side_lobe: true, ..none };
        }
        let is_moved =
            excess_m.abs() > half_cell_m && self.bodies.is_off(object, &Place::of(point, 0.0, half_cell_m));
        let folded = offset.beyond_period || offset.grating_lobe || is_moved;
        Flags { folded, ..none }
    }
}

/// Why a point is not where its object is; at most one is set.
#[derive(Default)]
struct Flags {
    side_lobe: bool,
    aliased: bool,
    ghost: bool,
    folded: bool,
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
        (p.bounces, p.share) = (label.bounces, label.share);
        (p.ghost, p.side_lobe, p.folded, p.aliased) =
            (label.ghost, label.side_lobe, label.folded, label.aliased);
    });
    Ok(())
}
