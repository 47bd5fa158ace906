//! How the length of a path bends over a frame (CONVENTIONS eq. 141) and how its directions turn (eq. 144): both are worked out
//! anew at the frame's start and end, from the images of the radar in the planes as they stand then.

use crate::geom::{Body, Geometry, Shift};
use crate::trace::TraceOptions;
use glam::DVec3;

/// What the end of a path keeps to while its body moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathEnd {
    /// Its place on the body: a corner, a point.
    Place,
    /// A straight side of the body, along which it slides with the place where the path is shortest: unit vector (world), and the
    /// length of the side at most, m. Where the place slides farther than that within half a frame, as on an edge of a wheel that turns,
    /// it is on the side for a moment only, and the wave keeps its place on the body.
    Side(DVec3, f64),
    /// The plane with this normal, on which it stays the specular point.
    Plane(DVec3),
    /// A curved surface of the body, over which the specular point travels: its positions on the body, as that is at mid-frame, at the
    /// frame's start and end, m.
    Surface([DVec3; 2]),
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
    fn normal(&self, when: When) -> DVec3 {
        when.shift(&self.body.shifts).map_or(self.normal, |s| s.direction(self.normal))
    }

    fn image(&self, of: DVec3, when: When) -> DVec3 {
        let (place, normal) = (when.place(&self.body.shifts, self.place_m), self.normal(when));
        of - normal * (2.0 * normal.dot(of - place))
    }
}

/// The three times of a frame at which paths are looked at.
#[derive(Clone, Copy)]
enum When {
    Start,
    Middle,
    End,
}

impl When {
    fn shift(self, shifts: &[Shift; 2]) -> Option<&Shift> {
        match self {
            When::Start => Some(&shifts[0]),
            When::Middle => None,
            When::End => Some(&shifts[1]),
        }
    }

    fn place(self, shifts: &[Shift; 2], place_m: DVec3) -> DVec3 {
        self.shift(shifts).map_or(place_m, |s| s.place(place_m))
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

/// How a path changes over a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathMotion {
    /// Rate of its length, m/s.
    pub rate_mps: f64,
    /// Second and third derivatives of its length.
    pub acceleration_and_jerk: [f64; 2],
    /// How its first and its last place move as the radar sees them, m/s: world axes that turn with the radar.
    pub velocities_mps: [DVec3; 2],
}

/// The radar over one frame.
#[derive(Clone, Copy)]
pub struct Bends {
    reach_s: f64,
    spin_rad_per_s: DVec3,
    /// Positions of the radar before, in the middle, and after, m.
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
        Bends {
            reach_s,
            spin_rad_per_s: options.radar_spin_rad_per_s,
            radar_m: [radar_m - way + before, radar_m, radar_m + way + after],
        }
    }

    /// Half the time of the frame, s.
    pub(super) fn reach_s(&self) -> f64 {
        self.reach_s
    }

    /// Rate at which the radar turns, rad/s.
    pub(super) fn spin_rad_per_s(&self) -> DVec3 {
        self.spin_rad_per_s
    }

    /// Position of the radar at the frame's start (0) or end (1), m.
    pub(super) fn radar_at_end(&self, end: usize) -> DVec3 {
        self.radar_m[2 * end]
    }

    /// The radar's images in the mirrors of a path's two ends.
    fn stations(&self, ends: [Mirrors; 2], when: When) -> [DVec3; 2] {
        ends.map(|mirrors| mirrors.iter().fold(self.radar_m[when as usize], |p, m| m.image(p, when)))
    }

    /// Where the radar's images in the mirrors of a path's two ends are at the frame's start and end, as seen from a body with these
    /// shifts that is where it is at mid-frame, m. None where nothing of the path moves.
    pub(super) fn stations_of_body(
        &self,
        ends: [Mirrors; 2],
        shifts: &[Shift; 2],
    ) -> Option<[[DVec3; 2]; 2]> {
        let before = self.stations(ends, When::Middle);
        let moved = [When::Start, When::End].map(|when| {
            let seen = |p| when.shift(shifts).map_or(p, |s| s.place_before(p));
            self.stations(ends, when).map(seen)
        });
        (self.reach_s > 0.0 && moved.iter().any(|m| *m != before)).then_some(moved)
    }

    /// Completes a path of `length_m` from the radar `out` over mirrors to `end` and `back` over mirrors, whose first and last places lie
    /// at `ranges_m`. `rate_mps` is that of an end that keeps its place.
    pub fn of(
        &self,
        [out, back]: [Mirrors; 2],
        end: End,
        length_m: f64,
        ranges_m: [f64; 2],
        rate_mps: f64,
    ) -> PathMotion {
        let at_rest = |m: &Mirror| m.body.shifts.iter().all(Shift::is_none);
        let radar_rests = self.radar_m[0] == self.radar_m[1]
            && self.radar_m[2] == self.radar_m[1]
            && self.spin_rad_per_s == DVec3::ZERO;
        if self.reach_s == 0.0
            || (radar_rests && end.shifts.iter().all(Shift::is_none) && out.iter().chain(back).all(at_rest))
        {
            return PathMotion {
                rate_mps,
                acceleration_and_jerk: [0.0; 2],
                velocities_mps: [DVec3::ZERO; 2],
            };
        }
        let times = [When::Start, When::Middle, When::End];
        let stations = times.map(|when| self.stations([out, back], when));
        // Where the straight lines from the two stations lead to, and the rate of the length.
        let (targets, rate) = match end.keeps {
            PathEnd::Place => (times.map(|when| [when.place(end.shifts, end.place_m); 2]), rate_mps),
            PathEnd::Surface([start, stop]) => {
                let points = [start, end.place_m, stop];
                (times.map(|when| [when.place(end.shifts, points[when as usize]); 2]), rate_mps)
            }
            PathEnd::Plane(normal) => {
                let targets = times.map(|when| {
                    let place = when.place(end.shifts, end.place_m);
                    let n = when.shift(end.shifts).map_or(normal, |s| s.direction(normal));
                    let [s, r] = stations[when as usize];
                    [r, s].map(|p| p - n * (2.0 * n.dot(p - place)))
                });
                (targets, rate_mps)
            }
            PathEnd::Side(along, most_m) => {
                // The two stations turned into one plane with the side: the path is shortest where it is straight.
                let shortest = |[s, r]: [DVec3; 2], line: DVec3, along: DVec3| {
                    let ((q, d), (p, e)) = (beside(line, along, s), beside(line, along, r));
                    (if d + e > 0.0 { (q * e + p * d) / (d + e) } else { 0.5 * (p + q) }, [(q, d), (p, e)])
                };
                let (start, places) = shortest(stations[1], end.place_m, along);
                let mut targets = [[end.place_m; 2]; 3];
                let mut slid = [0.0; 3];
                for when in [When::Start, When::End] {
                    let i = when as usize;
                    let along = when.shift(end.shifts).map_or(along, |s| s.direction(along));
                    let line = when.place(end.shifts, end.place_m);
                    slid[i] = shortest(stations[i], line, along).0 - start;
                    targets[i] = [line + along * slid[i]; 2];
                }
                if slid.iter().any(|s| s.abs() > most_m) {
                    (times.map(|when| [when.place(end.shifts, end.place_m); 2]), rate_mps)
                } else {
                    let slope: f64 = places.iter().map(|(q, d)| -q / q.hypot(*d)).sum();
                    (targets, rate_mps + slope * (slid[2] - slid[0]) / (2.0 * self.reach_s))
                }
            }
        };
        let mirrored = matches!(end.keeps, PathEnd::Plane(_));
        let [before, after] = [0, 2].map(|i| {
            let [first, last] = [0, 1].map(|leg| stations[i][leg].distance(targets[i][leg]));
            if mirrored { first } else { first + last }
        });
        let t = self.reach_s;
        let second = (before + after - 2.0 * length_m) / (t * t);
        let third = 3.0 * (after - before - 2.0 * rate * t) / (t * t * t);
        let velocity = |leg: usize, mirrors: Mirrors| {
            // Turned back from the last image to the radar.
            let seen = times.map(|when| {
                let d = targets[when as usize][leg] - stations[when as usize][leg];
                mirrors.iter().rev().map(|m| m.normal(when)).fold(d, |d, n| d - n * (2.0 * n.dot(d)))
            });
            let share = ranges_m[leg] / seen[1].length();
            ((seen[2] - seen[0]) / (2.0 * t) - self.spin_rad_per_s.cross(seen[1])) * share
        };
        let first = velocity(0, out);
        // Straight out and back, as most echoes are.
        let alike = out.is_empty() && back.is_empty() && !mirrored;
        let last = if alike { first } else { velocity(1, back) };
        PathMotion { rate_mps: rate, acceleration_and_jerk: [second, third], velocities_mps: [first, last] }
    }
}
