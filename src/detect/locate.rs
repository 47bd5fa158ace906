//! From the cells of a frame's maps to points: transmitters told apart, folds of the range rate, angles by the method
//! that the radar asks for, slopes paired.

use super::accuracy::{AxisAccuracy, Element, PointAccuracy, beam_floor};
use super::ambiguity::{
    Ambiguity, FASTEST_MPS, Folded, ROW_CELLS, SlotFolds, Standing, empty_bands, is_alone,
};
use super::angle_ambiguity::ByFolds;
use super::angle_ambiguity::{AngleLobes, MODEL_ERROR};
use super::bursts::{self, Burst, Known};
use super::points::{Detected, Point, min_range_m, peaks, point, range_rate_mps};
use super::same_slope;
use super::slope_pairs::{PairLimits, Slope, SlopePeak, pair_slopes};
use crate::base::error::{Error, Result};
use crate::base::frames::direction_from_angles;
use crate::base::memo::Memo;
use crate::base::tasks::Tasks;
use crate::base::units::{db_from_power, wavenumber};
use crate::dsp::doa_beamform::{BeamCells, Beamformer, Grid};
use crate::dsp::doa_calibration::Calibration;
use crate::dsp::doa_estimate::{Cells, Estimator, Method, Options, Smoothing, Source, SourceNumber};
use crate::dsp::doa_manifold::Manifold;
use crate::dsp::doa_order::Criterion;
use crate::dsp::multiplex::decode_in;
use crate::dsp::peaks::{Peak, group};
use crate::dsp::{RangeDoppler, Snapshots, window};
use crate::engine::Engine;
use crate::formats::csv::Table;
use crate::scene::grating_lobes::grating_lobes;
use crate::scene::radar::{AngleMethod, AngleSettings, Radar, Sources};
use crate::scene::waveform::Multiplex;
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::sync::Arc;

/// Directions in which folds are tested, to a beamwidth of the array.
const PER_BEAM: f64 = 3.0;
/// Levels of one body on two slopes differ by about this, dB: other frequencies, other cells.
const SLOPE_LEVEL_DB: f64 = 2.0;

/// Computes the quantities on which the standard deviations of this radar's points depend.
///
/// # Errors
/// Returns an error if a window or the grid of directions of the radar's settings cannot be computed.
pub fn accuracy(radar: &Radar) -> Result<PointAccuracy> {
    let p = &radar.processing;
    let axis = |w, n: usize, bins: usize| -> Result<AxisAccuracy> {
        Ok(AxisAccuracy::new(&window::coefficients(w, n)?, bins))
    };
    let places: Vec<(DVec3, usize)> = radar
        .tx
        .iter()
        .enumerate()
        .flat_map(|(k, t)| radar.rx.iter().map(move |r| (t.position_m + r.position_m, k)))
        .collect();
    let y: Vec<f64> = places.iter().map(|(p, _)| p.y).collect();
    let weights = window::at_positions(p.angle_window, &y)?;
    // Transmitters that send at once gather no phase between them.
    let turn = |k: usize| if radar.multiplex == Multiplex::Tdm { k } else { 0 };
    let elements: Vec<Element> = places
        .iter()
        .zip(weights)
        .map(|((position_m, slot), weight)| Element { position_m: *position_m, weight, slot: turn(*slot) })
        .collect();
    let k = wavenumber(radar.sample_centre_hz());
    let grid = Grid::new(radar)?;
    let step = |axis: &[f64]| if axis.len() > 1 { axis[1].sin() - axis[0].sin() } else { 0.0 };
    let sine_step = [step(&grid.azimuth_rad), step(&grid.elevation_rad)];
    let doppler = axis(p.doppler_window, radar.chirps, p.doppler_fft)?;
    Ok(PointAccuracy {
        range: axis(p.range_window, radar.lines().count, p.range_fft)?,
        // Of a moving body's places the window's centroid counts.
        coupling_s: radar.range_per_rate_s() + doppler.late * radar.loop_period_s(),
        doppler,
        range_bin_m: radar.range_bin_m(),
        velocity_bin_mps: radar.velocity_bin_mps(),
        sine_step,
        sine_floor: [beam_floor(&elements, k, 1, sine_step[0]), beam_floor(&elements, k, 2, sine_step[1])],
        centre_m: elements.iter().map(|e| e.position_m).sum::<DVec3>() / (2.0 * elements.len() as f64),
        angle_lobes: angle_lobes(&elements, &grid, k),
        elements,
        wavenumber: k,
        chirp_period_s: radar.chirp_period_s(),
    })
}

/// Directions that the array confuses among those that are searched.
fn angle_lobes(elements: &[Element], grid: &Grid, wavenumber: f64) -> AngleLobes {
    let total: f64 = elements.iter().map(|e| e.weight).sum();
    let places: Vec<(DVec3, f64)> = elements.iter().map(|e| (e.position_m, e.weight / total)).collect();
    let half = |axis: &[f64]| match axis {
        [first, .., last] => first.abs().max(last.abs()),
        _ => 0.0,
    };
    let fov_rad = [half(&grid.azimuth_rad), half(&grid.elevation_rad)];
    let is_searched = fov_rad.iter().any(|f| *f > 0.0);
    AngleLobes {
        lobes: if is_searched { grating_lobes(&places, wavenumber) } else { Vec::new() },
        fov_rad,
        noise_share: places.iter().map(|(_, w)| w * w).sum(),
    }
}

/// The array as the radar's settings describe it.
///
/// # Errors
/// Returns an error for coincident channels, or for a calibration of another array.
pub fn manifold(radar: &Radar) -> Result<Manifold> {
    let ideal = Manifold::of_radar(radar)?;
    match &radar.processing.angle.calibration {
        None => Ok(ideal),
        Some(c) => {
            let table = Table::parse(&c.path, c.text.clone())?;
            ideal.with_calibration(&Calibration::from_table(&table, &c.path)?).map_err(|e| match e {
                Error::Input(e) => e.file(&c.path).into(),
                e => e,
            })
        }
    }
}

/// Converts the radar's settings to options of the estimators.
pub fn options(a: &AngleSettings) -> Options {
    Options {
        method: match a.method {
            AngleMethod::Bartlett => Method::Bartlett,
            AngleMethod::Capon => Method::Capon,
            AngleMethod::Ml => Method::Ml,
            AngleMethod::Music => Method::Music,
            AngleMethod::RootMusic => Method::RootMusic,
            AngleMethod::Esprit => Method::Esprit,
            AngleMethod::BiSvd => Method::BiSvd { forgetting: a.forgetting },
        },
        sources: match a.sources {
            Sources::Given(n) => SourceNumber::Given(n),
            Sources::Mdl => SourceNumber::Found(Criterion::Mdl),
            Sources::Aic => SourceNumber::Found(Criterion::Aic),
            Sources::Residual => SourceNumber::Residual { false_alarm: 1e-3, model_error: MODEL_ERROR },
        },
        max_sources: a.max_sources,
        smoothing: a.subarray.map_or(Smoothing::Auto, Smoothing::Subarray),
        forward_backward: a.forward_backward,
        ..Options::default()
    }
}

/// Places the cells of one map in range, range rate and angle, strongest cell first. `found` keeps as many cells as
/// were taken (`Processing::max_points`). `velocity_mps` is the radar's own in its frame, where it is known.
///
/// # Errors
/// Returns an error if the array, its calibration or the method of the radar's settings does not allow an estimate, or
/// if the engine fails.
pub fn detected(
    engine: &Engine,
    radar: &Radar,
    found: &mut RangeDoppler<f64>,
    accuracy: &PointAccuracy,
    velocity_mps: Option<DVec3>,
) -> Result<Vec<Detected>> {
    let Some(chosen) = Chosen::new(radar, found, accuracy) else { return Ok(Vec::new()) };
    let search = chosen.search(radar, &*Directions::of(radar)?, found, velocity_mps, &[])?;
    let mut looked = looked(engine, &[&search])?;
    Ok(looked.pop().map_or_else(Vec::new, |looked| search.detections(&looked)))
}

/// What a search for directions needs of a radar: it is the same for all its frames.
struct Directions {
    folds: Option<SlotFolds>,
    grid: Grid,
    finder: Arc<Finder>,
}

impl Directions {
    fn new(radar: &Radar) -> Result<Directions> {
        let grid = Grid::new(radar)?;
        let angle = &radar.processing.angle;
        let finder = match angle.method == AngleMethod::Bartlett && angle.calibration.is_none() {
            true => Finder::Beam(Beamformer::new(radar)?),
            false => {
                let estimator = Estimator::new(manifold(radar)?, grid.clone(), options(angle))?;
                Finder::Estimator(Box::new(estimator))
            }
        };
        Ok(Directions { folds: fold_test(radar)?, grid, finder: Arc::new(finder) })
    }

    /// Those of a radar, which are made once for all frames.
    fn of(radar: &Radar) -> Result<Arc<Directions>> {
        static MADE: Memo<Radar, Directions> = Memo::new();
        MADE.get(radar, || Directions::new(radar))
    }
}

/// [`accuracy`] of a radar, which is made once for all frames.
fn known_accuracy(radar: &Radar) -> Result<Arc<PointAccuracy>> {
    static MADE: Memo<Radar, PointAccuracy> = Memo::new();
    MADE.get(radar, || accuracy(radar))
}

/// What looks for the directions of cells: an array with its method.
#[derive(PartialEq)]
enum Finder {
    Beam(Beamformer),
    Estimator(Box<Estimator>),
}

/// What a finder saw in the cells of a map.
enum Looked {
    /// Power in W, `[cell, elevation, azimuth]`.
    Powers(Vec<f64>),
    /// Sources of each cell.
    Sources(Vec<Vec<Source>>),
}

/// The cells of one map, whose directions are still to be found.
struct Search {
    finder: Arc<Finder>,
    grid: Grid,
    tops: Vec<Peak>,
    /// Power of each peak over that of its cell.
    scalloping: Vec<f64>,
    /// Range rate of each cell's row, m/s.
    rates: Vec<f64>,
    cells: Decoded,
    /// What stands as the radar sees it, where folds of the range rate leave the direction as it is.
    standing: Option<Standing>,
}

/// The cells of one map that are placed, and the range rate of each cell's row, m/s.
struct Chosen {
    tops: Vec<Peak>,
    rates: Vec<f64>,
}

impl Chosen {
    /// Chooses the cells of `found`, which keeps them. None where there are no cells.
    fn new(radar: &Radar, found: &mut RangeDoppler<f64>, accuracy: &PointAccuracy) -> Option<Chosen> {
        if radar.processing.group != [0; 2] {
            keep_heads(found, radar.processing.group);
        }
        let (tops, rates) = peaks(radar, found, accuracy);
        let channels = found.snapshots.channels;
        found.cells.truncate(tops.len());
        found.snapshots.data.truncate(tops.len() * channels);
        found.noise.truncate(tops.len());
        (!tops.is_empty()).then_some(Chosen { tops, rates })
    }

    /// Tells the transmitters of the cells apart. `known` is what other bursts know of each cell's range rate, or nothing at all.
    fn search(
        self,
        radar: &Radar,
        Directions { folds, grid, finder }: &Directions,
        found: &RangeDoppler<f64>,
        velocity_mps: Option<DVec3>,
        known: &[Option<Known>],
    ) -> Result<Search> {
        let Chosen { tops, rates } = self;
        let standing = velocity_mps.map(|velocity_mps| Standing::seen_by(radar, velocity_mps));
        let cells = decoded(radar, found, &rates, folds.as_ref(), standing.as_ref(), known);
        let scalloping = tops
            .iter()
            .zip(&found.cells)
            .map(|(top, cell)| {
                let at = found.map.at(cell.doppler as usize, cell.range as usize);
                if at > 0.0 { top.power / at } else { 1.0 }
            })
            .collect();
        let standing = standing.filter(|_| folds.is_none());
        let (finder, grid) = (Arc::clone(finder), grid.clone());
        Ok(Search { finder, grid, tops, scalloping, rates, cells, standing })
    }
}

impl Search {
    /// Bytes that the spectra of all cells take on the device and on the host.
    fn spectrum_bytes(&self) -> usize {
        self.tops.len() * self.grid.len() * (2 * size_of::<f32>() + size_of::<f64>())
    }

    fn detections(&self, looked: &Looked) -> Vec<Detected> {
        match (looked, &*self.finder) {
            (Looked::Powers(powers), Finder::Beam(beam)) => powers
                .chunks_exact(beam.grid.len())
                .enumerate()
                .filter_map(|(i, power)| {
                    let a = beam.strongest(power, self.cells.snapshots.of(i), 0.0)?;
                    Some(self.detection(i, a.azimuth_rad, a.elevation_rad, a.amplitude.norm_sqr()))
                })
                .collect(),
            (Looked::Sources(sources), _) => sources
                .iter()
                .enumerate()
                .flat_map(|(i, list)| list.iter().map(move |s| (i, s)))
                .map(|(i, s)| {
                    let d = self.detection(i, s.azimuth_rad, s.elevation_rad, s.power_w);
                    Detected {
                        angle_std_rad: Some([s.azimuth_std_rad, s.elevation_std_rad]),
                        ambiguity: if s.ambiguous { Ambiguity::Ambiguous } else { d.ambiguity },
                        ..d
                    }
                })
                .collect(),
            (Looked::Powers(_), Finder::Estimator(_)) => Vec::new(),
        }
    }

    fn detection(&self, i: usize, azimuth_rad: f64, elevation_rad: f64, power_w: f64) -> Detected {
        let (rate, mut ambiguity, modulo_mps) = self.cells.rates[i];
        let mut unfolded_mps = rate - self.rates[i];
        match self.standing.and_then(|s| s.fold(rate, (azimuth_rad, elevation_rad), modulo_mps)) {
            Some(n) if n != 0.0 || !ambiguity.is_settled() => {
                unfolded_mps += n * modulo_mps;
                ambiguity = Ambiguity::EgoSpeed;
            }
            _ => {}
        }
        Detected {
            range_bin: self.tops[i].range,
            doppler_row: self.tops[i].doppler,
            unfolded_mps,
            azimuth_rad,
            elevation_rad,
            power_w,
            scalloping: self.scalloping[i],
            noise_w: self.cells.noise[i],
            ambiguity,
            modulo_mps,
            angle_std_rad: None,
            looks: 1,
            at_search_edge: is_at_edge(&self.grid.azimuth_rad, azimuth_rad)
                || is_at_edge(&self.grid.elevation_rad, elevation_rad),
            by_folds: self.cells.by_folds[i],
        }
    }
}

/// Looks for the directions of the cells of many maps. What beamformers see is one submission on the gpu engine, and so is what each
/// other finder sees, as far as [`Estimator::estimate_cells`] takes its cells at once. A cell's spectrum does not depend on others.
fn looked(engine: &Engine, searches: &[&Search]) -> Result<Vec<Looked>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, search) in searches.iter().enumerate() {
        match groups.iter_mut().find(|g| {
            Arc::ptr_eq(&searches[g[0]].finder, &search.finder) || searches[g[0]].finder == search.finder
        }) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    let snapshots_of = |group: &[usize]| {
        let channels = searches[group[0]].cells.snapshots.channels;
        let data = group.iter().flat_map(|i| searches[*i].cells.snapshots.data.iter().copied()).collect();
        Snapshots { channels, data }
    };
    let mut out: Vec<(usize, Looked)> = Vec::with_capacity(searches.len());
    let (mut beams, mut of_beams) = (Vec::new(), Vec::new());
    for group in groups {
        let snapshots = snapshots_of(&group);
        match &*searches[group[0]].finder {
            Finder::Beam(beam) => {
                // The turns between transmitters are out already.
                let range_rates_mps = vec![0.0; snapshots.data.len() / snapshots.channels.max(1)];
                beams.push(BeamCells { beam, snapshots, range_rates_mps });
                of_beams.push(group);
            }
            Finder::Estimator(estimator) => {
                let noise: Vec<f64> = group.iter().flat_map(|i| searches[*i].cells.noise.clone()).collect();
                let cells = Cells { snapshots: 1, data: &snapshots.data, noise_w: Some(&noise) };
                let mut sources = estimator
                    .estimate_cells(&cells, |steering, forms| engine.forms(steering, forms))?
                    .into_iter();
                for i in group {
                    let own = sources.by_ref().take(searches[i].tops.len()).collect();
                    out.push((i, Looked::Sources(own)));
                }
            }
        }
    }
    let powers = engine.angular_powers(&beams)?;
    for (group, powers) in of_beams.into_iter().zip(powers) {
        let mut rest = powers.as_slice();
        for i in group {
            let (own, behind) = rest.split_at(searches[i].tops.len() * searches[i].grid.len());
            out.push((i, Looked::Powers(own.to_vec())));
            rest = behind;
        }
    }
    out.sort_by_key(|(i, _)| *i);
    Ok(out.into_iter().map(|(_, looked)| looked).collect())
}

/// The most that the spectra of maps take that are looked at together, bytes.
const SPECTRUM_BYTES: usize = 256 << 20;

/// [`looked`] of maps that may be many, so many at once as [`SPECTRUM_BYTES`] allow. Each map has the error that is its own.
fn looked_at_all(engine: &Engine, searches: &[&Search]) -> Vec<Result<Looked>> {
    let mut out = Vec::with_capacity(searches.len());
    while out.len() < searches.len() {
        let left = &searches[out.len()..];
        let mut bytes = 0;
        let fit = left.iter().take_while(|s| {
            bytes += s.spectrum_bytes();
            bytes <= SPECTRUM_BYTES
        });
        let some = &left[..fit.count().max(1)];
        match looked(engine, some) {
            Ok(looked) => out.extend(looked.into_iter().map(Ok)),
            Err(e) if some.len() == 1 => out.push(Err(e)),
            Err(_) => out.extend(some.iter().map(|s| {
                let mut one = looked(engine, &[*s])?;
                one.pop().ok_or_else(|| Error::Failed("a map has no angular spectra".into()))
            })),
        }
    }
    out
}

/// Range rate, m/s, what is known of its folds, and what it is known modulo, m/s.
type Rate = (f64, Ambiguity, f64);

/// The cells of a map with their transmitters told apart.
pub(super) struct Decoded {
    /// Snapshots over the virtual channels, without the turns between transmitters.
    pub snapshots: Snapshots<f64>,
    /// Noise of a decoded channel, W, of each cell.
    pub noise: Vec<f64>,
    /// Of each cell.
    pub rates: Vec<Rate>,
    /// Directions that each cell has by other folds of its range rate that are not ruled out.
    pub by_folds: Vec<ByFolds>,
}

/// Tells the transmitters of the cells of `found` apart; `rates` are the range rates of their rows, m/s, and `known` is what
/// other bursts know of each of them, where there are any.
pub(super) fn decoded(
    radar: &Radar,
    found: &RangeDoppler<f64>,
    rates: &[f64],
    folds: Option<&SlotFolds>,
    standing: Option<&Standing>,
    known: &[Option<Known>],
) -> Decoded {
    let channels = found.snapshots.channels;
    // Of a decoded channel: BPM averages its slots, and the map of DDM is scaled by B/N_tx.
    let share = match radar.multiplex {
        Multiplex::Tdm => 1.0,
        Multiplex::Bpm => 1.0 / radar.slots() as f64,
        Multiplex::Ddm { bands } => radar.tx.len() as f64 / bands as f64,
    };
    let noise: Vec<f64> = found.noise.iter().map(|w| w * share).collect();
    let fold_mps = 2.0 * radar.max_velocity_mps();
    let is_ddm = matches!(radar.multiplex, Multiplex::Ddm { .. });
    let is_certain = radar.doppler_rows() > 1 && !is_ddm && fold_mps > 2.0 * FASTEST_MPS;
    let cells: Vec<(Vec<Complex64>, Rate, ByFolds)> = rates
        .par_iter()
        .zip(found.snapshots.data.par_chunks(channels))
        .zip(&noise)
        .zip(&found.cells)
        .enumerate()
        .map_tasks(|(i, (((rate, snapshot), noise), cell))| {
            let known = known.get(i).copied().flatten();
            let as_known = |k: Known| (k.range_rate_mps, k.state, k.modulo_mps);
            let mut by_folds = ByFolds::default();
            let (rate, state, modulo_mps) = match (known, folds) {
                // What bursts agree on needs no array, which then sees the body where it is.
                (Some(k), _) if k.state == Ambiguity::Resolved => as_known(k),
                // An interval so wide that nothing folds needs no test.
                (None, _) if is_certain => (*rate, Ambiguity::Unambiguous, fold_mps),
                (_, Some(test)) => {
                    let t = test.test(snapshot, *rate, *noise, MODEL_ERROR, standing);
                    // In doubt the rate stays as it was measured.
                    let is_unfolded = t.is_found || t.state.is_settled();
                    if !is_unfolded {
                        by_folds = ByFolds::of(&t);
                    }
                    (if is_unfolded { t.range_rate_mps } else { *rate }, t.state, t.modulo_mps)
                }
                (Some(k), None) => as_known(k),
                (None, None) => (*rate, Ambiguity::Unresolved, fold_mps),
            };
            // Bands are counted from the cell's own row: a peak between rows may lie across the map's edge from it.
            let rate = match radar.multiplex {
                Multiplex::Ddm { .. } => {
                    let row = range_rate_mps(radar, cell.doppler as f64);
                    rate - fold_mps * ((rate - row) / fold_mps).round()
                }
                _ => rate,
            };
            // Bursts tell which transmitter has which Doppler band where no band is empty; else the bands have to agree with them.
            let certain = known.filter(|k| k.state == Ambiguity::Resolved);
            let bands = bands(radar);
            let fold_of = |k: &Known| {
                (((k.range_rate_mps - rate) / fold_mps).round() as i64).rem_euclid(bands as i64) as usize
            };
            let told = certain.as_ref().map(fold_of);
            let d = decode_in(radar, snapshot, rate, told.filter(|_| bands <= radar.tx.len()));
            let (state, modulo_mps) = match radar.multiplex {
                Multiplex::Ddm { bands } if bands > radar.tx.len() => {
                    let all_mps = fold_mps * bands as f64;
                    let values = radar.rx.len() * (bands - radar.tx.len());
                    let power = snapshot.iter().map(Complex64::norm_sqr).sum::<f64>() / snapshot.len() as f64;
                    let [empty_w, second_w] = d.empty_w;
                    match empty_bands(d.least_share, empty_w, second_w, values, noise + MODEL_ERROR * power) {
                        Ambiguity::Resolved if is_alone(d.range_rate_mps, all_mps) => {
                            (Ambiguity::Resolved, all_mps)
                        }
                        Ambiguity::Resolved => (Ambiguity::Ambiguous, all_mps),
                        doubt => (doubt, fold_mps),
                    }
                }
                _ => (state, modulo_mps),
            };
            let all_mps = fold_mps * bands as f64;
            let agrees = |k: &Known| {
                let off = k.range_rate_mps - d.range_rate_mps;
                (off - all_mps * (off / all_mps).round()).abs() < 0.5 * fold_mps
            };
            let rate = match certain {
                Some(k) if agrees(&k) => as_known(k),
                // Bursts and bands that say different things.
                Some(_) if state != Ambiguity::Unresolved => {
                    (d.range_rate_mps, Ambiguity::Ambiguous, modulo_mps)
                }
                _ => (d.range_rate_mps, state, modulo_mps),
            };
            (d.channels, rate, by_folds)
        })
        .collect();
    let data = cells.iter().flat_map(|c| c.0.iter().copied()).collect();
    let snapshots = Snapshots { channels: radar.virtual_channels(), data };
    let (rates, by_folds) = cells.into_iter().map(|c| (c.1, c.2)).unzip();
    Decoded { snapshots, noise, rates, by_folds }
}

/// Doppler bands of a map: one where transmitters do not have their own.
fn bands(radar: &Radar) -> usize {
    match radar.multiplex {
        Multiplex::Ddm { bands } => bands,
        Multiplex::Tdm | Multiplex::Bpm => 1,
    }
}

/// Whether an angle stands at an end of the angles that are searched, or beyond. An axis of one value is not searched.
fn is_at_edge(axis: &[f64], angle_rad: f64) -> bool {
    // Twice the finest step of the search between the grid's directions.
    const CLOSE_RAD: f64 = 2e-5;
    match axis {
        [first, .., last] => {
            angle_rad <= first.min(*last) + CLOSE_RAD || angle_rad >= first.max(*last) - CLOSE_RAD
        }
        _ => false,
    }
}

/// Leaves the strongest cell of each group.
fn keep_heads(found: &mut RangeDoppler<f64>, extent: [usize; 2]) {
    let heads: Vec<usize> = group(&found.map, &found.cells, extent).iter().map(|g| g.members[0]).collect();
    found.cells = heads.iter().map(|i| found.cells[*i]).collect();
    found.noise = heads.iter().map(|i| found.noise[*i]).collect();
    let channels = found.snapshots.channels;
    found.snapshots =
        Snapshots { channels, data: heads.iter().flat_map(|i| found.snapshots.of(*i).to_vec()).collect() };
}

/// The test of folds of transmitters that send in slots; None where there is nothing to test.
pub(super) fn fold_test(radar: &Radar) -> Result<Option<SlotFolds>> {
    if matches!(radar.multiplex, Multiplex::Ddm { .. }) || radar.tx.len() < 2 {
        return Ok(None);
    }
    let places: Vec<(DVec3, usize)> = radar
        .tx
        .iter()
        .enumerate()
        .flat_map(|(k, t)| radar.rx.iter().map(move |r| (t.position_m + r.position_m, k)))
        .collect();
    // All that waves can come from: what stands outside the directions that are searched would look like another fold.
    let axis = |along: fn(DVec3) -> f64| -> Vec<f64> {
        let ends = places.iter().map(|(p, _)| along(*p));
        let (lo, hi) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let half = (PER_BEAM * (hi - lo) / radar.sample_wavelength_m()).ceil() as i32;
        (-half..=half).map(|i| (f64::from(i) / f64::from(half.max(1))).asin()).collect()
    };
    let (azimuths, elevations) = (axis(|p| p.y), axis(|p| p.z));
    let directions: Vec<(f64, f64)> =
        elevations.iter().flat_map(|e| azimuths.iter().map(move |a| (*a, *e))).collect();
    let k = wavenumber(radar.sample_centre_hz());
    let periods_s = [radar.chirp_period_s(), radar.loop_period_s()];
    let transmitters = radar.tx.len();
    let folds = SlotFolds::new(&places, transmitters, k, periods_s, &directions)?;
    Ok(Some(match radar.multiplex {
        Multiplex::Bpm => {
            let signs = |slot| (0..transmitters).map(move |tx| radar.multiplex.weight(slot, tx));
            folds.coded((0..radar.slots()).flat_map(signs).collect())
        }
        _ => folds,
    }))
}

/// What the ramps of one slope saw, and the first of them.
struct OfSlope<'a> {
    part: &'a Radar,
    accuracy: &'a PointAccuracy,
    list: Vec<(Point, Detected)>,
}

/// The maps of a frame whose points are asked for.
pub struct FrameMaps<'a> {
    /// The radar.
    pub radar: &'a Radar,
    /// One map for each ramp. They keep as many cells as were taken.
    pub maps: &'a mut [RangeDoppler<f64>],
    /// Velocity of the radar in its own frame, m/s, where it is known.
    pub velocity_mps: Option<DVec3>,
}

/// Points of one frame without labels, strongest first. `maps` has one map for each ramp. What ramps of one slope see
/// is put together ([`same_slope`]). With one slope that is all; with several, points are peaks that belong
/// together of all different slopes ([`pair_slopes`]). `velocity_mps` is the radar's own in its frame,
/// where it is known. What would stand nearer than [`min_range_m`] is no point.
///
/// # Errors
/// Returns the errors of [`detected`].
pub fn points(
    engine: &Engine,
    radar: &Radar,
    maps: &mut [RangeDoppler<f64>],
    velocity_mps: Option<DVec3>,
) -> Result<Vec<Point>> {
    let mut all = points_of_frames(engine, vec![FrameMaps { radar, maps, velocity_mps }]);
    all.pop().unwrap_or_else(|| Ok(Vec::new()))
}

/// [`points`] of many frames, of any radars, to the bit as of each alone. On the gpu engine their spectra over angle share
/// submissions.
///
/// # Errors
/// Each frame has the errors of [`points`] for itself.
pub fn points_of_frames(engine: &Engine, mut frames: Vec<FrameMaps<'_>>) -> Vec<Result<Vec<Point>>> {
    let begun: Vec<Result<Ramps>> = frames.par_iter_mut().map_tasks(Ramps::new).collect();
    let searches: Vec<&Search> = begun.iter().flatten().flat_map(|r| r.searches.iter().flatten()).collect();
    let mut looked = looked_at_all(engine, &searches).into_iter();
    let located = frames.iter().zip(begun).map(|(frame, begun)| {
        let Ramps { parts, accuracies, searches } = begun?;
        let mut of = |search: &Option<Search>| match search {
            None => Ok(Vec::new()),
            Some(search) => looked.next().map_or_else(|| Ok(Vec::new()), |l| Ok(search.detections(&l?))),
        };
        // All are taken before the first error: what follows is that of other frames.
        let lists: Vec<Result<Vec<Detected>>> = searches.iter().map(&mut of).collect();
        joined(frame.radar, &parts, &accuracies, lists.into_iter().collect::<Result<_>>()?)
    });
    located.collect()
}

/// The ramps of a frame, with the search for directions in each map.
struct Ramps {
    parts: Vec<Radar>,
    accuracies: Vec<Arc<PointAccuracy>>,
    searches: Vec<Option<Search>>,
}

impl Ramps {
    fn new(frame: &mut FrameMaps<'_>) -> Result<Ramps> {
        let parts: Vec<Radar> = (0..frame.maps.len()).map(|i| frame.radar.part(i)).collect();
        let accuracies = parts.iter().map(known_accuracy).collect::<Result<Vec<_>>>()?;
        let ramps = || parts.iter().zip(&accuracies);
        let chosen: Vec<Option<Chosen>> = ramps()
            .zip(frame.maps.iter_mut())
            .map(|((part, accuracy), map)| Chosen::new(part, map, accuracy))
            .collect();
        let mut known = known(frame.radar, &parts, &accuracies, &chosen, frame.maps);
        let searches = chosen
            .into_iter()
            .zip(&parts)
            .zip(frame.maps.iter())
            .zip(&mut known)
            .map(|(((chosen, part), map), known)| {
                let search = |c: Chosen| {
                    c.search(part, &*Directions::of(part)?, map, frame.velocity_mps, &std::mem::take(known))
                };
                chosen.map(search).transpose()
            })
            .collect::<Result<_>>()?;
        Ok(Ramps { parts, accuracies, searches })
    }
}

/// What bursts of one slope know of the range rates of each ramp's cells; nothing where ramps follow each other in every loop, whose
/// periods are one.
fn known(
    radar: &Radar,
    parts: &[Radar],
    accuracies: &[Arc<PointAccuracy>],
    chosen: &[Option<Chosen>],
    maps: &[RangeDoppler<f64>],
) -> Vec<Vec<Option<Known>>> {
    let mut out = vec![Vec::new(); parts.len()];
    if !radar.waveform.is_in_bursts() {
        return out;
    }
    for group in same_slope::ramps(radar) {
        let of = |i: usize| {
            let (peaks, rates) =
                chosen[i].as_ref().map_or((&[][..], &[][..]), |c| (&c.tops[..], &c.rates[..]));
            Burst {
                radar: &parts[i],
                accuracy: &accuracies[i],
                snapshots: &maps[i].snapshots,
                noise_w: &maps[i].noise,
                peaks,
                rates_mps: rates,
            }
        };
        let bursts: Vec<Burst<'_>> = group.iter().map(|i| of(*i)).collect();
        for (i, known) in group.iter().zip(bursts::agreed(&bursts)) {
            out[*i] = known;
        }
    }
    out
}

/// What bursts know of the range rates of the cells of each ramp's map, as [`points`] has chosen them.
pub(super) fn known_of(radar: &Radar, maps: &[RangeDoppler<f64>]) -> Result<Vec<Vec<Option<Known>>>> {
    if !radar.waveform.is_in_bursts() {
        return Ok(vec![Vec::new(); maps.len()]);
    }
    let parts: Vec<Radar> = (0..maps.len()).map(|i| radar.part(i)).collect();
    let accuracies = parts.iter().map(known_accuracy).collect::<Result<Vec<_>>>()?;
    let chosen: Vec<Option<Chosen>> = parts
        .iter()
        .zip(&accuracies)
        .zip(maps)
        .map(|((part, accuracy), map)| {
            let (tops, rates) = peaks(part, map, accuracy);
            (!tops.is_empty()).then_some(Chosen { tops, rates })
        })
        .collect();
    Ok(known(radar, &parts, &accuracies, &chosen, maps))
}

/// A detection of one burst on the scales of another of the same slope.
fn on_scales_of(part: &Radar, d: &Detected, to: &Radar) -> Detected {
    let rate = range_rate_mps(part, d.doppler_row) + d.unfolded_mps;
    let (bin_mps, rows) = (to.velocity_bin_mps(), to.doppler_rows() as f64);
    let doppler_row = (rate / bin_mps + (rows / 2.0).floor()).rem_euclid(rows);
    Detected { doppler_row, unfolded_mps: rate - range_rate_mps(to, doppler_row), ..*d }
}

/// Points of what the ramps of one frame saw.
fn joined(
    radar: &Radar,
    parts: &[Radar],
    accuracies: &[Arc<PointAccuracy>],
    mut lists: Vec<Vec<Detected>>,
) -> Result<Vec<Point>> {
    // The first ramp of each slope, and what all of that slope saw.
    let mut seen: Vec<OfSlope> = Vec::new();
    for group in same_slope::ramps(radar) {
        let (part, accuracy) = (&parts[group[0]], &accuracies[group[0]]);
        let mut alike: Vec<Vec<Detected>> = group.iter().map(|i| std::mem::take(&mut lists[*i])).collect();
        // All to the time of the first.
        for (list, i) in alike.iter_mut().zip(&group) {
            let later_s = accuracies[*i].coupling_s - accuracy.coupling_s;
            for d in list {
                let rate = range_rate_mps(&parts[*i], d.doppler_row) + d.unfolded_mps;
                d.range_bin -= rate * later_s / part.range_bin_m();
                if radar.waveform.is_in_bursts() {
                    *d = on_scales_of(&parts[*i], d, part);
                }
            }
        }
        let bodies = same_slope::together(part, accuracy, &alike);
        let list = bodies.into_iter().map(|d| (point(part, &d, accuracy), d)).collect();
        seen.push(OfSlope { part, accuracy, list });
    }
    let least_m = min_range_m(radar);
    let is_off_radar = |p: &Point| p.range_m >= least_m;
    if seen.len() < 2 {
        return Ok(seen.into_iter().flat_map(|s| s.list).map(|(p, _)| p).filter(is_off_radar).collect());
    }
    let slopes: Vec<Slope> = seen
        .iter()
        .map(|OfSlope { part, accuracy, list }| {
            let bin_hz = part.sample_rate_hz / part.processing.range_fft as f64;
            let sign = part.slope_hz_per_s().signum();
            // A resolution cell along Doppler.
            let cell_mps = 2.0 * part.max_velocity_mps() / part.chirps.max(1) as f64;
            Slope {
                slope_hz_per_s: part.slope_hz_per_s(),
                // With the time of the ramp in it: eq. 15 and 119.
                carrier_hz: part.slope_hz_per_s() * accuracy.coupling_s,
                peaks: list
                    .iter()
                    .map(|(p, d)| SlopePeak {
                        beat_hz: sign * d.range_bin * bin_hz,
                        beat_std_hz: p.beat_std_cells.max(1e-3) * bin_hz,
                        power_db: db_from_power(d.power_w),
                        azimuth_rad: p.std.azimuth_rad.map(|_| p.azimuth_rad),
                        row: (part.doppler_rows() > 1).then(|| Folded {
                            range_rate_mps: range_rate_mps(part, d.doppler_row),
                            ambiguity_mps: 2.0 * part.max_velocity_mps(),
                            std_mps: p.std.range_rate_mps.hypot(ROW_CELLS * cell_mps),
                        }),
                    })
                    .collect(),
            }
        })
        .collect();
    let limits = PairLimits {
        max_range_m: radar.max_range_m(),
        max_range_rate_mps: FASTEST_MPS,
        power_std_db: SLOPE_LEVEL_DB,
        azimuth_std_rad: 1f64.to_radians(),
    };
    let pairs = pair_slopes(&slopes, &limits)?;
    let mut out: Vec<Point> = pairs
        .iter()
        .map(|pair| {
            let shown = pair.peaks.iter().zip(&seen).filter_map(|(k, s)| k.map(|k| (s, &s.list[k].0)));
            let (slopes, all): (Vec<&OfSlope>, Vec<&Point>) = shown.unzip();
            // Slots turned with a range rate of another fold give another direction, which the pair's rate tells.
            let is_turned_right = |(slope, p): &(&&OfSlope, &&Point)| {
                let fold_mps = 2.0 * slope.part.max_velocity_mps();
                slope.part.tx.len() == 1
                    || matches!(slope.part.multiplex, Multiplex::Ddm { .. })
                    || (p.range_rate_mps - pair.range_rate_mps).abs() < 0.5 * fold_mps
            };
            let right: Vec<&Point> =
                slopes.iter().zip(&all).filter(is_turned_right).map(|(_, p)| *p).collect();
            let has_direction = !right.is_empty();
            let seen_first = all[0];
            let all = if has_direction { right } else { all };
            let first = all[0];
            let mean = |of: fn(&Point) -> f64| all.iter().map(|p| of(p)).sum::<f64>() / all.len() as f64;
            let mut p = first.clone();
            // The angles count from the sensor's origin already.
            let u = direction_from_angles(first.azimuth_rad, first.elevation_rad);
            // Labels ask what the map of the frame's first ramp shows.
            p.cell = pair.peaks[0].map(|_| [seen_first.range_m, seen_first.range_rate_mps]);
            p.range_m = pair.range_m + u.dot(slopes[0].accuracy.centre_m);
            p.range_rate_mps = pair.range_rate_mps;
            p.azimuth_rad = mean(|p| p.azimuth_rad);
            p.elevation_rad = mean(|p| p.elevation_rad);
            p.position_m = direction_from_angles(p.azimuth_rad, p.elevation_rad) * p.range_m;
            // Noise of the ramps is independent; a lobe that may be wrong is the same in all.
            let is_alone = all.iter().all(|p| p.angle_ambiguity != Some(Ambiguity::Ambiguous));
            let mean_std = |of: fn(&Point) -> Option<f64>| {
                let variances: Option<f64> = all.iter().map(|p| of(p).map(|s| s * s)).sum();
                variances.map(|v| v.sqrt() / all.len() as f64)
            };
            if is_alone {
                p.std.azimuth_rad = mean_std(|p| p.std.azimuth_rad);
                p.std.elevation_rad = mean_std(|p| p.std.elevation_rad);
            }
            if !has_direction {
                p.angle_ambiguity = p.angle_ambiguity.map(|_| Ambiguity::Ambiguous);
            }
            p.std.range_m = pair.range_std_m;
            p.std.range_rate_mps = pair.range_rate_std_mps;
            p.ambiguity = pair.state;
            p.at_search_edge = all.iter().any(|p| p.at_search_edge);
            // Ranges of two slopes know no folds.
            p.modulo_mps = f64::INFINITY;
            // The level goes with the fourth power of a range that was not right before.
            p.rcs_dbsm += db_from_power((p.range_m / first.range_m).abs().powi(4));
            p
        })
        .filter(is_off_radar)
        .collect();
    out.sort_by(|a, b| b.power_dbm.total_cmp(&a.power_dbm));
    Ok(out)
}
