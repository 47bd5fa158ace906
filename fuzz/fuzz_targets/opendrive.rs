//! Roads of OpenDRIVE files, and places along them.
#![no_main]
mod check;

use catseye::road::opendrive;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    check::read(opendrive::parse(Path::new("fuzz.xodr"), text));
});
