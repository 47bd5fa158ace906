//! Place in a marked lane from the range-Doppler map alone (document F, section 3.6, Fig. 3.21 to 3.24), through the whole chain: the
//! scenario's own drive, or single looks at poses that are set ([`Case`]).

mod cases;

mod figures;

mod looks;

mod ready;

mod settings;

use crate::trial::context::TrialContext;
use crate::trial::drive::suitable;
use crate::trial::range_doppler::looks::{RadarDrive, RadarLook, errors};
use crate::trial::report::{Row, Sheet, Trial, common_rows};
use crate::trial::stats::{over_runs, rms};
use catseye::error::{BadInput, Result};
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye::scene::waveform::Waveform;
use catseye_lane::range_doppler::LaneFromMap;
pub(super) use ready::ready_method;
pub use settings::{Case, Settings};

const METHOD: &str = "range-doppler";
/// Fewer rows of the map do not tell range rates apart.
const LEAST_ROWS: usize = 16;

/// The first radar that tells ranges and range rates. Errors: there is none.
fn radar_of(scenario: &Scenario) -> Result<usize> {
    let found = suitable(&scenario.radars, |w| matches!(w, Waveform::Fmcw(_)))
        .filter(|i| scenario.radars[*i].doppler_rows() >= LEAST_ROWS);
    found.ok_or_else(|| {
        BadInput::new("the scenario has no radar whose map tells range rates")
            .key("radar")
            .allowed(format!("an FMCW radar with {LEAST_ROWS} or more rows of Doppler"))
            .remedy("take radar = \"feng77\"")
            .into()
    })
}

/// Drives the scenario, or looks from each [`Case`], and reports.
///
/// Errors: those of the scenario's files and of the chain; no suitable radar; settings outside their ranges.
pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let which = radar_of(given.scenario)?;
    let mut trial = Trial::new(METHOD, format!("{}: lane from the range-Doppler map", given.scenario.name));
    let made = match settings.case.is_empty() {
        true => drives(given, settings, which)?,
        false => cases::looks(given, settings, which)?,
    };
    report(&mut trial, settings, made)?;
    Ok(trial)
}

/// The scenario's own drive, all runs.
fn drives(given: &TrialContext<'_>, settings: &Settings, which: usize) -> Result<Vec<RadarLook>> {
    let equal = settings.left_spacing_m == settings.right_spacing_m;
    let frames = given.scenario.frames.count;
    let all = u64::from(given.runs) * u64::from(frames);
    let mut out = Vec::new();
    // Pictures of looks spread over the first drive.
    let every = frames.div_ceil(settings.pictures.clamp(1, 4));
    for run in 0..given.runs {
        let site = Site::new(&given.scenario_of(run))?;
        let mut looker = RadarDrive::new(&site, given, which, settings, equal)?;
        for index in 0..frames {
            let picture = run == 0 && settings.pictures > 0 && index % every == 0;
            let key = format!("run{run}_frame{index}");
            out.push(looker.look(given, &key, index, run, picture)?);
            (given.watch)(u64::from(run) * u64::from(frames) + u64::from(index) + 1, all);
        }
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
    let row = Row::mean;
    trial.rows = common_rows(&made.iter().map(|m| m.step.clone()).collect::<Vec<_>>());
    let truth = "of the radar; where the sign is open, of the nearer reading";
    trial.rows.push(row("offset of the radar, error (rms)", "m", &rms(&|m| Some(errors(m)?[0]))).why(truth));
    let heading = rms(&|m| Some(errors(m)?[1].to_degrees()));
    trial.rows.push(row("heading of its motion, error (rms)", "deg", &heading).why(truth));
    let chi = |m: &RadarLook| {
        let (e, l) = (errors(m)?, m.look.lane.as_ref()?);
        Some((0.5 * ((e[0] / l.offset_m.std).powi(2) + (e[1] / l.heading_rad.std).powi(2))).sqrt())
    };
    let why = "over their own standard deviations; 1 where these are right";
    trial.rows.push(row("errors of offset and heading (rms)", "std", &rms(&chi)).why(why));
    let open = share(&|m| m.look.lane.as_ref().map(|_| m.look.estimate.mirror));
    let why = "the mirrored lane fits as well; with equal spacings always";
    trial.rows.push(row("looks whose sign is open", "%", &open).why(why));
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
    let why = "of looks whose sign is told, with an offset or heading beyond three standard deviations";
    trial.rows.push(row("sign right", "%", &share(&right)).why(why));
    let speed = rms(&|m| Some(m.look.lane.as_ref()?.speed_mps.value - m.speed_mps));
    trial.rows.push(row("speed of the radar, error (rms)", "m/s", &speed));
    if !settings.case.is_empty() {
        cases::rows(trial, settings, &made);
    }
    trial.sheets.push(looks_sheet(settings, &made));
    figures::draw(trial, settings, &made)?;
    trial.notes.push(
        "Only range and range rate of the points are used. The radar's points are those of the detector; azimuths are not read."
            .into(),
    );
    trial.steps = made.into_iter().map(|m| m.step).collect();
    Ok(())
}

fn looks_sheet(settings: &Settings, made: &[RadarLook]) -> Sheet {
    let mut sheet = Sheet::new(
        "looks",
        "run look case true_offset_m offset_m offset_std_m true_heading_deg heading_deg \
             heading_std_deg curvature_per_m curvature_std_per_m bend_after_m speed_mps mirror \
             sign_log_odds cells_explained searched",
    );
    sheet
        .comments
        .push("Offset and heading are those of the radar and of its motion against the lane.".into());
    let text = |v: Option<f64>| v.filter(|v| v.is_finite()).map_or_else(String::new, |v| format!("{v:.5}"));
    for m in made {
        let lane = m.look.lane.as_ref();
        let of = |f: &dyn Fn(&LaneFromMap) -> f64| text(lane.map(f));
        let case = m.case.map_or_else(String::new, |c| settings.case[c].name.clone());
        sheet.row(&[
            &m.step.run,
            &m.step.frame,
            &case,
            &text(m.radar.map(|r| r[0])),
            &of(&|l| l.offset_m.value),
            &of(&|l| l.offset_m.std),
            &text(m.radar.map(|r| r[1].to_degrees())),
            &of(&|l| l.heading_rad.value.to_degrees()),
            &of(&|l| l.heading_rad.std.to_degrees()),
            &of(&|l| l.curvature_per_m.value),
            &of(&|l| l.curvature_per_m.std),
            &text(lane.filter(|l| l.curve_start_m.observed).map(|l| l.curve_start_m.value)),
            &of(&|l| l.speed_mps.value),
            &u8::from(m.look.estimate.mirror),
            &of(&|l| l.sign_log_odds),
            &of(&|l| l.explained),
            &u8::from(m.look.searched),
        ]);
    }
    sheet
}
