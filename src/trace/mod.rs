//! Waves through the scene: beams for what is smooth (`beams` and the kernels that clip them, `windows` for
//! a radar amid a scene), rays for closest hits and for the grids that beams are checked against (`launch`,
//! `upload`), and the echoes that come out.

pub mod air;
pub mod beam_ahead;
pub mod beam_clip;
pub mod beams;
pub mod closest;
pub mod cpu;
pub mod launch;
pub mod scan;
pub mod upload;
pub mod windows;

use glam::DVec3;
use num_complex::Complex64;

/// Longest chain of facets that is kept.
pub const MAX_BOUNCES: usize = 8;

/// Which bounces radiate to the receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Convention {
    /// The physical-optics current of every bounce radiates (default).
    Every,
    /// Only the bounce from which the ray leaves the scene.
    Last,
}

/// One echo, seen from the radar's phase centre, at the frame time. The received complex amplitude
/// in sqrt(W) of a channel is
/// sqrt(Pt) (lambda / 4 pi) sqrt(Gt Gr) e_rx^T spread e_tx exp(-j k path_length) (CONVENTIONS eq. 9).
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// Radar to first scatterer ... last scatterer to radar.
    pub path_length_m: f64,
    /// Its time derivative; range rate is half of it, positive receding.
    pub path_rate_mps: f64,
    /// Its second and third derivatives, m/s² and m/s³, such that the path is right in the middle, at the start and at the end of
    /// the frame (CONVENTIONS eq. 141).
    pub path_bend: [f64; 2],
    /// Unit vector to the first scatterer, sensor frame; and the distance to it.
    pub departure: DVec3,
    pub first_range_m: f64,
    /// Unit vector to the last scatterer, sensor frame; and the distance to it.
    pub arrival: DVec3,
    pub last_range_m: f64,
    /// S[rx][tx] / (R_t R_r) in 1/m, bases (V, H) of `arrival` and `departure`; index 0 is V. R_t is
    /// the unfolded length to the last scatterer, R_r = last_range_m.
    pub spread: [[Complex64; 2]; 2],
    /// Object ids in the order met; zero after the last.
    pub chain: [u32; MAX_BOUNCES],
    pub bounces: u8,
}

impl Return {
    pub fn range_m(&self) -> f64 {
        0.5 * self.path_length_m
    }
    pub fn range_rate_mps(&self) -> f64 {
        0.5 * self.path_rate_mps
    }
    /// Whether the path's length stays as it is.
    pub fn is_still(&self) -> bool {
        self.path_rate_mps == 0.0 && self.path_bend == [0.0; 2]
    }
    /// The object that scattered last.
    pub fn object_id(&self) -> u32 {
        self.chain[(self.bounces as usize).saturating_sub(1)]
    }
}

/// Largest entry of the matrix, in amplitude (1/m).
pub fn strength(r: &Return) -> f64 {
    r.spread.iter().flatten().map(|z| z.norm_sqr()).fold(0.0, f64::max).sqrt()
}

/// Drops the returns below `floor` times the strongest, in amplitude.
pub fn drop_weak(returns: &mut Vec<Return>, floor: f64) {
    let strongest = returns.iter().map(strength).fold(0.0, f64::max);
    returns.retain(|r| strength(r) > floor * strongest);
}

/// All echoes of one frame, in a fixed order (the same bytes whatever the number of threads).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Returns {
    pub returns: Vec<Return>,
    /// Samples of diffuse surfaces among them, before weak ones were dropped.
    pub rays: u64,
}

/// What to follow and what to keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceOptions {
    /// Facets met by one ray, 1..=MAX_BOUNCES.
    pub bounces: usize,
    pub convention: Convention,
    /// Returns weaker than this share of the frame's strongest (in amplitude) are not kept.
    pub amplitude_floor: f64,
    /// Echoes of smooth surfaces below this (1/m) are left out, and mostly not worked out.
    pub least: f64,
    /// Error to allow in the coherent sum of what a smooth surface radiates, dB.
    pub accuracy_db: f64,
    /// Echoes are good over this band around the carrier.
    pub bandwidth_hz: f64,
    /// Ways back over a plane that is large beside the body before it are the reciprocals of the ways out over it; false follows
    /// beams there too (CONVENTIONS eq. 65).
    pub images: bool,
    /// Samples of the diffuse echo of all rough surfaces, about, and as many of rain.
    pub rays: u64,
    /// Of the scatterers on rough surfaces, which are the same in all frames, and of rain.
    pub seed: u64,
    pub frame: u32,
    /// How far the radar is off the straight way of its velocity, `Geometry::reach_s` before and after, m (world).
    pub radar_sway_m: [DVec3; 2],
    /// None: takes nothing away.
    pub air: Option<air::Air>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            bounces: 3,
            convention: Convention::Every,
            amplitude_floor: 1e-8,
            least: 0.0,
            accuracy_db: 0.2,
            bandwidth_hz: 1e9,
            images: true,
            rays: 100_000,
            seed: 0,
            frame: 0,
            radar_sway_m: [DVec3::ZERO; 2],
            air: None,
        }
    }
}
