//! The radar image of an FM-CW radar with rising and falling slopes: an angular spectrum for each beat
//! frequency (Miyake, section III and Fig. 3), its peaks, and the pairing of the peaks of one slope with
//! those of the other.

use super::{Ego, RadarMount, expected_range_rate_mps};
use crate::numeric::vertex;
use catseye::adc::Cube;
use catseye::base::error::{BadInput, Result};
use catseye::base::frames::direction_from_angles;
use catseye::base::units::{C0, db_from_power};
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::assignment::assign;
use catseye::detect::locate::accuracy;
use catseye::detect::points::{Detected, Point, point};
use catseye::detect::slope_pairs::{PairLimits, Slope, SlopePeak, pair_slopes};
use catseye::dsp::Real;
use catseye::dsp::cpu::{fft, lines};
use catseye::dsp::doa_beamform::Grid;
use catseye::dsp::doa_bisvd::BiSvd;
use catseye::dsp::doa_estimate::{Cells, Estimator, Method, Options, Smoothing, Source, SourceNumber};
use catseye::dsp::doa_manifold::{Manifold, Matrix};
use catseye::dsp::doa_order::Criterion;
use catseye::dsp::transform::Transform;
use catseye::engine::{AnyCube, Engine};
use catseye::scene::radar::Radar;
use catseye::scene::waveform::{Multiplex, Waveform};
use num_complex::{Complex, Complex64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Angle estimation method for a row of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Angles {
    /// MUSIC with a signal subspace tracked by bi-iteration from frame to frame.
    BiSvd,
    /// MUSIC with a full eigendecomposition of each frame.
    Music,
    /// ESPRIT on the array's samples.
    Esprit,
    /// Conventional (Bartlett) beamformer.
    Bartlett,
}

/// Settings of the radar image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageSettings {
    /// Method of angle estimation.
    pub angles: Angles,
    /// Largest number of sources in a row (Miyake: 2).
    pub sources: usize,
    /// Whether each row has exactly that number, rather than as many as its eigenvalues show.
    pub exact: bool,
    /// Forgetting factor, alpha of Miyake eq. 9, for each snapshot that a tracker takes in.
    pub forgetting: f64,
    /// Number of elements of the subarrays for spatial smoothing; 0: the whole line.
    pub subarray: usize,
    /// Minimum mean power of a row above the noise, dB.
    pub row_db: f64,
    /// Least power of a source in all channels and snapshots above the noise, dB.
    pub source_db: f64,
    /// Largest level of a source below the strongest source of its row, dB.
    pub below_db: f64,
    /// Largest range of the image, m.
    pub max_range_m: f64,
    /// Least standard deviation of a peak's beat frequency, in range cells.
    pub beat_floor_cells: f64,
    /// Least standard deviation of a peak's azimuth, rad.
    pub azimuth_floor_rad: f64,
}

impl Default for ImageSettings {
    fn default() -> Self {
        ImageSettings {
            angles: Angles::BiSvd,
            sources: 2,
            exact: false,
            forgetting: 0.9,
            subarray: 0,
            row_db: 3.0,
            source_db: 13.0,
            below_db: 20.0,
            max_range_m: 120.0,
            beat_floor_cells: 0.05,
            azimuth_floor_rad: 3e-3,
        }
    }
}

/// A peak of one slope's image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePeak {
    /// Beat frequency, in range cells.
    pub range_bin: f64,
    /// Standard deviation of the beat frequency, in range cells.
    pub beat_std_cells: f64,
    /// The source that the peak shows.
    pub source: Source,
}

/// The image of one slope.
#[derive(Debug, Clone, PartialEq)]
pub struct SlopeImage {
    /// Slope of the ramp, Hz/s, negative when falling.
    pub slope_hz_per_s: f64,
    /// Range per cell of a body at rest relative to the radar, m.
    pub range_bin_m: f64,
    /// Mean power of each row, W.
    pub row_w: Vec<f64>,
    /// Power of the noise, W.
    pub noise_w: f64,
    /// Sources of each row; empty in rows without an echo.
    pub sources: Vec<Vec<Source>>,
    /// The peaks of the image.
    pub peaks: Vec<ImagePeak>,
    /// Azimuths of the spectrum's columns, rad.
    pub azimuth_rad: Vec<f64>,
    /// Spectrum `[row, azimuth]`, with values of 1 or more; empty unless requested, zero in rows without an
    /// echo.
    pub spectrum: Vec<f64>,
}

/// One ramp of the waveform.
struct Part {
    radar: Radar,
    transform: Transform,
    estimator: Estimator,
    rows: usize,
    /// Subspace trackers, one for each row; empty unless the subspace is tracked.
    trackers: Vec<BiSvd>,
}

/// Makes images of radar cubes. With [`Angles::BiSvd`] it remembers earlier frames, which must come in order.
pub struct Imager {
    radar: Radar,
    settings: ImageSettings,
    parts: Vec<Part>,
}

/// Whether a radar suits this image: linear ramps of two slopes, one transmitter, three channels or more in
/// azimuth.
pub fn suits(radar: &Radar) -> bool {
    let slopes = match &radar.waveform {
        Waveform::Fmcw(s) => s.ramps.len() > 1 && two_slopes(radar).is_some(),
        _ => false,
    };
    let line = Manifold::of_radar(radar).is_ok_and(|m| m.lattice().is_some_and(|l| l.size[0] == 1));
    slopes && line && radar.tx.len() == 1 && radar.rx.len() > 2 && radar.multiplex == Multiplex::Tdm
}

/// Indices of the first ramps of two different slopes.
fn two_slopes(radar: &Radar) -> Option<[usize; 2]> {
    let slope = |i: usize| radar.part(i).slope_hz_per_s();
    let first = slope(0);
    (1..radar.waveform.parts()).find(|i| (slope(*i) - first).abs() > 1e-6 * first.abs()).map(|i| [0, i])
}

impl Imager {
    /// Makes the imager of a radar.
    ///
    /// # Errors
    /// Returns an error for a radar that [`suits`] does not accept, or settings that its array does not
    /// allow.
    pub fn new(radar: &Radar, settings: &ImageSettings) -> Result<Imager> {
        let Some(ramps) = two_slopes(radar).filter(|_| suits(radar)) else {
            return Err(BadInput::new("the radar image needs FM-CW with two chirp types, one transmitter and three channels or more in one line")
                .key("radar")
                .value(&radar.name)
                .remedy("use fmcw76, or source = \"points\" in [lane.road_shape]")
                .into());
        };
        let parts = ramps
            .iter()
            .map(|i| {
                let part = radar.part(*i);
                let shape = [part.chirps, part.channels(), part.lines().count];
                let transform = Transform::of_shape(shape, &part)?;
                // An echo comes nearer by its Doppler shift: some cells more than the range.
                let reach_m = settings.max_range_m + part.range_per_rate_s().abs() * 60.0;
                let rows = ((reach_m / part.range_bin_m()).ceil() as usize).clamp(8, transform.range_bins);
                let estimator =
                    Estimator::new(Manifold::of_radar(&part)?, Grid::new(&part)?, settings.options())?;
                let trackers = match settings.angles {
                    Angles::BiSvd => {
                        let elements = estimator.elements(part.chirps);
                        let one = BiSvd::new(elements, settings.sources, settings.forgetting)?;
                        vec![one; rows]
                    }
                    _ => Vec::new(),
                };
                Ok(Part { radar: part, transform, estimator, rows, trackers })
            })
            .collect::<Result<_>>()?;
        Ok(Imager { radar: radar.clone(), settings: *settings, parts })
    }

    /// Makes the images of both slopes, `with_spectrum` or with their peaks only.
    ///
    /// # Errors
    /// Returns an error if the cube does not belong to the radar, or if a sample is non-finite.
    pub fn look(&mut self, engine: &Engine, cube: &AnyCube, with_spectrum: bool) -> Result<[SlopeImage; 2]> {
        let settings = self.settings;
        let mut made = Vec::with_capacity(2);
        for part in &mut self.parts {
            made.push(part.image(engine, cube, &settings, with_spectrum)?);
        }
        match <[SlopeImage; 2]>::try_from(made) {
            Ok(two) => Ok(two),
            Err(_) => Err(catseye::base::error::Error::Failed("two chirp types must give two images".into())),
        }
    }

    /// Combines both images to points in the sensor frame. A stationary body has one position in both once
    /// the vehicle's own speed is removed from the beats (Miyake, section IV): such peaks are paired first.
    /// The rest, moving bodies, is paired by level and angle alone (eq. 119). Without a speed all are.
    ///
    /// # Errors
    /// Returns an error if a value is non-finite.
    pub fn points(
        &self,
        images: &[SlopeImage; 2],
        ego: Option<&Ego>,
        mount: &RadarMount,
    ) -> Result<Vec<Point>> {
        let accuracies = [accuracy(&self.parts[0].radar)?, accuracy(&self.parts[1].radar)?];
        let beat = |k: usize, p: &ImagePeak| {
            let r = &self.parts[k].radar;
            let bin_hz = r.sample_rate_hz / r.processing.range_fft as f64;
            let sign = r.slope_hz_per_s().signum();
            SlopePeak {
                beat_hz: sign * p.range_bin * bin_hz,
                beat_std_hz: p.beat_std_cells * bin_hz,
                power_db: db_from_power(p.source.power_w),
                azimuth_rad: Some(p.source.azimuth_rad),
                row: None,
            }
        };
        let slope = |k: usize, peaks: Vec<SlopePeak>| {
            let slope_hz_per_s = self.parts[k].radar.slope_hz_per_s();
            // With the time of the ramp in it, as eq. 119 has it.
            let carrier_hz = slope_hz_per_s * self.parts[k].radar.range_per_rate_s();
            Slope { slope_hz_per_s, carrier_hz, peaks }
        };
        let all = [0, 1].map(|k| images[k].peaks.iter().map(|p| beat(k, p)).collect::<Vec<_>>());
        let mut pairs: Vec<(usize, usize, f64, f64, f64, f64, Ambiguity)> = Vec::new();
        let mut free = [0, 1].map(|k| vec![true; all[k].len()]);
        if let Some(ego) = ego {
            for (i, j) in self.standing(images, ego, mount) {
                let two = [slope(0, vec![all[0][i]]), slope(1, vec![all[1][j]])];
                let (range_m, rate, range_std, rate_std) = meet(&two);
                (free[0][i], free[1][j]) = (false, false);
                pairs.push((i, j, range_m, rate, range_std, rate_std, Ambiguity::EgoSpeed));
            }
        }
        let left = [0, 1].map(|k| (0..all[k].len()).filter(|i| free[k][*i]).collect::<Vec<usize>>());
        let rest = [0, 1].map(|k| slope(k, left[k].iter().map(|i| all[k][*i]).collect()));
        let limits = PairLimits {
            max_range_m: self.settings.max_range_m,
            max_range_rate_mps: FASTEST_MPS,
            power_std_db: LEVEL_DB,
            azimuth_std_rad: 1f64.to_radians(),
        };
        for p in pair_slopes(&rest, &limits)? {
            // Of two slopes, each pair has a peak of either.
            let [Some(first), Some(second)] = p.peaks[..] else { continue };
            let (i, j) = (left[0][first], left[1][second]);
            let v = (p.range_m, p.range_rate_mps, p.range_std_m, p.range_rate_std_mps);
            pairs.push((i, j, v.0, v.1, v.2, v.3, p.state));
        }
        let mut out = Vec::with_capacity(pairs.len());
        for (i, j, range_m, rate, range_std, rate_std, state) in pairs {
            if !(range_m > 0.0 && range_m <= self.settings.max_range_m) {
                continue;
            }
            let (first, second) = (&images[0].peaks[i], &images[1].peaks[j]);
            let radar = &self.parts[0].radar;
            let [w, u] = [first, second].map(|p| p.source.azimuth_std_rad.max(1e-6).powi(-2));
            let azimuth_rad = (w * first.source.azimuth_rad + u * second.source.azimuth_rad) / (w + u);
            let azimuth_std = (w + u).powf(-0.5).max(self.settings.azimuth_floor_rad);
            let looks = (radar.chirps * radar.channels()) as f64;
            let d = Detected {
                range_bin: first.range_bin,
                doppler_row: (radar.doppler_rows() / 2) as f64,
                unfolded_mps: 0.0,
                azimuth_rad,
                elevation_rad: 0.0,
                power_w: first.source.power_w,
                scalloping: 1.0,
                noise_w: images[0].noise_w / looks,
                ambiguity: state,
                modulo_mps: f64::INFINITY,
                angle_std_rad: Some([azimuth_std, 0.0]),
                looks: 1,
                at_search_edge: false,
                by_folds: Default::default(),
            };
            let mut p = point(radar, &d, &accuracies[0]);
            p.rcs_dbsm += db_from_power((range_m / p.range_m).abs().powi(4));
            (p.range_m, p.range_rate_mps) = (range_m, rate);
            p.position_m = direction_from_angles(azimuth_rad, 0.0) * range_m;
            (p.std.range_m, p.std.range_rate_mps, p.std.azimuth_rad) =
                (range_std, rate_std, Some(azimuth_std));
            out.push(p);
        }
        out.sort_by(|a, b| b.power_dbm.total_cmp(&a.power_dbm));
        Ok(out)
    }

    /// Pairs peaks of both slopes that lie in one place if they are stationary: least sum of squares, each
    /// used once.
    fn standing(&self, images: &[SlopeImage; 2], ego: &Ego, mount: &RadarMount) -> Vec<(usize, usize)> {
        let place = |k: usize, p: &ImagePeak| {
            let part = &self.parts[k].radar;
            let rate = expected_range_rate_mps(p.source.azimuth_rad, mount, ego);
            let moved = part.range_per_rate_s();
            (p.range_bin * part.range_bin_m() - rate * moved, p.beat_std_cells * part.range_bin_m(), moved)
        };
        let [first, second] = images;
        let mut cost = Vec::with_capacity(first.peaks.len() * second.peaks.len());
        for p in &first.peaks {
            let (range_m, std_m, moved) = place(0, p);
            for q in &second.peaks {
                let (other_m, other_std_m, other_moved) = place(1, q);
                // Both positions depend on the speed, each in its own way.
                let by_speed = (moved - other_moved) * ego.speed_std_mps;
                let range =
                    (range_m - other_m).powi(2) / (std_m.powi(2) + other_std_m.powi(2) + by_speed * by_speed);
                let spread = p.source.azimuth_std_rad.powi(2)
                    + q.source.azimuth_std_rad.powi(2)
                    + 2.0 * self.settings.azimuth_floor_rad.powi(2);
                let angle = (p.source.azimuth_rad - q.source.azimuth_rad).powi(2) / spread;
                let level = (db_from_power(p.source.power_w / q.source.power_w) / LEVEL_DB).powi(2) / 2.0;
                let sum = range + angle + level;
                cost.push(if sum <= SAME { sum } else { f64::INFINITY });
            }
        }
        let miss = vec![2.0 * SAME; first.peaks.len()];
        let choice = assign(&cost, second.peaks.len(), &miss);
        choice.into_iter().enumerate().filter_map(|(i, j)| Some((i, j?))).collect()
    }

    /// Snapshots for the angle estimation: the range transform of slope 0 or 1, `[range cell, chirp,
    /// channel]`, sqrt(W).
    ///
    /// # Errors
    /// Returns an error if the cube does not belong to the radar, or if `slope` is neither 0 nor 1.
    pub fn snapshots(&self, cube: &AnyCube, slope: usize) -> Result<Vec<Complex64>> {
        match self.parts.get(slope) {
            Some(part) => part.cells(cube),
            None => Err(BadInput::new("is out of range: there are two chirp types")
                .key("slope")
                .value(slope)
                .allowed("0, 1")
                .into()),
        }
    }

    /// The radar that the images are made for.
    pub fn radar(&self) -> &Radar {
        &self.radar
    }
}

/// Largest speed of a body along the line of sight, m/s.
const FASTEST_MPS: f64 = 60.0;
/// Typical difference of one body's levels on two slopes, dB.
const LEVEL_DB: f64 = 2.0;
/// χ² of three degrees of freedom that one correct pair in a thousand exceeds.
const SAME: f64 = 16.27;

/// Threshold over the noise power: the greatest eigenvalue of noise alone in five channels over some ten
/// looks is about three times its power.
const OVER_NOISE: f64 = 4.0;

/// Range and range rate at which two beats meet, with their standard deviations.
fn meet(two: &[Slope; 2]) -> (f64, f64, f64, f64) {
    let [(h, k), (g, l)] = [0, 1].map(|i| (2.0 * two[i].slope_hz_per_s / C0, 2.0 * two[i].carrier_hz / C0));
    let [p, q] = [0, 1].map(|i| &two[i].peaks[0]);
    let det = h * l - g * k;
    let range_m = (l * p.beat_hz - k * q.beat_hz) / det;
    let rate = (h * q.beat_hz - g * p.beat_hz) / det;
    let range_std = (l * p.beat_std_hz).hypot(k * q.beat_std_hz) / det.abs();
    let rate_std = (h * q.beat_std_hz).hypot(g * p.beat_std_hz) / det.abs();
    (range_m, rate, range_std, rate_std)
}

impl ImageSettings {
    /// The settings as options of the angle estimators.
    fn options(&self) -> Options {
        let method = match self.angles {
            Angles::BiSvd => Method::BiSvd { forgetting: self.forgetting },
            Angles::Music => Method::Music,
            Angles::Esprit => Method::Esprit,
            Angles::Bartlett => Method::Bartlett,
        };
        let smoothing =
            if self.subarray > 0 { Smoothing::Subarray([1, self.subarray]) } else { Smoothing::Off };
        Options {
            method,
            sources: match self.angles {
                Angles::BiSvd => SourceNumber::Given(self.sources),
                _ if self.exact => SourceNumber::Given(self.sources),
                _ => SourceNumber::Found(Criterion::Mdl),
            },
            max_sources: self.sources,
            smoothing,
            // Two echoes of one range cell keep their phases for the time of a frame.
            forward_backward: Some(true),
            below_db: self.below_db,
            ..Options::default()
        }
    }
}

impl Part {
    /// Range cells, `[row, chirp, channel]`.
    fn cells(&self, cube: &AnyCube) -> Result<Vec<Complex64>> {
        match cube {
            AnyCube::F32(c) => self.cells_of(c),
            AnyCube::F64(c) => self.cells_of(c),
        }
    }

    fn cells_of<T: Real>(&self, cube: &Cube<T>) -> Result<Vec<Complex64>> {
        let t = &self.transform;
        let (each, bins) = (t.chirps * t.channels, t.range_bins);
        let mut all = vec![Complex::<T>::default(); each * bins];
        fft::range(lines::prepared(cube, &self.radar)?.as_ref(), t, &mut all);
        let mut out = vec![Complex64::ZERO; self.rows * each];
        for (line, values) in all.chunks_exact(bins).enumerate() {
            for (row, z) in values.iter().take(self.rows).enumerate() {
                out[row * each + line] = Complex64::new(z.re.wide(), z.im.wide());
            }
        }
        Ok(out)
    }

    fn image(
        &mut self,
        engine: &Engine,
        cube: &AnyCube,
        s: &ImageSettings,
        with_spectrum: bool,
    ) -> Result<SlopeImage> {
        let (chirps, channels) = (self.transform.chirps, self.transform.channels);
        let each = chirps * channels;
        let data = self.cells(cube)?;
        let row_w: Vec<f64> = data
            .chunks_exact(each)
            .map(|x| x.iter().map(|z| z.norm_sqr()).sum::<f64>() / each as f64)
            .collect();
        if row_w.iter().any(|w| !w.is_finite()) {
            return Err(catseye::base::error::Error::Failed(
                "the cube has samples that are not finite".into(),
            ));
        }
        // Most rows are empty or hold little: the quarter with least power is noise.
        let mut sorted = row_w.clone();
        sorted.sort_by(f64::total_cmp);
        let noise_w = sorted[sorted.len() / 4].max(f64::MIN_POSITIVE);
        let due = noise_w * 10f64.powf(0.1 * s.row_db);
        let rows: Vec<usize> = (0..self.rows).filter(|r| row_w[*r] > due).collect();
        let picked: Vec<Complex64> =
            rows.iter().flat_map(|r| data[r * each..(r + 1) * each].iter().copied()).collect();
        let noise = vec![noise_w; rows.len()];
        let cells = Cells { snapshots: chirps, data: &picked, noise_w: Some(&noise) };
        let mut bases: Vec<Matrix> = Vec::new();
        if !self.trackers.is_empty() {
            for (row, tracker) in self.trackers.iter_mut().enumerate() {
                // Forward and backward, as the whole decomposition has them.
                let looks = self.estimator.looks(&data[row * each..(row + 1) * each]);
                let elements = self.estimator.elements(chirps);
                for snapshot in looks.chunks_exact(elements) {
                    tracker.update(snapshot);
                }
            }
            for row in &rows {
                let tracker = &self.trackers[*row];
                bases.push(if s.exact { tracker.basis() } else { Part::leading(tracker, noise_w) });
            }
        }
        let forms = |steering: &_, forms: &_| engine.forms(steering, forms);
        let found = match (rows.is_empty(), self.trackers.is_empty()) {
            (true, _) => Vec::new(),
            (_, true) => self.estimator.estimate_cells(&cells, forms)?,
            _ => self.estimator.track_cells(&bases, &cells, forms)?,
        };
        let mut sources = vec![Vec::new(); self.rows];
        let least = noise_w / each as f64 * 10f64.powf(0.1 * s.source_db);
        for (row, mut list) in rows.iter().zip(found) {
            let top = list.iter().map(|s| s.power_w).fold(0.0, f64::max);
            list.retain(|x| x.power_w >= least && x.power_w >= top * 10f64.powf(-0.1 * s.below_db));
            sources[*row] = list;
        }
        let azimuth_rad = self.estimator.grid().azimuth_rad.clone();
        let mut spectrum = Vec::new();
        if with_spectrum && s.angles != Angles::Esprit {
            let values = match (rows.is_empty(), self.trackers.is_empty()) {
                (true, _) => Vec::new(),
                (_, true) => self.estimator.spectra(&cells, forms)?,
                _ => self.estimator.track_spectra(&bases, chirps, forms)?,
            };
            spectrum = vec![0.0; self.rows * azimuth_rad.len()];
            for (row, values) in rows.iter().zip(values.chunks_exact(azimuth_rad.len())) {
                spectrum[row * azimuth_rad.len()..(row + 1) * azimuth_rad.len()].copy_from_slice(values);
            }
        }
        let peaks = self.peaks(&sources, &data, noise_w, s);
        Ok(SlopeImage {
            slope_hz_per_s: self.radar.slope_hz_per_s(),
            range_bin_m: self.radar.range_bin_m(),
            row_w,
            noise_w,
            sources,
            peaks,
            azimuth_rad,
            spectrum,
        })
    }

    /// The columns of a tracked subspace that exceed the noise, at least one; this needs no decomposition.
    fn leading(tracker: &BiSvd, noise_w: f64) -> Matrix {
        let basis = tracker.basis();
        let strong = tracker.singular_values().iter().filter(|s| *s * *s > OVER_NOISE * noise_w).count();
        basis.columns(0, strong.clamp(1, basis.ncols()))
    }

    /// Sources that no neighbour in range exceeds in the same direction.
    fn peaks(
        &self,
        sources: &[Vec<Source>],
        data: &[Complex64],
        noise_w: f64,
        s: &ImageSettings,
    ) -> Vec<ImagePeak> {
        let (chirps, channels) = (self.transform.chirps, self.transform.channels);
        // Half of the distance from a beam's centre to its null.
        let beam = 1.0 / channels as f64;
        let mut out = Vec::new();
        for row in 1..sources.len().saturating_sub(1) {
            for source in &sources[row] {
                let beaten = [row - 1, row + 1].iter().any(|r| {
                    sources[*r].iter().any(|x| {
                        let apart = (x.azimuth_rad.sin() - source.azimuth_rad.sin()).abs();
                        apart < beam && (x.power_w, *r) > (source.power_w, row)
                    })
                });
                if beaten {
                    continue;
                }
                let a = self.estimator.manifold().steering(source.azimuth_rad, 0.0);
                let level = |r: usize| -> f64 {
                    let cell = &data[r * chirps * channels..(r + 1) * chirps * channels];
                    let sum: f64 = cell
                        .chunks_exact(channels)
                        .map(|x| a.iter().zip(x).map(|(a, x)| a.conj() * x).sum::<Complex64>().norm_sqr())
                        .sum();
                    sum.max(f64::MIN_POSITIVE).ln()
                };
                let [low, top, high] = [level(row - 1), level(row), level(row + 1)];
                let shift = vertex(low, top, high);
                let snr = source.power_w * (chirps * channels) as f64 / noise_w;
                out.push(ImagePeak {
                    range_bin: row as f64 + shift,
                    beat_std_cells: (0.5 / snr.max(1.0).sqrt()).hypot(s.beat_floor_cells),
                    source: *source,
                });
            }
        }
        out
    }
}
