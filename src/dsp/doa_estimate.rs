//! From the channels of detected cells to sources: one entry for all estimators of angle.
//!
//! [`Estimator::new`] checks what array and method allow; [`Estimator::estimate_cells`] runs in three
//! steps: small decompositions on the host (both engines), quadratic forms over the grid on the
//! engine that the caller hands in, then peaks between the points of the grid, powers and standard
//! deviations on the host.

use super::doa_beamform::Grid;
use super::doa_bisvd::BiSvd;
use super::doa_covariance::{Eigen, check_forgetting, covariance, eigen, load};
use super::doa_crb::{fit, standard_deviations};
use super::doa_esprit::esprit;
use super::doa_manifold::{Lattice, Manifold, Matrix};
use super::doa_ml::alternating_projection;
use super::doa_music::{complement, root_music};
pub use super::doa_options::{Cells, Method, Options, Smoothing, Source, SourceNumber};
use super::doa_order::{residual_probability, source_number};
use super::doa_search::{minima, refine};
use super::doa_spectrum::{Forms, Steering, form};
use super::doa_view::View;
use super::{Real, doa_capon};
use crate::base::error::{BadInput, Result};
use crate::base::tasks::Tasks;
use crate::base::units::power_from_db;
use num_complex::Complex64;
use rayon::prelude::*;

/// A method prepared for an array.
///
/// # Example
/// Two equally strong bodies at ±3.5° in one cell and one snapshot of the twelve channels of `demo77`, whose beam is
/// 8.5° wide. The beamformer sees one source between them; MUSIC, after spatial smoothing, separates the two.
///
/// ```
/// use catseye::dsp::cpu::doa_spectrum::spectra;
/// use catseye::dsp::doa_beamform::Grid;
/// use catseye::dsp::doa_estimate::{Cells, Estimator, Method, Options, SourceNumber};
/// use catseye::dsp::doa_manifold::Manifold;
/// use catseye::scene::radar_toml::preset;
///
/// let mut radar = preset("demo77")?;
/// radar.processing.azimuth_bins = 241;
/// let (array, grid) = (Manifold::of_radar(&radar)?, Grid::new(&radar)?);
/// let [left, right] = [3.5f64, -3.5].map(|deg| array.steering(deg.to_radians(), 0.0));
/// let snapshot: Vec<_> = left.iter().zip(&right).map(|(l, r)| l + r).collect();
/// let azimuths_deg = |method, count| -> catseye::Result<Vec<f64>> {
///     let options = Options { method, sources: SourceNumber::Given(count), ..Default::default() };
///     let estimator = Estimator::new(array.clone(), grid.clone(), options)?;
///     let cells = Cells { snapshots: 1, data: &snapshot, noise_w: None };
///     let found = estimator.estimate_cells(&cells, |steering, forms| Ok(spectra::<f64>(steering, forms)))?;
///     let mut deg: Vec<f64> = found[0].iter().map(|s| s.azimuth_rad.to_degrees()).collect();
///     deg.sort_by(f64::total_cmp);
///     Ok(deg)
/// };
/// let music = azimuths_deg(Method::Music, 2)?;
/// assert!((music[0] + 3.5).abs() < 0.05 && (music[1] - 3.5).abs() < 0.05, "{music:?}");
/// let beamformer = azimuths_deg(Method::Bartlett, 1)?;
/// assert!(beamformer[0].abs() < 0.05, "{beamformer:?}");
/// # Ok::<(), catseye::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Estimator {
    manifold: Manifold,
    grid: Grid,
    options: Options,
    axes: [bool; 2],
    whole: View,
    smoothed: Option<View>,
    /// Steering vectors of the whole array, which mark ambiguous directions.
    table: Steering,
}

/// What the host makes of a cell before the grid.
enum Prepared {
    Form { factor: Matrix, count: usize },
    Directions(Vec<(f64, f64)>),
}

impl Estimator {
    /// An estimator of directions on a grid.
    ///
    /// # Errors
    /// Returns an error for a grid that is empty, wider than the calibration, or of two axes for an array on one line,
    /// for more sources than the array can tell, for a method that needs a uniform line or rectangle on another array,
    /// or for settings outside their ranges.
    pub fn new(manifold: Manifold, grid: Grid, options: Options) -> Result<Self> {
        let o = &options;
        if grid.azimuth_rad.is_empty() || grid.elevation_rad.is_empty() {
            return Err(BadInput::new("the grid of directions is empty")
                .key("azimuth_bins, elevation_bins")
                .into());
        }
        let axes = [grid.azimuth_rad.len() > 1, grid.elevation_rad.len() > 1];
        if axes == [true, true] && manifold.is_line() && o.method != Method::Bartlett {
            return Err(BadInput::new("an array on one line measures one angle only")
                .key("elevation_bins")
                .value(grid.elevation_rad.len())
                .allowed("1")
                .into());
        }
        let ends = |v: &[f64]| [v[0], v[v.len() - 1]];
        for a in ends(&grid.azimuth_rad) {
            for e in ends(&grid.elevation_rad) {
                if !manifold.covers(a, e) {
                    return Err(BadInput::new("the calibration does not include this direction of the grid")
                        .key("azimuth, elevation")
                        .value(format!("{:.2} deg, {:.2} deg", a.to_degrees(), e.to_degrees()))
                        .remedy("reduce the field of view, or calibrate over a wider one")
                        .into());
                }
            }
        }
        if let Method::BiSvd { forgetting } = o.method {
            check_forgetting(forgetting)?;
        }
        if !(o.loading >= 0.0 && o.loading.is_finite()) {
            return Err(BadInput::new("is not a diagonal loading")
                .key("loading")
                .value(o.loading)
                .allowed("0 or more")
                .into());
        }
        if o.below_db.is_nan() || o.below_db < 0.0 {
            return Err(BadInput::new("is not a level in dB below the maximum")
                .key("below_db")
                .value(o.below_db)
                .allowed("0 or more")
                .into());
        }
        if o.max_sources == 0 {
            return Err(BadInput::new("the maximum number of sources is zero")
                .key("max_sources")
                .value(0)
                .into());
        }
        if let SourceNumber::Residual { false_alarm, model_error } = o.sources {
            check_share("false_alarm", false_alarm, f64::MIN_POSITIVE)?;
            check_share("model_error", model_error, 0.0)?;
        }
        let lattice = manifold.lattice();
        if o.method.is_gridless() {
            check_even(o.method, &manifold, lattice.as_ref())?;
        }
        let whole = View::whole(&manifold, &grid, o, lattice.as_ref())?;
        let smoothed = match (o.smoothing, &lattice) {
            _ if !o.method.averages_subarrays() => None,
            (Smoothing::Off, _) | (Smoothing::Auto, None) => None,
            (Smoothing::Auto, Some(_)) if manifold.range_m().is_some() => None,
            (Smoothing::Subarray(_), _) if manifold.range_m().is_some() => {
                return Err(BadInput::new("subarrays receive a near source from different directions")
                    .key("subarray")
                    .remedy("use the manifold of the far field, or maximum likelihood without subarrays")
                    .into());
            }
            (Smoothing::Auto, Some(l)) => {
                let mut size = l.size.map(|s| (2 * s).div_ceil(3));
                if let (SourceNumber::Given(m), 1) = (o.sources, l.size[0]) {
                    size[1] = size[1].max(m.saturating_add(1)).min(l.size[1]);
                }
                Some(View::smoothed(&manifold, &grid, o, l, size)?)
            }
            (Smoothing::Subarray(size), Some(l)) => Some(View::smoothed(&manifold, &grid, o, l, size)?),
            (Smoothing::Subarray(_), None) => {
                return Err(BadInput::new("the array is not a uniform line or rectangle")
                    .key("subarray")
                    .remedy("leave out subarrays, or use maximum likelihood, which needs none")
                    .into());
            }
        };
        if let SourceNumber::Given(m) = o.sources {
            check_count(o.method, m, smoothed.as_ref().unwrap_or(&whole))?;
        }
        let table = Steering::new(&manifold, &grid);
        Ok(Estimator { manifold, grid, options, axes, whole, smoothed, table })
    }

    /// The manifold of the array.
    pub fn manifold(&self) -> &Manifold {
        &self.manifold
    }

    /// The grid of directions that is searched.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Subarrays if they are asked for or, left to itself, there are fewer snapshots than channels.
    fn view(&self, snapshots: usize) -> &View {
        match &self.smoothed {
            Some(v) if self.options.smoothing != Smoothing::Auto || snapshots < self.manifold.channels() => v,
            _ => &self.whole,
        }
    }

    /// Steering vectors that [`Self::estimate_cells`] evaluates forms on for cells of so many snapshots.
    pub fn steering(&self, snapshots: usize) -> &Steering {
        &self.view(snapshots).steering
    }

    /// Estimates the sources of each cell, strongest first. `evaluate` computes the forms over the grid, `[cell,
    /// direction]`, on either engine: [`super::doa_spectrum::spectra`] or its twin.
    ///
    /// # Errors
    /// Returns an error for data of another size, values that are not finite, too few snapshots for the method on this
    /// array, and the errors of `evaluate`.
    pub fn estimate_cells<T: Real>(
        &self,
        cells: &Cells<'_>,
        evaluate: impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<Vec<Source>>> {
        self.check(cells)?;
        let mut out = Vec::new();
        for block in self.blocks(cells) {
            out.extend(self.finish(self.prepare_all(&block)?, &block, &evaluate)?);
        }
        Ok(out)
    }

    /// Estimates as [`Self::estimate_cells`] from signal subspaces that trackers hold, one [`BiSvd::basis`] for each
    /// cell: by eq. 22 of the document. The trackers were fed with [`Self::looks`]; `cells` holds the latest snapshots,
    /// from which powers are taken.
    ///
    /// # Errors
    /// Returns the errors of [`Self::estimate_cells`], and an error if the method does not track.
    pub fn track_cells<T: Real>(
        &self,
        bases: &[Matrix],
        cells: &Cells<'_>,
        evaluate: impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<Vec<Source>>> {
        let values = self.check_data(cells)?;
        if bases.len() * values != cells.data.len() {
            return Err(BadInput::new("the number of subspaces differs from the number of cells")
                .key("bases")
                .value(bases.len())
                .allowed((cells.data.len() / values.max(1)).to_string())
                .into());
        }
        let prepared = bases.iter().map(|b| self.of_basis(b, cells.snapshots)).collect::<Result<_>>()?;
        self.finish(prepared, cells, &evaluate)
    }

    /// What a tracker of subspaces is fed with: the snapshots of all subarrays, forward and backward,
    /// `[look, element]` with [`Self::elements`] each.
    pub fn looks(&self, snapshots: &[Complex64]) -> Vec<Complex64> {
        let n = self.manifold.channels();
        self.view(snapshots.len() / n).looks(snapshots, n)
    }

    /// Number of elements of a subarray for cells of so many snapshots: all channels where no subarrays are formed.
    pub fn elements(&self, snapshots: usize) -> usize {
        self.view(snapshots).manifold.channels()
    }

    /// The spectrum of each cell, `[cell, elevation, azimuth]`: in W for Bartlett, maximum likelihood
    /// (its first source) and Capon, whose powers are those of sources in the middle of a bin; N over
    /// the form of the noise subspace (1 and more) for MUSIC and Bi-SVD. Cells without any source:
    /// zeros.
    ///
    /// # Errors
    /// Returns the errors of [`Self::estimate_cells`], and an error if the method has no spectrum.
    pub fn spectra<T: Real>(
        &self,
        cells: &Cells<'_>,
        evaluate: impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<f64>> {
        if self.options.method.is_gridless() {
            return Err(BadInput::new(format!("{} has no spectrum", self.options.method.name()))
                .key("method")
                .remedy("use MUSIC for a spectrum")
                .into());
        }
        self.check(cells)?;
        let mut out = Vec::new();
        for block in self.blocks(cells) {
            out.extend(self.picture(&self.prepare_all(&block)?, cells.snapshots, &evaluate)?);
        }
        Ok(out)
    }

    /// Cells in blocks whose factors and spectra take some 64 MiB together.
    fn blocks<'a>(&self, cells: &Cells<'a>) -> Vec<Cells<'a>> {
        const BYTES: usize = 64 << 20;
        let view = self.view(cells.snapshots);
        let values = cells.snapshots * self.manifold.channels();
        let elements = view.manifold.channels();
        let each = 16 * elements * elements.max(cells.snapshots) + 16 * view.steering.directions();
        let together = (BYTES / each).max(1);
        cells
            .data
            .chunks(together * values)
            .enumerate()
            .map(|(i, data)| {
                let first = i * together;
                let noise_w = cells.noise_w.map(|w| &w[first..first + data.len() / values]);
                Cells { data, noise_w, ..*cells }
            })
            .collect()
    }

    /// The spectrum of eq. 22 of the document for each tracked subspace, `[cell, elevation, azimuth]`.
    /// `snapshots`: as many as [`Self::looks`] was given at a time.
    ///
    /// # Errors
    /// Returns the errors of [`Self::estimate_cells`], and an error if the method does not track.
    pub fn track_spectra<T: Real>(
        &self,
        bases: &[Matrix],
        snapshots: usize,
        evaluate: impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<f64>> {
        let prepared = bases.iter().map(|b| self.of_basis(b, snapshots)).collect::<Result<Vec<_>>>()?;
        self.picture(&prepared, snapshots, &evaluate)
    }

    fn of_basis(&self, basis: &Matrix, snapshots: usize) -> Result<Prepared> {
        let due = self.elements(snapshots);
        if basis.nrows() != due || basis.ncols() == 0 || basis.ncols() >= due {
            return Err(BadInput::new("the subspace does not fit the array")
                .key("basis")
                .value(format!("{} x {}", basis.nrows(), basis.ncols()))
                .allowed(format!("{due} x 1 to {due} x {}", due - 1))
                .into());
        }
        Ok(Prepared::Form { factor: complement(basis)?, count: basis.ncols() })
    }

    fn prepare_all(&self, cells: &Cells<'_>) -> Result<Vec<Prepared>> {
        let values = cells.snapshots * self.manifold.channels();
        let view = self.view(cells.snapshots);
        let noise = |cell: usize| cells.noise_w.map(|w| w[cell]);
        cells
            .data
            .par_chunks_exact(values)
            .enumerate()
            .map_tasks(|(cell, x)| self.prepare(view, x, cells.snapshots, noise(cell)))
            .collect()
    }

    fn evaluated<T: Real>(
        &self,
        view: &View,
        prepared: &[Prepared],
        evaluate: &impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<Option<Vec<T>>>> {
        let factors: Vec<&Matrix> = prepared.iter().filter_map(Prepared::factor).collect();
        let forms = if factors.is_empty() {
            Vec::new()
        } else {
            evaluate(&view.steering, &Forms::new(&factors, view.manifold.channels()))?
        };
        let mut parts = forms.chunks_exact(view.steering.directions());
        Ok(prepared.iter().map(|p| p.factor().and_then(|_| parts.next()).map(<[T]>::to_vec)).collect())
    }

    fn picture<T: Real>(
        &self,
        prepared: &[Prepared],
        snapshots: usize,
        evaluate: &impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<f64>> {
        let view = self.view(snapshots);
        let n = view.manifold.channels() as f64;
        let level = |q: T| match self.options.method {
            Method::Bartlett | Method::Ml => q.wide() / (n * n),
            Method::Capon => 1.0 / q.wide(),
            _ => n / q.wide(),
        };
        let parts = self.evaluated(view, prepared, evaluate)?;
        Ok(parts
            .into_iter()
            .flat_map(|p| match p {
                Some(q) => q.into_iter().map(level).collect(),
                None => vec![0.0; view.steering.directions()],
            })
            .collect())
    }

    fn finish<T: Real>(
        &self,
        prepared: Vec<Prepared>,
        cells: &Cells<'_>,
        evaluate: &impl Fn(&Steering, &Forms) -> Result<Vec<T>>,
    ) -> Result<Vec<Vec<Source>>> {
        let view = self.view(cells.snapshots);
        let values = cells.snapshots * self.manifold.channels();
        let parts = self.evaluated(view, &prepared, evaluate)?;
        Ok(prepared
            .into_par_iter()
            .zip(parts)
            .enumerate()
            .map_tasks(|(cell, (p, q))| {
                let x = &cells.data[cell * values..(cell + 1) * values];
                let found = match (p, q) {
                    (Prepared::Form { factor, count }, Some(q)) => self.peaks(view, &factor, count, &q),
                    (Prepared::Directions(d), _) => d,
                    (Prepared::Form { .. }, None) => Vec::new(),
                };
                self.sources(found, x, cells.snapshots, cells.noise_w.map(|w| w[cell]))
            })
            .collect())
    }

    /// Values of one cell.
    fn check_data(&self, cells: &Cells<'_>) -> Result<usize> {
        let n = self.manifold.channels();
        let values = cells.snapshots * n;
        if values == 0 || !cells.data.len().is_multiple_of(values) {
            let due = format!("cells of {} snapshots of {n} channels are expected", cells.snapshots);
            return Err(BadInput::new(due).key("snapshots").value(cells.data.len()).into());
        }
        let count = cells.data.len() / values;
        if let Some(w) = cells.noise_w
            && (w.len() != count || w.iter().any(|w| w.is_nan() || *w < 0.0))
        {
            return Err(BadInput::new("the noise powers do not fit the cells")
                .key("noise_w")
                .value(format!("{} values", w.len()))
                .allowed(format!("{count} values of 0 W or more"))
                .into());
        }
        if let Some(i) = cells.data.iter().position(|z| !z.is_finite()) {
            return Err(BadInput::new("the snapshot is not finite")
                .key(format!("cell {}, channel {}", i / values, i % n))
                .value(cells.data[i])
                .into());
        }
        Ok(values)
    }

    /// The same, where the cells also have to suffice for the method.
    fn check(&self, cells: &Cells<'_>) -> Result<()> {
        self.check_data(cells)?;
        let o = &self.options;
        let needed = match o.sources {
            SourceNumber::Given(m) => m,
            // One source takes one look, and telling it from noise one more.
            SourceNumber::Found(_) => 2,
            SourceNumber::Residual { .. } => 1,
        };
        if matches!(o.sources, SourceNumber::Residual { .. }) && cells.noise_w.is_none() {
            return Err(BadInput::new(
                "the number of sources by residual needs the noise power of each cell",
            )
            .key("noise_w")
            .remedy("give the noise power, or the number of sources")
            .into());
        }
        let criterion = matches!(o.sources, SourceNumber::Found(_));
        if (o.method.uses_subspace() || criterion)
            && self.view(cells.snapshots).count(cells.snapshots) < needed
        {
            let what = if needed == 1 { "a source".into() } else { format!("{needed} sources") };
            let bad = BadInput::new(format!("{} cannot estimate {what} from this cell", o.method.name()))
                .key("snapshots")
                .value(cells.snapshots);
            return Err(if o.method.uses_subspace() {
                bad.allowed(format!("{needed} or more, because the array gives no subarrays here")).remedy(
                    "give more snapshots, use subarrays of a uniform array, or use maximum likelihood",
                )
            } else {
                bad.allowed(format!("{needed} or more for an information criterion"))
                    .remedy("give the number of sources, or use the residual")
            }
            .into());
        }
        Ok(())
    }

    /// Sources, and where they are, until the residual is noise or an error of the model.
    fn by_residual(&self, x: &[Complex64], snapshots: usize, noise_w: f64, o: [f64; 2]) -> Vec<(f64, f64)> {
        let [false_alarm, model_error] = o;
        let n = self.manifold.channels();
        let r = covariance(x, n);
        let total: f64 = (0..n).map(|c| r[(c, c)].re).sum();
        let factor = plain_factor(x, n);
        let angles = self.axes.iter().filter(|a| **a).count() as f64;
        let mut found: Vec<(f64, f64)> = Vec::new();
        while found.len() < self.options.max_sources.min((n - 1).max(1)) {
            let k = found.len();
            let left = match k {
                0 => total,
                _ => fit(&self.manifold.matrix(&found), &r).noise_w * (n - k) as f64,
            };
            // An angle takes half a complex degree of freedom.
            let freedom = (snapshots * (n - k)) as f64 - 0.5 * angles * k as f64;
            let chance = residual_probability(left, noise_w, snapshots as f64, freedom);
            if left <= model_error * total || chance >= false_alarm {
                break;
            }
            found = alternating_projection(&self.manifold, &self.grid, &self.table, &factor, found, k + 1);
        }
        found
    }

    fn prepare(
        &self,
        view: &View,
        x: &[Complex64],
        snapshots: usize,
        noise_w: Option<f64>,
    ) -> Result<Prepared> {
        let o = &self.options;
        let n = self.manifold.channels();
        let mut known = match o.sources {
            SourceNumber::Given(m) => Some(m),
            _ => None,
        };
        if let SourceNumber::Residual { false_alarm, model_error } = o.sources {
            let found = self.by_residual(x, snapshots, noise_w.unwrap_or(0.0), [false_alarm, model_error]);
            if o.method == Method::Ml || found.is_empty() {
                return Ok(Prepared::Directions(found));
            }
            known = Some(found.len());
        }
        // Bartlett and maximum likelihood with a known number need no covariance of their own.
        if matches!(o.method, Method::Bartlett | Method::Ml) {
            let count = match (known, o.sources) {
                (None, SourceNumber::Found(c)) => {
                    let values = eigen(&covariance(x, n))?.values;
                    source_number(&values, snapshots as f64, c, false).min(o.max_sources)
                }
                _ => known.unwrap_or(0),
            };
            let factor =
                if snapshots <= n { plain_factor(x, n) } else { square_root(&eigen(&covariance(x, n))?) };
            return Ok(Prepared::Form { factor, count });
        }
        let looks = view.looks(x, n);
        let m = view.manifold.channels();
        let mut r = covariance(&looks, m);
        let fb = view.mirror.is_some();
        let most = view.most_sources(o.method).min(view.count(snapshots));
        let count = |values: &[f64]| match (known, o.sources) {
            (None, SourceNumber::Found(c)) => {
                let sets = (view.sets.len() * snapshots) as f64;
                source_number(values, sets, c, fb).min(o.max_sources).min(most)
            }
            _ => known.unwrap_or(0).min(if o.method.uses_subspace() { most } else { m }),
        };
        if o.method == Method::Capon {
            let found = if known.is_some() { count(&[]) } else { count(&eigen(&r)?.values) };
            load(&mut r, o.loading);
            let e = eigen(&r)?;
            // A cell without any power has no directions.
            if e.values[0] <= 0.0 {
                return Ok(Prepared::Directions(Vec::new()));
            }
            return Ok(Prepared::Form { factor: doa_capon::factor(&e)?, count: found });
        }
        if let (Method::BiSvd { forgetting }, Some(_)) = (o.method, known) {
            let l = count(&[]);
            return Ok(Prepared::Form { factor: track(&looks, m, l, forgetting)?, count: l });
        }
        let e = eigen(&r)?;
        let l = if e.values[0] > 0.0 { count(&e.values) } else { 0 };
        if l == 0 {
            return Ok(Prepared::Directions(Vec::new()));
        }
        match (o.method, &view.lattice) {
            (Method::RootMusic, Some(lattice)) => {
                let turns = root_music(&e.noise(l), l)?;
                Ok(Prepared::Directions(
                    turns.into_iter().map(|t| self.direction(lattice, [0.0, t])).collect(),
                ))
            }
            (Method::Esprit, Some(lattice)) => {
                let turns = esprit(&e.signal(l), lattice.size)?;
                Ok(Prepared::Directions(turns.into_iter().map(|t| self.direction(lattice, t)).collect()))
            }
            (Method::BiSvd { forgetting }, _) => {
                Ok(Prepared::Form { factor: track(&looks, m, l, forgetting)?, count: l })
            }
            _ => Ok(Prepared::Form { factor: e.noise(l), count: l }),
        }
    }

    /// Steering vectors carry e^{-jk u.p}.
    fn direction(&self, lattice: &Lattice, turn: [f64; 2]) -> (f64, f64) {
        let middle = |v: &[f64]| v[v.len() / 2];
        let fixed = if lattice.tells_azimuth() {
            middle(&self.grid.elevation_rad)
        } else {
            middle(&self.grid.azimuth_rad)
        };
        lattice.angles(turn.map(|t| -t), self.manifold.wavelength_m(), fixed)
    }

    fn peaks<T: Real>(&self, view: &View, factor: &Matrix, count: usize, forms: &[T]) -> Vec<(f64, f64)> {
        let o = &self.options;
        let cols = self.grid.azimuth_rad.len();
        // Powers grow with the form for Bartlett and maximum likelihood and fall with it for the others.
        let up = matches!(o.method, Method::Bartlett | Method::Ml);
        let sign = if up { -1.0 } else { 1.0 };
        let cost: Vec<f64> = forms.iter().map(|q| sign * q.wide()).collect();
        let tops = minima(&cost, &self.grid);
        let exact = |a: f64, e: f64| sign * form(factor, &view.manifold.steering(a, e));
        let wanted = if o.method == Method::Ml { count.min(1) } else { count };
        let mut found: Vec<((f64, f64), f64)> = Vec::new();
        for top in tops {
            if found.len() == wanted {
                break;
            }
            let start = (self.grid.azimuth_rad[top % cols], self.grid.elevation_rad[top / cols]);
            let there = refine(exact, &self.grid, start, 1.0);
            // Two neighbours on the grid can run into one hollow.
            let same = |p: &((f64, f64), f64)| (p.0.0 - there.0).hypot(p.0.1 - there.1) < 1e-5;
            if !found.iter().any(same) {
                found.push((there, exact(there.0, there.1)));
            }
        }
        if matches!(o.method, Method::Bartlett | Method::Capon) {
            let power = |q: f64| if up { -q } else { 1.0 / q };
            let least = found.iter().map(|p| power(p.1)).fold(0.0, f64::max) * power_from_db(-o.below_db);
            found.retain(|p| power(p.1) >= least);
        }
        let found: Vec<(f64, f64)> = found.into_iter().map(|p| p.0).collect();
        if o.method == Method::Ml && count > 0 {
            return alternating_projection(&self.manifold, &self.grid, &self.table, factor, found, count);
        }
        found
    }

    fn sources(
        &self,
        directions: Vec<(f64, f64)>,
        x: &[Complex64],
        snapshots: usize,
        noise_w: Option<f64>,
    ) -> Vec<Source> {
        let n = self.manifold.channels();
        if directions.is_empty() || x.iter().all(|z| z.norm_sqr() == 0.0) {
            return Vec::new();
        }
        let fit = fit(&self.manifold.matrix(&directions), &covariance(x, n));
        let noise = noise_w.unwrap_or(if n > directions.len() { fit.noise_w } else { f64::INFINITY });
        // A line tells the angle of its own plane even if the grid has one direction only.
        let axes = match (&self.whole.lattice, self.options.method.is_gridless()) {
            (Some(l), true) if l.size[0] == 1 => [l.tells_azimuth(), !l.tells_azimuth()],
            (Some(_), true) => [true, true],
            _ => self.axes,
        };
        let std = standard_deviations(&self.manifold, &directions, axes, &fit.sources, noise, snapshots);
        let mut out: Vec<Source> = directions
            .iter()
            .zip(std)
            .enumerate()
            .map(|(i, (&(azimuth_rad, elevation_rad), std))| Source {
                azimuth_rad,
                elevation_rad,
                power_w: fit.sources[(i, i)].re,
                azimuth_std_rad: std[0],
                elevation_std_rad: std[1],
                ambiguous: self.is_ambiguous(azimuth_rad, elevation_rad),
            })
            .collect();
        out.sort_by(|a, b| b.power_w.total_cmp(&a.power_w).then(a.azimuth_rad.total_cmp(&b.azimuth_rad)));
        out
    }

    /// Whether another peak of |a^H(there) a(here)|/N on the grid comes up to 0.98 (eq. 99).
    fn is_ambiguous(&self, azimuth_rad: f64, elevation_rad: f64) -> bool {
        let n = self.manifold.channels();
        let here = self.manifold.steering(azimuth_rad, elevation_rad);
        let likeness = |a: &[Complex64]| {
            -a.iter().zip(&here).map(|(a, h)| a.conj() * h).sum::<Complex64>().norm_sqr() / (n * n) as f64
        };
        let cost: Vec<f64> = self.table.data.chunks_exact(n).map(likeness).collect();
        let cols = self.grid.azimuth_rad.len();
        let place = |i: usize| (self.grid.azimuth_rad[i % cols], self.grid.elevation_rad[i / cols]);
        let step = |axis: &[f64]| (axis[axis.len() - 1] - axis[0]).abs() / (axis.len().max(2) - 1) as f64;
        let (across, up) = (step(&self.grid.azimuth_rad), step(&self.grid.elevation_rad));
        let own = |p: (f64, f64)| {
            (p.0 - azimuth_rad).abs() <= 2.0 * across && (p.1 - elevation_rad).abs() <= 2.0 * up + 1e-6
        };
        minima(&cost, &self.grid).into_iter().take_while(|i| cost[*i] < -0.64).any(|i| {
            if own(place(i)) {
                return false;
            }
            let there = refine(|a, e| likeness(&self.manifold.steering(a, e)), &self.grid, place(i), 1.0);
            !own(there) && likeness(&self.manifold.steering(there.0, there.1)) < -0.98 * 0.98
        })
    }
}

impl Prepared {
    fn factor(&self) -> Option<&Matrix> {
        match self {
            Prepared::Form { factor, .. } => Some(factor),
            Prepared::Directions(_) => None,
        }
    }
}

fn check_even(method: Method, manifold: &Manifold, lattice: Option<&Lattice>) -> Result<()> {
    let shape = if method == Method::RootMusic { "a uniform line" } else { "a uniform line or rectangle" };
    let fits = lattice.is_some_and(|l| method == Method::Esprit || l.size[0] == 1);
    if fits && manifold.range_m().is_none() {
        return Ok(());
    }
    Err(BadInput::new(format!("{} needs {shape} and distant sources", method.name()))
        .key("method")
        .remedy("use MUSIC or maximum likelihood, which work on any array")
        .into())
}

fn check_share(key: &str, share: f64, least: f64) -> Result<()> {
    if (least..1.0).contains(&share) {
        return Ok(());
    }
    let allowed = if least > 0.0 { "above 0 and below 1" } else { "0 or more and below 1" };
    Err(BadInput::new("is not a share").key(key).value(share).allowed(allowed).into())
}

fn check_count(method: Method, sources: usize, view: &View) -> Result<()> {
    let most = view.most_sources(method);
    if (1..=most).contains(&sources) {
        return Ok(());
    }
    let elements = view.manifold.channels();
    Err(BadInput::new(format!(
        "{} cannot estimate this number of sources with {elements} channels",
        method.name()
    ))
    .key("sources")
    .value(sources)
    .allowed(if most == usize::MAX { "1 or more".into() } else { format!("1 to {most}") })
    .into())
}

/// F of R = mean of x x^H without forming R: a column for each snapshot.
fn plain_factor(x: &[Complex64], channels: usize) -> Matrix {
    let snapshots = x.len() / channels;
    let scale = 1.0 / (snapshots as f64).sqrt();
    Matrix::from_fn(channels, snapshots, |c, t| x[t * channels + c] * scale)
}

/// F with F F^H = R; columns of eigenvalues that are rounding are left out.
fn square_root(e: &Eigen) -> Matrix {
    let n = e.values.len();
    let rank = e.values.iter().filter(|v| **v > e.values[0] * n as f64 * f64::EPSILON).count();
    Matrix::from_fn(n, rank, |i, j| e.vectors[(i, j)] * e.values[j].max(0.0).sqrt())
}

/// Noise subspace after the tracker has seen all looks, over and over until a round of them leaves
/// the subspace where it was, or its memory has been filled tenfold.
fn track(looks: &[Complex64], channels: usize, rank: usize, forgetting: f64) -> Result<Matrix> {
    const SAME_RAD: f64 = 1e-6;
    let mut tracker = BiSvd::new(channels, rank, forgetting)?;
    let count = looks.len() / channels;
    let rounds = (10.0 / (1.0 - forgetting) / count as f64).ceil().clamp(4.0, 1e4) as usize;
    let mut before = tracker.basis();
    for _ in 0..rounds {
        looks.chunks_exact(channels).for_each(|x| tracker.update(x));
        let now = tracker.basis();
        let turned = &now - &before * (before.adjoint() * &now);
        if turned.norm_l2() < SAME_RAD {
            break;
        }
        before = now;
    }
    complement(&before)
}
