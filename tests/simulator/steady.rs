//! What a frame like the one before it asks of the device.

use catseye::base::control::Control;
use catseye::engine::Engine;
use catseye::gpu::GpuCounts;
use catseye::gpu::compare::opened_for_tests;
use catseye::road::site::Site;
use catseye::scene::scenario;
use catseye::simulate::{Frame, Prepared};
use std::path::Path;

/// A frame of a drive past guard rails takes two submissions, one up to the detected cells and one for their directions. Made again after
/// others it allocates neither buffers nor bind groups, has the same bytes, and leaves its samples on the device unless they are asked
/// for.
#[test]
fn a_steady_frame_allocates_nothing() {
    let text = "name = \"steady\"\nseed = 3\nradar = \"recipes/small_radar.toml\"\n\
                [scene]\nroad = \"road/road_model_straight.toml\"\n\
                [ego]\nposition_m = [2, -1.75, 0]\nspeed_mps = 12\n[trace]\nbounces = 2\nfacets = 0";
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/s.toml");
    let site = Site::new(&scenario::parse(&place, text).unwrap()).unwrap();
    // Two submissions are what comes after the beams, which the host follows here.
    let engine = Engine::Gpu(Box::new(opened_for_tests().with_tracing_on_host(true)));
    let Engine::Gpu(gpu) = &engine else { panic!("a device was named") };
    let all = Prepared::new(&site.scenario, &site.scene).unwrap();
    let made = |prepared: &Prepared<'_>, index: u32| -> (Frame, GpuCounts) {
        let before = gpu.counts();
        let frame = prepared.frame(&engine, 0, index, Control::default()).unwrap();
        (frame, gpu.counts().since(&before))
    };
    let (first, counts) = made(&all, 1);
    assert!(!first.points.is_empty() && counts.buffers > 10 && counts.bind_groups > 5, "{counts:?}");
    // Other sizes come between: memory that is used again holds what they left.
    for index in [30, 7] {
        made(&all, index);
    }
    for _ in 0..3 {
        let (again, counts) = made(&all, 1);
        assert_eq!((counts.submits, counts.buffers, counts.bind_groups), (2, 0, 0), "{counts:?}");
        assert_eq!((&again.maps, &again.points), (&first.maps, &first.points));
        assert_eq!(again.cube, first.cube);
    }
    let with = made(&all, 1).1;
    let (bare, without) = made(&Prepared::new(&site.scenario, &site.scene).unwrap().without_cubes(), 1);
    assert!(bare.cube.is_none() && bare.samples().is_err());
    assert_eq!((&bare.maps, &bare.points), (&first.maps, &first.points));
    let radar = &site.scenario.radars[0];
    let cube_bytes = 8 * (radar.rows() * radar.channels() * radar.samples) as u64;
    assert_eq!(with.read_bytes - without.read_bytes, cube_bytes);
}
