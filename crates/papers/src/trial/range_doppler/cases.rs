//! Single looks from given poses, each on a road of its own.

use crate::trial::kit::*;
use crate::trial::range_doppler::looks::{RadarDrive, RadarLook, errors};
use crate::trial::range_doppler::settings::{Case, Settings};
use catseye::scene::scenario::{Ego, EgoPlan};
use catseye_lane::range_doppler::LaneFromMap;
use std::fmt::Write as _;
use std::path::Path;

/// Least distance by which rows reach back behind the radar, m.
const BEHIND_M: f64 = 10.0;
/// Range at which the distance of the two curves is stated, m.
const APART_AT_M: f64 = 5.0;
/// Largest width of the strip beside the lane, m.
const VERGE_M: f64 = 6.0;

impl Case {
    /// Title for pictures.
    pub(super) fn title(&self) -> String {
        let mut out = format!("{}: offset {} m", self.name, self.offset_m);
        if self.heading_deg != 0.0 {
            let _ = write!(out, ", heading {}°", self.heading_deg);
        }
        if self.radius_m != 0.0 {
            let _ = write!(out, ", radius {} m after {} m", self.radius_m, self.bend_after_m);
        }
        out
    }

    fn radius_m(&self) -> Option<f64> {
        (self.radius_m != 0.0).then_some(self.radius_m.abs())
    }

    /// The road of this case: its axis in the middle of the lane, along x from the origin to the bend.
    fn road(&self, s: &Settings, radar_x_m: f64) -> String {
        let reach = s.far_m + 5.0;
        let straight = radar_x_m + if self.radius_m == 0.0 { reach } else { self.bend_after_m };
        let mut plan = format!("{{ kind = \"straight\", length_m = {straight:.6} }}");
        let mut verge = VERGE_M;
        if let Some(radius) = self.radius_m() {
            // Half a turn, or as far as the radar sees; it ends with no straight.
            let length = (std::f64::consts::PI * radius).min(reach);
            let turn = (length / radius).to_degrees().copysign(self.radius_m);
            let (angle, side) = (turn.abs(), if turn < 0.0 { -radius } else { radius });
            let _ = write!(plan, ", {{ kind = \"arc\", radius_m = {side:.6}, angle_deg = {angle:.6} }}");
            verge = verge.min(0.5 * (radius - 0.5 * s.lane_width_m));
        }
        let lane = s.lane_width_m;
        let inside = 0.5 * (lane - s.row_distance_m);
        let mut text = format!(
            "name = \"case\"\n[[road]]\nname = \"lane\"\nplan = [{plan}]\nlane_offset_m = {}\n\
             right = [{{ width_m = {lane}, number = 1 }}]\n\
             verge = [{{ side = \"left\", width_m = {verge:.4} }}, {{ side = \"right\", width_m = {verge:.4} }}]\n",
            0.5 * lane
        );
        let right_spacing_m = if self.equal { s.left_spacing_m } else { s.right_spacing_m };
        for (name, offset, spacing) in
            [("left", -inside, s.left_spacing_m), ("right", inside, right_spacing_m)]
        {
            let _ = write!(
                text,
                "[[road.markers]]\nname = \"{name}\"\nreflector = {:?}\n\
                 lateral = {{ lane = 1, side = \"{name}\", offset_m = {offset} }}\nfrom_m = 0.2\n\
                 spacing_m = {spacing}\n",
                s.marker
            );
        }
        text
    }

    /// The site with the radar in the lane of this case; its position along the row is drawn at random.
    fn site(
        &self,
        scenario: &Scenario,
        s: &Settings,
        which: usize,
        speed_mps: f64,
        draws: &mut Draws,
    ) -> Result<Site> {
        let x_m = BEHIND_M + s.left_spacing_m.max(s.right_spacing_m) * draws.uniform();
        let plan = scene_toml::parse(Path::new("case.toml"), &self.road(s, x_m))?;
        let yaw_rad = self.heading_deg.to_radians();
        let lever = scenario.radars[which].mounting.translation_m.truncate();
        let at = DVec2::new(x_m, self.offset_m) - DVec2::from_angle(yaw_rad).rotate(lever);
        let ego = Ego { position_m: DVec3::new(at.x, at.y, 0.0), yaw_rad, speed_mps, motion: None };
        Site::on(&scenario.clone().with_ego(EgoPlan::Free(ego)), plan)
    }
}

/// Runs each case once in each run.
pub(super) fn looks(given: &TrialContext<'_>, s: &Settings, which: usize) -> Result<Vec<RadarLook>> {
    let ego = &given.scenario.ego;
    let speed_mps = match ego {
        EgoPlan::Free(ego) => ego.speed_mps,
        EgoPlan::OnRoad(on) => on.drive.speed_mps(0.0),
    };
    if !(0.5..=150.0).contains(&speed_mps) {
        let bad = BadInput::new("is out of range").key("ego.speed_mps").value(speed_mps);
        return Err(bad.allowed("0.5..=150").remedy("give a speed in that range").into());
    }
    let mut out: Vec<RadarLook> = Vec::new();
    for run in 0..given.runs {
        let mut scenario = given.scenario_of(run);
        let mut draws = draws(scenario.seed, 0xca5e);
        for (i, case) in (0..).zip(&s.case) {
            // Noise of its own for each case.
            scenario.seed = given.scenario_of(run).seed.wrapping_add(1_000_003 * (u64::from(i) + 1));
            let site = case.site(&scenario, s, which, speed_mps, &mut draws)?;
            let drive = Drive::new(&site, given.engine)?;
            let equal = case.equal || s.left_spacing_m == s.right_spacing_m;
            let pictured = |_: u32| run == 0 && i < s.pictures;
            let mut looks = RadarDrive::new(&drive, which, s, equal, &pictured)?;
            one_look(given, (&drive, which), (run, 0), &format!("run{run}_frame{i}"), &mut looks)?;
            out.extend(looks.made.into_iter().map(|mut made| {
                made.case = Some(i as usize);
                made.step.frame = i;
                made
            }));
            given.report_frame(run, i, s.case.len() as u32);
        }
    }
    Ok(out)
}

/// Rows with the given and the estimated values of each case, and the shape of the curves.
pub(super) fn rows(rows: &mut Vec<Row>, s: &Settings, made: &[RadarLook]) {
    let mut bends: Vec<f64> = Vec::new();
    for (i, case) in s.case.iter().enumerate() {
        let looks: Vec<&RadarLook> = made.iter().filter(|m| m.case == Some(i)).collect();
        let lanes = || looks.iter().filter_map(|m| Some((*m, m.look.lane.as_ref()?)));
        let name = &case.name;
        let sign = |m: &RadarLook, v: f64, set: f64| match m.look.estimate.mirror {
            // Up to the sign, which is the set one's here.
            true => v.abs() * if set < 0.0 { -1.0 } else { 1.0 },
            false => v,
        };
        let size = if case.equal { "size only: equal spacings; " } else { "" };
        let offset: Vec<f64> = lanes().map(|(m, l)| sign(m, l.offset_m.value, case.offset_m)).collect();
        let why = format!("{size}the value that is set; the document draws it and states no estimate");
        rows.mean(format!("offset, {name}"), "m", &offset).document(case.offset_m).why(&why);
        if case.heading_deg != 0.0 {
            let degrees = |l: &LaneFromMap| l.heading_rad.value.to_degrees();
            let heading: Vec<f64> = lanes().map(|(m, l)| sign(m, degrees(l), case.heading_deg)).collect();
            rows.mean(format!("heading, {name}"), "deg", &heading).document(case.heading_deg).why(&why);
            // The marker in the direction of motion has the vehicle's speed (Fig. 3.23).
            let peak: Vec<f64> = lanes().filter_map(|(_, l)| peak_m(l, s)).collect();
            let set = (0.5 * s.row_distance_m - case.offset_m * case.heading_deg.signum())
                / case.heading_deg.to_radians().sin().abs();
            rows.mean(format!("range of the peak of the curves, {name}"), "m", &peak)
                .document(set)
                .why("row distance and heading as set, by geometry");
        }
        if let Some(radius) = case.radius_m() {
            let told: Vec<f64> = lanes().filter_map(|(_, l)| Some(l.radius_m()?[0])).collect();
            bends.extend(told.iter().map(|r| (r / radius - 1.0).abs() * 100.0));
            let why = format!("estimated in {} of {} frames; {why}", told.len(), looks.len());
            rows.mean(format!("radius, {name}"), "m", &told).document(radius).why(why);
            let observed = lanes().filter(|(_, l)| l.curve_start_m.observed);
            let start: Vec<f64> = observed.map(|(_, l)| l.curve_start_m.value).collect();
            rows.mean(format!("distance to the bend, {name}"), "m", &start)
                .document(case.bend_after_m)
                .why("the value that is set here");
        } else {
            let apart: Vec<f64> = lanes().filter_map(|(_, l)| apart_mps(l, s)).collect();
            let v = looks.first().map_or(0.0, |m| m.speed_mps);
            rows.mean(format!("distance of the curves at {APART_AT_M} m, {name}"), "m/s", &apart)
                .document(set_apart_mps(case, s, v))
                .why("set pose, by geometry: r' = -v cos of the angle to the motion");
        }
    }
    if !bends.is_empty() {
        rows.mean("radius, relative error (mean)", "%", &bends)
            .why("of all bends whose curvature is beyond two standard deviations");
    }
    let gross = made.iter().filter(|m| is_gross(m)).count();
    rows.one("frames with a lane that is not the true one", "", Some(gross as f64))
        .why(format!("more than five standard deviations off, of {}", made.len()));
}

fn is_gross(m: &RadarLook) -> bool {
    let (Some(e), Some(l)) = (errors(m), m.look.lane.as_ref()) else { return false };
    (e[0] / l.offset_m.std).abs().max((e[1] / l.heading_rad.std).abs()) > 5.0
}

/// Difference in range rate of two rows at one range ahead, for a straight lane, m/s.
fn set_apart_mps(case: &Case, s: &Settings, v: f64) -> f64 {
    let h = case.heading_deg.to_radians();
    let rate = |side: f64| {
        let y = side * 0.5 * s.row_distance_m - case.offset_m;
        let x = (APART_AT_M * APART_AT_M - y * y).max(0.0).sqrt();
        -v * DVec2::new(x, y).dot(DVec2::from_angle(h)) / APART_AT_M
    };
    (rate(1.0) - rate(-1.0)).abs()
}

fn apart_mps(l: &LaneFromMap, s: &Settings) -> Option<f64> {
    let lane = s.lane_ahead();
    let at = |is_left: bool| -> Option<f64> {
        let curve = l.curve(is_left, 0.05, &lane);
        let ahead: Vec<_> = curve.iter().filter(|m| m.along_m > 0.0).collect();
        ahead.windows(2).find_map(|w| {
            let (a, b) = (w[0], w[1]);
            let t = (APART_AT_M - a.range_m) / (b.range_m - a.range_m);
            (0.0..=1.0).contains(&t).then_some(a.range_rate_mps + t * (b.range_rate_mps - a.range_rate_mps))
        })
    };
    Some((at(true)? - at(false)?).abs())
}

fn peak_m(l: &LaneFromMap, s: &Settings) -> Option<f64> {
    let lane = s.lane_ahead();
    let all = [true, false].map(|is_left| l.curve(is_left, 0.02, &lane));
    let top = all.iter().flatten().min_by(|a, b| a.range_rate_mps.total_cmp(&b.range_rate_mps))?;
    Some(top.range_m)
}
