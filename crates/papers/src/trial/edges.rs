//! The true edges of a road: the faces of its walls, rails and fences, cut from the scene's own triangles.

use crate::trial::drive::{Level, stretches};
use catseye::road::labels::{Polyline, RoadTruth};
use catseye::scene::{Scene, Shape};
use catseye_lane::score::TrueLanes;
use glam::{DVec2, DVec3};

/// Spacing of stations along the axis, m.
const STEP_M: f64 = 2.0;
/// Largest distance of an edge from the axis, m.
const WIDEST_M: f64 = 40.0;
/// Least height of a barrier, m: lower things are kerbs and paint.
const LEAST_HEIGHT_M: f64 = 0.3;

/// A cross section of a road.
struct Station {
    at_m: DVec2,
    along: DVec2,
    curvature_per_m: f64,
    /// Interval of each barrier to the left of the axis, m.
    barriers: Vec<[f64; 2]>,
}

/// The barriers of a scene's roads.
pub struct Edges {
    roads: Vec<Vec<Station>>,
}

/// The edges near a vehicle.
pub struct NearEdges {
    /// Pieces of the right and left edge in order, in the level frame, m.
    pub sides: [Vec<Vec<[f64; 2]>>; 2],
    /// Curvature of the right and left edge beside the vehicle, 1/m, positive to the left.
    pub curvature_per_m: [Option<f64>; 2],
    pub heading_rad: Option<f64>,
}

impl Edges {
    /// Collects all walls and guard rails, and fences where there is neither.
    pub fn of(scene: &Scene, road: Option<&RoadTruth>) -> Edges {
        let solid: Vec<Triangles> = barriers(scene, &["wall", "guard_rail"]);
        let fences: Vec<Triangles> = barriers(scene, &["fence"]);
        let roads = road.iter().flat_map(|r| &r.roads).map(|r| {
            let mut stations = stations(&r.axis_m, &r.curvature_per_m);
            for s in &mut stations {
                s.barriers = cut(&solid, s);
                if s.barriers.is_empty() {
                    s.barriers = cut(&fences, s);
                }
            }
            stations
        });
        Edges { roads: roads.collect() }
    }

    /// Whether there is no barrier.
    pub fn is_empty(&self) -> bool {
        self.roads.iter().flatten().all(|s| s.barriers.is_empty())
    }

    /// The innermost barrier on each side of the vehicle along the road nearest to it.
    pub fn near(&self, level: &Level, reach_m: f64) -> NearEdges {
        let mut out =
            NearEdges { sides: [Vec::new(), Vec::new()], curvature_per_m: [None; 2], heading_rad: None };
        let far = |s: &&Station| s.at_m.distance(level.at_m);
        let nearest = |r: &&Vec<Station>| r.iter().map(|s| far(&s)).fold(f64::INFINITY, f64::min);
        let Some(road) = self.roads.iter().min_by(|a, b| nearest(a).total_cmp(&nearest(b))) else {
            return out;
        };
        let Some(here) = road.iter().min_by(|a, b| far(a).total_cmp(&far(b))) else { return out };
        let own_m = here.along.perp_dot(level.at_m - here.at_m);
        let forward = DVec2::from_angle(level.heading_rad).dot(here.along) >= 0.0;
        let turn = DVec2::from_angle(level.heading_rad);
        let along = if forward { here.along } else { -here.along };
        out.heading_rad = Some(along.perp_dot(turn).atan2(along.dot(turn)));
        for (k, left) in [(0, !forward), (1, forward)] {
            let face = |s: &Station| {
                let of = |b: &[f64; 2]| match left {
                    true => (b[0] > own_m).then_some(b[0]),
                    false => (b[1] < own_m).then_some(b[1]),
                };
                let all = s.barriers.iter().filter_map(of);
                all.min_by(|a, b| (a - own_m).abs().total_cmp(&(b - own_m).abs()))
            };
            // What lies behind is not looked at; the place beside the vehicle is.
            let seen = |p: &DVec2| p.length() <= reach_m && p.x > -2.0 * STEP_M;
            let place = |s: &Station| Some(level.from_world(s.at_m + s.along.perp() * face(s)?)).filter(seen);
            out.sides[k] = stretches(road.iter().map(place));
            if !forward {
                out.sides[k].iter_mut().for_each(|l| l.reverse());
            }
            let sign = if forward { 1.0 } else { -1.0 };
            out.curvature_per_m[k] =
                face(here).map(|t| sign * here.curvature_per_m / (1.0 - here.curvature_per_m * t));
        }
        out
    }

    /// The edges as lines that are to be found. Offset, width and heading are relative to them, not to a
    /// lane; the curvature is the mean of the edges that exist.
    pub fn truth(&self, level: &Level, range_m: [f64; 2]) -> TrueLanes {
        let near = self.near(level, range_m[1] + 20.0);
        let mut t = TrueLanes { range_m, heading_rad: near.heading_rad, ..TrueLanes::default() };
        let mut beside = [None; 2];
        for (k, pieces) in near.sides.iter().enumerate() {
            for line in pieces {
                let at = line.windows(2).find(|w| (w[0][0] <= 0.0) != (w[1][0] <= 0.0)).map(|w| {
                    let f = w[0][0] / (w[0][0] - w[1][0]);
                    w[0][1] + f * (w[1][1] - w[0][1])
                });
                beside[k] = beside[k].or(at);
                // A barrier that begins ahead is an edge too.
                t.own[k] = t.own[k].or(Some(t.lines.len()));
                t.lines.push(line.clone());
            }
        }
        if let [Some(right), Some(left)] = beside {
            t.offset_m = Some(-0.5 * (left + right));
        }
        let known: Vec<f64> = near.curvature_per_m.into_iter().flatten().collect();
        t.curvature_per_m = (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64);
        t
    }
}

/// One object's triangles in the world, and the box round them in plan.
struct Triangles {
    corners_m: Vec<[DVec2; 3]>,
    low: DVec2,
    high: DVec2,
}

fn barriers(scene: &Scene, classes: &[&str]) -> Vec<Triangles> {
    let mut out = Vec::new();
    for o in scene.objects.iter().filter(|o| classes.contains(&o.class.as_str())) {
        let Shape::Mesh(m) = o.shape else { continue };
        let world: Vec<DVec3> = scene.meshes[m].positions_m.iter().map(|p| o.pose.point(*p)).collect();
        let (z0, z1) =
            world.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.z), b.max(p.z)));
        if z1 - z0 < LEAST_HEIGHT_M {
            continue;
        }
        let low = world.iter().fold(DVec2::INFINITY, |a, p| a.min(p.truncate()));
        let high = world.iter().fold(DVec2::NEG_INFINITY, |a, p| a.max(p.truncate()));
        let corner = |i: u32| world[i as usize].truncate();
        let corners_m = scene.meshes[m].triangles.iter().map(|t| t.map(corner)).collect();
        out.push(Triangles { corners_m, low, high });
    }
    out
}

fn stations(axis: &Polyline, curvature: &[f64]) -> Vec<Station> {
    let mut out = Vec::new();
    let mut next = 0.0;
    for (i, w) in axis.windows(2).enumerate() {
        let (a, b) = (DVec2::new(w[0][0], w[0][1]), DVec2::new(w[1][0], w[1][1]));
        let length = a.distance(b);
        let known = |i: usize| curvature.get(i).copied().unwrap_or(0.0);
        while length > 0.0 && next < length {
            let f = next / length;
            out.push(Station {
                at_m: a.lerp(b, f),
                along: (b - a) / length,
                curvature_per_m: known(i) + f * (known(i + 1) - known(i)),
                barriers: Vec::new(),
            });
            next += STEP_M;
        }
        next -= length;
    }
    out
}

/// Intervals in which the station's cross section meets each body.
fn cut(bodies: &[Triangles], s: &Station) -> Vec<[f64; 2]> {
    let left = s.along.perp();
    let reach = DVec2::splat(WIDEST_M);
    let mut out = Vec::new();
    for body in bodies {
        if (s.at_m + reach).cmplt(body.low).any() || (s.at_m - reach).cmpgt(body.high).any() {
            continue;
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for t in &body.corners_m {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let (fa, fb) = ((a - s.at_m).dot(s.along), (b - s.at_m).dot(s.along));
                if (fa <= 0.0) == (fb <= 0.0) {
                    continue;
                }
                let x = (a.lerp(b, fa / (fa - fb)) - s.at_m).dot(left);
                if x.abs() <= WIDEST_M {
                    (low, high) = (low.min(x), high.max(x));
                }
            }
        }
        if low <= high {
            out.push([low, high]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(barriers: Vec<[f64; 2]>) -> Edges {
        let axis: Polyline = vec![[0.0, 0.0, 0.0], [200.0, 0.0, 0.0]];
        let mut road = stations(&axis, &[0.0, 0.0]);
        road.iter_mut().for_each(|s| s.barriers = barriers.clone());
        Edges { roads: vec![road] }
    }

    #[test]
    fn the_face_towards_the_vehicle_is_the_edge() {
        let edges = straight(vec![[3.0, 3.2], [6.0, 6.2], [-5.2, -5.0]]);
        let level = Level {
            at_m: DVec2::new(50.0, -1.0),
            heading_rad: 0.0,
            speed_mps: 10.0,
            yaw_rate_rad_per_s: 0.0,
        };
        let t = edges.truth(&level, [10.0, 60.0]);
        assert_eq!(t.own, [Some(0), Some(1)]);
        assert!(t.lines[0].iter().all(|p| (p[1] + 4.0).abs() < 1e-9), "{:?}", t.lines[0]);
        assert!(t.lines[1].iter().all(|p| (p[1] - 4.0).abs() < 1e-9), "{:?}", t.lines[1]);
        assert_eq!((t.offset_m, t.heading_rad), (Some(0.0), Some(0.0)));
        // The other way round: left and right change places.
        let back = Level { heading_rad: std::f64::consts::PI, ..level };
        let t = edges.truth(&back, [10.0, 60.0]);
        assert!(t.lines[0].iter().all(|p| (p[1] + 4.0).abs() < 1e-9), "{:?}", t.lines[0]);
        assert!(straight(vec![]).is_empty() && straight(vec![]).truth(&level, [10.0, 60.0]).lines.is_empty());
    }
}
