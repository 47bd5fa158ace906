//! The channels that an estimator of angle works on: the whole array, or its subarrays and their mirror
//! images (CONVENTIONS eq. 92).

use super::doa_beamform::Grid;
use super::doa_covariance::{subarray_snapshots, subarrays, with_backward};
use super::doa_manifold::{Lattice, Manifold};
use super::doa_options::{Method, Options};
use super::doa_spectrum::Steering;
use crate::base::error::{BadInput, Result};
use num_complex::Complex64;

/// Channels that a method works on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct View {
    /// Elements of each subarray; one set for the whole array.
    pub sets: Vec<Vec<usize>>,
    /// Divides the data, so that an ideal array is left.
    pub equaliser: Option<Vec<Complex64>>,
    pub mirror: Option<Vec<usize>>,
    pub manifold: Manifold,
    pub steering: Steering,
    /// The lattice of one subarray.
    pub lattice: Option<Lattice>,
}

impl View {
    pub fn whole(manifold: &Manifold, grid: &Grid, o: &Options, lattice: Option<&Lattice>) -> Result<View> {
        let gridless = o.method.is_gridless();
        let fb = o.forward_backward == Some(true) && o.method.averages_subarrays();
        if let (true, Some(l)) = (gridless, lattice) {
            return View::smoothed(manifold, grid, &Options { forward_backward: Some(fb), ..*o }, l, l.size);
        }
        let mirror = if fb {
            Some(manifold.mirrored().filter(|_| manifold.range_m().is_none()).ok_or_else(|| {
                BadInput::new("forward-backward averaging needs a point-symmetric array and distant sources")
                    .key("forward_backward")
                    .value(true)
                    .remedy("leave it out")
            })?)
        } else {
            None
        };
        let (manifold, equaliser) =
            if fb { (manifold.ideal(), equaliser(manifold)) } else { (manifold.clone(), None) };
        let steering = Steering::new(&manifold, grid);
        let sets = vec![(0..manifold.channels()).collect()];
        Ok(View { sets, equaliser, mirror, manifold, steering, lattice: None })
    }

    pub fn smoothed(
        manifold: &Manifold,
        grid: &Grid,
        o: &Options,
        lattice: &Lattice,
        size: [usize; 2],
    ) -> Result<View> {
        let sets = subarrays(lattice, size)?;
        let elements = sets[0].len();
        let fb = o.forward_backward.unwrap_or(true);
        let part = manifold.ideal().subset(&sets[0]);
        let steering = Steering::new(&part, grid);
        let steps = lattice.step_m;
        let channel = (0..elements).collect();
        Ok(View {
            sets,
            equaliser: equaliser(manifold),
            mirror: fb.then(|| (0..elements).rev().collect()),
            manifold: part,
            steering,
            lattice: Some(Lattice { size, step_m: steps, channel }),
        })
    }

    /// Number of looks that cells of so many snapshots give.
    pub fn count(&self, snapshots: usize) -> usize {
        snapshots * self.sets.len() * (1 + usize::from(self.mirror.is_some()))
    }

    /// Number of sources that a method can tell apart on these elements.
    pub fn most_sources(&self, method: Method) -> usize {
        let m = self.manifold.channels();
        match (method, &self.lattice) {
            (Method::Esprit, Some(l)) if l.size[0] > 1 && l.size[1] > 1 => {
                let [rows, cols] = l.size;
                ((rows - 1) * cols).min(rows * (cols - 1))
            }
            (Method::Bartlett, _) => usize::MAX,
            // As many sources as channels explain everything.
            _ => m.saturating_sub(1).max(1),
        }
    }

    /// Snapshots of all subarrays, forward and backward, `[look, element]`.
    pub fn looks(&self, x: &[Complex64], channels: usize) -> Vec<Complex64> {
        let even: Vec<Complex64> = match &self.equaliser {
            Some(g) => x.iter().enumerate().map(|(i, z)| z / g[i % channels]).collect(),
            None => x.to_vec(),
        };
        let parts = subarray_snapshots(&even, channels, &self.sets);
        match &self.mirror {
            Some(m) => with_backward(&parts, self.manifold.channels(), m),
            None => parts,
        }
    }
}

/// None for an array that is ideal already.
fn equaliser(manifold: &Manifold) -> Option<Vec<Complex64>> {
    let g = manifold.mean_gains();
    g.iter().any(|g| *g != Complex64::ONE).then_some(g)
}
