//! Rules by which scans become passes, and thresholds from the bare road.

use crate::trial::kit::*;
use crate::trial::uwb::drives::{ImpulseRadar, Scans};
use crate::trial::uwb::settings::Settings;
use catseye_lane::uwb::{self, Centre, UwbLanes, UwbSetup};
pub use catseye_lane::uwb::{Tuned, Tuning};

/// A rule by which scans become passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// Name in the report.
    pub name: &'static str,
    pub take_background: bool,
    pub centre: Centre,
}

pub fn failed(what: &str, reason: LaneError) -> Error {
    Error::Failed(format!("{what}: {reason}"))
}

pub fn wide(scan: &[f32]) -> Vec<f64> {
    scan.iter().map(|v| f64::from(*v)).collect()
}

pub fn energy(options: &UwbSetup, scan: &[f32]) -> Result<uwb::GateEcho> {
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
        tuning(settings, rule, radar).tune(&scans).map_err(|(what, r)| failed(what, r))
    };
    radars.iter().enumerate().map(one).collect()
}

/// What is known of a radar before the bare road has been seen, under a rule.
fn tuning(settings: &Settings, rule: &Rule, radar: &ImpulseRadar) -> Tuning {
    Tuning {
        axis: radar.axis,
        gate: radar.gate,
        side: radar.side,
        height_m: radar.height_m,
        at_m: radar.at_m,
        spacing_m: settings.spacing_m,
        plate_length_m: settings.plate_length_m,
        lane_width_m: settings.lane_width_m,
        take_background: rule.take_background,
        centre: rule.centre,
        largest_error_m: settings.largest_error_m(),
        confirm_spacings: settings.confirm_spacings as usize,
        misses_to_warn: settings.misses_to_warn as usize,
        false_alarm_probability: settings.false_alarm_probability,
        offset_std_m: settings.offset_std_m,
    }
}

/// Makes the estimator of the steps: one radar, or a left and a right one.
///
/// # Errors
/// Returns an error if there is no radar, or if options do not go together.
pub fn estimator(tuned: &[Tuned]) -> Result<UwbLanes> {
    match tuned {
        [] => return Err(Error::Failed("there is no impulse radar".into())),
        [one] => UwbLanes::new(one.options.clone()),
        [left, right, ..] => UwbLanes::pair(left.options.clone(), right.options.clone()),
    }
    .map_err(|r| failed("lane.uwb", r))
}
