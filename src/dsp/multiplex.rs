//! From the channels of a cell to pairs of a transmitter and a receiver (CONVENTIONS eq. 19a).

use crate::scene::radar::Radar;
use crate::scene::waveform::Multiplex;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// The channels of one cell, told apart by transmitter.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// Values of the channels, `[tx, rx]`, √W, all as at the time of the first slot.
    pub channels: Vec<Complex64>,
    /// Range rate; with Doppler bands (DDM) in the fold that the empty bands point to.
    pub range_rate_mps: f64,
    /// Mean power of a channel in the Doppler bands that are empty in this fold, and in those of the best other fold, W; zeros
    /// without empty bands.
    pub empty_w: [f64; 2],
    /// Power of the weakest transmitter's Doppler band over the mean of those of all; 1 without bands.
    pub least_share: f64,
}

/// Separates the transmitters. `snapshot` is in the order of the map's channels, `range_rate_mps` the row's.
pub fn decode(radar: &Radar, snapshot: &[Complex64], range_rate_mps: f64) -> Decoded {
    decode_in(radar, snapshot, range_rate_mps, None)
}

/// [`decode`], with Doppler bands (DDM) in this fold of them, where it is known, in place of the one that the empty bands point to.
pub fn decode_in(
    radar: &Radar,
    snapshot: &[Complex64],
    range_rate_mps: f64,
    known_fold: Option<usize>,
) -> Decoded {
    let (n_tx, n_rx) = (radar.tx.len(), radar.rx.len());
    let slot_turns = 2.0 * range_rate_mps / radar.sample_wavelength_m() * radar.chirp_period_s();
    let slots = radar.slots();
    match radar.multiplex {
        Multiplex::Tdm | Multiplex::Bpm => {
            let norm = match radar.multiplex {
                Multiplex::Tdm => 1.0,
                _ => 1.0 / slots as f64,
            };
            let mut channels = vec![Complex64::ZERO; n_tx * n_rx];
            for (slot, received) in snapshot.chunks_exact(n_rx).enumerate() {
                let back = Complex64::cis(-TAU * slot_turns * slot as f64) * norm;
                for tx in 0..n_tx {
                    let weight = radar.multiplex.weight(slot, tx);
                    if weight != 0.0 {
                        for (c, x) in channels[tx * n_rx..][..n_rx].iter_mut().zip(received) {
                            *c += x * back * weight;
                        }
                    }
                }
            }
            Decoded { channels, range_rate_mps, empty_w: [0.0; 2], least_share: 1.0 }
        }
        Multiplex::Ddm { bands } => {
            let power: Vec<f64> =
                snapshot.chunks_exact(n_rx).map(|b| b.iter().map(Complex64::norm_sqr).sum()).collect();
            let band = |tx: usize, fold: usize| (tx + bands - fold) % bands;
            let received = |fold: usize| (0..n_tx).map(|tx| power[band(tx, fold)]).sum::<f64>();
            // Of equal folds the slowest.
            let order = (0..bands).map(|i| if i % 2 == 0 { i / 2 } else { bands - i.div_ceil(2) });
            let mut fold = 0;
            for f in order {
                if received(f) > received(fold) * (1.0 + 1e-12) {
                    fold = f;
                }
            }
            let fold = known_fold.unwrap_or(fold);
            let channels =
                (0..n_tx).flat_map(|tx| &snapshot[band(tx, fold) * n_rx..][..n_rx]).copied().collect();
            let values = (n_rx * bands.saturating_sub(n_tx)).max(1) as f64;
            let empty = |fold: usize| {
                let filled: Vec<usize> = (0..n_tx).map(|tx| band(tx, fold)).collect();
                (0..bands).filter(|b| !filled.contains(b)).map(|b| power[b]).sum::<f64>() / values
            };
            let second = (0..bands).filter(|f| *f != fold).map(empty).fold(f64::INFINITY, f64::min);
            let empty_w = if bands > n_tx { [empty(fold), second] } else { [0.0; 2] };
            let least = (0..n_tx).map(|tx| power[band(tx, fold)]).fold(f64::INFINITY, f64::min);
            let least_share = least * n_tx as f64 / received(fold).max(f64::MIN_POSITIVE);
            let width = 2.0 * radar.max_velocity_mps();
            let all = width * bands as f64;
            let rate = range_rate_mps + fold as f64 * width;
            Decoded { channels, range_rate_mps: rate - all * (rate / all).round(), empty_w, least_share }
        }
    }
}
