//! The method among others on one drive.

use super::drives::{self, Eye, Progress};
use super::{Estimator, Settings, rules, tune, wide};
use crate::error::Result;
use crate::lane::LaneEstimator;
use crate::scene::waveform::Waveform;
use crate::trial::compare::{Finds, Rival};
use crate::trial::sensors::{OwnedLook, pulse_of};
use crate::trial::{Drive, Given};

/// Scans of the road without markers that set the threshold of a comparison: fewer than a trial of the method takes.
const QUIET_SCANS: u32 = 600;
/// Scatterers on all rough surfaces, for a radar that sees some square metres of them.
const MOST_RAYS: u64 = 2000;

/// Each drive has a scene of its own: the band of impulse radars has an asphalt of its own.
pub(in crate::trial) fn rival(
    given: &Given<'_>,
    settings: &Settings,
    _drive: &Drive<'_>,
    run: u32,
) -> Result<Rival> {
    let mut scenario = given.scenario_of(run);
    scenario.radars.retain(|r| matches!(r.waveform, Waveform::Pulse { .. }));
    // A radar that looks down at the road sees no reflections between things, and few square metres of it.
    scenario.trace.bounces = 1;
    scenario.trace.rays = scenario.trace.rays.min(MOST_RAYS);
    let eyes: Vec<Eye> = drives::eyes(&scenario, settings)?;
    let settings = Settings { quiet_scans: settings.quiet_scans.min(QUIET_SCANS), ..settings.clone() };
    let own = Given {
        scenario: &scenario,
        path: given.path,
        engine: given.engine,
        runs: 1,
        keep: None,
        watch: given.watch,
    };
    let progress = Progress::new(&own, u64::from(settings.quiet_scans));
    let quiet = drives::quiet(&own, &progress, &settings, &eyes)?;
    let rules = rules(&settings);
    let rule = &rules[rules.len() - 1];
    let tuned = eyes
        .iter()
        .enumerate()
        .map(|(i, eye)| tune(&settings, rule, eye, i, &quiet))
        .collect::<Result<Vec<_>>>()?;
    let estimator: Box<dyn LaneEstimator + Send> = match Estimator::new(&tuned)? {
        Estimator::One(e) => e,
        Estimator::Two(e) => e,
    };
    let site = drives::site(&scenario, &settings)?;
    let sense = move |outer: &Drive<'_>, _: Option<&_>, index: u32, look: &mut OwnedLook| {
        let drive = Drive::new(&site, outer.engine())?;
        let mut pulse = Vec::new();
        for eye in &eyes {
            let all = pulse_of(&drive.frame(eye.which, index)?);
            // As the trial keeps samples.
            let narrow: Vec<f32> = all.iter().take(eye.samples).map(|v| *v as f32).collect();
            pulse.extend(wide(&narrow));
        }
        look.pulse = Some(pulse);
        Ok(())
    };
    Ok(Rival {
        estimator,
        finds: Finds::OwnLines,
        radar: None,
        points: false,
        tracks: false,
        sense: Some(Box::new(sense)),
    })
}
