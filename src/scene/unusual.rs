//! Values of radars and scenarios that are allowed and seldom meant: a forgotten power of ten, millimetres for metres, frames that overlap.
//! Each gives one line with key, value and what is usual; nothing is changed.

use super::radar::{Pattern, Radar};
use super::scenario::Scenario;
use super::waveform::Waveform;

/// A value, its key, and the range in which such values are.
struct Value {
    key: &'static str,
    value: f64,
    usual: (f64, f64),
    unit: &'static str,
}

/// What of a radar is seldom meant, one line for each key.
pub fn of_radar(radar: &Radar) -> Vec<String> {
    let value = |key, value, usual, unit| Value { key, value, usual, unit };
    let period_s = radar.chirp_period_s();
    let mut values = vec![
        value("receiver.sample_rate_hz", radar.sample_rate_hz, (1e5, 1e11), "Hz"),
        value("transmitter.power_dbm", radar.tx_power_dbm, (-40.0, 60.0), "dBm"),
        value("waveform.chirp_period_s", period_s, (1e-7, 0.1), "s"),
        value("tx, rx position", widest_m(radar), (0.0, usual_aperture_m(radar)), "m between antennas"),
        value(
            "mounting.position_m",
            radar.mounting.translation_m.abs().max_element(),
            (0.0, 100.0),
            "m from the vehicle's origin",
        ),
    ];
    for antenna in radar.tx.iter().chain(&radar.rx) {
        values.push(value("antenna gain_dbi", antenna.gain_dbi, (-30.0, 50.0), "dBi"));
    }
    if let Waveform::Fmcw(slopes) = &radar.waveform {
        for ramp in &slopes.ramps {
            values.push(value("waveform.bandwidth_hz", ramp.bandwidth_hz.abs(), (1e6, 1e10), "Hz"));
            values.push(value("waveform.ramp_time_s", ramp.time_s, (1e-7, 0.1), "s"));
        }
    }
    let mut lines = Vec::new();
    let mut seen: Vec<&str> = Vec::new();
    for v in values {
        let (low, high) = v.usual;
        if (low..=high).contains(&v.value) || seen.contains(&v.key) {
            continue;
        }
        seen.push(v.key);
        // A long ramp makes a long chirp: one line for the two.
        if v.key == "waveform.ramp_time_s" && seen.contains(&"waveform.chirp_period_s") {
            continue;
        }
        let usual = match low {
            0.0 => format!("up to {}", plain(high)),
            _ => format!("{} to {}", plain(low), plain(high)),
        };
        lines.push(format!(
            "radar '{}': {} is {} {}; usual is {usual}",
            radar.name,
            v.key,
            plain(v.value),
            v.unit
        ));
    }
    lines.extend(narrow_table(radar));
    lines
}

/// Antenna tables that end before ±80° of azimuth: beyond, the gain at their edge holds.
fn narrow_table(radar: &Radar) -> Option<String> {
    let mut ends = radar.tx.iter().chain(&radar.rx).filter_map(|a| match &a.pattern {
        Pattern::Table { azimuth_rad, .. } => {
            Some([azimuth_rad.first()?.to_degrees(), azimuth_rad.last()?.to_degrees()])
        }
        _ => None,
    });
    let [low, high] = ends.find(|[a, b]| *a > -80.0 || *b < 80.0)?;
    Some(format!(
        "radar '{}': the antenna's table has azimuths from {} to {} degrees; beyond them the gain of its edge applies; usual is -90 to 90 or more",
        radar.name,
        plain(low),
        plain(high)
    ))
}

/// What of a scenario is seldom meant: its radars' values, and frames that begin before the one before them ends.
pub fn of_scenario<E>(scenario: &Scenario<E>) -> Vec<String> {
    let mut lines: Vec<String> = scenario.radars.iter().flat_map(of_radar).collect();
    let interval_s = scenario.frames.interval_s;
    for radar in &scenario.radars {
        let time_s = radar.frame_time_s();
        if scenario.frames.count > 1 && interval_s < time_s * (1.0 - 1e-9) {
            lines.push(format!(
                "radar '{}': its frames overlap: frames.interval_s is {} s and a frame takes {} s; usual is an interval longer than the frame",
                radar.name,
                plain(interval_s),
                plain(time_s)
            ));
        }
    }
    lines
}

/// The largest distance between two antennas, m.
fn widest_m(radar: &Radar) -> f64 {
    let all: Vec<_> = radar.tx.iter().chain(&radar.rx).map(|a| a.position_m).collect();
    all.iter().enumerate().flat_map(|(i, a)| all[..i].iter().map(|b| a.distance(*b))).fold(0.0, f64::max)
}

/// Arrays of vehicles are up to half a metre wide, and at low frequencies up to ten wavelengths.
fn usual_aperture_m(radar: &Radar) -> f64 {
    (10.0 * radar.wavelength_m()).max(1.0)
}

/// A number with up to four digits.
fn plain(x: f64) -> String {
    if x == 0.0 || (1e-3..1e5).contains(&x.abs()) {
        let digits = 3 - x.abs().max(1e-3).log10().floor() as i32;
        let scale = 10f64.powi(digits);
        return format!("{}", (x * scale).round() / scale);
    }
    let text = format!("{x:.3e}");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            format!("{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
        }
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::radar_toml::{PRESETS, preset};
    use glam::DVec3;

    #[test]
    fn presets_are_usual() {
        for (name, _) in PRESETS {
            assert_eq!(of_radar(&preset(name).unwrap()), Vec::<String>::new(), "{name}");
        }
    }

    #[test]
    fn each_value_that_is_seldom_meant_gives_one_line() {
        let demo = preset("demo77").unwrap();
        let changed = |change: &dyn Fn(&mut Radar)| {
            let mut radar = demo.clone();
            change(&mut radar);
            let lines = of_radar(&radar);
            assert_eq!(lines.len(), 1, "{lines:?}");
            lines[0].clone()
        };
        let ramp = |radar: &mut Radar, bandwidth_hz: f64| {
            let Waveform::Fmcw(slopes) = &mut radar.waveform else { panic!("demo77 has ramps") };
            slopes.ramps[0].bandwidth_hz = bandwidth_hz;
        };
        let line = changed(&|r| ramp(r, 324.0));
        assert_eq!(line, "radar 'demo77': waveform.bandwidth_hz is 324 Hz; usual is 1e6 to 1e10");
        let line = changed(&|r| r.rx[0].position_m = DVec3::new(0.0, 8.0, 0.0));
        assert!(line.contains("tx, rx position is 8") && line.contains("usual is up to 1"), "{line}");
        assert!(changed(&|r| r.sample_rate_hz = 12.5).contains("12.5 Hz"));
        assert!(changed(&|r| r.mounting.translation_m.x = 500.0).contains("500 m from"));
        assert!(changed(&|r| r.tx_power_dbm = -100.0).contains("-100 dBm"));
        assert!(changed(&|r| r.tx[0].gain_dbi = 100.0).contains("antenna gain_dbi is 100 dBi"));
        let table = |to_rad: f64| Pattern::Table {
            azimuth_rad: vec![-to_rad, 0.0, to_rad],
            elevation_rad: vec![0.0],
            gain_db: vec![-3.0, 0.0, -3.0],
        };
        assert!(changed(&|r| r.rx[0].pattern = table(0.35)).contains("from -20.05 to 20.05 degrees"));
        let mut wide = demo.clone();
        wide.rx[0].pattern = table(1.6);
        assert_eq!(of_radar(&wide), Vec::<String>::new());
    }

    #[test]
    fn numbers_are_short() {
        for (x, text) in [
            (324.0, "324"),
            (8.00123, "8.001"),
            (0.0, "0"),
            (12345.6, "12350"),
            (3.24e8, "3.24e8"),
            (1e-7, "1e-7"),
        ] {
            assert_eq!(plain(x), text);
        }
    }
}
