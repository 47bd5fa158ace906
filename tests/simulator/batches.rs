//! Frames that share submissions: few submissions, and the bytes of frames that are made singly.

use catseye::base::control::Control;
use catseye::base::error::Error;
use catseye::dsp::RangeDoppler;
use catseye::engine::{Engine, Extent, FrameInput, MadeFrame};
use catseye::gpu::GpuCounts;
use catseye::gpu::compare::opened_for_tests;
use catseye::road::site::Site;
use catseye::scene::radar::{AngleMethod, Sources};
use catseye::scene::scenario;
use catseye::simulate::{Frame, Prepared, TracedFrame};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A drive past guard rails.
fn site() -> Site {
    let text = "name = \"steady\"\nseed = 3\nradar = \"recipes/small_radar.toml\"\n\
                [scene]\nroad = \"road/road_model_straight.toml\"\n\
                [ego]\nposition_m = [2, -1.75, 0]\nspeed_mps = 12\n[trace]\nbounces = 2\nfacets = 0";
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/s.toml");
    Site::new(&scenario::parse(&place, text).unwrap()).unwrap()
}

/// Beams are followed on the host: what is counted here is what comes after them.
fn opened() -> Engine {
    Engine::Gpu(Box::new(opened_for_tests().with_tracing_on_host(true)))
}

fn used<T>(engine: &Engine, work: impl FnOnce() -> T) -> (T, GpuCounts) {
    let before = engine.device_counts().unwrap();
    let result = work();
    (result, engine.device_counts().unwrap().since(&before))
}

/// Echoes of some frames, which 64 frames then take in turn.
fn received(site: &Site, engine: &Engine) -> Vec<TracedFrame> {
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap();
    (0..8).map(|index| prepared.echoes(engine, 0, index).unwrap()).collect()
}

fn inputs<'a>(site: &'a Site, received: &'a [TracedFrame]) -> Vec<FrameInput<'a>> {
    let input = |frame: u32| FrameInput {
        radar: &site.scenario.radars[0],
        echoes: &received[frame as usize % received.len()].echoes,
        interference: &[],
        seed: 5,
        frame,
        extent: Extent { samples: frame.is_multiple_of(3), ..Extent::CELLS },
    };
    (0..64).map(input).collect()
}

fn content(made: &MadeFrame) -> (&Option<catseye::engine::AnyCube>, &Vec<RangeDoppler<f64>>) {
    (&made.cube, &made.maps)
}

/// Frames of one submission have the bytes of frames made singly, and of any other number together.
#[test]
fn frames_of_one_submission_are_those_of_many() {
    let (site, engine) = (site(), opened());
    let received = received(&site, &engine);
    let inputs = inputs(&site, &received);
    let few = &inputs[..12];
    let (singly, counts) = used(&engine, || -> Vec<MadeFrame> {
        few.iter().map(|i| engine.frame(i, Control::default()).unwrap()).collect()
    });
    assert_eq!(counts.submits, 12);
    assert!(singly.iter().any(|made| !made.maps[0].cells.is_empty()));
    for (inputs, together, most) in [(few, 3, 4), (&inputs[..], 64, 2)] {
        let (made, counts) = used(&engine, || -> Vec<MadeFrame> {
            let of = |some: &[FrameInput<'_>]| engine.frames(some, Control::default());
            inputs.chunks(together).flat_map(of).map(Result::unwrap).collect()
        });
        assert!(counts.submits <= most, "{counts:?}");
        assert_eq!(made.len(), inputs.len());
        for (i, (a, b)) in made.iter().zip(&singly).enumerate() {
            assert!(content(a) == content(b) && a.echo_summary == b.echo_summary, "frame {i} of {together}");
            assert_eq!(a.cube.is_some(), i.is_multiple_of(3));
        }
    }
    // The same buffers and bind groups serve again.
    let counts = used(&engine, || engine.frames(&inputs, Control::default())).1;
    assert_eq!((counts.buffers, counts.bind_groups), (0, 0), "{counts:?}");
}

/// Each further frame of a submission takes the memory of what goes to the device and comes back, and no more: the rest it shares with
/// those before it.
#[test]
fn frames_of_a_submission_share_their_memory() {
    let site = site();
    let received = received(&site, &Engine::Gpu(Box::new(opened_for_tests())));
    let inputs = inputs(&site, &received);
    let of = |count: usize| {
        let engine = Engine::Gpu(Box::new(opened_for_tests()));
        let made = used(&engine, || engine.frames(&inputs[..count], Control::default()));
        assert!(made.0.iter().all(Result::is_ok) && made.1.submits == 1, "{:?}", made.1);
        made.1
    };
    let (few, many) = (of(4), of(64));
    let growth = (many.buffer_bytes - few.buffer_bytes) as f64;
    let moved = (many.uploaded_bytes + many.read_bytes - few.uploaded_bytes - few.read_bytes) as f64;
    // Uploads lie twice on the device; buffers are up to an eighth larger than what they hold.
    assert!(growth < 2.0 * moved, "{growth} bytes for {moved} that are moved: {few:?} {many:?}");
}

/// Where a batch would be too large it is cut, and frames that need the host stand between others.
#[test]
fn batches_are_bounded_and_leave_others_out() {
    let site = site();
    let gpu = opened_for_tests().with_binding_limit(1 << 20);
    let engine = Engine::Gpu(Box::new(gpu.with_tracing_on_host(true)));
    assert_eq!(engine.batch_bytes(), 8 << 20);
    let received = received(&site, &engine);
    let mut inputs = inputs(&site, &received);
    inputs.truncate(12);
    let mut special = site.scenario.radars[0].clone();
    special.front_end.aperture_jitter_rms_s = Some(1e-12);
    for i in [0, 5, 6] {
        inputs[i].radar = &special;
    }
    let singly: Vec<MadeFrame> =
        inputs.iter().map(|i| engine.frame(i, Control::default()).unwrap()).collect();
    let (made, counts) = used(&engine, || engine.frames(&inputs, Control::default()));
    assert!(counts.submits > 4, "{counts:?}");
    for (a, b) in made.into_iter().zip(&singly) {
        assert!(content(&a.unwrap()) == content(b));
    }
}

/// An echo that is not finite fails the frame that it belongs to; those before it are there, those behind it are not made.
#[test]
fn an_error_is_that_of_its_frame() {
    let (site, engine) = (site(), opened());
    let received = received(&site, &engine);
    let mut inputs = inputs(&site, &received);
    inputs.truncate(6);
    let mut broken = site.scenario.radars[0].clone();
    broken.processing.cfar.pfa = 2.0;
    inputs[4].radar = &broken;
    let alone = engine.frame(&inputs[4], Control::default()).unwrap_err();
    let made = engine.frames(&inputs, Control::default());
    assert_eq!(made.len(), 5);
    assert!(made[..4].iter().all(Result::is_ok));
    assert_eq!(made[4].as_ref().unwrap_err().to_string(), alone.to_string());
}

/// A batch of 64 frames of a drive takes few submissions, and its frames are those that are made singly, whatever the size of the batch;
/// whether their beams are followed on the host or on the device.
#[test]
fn a_batch_of_64_frames_waits_rarely() {
    for (engine, singly) in [(opened(), 2), (Engine::Gpu(Box::new(opened_for_tests())), 8)] {
        waits_rarely(&engine, singly);
    }
}

/// `most` is how many submissions a frame may take alone.
fn waits_rarely(engine: &Engine, most: u64) {
    let site = site();
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap();
    let wanted: Vec<(usize, u32)> = (0..64).map(|index| (0, index)).collect();
    let all = |wanted: &[(usize, u32)], together: usize| -> Vec<Frame> {
        let made = wanted.chunks(together).flat_map(|some| prepared.frames(engine, some, Control::default()));
        made.map(Result::unwrap).collect()
    };
    let (many, counts) = used(engine, || all(&wanted, 64));
    let a_frame = counts.submits as f64 / 64.0;
    println!("{:?} traces: {a_frame} submissions a frame", engine.tracing());
    assert!(a_frame <= 0.2, "{a_frame} submissions a frame: {counts:?}");
    // Made one by one, every sixteenth and the two after it.
    let some: Vec<(usize, u32)> = wanted.iter().filter(|(_, index)| index % 16 < 3).copied().collect();
    let (singly, counts) = used(engine, || all(&some, 1));
    println!("alone: {} submissions", counts.submits as f64 / some.len() as f64);
    assert!(counts.submits <= some.len() as u64 * most, "{counts:?}");
    assert!(singly.iter().all(|f| !f.points.is_empty()));
    let same: Vec<Frame> = many.into_iter().filter(|f| f.index % 16 < 3).collect();
    for frames in [same, all(&some, 3)] {
        assert_eq!(frames.len(), singly.len());
        for (a, b) in frames.iter().zip(&singly) {
            assert_eq!((a.index, &a.points, a.echo_summary), (b.index, &b.points, b.echo_summary));
            assert!(a.maps == b.maps && a.cube == b.cube && a.echoes.list == b.echoes.list, "{}", a.index);
        }
    }
}

/// Radars of several kinds in one batch: other methods for angles, ramps of two slopes, a front end that needs the host.
#[test]
fn mixed_radars_share_a_batch() {
    let site = {
        let mut site = site();
        let first = &mut site.scenario.radars[0];
        first.name = "bartlett".into();
        let mut music = first.clone();
        music.name = "music".into();
        music.processing.angle.method = AngleMethod::Music;
        music.processing.angle.sources = Sources::Given(1);
        let mut hosted = first.clone();
        hosted.name = "hosted".into();
        hosted.front_end.aperture_jitter_rms_s = Some(1e-12);
        site.scenario.radars.extend([music, hosted]);
        site
    };
    let engine = opened();
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap().without_cubes();
    let wanted: Vec<(usize, u32)> =
        (0..4).flat_map(|index| (0..3).map(move |which| (which, index))).collect();
    let together = prepared.frames(&engine, &wanted, Control::default());
    assert_eq!(together.len(), wanted.len());
    for ((which, index), made) in wanted.into_iter().zip(together) {
        let made = made.unwrap();
        let alone = prepared.frame(&engine, which, index, Control::default()).unwrap();
        assert!(!alone.points.is_empty() && made.cube.is_none());
        assert_eq!((made.radar, made.index, &made.points), (which, index, &alone.points));
        assert!(made.maps == alone.maps);
    }
    // What is cancelled makes nothing, and says so.
    let cancel = AtomicBool::new(true);
    let control = Control { progress: None, cancel: Some(&cancel) };
    let made = prepared.frames(&engine, &[(0, 0), (1, 0)], control);
    assert!(matches!(&made[..], [Err(Error::Interrupted(_))]));
}

/// Frames with more detected cells than there was room for fetch them in one further submission together.
#[test]
fn crowded_frames_share_their_second_submission() {
    let (site, engine) = (site(), opened());
    let received = received(&site, &engine);
    let mut inputs = inputs(&site, &received);
    inputs.truncate(5);
    let mut crowded = site.scenario.radars[0].clone();
    crowded.processing.cfar.pfa = 0.6;
    (crowded.chirps, crowded.processing.doppler_fft) = (512, 512);
    for i in [1, 3, 4] {
        inputs[i].radar = &crowded;
    }
    let (made, counts) = used(&engine, || engine.frames(&inputs, Control::default()));
    assert_eq!((made.len(), counts.submits), (5, 2));
    for (made, input) in made.into_iter().zip(&inputs) {
        let (made, alone) = (made.unwrap(), engine.frame(input, Control::default()).unwrap());
        assert!(content(&made) == content(&alone));
        assert_eq!(made.maps[0].cells.len() > 4096, std::ptr::eq(input.radar, &crowded));
    }
}
