//! The camera and radar fusion behind the interface of all lane methods: it takes looks in order of time,
//! with pictures and tracks from any source.

use super::camera::{Camera, Trapezoid};
use super::curve::{Parabola, fit_parabola};
use super::edges::edges;
use super::near::{NearLane, NearSettings, find_near_lane};
use super::pnn::{BendSettings, Pnn, generate_bends};
use super::recognise::{
    Blinding, CameraView, Part, RecogniseInput, RecogniseSettings, Recogniser, Recognition, Sources,
};
use super::targets::{EgoPath, EgoSample, Trail};
use crate::body::Body;
use crate::curve::{Shape, fit, fit_simplest};
use crate::error::{LaneError, checked, finite, positive, within};
use crate::{LaneEstimate, LaneEstimator, Line, SensorInput};
use glam::DVec2;
use std::collections::BTreeMap;

/// The method's name, as on the command line.
pub const METHOD: &str = "camera-fusion";
/// Largest distance of a line's pieces from its points, m.
const PIECE_M: f64 = 0.1;
/// Minimum number of points of a path.
const LEAST_POINTS: usize = 6;
/// Largest scatter of a path's points about a parabola, m. Where it is larger, only the younger half of the
/// points is used.
const LARGEST_SCATTER_M: f64 = 0.4;
/// Correlation time of the errors of a track's places, s: the tracker remembers, and an echo wanders over a
/// car only slowly.
const ALIKE_S: f64 = 0.5;
/// A track without an update for this long has ended, s.
const GONE_S: f64 = 0.5;
/// Standard deviation of the change of a road's curvature along it, 1/m²: that of a bend of 80 m radius after
/// a clothoid of 60 m.
const CURVATURE_RATE: f64 = 2e-4;
/// Least speed away from the vehicle for a track to count as a car driving ahead, m/s.
const LEAST_AWAY_MPS: f64 = 0.5;

/// What [`CameraFusion`] works with, as [`super::CameraFusionOptions`] makes it of a camera and a radar.
#[derive(Debug, Clone, PartialEq)]
pub struct FusionSetup {
    /// The camera that takes the pictures.
    pub camera: Camera,
    /// Distances ahead of the near and the far side of the trapezoid on the ground, m.
    pub seen_m: [f64; 2],
    /// Half width of the trapezoid on the ground, m.
    pub half_width_m: f64,
    /// Settings of the near part, from the picture.
    pub near: NearSettings,
    /// Settings of the joining of near and far part.
    pub recognise: RecogniseSettings,
    /// Length of the time window of tracks in one recognition, s: the document's t. Successive windows share
    /// half of it.
    pub period_s: f64,
    /// Least length of a path that tells a road's shape, m.
    pub least_way_m: f64,
    /// Standard deviation of a car's middle from the middle of its lane, m.
    pub in_lane_std_m: f64,
    /// Size of the cars ahead. Echoes are moved to the middle of such a car, and the uncertainty of that step
    /// enters the lines' covariances. None: echoes are used where they are, taken to lie anywhere on the
    /// width of a passenger car.
    pub body: Option<Body>,
    /// Position of the radar in the vehicle frame, m.
    pub radar_at_m: DVec2,
    /// Standard deviation of the angle between a car's axis and the direction of its path, rad.
    pub axis_std_rad: f64,
    /// Standard deviation of the camera's pitch, rad, which moves points on the ground.
    pub pitch_std_rad: f64,
    /// Settings of the bends that train the network.
    pub bends: BendSettings,
    /// Number of training bends, which is the number of units in the network's second layer.
    pub units: usize,
    /// Seed of the random draws of the training bends.
    pub seed: u64,
}

impl FusionSetup {
    /// Setup with the document's network (15 units), a trapezoid from 6 to 35 m ahead, and a radar in the
    /// front bumper.
    pub fn new(camera: Camera) -> FusionSetup {
        FusionSetup {
            camera,
            seen_m: [6.0, 35.0],
            half_width_m: 6.0,
            near: NearSettings::default(),
            recognise: RecogniseSettings::default(),
            period_s: 2.0,
            least_way_m: 8.0,
            in_lane_std_m: 0.25,
            body: Some(Body::CAR),
            radar_at_m: DVec2::new(3.6, 0.0),
            axis_std_rad: 2f64.to_radians(),
            pitch_std_rad: 0.1f64.to_radians(),
            bends: BendSettings { even: true, ..BendSettings::default() },
            units: 15,
            seed: 1,
        }
    }
}

/// A track at one time, in the vehicle frame of that time.
#[derive(Debug, Clone, Copy)]
struct TrackSample {
    time_s: f64,
    at_m: DVec2,
    velocity_mps: DVec2,
    std_m: f64,
}

/// A track at one time and the position of the radar that saw it, in the present vehicle frame.
#[derive(Debug, Clone, Copy)]
struct Echo {
    time_s: f64,
    at_m: DVec2,
    radar_m: DVec2,
    std_m: f64,
}

/// The path of one car ahead, in the present vehicle frame.
#[derive(Debug, Clone, PartialEq)]
pub struct LeadPath {
    /// Identifier of the track.
    pub id: u64,
    /// Points of the path, moved to the car's middle, m.
    pub points_m: Vec<DVec2>,
    /// The curve through the points, with its extension by arcs.
    pub trail: Trail,
    /// Standard deviation of the whole path from that of the car's middle, m, since the place of the echoes
    /// on the car is not known.
    pub echo_std_m: f64,
}

/// What the last look was made of, for inspection.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Insight {
    /// The lane as the camera sees it.
    pub near: Option<NearLane>,
    /// The reason why the camera gave nothing.
    pub blinded: Option<Blinding>,
    /// The paths of the cars ahead.
    pub ways: Vec<LeadPath>,
    /// The result of joining near and far part.
    pub recognition: Option<Recognition>,
}

/// Estimates the lane from pictures, tracks and the vehicle's own motion, from any source (Sangeetha
/// Lakshmi).
///
/// A look without a picture rests on the radar alone, a look without tracks on the camera alone; the
/// provenance of an estimate states which. Without a yaw rate the vehicle's path is taken to bend as the
/// camera's last lane does, as in the document.
#[derive(Debug, Clone)]
pub struct CameraFusion {
    options: FusionSetup,
    pnn: Pnn,
    trapezoid: Trapezoid,
    ego: Vec<EgoSample>,
    told: BTreeMap<u64, Vec<TrackSample>>,
    /// Lanes of tracks as last matched, counted from the own lane.
    lanes: BTreeMap<u64, i32>,
    /// Last samples of tracks that ended with their lane known.
    lost: Vec<(TrackSample, i32)>,
    /// Curvature of the last lane that the camera saw, 1/m.
    seen_curvature: f64,
    /// Time and state of the last recognition that is at least half a period old.
    before: Option<(f64, Recogniser)>,
    insight: Insight,
}

impl CameraFusion {
    /// Makes the estimator and trains its network.
    ///
    /// # Errors
    /// Returns an error if an option is outside its range, the trapezoid lies outside the picture, or the
    /// training bends do not suffice.
    pub fn new(options: FusionSetup) -> Result<CameraFusion, LaneError> {
        let [near_m, far_m] = options.seen_m;
        let trapezoid = Trapezoid::of_ground(&options.camera, near_m, far_m, options.half_width_m)?;
        let rows = trapezoid.bottom_v_px.min(options.camera.height_px as f64) - trapezoid.top_v_px.max(0.0);
        if rows.is_nan() || rows < 8.0 {
            return Err(LaneError::undetermined("the near lane, because the trapezoid is outside the image"));
        }
        positive("the period", options.period_s)?;
        positive("the minimum track length", options.least_way_m)?;
        positive("the standard deviation of the position in the lane", options.in_lane_std_m)?;
        within("the standard deviation of the axis", options.axis_std_rad, 0.0..=1.0)?;
        finite("the position of the radar", options.radar_at_m.x + options.radar_at_m.y)?;
        if let Some(b) = options.body {
            let is_body =
                b.length_m > 0.0 && b.width_m > 0.0 && b.width_std_m >= 0.0 && b.length_m.is_finite();
            checked("the width of a car", b.width_m, is_body, "above 0")?;
        }
        within("the pitch's standard deviation", options.pitch_std_rad, 0.0..=0.1)?;
        within("the network's units", options.units as f64, 10.0..=10_000.0)?;
        let pnn = Pnn::train(&generate_bends(&options.bends, options.units, options.seed))?;
        Ok(CameraFusion {
            pnn,
            trapezoid,
            ego: Vec::new(),
            told: BTreeMap::new(),
            lanes: BTreeMap::new(),
            lost: Vec::new(),
            seen_curvature: 0.0,
            before: None,
            insight: Insight::default(),
            options,
        })
    }

    /// The part of the picture in which lines are sought.
    pub fn trapezoid(&self) -> &Trapezoid {
        &self.trapezoid
    }

    /// The network that chooses the road model.
    pub fn pnn(&self) -> &Pnn {
        &self.pnn
    }

    /// What the last estimate was made of.
    pub fn insight(&self) -> &Insight {
        &self.insight
    }

    /// Takes in tracks and the vehicle's motion without making an estimate, for frames between pictures.
    ///
    /// # Errors
    /// Returns an error if the time is non-finite or runs backwards, or if there are tracks but no speed.
    pub fn observe(&mut self, input: &SensorInput<'_>) -> Result<(), LaneError> {
        if !input.time_s.is_finite() {
            return Err(LaneError::not_finite("the time of the frame"));
        }
        if self.ego.last().is_some_and(|e| e.time_s > input.time_s) {
            return Err(LaneError::refused("frames must follow in the order of their times"));
        }
        let Some(speed) = input.speed_mps.map(|m| m.value).filter(|v| v.is_finite() && v.abs() < 200.0)
        else {
            // Tracks of different times cannot be brought together.
            self.forget();
            return match input.tracks.is_empty() {
                true => Ok(()),
                false => Err(LaneError::NoSpeed),
            };
        };
        let yaw_rate = input.yaw_rate_rad_per_s.map(|m| m.value).filter(|v| v.is_finite() && v.abs() < 10.0);
        let curvature_1pm = match yaw_rate {
            // At walking pace and below, noise would tie the path in a knot.
            Some(rate) if speed.abs() > 0.5 => rate / speed,
            Some(_) => 0.0,
            None => self.seen_curvature,
        };
        self.ego.push(EgoSample { time_s: input.time_s, speed_mps: speed, curvature_1pm });
        for t in input.tracks {
            let told = TrackSample {
                time_s: input.time_s,
                at_m: DVec2::from_array(t.at_m),
                velocity_mps: DVec2::from_array(t.velocity_mps),
                std_m: DVec2::from_array(t.std_m).length(),
            };
            let sound = told.at_m.is_finite()
                && told.at_m.length() < 1e4
                && told.velocity_mps.is_finite()
                && told.std_m.is_finite();
            if sound {
                self.told.entry(t.id).or_default().push(told);
            }
        }
        // Half a period more than is used, since the recognition before this one is moved along, too.
        let oldest = input.time_s - 2.0 * self.options.period_s;
        self.ego.retain(|e| e.time_s >= oldest);
        let (lost, lanes) = (&mut self.lost, &self.lanes);
        self.told.retain(|id, way| {
            let goes_on = way.last().is_some_and(|t| input.time_s - t.time_s <= GONE_S);
            if let (false, Some(last), Some(lane)) = (goes_on, way.last(), lanes.get(id)) {
                lost.push((*last, *lane));
            }
            way.retain(|t| t.time_s >= oldest);
            goes_on
        });
        self.lost.retain(|(t, _)| t.time_s >= oldest);
        self.lanes.retain(|id, _| self.told.contains_key(id));
        Ok(())
    }

    fn forget(&mut self) {
        self.ego.clear();
        self.told.clear();
        self.lanes.clear();
        self.lost.clear();
        self.before = None;
    }

    /// The paths of the cars ahead, from the tracks of one period.
    fn ways(&self, path: &EgoPath, now_s: f64) -> Vec<LeadPath> {
        let from_s = now_s - self.options.period_s - 1e-9;
        let way = |(id, told): (&u64, &Vec<TrackSample>)| {
            let last = told.last()?;
            let away = last.velocity_mps.dot(last.at_m.normalize_or_zero());
            if away < LEAST_AWAY_MPS {
                return None;
            }
            let used: Vec<Echo> = told
                .iter()
                .filter(|t| t.time_s >= from_s)
                .filter_map(|t| {
                    Some(Echo {
                        time_s: t.time_s,
                        at_m: path.moved(t.at_m, t.time_s, now_s).ok()?,
                        radar_m: path.moved(self.options.radar_at_m, t.time_s, now_s).ok()?,
                        std_m: t.std_m.max(0.02),
                    })
                })
                .collect();
            let (points_m, curve, echo_std_m) = match self.through(&used)? {
                found if found.1.residual_m > LARGEST_SCATTER_M => {
                    self.through(&used[used.len() / 2..]).unwrap_or(found)
                }
                found => found,
            };
            // Trails start at the end that is nearer to the car, and a car that drives away leaves them in that order.
            let trail = Trail::new(curve).ok()?;
            Some(LeadPath { id: *id, points_m, trail, echo_std_m })
        };
        self.told.iter().filter_map(way).collect()
    }

    /// The path of the middle of the car that made these echoes, with its parabola and its standard deviation
    /// sideways. The car's axis is taken along the path of its echoes.
    fn through(&self, echoes: &[Echo]) -> Option<(Vec<DVec2>, Parabola, f64)> {
        let weights: Vec<f64> = echoes.iter().map(|e| e.std_m.powi(-2)).collect();
        let fitted = |points: &[DVec2]| -> Option<Parabola> {
            let long = points.first()?.distance(*points.last()?) >= self.options.least_way_m;
            (points.len() >= LEAST_POINTS && long)
                .then(|| fit_parabola(points, Some(&weights), None).ok())
                .flatten()
        };
        let seen: Vec<DVec2> = echoes.iter().map(|e| e.at_m).collect();
        let curve = fitted(&seen)?;
        let Some(body) = self.options.body else {
            return Some((seen, curve, Body::CAR.width_m / 12f64.sqrt()));
        };
        let lasted_s = echoes.last()?.time_s - echoes.first()?.time_s;
        // The fit takes errors of neighbours as independent; three of the independent ones are spent on its
        // parameters.
        let apart = (lasted_s / ALIKE_S + 1.0 - 3.0).max(0.5);
        let alike = (echoes.len().saturating_sub(3) as f64 / apart).sqrt().max(1.0);
        // One side for the whole path: its direction has one error, and different steps would turn it.
        let count = echoes.len() as f64;
        let (mut aside, mut range, mut bend, mut middle, mut std) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for e in echoes {
            let u = curve.coordinate(e.at_m);
            let from = e.radar_m - e.at_m;
            aside += from.dot(DVec2::from_angle(curve.heading_rad(u)).perp()) / count;
            range += from.length() / count;
            bend += curve.curvature_1pm(u) / count;
            middle += u / count;
            std += e.std_m / count;
        }
        // An echo may lie anywhere along its car, whose axis is that of the path at the car's middle.
        let slip = bend * body.length_m / 12f64.sqrt();
        let turn = self.options.axis_std_rad.hypot(alike * curve.sigma_slope(middle)).hypot(slip);
        let step = body.left_m(aside, (range * turn).hypot(std));
        let moved = |e: &Echo| {
            let u = curve.coordinate(e.at_m);
            e.at_m + DVec2::from_angle(curve.heading_rad(u)).perp() * step.value
        };
        // This is not repeated with the new path's direction, which would only confirm the step that it came
        // from.
        let points: Vec<DVec2> = echoes.iter().map(moved).collect();
        let curve = fitted(&points)?;
        Some((points, curve, step.std))
    }

    /// The lane of a car that was lost and is seen again under another identifier: the lost car that has gone
    /// on at its last speed from its last place to where this track begins. In a bend the chord is up to a
    /// tenth shorter than the path (a right angle).
    fn lane_again(&self, id: u64, path: &EgoPath) -> Option<i32> {
        let first = self.told.get(&id)?.first()?;
        let fits = |(last, _): &&(TrackSample, i32)| {
            let passed_s = first.time_s - last.time_s;
            let Ok(then) = path.moved(last.at_m, last.time_s, first.time_s) else { return false };
            let gone_m = last.velocity_mps.length() * passed_s;
            // One car's length of tolerance, as another part of the car may be seen.
            passed_s > 0.0 && (0.9 * gone_m - 4.5..=gone_m + 4.5).contains(&then.distance(first.at_m))
        };
        let mut found = self.lost.iter().filter(fits).map(|l| l.1);
        let lane = found.next()?;
        // Two fits in different lanes tell nothing.
        found.all(|other| other == lane).then_some(lane)
    }

    /// The near lane in the look's picture, or the reason why there is none.
    fn see(&self, input: &SensorInput<'_>) -> Result<CameraView, LaneError> {
        let o = &self.options;
        let Some(image) = input.image else { return Ok(CameraView::Blinded(Blinding::Covered)) };
        match find_near_lane(&o.camera, image, &self.trapezoid, &o.near) {
            Ok(lane) => Ok(CameraView::Lane(lane)),
            Err(LaneError::NoLaneLine) => {
                let found = edges(image, &self.trapezoid, &o.near.edges)?;
                Ok(CameraView::Blinded(match (found.bright_share, found.dark_share) {
                    (bright, _) if bright > 0.2 => Blinding::Glare,
                    (_, dark) if dark > 0.5 => Blinding::Dark,
                    _ => Blinding::NoLine,
                }))
            }
            Err(other) => Err(other),
        }
    }

    fn recognised(&mut self, input: &SensorInput<'_>) -> Result<LaneEstimate, LaneError> {
        self.observe(input)?;
        let camera = self.see(input)?;
        let path = EgoPath::new(&self.ego, 0.0);
        let ways = path.as_ref().map_or_else(|_| Vec::new(), |p| self.ways(p, input.time_s));
        self.insight = Insight { ways: ways.clone(), ..Insight::default() };
        match &camera {
            CameraView::Lane(lane) => self.insight.near = Some(lane.clone()),
            CameraView::Blinded(why) => self.insight.blinded = Some(*why),
        }
        if input.image.is_none() && input.tracks.is_empty() {
            return Err(LaneError::NotGiven { what: "an image, or tracks of cars ahead".into() });
        }
        if let (CameraView::Blinded(why), true) = (&camera, ways.is_empty()) {
            let least_m = self.options.least_way_m;
            return Err(LaneError::refused(format!(
                "the camera is blinded by {why}, and no car ahead has a track of {least_m} m"
            )));
        }
        let trails: Vec<Trail> = ways.iter().map(|w| w.trail.clone()).collect();
        for w in &ways {
            if let (false, Ok(path)) = (self.lanes.contains_key(&w.id), &path)
                && let Some(lane) = self.lane_again(w.id, path)
            {
                self.lanes.insert(w.id, lane);
            }
        }
        let known_lanes: Vec<Option<i32>> = ways.iter().map(|w| self.lanes.get(&w.id).copied()).collect();
        let parts = RecogniseInput { camera: &camera, trails: &trails, known_lanes: &known_lanes };
        let mut recogniser = match &self.before {
            Some((_, before)) => before.clone(),
            None => Recogniser::new(self.options.recognise),
        };
        let then_s = self.before.as_ref().map_or(input.time_s, |b| b.0);
        let joined = recogniser.step(&parts, &self.pnn, |p| match &path {
            Ok(path) => path.moved(p, then_s, input.time_s),
            Err(e) => Err(e.clone()),
        });
        let found = match joined {
            Ok(found) => found,
            // The recognition before is too old to be moved into this frame.
            Err(_) if self.before.is_some() => {
                recogniser = Recogniser::new(self.options.recognise);
                recogniser.step(&parts, &self.pnn, Ok)?
            }
            Err(e) => return Err(e),
        };
        if self.before.as_ref().is_none_or(|b| input.time_s - b.0 >= 0.5 * self.options.period_s - 1e-6) {
            self.before = Some((input.time_s, recogniser));
        }
        if let Some((i, lane, Some(_))) = &found.way {
            self.lanes.insert(ways[*i].id, *lane);
        }
        if let CameraView::Lane(lane) = &camera {
            let line = lane.left.as_ref().or(lane.right.as_ref());
            self.seen_curvature = line.map_or(0.0, |l| l.curve.curvature_1pm(l.curve.span_m[0]));
        }
        let estimate = self.stated(input, &camera, &found, &ways);
        self.insight.recognition = Some(found);
        estimate
    }

    /// The recognition as lane lines with their covariance.
    fn stated(
        &self,
        input: &SensorInput<'_>,
        camera: &CameraView,
        found: &Recognition,
        ways: &[LeadPath],
    ) -> Result<LaneEstimate, LaneError> {
        let lane = match camera {
            CameraView::Lane(lane) => Some(lane),
            CameraView::Blinded(_) => None,
        };
        let matched = found.way.as_ref().and_then(|w| w.2).map_or(0.5, |m| m.r_squared.clamp(0.0, 1.0));
        let (mut first, mut rest) = (Vec::new(), Vec::new());
        for (left, points) in [(true, &found.left_m), (false, &found.right_m)] {
            let seen = lane.and_then(|l| if left { l.left.as_ref() } else { l.right.as_ref() });
            let near = found.parts.iter().take_while(|p| **p == Part::Camera).count();
            if let Some(line) = seen {
                first.extend(self.near_line(&line.curve));
            } else if near > 3 {
                // Half a lane of assumed width beside the other line.
                let std = vec![self.options.in_lane_std_m * (near as f64).sqrt(); near];
                let fitted = fit(&points[..near], &std, Shape::Arc);
                first.extend(fitted.map(|fitted| Line { fitted, confidence: 0.5, members: Vec::new() }));
            }
            let (far, std) = self.far_points(points, found, ways, near);
            let confidence = if lane.is_some() { 0.5 + 0.4 * matched } else { 0.5 };
            let mut pieces = Vec::new();
            split(&far, &std, confidence, &mut pieces);
            if near == 0 && seen.is_none() && !pieces.is_empty() {
                first.push(pieces.remove(0));
            }
            rest.extend(pieces);
        }
        if first.is_empty() {
            return Err(LaneError::refused("the lines do not extend to the vehicle"));
        }
        let mut e = LaneEstimate::of_lines(METHOD, input.time_s, input.tracks.len(), first);
        e.lines.extend(rest);
        let sources = match found.sources {
            Sources::CameraAndRadar => "camera and radar",
            Sources::CameraAlone => "camera alone",
            Sources::RadarAlone(_) => "radar alone",
        };
        e.provenance.method = format!("{METHOD} ({sources})");
        e.provenance.used = usize::from(found.way.is_some());
        Ok(e)
    }

    /// A line that the camera sees, extended back to the car.
    fn near_line(&self, curve: &Parabola) -> Option<Line> {
        let [a, b] = curve.span_m;
        let start = curve.coordinate(DVec2::ZERO).min(a);
        let count = 30;
        let (mut points, mut std) = (Vec::new(), Vec::new());
        for i in 0..count {
            let u = start + (b - start) * i as f64 / f64::from(count - 1);
            let (p, heading) = (curve.point(u), curve.heading_rad(u));
            // A pitch error p moves the ground point at x by x²p/h along the ray and scales the offset alike.
            let away = p - self.options.camera.position_m.truncate();
            let stretch = away.length() * self.options.pitch_std_rad / self.options.camera.position_m.z;
            let tilt = (away * stretch).perp_dot(DVec2::from_angle(heading)).abs();
            points.push(p);
            // Errors of neighbours are correlated: three parameters count as three points.
            let inside = curve.sigma_m(u).hypot(0.01);
            // Behind the picture's lower edge the road may have bent otherwise.
            let unseen =
                CURVATURE_RATE * (0.5 * (a + b) - u).max(0.0).powi(3) / 6.0 * f64::from(u8::from(u < a));
            std.push(inside.hypot(tilt).hypot(unseen) * (f64::from(count) / 3.0).sqrt());
        }
        let fitted = fit(&points, &std, Shape::Arc)?;
        Some(Line { fitted, confidence: 0.95, members: Vec::new() })
    }

    /// The points beyond the camera's part. Their standard deviations count each part as one measurement of
    /// where its cars drive.
    fn far_points(
        &self,
        points: &[DVec2],
        found: &Recognition,
        ways: &[LeadPath],
        near: usize,
    ) -> (Vec<DVec2>, Vec<f64>) {
        let parts = &found.parts[near.min(found.parts.len())..];
        let count = |p: Part| parts.iter().filter(|q| **q == p).count().max(1) as f64;
        let (middle, radar) = (count(Part::Middle), count(Part::Radar));
        let scatter =
            found.way.as_ref().and_then(|w| ways.get(w.0)).map_or(0.3, |w| {
                w.trail.curve.residual_m / (w.trail.curve.count as f64 / 3.0).max(1.0).sqrt()
            });
        let echo = found.way.as_ref().and_then(|w| ways.get(w.0)).map_or(0.0, |w| w.echo_std_m);
        let far_std = self.options.in_lane_std_m.hypot(scatter).hypot(echo);
        // With the camera's end at its start the middle is fixed at both ends, without it at one.
        let blind = found.sources != Sources::CameraAndRadar;
        let mut passed = 0.0;
        let std = parts.iter().map(|p| match p {
            Part::Middle => {
                passed += 1.0;
                let t = passed / middle;
                let grown = if blind { 0.02 * middle * (1.0 - t) } else { 0.04 * middle * t * (1.0 - t) };
                let held = if blind { far_std } else { far_std * t };
                held.hypot(grown).max(0.03) * middle.sqrt()
            }
            _ => far_std * radar.sqrt(),
        });
        let std = std.collect();
        (points[near.min(points.len())..].to_vec(), std)
    }
}

/// Splits the points by halving into as few lines, arcs and clothoids as keep close to them.
fn split(points: &[DVec2], std_m: &[f64], confidence: f64, out: &mut Vec<Line>) {
    if points.len() < 4 || points.len() != std_m.len() {
        return;
    }
    // Equal weights for the shape, so that a part of large uncertainty bends as drawn.
    let even = vec![PIECE_M; points.len()];
    let shaped = fit_simplest(points, &even, 1.0);
    let off = |c: &crate::curve::Clothoid| points.iter().map(|p| c.foot(*p).left_m.abs()).fold(0.0, f64::max);
    match shaped {
        Some(f) if off(&f.curve) <= PIECE_M || points.len() < 8 => {
            // The uncertainty is that of the points.
            let doubt = fit(points, std_m, f.shape).map_or(f.covariance, |d| d.covariance);
            let fitted = crate::curve::Fitted { covariance: doubt, ..f };
            out.push(Line { fitted, confidence, members: Vec::new() });
        }
        _ => {
            let half = points.len() / 2;
            split(&points[..=half], &std_m[..=half], confidence, out);
            split(&points[half..], &std_m[half..], confidence, out);
        }
    }
}

impl LaneEstimator for CameraFusion {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        match self.recognised(input) {
            Ok(e) => e,
            Err(why) => LaneEstimate::none(METHOD, input.time_s, input.tracks.len(), why),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::Arc;
    use super::super::synth::{Draws, camera};
    use super::*;

    fn fusion(body: Option<Body>) -> CameraFusion {
        CameraFusion::new(FusionSetup { body, ..FusionSetup::new(camera()) }).unwrap()
    }

    /// A car on a road, two seconds at 12 m/s: it returns from `right_m` of its middle.
    fn echoes(road: &Arc, right_m: f64, noise_m: f64) -> Vec<Echo> {
        let mut draws = Draws::new(5, 0);
        (0..20)
            .map(|i| {
                let s = 1.2 * f64::from(i);
                let right = right_m + noise_m * draws.normal();
                let left = DVec2::from_angle(road.heading_at(s)).perp();
                Echo {
                    time_s: 0.1 * f64::from(i),
                    at_m: road.point(s) - left * right,
                    radar_m: DVec2::new(3.6, 0.0),
                    std_m: 0.05,
                }
            })
            .collect()
    }

    #[test]
    fn ways_are_those_of_the_cars_middle() {
        for side in [1.0, -1.0] {
            // In the next lane of a bend: the side towards the radar returns.
            let road = Arc {
                point_m: DVec2::new(35.0, 5.0 * side),
                heading_rad: 0.2 * side,
                curvature_1pm: side / 150.0,
            };
            // From the left of the radar's line it shows its right side, and where it turns left, its left one.
            let aside = DVec2::new(3.6, 0.0) - road.point_m;
            let right = -0.9 * aside.dot(DVec2::from_angle(road.heading_rad).perp()).signum();
            let off = |body| {
                let (points, _, std) = fusion(body).through(&echoes(&road, right, 0.01)).unwrap();
                let far = points.iter().enumerate().map(|(i, p)| p.distance(road.point(1.2 * i as f64)));
                (far.fold(0.0, f64::max), std)
            };
            let (moved, std) = off(Some(Body::CAR));
            assert!(moved < 0.15 && std < 0.3, "{side}: {moved} {std}");
            let (kept, std) = off(None);
            assert!((kept - 0.9).abs() < 0.1 && (std - 0.52).abs() < 0.01, "{side}: {kept} {std}");
        }
    }

    #[test]
    fn a_car_straight_ahead_has_no_side() {
        let road = Arc { point_m: DVec2::new(30.0, 0.0), heading_rad: 0.0, curvature_1pm: 0.0 };
        let (points, _, std) = fusion(Some(Body::CAR)).through(&echoes(&road, 0.0, 0.01)).unwrap();
        assert!(points.iter().all(|p| p.y.abs() < 0.2), "{points:?}");
        assert!(std > 0.4, "{std}");
    }
}
