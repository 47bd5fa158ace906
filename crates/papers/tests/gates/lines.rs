//! Visibility by lines beside polygons: the visible area of every patch of a frame.

use super::device_frames::drawn;
use catseye::geom::edge_table::EdgeTable;
use catseye::geom::faces::{Face, Faces, LIES_M};
use catseye::trace::beams::{BeamOptions, Frame as Window};
use catseye::trace::cpu::{beams, lines};
use catseye::trace::windows::windows;
use catseye_papers::bench::frame::Frame;
use catseye_papers::bench::frame_of;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::time::Instant;

/// Areas of patches agree within this share and this much, m².
const SHARE: f64 = 1e-6;
const LEAST_M2: f64 = 1e-9;

/// Visible area of every patch by both methods, m², and how far its outline by lines is from closing, m.
struct Areas {
    polygons: Vec<f64>,
    lines: Vec<f64>,
    gaps: Vec<f64>,
    seconds: [f64; 3],
}

fn areas(faces: &Faces, windows: &[Window]) -> Areas {
    let patches = faces.patch_area_m2.len();
    let start = Instant::now();
    let options = BeamOptions::new(1, 0.2, false);
    let clipped = beams::clip_windows(faces, windows, &options, None);
    let by_polygons = start.elapsed().as_secs_f64();
    let mut polygons = vec![0.0; patches];
    // Corners of a file may be a little off their planes. Seen at a small angle that shifts an outline by far more, so that both are
    // measured in the plane in which lines give the outline.
    let mut leads = vec![0; patches];
    faces.faces.iter().enumerate().for_each(|(i, f)| leads[f.patch as usize] = i);
    for piece in &clipped.every {
        let face = &faces.faces[clipped.nodes[piece.node as usize].face as usize];
        let lead = &faces.faces[leads[face.patch as usize]];
        let radar = windows[0].origin;
        let on_lead = |p: &DVec2| {
            let d = faces.corners(face)[0] + face.axis[0] * p.x + face.axis[1] * p.y - radar;
            radar - d * (height(lead, radar) / lead.normal.dot(d))
        };
        let corners: Vec<DVec3> = piece.polygon.corners().iter().map(on_lead).collect();
        let fan = corners.windows(2).map(|w| (w[0] - corners[0]).cross(w[1] - corners[0]));
        polygons[face.patch as usize] += 0.5 * lead.normal.dot(fan.sum()).abs();
    }
    let start = Instant::now();
    let table = EdgeTable::new(faces);
    let by_table = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let found = lines::seen(faces, &table, windows);
    let by_lines = start.elapsed().as_secs_f64();
    let mut origins: Vec<Option<(DVec3, DVec3)>> = vec![None; patches];
    let (mut lines, mut gaps) = (vec![0.0; patches], vec![DVec3::ZERO; patches]);
    for f in &found {
        let face = &faces.faces[f.face as usize];
        let patch = face.patch as usize;
        let (origin, normal) = *origins[patch].get_or_insert((faces.corners(face)[0], face.normal));
        lines[patch] += f.area_m2(origin, normal);
        gaps[patch] += f.vector_m(normal);
    }
    let gaps = gaps.into_iter().map(|g| g.length()).collect();
    Areas { polygons, lines, gaps, seconds: [by_polygons, by_table, by_lines] }
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

/// Visible area of a patch by a grid of rays over each of its faces, m², each ray against all faces in its cone. Which of two faces in one
/// plane hides the other follows CONVENTIONS eq. 65b.
fn by_rays(faces: &Faces, windows: &[Window], patch: usize) -> f64 {
    const RAYS: usize = 300;
    let radar = windows[0].origin;
    let is_lit = |f: &Face| {
        let h = height(f, radar);
        h.abs() > 1e-9 * faces.radius_m && (h > 0.0 || !f.one_sided)
    };
    let lies_on = |a: &Face, b: &Face| {
        let area = |f: &Face| (faces.patch_area_m2[f.patch as usize], f.body);
        a.body != b.body
            && area(a) < area(b)
            && faces.corners(a).iter().all(|p| height(b, *p).abs() <= LIES_M)
    };
    // Least and largest height of corners over a plane, towards the radar.
    let heights = |of: &Face, plane: &Face| {
        let side = height(plane, radar).signum();
        let all = faces.corners(of).iter().map(|p| side * height(plane, *p));
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)))
    };
    // None where the nearer one hides, else whether `other` does.
    let hides = |other: &Face, face: &Face| {
        if lies_on(face, other) || lies_on(other, face) {
            return Some(lies_on(other, face));
        }
        let (lo, hi) = heights(other, face);
        if hi <= faces.flat_m || lo >= -faces.flat_m {
            return Some(hi > faces.flat_m);
        }
        let (lo, hi) = heights(face, other);
        (hi <= faces.flat_m || lo >= -faces.flat_m).then_some(hi <= faces.flat_m)
    };
    let cone = |f: &Face| {
        let corners = faces.corners(f);
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let size = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
        let d = middle - radar;
        (d.normalize(), if size < d.length() { (size / d.length()).asin() } else { PI })
    };
    let in_window = |d: DVec3| {
        windows.iter().any(|w| w.k.dot(d) > 0.0 && w.u.dot(d).abs().max(w.v.dot(d).abs()) <= w.k.dot(d))
    };
    let mut sum = 0.0;
    for face in faces.faces.iter().filter(|f| f.patch as usize == patch && is_lit(f)) {
        let (axis, angle) = cone(face);
        let others: Vec<(&Face, Option<bool>)> = (faces.faces.iter())
            .filter(|f| f.patch != face.patch && is_lit(f))
            .filter(|f| {
                let (other_axis, other_angle) = cone(f);
                axis.dot(other_axis).clamp(-1.0, 1.0).acos() <= angle + other_angle + 1e-9
            })
            .map(|f| (f, hides(f, face)))
            .filter(|(_, hides)| *hides != Some(false))
            .collect();
        let corners = faces.corners(face);
        let span = |axis: DVec3| {
            let at = corners.iter().map(|c| axis.dot(*c - corners[0]));
            at.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
        };
        let [x, y] = face.axis.map(span);
        let step = [(x.1 - x.0) / RAYS as f64, (y.1 - y.0) / RAYS as f64];
        let is_seen = |i: &usize| {
            let (a, b) = ((i % RAYS) as f64 + 0.5, (i / RAYS) as f64 + 0.5);
            let p = corners[0] + face.axis[0] * (x.0 + step[0] * a) + face.axis[1] * (y.0 + step[1] * b);
            let d = p - radar;
            is_met(faces, face, radar, d)
                && in_window(d)
                && !others.iter().any(|(f, hides)| {
                    let t = -height(f, radar) / f.normal.dot(d);
                    let is_near = if hides.is_some() { t > 0.0 } else { t > 0.0 && t < 1.0 };
                    // What hides as a whole may lie a little behind the plane, never far behind the place.
                    is_near && (t - 1.0) * d.length() < 1.0 && is_met(faces, f, radar, d)
                })
        };
        sum += (0..RAYS * RAYS).filter(is_seen).count() as f64 * step[0] * step[1];
    }
    sum
}

/// Prints how two lists of areas differ, and gives the areas.
fn compare(name: &str, frame: &Frame) -> Areas {
    let geometry = frame.geometry(&frame.refined(frame.options.accuracy_db).unwrap()).unwrap();
    let faces = geometry.faces();
    let windows = windows(&frame.radar, &frame.pose);
    let areas = areas(faces, &windows);
    let all: f64 = areas.polygons.iter().sum();
    let mut off: Vec<(f64, usize)> = (areas.polygons.iter().zip(&areas.lines).enumerate())
        .map(|(i, (p, l))| ((p - l).abs(), i))
        .filter(|(d, i)| *d > LEAST_M2 + SHARE * areas.polygons[*i])
        .collect();
    off.sort_by(|a, b| b.0.total_cmp(&a.0));
    let sum: f64 = off.iter().map(|o| o.0).sum();
    let seen = areas.polygons.iter().filter(|a| **a > 0.0).count();
    let open = areas.gaps.iter().filter(|g| **g > 1e-6).count();
    let [by_polygons, by_table, by_lines] = areas.seconds;
    println!(
        "{name}: {} faces, {seen} of {} patches seen, {all:.1} m²; {} off by {:.2e} in sum, {open} outlines open; polygons {by_polygons:.3} s, edges {by_table:.3} s, lines {by_lines:.3} s",
        faces.faces.len(),
        areas.polygons.len(),
        off.len(),
        sum / all,
    );
    let shown = std::env::var("CATSEYE_WORST").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    for (d, i) in off.iter().take(shown) {
        let rays = match std::env::var("CATSEYE_RAYS") {
            Ok(_) => format!(", rays {:.6}", by_rays(faces, &windows, *i)),
            Err(_) => String::new(),
        };
        println!(
            "  patch {i} of {:.3e} m²: polygons {:.9}, lines {:.9}{rays}, difference {d:.2e}, gap {:.1e} m",
            faces.patch_area_m2[*i], areas.polygons[*i], areas.lines[*i], areas.gaps[*i]
        );
    }
    areas
}

/// Every patch agrees within 1e-6 of a square metre or of its area, and every outline closes within a micrometre. One patch of template
/// scene 3 stays open by 7 µm.
#[test]
fn lines_and_polygons_agree() {
    let frames = ["W3-static", "W3-moving"].map(|name| (name.to_string(), frame_of(name).unwrap(), 1e-6));
    let scenes = [("template", 3, 1e-5), ("template", 4, 1e-6), ("highways", 2, 1e-6), ("highways", 3, 1e-6)];
    let scenes = scenes.map(|(recipe, i, open_m)| (format!("{recipe}, scene {i}"), drawn(recipe, i), open_m));
    for (name, frame, open_m) in frames.into_iter().chain(scenes) {
        let areas = compare(&name, &frame);
        for (patch, ((p, l), gap)) in areas.polygons.iter().zip(&areas.lines).zip(&areas.gaps).enumerate() {
            assert!((p - l).abs() <= 1e-6 * p.max(1.0), "{name}, patch {patch}: polygons {p}, lines {l}");
            assert!(*gap <= open_m, "{name}, patch {patch} is open by {gap} m");
        }
    }
}

/// CATSEYE_LOOKS chooses frames whose name contains it, CATSEYE_WORST says how many patches are listed. With CATSEYE_RAYS
/// set their areas are counted by rays too.
#[test]
#[ignore = "prints a table"]
fn areas_of_every_frame() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
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
        compare(name, &frame());
    }
}
