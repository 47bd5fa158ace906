//! The whole recognition and its repetition in time (Sangeetha Lakshmi sections 4 and 5).

use super::curve::{Arc, Parabola, fit_parabola};
use super::matching::{LaneMatch, MatchSettings, match_lane};
use super::near::NearLane;
use super::pnn::{Bend, Choice, Pnn};
use super::reconstruct::{EdgeOfPart, RoadModel, reconstruct};
use super::targets::Trail;
use crate::error::{LaneError, positive, within};
use glam::DVec2;
use std::fmt;

/// Why the camera contributes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blinding {
    /// Light dazzles the camera.
    Glare,
    /// It is too dark to see lines.
    Dark,
    /// Fog hides the road.
    Fog,
    /// Something covers the lens.
    Covered,
    /// The image shows no lane line.
    NoLine,
}

impl fmt::Display for Blinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Blinding::Glare => "glare",
            Blinding::Dark => "darkness",
            Blinding::Fog => "fog",
            Blinding::Covered => "a covered lens",
            Blinding::NoLine => "no visible line",
        })
    }
}

/// What the camera contributes; the caller states when it is blinded.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is one for each image")]
pub enum CameraView {
    /// The lane that the camera sees.
    Lane(NearLane),
    /// Nothing is seen, for this reason.
    Blinded(Blinding),
}

/// The sensors that a recognition rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sources {
    /// The camera's near part and a radar's far part, joined.
    CameraAndRadar,
    /// The camera's near part alone: the radar gave no path, or none that continues the near lane.
    CameraAlone,
    /// The radar's far part alone, with the reason why the camera contributes nothing.
    RadarAlone(Blinding),
}

impl fmt::Display for Sources {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Sources::CameraAndRadar => write!(f, "The lane was found with camera and radar."),
            Sources::CameraAlone => {
                write!(f, "The lane was found with the camera alone and ends where the camera's view ends.")
            }
            Sources::RadarAlone(why) => write!(
                f,
                "The lane was found with the radar alone, because the camera is blinded by {why}; its lines are half a lane beside the track of the cars ahead."
            ),
        }
    }
}

/// Origin of a piece of the lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The camera saw it.
    Camera,
    /// Reconstructed between the two.
    Middle,
    /// The radar's tracks show it.
    Radar,
}

/// Settings of [`recognise`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecogniseSettings {
    /// Settings of the matching of near and far part.
    pub matching: MatchSettings,
    /// Lane width where the camera does not detect both lines, m.
    pub lane_width_m: f64,
    /// Longest arc extension of a far path back to the vehicle when the camera is blinded, m.
    pub extension_m: f64,
    /// Spacing of the points of the result, m.
    pub step_m: f64,
}

impl Default for RecogniseSettings {
    fn default() -> Self {
        RecogniseSettings {
            matching: MatchSettings::default(),
            lane_width_m: 3.5,
            extension_m: 60.0,
            step_m: 1.0,
        }
    }
}

/// Input of one recognition.
#[derive(Debug, Clone, PartialEq)]
pub struct RecogniseInput<'a> {
    /// What the camera contributes.
    pub camera: &'a CameraView,
    /// Paths of the cars that drive ahead in the own direction, in the present vehicle frame.
    pub trails: &'a [Trail],
    /// Lane of each far path where it is known from elsewhere (an earlier recognition), one entry for each
    /// path, counted from the own lane, positive to the left. It is used where extension cannot tell, as in a
    /// right-angle bend.
    pub known_lanes: &'a [Option<i32>],
}

/// The own lane from the vehicle to the end of what is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Recognition {
    /// The sensors that the result rests on.
    pub sources: Sources,
    /// Points of the lane's centre line, the nearest first, vehicle frame, m.
    pub middle_m: Vec<DVec2>,
    /// Points of the left line, near to far, vehicle frame, m.
    pub left_m: Vec<DVec2>,
    /// Points of the right line, near to far, vehicle frame, m.
    pub right_m: Vec<DVec2>,
    /// Origin of each point.
    pub parts: Vec<Part>,
    /// Width of the lane, m.
    pub lane_width_m: f64,
    /// The network's answer; None without both sensors.
    pub choice: Option<Choice>,
    /// The model that joined the parts, if any. It differs from the choice where the chosen model could not
    /// join them.
    pub joined_by: Option<RoadModel>,
    /// Index of the path that was used, its lane and how it matched; the match is None when the lane was
    /// known beforehand.
    pub way: Option<(usize, i32, Option<LaneMatch>)>,
    /// Centre line of the near part.
    near: Option<Parabola>,
    /// Reasons why parts were left out or a model was replaced.
    pub notes: Vec<LaneError>,
}

impl Recognition {
    /// Direction of the centre line at its point i, from the neighbours, rad.
    fn heading(points: &[DVec2], i: usize) -> f64 {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(points.len().saturating_sub(1)));
        (points[b] - points[a]).to_angle()
    }

    fn with_lines(mut self) -> Recognition {
        let side = |d: f64| -> Vec<DVec2> {
            let m = &self.middle_m;
            (0..m.len()).map(|i| m[i] + DVec2::from_angle(Self::heading(m, i)).perp() * d).collect()
        };
        (self.left_m, self.right_m) = (side(0.5 * self.lane_width_m), side(-0.5 * self.lane_width_m));
        self
    }
}

/// Centre line of the near lane as one parabola, and the lane's width, m.
fn near_middle(lane: &NearLane, settings: &RecogniseSettings) -> Result<(Parabola, f64), LaneError> {
    let width_m = match (&lane.left, &lane.right) {
        (Some(l), Some(r)) => {
            let at = l.curve.point(0.0);
            let u = r.curve.coordinate(at);
            (at - r.curve.point(u)).dot(DVec2::from_angle(r.curve.heading_rad(u)).perp())
        }
        _ => settings.lane_width_m,
    };
    positive("the lane's width", width_m)?;
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (line, side) in [(&lane.left, -0.5), (&lane.right, 0.5)] {
        let Some(line) = line else { continue };
        let [a, b] = line.curve.span_m;
        for (i, p) in line.curve.samples(30, side * width_m).into_iter().enumerate() {
            points.push(p);
            weights.push(1.0 / line.curve.sigma_m(a + (b - a) * i as f64 / 29.0).max(1e-3).powi(2));
        }
    }
    if points.is_empty() {
        return Err(LaneError::NoLaneLine);
    }
    points_in_order(&mut points, &mut weights);
    Ok((fit_parabola(&points, Some(&weights), None)?, width_m))
}

/// Sorts points by distance from the vehicle, so that first and last are the ends.
fn points_in_order(points: &mut [DVec2], weights: &mut [f64]) {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| points[*a].length_squared().total_cmp(&points[*b].length_squared()));
    let (p, w) = (points.to_vec(), weights.to_vec());
    for (to, from) in order.into_iter().enumerate() {
        (points[to], weights[to]) = (p[from], w[from]);
    }
}

/// The far path moved sideways into another lane.
fn moved_aside(trail: &Trail, left_m: f64) -> Result<Trail, LaneError> {
    if left_m == 0.0 {
        return Ok(trail.clone());
    }
    let mut curve = fit_parabola(&trail.curve.samples(40, left_m), None, None)?;
    curve.covariance = trail.curve.covariance;
    Trail::new(curve)
}

/// Recognises the lane ahead: the near part from the camera, the far part from the path that matches best,
/// and the middle between them by the model that the network chooses from the two slopes. Where the chosen
/// model cannot join the parts, the weighted fusion of the straight model does, and the notes say so. With a
/// blinded camera the result is the radar's path nearest to the own lane, extended to the vehicle by its arc.
///
/// # Errors
/// Returns an error if a setting is outside its range, if no lane can be fitted to the camera's lines, or if
/// the camera is blinded and no path reaches the vehicle.
pub fn recognise(
    input: &RecogniseInput,
    pnn: &Pnn,
    settings: &RecogniseSettings,
) -> Result<Recognition, LaneError> {
    positive("the lane's width", settings.lane_width_m)?;
    positive("the longest extension", settings.extension_m)?;
    within("the step", settings.step_m, 0.01..=100.0)?;
    match input.camera {
        CameraView::Blinded(why) => radar_alone(input, *why, settings),
        CameraView::Lane(lane) => {
            let (near, width_m) = near_middle(lane, settings)?;
            fuse(near, width_m, input, pnn, settings)
        }
    }
}

fn along(curve: &Parabola, step_m: f64) -> Vec<DVec2> {
    let count = ((curve.length_m() / step_m).ceil() + 1.0).clamp(2.0, 1e5);
    curve.samples(count as usize, 0.0)
}

fn radar_alone(
    input: &RecogniseInput,
    why: Blinding,
    settings: &RecogniseSettings,
) -> Result<Recognition, LaneError> {
    let mut best: Option<(f64, usize, i32, f64)> = None;
    let mut notes = Vec::new();
    for (i, trail) in input.trails.iter().enumerate() {
        // Back along the arc to the point beside the vehicle.
        let back = (0..=400).map(|k| -settings.extension_m * f64::from(k) / 400.0).min_by(|a, b| {
            trail.near.point(*a).length_squared().total_cmp(&trail.near.point(*b).length_squared())
        });
        let s = back.unwrap_or(0.0);
        let p = trail.near.point(s);
        if p.x.is_nan() || p.x.abs() >= 2.0 {
            let value = trail.near.point_m.length();
            notes.push(LaneError::out_of_range(
                "the distance of the start of a track",
                value,
                "within the longest extension",
            ));
            continue;
        }
        let normal = DVec2::from_angle(trail.near.heading_at(s)).perp();
        let offset = p.dot(normal);
        // The vehicle is taken to be in its lane: a path less than half a lane to the side is the own one.
        let guess = (offset / settings.lane_width_m).round() as i32;
        let lane = input.known_lanes.get(i).copied().flatten().unwrap_or(guess);
        let cost = offset.abs();
        if best.is_none_or(|b| cost < b.0) {
            best = Some((cost, i, lane, s));
        }
    }
    let Some((_, i, lane, s)) = best else {
        return Err(notes
            .into_iter()
            .next()
            .unwrap_or(LaneError::refused("neither the camera nor the radar sees a lane")));
    };
    let trail = &input.trails[i];
    let left = -f64::from(lane) * settings.lane_width_m;
    let count = ((-s / settings.step_m).ceil() as usize).clamp(1, 100_000);
    let mut middle_m: Vec<DVec2> = (0..count)
        .map(|k| s * (1.0 - k as f64 / count as f64))
        .map(|s| trail.near.point(s) + DVec2::from_angle(trail.near.heading_at(s)).perp() * left)
        .collect();
    let mut parts = vec![Part::Middle; middle_m.len()];
    let far = along(&moved_aside(trail, left)?.curve, settings.step_m);
    parts.extend(vec![Part::Radar; far.len()]);
    middle_m.extend(far);
    Ok(Recognition {
        sources: Sources::RadarAlone(why),
        middle_m,
        left_m: Vec::new(),
        right_m: Vec::new(),
        parts,
        lane_width_m: settings.lane_width_m,
        choice: None,
        joined_by: None,
        way: Some((i, lane, None)),
        near: None,
        notes,
    }
    .with_lines())
}

fn fuse(
    near: Parabola,
    width_m: f64,
    input: &RecogniseInput,
    pnn: &Pnn,
    settings: &RecogniseSettings,
) -> Result<Recognition, LaneError> {
    let near_points = along(&near, settings.step_m);
    let mut out = Recognition {
        sources: Sources::CameraAlone,
        parts: vec![Part::Camera; near_points.len()],
        middle_m: near_points,
        left_m: Vec::new(),
        right_m: Vec::new(),
        lane_width_m: width_m,
        choice: None,
        joined_by: None,
        way: None,
        near: Some(near.clone()),
        notes: Vec::new(),
    };
    let end = near.arc(near.span_m[1]);
    let mut best: Option<(f64, usize, i32, Option<LaneMatch>)> = None;
    for (i, trail) in input.trails.iter().enumerate() {
        let found = match_lane(&end, trail, width_m, &settings.matching);
        let (rank, lane, found) = match (found, input.known_lanes.get(i).copied().flatten()) {
            (Ok(m), _) => (m.r_squared, m.lane, Some(m)),
            (Err(why), Some(lane)) => {
                out.notes.push(why);
                (0.0, lane, None)
            }
            (Err(why), None) => {
                out.notes.push(why);
                continue;
            }
        };
        if best.as_ref().is_none_or(|b| rank > b.0) {
            best = Some((rank, i, lane, found));
        }
    }
    let Some((_, i, lane, found)) = best else { return Ok(out.with_lines()) };
    let far = moved_aside(&input.trails[i], -f64::from(lane) * width_m)?;
    // Where the radar's part begins before the camera's ends, it starts behind that end.
    let heading = DVec2::from_angle(end.heading_rad);
    let [a, b] = far.curve.span_m;
    let beyond = (0..=200)
        .map(|k| a + (b - a) * f64::from(k) / 200.0)
        .find(|u| (far.curve.point(*u) - end.point_m).dot(heading) > 2.0 || wide(&end, &far.curve, *u));
    let Some(start) = beyond else {
        out.notes.push(LaneError::undetermined("the far part, because it ends within the camera's view"));
        return Ok(out.with_lines());
    };
    let mut curve = far.curve;
    curve.span_m[0] = start.min(b - 1e-6);
    let edges = [
        EdgeOfPart { arc: end, sigma_curvature_1pm: near.sigma_curvature_1pm() },
        EdgeOfPart { arc: curve.arc(curve.span_m[0]), sigma_curvature_1pm: curve.sigma_curvature_1pm() },
    ];
    let choice = pnn.choose(&Bend {
        near_slope_rad: edges[0].arc.heading_rad,
        far_slope_rad: edges[1].arc.heading_rad,
    })?;
    let gap = end.point_m.distance(edges[1].arc.point_m);
    let count = ((gap / settings.step_m).ceil() + 2.0).clamp(3.0, 1e5) as usize;
    let (model, middle) = match reconstruct(choice.model, &edges[0], &edges[1], count) {
        Ok(m) => (choice.model, m),
        Err(why) => {
            out.notes.push(why);
            (RoadModel::Straight, reconstruct(RoadModel::Straight, &edges[0], &edges[1], count)?)
        }
    };
    let between = &middle.points_m[1..count - 1];
    out.middle_m.extend_from_slice(between);
    out.parts.extend(vec![Part::Middle; between.len()]);
    let far_points = along(&curve, settings.step_m);
    out.parts.extend(vec![Part::Radar; far_points.len()]);
    out.middle_m.extend(far_points);
    (out.sources, out.choice, out.joined_by) = (Sources::CameraAndRadar, Some(choice), Some(model));
    out.way = Some((i, lane, found));
    Ok(out.with_lines())
}

/// Whether the far curve has turned across the near end's direction at u and lies clear of it.
fn wide(end: &Arc, curve: &Parabola, u_m: f64) -> bool {
    let turn = crate::numeric::wrapped(curve.heading_rad(u_m) - end.heading_rad).abs();
    turn > 1.0 && curve.point(u_m).distance(end.point_m) > 2.0
}

/// Recognises the lane step by step (Sangeetha Lakshmi section 5).
///
/// With the same model as before, the two lanes are averaged where both know the road. With another model the
/// earlier near part, moved into the present frame, is joined to the present one with half its weight, and
/// the lane is recognised again from that and the present paths.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recogniser {
    /// Settings of every step.
    pub settings: RecogniseSettings,
    previous: Option<Recognition>,
}

impl Recogniser {
    /// Makes a recogniser without an earlier recognition.
    pub fn new(settings: RecogniseSettings) -> Recogniser {
        Recogniser { settings, previous: None }
    }

    /// Makes one recognition. `from_previous` maps points from the frame of the last step into the present
    /// one ([`super::EgoPath::moved`]). A step that fails leaves the last one in place.
    ///
    /// # Errors
    /// Returns the errors of [`recognise`] and of `from_previous`, and an error if the joined near parts give
    /// no parabola.
    pub fn step(
        &mut self,
        input: &RecogniseInput,
        pnn: &Pnn,
        from_previous: impl Fn(DVec2) -> Result<DVec2, LaneError>,
    ) -> Result<Recognition, LaneError> {
        let mut now = recognise(input, pnn, &self.settings)?;
        if let Some(before) = &self.previous {
            let moved: Vec<DVec2> =
                before.middle_m.iter().map(|p| from_previous(*p)).collect::<Result<_, _>>()?;
            let kind = |r: &Recognition| (r.joined_by, std::mem::discriminant(&r.sources));
            let same = kind(before) == kind(&now);
            match (&now.near, &before.near, same) {
                (_, _, true) => {
                    average(&mut now.middle_m, &moved);
                    now = now.with_lines();
                }
                (Some(near), Some(old), false) => {
                    let mut points = near.samples(30, 0.0);
                    let mut weights = vec![1.0; 30];
                    for p in old.samples(30, 0.0) {
                        let p = from_previous(p)?;
                        let u = near.coordinate(p);
                        if u > near.span_m[0] - 5.0 && u < near.span_m[1] {
                            points.push(p);
                            weights.push(0.5);
                        }
                    }
                    points_in_order(&mut points, &mut weights);
                    let joined = fit_parabola(&points, Some(&weights), None)?;
                    now = fuse(joined, now.lane_width_m, input, pnn, &self.settings)?;
                }
                _ => {}
            }
        }
        self.previous = Some(now.clone());
        Ok(now)
    }
}

/// Moves each point of `now` halfway to the polyline `before`, along its own normal, where that passes within
/// two metres.
fn average(now: &mut [DVec2], before: &[DVec2]) {
    let shifts: Vec<DVec2> = (0..now.len())
        .map(|i| {
            let t = DVec2::from_angle(Recognition::heading(now, i));
            let offset = before
                .windows(2)
                .filter_map(|w| {
                    let (d0, d1) = ((w[0] - now[i]).dot(t), (w[1] - now[i]).dot(t));
                    ((d0 > 0.0) != (d1 > 0.0)).then(|| t.perp_dot(w[0].lerp(w[1], d0 / (d0 - d1)) - now[i]))
                })
                .min_by(|a, b| a.abs().total_cmp(&b.abs()));
            offset.filter(|o| o.abs() < 2.0).map_or(DVec2::ZERO, |o| t.perp() * (0.5 * o))
        })
        .collect();
    now.iter_mut().zip(shifts).for_each(|(p, s)| *p += s);
}

#[cfg(test)]
mod tests {
    use super::super::near::NearLine;
    use super::super::pnn::{BendSettings, generate_bends};
    use super::super::synth::{CLEAR, Draws, Road, camera, render, way};
    use super::super::{NearSettings, Trapezoid, find_near_lane};
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn pnn() -> Pnn {
        Pnn::train(&generate_bends(&BendSettings { even: true, ..Default::default() }, 15, 1)).unwrap()
    }

    /// The camera's part as [`find_near_lane`] gives it, from points with 2 cm of noise.
    fn near(road: &Road, to_m: f64, noise_m: f64, seed: u64) -> CameraView {
        let line = |left: f64, seed| {
            let curve = fit_parabola(&way(road, 6.0, to_m, left, 60, noise_m, seed), None, None).unwrap();
            Some(NearLine {
                curve,
                stripe_m: 0.15,
                hough: std::array::from_fn(|_| super::super::HoughLine {
                    theta_rad: 0.0,
                    rho_px: 0.0,
                    votes: 0,
                    rows_px: [0.0; 2],
                }),
            })
        };
        CameraView::Lane(NearLane { left: line(1.75, seed), right: line(-1.75, seed + 7777) })
    }

    fn rms_by_part(r: &Recognition, road: &Road) -> [f64; 3] {
        [Part::Camera, Part::Middle, Part::Radar].map(|part| {
            let e: Vec<f64> = (r.middle_m.iter().zip(&r.parts))
                .filter(|(_, p)| **p == part)
                .map(|(m, _)| road.frenet(*m).1)
                .collect();
            (e.iter().map(|e| e * e).sum::<f64>() / e.len().max(1) as f64).sqrt()
        })
    }

    fn roads() -> [(&'static str, Road, f64, Option<i32>, RoadModel); 7] {
        [
            ("straight", Road::straight(), 60.0, None, RoadModel::Straight),
            ("curve right, 300 m", Road::curve(300.0, false), 60.0, None, RoadModel::CurveRight),
            ("curve left, 100 m", Road::curve(100.0, true), 55.0, None, RoadModel::CurveLeft),
            ("bend right by 0.6", Road::bend(24.0, 60.0, -0.6), 58.0, Some(1), RoadModel::CurveRight),
            ("bend left by 0.6", Road::bend(24.0, 60.0, 0.6), 58.0, Some(1), RoadModel::CurveLeft),
            (
                "right angle right",
                Road::bend(28.0, 15.0, -FRAC_PI_2),
                53.0,
                Some(1),
                RoadModel::RightAngleRight,
            ),
            ("right angle left", Road::bend(28.0, 15.0, FRAC_PI_2), 53.0, Some(1), RoadModel::RightAngleLeft),
        ]
    }

    /// From noisy parts to the lane: distance from the true middle in the near, the blind and the far part.
    #[test]
    fn five_roads() {
        let pnn = pnn();
        for (name, road, from, known, model) in roads() {
            for (noise, bound) in [(0.0, [0.06, 1.0, 0.12]), (0.3, [0.06, 1.2, 0.4])] {
                let (mut sum, mut fused, mut lanes, mut models, runs) = ([0.0; 3], 0, 0, 0, 50);
                for seed in 0..runs as u64 {
                    let trail = Trail::fit(&way(&road, from, from + 40.0, 3.5, 40, noise, 3 * seed)).unwrap();
                    let camera = near(&road, 24.0, if noise > 0.0 { 0.02 } else { 0.0 }, seed);
                    let trails = [trail];
                    let input = RecogniseInput { camera: &camera, trails: &trails, known_lanes: &[known] };
                    let r = recognise(&input, &pnn, &RecogniseSettings::default()).unwrap();
                    if r.sources != Sources::CameraAndRadar {
                        continue;
                    }
                    fused += 1;
                    lanes += usize::from(r.way.as_ref().is_some_and(|w| w.1 == 1));
                    models += usize::from(r.choice.as_ref().is_some_and(|c| c.model == model));
                    let e = rms_by_part(&r, &road);
                    (0..3).for_each(|i| sum[i] += e[i] * e[i]);
                    assert_eq!(r.middle_m.len(), r.parts.len());
                    assert!(r.left_m.len() == r.parts.len() && (r.lane_width_m - 3.5).abs() < 0.1);
                    for (m, l) in r.middle_m.iter().zip(&r.left_m) {
                        assert!((m.distance(*l) - 0.5 * r.lane_width_m).abs() < 1e-9);
                    }
                }
                let e = sum.map(|s| (s / fused.max(1) as f64).sqrt());
                println!(
                    "{name}, radar noise {noise} m: {fused} of {runs} joined, {lanes} in the right lane, \
                     {models} with the model as drawn; rms near {:.3}, middle {:.3}, far {:.3} m",
                    e[0], e[1], e[2]
                );
                assert!(lanes == fused && 10 * fused >= 8 * runs, "{name}");
                assert!((0..3).all(|i| e[i] < bound[i]), "{name} {noise} {e:?}");
            }
        }
    }

    /// Rendered image and tracks together.
    #[test]
    fn from_image_to_lane() {
        let pnn = pnn();
        let c = camera();
        let t = Trapezoid::of_ground(&c, 6.0, 35.0, 6.0).unwrap();
        for (name, road) in [("straight", Road::straight()), ("left curve 200 m", Road::curve(200.0, true))] {
            let image = render(&c, &road, &[(1.75, true), (-1.75, false)], &CLEAR, 2);
            let start = std::time::Instant::now();
            let lane = find_near_lane(&c, &image, &t, &NearSettings::default()).unwrap();
            let near_ms = start.elapsed().as_secs_f64() * 1e3;
            let trails = [Trail::fit(&way(&road, 50.0, 95.0, -3.5, 60, 0.2, 5)).unwrap()];
            let camera = CameraView::Lane(lane);
            let input = RecogniseInput { camera: &camera, trails: &trails, known_lanes: &[] };
            let start = std::time::Instant::now();
            let r = recognise(&input, &pnn, &RecogniseSettings::default()).unwrap();
            let ms = start.elapsed().as_secs_f64() * 1e3;
            let e = rms_by_part(&r, &road);
            println!(
                "{name}: image {near_ms:.1} ms, recognition {ms:.2} ms; \
                 rms near {:.3}, middle {:.3}, far {:.3} m",
                e[0], e[1], e[2]
            );
            assert_eq!(r.way.as_ref().map(|w| w.1), Some(-1));
            assert!(r.sources == Sources::CameraAndRadar && e[0] < 0.03 && e[1] < 0.3 && e[2] < 0.3);
        }
    }

    #[test]
    fn a_blinded_camera_leaves_the_radar_and_says_so() {
        let pnn = pnn();
        for (road, noise) in [(Road::straight(), 0.2), (Road::curve(250.0, false), 0.1)] {
            let camera = CameraView::Blinded(Blinding::Fog);
            let trails =
                [3.5, 0.0].map(|left| Trail::fit(&way(&road, 30.0, 80.0, left, 50, noise, 8)).unwrap());
            let input = RecogniseInput { camera: &camera, trails: &trails, known_lanes: &[] };
            let r = recognise(&input, &pnn, &RecogniseSettings::default()).unwrap();
            assert_eq!(r.sources, Sources::RadarAlone(Blinding::Fog));
            assert!(r.sources.to_string().contains("radar alone") && r.sources.to_string().contains("fog"));
            assert_eq!(r.way.map(|w| (w.0, w.1)), Some((1, 0)));
            assert!(r.choice.is_none() && r.parts.iter().all(|p| *p != Part::Camera));
            let e = rms_by_part(&Recognition { way: None, ..r.clone() }, &road);
            println!("radar alone: rms extension {:.3}, far {:.3} m", e[1], e[2]);
            assert!(e[1] < 0.8 && e[2] < 0.2 && r.middle_m[0].x.abs() < 2.0);
        }
        let none =
            RecogniseInput { camera: &CameraView::Blinded(Blinding::Glare), trails: &[], known_lanes: &[] };
        assert_eq!(
            recognise(&none, &pnn, &RecogniseSettings::default()),
            Err(LaneError::refused("neither the camera nor the radar sees a lane"))
        );
        // Too far to extend: the reason, not a guess.
        let far = [Trail::fit(&way(&Road::straight(), 90.0, 130.0, 0.0, 30, 0.0, 1)).unwrap()];
        let input = RecogniseInput { trails: &far, ..none };
        assert!(matches!(
            recognise(&input, &pnn, &RecogniseSettings::default()),
            Err(LaneError::OutOfRange { .. })
        ));
    }

    #[test]
    fn a_camera_without_radar_ends_early() {
        let camera = near(&Road::straight(), 25.0, 0.0, 1);
        let input = RecogniseInput { camera: &camera, trails: &[], known_lanes: &[] };
        let r = recognise(&input, &pnn(), &RecogniseSettings::default()).unwrap();
        assert!(r.sources == Sources::CameraAlone && r.middle_m.iter().all(|p| p.x < 25.5));
        // A way that leaves at a right angle, lane unknown, is not used, and the notes say why.
        let road = Road::bend(28.0, 15.0, FRAC_PI_2);
        let trails = [Trail::fit(&way(&road, 53.0, 90.0, 0.0, 40, 0.0, 1)).unwrap()];
        let r = recognise(
            &RecogniseInput { trails: &trails, ..input.clone() },
            &pnn(),
            &RecogniseSettings::default(),
        )
        .unwrap();
        assert!(r.sources == Sources::CameraAlone && matches!(r.notes[0], LaneError::Refused { .. }));
        let one = match &camera {
            CameraView::Lane(l) => CameraView::Lane(NearLane { left: None, right: l.right.clone() }),
            other => other.clone(),
        };
        let r = recognise(
            &RecogniseInput { camera: &one, ..input.clone() },
            &pnn(),
            &RecogniseSettings::default(),
        )
        .unwrap();
        assert!(r.middle_m.iter().all(|p| p.y.abs() < 0.01));
        let empty = CameraView::Lane(NearLane { left: None, right: None });
        assert!(
            recognise(
                &RecogniseInput { camera: &empty, ..input.clone() },
                &pnn(),
                &RecogniseSettings::default()
            )
            .is_err()
        );
        let bad = RecogniseSettings { lane_width_m: f64::NAN, ..Default::default() };
        assert!(recognise(&input, &pnn(), &bad).is_err());
        assert!(recognise(&input, &pnn(), &RecogniseSettings { step_m: 0.0, ..Default::default() }).is_err());
    }

    /// Averaging successive recognitions of a straight road lowers the scatter of the far part.
    #[test]
    fn overlap_steadies_the_lane() {
        let pnn = pnn();
        let road = Road::straight();
        let (mut once, mut dynamic, mut count) = (0.0, 0.0, 0.0f64);
        for run in 0..40 {
            let mut recogniser = Recogniser::new(RecogniseSettings::default());
            for step in 0..4 {
                let seed = 100 * run + step;
                let camera = near(&road, 24.0, 0.02, seed);
                let trails = [Trail::fit(&way(&road, 55.0, 95.0, 0.0, 30, 0.3, seed)).unwrap()];
                let input = RecogniseInput { camera: &camera, trails: &trails, known_lanes: &[] };
                let alone = recognise(&input, &pnn, &RecogniseSettings::default()).unwrap();
                let joined = recogniser.step(&input, &pnn, |p| Ok(p - DVec2::X * 10.0)).unwrap();
                let inner = |r: &Recognition| {
                    let e: Vec<f64> =
                        r.middle_m.iter().filter(|p| p.x > 56.0 && p.x < 84.0).map(|p| p.y * p.y).collect();
                    (!e.is_empty()).then(|| e.iter().sum::<f64>() / e.len() as f64)
                };
                // Steps whose way matched no lane have no far part.
                if let (3, Some(a), Some(b)) = (step, inner(&alone), inner(&joined)) {
                    (once, dynamic, count) = (once + a, dynamic + b, count + 1.0);
                }
            }
        }
        let (once, dynamic) = ((once / count).sqrt(), (dynamic / count).sqrt());
        println!(
            "straight road, {count} runs: far part {once:.3} m in one window, {dynamic:.3} m with overlap"
        );
        // Weights 1/2, 1/4, 1/8, 1/8 of four independent windows give sqrt(0.34) = 0.59 where all four know
        // the road.
        assert!(count > 30.0 && dynamic < 0.85 * once);
    }

    /// Straight to a right curve: the earlier near part steadies the present one, and the model is the new
    /// one.
    #[test]
    fn a_change_of_model_is_recognised_anew() {
        let pnn = pnn();
        let mut recogniser = Recogniser::new(RecogniseSettings::default());
        let mut draws = Draws::new(1, 0);
        let (first, second) = (Road::bend(100.0, 80.0, -0.7), Road::bend(25.0, 80.0, -0.7));
        let mut models = Vec::new();
        for (road, from) in [(first, 50.0), (second, 82.0)] {
            let camera = near(&road, 23.0, 0.02, (draws.uniform() * 1e6) as u64);
            let trails = [Trail::fit(&way(&road, from, from + 40.0, 0.0, 40, 0.1, 3)).unwrap()];
            let input = RecogniseInput { camera: &camera, trails: &trails, known_lanes: &[Some(0)] };
            let r = recogniser.step(&input, &pnn, |p| Ok(p - DVec2::X * 75.0)).unwrap();
            assert_eq!(r.sources, Sources::CameraAndRadar);
            models.push(r.joined_by);
            assert!(rms_by_part(&r, &road)[1] < 1.5, "{:?}", rms_by_part(&r, &road));
        }
        assert_eq!(models, [Some(RoadModel::Straight), Some(RoadModel::CurveRight)]);
        // A motion that is not known is passed on, and the state stays.
        let camera = near(&second, 23.0, 0.0, 1);
        let input = RecogniseInput { camera: &camera, trails: &[], known_lanes: &[] };
        let before = recogniser.clone();
        assert!(
            recogniser
                .step(&input, &pnn, |_| Err(LaneError::refused(
                    "neither the camera nor the radar sees a lane"
                )))
                .is_err()
        );
        assert_eq!(recogniser, before);
    }
}
