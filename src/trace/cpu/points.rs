//! Echoes of point targets and of objects with a scattering table: no facets, so both engines take them from
//! here.

use super::bend::{Bends, End, Mirror, PathEnd};
use super::boundary::Plane;
use super::field::{Bounce, CVec, sent};
use crate::base::frames::{Pose, Sensor, World, polarisation_basis};
use crate::base::matrix::Matrix2;
use crate::base::units::wavenumber;
use crate::geom::faces::NOT_CURVED;
use crate::geom::outline::outline;
use crate::geom::{Geometry, Shift};
use crate::trace::{Echo, MAX_BOUNCES, TraceOptions};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A plane that mirrors what stands before it.
pub struct Reflecting {
    /// A face of it, whose axes the outline is in.
    pub face: u32,
    /// Sides, inside on the left, m.
    pub outline: Vec<[DVec2; 2]>,
    /// Whether the radar sees all within the outline. Otherwise it has to see the place of mirror reflection.
    pub is_seen: bool,
}

/// The planes of a geometry, whether the radar sees them or not.
fn planes(geometry: &Geometry) -> Vec<Reflecting> {
    let faces = geometry.faces();
    let mut of_patch: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (i, face) in faces.faces.iter().enumerate().filter(|(_, f)| f.curved == NOT_CURVED) {
        of_patch.entry(face.patch).or_default().push(i as u32);
    }
    let plane = |list: Vec<u32>| {
        let first = &faces.faces[list[0] as usize];
        let corner = faces.corners[first.first as usize];
        let on = |p: &DVec3| DVec2::new(first.axis[0].dot(*p - corner), first.axis[1].dot(*p - corner));
        let polygons: Vec<Vec<DVec2>> =
            list.iter().map(|i| faces.corners(&faces.faces[*i as usize]).iter().map(on).collect()).collect();
        let outline = outline(polygons.iter().map(|p| &p[..]), SAME * faces.radius_m);
        Reflecting { face: list[0], outline, is_seen: false }
    };
    of_patch.into_values().map(plane).collect()
}

/// Echoes of the point targets (S = sqrt(sigma / 4 pi) on both polarisations, whatever the directions) and of the scattering
/// tables, from their origins, straight and, with `options.images`, over the planes that mirror them, in all combinations of ways out and
/// back (CONVENTIONS eq. 65, 65a). Ways that something blocks are left out; these targets themselves hide nothing. A table knows
/// no scattering from one direction into another: there it is asked for the direction halfway.
pub fn point_echoes(
    geometry: &Geometry,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Vec<Echo> {
    let planes = if options.images { planes(geometry) } else { Vec::new() };
    point_echoes_over(&planes, geometry, pose, velocity_mps, options)
}

/// Computes the echoes of points with ways over these planes also.
pub fn point_echoes_over(
    mirrors: &[Reflecting],
    geometry: &Geometry,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Vec<Echo> {
    let bends = Bends::new(geometry, pose.translation_m, velocity_mps, options);
    let radar = Radar { geometry, pose, velocity_mps, bends, mirrors, places: options.places };
    let points = geometry.points.iter().flat_map(|p| {
        let s = (crate::base::units::power_from_db(p.rcs_dbsm) / (4.0 * PI)).sqrt();
        let target =
            Target { id: p.id, place_m: p.position_m, velocity_mps: p.velocity_mps, shifts: &p.shifts };
        radar.echoes(target, &|tx, rx| [0, 1].map(|r| [0, 1].map(|t| rx.field[r].times(&tx.field[t]) * s)))
    });
    let tables = geometry.tables.iter().flat_map(|t| {
        let target =
            Target { id: t.id, place_m: t.position_m, velocity_mps: t.velocity_mps, shifts: &t.shifts };
        radar.echoes(target, &|tx, rx| {
            let u = -(tx.dir + rx.dir).normalize_or(tx.dir);
            let (v, h) = polarisation_basis(u);
            let s = t.scattering(&t.band, u, (v, h));
            let on = |way: &Leg, i: usize| [v, h].map(|e| way.field[i].dot(e));
            [0, 1].map(|r| {
                [0, 1].map(|i| {
                    let (seen, sent) = (on(rx, r), on(tx, i));
                    (0..2).map(|a| seen[a] * (s[a][0] * sent[0] + s[a][1] * sent[1])).sum()
                })
            })
        })
    });
    points.chain(tables).collect()
}

/// A leg from the radar to a target.
struct Leg<'a> {
    /// Direction from the radar, unit (world).
    out: DVec3,
    /// Length to the first place, and of the whole leg, m.
    first_range_m: f64,
    length_m: f64,
    /// Where it arrives.
    dir: DVec3,
    /// Fields there of V and H at the radar.
    field: [CVec; 2],
    /// The mirror and where it is met.
    by: Option<Mirror<'a>>,
}

/// Corners nearer to one another than this share of the scene's radius are one.
pub(super) const SAME: f64 = 1e-9;
/// As the tau of exact beams at an accuracy of 0.05 dB.
pub(super) const TAU: f64 = 0.125;

struct Radar<'a> {
    geometry: &'a Geometry,
    pose: &'a Pose<Sensor, World>,
    velocity_mps: DVec3,
    bends: Bends,
    mirrors: &'a [Reflecting],
    /// As `TraceOptions::places`.
    places: bool,
}

#[derive(Clone, Copy)]
struct Target<'a> {
    id: u32,
    place_m: DVec3,
    velocity_mps: DVec3,
    shifts: &'a [Shift; 2],
}

impl Radar<'_> {
    fn straight(&self, target: DVec3) -> Option<Leg<'_>> {
        let d = target - self.pose.translation_m;
        let r = d.length();
        if r <= self.geometry.t_min_m || !self.geometry.sees(self.pose.translation_m, target) {
            return None;
        }
        let dir = d / r;
        Some(Leg { out: dir, first_range_m: r, length_m: r, dir, field: sent(self.pose, dir), by: None })
    }

    fn over(&self, mirror: &Reflecting, target: DVec3) -> Option<Leg<'_>> {
        let (radar, geometry) = (self.pose.translation_m, self.geometry);
        let faces = geometry.faces();
        let face = &faces.faces[mirror.face as usize];
        let height = |p: DVec3| face.normal.dot(p) - face.offset_m;
        let (from, to) = (height(radar), height(target));
        let in_front = |h: f64| h > 0.0 || !face.one_sided;
        if from * to <= 0.0 || !in_front(from) {
            return None;
        }
        let k = wavenumber(geometry.freq_hz);
        let corner = faces.corners[face.first as usize];
        let feet =
            [radar, target].map(|p| p - corner).map(|d| DVec2::new(face.axis[0].dot(d), face.axis[1].dot(d)));
        let plane = Plane::new(k, feet, [from.abs(), to.abs()], TAU, f64::INFINITY);
        let (share, spot) = plane.share(&mirror.outline)?;
        let spot = corner + face.axis[0] * spot.x + face.axis[1] * spot.y;
        if !geometry.sees(target, spot) || !(mirror.is_seen || geometry.sees(radar, spot)) {
            return None;
        }
        let image = radar - face.normal * (2.0 * from);
        let d = target - image;
        let length_m = d.length();
        let foot = image + d * (from / (from + to));
        let first_range_m = radar.distance(foot);
        let out = (foot - radar) / first_range_m;
        let normal = face.normal * from.signum();
        let surface = &geometry.surfaces[face.surface as usize];
        let bounce = Bounce::new(sent(self.pose, out), out, normal, surface, k);
        let by = Some(Mirror { body: &geometry.bodies[face.body as usize], place_m: foot, normal });
        let field = bounce.reflected.map(|e| e.scaled(share));
        Some(Leg { out, first_range_m, length_m, dir: d / length_m, field, by })
    }

    fn echoes(&self, target: Target, scattering: &dyn Fn(&Leg, &Leg) -> Matrix2) -> Vec<Echo> {
        let mut ways: Vec<Leg> = self.straight(target.place_m).into_iter().collect();
        ways.extend(self.mirrors.iter().filter_map(|m| self.over(m, target.place_m)));
        let rate = |w: &Leg| {
            let mirror = w.by.map_or(DVec3::ZERO, |m| m.body.velocity_at(m.place_m));
            target.velocity_mps.dot(w.dir) - self.velocity_mps.dot(w.out) + mirror.dot(w.out - w.dir)
        };
        let to_sensor = self.pose.rotation.inverse();
        let mut list = Vec::with_capacity(ways.len() * ways.len());
        for back in &ways {
            for out in &ways {
                let mut chain = [0; MAX_BOUNCES];
                let met = out.by.iter().map(|m| m.body.id);
                let met = met.chain([target.id]).chain(back.by.iter().map(|m| m.body.id));
                let mut bounces = 0;
                for (place, id) in chain.iter_mut().zip(met) {
                    *place = id;
                    bounces += 1;
                }
                let lengths = out.length_m * back.length_m;
                let length_m = out.length_m + back.length_m;
                let end = End { shifts: target.shifts, place_m: target.place_m, keeps: PathEnd::Place };
                let motion = self.bends.of(
                    [out.by.as_slice(), back.by.as_slice()],
                    end,
                    length_m,
                    [out.first_range_m, back.first_range_m],
                    rate(out) + rate(back),
                );
                let [first_mps, last_mps] = motion.velocities_mps;
                list.push(Echo {
                    path_length_m: length_m,
                    path_rate_mps: motion.rate_mps,
                    path_acceleration_and_jerk: motion.acceleration_and_jerk,
                    departure: to_sensor * out.out,
                    first_range_m: out.first_range_m,
                    first_velocity_mps: to_sensor * first_mps,
                    arrival: to_sensor * back.out,
                    last_range_m: back.first_range_m,
                    last_velocity_mps: to_sensor * last_mps,
                    path_gain: scattering(out, back).map(|row| row.map(|z| z / lengths)),
                    chain,
                    bounces,
                    between_m: match bounces {
                        3 if self.places => [to_sensor * (target.place_m - self.pose.translation_m)].into(),
                        _ => Box::default(),
                    },
                });
            }
        }
        list
    }
}
