//! Echoes of flat patches whose regions lines find, beside those of regions that polygons find, chain by chain.

use super::device_frames::drawn;
use catseye::base::units::{C0, wavenumber};
use catseye::geom::edge_table::EdgeTable;
use catseye::trace::TraceOptions;
use catseye::trace::beams::BeamOptions;
use catseye::trace::cpu::beams;
use catseye::trace::cpu::chains;
use catseye::trace::cpu::echoes::{ChainEchoes, Lit, echoes_by_chain};
use catseye::trace::windows::windows;
use catseye_papers::bench::frame::Frame;
use catseye_papers::bench::frame_of;
use num_complex::Complex64;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Relative amplitude that is 0.01 dB.
const HUNDREDTH_DB: f64 = 1.15e-3;

/// Fields at the middle and at the ends of the band, in all polarisations, by polygons and by lines, and numbers of echoes.
#[derive(Debug, Default, Clone)]
struct Fields {
    at: [[Complex64; 12]; 2],
    echoes: [usize; 2],
}

impl Fields {
    fn power(&self, which: usize) -> f64 {
        self.at[which].iter().map(|z| z.norm_sqr()).sum()
    }

    fn off(&self) -> f64 {
        self.at[0].iter().zip(&self.at[1]).map(|(a, b)| (a - b).norm_sqr()).sum()
    }
}

/// What is left of a comparison.
struct Agreement {
    /// Share of the power in chains that agree within 0.01 dB, phase included.
    agreeing: f64,
    /// Power of the differences over the power.
    off: f64,
    echoes: [usize; 2],
}

fn compare(name: &str, frame: &Frame, bounces: usize) -> Agreement {
    let geometry = frame.geometry(&frame.refined(frame.options.accuracy_db).unwrap()).unwrap();
    let faces = geometry.faces();
    let windows = windows(&frame.radar, &frame.pose);
    let options = TraceOptions { bounces, least: 0.0, ..frame.options.clone() };
    let beams =
        BeamOptions { images: options.images, ..BeamOptions::new(bounces, options.accuracy_db, false) };
    let clipped = beams::clip_windows(faces, &windows, &beams, None);
    let chains = chains::follow(faces, &EdgeTable::new(faces), &windows, &beams);
    let of = |lit| echoes_by_chain(&geometry, lit, &frame.pose, frame.ego_mps, &options);
    let lists: [Vec<ChainEchoes>; 2] = [of(Lit::Beams(&clipped)), of(Lit::Lines(&chains, &windows))];
    let half_band = TAU * 0.5 * options.bandwidth_hz / C0;
    let k = wavenumber(geometry.freq_hz);
    let mut all: BTreeMap<(Vec<u32>, bool), Fields> = BTreeMap::new();
    for (which, list) in lists.into_iter().enumerate() {
        for ChainEchoes { patches, over, list } in list {
            let fields = all.entry((patches, over)).or_default();
            fields.echoes[which] += list.len();
            for echo in list {
                for (tone, k) in [k - half_band, k, k + half_band].into_iter().enumerate() {
                    let turn = Complex64::cis(-k * echo.path_length_m);
                    for (i, gain) in echo.path_gain.as_flattened().iter().enumerate() {
                        fields.at[which][4 * tone + i] += gain * turn;
                    }
                }
            }
        }
    }
    let power: f64 = all.values().map(|f| f.power(0)).sum();
    let agrees = |f: &&Fields| f.off() <= HUNDREDTH_DB * HUNDREDTH_DB * f.power(0);
    let agreeing: f64 = all.values().filter(agrees).map(|f| f.power(0)).sum();
    let off: f64 = all.values().map(Fields::off).sum();
    let echoes = [0, 1].map(|which| all.values().map(|f| f.echoes[which]).sum::<usize>());
    println!(
        "{name}, {bounces} bounces: {} chains, {echoes:?} echoes; {:.4} % of the power agrees, {:.1e} of it is off",
        all.len(),
        100.0 * agreeing / power,
        off / power
    );
    let shown = std::env::var("CATSEYE_WORST").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let mut worst: Vec<_> = all.iter().filter(|(_, f)| !agrees(f)).collect();
    worst.sort_by(|a, b| b.1.off().total_cmp(&a.1.off()));
    for ((patches, over), f) in worst.into_iter().take(shown) {
        let db = 10.0 * (f.power(1) / f.power(0)).log10();
        println!(
            "    {patches:?}{}: {:.1e} of the power, {db:+.3} dB, off by {:.1e}, {:?} echoes",
            if *over { " back over the first" } else { "" },
            f.power(0) / power,
            f.off() / f.power(0),
            f.echoes
        );
    }
    Agreement { agreeing: agreeing / power, off: off / power, echoes }
}

/// On scenes of flat patches nearly all of the power agrees within 0.01 dB, and outlines in parts bring no more echoes than polygons do.
#[test]
fn lines_return_what_polygons_return() {
    let mut frames = vec![("W3-moving".to_string(), frame_of("W3-moving").unwrap(), 3)];
    for (recipe, scene) in [("template", 4), ("highways", 2)] {
        frames.push((format!("{recipe}, scene {scene}"), drawn(recipe, scene), 2));
    }
    for (name, frame, bounces) in frames {
        let Agreement { agreeing, off, echoes: [polygons, lines] } = compare(&name, &frame, bounces);
        assert!(agreeing > 0.9999 && off < 1e-5, "{name}: {agreeing}, {off}");
        assert!((lines as f64) < 1.02 * polygons as f64, "{name}: {lines} echoes for {polygons}");
    }
}

/// As for areas (`lines::areas_of_every_frame`).
#[test]
#[ignore = "prints a table"]
fn echoes_of_every_frame() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
    let bounces = std::env::var("CATSEYE_BOUNCES").ok().and_then(|n| n.parse().ok()).unwrap_or(3);
    let mut frames: Vec<(String, Box<dyn Fn() -> Frame>)> = Vec::new();
    for name in ["W3-static", "W3-moving", "W7", "W8", "W9", "W13"] {
        frames.push((name.into(), Box::new(move || frame_of(name).unwrap())));
    }
    for recipe in ["template", "highways"] {
        for scene in 0..10 {
            frames.push((format!("{recipe}, scene {scene}"), Box::new(move || drawn(recipe, scene))));
        }
    }
    for (name, frame) in frames.iter().filter(|f| f.0.contains(&only)) {
        compare(name, &frame(), bounces);
    }
}
