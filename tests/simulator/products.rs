//! Only what is kept is made: the stages that run for each combination of the keys of `[output]`.

use catseye::base::control::Control;
use catseye::engine::{Engine, Precision, Stage};
use catseye::gpu::compare::opened_for_tests;
use catseye::road::site::Site;
use catseye::scene::scenario::{self, Output};
use catseye::simulate::products::{Product, Products};
use catseye::simulate::{Frame, Prepared, Wanted, frames};
use std::path::Path;

/// A scene with a car-sized point before a small radar.
fn site() -> Site {
    let radar =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/recipes/tiny_radar.toml"))
            .unwrap();
    let text = "name = \"kept\"\n[[point]]\nposition_m = [12, 1, 0.5]\nrcs_dbsm = 10\nclass = \"car\"\n\
                [frames]\ncount = 2\ninterval_s = 0.1\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("radar.toml"), radar).unwrap();
    let text = format!("radar = \"radar.toml\"\n{text}");
    Site::new(&scenario::parse(&folder.path().join("s.toml"), &text).unwrap()).unwrap()
}

/// The output of which the bits of `chosen` are true, in the order of the table of products.
fn output(chosen: u32) -> Output {
    let on = |product: Product| chosen >> product as u32 & 1 == 1;
    Output {
        adc: on(Product::Samples),
        range_doppler: on(Product::Map),
        cfar_threshold: on(Product::CfarThreshold),
        angle_spectra: on(Product::AngleSpectra),
        points: on(Product::Points),
        returns: on(Product::Returns),
        return_places: on(Product::ReturnPlaces),
        echoes: on(Product::Echoes),
        truth: on(Product::Truth),
        masks: on(Product::Masks),
        lidar: on(Product::Lidar),
        plots: on(Product::Plots),
        ..Output::default()
    }
}

/// The last stage of each product in the order of [`output`], written by hand: 0 for none, 1 for the trace, up to 6 for labels.
const LAST: [usize; 12] = [2, 3, 3, 5, 6, 1, 1, 1, 1, 5, 0, 6];

/// Whether the frame ran each stage up to the last that one of the chosen products needs once and none after it, and holds what that
/// gives and nothing else.
fn assert_made(frame: &Frame, chosen: u32) {
    let has = |product: Product| chosen >> product as u32 & 1 == 1;
    let last = (0..LAST.len()).filter(|i| chosen >> i & 1 == 1).map(|i| LAST[i]).max().unwrap_or(0);
    for (i, stage) in Stage::ALL.into_iter().enumerate() {
        assert_eq!(frame.ran.of(stage), u32::from(i < last), "{stage:?} for {chosen:#b}");
    }
    assert_eq!(frame.cube.is_some(), has(Product::Samples), "{chosen:#b}");
    assert_eq!(frame.kept.is_some(), has(Product::Echoes), "{chosen:#b}");
    assert_eq!(!frame.echoes.list.is_empty(), last >= 1, "{chosen:#b}");
    assert_eq!(frame.maps.len(), usize::from(last >= 3), "{chosen:#b}");
    let detected = frame.maps.first().is_some_and(|map| !map.detection.mask.is_empty());
    assert_eq!(detected, last >= 4, "{chosen:#b}");
    assert_eq!(!frame.points.is_empty(), last >= 5, "{chosen:#b}");
    let labelled = frame.points.iter().any(|p| p.class == "car");
    assert_eq!(labelled, last >= 6, "{chosen:#b}");
}

/// All 4,096 combinations of what a run can keep of a frame, on the cpu engine.
#[test]
fn each_combination_runs_what_it_needs_and_nothing_else() {
    let site = site();
    let engine = Engine::Cpu(Precision::F32);
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap();
    let whole = prepared.frame(&engine, 0, 1, Control::default()).unwrap();
    let mut prepared = Some(prepared);
    for chosen in 0..1u32 << Product::TABLE.len() {
        let products = Products::of_output(&output(chosen));
        let made = prepared.take().unwrap().making(products);
        let frame = made.frame(&engine, 0, 1, Control::default()).unwrap();
        assert_made(&frame, chosen);
        // What is made is what a whole frame has.
        if frame.cube.is_some() {
            assert!(frame.cube == whole.cube, "{chosen:#b}");
        }
        if let Some(map) = frame.maps.first() {
            assert!(map.map == whole.maps[0].map, "{chosen:#b}");
        }
        if products.reaches(Stage::Labels) {
            assert_eq!(frame.points, whole.points, "{chosen:#b}");
        }
        prepared = Some(made);
    }
}

/// The same on a device, alone and in a batch, for one combination of each last stage.
#[test]
fn a_device_runs_what_is_needed_and_nothing_else() {
    let site = site();
    let engine = Engine::Gpu(Box::new(opened_for_tests()));
    for product in
        [Product::Lidar, Product::Returns, Product::Samples, Product::Map, Product::Masks, Product::Points]
    {
        let products = Products::default().with(product);
        let prepared = Prepared::new(&site.scenario, &site.scene).unwrap().making(products);
        let alone = prepared.frame(&engine, 0, 0, Control::default()).unwrap();
        assert_made(&alone, 1 << product as u32);
        let wanted: Vec<Wanted<'_, '_>> =
            (0..2).map(|index| Wanted { prepared: &prepared, which: 0, index }).collect();
        let together = frames(&engine, &wanted, Control::default());
        assert_eq!(together.len(), 2);
        for frame in together.into_iter().map(Result::unwrap) {
            assert_made(&frame, 1 << product as u32);
            if frame.index == 0 {
                assert!(frame.cube == alone.cube && frame.maps == alone.maps && frame.points == alone.points);
            }
        }
    }
}
