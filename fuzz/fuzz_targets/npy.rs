//! NumPy arrays: header and contents.
#![no_main]
mod check;

use catseye::formats::npy;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = check::file("a.npy", bytes);
    check::read(npy::read_header(&path));
    check::read(npy::read_complex32(&path));
    check::read(npy::read_f32(&path));
});
