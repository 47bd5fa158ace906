//! Which object a point came from, by the echoes that fall into its cell.

use super::points::Point;
use crate::adc::synthesis::{Levels, passes};
use crate::frames::direction_from_angles;
use crate::scene::Object;
use crate::scene::radar::Radar;
use crate::trace::{Return, Returns};
use crate::units::{C0, wavenumber};
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::FRAC_PI_2;

/// Classes that a path may touch on its way to what it is an echo of.
pub const SURFACES: [&str; 4] = ["road", "verge", "ground", "terrain"];

/// The object that a chain of bounces is an echo of: the first in it that is not a road surface,
/// else the first; 0 for an empty chain.
pub fn object_of<'a>(r: &Return, class: impl Fn(u32) -> &'a str) -> u32 {
    let chain = || r.chain.iter().copied().take_while(|id| *id != 0);
    chain().find(|id| !SURFACES.contains(&class(*id))).or_else(|| chain().next()).unwrap_or(0)
}

/// One echo, reduced to what labelling needs.
struct Echo {
    range_m: f64,
    range_rate_mps: f64,
    /// y of the direction, mean of departure and arrival.
    sine: f64,
    object: u32,
    amplitude: Complex64,
}

/// Labels the points of one frame. An object's share of a point is the power of the coherent sum of
/// its echoes within one resolution of the point in range, range rate (modulo the ambiguity) and
/// azimuth, each weighted by cos² of its distance on each axis, much as a Hann window's cell
/// does. A flat road that sums to little there thus does not outweigh a car.
pub struct Labeller {
    /// By range.
    echoes: Vec<Echo>,
    classes: HashMap<u32, String>,
    range_m: f64,
    range_rate_mps: f64,
    ambiguity_mps: f64,
    /// In sines; infinite for one column of channels.
    sine: f64,
}

impl Labeller {
    pub fn new(radar: &Radar, returns: &Returns, objects: &[Object]) -> Labeller {
        let classes: HashMap<u32, String> = objects.iter().map(|o| (o.id, o.class.clone())).collect();
        let class = |id: u32| classes.get(&id).map_or("", String::as_str);
        let k = wavenumber(radar.carrier_hz);
        let levels = Levels::new(radar);
        let mut echoes: Vec<Echo> = returns
            .returns
            .par_iter()
            .filter(|r| passes(radar, r))
            .map(|r| Echo {
                range_m: r.range_m(),
                range_rate_mps: r.range_rate_mps(),
                sine: 0.5 * (r.departure.y + r.arrival.y),
                object: object_of(r, class),
                amplitude: levels.amplitude(r) * Complex64::cis(-k * r.path_length_m),
            })
            .filter(|e| e.object != 0)
            .collect();
        // Stable, so that equal ranges keep their order and sums repeat.
        echoes.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
        let lines = radar.lines();
        let sampled_hz = lines.step_hz.abs() * lines.count as f64;
        Labeller {
            echoes,
            range_m: C0 / (2.0 * sampled_hz),
            range_rate_mps: radar.wavelength_m() / (2.0 * radar.frame_time_s()),
            ambiguity_mps: 2.0 * radar.max_velocity_mps(),
            sine: sine_resolution(radar),
            classes,
        }
    }

    /// The object's class; "" when it has none.
    pub fn class(&self, object: u32) -> &str {
        self.classes.get(&object).map_or("", String::as_str)
    }

    /// The object that the point came from, 0 when no echo is near.
    pub fn label(&self, point: &Point) -> u32 {
        let sine = direction_from_angles(point.azimuth_rad, point.elevation_rad).y;
        let first = self.echoes.partition_point(|e| e.range_m <= point.range_m - self.range_m);
        let mut sums = BTreeMap::<u32, Complex64>::new();
        for e in self.echoes[first..].iter().take_while(|e| e.range_m < point.range_m + self.range_m) {
            let rate = e.range_rate_mps - point.range_rate_mps;
            let rate = rate - self.ambiguity_mps * (rate / self.ambiguity_mps).round();
            let weight = share((e.range_m - point.range_m) / self.range_m)
                * share(rate / self.range_rate_mps)
                * share((e.sine - sine) / self.sine);
            if weight > 0.0 {
                *sums.entry(e.object).or_default() += weight * e.amplitude;
            }
        }
        let mut best = (0, 0.0);
        for (object, sum) in sums {
            if sum.norm_sqr() > best.1 {
                best = (object, sum.norm_sqr());
            }
        }
        best.0
    }
}

/// cos² from 1 in the middle to 0 at ±1.
fn share(x: f64) -> f64 {
    if x.abs() < 1.0 { (FRAC_PI_2 * x).cos().powi(2) } else { 0.0 }
}

/// λ over the virtual array's width, counting half an element's spacing at each end.
fn sine_resolution(radar: &Radar) -> f64 {
    let mut y: Vec<f64> =
        radar.tx.iter().flat_map(|t| radar.rx.iter().map(move |r| t.position_m.y + r.position_m.y)).collect();
    y.sort_by(f64::total_cmp);
    y.dedup_by(|a, b| (*a - *b).abs() < 1e-3 * radar.wavelength_m());
    let n = y.len() as f64;
    if y.len() < 2 {
        return f64::INFINITY;
    }
    radar.wavelength_m() / ((y[y.len() - 1] - y[0]) * n / (n - 1.0))
}
