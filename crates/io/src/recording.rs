//! Radars of this program as devices whose recordings other programs read.

use crate::ti_cfg::{Antennas, IqOrder, Multiplex as TiMultiplex, TiRadar};
use catseye::base::error::{BadInput, Error, Result};
use catseye::scene::radar::{Antenna, Radar, Sampling};
use catseye::scene::waveform::{Multiplex, Waveform};

/// Positions of antennas in half wavelengths of the carrier.
fn places(radar: &Radar, list: &[Antenna]) -> Vec<[f64; 3]> {
    let half_wavelength_m = 0.5 * radar.wavelength_m();
    // Without the rounding errors of products.
    let short = |x: f64| (x / half_wavelength_m * 1e9).round() / 1e9;
    list.iter().map(|a| a.position_m.to_array().map(short)).collect()
}

/// The TI device equivalent to this radar: one ramp, transmitters in turn, up to three of them and four
/// receivers.
///
/// # Errors
/// Returns an error for a property of the radar that such a device does not have.
pub fn ti_radar(radar: &Radar) -> Result<TiRadar> {
    let bad = |problem: &str, value: String, allowed: &str| {
        Error::from(
            BadInput::new(problem)
                .key("radar")
                .value(value)
                .allowed(allowed)
                .remedy("write .npy or .h5 instead"),
        )
    };
    let ramp = match &radar.waveform {
        Waveform::Fmcw(s) if s.ramps.len() == 1 => s.ramps[0],
        other => {
            return Err(bad(
                "a .cfg can only describe one linear ramp",
                format!("{} with {} ramps", other.kind(), other.parts()),
                "fmcw with one ramp",
            ));
        }
    };
    if radar.multiplex != Multiplex::Tdm || radar.tx.len() > 3 {
        return Err(bad(
            "a .cfg can only describe TDM with up to 3 transmitters",
            format!("{:?} with {} transmitters", radar.multiplex, radar.tx.len()),
            "tdm with up to 3",
        ));
    }
    if radar.rx.len() > 4 {
        return Err(bad("the devices of a .cfg have four receivers", radar.rx.len().to_string(), "1..=4"));
    }
    Ok(TiRadar {
        start_hz: radar.start_hz(),
        slope_hz_per_s: radar.slope_hz_per_s(),
        idle_s: ramp.period_s - ramp.time_s,
        adc_start_s: radar.adc_start_s,
        ramp_end_s: ramp.time_s,
        tx_start_s: 0.0,
        samples: radar.samples,
        sample_rate_hz: radar.sample_rate_hz,
        loops: radar.chirps,
        tx_masks: (0..radar.tx.len()).map(|k| 1 << k).collect(),
        multiplex: TiMultiplex::Tdm,
        rx: (0..radar.rx.len() as u32).collect(),
        frames: Some(1),
        frame_period_s: 2.0 * radar.frame_time_s(),
        complex: radar.sampling == Sampling::Iq,
        image_band: false,
        adc_bits: 16,
        iq_order: IqOrder::Qi,
        interleaved: false,
        power_backoff_db: [0; 3],
        rx_gain: 30,
        high_pass: [0; 2],
        lvds: Some([0, 1, 0]),
        others: Vec::new(),
        phase_shifter: 0,
        device: None,
        antennas: Some(Antennas { tx: places(radar, &radar.tx), rx: places(radar, &radar.rx) }),
    })
}
