//! How the length of a path bends over a frame (CONVENTIONS eq. 141): it is worked out anew at the frame's start and end, from
//! the images of the radar in the planes as they stand then.

use crate::geom::{Body, Geometry, Shift};
use crate::trace::TraceOptions;
use glam::DVec3;

/// What the end of a path keeps to while its body moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathEnd {
    /// Its place on the body: a corner, a point.
    Place,
    /// A straight side of the body, along which it slides with the place where the path is shortest: unit vector (world).
    Side(DVec3),
    /// The plane with this normal, on which it stays the place of mirror reflection.
    Plane(DVec3),
}

/// A plane that moves with a body: a place on it and its normal.
#[derive(Clone, Copy)]
pub struct Mirror<'a> {
    /// Body that carries it.
    pub body: &'a Body,
    /// A place on the plane, m.
    pub place_m: DVec3,
    /// Normal of the plane.
    pub normal: DVec3,
}

impl Mirror<'_> {
    fn image(&self, of: DVec3, when: usize) -> DVec3 {
        let shift = &self.body.shifts[when];
        let (place, normal) = (shift.place(self.place_m), shift.direction(self.normal));
        of - normal * (2.0 * normal.dot(of - place))
    }
}

/// One end of a path: from the radar over mirrors, in the order met.
pub type Mirrors<'a> = &'a [Mirror<'a>];

/// Where the path ends and what holds it.
#[derive(Clone, Copy)]
pub struct End<'a> {
    /// How each body moves to the frame's start and end.
    pub shifts: &'a [Shift; 2],
    /// The place at mid-frame, m.
    pub place_m: DVec3,
    /// What it stays with.
    pub keeps: PathEnd,
}

/// The radar over one frame.
#[derive(Clone, Copy)]
pub struct Bends {
    reach_s: f64,
    /// Of the radar before, in the middle, and after.
    radar_m: [DVec3; 3],
}

/// Foot along a line and distance from it.
fn beside(line: DVec3, along: DVec3, p: DVec3) -> (f64, f64) {
    let q = along.dot(p - line);
    (q, p.distance(line + along * q))
}

impl Bends {
    /// The bends of paths of a scene seen by a radar at a place that moves.
    pub fn new(geometry: &Geometry, radar_m: DVec3, velocity_mps: DVec3, options: &TraceOptions) -> Bends {
        let reach_s = geometry.reach_s;
        let way = velocity_mps * reach_s;
        let [before, after] = options.radar_sway_m;
        Bends { reach_s, radar_m: [radar_m - way + before, radar_m, radar_m + way + after] }
    }

    /// Completes a path of `length_m` from the radar `out` over mirrors to `end` and `back` over mirrors: its rate, m/s, and its second and
    /// third derivatives. `rate_mps` is that of an end that keeps its place.
    pub fn of(&self, out: Mirrors, back: Mirrors, end: End, length_m: f64, rate_mps: f64) -> (f64, [f64; 2]) {
        let at_rest = |m: &Mirror| m.body.shifts.iter().all(Shift::is_none);
        let radar_rests = self.radar_m[0] == self.radar_m[1] && self.radar_m[2] == self.radar_m[1];
        if self.reach_s == 0.0
            || (radar_rests && end.shifts.iter().all(Shift::is_none) && out.iter().chain(back).all(at_rest))
        {
            return (rate_mps, [0.0; 2]);
        }
        let image = |mirrors: Mirrors, when: usize| {
            mirrors.iter().fold(self.radar_m[2 * when], |p, m| m.image(p, when))
        };
        let stations = [0, 1].map(|when| [image(out, when), image(back, when)]);
        let ends = [0, 1].map(|when| end.shifts[when].place(end.place_m));
        let (lengths, rate) = match end.keeps {
            PathEnd::Place => {
                ([0, 1].map(|w| stations[w].iter().map(|s| s.distance(ends[w])).sum::<f64>()), rate_mps)
            }
            PathEnd::Plane(normal) => {
                let lengths = [0, 1].map(|w| {
                    let n = end.shifts[w].direction(normal);
                    let [s, r] = stations[w];
                    s.distance(r - n * (2.0 * n.dot(r - ends[w])))
                });
                (lengths, rate_mps)
            }
            PathEnd::Side(along) => {
                // The two stations turned into one plane with the side: the path is shortest where it is straight.
                let shortest = |[s, r]: [DVec3; 2], line: DVec3, along: DVec3| {
                    let ((q, d), (p, e)) = (beside(line, along, s), beside(line, along, r));
                    (if d + e > 0.0 { (q * e + p * d) / (d + e) } else { 0.5 * (p + q) }, [(q, d), (p, e)])
                };
                let now = [out, back].map(|mirrors| {
                    mirrors
                        .iter()
                        .fold(self.radar_m[1], |p, m| p - m.normal * (2.0 * m.normal.dot(p - m.place_m)))
                });
                let (start, places) = shortest(now, end.place_m, along);
                let then = [0, 1].map(|w| shortest(stations[w], ends[w], end.shifts[w].direction(along)));
                let lengths = [0, 1].map(|w| {
                    let (best, feet) = then[w];
                    feet.iter().map(|(q, d)| (best - start - q).hypot(*d)).sum::<f64>()
                });
                let slope: f64 = places.iter().map(|(q, d)| -q / q.hypot(*d)).sum();
                (lengths, rate_mps + slope * (then[1].0 - then[0].0) / (2.0 * self.reach_s))
            }
        };
        let [before, after] = lengths;
        let t = self.reach_s;
        let second = (before + after - 2.0 * length_m) / (t * t);
        let third = 3.0 * (after - before - 2.0 * rate * t) / (t * t * t);
        (rate, [second, third])
    }
}
