//! Errors of the channels: they belong to the device and are the same in every frame (CONVENTIONS eq. 108).

use super::draws::{CHANNEL_GAIN_STREAM, POSITION_STREAM, normals};
use crate::base::units::power_from_db;
use crate::scene::front_end::ChannelErrors;
use crate::scene::radar::Radar;
use glam::DVec3;
use num_complex::Complex64;

/// Factor of each channel c = tx · n_rx + rx: that of its transmitter times that of its receiver times the
/// given one. The samples are s_tx s_rx*, so a phase that the way through the antennas adds counts backwards.
pub fn gains(errors: &ChannelErrors, n_tx: usize, n_rx: usize) -> Vec<Complex64> {
    let drawn = |antenna: usize| {
        let [g, p] = normals(errors.seed, 0, CHANNEL_GAIN_STREAM, antenna as u64);
        factor(errors.gain_rms_db * g, errors.phase_rms_rad * p)
    };
    (0..n_tx * n_rx)
        .map(|c| {
            let given = factor(
                errors.gain_db.get(c).copied().unwrap_or(0.0),
                errors.phase_rad.get(c).copied().unwrap_or(0.0),
            );
            drawn(c / n_rx) * drawn(n_tx + c % n_rx) * given
        })
        .collect()
}

fn factor(gain_db: f64, phase_rad: f64) -> Complex64 {
    Complex64::from_polar(power_from_db(gain_db).sqrt(), -phase_rad)
}

/// The radar as it was built: each antenna off its place. To be given to the synthesis; processing goes by
/// the radar as it was drawn.
pub fn displaced(radar: &Radar, errors: &ChannelErrors) -> Radar {
    let mut built = radar.clone();
    if errors.position_rms_m > 0.0 {
        for (i, antenna) in built.tx.iter_mut().chain(&mut built.rx).enumerate() {
            let [x, y] = normals(errors.seed, 0, POSITION_STREAM, 2 * i as u64);
            let [z, _] = normals(errors.seed, 0, POSITION_STREAM, 2 * i as u64 + 1);
            antenna.position_m += errors.position_rms_m * DVec3::new(x, y, z);
        }
    }
    built
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_errors_have_the_spread_asked_for() {
        let errors = ChannelErrors { gain_rms_db: 0.3, phase_rms_rad: 0.1, ..Default::default() };
        let g = gains(&errors, 1, 20_000);
        // All share the transmitter's error.
        let first = g.iter().sum::<Complex64>() / g.len() as f64;
        let level: Vec<f64> = g.iter().map(|z| 10.0 * (z / first).norm_sqr().log10()).collect();
        let phase: Vec<f64> = g.iter().map(|z| (z / first).arg()).collect();
        let rms = |x: &[f64]| {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
        };
        // Four standard deviations of a spread from 20,000 draws: 2 %.
        assert!((rms(&level) / 0.3 - 1.0).abs() < 0.02 && (rms(&phase) / 0.1 - 1.0).abs() < 0.02);
        assert_eq!(g, gains(&errors, 1, 20_000));
        assert_ne!(g[0], gains(&ChannelErrors { seed: 1, ..errors }, 1, 1)[0]);
    }

    #[test]
    fn given_errors_are_per_channel() {
        let errors = ChannelErrors {
            gain_db: vec![0.0, 6.0, 0.0, 0.0],
            phase_rad: vec![0.0, 0.0, 0.5, 0.0],
            ..Default::default()
        };
        let g = gains(&errors, 2, 2);
        assert!((g[0] - 1.0).norm() < 1e-15 && (g[3] - 1.0).norm() < 1e-15);
        assert!((g[1].re - 10f64.powf(0.3)).abs() < 1e-12 && (g[2].arg() + 0.5).abs() < 1e-12);
    }

    #[test]
    fn places_move_and_stay_moved() {
        let radar = crate::scene::radar_toml::preset("front77").unwrap();
        let errors = ChannelErrors { position_rms_m: 1e-4, seed: 3, ..Default::default() };
        let built = displaced(&radar, &errors);
        assert_eq!(built, displaced(&radar, &errors));
        for (a, b) in built.tx.iter().chain(&built.rx).zip(radar.tx.iter().chain(&radar.rx)) {
            let d = (a.position_m - b.position_m).length();
            assert!(d > 0.0 && d < 6e-4, "{d}");
        }
        assert_eq!(displaced(&radar, &ChannelErrors::default()), radar);
    }
}
