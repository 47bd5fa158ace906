//! Why a point is there: the echoes that fall into its cell, first those that its beam hears most, with the places that their paths touch.

use catseye::base::error::{BadInput, Result};
use catseye::formats::csv::Table;
use catseye::formats::npy;
use catseye::scene::radar::Radar;
use serde_json::{Value, json};
use std::path::Path;

/// Most echoes that are told of a point.
const MOST: usize = 6;
/// Half width of a cell in bins of range and range rate: the main lobe of a Hann window reaches two bins.
const BINS: f64 = 1.5;

/// One echo of `returns.csv`.
struct Return {
    range_m: f64,
    range_rate_mps: f64,
    /// Sine of the azimuth by which the virtual array sees it: the mean of both ends of the path.
    sine: f64,
    power_dbm: f64,
}

/// The returns of a frame with their chains and places.
pub struct Returns {
    list: Vec<Return>,
    chains: Vec<String>,
    bounces: Vec<f64>,
    /// `[echo, bounce, 3]`, where the frame has them.
    places: Option<(usize, Vec<f32>)>,
}

impl Returns {
    /// Reads `returns.csv` of a frame and, where it is there, `return_places.npy`.
    ///
    /// # Errors
    /// Returns an error for files that are no tables of returns or of another number of rows.
    pub fn read(dir: &Path) -> Result<Option<Returns>> {
        let path = dir.join("returns.csv");
        if !path.is_file() {
            return Ok(None);
        }
        let table = Table::read(&path)?;
        let column = |name: &str| table.numbers(name);
        let (range, rate) = (column("range_m")?, column("range_rate_mps")?);
        let (azimuth, elevation) = (column("azimuth_deg")?, column("elevation_deg")?);
        let power = column("power_dbm")?;
        let places = dir.join("return_places.npy");
        let places = match places.is_file() {
            true => {
                let array = npy::read_f32(&places)?;
                let [rows, most, 3] = array.shape[..] else { return Err(other_rows(&places, table.len())) };
                if rows != table.len() {
                    return Err(other_rows(&places, table.len()));
                }
                Some((most, array.data))
            }
            false => None,
        };
        let sine = |i: usize| {
            let own = azimuth[i].to_radians().sin() * elevation[i].to_radians().cos();
            let Some((most, data)) = &places else { return own };
            let row = &data[3 * most * i..3 * most * (i + 1)];
            let known: Vec<&[f32]> =
                row.chunks_exact(3).filter(|p| p.iter().all(|x| x.is_finite())).collect();
            let side = |p: &[f32]| {
                let [x, y, z] = [p[0], p[1], p[2]].map(f64::from);
                y / (x * x + y * y + z * z).sqrt().max(1e-12)
            };
            match (known.first(), known.last()) {
                (Some(first), Some(last)) => 0.5 * (side(first) + side(last)),
                _ => own,
            }
        };
        let list = (0..table.len())
            .map(|i| Return {
                range_m: range[i],
                range_rate_mps: rate[i],
                sine: sine(i),
                power_dbm: power[i],
            })
            .collect();
        let chains = table.text("chain")?.iter().map(|c| c.to_string()).collect();
        let bounces = column("bounces")?;
        Ok(Some(Returns { list, chains, bounces, places }))
    }

    /// The strongest echoes in the cell of a point.
    pub fn of(
        &self,
        radar: &Radar,
        range_m: f64,
        range_rate_mps: f64,
        azimuth_deg: f64,
        elevation_deg: f64,
    ) -> Value {
        let (range_bin, rate_bin) = (radar.range_bin_m().abs(), radar.velocity_bin_mps().abs());
        let span = rate_bin * radar.doppler_rows() as f64;
        let sine = azimuth_deg.to_radians().sin() * elevation_deg.to_radians().cos();
        let width = sine_width(radar);
        let folded = |d: f64| d - span * (d / span).round();
        let mut found: Vec<usize> = (0..self.list.len())
            .filter(|i| {
                let e = &self.list[*i];
                (e.range_m - range_m).abs() <= BINS * range_bin
                    && folded(e.range_rate_mps - range_rate_mps).abs() <= BINS * rate_bin
                    && width.is_none_or(|w| (e.sine - sine).abs() <= w)
            })
            .collect();
        let total = found.len();
        // As the array hears them that looks at the point: its beam as a Gaussian of 0.886 λ/D between half powers.
        let received = |i: usize| {
            let e = &self.list[i];
            let off = width.map_or(0.0, |w| (e.sine - sine) / (0.886 * w));
            e.power_dbm - 12.0 * off * off
        };
        found.sort_by(|a, b| received(*b).total_cmp(&received(*a)));
        found.truncate(MOST);
        let echoes: Vec<Value> = found.iter().map(|i| self.echo(*i)).collect();
        json!({ "echoes": echoes, "in_cell": total })
    }

    fn echo(&self, i: usize) -> Value {
        let e = &self.list[i];
        let chain: Vec<u32> = self.chains[i].split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let places: Vec<Option<[f32; 3]>> = match &self.places {
            Some((most, data)) => data[3 * most * i..3 * most * (i + 1)]
                .chunks_exact(3)
                .take(self.bounces[i] as usize)
                .map(|p| p.iter().all(|x| x.is_finite()).then(|| [p[0], p[1], p[2]]))
                .collect(),
            None => Vec::new(),
        };
        json!({
            "power_dbm": e.power_dbm, "range_m": e.range_m, "range_rate_mps": e.range_rate_mps,
            "bounces": self.bounces[i] as u64, "chain": chain, "places": places,
        })
    }
}

/// Width of the virtual array's beam in the sine of the azimuth, λ/D; None for an array without width.
fn sine_width(radar: &Radar) -> Option<f64> {
    let span = |ys: Vec<f64>| {
        let (lo, hi) = ys.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(*y), b.max(*y)));
        (hi - lo).max(0.0)
    };
    let aperture = span(radar.tx.iter().map(|a| a.position_m.y).collect())
        + span(radar.rx.iter().map(|a| a.position_m.y).collect());
    (aperture > 0.0).then(|| radar.wavelength_m() / aperture)
}

fn other_rows(path: &Path, rows: usize) -> catseye::base::error::Error {
    BadInput::new("the shape does not fit returns.csv")
        .file(path)
        .allowed(format!("[{rows}, bounces, 3], a row for each row of returns.csv"))
        .remedy("simulate the run again")
        .into()
}
