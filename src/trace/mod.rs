//! Waves through the scene: beams for what is smooth (`beams`, the kernels that clip them and their `clipper`,
//! `windows` for a radar amid a scene), rays for closest hits and for the grids that beams are checked against
//! (`launch`, `upload`), and the echoes that come out.
//!
//! A beam is a polygon of rays that share a source or its image (CONVENTIONS eq. 50), so that plane faces reflect it
//! without error and nothing is sampled. An [`Echo`] has the length and rate of its path (eq. 7), directions and path
//! gain (eq. 9), from which all channels and chirps of a frame follow. [`crate::engine::Engine::trace`] finds them.

pub mod air;
pub mod beam_ahead;
pub mod beam_clip;
pub mod beams;
pub mod clipper;
pub mod closest;
pub mod cpu;
pub mod echo;
pub mod launch;
pub mod line_ahead;
mod line_arrays;
pub mod line_gather;
pub mod line_shadow;
pub mod line_sides;
pub mod line_split;
pub mod line_tracer;
pub mod merge;
pub mod scan;
pub mod tracing;
pub mod upload;
pub mod view_ahead;
pub mod view_clipper;
pub mod view_gather;
pub mod view_hide;
pub mod view_target;
pub mod views;
pub mod windows;

use crate::base::convention::Convention;
pub use crate::base::convention::MAX_BOUNCES;
pub use echo::{Echo, Echoes, strength, strong};
use glam::DVec3;

/// What to follow and what to keep.
///
/// # Example
/// Multipath: over a conducting road a point has echoes of three lengths: straight out and back, over the road
/// once, and over the road out and back (the path over the road is as long as that to the point's mirror image).
///
/// ```
/// use catseye::base::frames::{Pose, Sensor, World};
/// use catseye::engine::{Engine, Precision};
/// use catseye::scene::{Material, Scene, Shape, radar_toml::preset};
/// use catseye::{geom::Geometry, road::objects::ground, trace::TraceOptions};
/// use glam::{DQuat, DVec2, DVec3};
///
/// let mut scene = Scene::default();
/// let metal = scene.material_index(&Material::pec());
/// let road = ground(DVec2::new(-5.0, -10.0), DVec2::new(60.0, 10.0), 0.0, metal);
/// scene.add_mesh("road", "road", road, Pose::IDENTITY);
/// let at = Pose::new(DQuat::IDENTITY, DVec3::new(30.0, 0.0, 1.0));
/// let post = scene.add_object("post", "post", Shape::Point { rcs_dbsm: 0.0 }, at, DVec3::ZERO);
/// let radar = preset("demo77")?;
/// let pose = Pose::<Sensor, World>::new(DQuat::IDENTITY, DVec3::Z * 0.5);
/// let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz)?;
/// let engine = Engine::open("cpu", Precision::F32)?;
/// let echoes = engine.trace(&geometry, &radar, &pose, DVec3::ZERO, &TraceOptions::default())?;
/// let (straight_m, over_road_m) = (30f64.hypot(0.5), 30f64.hypot(1.5));
/// for expected_m in [2.0 * straight_m, straight_m + over_road_m, 2.0 * over_road_m] {
///     let mut of_post = echoes.list.iter().filter(|e| e.chain.contains(&post));
///     assert!(of_post.any(|e| (e.path_length_m - expected_m).abs() < 1e-6), "{expected_m}");
/// }
/// # Ok::<(), catseye::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceOptions {
    /// Number of faces that one ray may meet, 1..=MAX_BOUNCES.
    pub bounces: usize,
    /// Number of bounces up to which engines follow beams further, until what one bounce more would bring is below the
    /// accuracy; up to `bounces` it does nothing. It needs `least_cut`.
    pub most_bounces: usize,
    /// Which bounces of a chain radiate.
    pub convention: Convention,
    /// Share of the frame's strongest echo, in amplitude, below which echoes are not kept.
    pub amplitude_floor: f64,
    /// Strength, 1/m, below which echoes of smooth surfaces are left out, and mostly not computed.
    pub least: f64,
    /// Return, 1/m, above which a beam that the limit of bounces ends is asked what one bounce more would bring
    /// ([`Echoes::cut`], CONVENTIONS eq. 68). None asks no beam.
    pub least_cut: Option<f64>,
    /// Error allowed in the coherent sum of what a smooth surface radiates, dB.
    pub accuracy_db: f64,
    /// Bandwidth around the carrier over which the echoes are good, Hz.
    pub bandwidth_hz: f64,
    /// Distance from the radar beyond which faces are left out, and hide nothing, m: half the length of the longest
    /// path that the receiver hears. All are kept where rough surfaces are sampled, whose squares share out all that is
    /// seen.
    pub reach_m: f64,
    /// Whether ways back over a plane that is large beside the body before it are taken as the reciprocals of the ways
    /// out over it; false follows beams there too (CONVENTIONS eq. 65).
    pub images: bool,
    /// Whether echoes of one place by one way are added up ([`merge`]).
    pub merge: bool,
    /// Whether echoes carry the places of all of their bounces ([`Echo::places_m`]); else those of the first and the last.
    pub places: bool,
    /// Approximate number of samples of the diffuse echo of all rough surfaces, and of rain.
    pub rays: u64,
    /// Seed of the scatterers on rough surfaces, which are the same in all frames, and of rain.
    pub seed: u64,
    /// Number of the frame, which selects the random numbers of diffuse samples.
    pub frame: u32,
    /// Deviation of the radar from the straight way of its velocity, `Geometry::reach_s` before and after, m (world).
    pub radar_sway_m: [DVec3; 2],
    /// Rate at which the radar turns, rad/s (world).
    pub radar_spin_rad_per_s: DVec3,
    /// The air, which takes away from the echoes; None takes nothing.
    pub air: Option<air::Air>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            bounces: 3,
            most_bounces: 0,
            convention: Convention::Every,
            amplitude_floor: 1e-8,
            least: 0.0,
            least_cut: None,
            accuracy_db: 0.2,
            bandwidth_hz: 1e9,
            reach_m: f64::INFINITY,
            images: true,
            merge: true,
            places: false,
            rays: 100_000,
            seed: 0,
            frame: 0,
            radar_sway_m: [DVec3::ZERO; 2],
            radar_spin_rad_per_s: DVec3::ZERO,
            air: None,
        }
    }
}
