//! Physical-optics integrals over flat lit regions at finite range, as waves from the place of mirror
//! reflection, from the sides and from the corners of the region (CONVENTIONS eq. 60-63).

use glam::DVec2;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// A part of the integral: `value` exp(-j k `length_m`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Place in the plane, m.
    pub place: DVec2,
    /// Length of both ways, m.
    pub length_m: f64,
    /// Value of this part of the integral, m².
    pub value: Complex64,
    /// The same part of the integral of exp(-j k L) times the gradient of L.
    pub flux: [Complex64; 2],
    /// What its place stays with.
    pub holds: Holds,
}

/// What of the region a wave comes from, and goes with when the stations move.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Holds {
    /// A corner, or a side so short that it is one.
    #[default]
    Corner,
    /// A part of a side about its nearest place: unit vector along it.
    Side(DVec2),
    /// The place of mirror reflection.
    Mirror,
}

/// A plane between a source and a receiver, both in front of it.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// Wavenumber, rad/m.
    pub k: f64,
    /// Feet and heights of source and receiver.
    foot: [DVec2; 2],
    height: [f64; 2],
    /// Place of mirror reflection.
    pub mirror: DVec2,
    /// The path by way of it, m.
    pub mirror_m: f64,
    /// Isotropic coordinates about it: y = (p . stretch[0], p . stretch[1]) with L - L* = y^2 / 2 near it.
    stretch: [DVec2; 2],
    determinant: f64,
    tau: f64,
    /// Half the spread of path lengths that one wave may stand for.
    spread_m: f64,
    /// How far source and receiver go while each wave has to stand for the same places, in the plane and over it.
    drift_m: [(DVec2, f64); 2],
}

/// Path length and its derivatives at a place.
pub struct Path {
    /// Length, m.
    pub length: f64,
    /// Derivative of the length along the plane's axes.
    pub slope: DVec2,
    /// xx, yy, xy
    pub bend: [f64; 3],
    /// Distance to the nearer station.
    pub nearest: f64,
}

impl Path {
    /// Derivative of the slope along a direction.
    pub fn bent(&self, d: DVec2) -> DVec2 {
        let [xx, yy, xy] = self.bend;
        DVec2::new(xx * d.x + xy * d.y, xy * d.x + yy * d.y)
    }
}

/// Stretches of a side over this share of the distance to a station are halved.
const LONGEST: f64 = 0.05;
/// Most radians by which the phase may run from the middle of a stretch to its ends.
pub(super) const RUN: f64 = 2.5;
/// Radians by which the phase may run over a stretch for the closed form about the place of mirror reflection: what it leaves out is
/// 5e-6 of the stretch's angle.
const STILL: f64 = 0.03;
/// Radians from the place of mirror reflection within which lengths are quadratic.
const LEAST_SQUARE: f64 = 1e-6;
/// The same where lengths are set off against one another, whose rounding counts.
const LEAST_LENGTH: f64 = 1e-3;
/// Nodes and weights of Gauss' rule of eight points.
pub(super) const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];
/// Radians from the place of mirror reflection up to which sides count in what a region brings of a mirror, and from which on they
/// do not: their waves come so much later, up to 0.15 m at 77 GHz.
const FADES: [f64; 2] = [60.0, 240.0];
/// Shares of a mirror's field below this are none.
const LEAST_SHARE: f64 = 0.005;
/// Rounding of the sum of angles.
const LEAST_TURN: f64 = 1e-9;
/// Times a side may be halved.
const DEPTH: u32 = 60;

impl Plane {
    /// `foot` and `height` of source and receiver over the plane (heights positive). Phases across a
    /// stretch of a side stay below about `tau`; no wave stands for paths whose lengths differ by more
    /// than 2 `spread_m`.
    pub fn new(k: f64, foot: [DVec2; 2], height: [f64; 2], tau: f64, spread_m: f64) -> Plane {
        let mirror = (foot[0] * height[1] + foot[1] * height[0]) / (height[0] + height[1]);
        let mut plane = Plane {
            k,
            foot,
            height,
            mirror,
            mirror_m: 0.0,
            stretch: [DVec2::X, DVec2::Y],
            determinant: 1.0,
            tau,
            spread_m: spread_m.min(RUN / k),
            drift_m: [(DVec2::ZERO, 0.0); 2],
        };
        let reach = |i: usize| (mirror.distance_squared(foot[i]) + height[i] * height[i]).sqrt();
        let (r, s) = (reach(0), reach(1));
        plane.mirror_m = r + s;
        let bend = (1.0 / r + 1.0 / s).sqrt();
        let cosine = height[0] / r;
        let along = (mirror - foot[0]).normalize_or(DVec2::X);
        plane.stretch = [along * (bend * cosine), along.perp() * bend];
        plane.determinant = bend * bend * cosine;
        plane
    }

    /// The plane for a source and a receiver that go so far, in the plane and over it: a wave stands for the same
    /// places all the way.
    pub fn drifting(self, drift_m: [(DVec2, f64); 2]) -> Plane {
        Plane { drift_m, ..self }
    }

    /// How much the slope of the path along a direction changes on the way of source and receiver.
    fn sway(&self, p: DVec2, along: DVec2) -> f64 {
        let mut sway = 0.0;
        for i in 0..2 {
            let (d, up) = (p - self.foot[i], self.height[i]);
            let (way, rise) = self.drift_m[i];
            let square = d.length_squared() + up * up;
            let towards = (d.dot(way) - up * rise) / square;
            sway += (d.dot(along) * towards - way.dot(along)) / square.sqrt();
        }
        sway.abs()
    }

    /// Distances of a place from source and receiver.
    pub fn ranges(&self, p: DVec2) -> [f64; 2] {
        [0, 1].map(|i| ((p - self.foot[i]).length_squared() + self.height[i] * self.height[i]).sqrt())
    }

    /// The path by way of a place of the plane.
    pub fn path(&self, p: DVec2) -> Path {
        let mut out = Path { length: 0.0, slope: DVec2::ZERO, bend: [0.0; 3], nearest: f64::INFINITY };
        for i in 0..2 {
            let d = p - self.foot[i];
            let r = (d.length_squared() + self.height[i] * self.height[i]).sqrt();
            let e = d / r;
            out.length += r;
            out.slope += e;
            out.bend[0] += (1.0 - e.x * e.x) / r;
            out.bend[1] += (1.0 - e.y * e.y) / r;
            out.bend[2] -= e.x * e.y / r;
            out.nearest = out.nearest.min(r);
        }
        out
    }

    /// Scale of the kernel: an angle divided by it is an area.
    fn measure(&self) -> f64 {
        self.k * self.determinant
    }

    fn isotropic(&self, p: DVec2) -> DVec2 {
        let d = p - self.mirror;
        DVec2::new(self.stretch[0].dot(d), self.stretch[1].dot(d))
    }

    /// The place of the region within these sides (inside on the left) that the fewest radians part from the place of mirror
    /// reflection.
    pub fn nearest(&self, outline: &[[DVec2; 2]]) -> DVec2 {
        let mut best = (f64::INFINITY, self.mirror);
        for [a, b] in outline {
            let (p, q) = (self.isotropic(*a), self.isotropic(*b));
            let along = q - p;
            let long = along.length_squared();
            let t = if long > 0.0 { (-p.dot(along) / long).clamp(0.0, 1.0) } else { 0.0 };
            let away = (p + along * t).length_squared();
            if away < best.0 {
                best = (away, *a + (*b - *a) * t);
            }
        }
        best.1
    }

    /// What the region within these sides (inside on the left) brings to the receiver of what an endless mirror would bring, and its
    /// place through which it does: 1 far within a large region, half on its straight side, nothing far beside it, a small region's area
    /// over its Fresnel zone's (CONVENTIONS eq. 65a). None where that is next to nothing.
    pub fn share(&self, outline: &[[DVec2; 2]]) -> Option<(Complex64, DVec2)> {
        let nearest = self.nearest(outline);
        let turned: f64 = outline
            .iter()
            .map(|[a, b]| (self.isotropic(*a), self.isotropic(*b)))
            .map(|(p, q)| p.perp_dot(q).atan2(p.dot(q)))
            .sum();
        let is_inside = turned > PI;
        if self.k * (self.path(nearest).length - self.mirror_m) > FADES[1] {
            return is_inside.then_some((Complex64::ONE, self.mirror));
        }
        let mut sum = Complex64::ZERO;
        self.waves(outline, |w| {
            let phase = self.k * (w.length_m - self.mirror_m);
            let t = ((phase - FADES[0]) / (FADES[1] - FADES[0])).clamp(0.0, 1.0);
            sum += w.value * Complex64::cis(-phase) * (0.5 + 0.5 * (PI * t).cos());
        });
        let share = sum * Complex64::new(0.0, self.measure() / TAU);
        let spot = if is_inside { self.mirror } else { nearest };
        (share.norm() >= LEAST_SHARE).then_some((share, spot))
    }

    /// Calls `emit` for the waves of the region whose sides are `outline` (inside on the left): together
    /// they are the integral of exp(-j k L) over it.
    pub fn waves(&self, outline: &[[DVec2; 2]], mut emit: impl FnMut(Wave)) {
        let mut turned = 0.0;
        for [a, b] in outline {
            turned += self.side(*a, *b, &mut emit);
        }
        // A full turn inside the region, none outside, a part at a corner.
        if turned.abs() > LEAST_TURN {
            emit(Wave {
                place: self.mirror,
                length_m: self.mirror_m,
                value: Complex64::new(0.0, -turned / self.measure()),
                flux: [Complex64::ZERO; 2],
                holds: Holds::Mirror,
            });
        }
    }

    /// The waves of one side; returns the angle by which it is seen from the place of mirror reflection.
    fn side(&self, a: DVec2, b: DVec2, emit: &mut impl FnMut(Wave)) -> f64 {
        let length = a.distance(b);
        if length == 0.0 {
            return 0.0;
        }
        let along = (b - a) / length;
        let offset = (a - self.mirror).perp_dot(along);
        let side = Side { plane: self, along, offset };
        let mut turned = 0.0;
        // Steep stretches that follow one another have waves from their two ends only.
        let mut steep_from: Option<DVec2> = None;
        let mut stack = vec![(a, b, 0)];
        while let Some((p, q, depth)) = stack.pop() {
            match side.stretch(p, q, depth) {
                Stretch::Steep(angle) => {
                    turned += angle;
                    steep_from.get_or_insert(p);
                }
                Stretch::Whole(angle, wave) => {
                    turned += angle;
                    let holds = |inside: bool| if inside { Holds::Side(along) } else { Holds::Corner };
                    if let Some(from) = steep_from.take() {
                        emit(Wave { holds: holds(from != a), ..side.end(from, -1.0) });
                        emit(Wave { holds: holds(true), ..side.end(p, 1.0) });
                    }
                    emit(Wave { holds: holds(p != a && q != b), ..wave });
                }
                Stretch::Halve => {
                    let m = 0.5 * (p + q);
                    stack.push((m, q, depth + 1));
                    stack.push((p, m, depth + 1));
                }
            }
        }
        if let Some(from) = steep_from {
            let holds = if from == a { Holds::Corner } else { Holds::Side(along) };
            emit(Wave { holds, ..side.end(from, -1.0) });
            emit(side.end(b, 1.0));
        }
        turned
    }
}

struct Side<'a> {
    plane: &'a Plane,
    along: DVec2,
    /// Distance from the place of mirror reflection to the side's line, along the outward normal, m.
    offset: f64,
}

enum Stretch {
    Steep(f64),
    Whole(f64, Wave),
    Halve,
}

/// Derivatives of the phase and of the boundary wave's kernel along the side.
struct Along {
    path: Path,
    slope: f64,
    bend: f64,
    /// How much the slope changes on the way of source and receiver.
    sway: f64,
    /// slope of the length times the vector from the place of mirror reflection, and its derivative.
    radial: f64,
    radial_slope: f64,
}

impl Side<'_> {
    fn at(&self, p: DVec2) -> Along {
        let path = self.plane.path(p);
        let d = p - self.plane.mirror;
        let turned = path.bent(self.along);
        Along {
            slope: path.slope.dot(self.along),
            bend: turned.dot(self.along),
            sway: self.plane.sway(p, self.along),
            radial: path.slope.dot(d),
            radial_slope: turned.dot(d) + path.slope.dot(self.along),
            path,
        }
    }

    /// How much the integrand changes, apart from its phase, while the phase runs by one radian, at any time of the frame.
    fn roughness(&self, x: &Along) -> f64 {
        let slope = (x.slope.abs() - x.sway).max(0.0);
        (x.radial_slope / x.radial).abs().max(x.bend.abs() / slope) / (self.plane.k * slope)
    }

    fn stretch(&self, p: DVec2, q: DVec2, depth: u32) -> Stretch {
        let plane = self.plane;
        let half = 0.5 * p.distance(q);
        let middle = 0.5 * (p + q);
        let (yp, yq) = (plane.isotropic(p), plane.isotropic(q));
        let angle = yp.perp_dot(yq).atan2(yp.dot(yq));
        let step = yq - yp;
        // A stretch that rounding leaves no length has one place.
        let long = step.length_squared();
        let t = if long > 0.0 { (-yp.dot(step) / long).clamp(0.0, 1.0) } else { 0.0 };
        let nearest = (yp + step * t).length();
        let (a, b, m) = (self.at(p), self.at(q), self.at(middle));

        let run = (a.path.length - m.path.length).abs().max((b.path.length - m.path.length).abs());
        let smooth = step.length() <= nearest;
        let run = run + m.sway * half;
        if run <= plane.spread_m && smooth && half <= LONGEST * m.path.nearest {
            return Stretch::Whole(angle, self.whole(middle, half, m.path.length));
        }
        // Near the place of mirror reflection the kernel is sharper than any stretch, but the phase hardly runs: the
        // angle counts, and what the phase changes over it.
        let foot = p + (q - p) * t;
        let at_foot = plane.path(foot).length;
        let (from_a, from_b) = (a.path.length - at_foot, b.path.length - at_foot);
        if plane.k * from_a.abs().max(from_b.abs()) <= STILL || depth >= DEPTH {
            let ends = [(yp, self.shape(&a, p), a.path.length), (yq, self.shape(&b, q), b.path.length)];
            let [over_angle, over_length] =
                self.still(ends, angle, (yp + step * t).length_squared(), at_foot);
            let over = Complex64::new(0.0, 1.0 / plane.measure());
            let flux = self.flux(over_length * Complex64::new(0.0, 2.0 * half / plane.k));
            let holds = Holds::Corner;
            let wave = Wave { place: foot, length_m: at_foot, value: over_angle * over, flux, holds };
            return Stretch::Whole(angle, wave);
        }
        let gentle = 0.1 * plane.tau.sqrt();
        let steep =
            a.slope * b.slope > 0.0 && [&a, &b, &self.at(foot)].iter().all(|x| self.roughness(x) <= gentle);
        if steep { Stretch::Steep(angle) } else { Stretch::Halve }
    }

    /// A stretch over which the phase hardly runs: kernel times exp(-j k (L - L of its foot)) summed up over the angle, and the mean
    /// of the exponential over the length. Of both ends: isotropic coordinates, shape of the kernel, length; shape and length over
    /// square change in proportion to the way between them. The sum is that of 1 - j k L - (k L)^2 / 2 in closed form: waves of opposite
    /// sides of a region much smaller than a Fresnel zone cancel to its area.
    fn still(&self, [a, b]: [(DVec2, f64, f64); 2], angle: f64, foot: f64, at_foot: f64) -> [Complex64; 2] {
        let Plane { k, mirror_m, .. } = *self.plane;
        let along = (b.0 - a.0).normalize_or_zero();
        let (x, y, off) = (along.dot(a.0), along.dot(b.0), a.0.perp_dot(along));
        // Value at the place of mirror reflection's own foot, and change along the way.
        let line = |at_a: f64, at_b: f64| {
            let change = if y > x { (at_b - at_a) / (y - x) } else { 0.0 };
            (at_a - change * x, change)
        };
        let over_square = |(p, _, length): (DVec2, f64, f64)| match p.length_squared() {
            square if k * square > LEAST_LENGTH => (length - mirror_m) / square,
            _ => 0.5,
        };
        let (shape, bend) = line(a.1, b.1);
        let (scale, skew) = line(over_square(a), over_square(b));
        let far = b.0.length_squared() / a.0.length_squared();
        let log = if far.is_normal() { 0.5 * off * far.ln() } else { 0.0 };
        let square = a.0.perp_dot(b.0);
        let fourth = off * off * square + off * (y * y * y - x * x * x) / 3.0;
        let lengths = scale * square + 0.5 * skew * off * (y * y - x * x);
        let first = k * (lengths - (at_foot - mirror_m) * angle);
        let scale = k * scale;
        let second = 0.5 * scale * scale * (fourth - 2.0 * foot * square + foot * foot * angle);
        let mean = scale * (off * off + (x * x + x * y + y * y) / 3.0 - foot);
        [Complex64::new(shape * angle + bend * log - second, -first), Complex64::new(1.0, -mean)]
    }

    /// The kernel over what it would be if lengths were quadratic about the place of mirror reflection.
    fn shape(&self, x: &Along, p: DVec2) -> f64 {
        let y = self.plane.isotropic(p).length_squared();
        if self.plane.k * y > LEAST_SQUARE { y / x.radial } else { 1.0 }
    }

    /// A stretch over which the phase runs by a few radians, by Gauss' rule.
    fn whole(&self, middle: DVec2, half: f64, length_m: f64) -> Wave {
        let k = self.plane.k;
        let (mut value, mut sum) = (Complex64::ZERO, Complex64::ZERO);
        for (x, weight) in GAUSS {
            for x in [-x, x] {
                let p = middle + self.along * (half * x);
                let at = self.plane.path(p);
                let radial = at.slope.dot(p - self.plane.mirror);
                let e = Complex64::cis(-k * (at.length - length_m)) * weight;
                sum += e;
                value += e / radial;
            }
        }
        let over_k = Complex64::new(0.0, half / k);
        Wave {
            place: middle,
            length_m,
            value: value * over_k * self.offset,
            flux: self.flux(sum * over_k),
            holds: Holds::Corner,
        }
    }

    /// Along the outward normal.
    fn flux(&self, z: Complex64) -> [Complex64; 2] {
        [z * self.along.y, z * -self.along.x]
    }

    /// Wave from the end of a steep stretch: `sign` 1 where the stretch ends, -1 where it begins.
    fn end(&self, p: DVec2, sign: f64) -> Wave {
        let x = self.at(p);
        let k = self.plane.k;
        let first = -sign / (k * k * x.slope);
        let second = |change: f64| Complex64::new(1.0, change / (k * x.slope));
        let bend = x.bend / x.slope;
        Wave {
            place: p,
            length_m: x.path.length,
            value: second(x.radial_slope / x.radial + bend) * (first * self.offset / x.radial),
            flux: self.flux(second(bend) * first),
            holds: Holds::Corner,
        }
    }
}

/// Half the path lengths that one wave may stand for when the band is `bandwidth_hz` wide: a wave's
/// amplitude is taken to be the same all over the band.
pub fn spread_for(bandwidth_hz: f64) -> f64 {
    // 0.02 rad between the middle and the ends of the band.
    0.02 * crate::base::units::C0 / (PI * bandwidth_hz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Brute force: the triangle cut into n x n, each part with its linear phase left out; and the same times
    /// the gradient of the length.
    fn brute(plane: &Plane, corners: [DVec2; 3], n: usize) -> [Complex64; 3] {
        let [a, b, c] = corners;
        let (u, v) = ((b - a) / n as f64, (c - a) / n as f64);
        let part = 0.5 * u.perp_dot(v);
        let mut sum = [Complex64::ZERO; 3];
        for i in 0..n {
            for j in 0..n - i {
                let o = a + u * i as f64 + v * j as f64;
                let mut add = |m: DVec2| {
                    let at = plane.path(m);
                    let z = Complex64::cis(-plane.k * at.length) * part;
                    sum[0] += z;
                    sum[1] += z * at.slope.x;
                    sum[2] += z * at.slope.y;
                };
                add(o + (u + v) / 3.0);
                if j + 1 < n - i {
                    add(o + (u + v) * (2.0 / 3.0));
                }
            }
        }
        sum
    }

    fn sum(plane: &Plane, corners: [DVec2; 3]) -> ([Complex64; 3], usize) {
        let [a, b, c] = corners;
        let (mut sum, mut n) = ([Complex64::ZERO; 3], 0);
        plane.waves(&[[a, b], [b, c], [c, a]], |w| {
            let z = Complex64::cis(-plane.k * w.length_m);
            sum[0] += w.value * z;
            sum[1] += w.flux[0] * z;
            sum[2] += w.flux[1] * z;
            n += 1;
        });
        (sum, n)
    }

    #[test]
    fn a_region_around_the_mirror_point_gives_the_mirror_image() {
        // Far sides: amplitude of the image is 2 pi / (k sqrt det).
        let plane = Plane::new(1613.0, [DVec2::ZERO, DVec2::new(4.0, 0.0)], [1.0, 3.0], 0.01, 1e9);
        let big = [DVec2::new(-50.0, -40.0), DVec2::new(60.0, -45.0), DVec2::new(3.0, 80.0)];
        let mut waves = Vec::new();
        plane.waves(&[[big[0], big[1]], [big[1], big[2]], [big[2], big[0]]], |w| waves.push(w));
        let image = waves.last().unwrap();
        assert!((image.place - DVec2::new(1.0, 0.0)).length() < 1e-12);
        // Path: from (0, 1) to the image at (4, -3).
        assert!((image.length_m - 32f64.sqrt()).abs() < 1e-12);
        // sqrt(det) of the Hessian of a mirror path: (1/r + 1/s) cos.
        let (r, s) = (2f64.sqrt(), 18f64.sqrt());
        let det = (1.0 / r + 1.0 / s) * 0.5f64.sqrt();
        assert!((image.value.norm() - TAU / (1613.0 * det)).abs() < 1e-12);
        assert!(waves[..waves.len() - 1].iter().all(|w| w.value.norm() < 0.1 * image.value.norm()));
    }

    /// A side of two places that are one but for rounding is seen from the place of mirror reflection by any angle, and has no length.
    #[test]
    fn sides_without_length_are_done_with() {
        let plane = Plane::new(1613.0, [DVec2::ZERO, DVec2::new(4.0, 0.0)], [1.0, 3.0], 0.25, 1e9);
        for at in [plane.mirror, DVec2::new(7.0, 1.0)] {
            let off = DVec2::new(2.2e-16, 0.0);
            let mut waves = Vec::new();
            plane.waves(&[[at, at + off], [at + off, at]], |w| waves.push(w));
            assert!(waves.len() < 10 && waves.iter().all(|w| w.value.norm() < 1e-9), "{waves:?}");
        }
    }

    /// A sliver that ends in the place of mirror reflection: its sides see that place by large angles, which cancel.
    #[test]
    fn slivers_at_the_mirror_point_keep_their_area() {
        let plane =
            Plane::new(1613.0, [DVec2::new(-15.0, 26.0), DVec2::new(15.0, -26.0)], [21.0; 2], 0.25, 1e9);
        for (wide, ahead) in [(2.6e-4, 0.0), (2.6e-4, 1e-15), (2.6e-4, -1e-15), (2e-3, 1e-15), (1e-5, 0.0)] {
            let along = DVec2::new(-0.0302, 0.1090);
            let apex = DVec2::new(ahead, -ahead);
            let corners = [apex, apex + along.perp().normalize() * -wide, along];
            let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            let (got, n) = sum(&plane, corners);
            let want = brute(&plane, corners, 200);
            let off = (got[0] - want[0]).norm() / area;
            println!("{wide} {ahead}: {off:.1e} of the area, {n} waves");
            assert!(off < 0.01, "{wide} {ahead}: {off}");
        }
    }

    /// When stations move so far that a side's own place of standing phase comes to it within the frame, the side's waves are parts of
    /// it and no longer those of its ends.
    #[test]
    fn waves_hold_all_over_the_frame() {
        let plane = Plane::new(1613.0, [DVec2::new(-0.4, 0.0); 2], [2.0; 2], 0.25, 1e9);
        let count = |plane: &Plane| {
            let mut n = 0;
            plane.waves(&[[DVec2::new(0.0, -0.2), DVec2::new(1.0, -0.2)]], |_| n += 1);
            n
        };
        let at_rest = count(&plane);
        let past = count(&plane.drifting([(DVec2::new(0.4, 0.0), 0.0); 2]));
        assert!(at_rest <= 4 && past > 20, "{at_rest} {past}");
        // A way towards the side turns no path to it.
        assert!(count(&plane.drifting([(DVec2::ZERO, -0.01); 2])) < past / 2);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// What is much smaller than a Fresnel zone radiates its area, wherever the place of mirror reflection lies.
        #[test]
        fn small_regions_keep_their_area(
            c in prop::array::uniform6(-1.0f64..1.0),
            foot in prop::array::uniform2(-0.05f64..0.05),
            size in 1e-4f64..0.02,
            away in 0.0f64..0.05,
        ) {
            let shift = DVec2::new(away, -away);
            let corners = [0, 2, 4].map(|i| DVec2::new(c[i], c[i + 1]) * size + shift);
            let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            prop_assume!(area > 0.05 * size * size);
            let feet = [DVec2::new(foot[0], foot[1]), DVec2::new(foot[1], -foot[0])];
            let plane = Plane::new(1613.0, feet, [3.0, 5.0], 0.25, 1e9);
            let (got, _) = sum(&plane, corners);
            let want = brute(&plane, corners, 200);
            prop_assert!((got[0] - want[0]).norm() < 2e-3 * area, "{} {} {area}", got[0], want[0]);
        }

        #[test]
        fn waves_add_up_to_the_integral(
            c in prop::array::uniform6(-0.15f64..0.15),
            foot in prop::array::uniform2(-0.4f64..0.4),
            height in prop::array::uniform2(0.5f64..3.0),
        ) {
            let k = 800.0;
            let corners = [DVec2::new(c[0], c[1]), DVec2::new(c[2], c[3]), DVec2::new(c[4], c[5])];
            let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            prop_assume!(area > 1e-3);
            let feet = [DVec2::new(foot[0], foot[1]), DVec2::new(foot[1], -foot[0])];
            for (tau, bound) in [(0.25, 0.005), (0.02, 0.002)] {
                let plane = Plane::new(k, feet, height, tau, 1e9);
                let (got, n) = sum(&plane, corners);
                let want = brute(&plane, corners, 400);
                // The scale of what a region can radiate: its image, or all of its area in phase.
                let scale = (TAU / (k * plane.determinant)).min(area);
                for (got, want) in got.into_iter().zip(want) {
                    prop_assert!((got - want).norm() < bound * scale, "tau {tau}: {got} {want} {scale} {n}");
                }
            }
        }
    }
}
