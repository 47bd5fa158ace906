//! A configuration of Texas Instruments' devices and the recording that it describes: text, a zero byte, samples.
#![no_main]
mod check;

use catseye_io::{ti_bin, ti_cfg};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let at = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    let Ok(text) = std::str::from_utf8(&bytes[..at]) else { return };
    let Some(radar) = check::read(ti_cfg::TiRadar::parse("fuzz.cfg", text)) else { return };
    check::read(radar.to_radar_toml("fuzz", ti_cfg::Board::default()));
    let path = check::file("a.bin", bytes.get(at + 1..).unwrap_or(&[]));
    let Some(mut reader) = check::read(ti_bin::open(&path, &radar, &ti_bin::BinOptions::default())) else { return };
    for frame in 0..reader.frames().min(2) {
        let channels = reader.shape()[1];
        check::read(reader.channels::<f32>(frame, 0..channels));
    }
});
