//! What the limit of bounces cuts off (CONVENTIONS eq. 68).
//!
//! The beams that it ends would go on. What the next bounce of each of them would return is worked out as if its middle stood for
//! all of it: enough to say how much power is missing, and where to look for it.

use super::beams::{Clipped, Ended};
use crate::base::frames::{Pose, Sensor, World};
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::geom::Geometry;
use crate::geom::faces::NOT_CURVED;
use crate::geom::hash::FastMap;
use crate::trace::{Echo, MAX_BOUNCES};
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::{PI, SQRT_2};

/// The echo of one bounce more of the beams that the limit ended, where the radar sees the place of that bounce: right in size, and of
/// both polarisations alike. Beams that went over the same planes to the same one are one echo, that of the strongest of them.
pub fn estimates(geometry: &Geometry, clipped: &Clipped, pose: &Pose<Sensor, World>) -> Vec<Echo> {
    let faces = geometry.faces();
    let patch = |face: u32| faces.faces[face as usize].patch;
    let all: Vec<Option<Estimate>> =
        clipped.ended.par_iter().map_tasks(|e| estimate(geometry, clipped, pose, e)).collect();
    let mut of_way: FastMap<[u32; MAX_BOUNCES + 1], usize> = FastMap::default();
    let mut ways: Vec<Estimate> = Vec::new();
    for (e, estimate) in clipped.ended.iter().zip(all).filter_map(|(e, x)| Some((e, x?))) {
        let mut way = [u32::MAX; MAX_BOUNCES + 1];
        way[0] = patch(e.face);
        let parent = |i: u32| Some(clipped.nodes[i as usize].parent).filter(|p| *p != u32::MAX);
        for (at, node) in way[1..].iter_mut().zip(std::iter::successors(Some(e.node), |i| parent(*i))) {
            *at = patch(clipped.nodes[node as usize].face);
        }
        let new = ways.len();
        match ways.get_mut(*of_way.entry(way).or_insert(new)) {
            Some(sum) => {
                sum.amplitude += estimate.amplitude;
                if estimate.strongest > sum.strongest {
                    let amplitude = sum.amplitude;
                    *sum = Estimate { amplitude, ..estimate };
                }
            }
            None => ways.push(estimate),
        }
    }
    ways.into_iter().map(Estimate::echo).collect()
}

/// What one bounce more returns of a beam, or of all on one way.
struct Estimate {
    /// Sum of what the beams return, 1/m.
    amplitude: Complex64,
    /// Largest of them, 1/m.
    strongest: f64,
    /// What the whole mirror would return at most, 1/m.
    most: f64,
    /// The strongest echo, without its amplitude.
    at: Echo,
}

impl Estimate {
    fn echo(self) -> Echo {
        // No plane returns more than the whole mirror.
        let size = Complex64::from(self.amplitude.norm().min(self.most));
        Echo { path_gain: [[size, Complex64::ZERO], [Complex64::ZERO, size]], ..self.at }
    }
}

fn estimate(
    geometry: &Geometry,
    clipped: &Clipped,
    pose: &Pose<Sensor, World>,
    e: &Ended,
) -> Option<Estimate> {
    let (faces, radar) = (geometry.faces(), pose.translation_m);
    let k = wavenumber(geometry.freq_hz);
    let target = &faces.faces[e.face as usize];
    let [way, back] = [e.place - e.image, e.place - radar];
    let [out_m, back_m] = [way, back].map(DVec3::length);
    let (arrives, leaves) = (way / out_m, -back / back_m);
    let cos_i = arrives.dot(target.normal).abs();
    if arrives.dot(target.normal) * leaves.dot(target.normal) >= 0.0 || cos_i == 0.0 {
        return None;
    }
    // A disc of the same area, on average over the directions about its mirror direction.
    let area_m2 = e.solid_angle_sr * out_m * out_m / cos_i;
    let steep = arrives - leaves;
    let along = (steep - target.normal * steep.dot(target.normal)).length();
    let x = k * along * (area_m2 / PI).sqrt();
    let lobe = 1.0 / (1.0 + PI / 8.0 * x.powi(3));
    let disc = k * e.solid_angle_sr * out_m / (2.0 * PI * back_m) * lobe.sqrt();
    // A curved surface returns the same over the planes backwards, which no beam of its own shows, and where the chain begins with a mirror
    // of what follows also over that.
    let ways = match (target.curved == NOT_CURVED, clipped.nodes[e.node as usize].imaged) {
        (true, _) => 1.0,
        (false, false) => 2.0,
        (false, true) => 2.0 * SQRT_2,
    };
    let size = ways * e.left * disc;
    if !size.is_finite() || size <= 0.0 || !geometry.sees(e.place, radar) {
        return None;
    }
    let mut chain = [0; MAX_BOUNCES];
    let id = |face: u32| geometry.bodies[faces.faces[face as usize].body as usize].id;
    let bounces = clipped.nodes[e.node as usize].bounce as usize;
    let (mut node, mut number) = (e.node, bounces);
    let first = loop {
        let at = &clipped.nodes[node as usize];
        number -= 1;
        chain[number] = id(at.face);
        if at.parent == u32::MAX {
            break at;
        }
        node = at.parent;
    };
    if let Some(last) = chain.get_mut(bounces) {
        *last = id(e.face);
    }
    let face = &faces.faces[first.face as usize];
    let nearness = first.frame.nearness(face.normal, face.offset_m);
    let to_sensor = pose.rotation.inverse();
    let at = Echo {
        path_length_m: out_m + back_m,
        path_rate_mps: 0.0,
        path_acceleration_and_jerk: [0.0; 2],
        departure: to_sensor * first.frame.direction(e.middle),
        first_range_m: first.frame.lift(e.middle, nearness).distance(radar),
        first_velocity_mps: DVec3::ZERO,
        arrival: to_sensor * (back / back_m),
        last_range_m: back_m,
        last_velocity_mps: DVec3::ZERO,
        path_gain: [[Complex64::ZERO; 2]; 2],
        chain,
        bounces: (bounces + 1).min(MAX_BOUNCES) as u8,
        between_m: Box::default(),
    };
    let most = ways * e.left / (out_m + back_m);
    Some(Estimate {
        amplitude: Complex64::from_polar(size, -k * (out_m + back_m)),
        strongest: size,
        most,
        at,
    })
}
