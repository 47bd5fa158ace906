//! Rules by which scans become passes, and thresholds from the bare road.

use crate::trial::kit::*;
use crate::trial::uwb::drives::{ImpulseRadar, Scans};
use crate::trial::uwb::settings::Settings;
use catseye_lane::uwb::{self, Background, Centre, OffsetSource, Threshold, UwbConfig, UwbLanes, UwbOptions};

/// A rule by which scans become passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// Name in the report.
    pub name: &'static str,
    pub take_background: bool,
    pub centre: Centre,
}

/// Options of one radar under one rule.
pub struct Tuned {
    pub options: UwbOptions,
    pub threshold: Threshold,
    /// Energies of the bare road.
    pub bare: Vec<f64>,
}

pub fn failed(what: &str, reason: LaneError) -> Error {
    Error::Failed(format!("{what}: {reason}"))
}

pub fn wide(scan: &[f32]) -> Vec<f64> {
    scan.iter().map(|v| f64::from(*v)).collect()
}

pub fn energy(options: &UwbOptions, scan: &[f32]) -> Result<uwb::GateEcho> {
    options.echo(&wide(scan)).map_err(|why: LaneError| Error::Failed(format!("a scan's energy: {why}")))
}

/// The rules; that of the settings, which makes the steps, comes last.
pub fn rules(settings: &Settings) -> Vec<Rule> {
    let document = Rule { name: "document's rule", take_background: false, centre: Centre::Maximum };
    let ours =
        Rule { name: "settings' rule", take_background: settings.take_background, centre: settings.centre };
    match (Rule { name: document.name, ..ours }) == document {
        true => vec![document],
        false => vec![document, ours],
    }
}

/// Tunes each radar under a rule, with its threshold from scans of the bare road.
pub fn tune_all(
    settings: &Settings,
    rule: &Rule,
    radars: &[ImpulseRadar],
    quiet: &Scans,
) -> Result<Vec<Tuned>> {
    let one = |(i, radar): (usize, &ImpulseRadar)| {
        let scans: Vec<Vec<f64>> = quiet.iter().map(|s| wide(&s[i])).collect();
        tune(settings, rule, radar, &scans).map_err(|(what, r)| failed(what, r))
    };
    radars.iter().enumerate().map(one).collect()
}

/// Tunes a radar under a rule, with its threshold from scans of the bare road.
///
/// # Errors
/// Returns the name of what cannot be made, with the reason.
pub fn tune(
    settings: &Settings,
    rule: &Rule,
    radar: &ImpulseRadar,
    quiet: &[Vec<f64>],
) -> Result<Tuned, (&'static str, LaneError)> {
    let of = |what: &'static str| move |r: LaneError| (what, r);
    let background = match rule.take_background {
        true => Some(Background::of(quiet.iter().map(Vec::as_slice)).map_err(of("background"))?),
        false => None,
    };
    // For the energies alone, until the threshold is known.
    let floor = Threshold::maximum(&[0.0, 1.0]).map_err(of("threshold"))?;
    let config = |t: &Threshold| {
        UwbConfig::new(settings.spacing_m, settings.plate_length_m, t).map(|c| UwbConfig {
            max_spacing_error_m: settings.largest_error_m(),
            least_distance_m: c.least_distance_m.min(settings.spacing_m - settings.largest_error_m()),
            centre: rule.centre,
            confirm_spacings: settings.confirm_spacings as usize,
            misses_to_warn: settings.misses_to_warn as usize,
            // With the mirror reflection in the scan the strongest echo is always that.
            offset: match rule.take_background {
                true => OffsetSource::Range { height_m: radar.height_m },
                false => OffsetSource::None,
            },
            ..c
        })
    };
    let mut options = UwbOptions {
        axis: radar.axis,
        gate: radar.gate,
        background,
        config: config(&floor).map_err(of("lane.uwb"))?,
        side: radar.side,
        at_m: radar.at_m,
        offset_std_m: settings.offset_std_m,
        lane_width_m: Some(settings.lane_width_m),
    };
    let bare = quiet.iter().map(|s| options.echo(s).map(|e| e.energy));
    let bare = bare.collect::<Result<Vec<f64>, _>>().map_err(of("a scan's energy"))?;
    let threshold = match settings.false_alarm_probability {
        None => Threshold::maximum(&bare),
        Some(p) => Threshold::extreme_value(&bare, p),
    };
    let threshold = threshold.map_err(of("threshold"))?;
    options.config = config(&threshold).map_err(of("lane.uwb"))?;
    Ok(Tuned { options, threshold, bare })
}

/// Makes the estimator of the steps: one radar, or a left and a right one.
///
/// # Errors
/// Returns an error if there is no radar, or if options do not go together.
pub fn estimator(tuned: &[Tuned]) -> Result<UwbLanes> {
    match tuned {
        [] => return Err(Error::Failed("no impulse radar".into())),
        [one] => UwbLanes::new(one.options.clone()),
        [left, right, ..] => UwbLanes::pair(left.options.clone(), right.options.clone()),
    }
    .map_err(|r| failed("lane.uwb", r))
}
