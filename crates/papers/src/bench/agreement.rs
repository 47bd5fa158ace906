//! Compares a frame's map with that of the same frame at a stricter accuracy and with all echoes kept.

use super::frame::Frame;
use super::sheet::{Sheet, median, relative_l2};
use catseye::adc::budget::Budget;
use catseye::adc::noise::Noise;
use catseye::adc::synthesis::{Levels, PhasePolynomial, Plan, Set, beat_frequency_hz, passes};
use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::base::units::db_from_power;
use catseye::dsp::PowerMap;
use catseye::engine::Engine;
use catseye::scene::Scene;
use catseye::scene::radar::Radar;
use catseye::trace::{Echo, Echoes, TraceOptions};
use num_complex::Complex64;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Factor between the accuracy of the frame and that of the reference: a sixteenth of the error, that is a
/// quarter of the phase across a patch.
const FINER: f64 = 16.0;
/// Largest relative L2 error between the maps, and largest change of an object's level, dB, relative to the
/// stricter run.
const STRICTER: [f64; 2] = [1e-2, 0.1];
/// The same limits relative to all echoes, none left out, at the same accuracy.
const EXACT: [f64; 2] = [1e-3, 0.2];
/// Largest error of samples against the direct sum in f64, dB relative to the sum of squares of all
/// amplitudes.
const SYNTHESIS_DB: f64 = -80.0;

/// Number of samples of each of three channels that are summed directly.
const SAMPLES: usize = 101;

/// Extent of the comparison of a frame.
pub(super) struct Limits {
    /// Number of loops of the compared frames, so that the comparison takes no longer than the frame itself.
    pub loops: usize,
}

/// Level in channel 0 (W) and map cell of an object's strongest echo.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Strongest {
    power_w: f64,
    doppler: usize,
    range: usize,
}

/// Compares the map of these echoes with that of all echoes of the frame and with that at a stricter
/// accuracy, and some samples with the direct sum; notes the gates.
///
/// # Errors
/// Returns the errors of the scene's geometry and of the engine.
pub(super) fn compare(
    frame: &Frame,
    echoes: &Echoes,
    limits: &Limits,
    engine: &Engine,
    sheet: &mut Sheet<'_>,
) -> Result<()> {
    (sheet.say)("  reference with phases of a quarter");
    let accuracy_db = frame.options.accuracy_db;
    let mut radar = frame.radar.clone();
    radar.thermal_noise = false;
    radar.chirps = limits.loops.min(radar.chirps);
    radar.processing.doppler_fft = radar.chirps;
    let map = |echoes: &Echoes| -> Result<PowerMap<f64>> {
        let (cube, _) = engine.cube(&radar, echoes, &[], 0, 0, Control::default())?;
        Ok(engine.range_doppler(&radar, &cube)?.map)
    };
    let got = map(echoes)?;
    // How well facets represent the surfaces of bodies depends on the mesh and not on the frame's own
    // accuracy.
    let sized = frame.refined(accuracy_db)?;
    let geometry = frame.geometry(&sized)?;
    let all = |accuracy_db: f64| -> Result<Echoes> {
        let options = TraceOptions { accuracy_db, least: 0.0, merge: false, ..frame.options };
        frame.echoes(engine, &geometry, &options, Budget::Nothing)
    };
    let noise_w = noise_w(&frame.radar);
    let error_db = synthesis_error_db(engine, &frame.radar, echoes)?;
    sheet.accuracy("synthesis_error_db", error_db);
    let exact = {
        let all = all(accuracy_db)?;
        let want = map(&all)?;
        let objects = objects(&frame.scene, &radar, &all, noise_w, &got, &want);
        let worst = objects.values().flatten().map(|o| o.change_db.abs()).fold(0.0, f64::max);
        [relative_l2(got.data.iter().copied(), want.data.iter().copied()), worst]
    };
    sheet.accuracy("exact_map_relative_l2", exact[0]);
    sheet.accuracy("exact_worst_object_db", exact[1]);
    let all = all(accuracy_db / FINER)?;
    let want = map(&all)?;
    let objects = objects(&frame.scene, &radar, &all, noise_w, &got, &want);
    drop(all);

    let map_l2 = relative_l2(got.data.iter().copied(), want.data.iter().copied());
    let mut changes: Vec<f64> = objects.values().flatten().map(|o| o.change_db.abs()).collect();
    let worst_db = changes.iter().copied().fold(0.0, f64::max);
    sheet.accuracy("accuracy_db", accuracy_db);
    sheet.accuracy("map_relative_l2", map_l2);
    let (over, near) = cells(&got, &want, noise_w);
    sheet.accuracy("cells_over_noise", over);
    sheet.accuracy("cells_within_0_1_db", near);
    sheet.accuracy("objects", changes.len());
    sheet.accuracy("objects_within_1_db", within(&changes, 1.0));
    sheet.accuracy("objects_within_0_1_db", within(&changes, 0.1));
    sheet.accuracy("worst_object_db", worst_db);
    sheet.accuracy("objects_median_db", median(&mut changes));
    sheet.accuracy("classes", by_class(&objects, &radar));
    let gate =
        |value: f64, at_most: f64| json!({ "value": value, "at_most": at_most, "holds": value <= at_most });
    sheet.accuracy(
        "gates",
        json!({
            "map_relative_l2": gate(map_l2, STRICTER[0]),
            "worst_object_db": gate(worst_db, STRICTER[1]),
            "exact_map_relative_l2": gate(exact[0], EXACT[0]),
            "exact_worst_object_db": gate(exact[1], EXACT[1]),
            "synthesis_error_db": gate(error_db, SYNTHESIS_DB),
        }),
    );
    sheet.note(format!(
        "the reference is the same frame with an accuracy {FINER} times stricter and every single echo kept, exact_ is that of every \
         single echo at the same accuracy; synthesis_error is that of samples against the direct sum in f64; maps without noise \
         over {} of {} loops; cells of the objects are those of their strongest echo",
        radar.chirps, frame.radar.chirps
    ));
    Ok(())
}

/// Error of samples spread over the cube against the direct sum in f64, dB relative to Σ|A|².
fn synthesis_error_db(engine: &Engine, radar: &Radar, echoes: &Echoes) -> Result<f64> {
    // The waveforms of the workloads have samples that are lines, one for each way.
    let quiet = Radar { thermal_noise: false, ..radar.clone() };
    let plan = Plan::new(&quiet, echoes)?;
    let (cube, _) = engine.cube(&quiet, echoes, &[], 0, 0, Control::default())?;
    let cube = cube.into_f32();
    let moving: Vec<u32> = [Set::Moving, Set::Still].into_iter().flat_map(|s| plan.set(s)).copied().collect();
    let (mut sum, mut count) = (0.0, 0);
    for channel in [0, plan.channels / 2, plan.channels - 1] {
        let of = plan.channel(channel);
        let terms: Vec<PhasePolynomial> = moving.iter().map(|i| of.coefficients(*i)).collect();
        // Two rows of steps without a common measure with either length.
        for i in 0..SAMPLES {
            let (m, n) = ((i * 7919) % plan.chirps, (i * 104_729) % plan.samples);
            let mut truth = Complex64::ZERO;
            for k in &terms {
                let turns = k.turns(m as f64, n as f64);
                truth += k.amplitude * Complex64::cis(TAU * (turns - turns.round()));
            }
            let z = cube.row(m, channel)[n];
            sum += (Complex64::new(z.re.into(), z.im.into()) - truth).norm_sqr() / plan.power(channel);
            count += 1;
        }
    }
    Ok(10.0 * (sum / f64::from(count)).log10())
}

/// Noise power in one cell of a whole frame, W. Peaks below it do not count: single precision alone may move
/// them.
pub fn noise_w(radar: &Radar) -> f64 {
    Noise::thermal(radar, 0, 0)
        .map_or(0.0, |n| 2.0 * n.sigma * n.sigma / (radar.samples * radar.chirps) as f64)
}

/// Cell (row, column) of an echo in the map.
fn cell(radar: &Radar, r: &Echo) -> (usize, usize) {
    let rows = radar.processing.doppler_fft as f64;
    let bin = beat_frequency_hz(radar, r).abs() / radar.sample_rate_hz * radar.processing.range_fft as f64;
    let row = (r.range_rate_mps() / radar.velocity_bin_mps() + 0.5 * rows).round().rem_euclid(rows);
    (row as usize, bin.round().clamp(0.0, radar.range_bins() as f64 - 1.0) as usize)
}

/// Change of the level in an object's cell.
struct Change {
    name: String,
    change_db: f64,
    range_bin: usize,
}

/// Level changes of the cells of all objects above the noise, by class.
fn objects(
    scene: &Scene,
    radar: &Radar,
    echoes: &Echoes,
    noise_w: f64,
    got: &PowerMap<f64>,
    want: &PowerMap<f64>,
) -> BTreeMap<String, Vec<Change>> {
    let levels = Levels::new(radar);
    let mut strongest = BTreeMap::new();
    for r in echoes.list.iter().filter(|r| passes(radar, r)) {
        let power_w = levels.amplitude(r).norm_sqr();
        let best = strongest.entry(r.object_id()).or_insert(Strongest { power_w: 0.0, doppler: 0, range: 0 });
        if power_w > best.power_w {
            let (doppler, range) = cell(radar, r);
            *best = Strongest { power_w, doppler, range };
        }
    }
    let mut classes: BTreeMap<String, Vec<Change>> = BTreeMap::new();
    for (id, s) in strongest.iter().filter(|(_, s)| want.at(s.doppler, s.range) > noise_w) {
        if let Some(o) = scene.object_by_id(*id) {
            let change_db = db_from_power(got.at(s.doppler, s.range) / want.at(s.doppler, s.range));
            let change = Change { name: o.name.clone(), change_db, range_bin: s.range };
            classes.entry(o.class.clone()).or_default().push(change);
        }
    }
    classes
}

/// Number of cells of the reference above the noise, and how many of them agree within 0.1 dB.
pub fn cells(got: &PowerMap<f64>, want: &PowerMap<f64>, noise_w: f64) -> (usize, usize) {
    let over = got.data.iter().zip(&want.data).filter(|(_, w)| **w > noise_w);
    over.fold((0, 0), |(n, near), (g, w)| (n + 1, near + usize::from(db_from_power(g / w).abs() <= 0.1)))
}

fn within(changes_db: &[f64], most_db: f64) -> usize {
    changes_db.iter().filter(|c| **c <= most_db).count()
}

fn by_class(objects: &BTreeMap<String, Vec<Change>>, radar: &Radar) -> Map<String, Value> {
    let entry = |(class, list): (&String, &Vec<Change>)| {
        let mut sizes: Vec<f64> = list.iter().map(|c| c.change_db.abs()).collect();
        let worst = list.iter().max_by(|a, b| a.change_db.abs().total_cmp(&b.change_db.abs()));
        let range_m = |c: &Change| c.range_bin as f64 * radar.range_bin_m();
        let entry = json!({
            "objects": list.len(),
            "within_1_db": within(&sizes, 1.0),
            "median_db": median(&mut sizes),
            "worst_db": worst.map(|w| w.change_db),
            "worst": worst.map(|w| format!("{} at {:.1} m", w.name, range_m(w))),
        });
        (class.clone(), entry)
    };
    objects.iter().map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_under_the_noise_do_not_count() {
        let map = |data: [f64; 4]| PowerMap { data: data.to_vec(), doppler_bins: 2, range_bins: 2 };
        let want = map([1.0, 2.0, 0.1, 4.0]);
        assert_eq!(cells(&map([1.0, 2.0, 9.0, 4.2]), &want, 0.5), (3, 2));
        assert_eq!(cells(&want, &want, 0.0), (4, 4));
    }
}
