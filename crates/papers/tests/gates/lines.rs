//! Visibility by lines beside polygons: the visible area of every patch of a frame.

use super::device_frames::drawn;
use catseye::geom::edge_table::EdgeTable;
use catseye::geom::faces::{Face, Faces, LIES_M, NOT_CURVED};
use catseye::gpu::Gpu;
use catseye::gpu::compare::{opened_for_tests, test_gpu};
use catseye::trace::beams::{BeamOptions, Frame as Window};
use catseye::trace::cpu::beams::{self, Piece};
use catseye::trace::cpu::chains;
use catseye::trace::cpu::lines::Fragment;
use catseye::trace::line_tracer::{self, Followed, Sight};
use catseye::trace::windows::windows;
use catseye_papers::bench::frame::Frame;
use catseye_papers::bench::frame_of;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::time::Instant;

/// Areas agree within this share and this much, m².
const SHARE: f64 = 1e-6;
const LEAST_M2: f64 = 1e-9;

/// Areas of a chain of patches, across the rays from the middle of its last patch to the image: what the radar sees of what is lit, by
/// polygons and by lines, m²; what is lit, by polygons where they list it, and by lines; how far the outlines by lines are from closing, m.
#[derive(Debug, Default, Clone, Copy)]
struct Areas {
    seen: [f64; 2],
    lit: [Option<f64>; 2],
    gap_m: f64,
}

impl Areas {
    fn off_m2(&self) -> f64 {
        let lit = self.lit[0].map_or(0.0, |polygons| (polygons - self.lit[1].unwrap_or(0.0)).abs());
        lit.max((self.seen[0] - self.seen[1]).abs())
    }

    fn is_off(&self) -> bool {
        self.off_m2() > LEAST_M2 + SHARE * self.seen[0].max(self.lit[0].unwrap_or(0.0))
    }
}

type OfChains = BTreeMap<Vec<u32>, Areas>;

/// Areas of all chains, and the seconds that polygons, the table of edges and lines took.
fn areas(faces: &Faces, windows: &[Window], options: &BeamOptions) -> (OfChains, [f64; 3]) {
    let start = Instant::now();
    let clipped = beams::clip_windows(faces, windows, options, None);
    let by_polygons = start.elapsed().as_secs_f64();
    let mut all = OfChains::new();
    // Corners of a file may be a little off their planes. Seen at a small angle that shifts an outline by far more, so that both are
    // measured in the plane in which lines give the outline.
    let leads = leads(faces);
    // What noise moves at small angles counts as little as it returns.
    let middles: Vec<DVec3> = leads
        .iter()
        .map(|i| {
            let corners = faces.corners(&faces.faces[*i]);
            corners.iter().sum::<DVec3>() / corners.len() as f64
        })
        .collect();
    let across = |patch: u32, source: DVec3| {
        let patch = patch as usize;
        (middles[patch] - source).normalize().dot(faces.faces[leads[patch]].normal).abs()
    };
    let area_of = |piece: &Piece| {
        let node = &clipped.nodes[piece.node as usize];
        let face = &faces.faces[node.face as usize];
        let lead = &faces.faces[leads[face.patch as usize]];
        let source = node.frame.origin;
        let on_lead = |p: &DVec2| {
            let d = faces.corners(face)[0] + face.axis[0] * p.x + face.axis[1] * p.y - source;
            source - d * (height(lead, source) / lead.normal.dot(d))
        };
        let corners: Vec<DVec3> = piece.polygon.corners().iter().map(on_lead).collect();
        let fan = corners.windows(2).map(|w| (w[0] - corners[0]).cross(w[1] - corners[0]));
        0.5 * lead.normal.dot(fan.sum()).abs() * across(face.patch, source)
    };
    let chain_of = |mut node: u32| {
        let mut chain = Vec::new();
        while let Some(at) = clipped.nodes.get(node as usize) {
            chain.insert(0, faces.faces[at.face as usize].patch);
            node = at.parent;
        }
        chain
    };
    let is_curved = |patch: u32| faces.faces[leads[patch as usize]].curved != NOT_CURVED;
    for piece in &clipped.every {
        all.entry(chain_of(piece.node)).or_default().seen[0] += area_of(piece);
    }
    for piece in &clipped.imaged {
        let of = all.entry(chain_of(piece.node)).or_default();
        *of.lit[0].get_or_insert(0.0) += area_of(piece);
    }
    let start = Instant::now();
    let table = EdgeTable::new(faces);
    let by_table = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let chains = chains::follow(faces, &table, windows, options);
    let by_lines = start.elapsed().as_secs_f64();
    let asked = asked_chain();
    for (i, chain) in chains.iter().enumerate() {
        let patches = chains::patches_of(&chains, i);
        if asked.as_ref() == Some(&patches) {
            let rays = Rays::new(faces, windows, &patches);
            rays.check("lit", &chain.lit, false);
            if !chain.returning().is_empty() {
                rays.check("seen", chain.returning(), true);
            }
        }
        let of = all.entry(patches).or_default();
        if chain.node.bounce == 1 || !is_curved(chain.patch) {
            of.seen[1] +=
                chains::area_m2(faces, chain.returning()) * across(chain.patch, chain.node.frame.origin);
        }
        *of.lit[1].get_or_insert(0.0) +=
            chains::area_m2(faces, &chain.lit) * across(chain.patch, chain.node.frame.origin);
        let gap = |outline: &[Fragment]| {
            outline.iter().map(|f| f.vector_m(faces.faces[f.face as usize].normal)).sum::<DVec3>().length()
        };
        of.gap_m = gap(&chain.lit).max(gap(chain.returning()));
    }
    (all, [by_polygons, by_table, by_lines])
}

/// The chain of patches that CATSEYE_CHAIN names.
fn asked_chain() -> Option<Vec<u32>> {
    let list = std::env::var("CATSEYE_CHAIN").ok()?;
    Some(list.split(',').filter_map(|n| n.trim().parse().ok()).collect())
}

/// A face of each patch.
fn leads(faces: &Faces) -> Vec<usize> {
    let mut leads = vec![0; faces.patch_area_m2.len()];
    faces.faces.iter().enumerate().for_each(|(i, f)| leads[f.patch as usize] = i);
    leads
}

fn height(face: &Face, p: DVec3) -> f64 {
    face.normal.dot(p) - face.offset_m
}

/// Whether a face has a place in a direction from the radar.
fn is_met(faces: &Faces, face: &Face, radar: DVec3, d: DVec3) -> bool {
    let corners = faces.corners(face);
    let sign = -height(face, radar).signum();
    (0..corners.len()).all(|k| {
        let (a, b) = (corners[k] - radar, corners[(k + 1) % corners.len()] - radar);
        sign * a.cross(b).dot(d) >= 0.0
    })
}

/// Which of two faces in one plane hides the other follows CONVENTIONS eq. 65b.
fn lies_on(faces: &Faces, a: &Face, b: &Face) -> bool {
    let area = |f: &Face| (faces.patch_area_m2[f.patch as usize], f.body);
    a.body != b.body && area(a) < area(b) && faces.corners(a).iter().all(|p| height(b, *p).abs() <= LIES_M)
}

/// Whether `other` hides `face` from a source; None where the nearer one hides.
fn hides(faces: &Faces, source: DVec3, other: &Face, face: &Face) -> Option<bool> {
    // Least and largest height of corners over a plane, towards the source.
    let heights = |of: &Face, plane: &Face| {
        let side = height(plane, source).signum();
        let all = faces.corners(of).iter().map(|p| side * height(plane, *p));
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)))
    };
    if lies_on(faces, face, other) || lies_on(faces, other, face) {
        return Some(lies_on(faces, other, face));
    }
    let (lo, hi) = heights(other, face);
    if hi <= faces.flat_m || lo >= -faces.flat_m {
        return Some(hi > faces.flat_m);
    }
    let (lo, hi) = heights(face, other);
    (hi <= faces.flat_m || lo >= -faces.flat_m).then_some(hi <= faces.flat_m)
}

/// A face, and the faces that may hide it, as [`hides`] has it.
type Target<'a> = (&'a Face, Vec<(&'a Face, Option<bool>)>);

/// A leg of a path: its source, the plane that it leaves (normal on the lit side, offset), and what it leads to, with the faces that may
/// hide that.
struct Leg<'a> {
    source: DVec3,
    leaves: Option<(DVec3, f64)>,
    targets: Vec<Target<'a>>,
}

impl<'a> Leg<'a> {
    fn new(faces: &'a Faces, source: DVec3, leaves: Option<(DVec3, f64)>, patch: u32) -> Leg<'a> {
        let is_lit = |f: &Face| {
            let h = height(f, source);
            h.abs() > 1e-9 * faces.radius_m
                && (h > 0.0 || !f.one_sided)
                && leaves.is_none_or(|(n, offset)| {
                    faces.corners(f).iter().any(|p| n.dot(*p) - offset > LIES_M.max(faces.flat_m))
                })
        };
        let cone = |f: &Face| {
            let corners = faces.corners(f);
            let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let size = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
            let d = middle - source;
            (d.normalize(), if size < d.length() { (size / d.length()).asin() } else { PI })
        };
        let lit: Vec<(&Face, (DVec3, f64))> =
            faces.faces.iter().filter(|f| is_lit(f)).map(|f| (f, cone(f))).collect();
        let target = |face: &'a Face| {
            let (axis, angle) = cone(face);
            let others = (lit.iter())
                .filter(|(f, (other_axis, other_angle))| {
                    f.patch != patch
                        && axis.dot(*other_axis).clamp(-1.0, 1.0).acos() <= angle + other_angle + 1e-9
                })
                .map(|(f, _)| (*f, hides(faces, source, f, face)))
                .filter(|(_, hides)| *hides != Some(false));
            (face, others.collect())
        };
        let targets = faces.faces.iter().filter(|f| f.patch == patch && is_lit(f)).map(target).collect();
        Leg { source, leaves, targets }
    }

    /// Whether a ray reaches a place on a face of the target.
    fn reaches(&self, faces: &Faces, p: DVec3) -> bool {
        let d = p - self.source;
        let start = self.leaves.map_or(0.0, |(n, offset)| (offset - n.dot(self.source)) / n.dot(d));
        self.targets.iter().any(|(face, others)| {
            is_met(faces, face, self.source, d)
                && !others.iter().any(|(f, hides)| {
                    let t = -height(f, self.source) / f.normal.dot(d);
                    // What hides as a whole may lie a little behind the plane, never far behind the place.
                    t > start
                        && (hides.is_some() || t < 1.0)
                        && (t - 1.0) * d.length() < 1.0
                        && is_met(faces, f, self.source, d)
                })
        })
    }
}

/// What a chain lights of its last patch, and what the radar sees of that, ray by ray, each against all faces in its cone.
struct Rays<'a> {
    faces: &'a Faces,
    windows: &'a [Window],
    legs: Vec<Leg<'a>>,
    direct: Leg<'a>,
    chain: Vec<u32>,
    patch: u32,
}

impl<'a> Rays<'a> {
    fn new(faces: &'a Faces, windows: &'a [Window], chain: &[u32]) -> Rays<'a> {
        let radar = windows[0].origin;
        let leads = leads(faces);
        let mut legs = vec![Leg::new(faces, radar, None, chain[0])];
        for pair in chain.windows(2) {
            let (mirror, source) = (&faces.faces[leads[pair[0] as usize]], legs[legs.len() - 1].source);
            let h = height(mirror, source);
            let leaves = (mirror.normal * h.signum(), mirror.offset_m * h.signum());
            legs.push(Leg::new(faces, source - mirror.normal * (2.0 * h), Some(leaves), pair[1]));
        }
        let patch = chain[chain.len() - 1];
        Rays {
            faces,
            windows,
            legs,
            direct: Leg::new(faces, radar, None, patch),
            chain: chain.to_vec(),
            patch,
        }
    }

    fn in_window(&self, p: DVec3) -> bool {
        let d = p - self.windows[0].origin;
        let sees = |w: &Window| w.k.dot(d) > 0.0 && w.u.dot(d).abs().max(w.v.dot(d).abs()) <= w.k.dot(d);
        self.windows.iter().any(sees)
    }

    fn is_lit(&self, mut p: DVec3) -> bool {
        for leg in self.legs.iter().rev() {
            if !leg.reaches(self.faces, p) {
                return false;
            }
            if let Some((n, offset)) = leg.leaves {
                let d = p - leg.source;
                p = leg.source + d * ((offset - n.dot(leg.source)) / n.dot(d));
            }
        }
        self.in_window(p)
    }

    fn is_seen(&self, p: DVec3) -> bool {
        let (image, radar) = (self.legs[self.legs.len() - 1].source, self.windows[0].origin);
        let is_before = |f: &Face| height(f, image) * height(f, radar) > 0.0;
        self.direct.targets.iter().any(|(f, _)| is_before(f))
            && self.in_window(p)
            && self.direct.reaches(self.faces, p)
    }

    /// Areas of what is seen of what is lit, and of what is lit, m², by a grid over each face of so many rays along its sides.
    fn areas_m2(&self, rays: usize) -> [f64; 2] {
        let faces = self.faces;
        let image = self.legs[self.legs.len() - 1].source;
        let mut sums = [0.0; 2];
        for face in faces.faces.iter().filter(|f| f.patch == self.patch) {
            let corners = faces.corners(face);
            let span = |axis: DVec3| {
                let at = corners.iter().map(|c| axis.dot(*c - corners[0]));
                at.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
            };
            let [x, y] = face.axis.map(span);
            let step = [(x.1 - x.0) / rays as f64, (y.1 - y.0) / rays as f64];
            for i in 0..rays * rays {
                let (a, b) = ((i % rays) as f64 + 0.5, (i / rays) as f64 + 0.5);
                let p = corners[0] + face.axis[0] * (x.0 + step[0] * a) + face.axis[1] * (y.0 + step[1] * b);
                if is_met(faces, face, image, p - image) && self.is_lit(p) {
                    sums[0] += if self.is_seen(p) { step[0] * step[1] } else { 0.0 };
                    sums[1] += step[0] * step[1];
                }
            }
        }
        sums
    }

    /// Prints each fragment of an outline, whether what is beside it is lit (`seen`: and seen) as it says, and where it does not close.
    fn check(&self, name: &str, outline: &[Fragment], seen: bool) {
        let is_in = |p: DVec3| self.is_lit(p) && (!seen || self.is_seen(p));
        let mut ends: Vec<(DVec3, i32)> = Vec::new();
        let normal = self.faces.faces[outline[0].face as usize].normal;
        println!("      {name}: {} fragments", outline.len());
        let leaves = self.legs[self.legs.len() - 1].leaves;
        let over = |p: &DVec3| leaves.map_or(0.0, |(n, offset)| n.dot(*p) - offset);
        for f in self.faces.faces.iter().filter(|f| self.chain.contains(&f.patch)) {
            let corners: Vec<_> =
                self.faces.corners(f).iter().map(|p| format!("{p:.6} {:.1e}", over(p))).collect();
            println!("        patch {}, heights over the last mirror: {}", f.patch, corners.join(", "));
        }
        for f in outline {
            let [a, b] = f.ends_m;
            let (middle, beside) = (0.5 * (a + b), f.inward * 2e-4f64.min(0.1 * a.distance(b)));
            let sides = [is_in(middle + beside), is_in(middle - beside)];
            if sides != [true, false] || outline.len() <= 12 {
                println!("        {sides:?} at {a:.6} to {b:.6}, inward {:.3}, {f:?}", f.inward);
            }
            let turn = if f.vector_m(normal).dot(b - a) > 0.0 { 1 } else { -1 };
            for (p, sign) in [(a, -turn), (b, turn)] {
                match ends.iter_mut().find(|(q, _)| q.distance(p) < 1e-6) {
                    Some(end) => end.1 += sign,
                    None => ends.push((p, sign)),
                }
            }
        }
        ends.iter().filter(|e| e.1 != 0).for_each(|(p, n)| println!("        {n} at {p:.7}"));
    }
}

/// Prints how areas differ by number of bounces, and gives the areas.
fn compare(name: &str, frame: &Frame, bounces: usize) -> OfChains {
    let geometry = frame.geometry(&frame.refined(frame.options.accuracy_db).unwrap()).unwrap();
    let faces = geometry.faces();
    let windows = windows(&frame.radar, &frame.pose);
    let options = BeamOptions { images: bounces > 1, ..BeamOptions::new(bounces, 0.2, false) };
    let (areas, [by_polygons, by_table, by_lines]) = areas(faces, &windows, &options);
    println!(
        "{name}: {} faces in {} patches; polygons {by_polygons:.3} s, edges {by_table:.3} s, lines {by_lines:.3} s",
        faces.faces.len(),
        faces.patch_area_m2.len(),
    );
    let shown = std::env::var("CATSEYE_WORST").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    for bounce in 1..=bounces + 1 {
        let of: Vec<_> = areas.iter().filter(|(chain, _)| chain.len() == bounce).collect();
        if of.is_empty() {
            continue;
        }
        let all: f64 = of.iter().map(|(_, a)| a.seen[0].max(a.lit[0].unwrap_or(0.0))).sum();
        let mut off: Vec<_> = of.iter().filter(|(_, a)| a.is_off()).collect();
        off.sort_by(|a, b| b.1.off_m2().total_cmp(&a.1.off_m2()));
        let sum: f64 = off.iter().map(|(_, a)| a.off_m2()).sum();
        let open = of.iter().filter(|(_, a)| a.gap_m > 1e-6).count();
        println!(
            "  bounce {bounce}: {} chains, {all:.4} m²; {} off by {:.2e} in sum, {open} outlines open",
            of.len(),
            off.len(),
            sum / all,
        );
        for (chain, a) in off.iter().take(shown) {
            let rays = match std::env::var("CATSEYE_RAYS").ok().and_then(|n| n.parse().ok()) {
                Some(rays) => {
                    let [seen, lit] = Rays::new(faces, &windows, chain).areas_m2(rays);
                    format!(", rays {seen:.6} {lit:.6}")
                }
                _ => String::new(),
            };
            println!(
                "    {chain:?} of {:.3e} m²: polygons {:.9} {:.9?}, lines {:.9} {:.9?}{rays}, gap {:.1e} m",
                faces.patch_area_m2[*chain.last().unwrap() as usize],
                a.seen[0],
                a.lit[0],
                a.seen[1],
                a.lit[1],
                a.gap_m
            );
        }
    }
    areas
}

/// Every patch agrees within 1e-9 m² and 1e-6 of its area, and every outline closes within a micrometre, which is what corners of a file are
/// welded by. One patch of template scene 3 stays open by 7 µm. On W3 so does every chain of three mirrors, with a fourth bounce behind an endless one.
#[test]
fn lines_and_polygons_agree() {
    let frames = ["W3-static", "W3-moving"].map(|name| (name.to_string(), frame_of(name).unwrap(), 3, 1e-6));
    let scenes = [("template", 3, 1e-5), ("template", 4, 1e-6), ("highways", 2, 1e-6), ("highways", 3, 1e-6)];
    let scenes =
        scenes.map(|(recipe, i, open_m)| (format!("{recipe}, scene {i}"), drawn(recipe, i), 1, open_m));
    for (name, frame, bounces, open_m) in frames.into_iter().chain(scenes) {
        let areas = compare(&name, &frame, bounces);
        assert!(bounces == 1 || areas.keys().filter(|chain| chain.len() == 4).count() > 100);
        for (chain, of) in areas {
            assert!(!of.is_off(), "{name}, chain {chain:?}: {of:?}");
            assert!(of.gap_m <= open_m, "{name}, chain {chain:?} is open by {} m", of.gap_m);
        }
    }
}

/// Tiles of a road whose bank changes have corners up to 0.7 mm off their planes. They do not hide what they mirror. Of the areas by way of them
/// 0.3 % differ, where such tiles are lit at milliradians too, and their sides lie elsewhere in either view.
#[test]
fn warped_tiles_mirror() {
    let frame = drawn("highways", 1);
    let geometry = frame.geometry(&frame.refined(frame.options.accuracy_db).unwrap()).unwrap();
    let faces = geometry.faces();
    let off_m = |face: &Face| faces.corners(face).iter().map(|p| height(face, *p).abs()).fold(0.0, f64::max);
    let mut is_warped = vec![false; faces.patch_area_m2.len()];
    faces.faces.iter().for_each(|f| is_warped[f.patch as usize] |= off_m(f) > 4.0 * faces.flat_m);
    let options = BeamOptions { images: true, ..BeamOptions::new(2, 0.2, false) };
    let (areas, _) = areas(faces, &windows(&frame.radar, &frame.pose), &options);
    let (mut sums, mut worst) = ([0.0; 2], (0.0, Vec::new()));
    for (chain, a) in areas.iter().filter(|(chain, _)| chain.len() == 2 && is_warped[chain[0] as usize]) {
        (0..2).for_each(|i| sums[i] += a.seen[i]);
        if a.off_m2() > worst.0 {
            worst = (a.off_m2(), chain.clone());
        }
    }
    let [polygons, lines] = sums;
    println!("by way of warped tiles {polygons} m² by polygons, {lines} m² by lines; worst {worst:?}");
    assert!(polygons > 0.1 && (polygons / lines - 1.0).abs() < 0.01);
}

/// A frame's name, and how to make it.
type Named = (String, Box<dyn Fn() -> Frame>);

/// The frames of the tables of benches/RESULTS.md.
pub(super) fn all_frames() -> Vec<Named> {
    let mut frames: Vec<Named> = Vec::new();
    for name in ["W3-static", "W3-moving", "W7", "W8", "W9", "W13"] {
        frames.push((name.into(), Box::new(move || frame_of(name).unwrap())));
    }
    for recipe in ["template", "highways"] {
        for scene in 0..10 {
            frames.push((format!("{recipe}, scene {scene}"), Box::new(move || drawn(recipe, scene))));
        }
    }
    frames
}

/// CATSEYE_LOOKS chooses frames whose name contains it, CATSEYE_BOUNCES how many bounces are followed (1), CATSEYE_WORST says how many chains
/// are listed. With CATSEYE_RAYS these are counted by rays too, so many along each side of a face. CATSEYE_CHAIN names a chain by its patches, whose
/// fragments are checked one by one.
#[test]
#[ignore = "prints a table"]
fn areas_of_every_frame() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
    let bounces = std::env::var("CATSEYE_BOUNCES").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    for (name, frame) in all_frames().iter().filter(|f| f.0.contains(&only)) {
        compare(name, &frame(), bounces);
    }
}

/// Areas of all chains of a frame by the host and by the device, what is lit and what is seen of that, m².
fn device_areas(gpu: &Gpu, name: &str, frame: &Frame, bounces: usize) -> BTreeMap<Vec<u32>, [[f64; 2]; 2]> {
    let geometry = frame.geometry(&frame.refined(frame.options.accuracy_db).unwrap()).unwrap();
    let faces = geometry.faces();
    let windows = windows(&frame.radar, &frame.pose);
    let options = BeamOptions { images: bounces > 1, ..BeamOptions::new(bounces, 0.2, false) };
    let table = EdgeTable::new(faces);
    let start = Instant::now();
    let by_host = chains::follow(faces, &table, &windows, &options);
    let host_s = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let sight = Sight { faces, table: &table, windows: &windows, options: &options };
    let by_device = match line_tracer::follow(gpu, sight).unwrap() {
        Followed::Whole(chains) => chains,
        Followed::Refused(why) => panic!("{name}: {why}"),
    };
    let device_s = start.elapsed().as_secs_f64();
    println!(
        "{name}: {} faces, {} edges; host {host_s:.3} s, device {device_s:.3} s",
        faces.faces.len(),
        table.edges.len()
    );
    let mut areas: BTreeMap<Vec<u32>, [[f64; 2]; 2]> = BTreeMap::new();
    let asked = asked_chain();
    for (which, all) in [&by_host, &by_device].into_iter().enumerate() {
        for (i, chain) in all.iter().enumerate() {
            if asked.as_ref() == Some(&chains::patches_of(all, i)) {
                println!("  by {}:", ["host", "device"][which]);
                chain.lit.iter().for_each(|f| println!("    {:.9?} {f:?}", f.ends_m));
            }
            // The area of an outline that is open, as some are, goes with the origin and not only with the outline.
            let face = &faces.faces[chain.node.face as usize];
            let area = |f: &Fragment| f.area_m2(faces.corners(face)[0], face.normal);
            areas.entry(chains::patches_of(all, i)).or_default()[which] =
                [&chain.lit, &chain.seen].map(|o| o.iter().map(area).sum());
        }
    }
    areas
}

/// Area of all chains of so many bounces by the host, m², and how many of them are off on the device.
fn device_is_off(areas: &BTreeMap<Vec<u32>, [[f64; 2]; 2]>, bounce: usize) -> (f64, usize) {
    let off_m2 = |a: &[[f64; 2]; 2]| (a[0][0] - a[1][0]).abs().max((a[0][1] - a[1][1]).abs());
    let is_off = |a: &[[f64; 2]; 2]| off_m2(a) > LEAST_M2 + SHARE * a[0][0].max(a[1][0]);
    let of: Vec<_> = areas.iter().filter(|(chain, _)| chain.len() == bounce).collect();
    let mut off: Vec<_> = of.iter().filter(|(_, a)| is_off(a)).collect();
    off.sort_by(|a, b| off_m2(b.1).total_cmp(&off_m2(a.1)));
    let all: f64 = of.iter().map(|(_, a)| a[0][0]).sum();
    let sum: f64 = off.iter().map(|(_, a)| off_m2(a)).sum();
    println!("  bounce {bounce}: {} chains, {all:.4} m²; {} off by {sum:.2e} m²", of.len(), off.len());
    let worst = std::env::var("CATSEYE_WORST").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    off.iter().take(worst).for_each(|(chain, a)| println!("    {chain:?}: {a:?}"));
    (all, off.len())
}

/// The device lights what the host lights: of three bounces on W3, and at the first bounce of a highway and of W7, every chain to 1e-6 of its
/// area.
#[test]
fn the_device_lights_what_lines_light() {
    for (name, bounces) in [("W3-moving", 3), ("highways", 1), ("W7", 1)] {
        let frame = if name == "highways" { drawn(name, 2) } else { frame_of(name).unwrap() };
        let areas = device_areas(test_gpu(), name, &frame, bounces);
        for bounce in 1..=bounces {
            let (all, off) = device_is_off(&areas, bounce);
            assert!(all > 1.0 && off == 0, "{name}, bounce {bounce}: {off} chains are off");
        }
    }
}

/// CATSEYE_LOOKS chooses frames whose name contains it: how tests of boxes, faces and edges are shared out among threads, for as many bounces as
/// the frame begins with.
#[test]
#[ignore = "prints a table"]
fn balance_of_every_frame() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
    for (name, frame) in all_frames().iter().filter(|f| f.0.contains(&only)) {
        let frame = frame();
        let geometry = frame.geometry(&frame.refined(frame.options.accuracy_db).unwrap()).unwrap();
        let windows = windows(&frame.radar, &frame.pose);
        let bounces = frame.options.bounces;
        let options = BeamOptions { images: bounces > 1, ..BeamOptions::new(bounces, 0.2, false) };
        let faces = geometry.faces();
        let table = EdgeTable::new(faces);
        let sight = Sight { faces, table: &table, windows: &windows, options: &options };
        let all = line_tracer::balance(test_gpu(), sight).unwrap();
        let sum: u64 = all.iter().map(|b| b.tests).sum();
        println!("{name}: {bounces} bounces, {:.2} M tests", sum as f64 / 1e6);
        for b in all {
            println!(
                "  {}: {:.3} of the tests, {} threads, longest over mean {:.1}",
                b.name,
                b.tests as f64 / sum as f64,
                b.threads,
                b.longest_over_mean()
            );
        }
    }
}

/// CATSEYE_LOOKS and CATSEYE_BOUNCES as in [`areas_of_every_frame`]: what the device lights of every frame beside what the host lights. With
/// CATSEYE_PAIRS it computes in pairs of f32, with CATSEYE_PROFILE it says how long each kernel took.
#[test]
#[ignore = "prints a table"]
fn device_areas_of_every_frame() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
    let bounces = std::env::var("CATSEYE_BOUNCES").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    let mut gpu = opened_for_tests();
    if std::env::var_os("CATSEYE_PAIRS").is_some() {
        gpu = gpu.with_pairs();
    }
    if std::env::var_os("CATSEYE_PROFILE").is_some() {
        gpu = gpu.with_profiling();
    }
    for (name, frame) in all_frames().iter().filter(|f| f.0.contains(&only)) {
        let areas = device_areas(&gpu, name, &frame(), bounces);
        for kernel in gpu.profile().iter().flat_map(|p| &p.kernels) {
            let seconds = kernel.seconds.unwrap_or_default();
            println!("  {}: {} dispatches, {seconds:.4} s", kernel.kernel, kernel.dispatches);
        }
        (1..=bounces + 1).for_each(|bounce| _ = device_is_off(&areas, bounce));
    }
}
