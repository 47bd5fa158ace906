//! Processing on the cpu, in f32 or f64.

pub mod cfar_ca;
pub mod cfar_os;
pub mod doa_beamform;
pub mod doa_spectrum;
pub mod fft;
pub mod lines;
pub mod peaks;
pub mod power;
pub mod snapshot;

use crate::adc::Cube;
use crate::dsp::fft::Transform;
use crate::dsp::{Detection, PowerMap, RangeDoppler, Real, Spectrum, cfar};
use crate::error::Result;
use crate::scene::radar::{Cfar, CfarKind, Radar};

/// From the cube to detected cells: windows, range and Doppler transform, power, CFAR, peaks,
/// snapshots. Errors: a cube that is not this radar's, bad settings, samples that are not finite.
pub fn process<T: Real>(cube: &Cube<T>, radar: &Radar) -> Result<(Spectrum<T>, RangeDoppler<T>)> {
    let transform = Transform::of_cube(cube, radar)?;
    let spectrum = fft::spectrum(cube, &transform);
    let mut map = power::power(&spectrum);
    if transform.bands > 1 {
        // Empty bands hold noise alone: what a transmitter sends reads its power.
        let share = T::of(transform.bands as f64 / radar.tx.len() as f64);
        map.data.iter_mut().for_each(|p| *p = *p * share);
    }
    let detection = detect(&map, &radar.processing.cfar, spectrum.channels)?;
    let cells = peaks::peaks(&map, &detection.mask);
    let snapshots = snapshot::snapshots(&spectrum, &cells);
    Ok((spectrum, RangeDoppler { map, detection, cells, snapshots }))
}

/// The detector that `cfar` names, on a map that is the mean over `channels` looks.
pub fn detect<T: Real>(map: &PowerMap<T>, cfar: &Cfar, channels: usize) -> Result<Detection<T>> {
    cfar::check_map(map)?;
    let columns = cfar::columns(cfar, channels, map.doppler_bins, map.range_bins)?;
    Ok(match cfar.kind {
        CfarKind::Ca => cfar_ca::cfar_ca(map, cfar, &columns),
        CfarKind::Os { .. } => cfar_os::cfar_os(map, cfar, &columns),
    })
}
