//! Position in a marked lane from the range-Doppler map alone (Feng 2019, section 3.6, Fig. 3.21 to 3.24),
//! through the whole chain: the scenario's own drive, or single looks at given poses ([`Case`]).

mod cases;
mod figures;
mod looks;
mod settings;

use crate::trial::kit::*;
use crate::trial::range_doppler::looks::{RadarDrive, RadarLook, errors};
use catseye_lane::range_doppler::LaneFromMap;
pub use settings::{Case, Settings};

const METHOD: &str = "range-doppler";
/// Least number of rows of a map that resolves range rates.
const LEAST_ROWS: usize = 16;

/// The first radar that measures ranges and range rates.
fn radar_of(scenario: &Scenario) -> Result<usize> {
    let suits = |w: &Waveform| matches!(w, Waveform::Fmcw(_));
    let found = scenario.radars.iter().position(|r| suits(&r.waveform));
    let enough = found.filter(|i| scenario.radars[*i].doppler_rows() >= LEAST_ROWS);
    let allowed = format!("an FMCW radar with {LEAST_ROWS} or more rows of Doppler");
    enough.ok_or_else(|| no_radar(&scenario.radars, METHOD, &allowed, "use radar = \"feng77\"").into())
}

impl LaneMethod for Settings {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check()?;
        let which = radar_of(given.scenario)?;
        let title = format!("{}: lane from the range-Doppler map", given.scenario.name);
        let mut trial = Trial::new(METHOD, title);
        let made = match self.case.is_empty() {
            true => drives(given, self, which)?,
            false => cases::looks(given, self, which)?,
        };
        report(&mut trial, self, made)?;
        Ok(trial)
    }

    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        _: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let which = chirp_radar(given, METHOD)?;
        let equal = self.left_spacing_m == self.right_spacing_m;
        Ok(ReadyMethod::of_points(self.estimator(drive.radar(which), equal)?, which).alone())
    }
}

/// Looks of the scenario's own drive, in all runs.
fn drives(given: &TrialContext<'_>, settings: &Settings, which: usize) -> Result<Vec<RadarLook>> {
    let equal = settings.left_spacing_m == settings.right_spacing_m;
    let frames = given.scenario.frames.count;
    let mut out = Vec::new();
    // Pictures of looks spread over the first drive.
    let every = frames.div_ceil(settings.pictures.clamp(1, 4));
    for run in 0..given.runs {
        let site = Site::new(&given.scenario_of(run))?;
        let drive = Drive::new(&site, given.engine)?;
        let pictured = |frame: u32| run == 0 && settings.pictures > 0 && frame.is_multiple_of(every);
        let mut looks = RadarDrive::new(&drive, which, settings, equal, &pictured)?;
        drive_through(given, (&drive, which), (run, frames), &mut looks)?;
        out.append(&mut looks.made);
    }
    Ok(out)
}

fn report(trial: &mut Trial, settings: &Settings, made: Vec<RadarLook>) -> Result<()> {
    let rms = |of: &dyn Fn(&RadarLook) -> Option<f64>| {
        over_runs(&made, |m| m.step.run, |run| rms(run.iter().filter_map(|m| of(m))))
    };
    let share = |of: &dyn Fn(&RadarLook) -> Option<bool>| -> Vec<f64> {
        rms(&|m| of(m).map(|b| if b { 1.0 } else { 0.0 })).iter().map(|x| 100.0 * x * x).collect()
    };
    trial.steps = made.iter().map(|m| m.step.clone()).collect();
    trial.rows = common_rows(&trial.steps);
    let rows = &mut trial.rows;
    let truth = "of the radar; where the sign is ambiguous, of the nearer candidate";
    rows.mean("offset of the radar, error (rms)", "m", &rms(&|m| Some(errors(m)?[0]))).why(truth);
    let heading = rms(&|m| Some(errors(m)?[1].to_degrees()));
    rows.mean("heading of its motion, error (rms)", "deg", &heading).why(truth);
    let chi = |m: &RadarLook| {
        let (e, l) = (errors(m)?, m.look.lane.as_ref()?);
        Some((0.5 * ((e[0] / l.offset_m.std).powi(2) + (e[1] / l.heading_rad.std).powi(2))).sqrt())
    };
    rows.mean("errors of offset and heading (rms)", "std", &rms(&chi))
        .why("over their own standard deviations; 1 where these are right");
    let open = share(&|m| m.look.lane.as_ref().map(|_| m.look.estimate.mirror));
    rows.mean("frames with an ambiguous sign", "%", &open)
        .why("the mirrored lane fits as well; always with equal spacings");
    // An offset or heading that is nothing has no sign.
    let right = |m: &RadarLook| {
        let (l, [offset, heading]) = (m.look.lane.as_ref().filter(|_| !m.look.estimate.mirror)?, m.radar?);
        let sure = |v: f64, std: f64| v.abs() > 3.0 * std;
        match (sure(offset, l.offset_m.std), sure(heading, l.heading_rad.std)) {
            (true, _) => Some(offset * l.offset_m.value > 0.0),
            (_, true) => Some(heading * l.heading_rad.value > 0.0),
            _ => None,
        }
    };
    rows.mean("sign right", "%", &share(&right))
        .why("of frames whose sign is resolved, with an offset or heading beyond three standard deviations");
    let speed = rms(&|m| Some(m.look.lane.as_ref()?.speed_mps.value - m.speed_mps));
    rows.mean("speed of the radar, error (rms)", "m/s", &speed);
    if !settings.case.is_empty() {
        cases::rows(rows, settings, &made);
    }
    trial.sheets.push(looks_sheet(settings, &made));
    figures::draw(trial, settings, &made)?;
    trial.notes.push(
        "Only range and range rate of the points are used. The radar's points are those of the detector; azimuths are not read."
            .into(),
    );
    Ok(())
}

fn looks_sheet(settings: &Settings, made: &[RadarLook]) -> Sheet {
    let columns = "run look case true_offset_m offset_m offset_std_m true_heading_deg heading_deg heading_std_deg \
                   curvature_per_m curvature_std_per_m bend_after_m speed_mps mirror sign_log_odds cells_explained searched";
    let mut sheet = Sheet::new("looks", columns)
        .noted("Offset and heading are those of the radar and of its motion against the lane.");
    let text = |v: Option<f64>| fixed(v.filter(|v| v.is_finite()), 5);
    for m in made {
        let of = |f: fn(&LaneFromMap) -> f64| m.look.lane.as_ref().map(f);
        let case = m.case.map_or_else(String::new, |c| settings.case[c].name.clone());
        let bend = m.look.lane.as_ref().filter(|l| l.curve_start_m.observed);
        let pose = [
            m.radar.map(|r| r[0]),
            of(|l| l.offset_m.value),
            of(|l| l.offset_m.std),
            m.radar.map(|r| r[1].to_degrees()),
            of(|l| l.heading_rad.value.to_degrees()),
            of(|l| l.heading_rad.std.to_degrees()),
            of(|l| l.curvature_per_m.value),
            of(|l| l.curvature_per_m.std),
            bend.map(|l| l.curve_start_m.value),
            of(|l| l.speed_mps.value),
        ];
        let mut row = vec![m.step.run.to_string(), m.step.frame.to_string(), case];
        row.extend(pose.map(text));
        row.push(u8::from(m.look.estimate.mirror).to_string());
        row.extend([of(|l| l.sign_log_odds), of(|l| l.explained)].map(text));
        row.push(u8::from(m.look.searched).to_string());
        sheet.rows.push(row);
    }
    sheet
}
