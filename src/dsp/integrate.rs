//! Non-coherent integration: power maps of frames, or of groups of chirps of one frame (CONVENTIONS
//! eq. 87). Coherent integration is the Doppler transform itself.

use super::{PowerMap, Real};
use crate::adc::Cube;
use crate::base::error::{BadInput, Result};

/// Averages maps, each weighted by its looks (the channels it is the mean of), and adds up the looks: noise cells are
/// Gamma with that number, which the detector has to be given.
///
/// # Errors
/// Returns an error if there is no map, for maps of different sizes, or for a map of no look.
pub fn integrate<T: Real>(maps: &[(&PowerMap<T>, usize)]) -> Result<(PowerMap<T>, usize)> {
    let size = |m: &PowerMap<T>| [m.doppler_bins, m.range_bins, m.data.len()];
    let Some(((first, _), looks)) = maps.first().zip(maps.iter().map(|m| m.1).reduce(|a, b| a + b)) else {
        return Err(BadInput::new("there is no power map to integrate").key("maps").value(0).into());
    };
    for (map, looks) in maps {
        if size(map) != size(first) || *looks == 0 {
            return Err(BadInput::new("the power maps cannot be added")
                .key("[doppler bins, range bins, cells], looks")
                .value(format!("{:?}, {looks}", size(map)))
                .allowed(format!("{:?} and at least one look", size(first)))
                .into());
        }
    }
    let mut sums = vec![0.0; first.data.len()];
    for (map, looks) in maps {
        let weight = *looks as f64;
        for (s, p) in sums.iter_mut().zip(&map.data) {
            *s += weight * p.wide();
        }
    }
    let data = sums.into_iter().map(|s| T::of(s / looks as f64)).collect();
    Ok((PowerMap { doppler_bins: first.doppler_bins, range_bins: first.range_bins, data }, looks))
}

/// Splits the chirps of a cube into `groups` cubes of equally many, one after another, for [`integrate`]. Chirps that
/// remain are left out.
///
/// # Errors
/// Returns an error if there is no group, or more groups than chirps.
pub fn chirp_groups<T: Clone>(cube: &Cube<T>, groups: usize) -> Result<Vec<Cube<T>>> {
    if groups == 0 || groups > cube.chirps {
        return Err(BadInput::new("the chirps cannot be divided into this number of groups")
            .key("groups")
            .value(groups)
            .allowed(format!("1..={}", cube.chirps))
            .into());
    }
    let chirps = cube.chirps / groups;
    let part = chirps * cube.channels * cube.samples;
    Ok((0..groups)
        .map(|g| Cube {
            chirps,
            channels: cube.channels,
            samples: cube.samples,
            data: cube.data[g * part..(g + 1) * part].to_vec(),
        })
        .collect())
}
