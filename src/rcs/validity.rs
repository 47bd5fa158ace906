//! Where physical optics ends: how large the surfaces are in wavelengths that make the echo, how near to grazing faces are seen, and where
//! the ground is none of a plane's. One judgement for every output of a cross section.
//!
//! A surface is a part of a mesh whose facets turn by no more than 30 degrees from one to the next, flat or curved, however it is cut into
//! triangles. It makes the echo in a direction when it takes part in a chain of bounces that returns a tenth of what the strongest chain
//! does, in amplitude, or more; of scenes with many triangles, and with the receiver elsewhere, when it shows the radar a twentieth of what
//! the largest shows. Of a curved surface the second extent of its bounds counts.

use super::ground::{self, GroundRemark};
use super::{Aspect, RcsOptions};
use crate::base::error::Result;
use crate::base::frames::{Pose, direction_from_angles};
use crate::base::units::{wavelength_m, wavenumber};
use crate::geom::patches::SurfaceParts;
use crate::geom::{Geometry, surfaces_at};
use crate::rcs::beam_sum::FrequencyPoint;
use crate::rcs::cpu::beam_sum;
use crate::scene::creases::{SMOOTH_DEG, smooth};
use crate::scene::{Material, Mesh, Scene, Shape};
use crate::trace::beams::{BeamOptions, Port};
use glam::DVec3;
use std::sync::Arc;

/// Surfaces of so many wavelengths and more are large.
const LARGE: f64 = 2.0;
/// Faces that are seen nearer than this to their own plane are seen at grazing, deg.
const GRAZING_DEG: f64 = 15.0;
/// Share of the largest face's shadow that makes a face count.
const COUNTS: f64 = 0.05;
/// Share of the amplitude of the strongest chain that makes a chain count, and of that of the strongest direction that makes a direction count.
const CHAIN_COUNTS: f64 = 0.1;
/// Most directions of one sweep that are looked at.
const MOST_DIRECTIONS: usize = 181;
/// Most triangles of which chains are followed in so many directions, and in a few.
const FEW_TRIANGLES: usize = 500;
const MOST_TRIANGLES: usize = 5000;
const FEW_DIRECTIONS: usize = 7;
/// Bounces of the chains that are looked at.
const BOUNCES: usize = 3;
/// Facets whose normals differ by less are in one plane: files hold places in f32.
const COPLANAR_RAD: f64 = 1e-5;
/// Most directions of edges in which the width of one face is measured.
const MOST_EDGES: usize = 64;
/// Round trip over the sagitta of flat facets that stand for a curved surface, rad, from which it shows: up to 1 dB by CONVENTIONS eq. 56.
const FACETED_RAD: f64 = 0.25;

/// A surface of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    /// None of a curved surface.
    normal: Option<DVec3>,
    area_m2: f64,
    width_m: f64,
    /// Largest sagitta of a flat facet that stands for a curved surface, m.
    sagitta_m: f64,
}

/// The surfaces of a scene.
#[derive(Debug, Clone)]
pub struct Faces {
    parts: Vec<Part>,
    /// The scene with the number of a triangle's surface in place of its material; None of too many triangles.
    coded: Option<Arc<Coded>>,
    bounds_m: Option<(DVec3, DVec3)>,
}

/// A scene whose materials are its surfaces.
#[derive(Debug)]
struct Coded {
    scene: Scene,
    triangles: usize,
}

/// Where the assumptions of physical optics do not hold for a sweep. The default says nothing against it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Validity {
    /// (width in m, wavelength in m) of the surfaces that are smallest and largest in wavelengths, of those that are too small.
    small: Option<[(f64, f64); 2]>,
    /// (sagitta in m, wavelength in m) of facets that show.
    faceted: Option<(f64, f64)>,
    /// Angle between the direction and the nearest to upright of the faces that count, deg.
    grazing_deg: Option<f64>,
    ground: Option<GroundRemark>,
}

impl Faces {
    /// Finds the surfaces of a scene's meshes. Points and scattering tables have none.
    pub fn of(scene: &Scene) -> Faces {
        let mut parts = Vec::new();
        let mut coded = Scene::default();
        let mut triangles = 0;
        for o in scene.objects.iter().filter(|o| o.radar) {
            let Shape::Mesh(m) = o.shape else { continue };
            let mesh = &scene.meshes[m];
            let world: Vec<DVec3> = mesh.positions_m.iter().map(|p| o.pose.point(*p)).collect();
            // Facets without normals that turn as those of a curved surface do.
            let mut smoothed = Mesh { normals: Vec::new(), ..mesh.clone() };
            smooth(&mut smoothed, SMOOTH_DEG);
            let faceted = |t: usize| smoothed.corner_normals(t).is_some() && mesh.corner_normals(t).is_none();
            let found = SurfaceParts::of(&world, &mesh.triangles, SMOOTH_DEG.to_radians(), faceted);
            let first = parts.len() as u32;
            parts.extend((0..found.lists.len()).map(|i| part(mesh, &world, &found, i)));
            triangles += mesh.triangles.len();
            if triangles <= MOST_TRIANGLES {
                // One material for each surface, so that faces do not join over their borders and tell which they belong to.
                let of_list =
                    |list: &Vec<usize>| scene.materials.get(mesh.material[list[0]] as usize).cloned();
                coded.materials.extend(found.lists.iter().map(|l| of_list(l).unwrap_or_else(Material::pec)));
                let material = found.of.iter().map(|i| first + i).collect();
                let mesh = Mesh {
                    positions_m: world,
                    triangles: mesh.triangles.clone(),
                    material,
                    ..Mesh::default()
                };
                coded.add_mesh(&o.name, "", mesh, Pose::IDENTITY);
            }
        }
        let coded = (triangles > 0 && triangles <= MOST_TRIANGLES)
            .then(|| Arc::new(Coded { scene: coded, triangles }));
        Faces { parts, coded, bounds_m: scene.bounds_m(0.0) }
    }

    /// Judges a sweep over frequencies and directions of the transmitter, with the receiver at its side or elsewhere.
    pub fn validity(
        &self,
        frequencies_hz: &[f64],
        transmit: &[Aspect],
        is_bistatic: bool,
        options: &RcsOptions,
    ) -> Validity {
        let mut out = Validity::default();
        let lowest = frequencies_hz.iter().copied().fold(f64::INFINITY, f64::min);
        if !lowest.is_finite() {
            return out;
        }
        let lambda = wavelength_m(lowest);
        let every = |most: usize| {
            let step = transmit.len().div_ceil(most).max(1);
            transmit.iter().step_by(step).chain(transmit.last())
        };
        let by_chains = match &self.coded {
            Some(coded) if !is_bistatic => {
                let most = if coded.triangles <= FEW_TRIANGLES { MOST_DIRECTIONS } else { FEW_DIRECTIONS };
                self.by_chains(coded, lowest, every(most), options.bounces.min(BOUNCES)).ok()
            }
            _ => None,
        };
        if let Some(echoing) = &by_chains {
            self.add_sizes(&mut out, echoing, lambda);
        }
        for a in every(MOST_DIRECTIONS) {
            let u = direction_from_angles(a.azimuth, a.elevation);
            let shown = |p: &Part| match p.normal {
                Some(n) => p.area_m2 * n.dot(u).abs(),
                None => p.width_m * p.width_m,
            };
            let most = self.parts.iter().map(shown).fold(0.0, f64::max);
            let counted = || (0..self.parts.len()).filter(|i| shown(&self.parts[*i]) >= COUNTS * most);
            if by_chains.is_none() {
                self.add_sizes(&mut out, &counted().collect::<Vec<_>>(), lambda);
            }
            // Of a curved surface there is a place that is seen upright.
            let sine = |i: usize| self.parts[i].normal.map_or(1.0, |n| n.dot(u).abs());
            if let Some(sine) = counted().map(sine).reduce(f64::max)
                && sine < GRAZING_DEG.to_radians().sin()
            {
                out.add_grazing(sine.asin().to_degrees());
            }
        }
        let below = transmit.iter().copied().min_by(|a, b| a.elevation.total_cmp(&b.elevation));
        if let (Some(bounds), Some(aspect)) = (self.bounds_m, below) {
            out.ground = ground::remark(bounds, lowest, aspect, options);
        }
        out
    }

    fn add_sizes(&self, out: &mut Validity, echoing: &[usize], lambda: f64) {
        let of = |f: fn(&Part) -> f64| echoing.iter().map(move |i| f(&self.parts[*i]));
        if let Some(w) = of(|p| p.width_m).reduce(f64::min)
            && w < LARGE * lambda
        {
            out.add_small([(w, lambda); 2]);
        }
        let sagitta_m = of(|p| p.sagitta_m).fold(0.0, f64::max);
        if 2.0 * std::f64::consts::TAU / lambda * sagitta_m > FACETED_RAD {
            out.add_faceted((sagitta_m, lambda));
        }
    }

    /// The surfaces that make the echo in any of the directions.
    fn by_chains<'a>(
        &self,
        coded: &Coded,
        freq_hz: f64,
        directions: impl Iterator<Item = &'a Aspect>,
        bounces: usize,
    ) -> Result<Vec<usize>> {
        let geometry = Geometry::build(&coded.scene, 0.0, freq_hz)?;
        let surfaces = surfaces_at(&coded.scene, freq_hz)?;
        let point = FrequencyPoint { wavenumber: wavenumber(freq_hz), surfaces: &surfaces };
        let options = BeamOptions { facets_reflect: true, ..BeamOptions::new(bounces.max(1), 0.2, false) };
        let looks: Vec<Vec<(Vec<u32>, f64)>> = directions
            .map(|a| {
                let port = Port::Far(direction_from_angles(a.azimuth, a.elevation));
                beam_sum::by_chains(geometry.faces(), &point, port, &options)
            })
            .collect();
        let strongest = |chains: &[(Vec<u32>, f64)]| chains.iter().map(|c| c.1).fold(0.0, f64::max);
        let most = looks.iter().map(|l| strongest(l)).fold(0.0, f64::max);
        let mut echoing: Vec<usize> = Vec::new();
        for chains in looks.iter().filter(|l| strongest(l) >= CHAIN_COUNTS * most) {
            let least = CHAIN_COUNTS * strongest(chains);
            let counted = chains.iter().filter(|c| c.1 > 0.0 && c.1 >= least);
            echoing.extend(counted.flat_map(|c| c.0.iter().map(|i| *i as usize)));
        }
        echoing.sort_unstable();
        echoing.dedup();
        Ok(echoing)
    }
}

impl Validity {
    /// Takes from `other` what is worse.
    pub fn add(&mut self, other: &Validity) {
        other.small.into_iter().for_each(|s| self.add_small(s));
        other.faceted.into_iter().for_each(|f| self.add_faceted(f));
        other.grazing_deg.into_iter().for_each(|g| self.add_grazing(g));
        if let Some(g) = other.ground
            && self.ground.is_none_or(|own| g.zone.length_m() > own.zone.length_m())
        {
            self.ground = Some(g);
        }
    }

    fn add_small(&mut self, [least, largest]: [(f64, f64); 2]) {
        let waves = |(w, lambda): (f64, f64)| w / lambda;
        let [a, b] = self.small.unwrap_or([least, largest]);
        self.small = Some([
            if waves(least) < waves(a) { least } else { a },
            if waves(largest) > waves(b) { largest } else { b },
        ]);
    }

    fn add_faceted(&mut self, (sagitta, lambda): (f64, f64)) {
        if self.faceted.is_none_or(|(s, l)| sagitta / lambda > s / l) {
            self.faceted = Some((sagitta, lambda));
        }
    }

    fn add_grazing(&mut self, deg: f64) {
        self.grazing_deg = Some(self.grazing_deg.map_or(deg, |g| g.min(deg)));
    }

    /// Remarks of one line each, in the same words wherever they are written.
    pub fn lines(&self) -> Vec<String> {
        let mut out = Vec::new();
        if let Some([(w, lambda), (most, most_lambda)]) = self.small {
            let size = match (w / lambda, most / most_lambda) {
                (a, b) if b - a < 0.005 => format!("{} mm, {a:.2} wavelengths", millimetres(w)),
                (a, b) => {
                    format!("{} to {} mm, {a:.2} to {b:.2} wavelengths", millimetres(w), millimetres(most))
                }
            };
            out.push(format!(
                "size: the narrowest surfaces that contribute to the echo measure {size}: the error of physical optics is about 2 dB at two wavelengths and 3 to 4 dB at one; at half a wavelength and below the result is not a prediction, and HH near grazing is some 14 dB too high"
            ));
        }
        if let Some((sagitta, lambda)) = self.faceted {
            out.push(format!(
                "facets: flat facets represent a curved surface and deviate from it by up to {} mm ({:.3} wavelengths), which may change the result by several dB; give the file smooth normals, or give --smooth-deg another value than 0",
                millimetres(sagitta),
                sagitta / lambda
            ));
        }
        if let Some(deg) = self.grazing_deg {
            out.push(format!(
                "grazing: in some directions every visible face is seen at less than {GRAZING_DEG} deg from its own plane; the minimum is {deg:.1} deg. There, physical optics does not model the echoes of edges or the difference between VV and HH; --diffraction ptd adds the edges of metal, to first order"
            ));
        }
        out.extend(self.ground.map(|g| g.to_string()));
        out
    }
}

/// Two digits behind the point below 10 mm.
fn millimetres(metres: f64) -> String {
    let mm = 1e3 * metres;
    if mm < 10.0 { format!("{mm:.2}") } else { format!("{mm:.1}") }
}

/// Surface number `i` of a mesh whose corners are `world`.
fn part(mesh: &Mesh, world: &[DVec3], found: &SurfaceParts, i: usize) -> Part {
    let own = &found.lists[i];
    let corners = |t: usize| mesh.triangles[t].map(|v| world[v as usize]);
    let doubled = |t: usize| {
        let [a, b, c] = corners(t);
        (b - a).cross(c - a)
    };
    let area_m2: f64 = own.iter().map(|t| 0.5 * doubled(*t).length()).sum();
    let normal =
        own.iter().map(|t| doubled(*t).normalize_or_zero()).find(|n| *n != DVec3::ZERO).unwrap_or(DVec3::X);
    let is_flat =
        own.iter().all(|t| normal.cross(doubled(*t)).length() <= COPLANAR_RAD * doubled(*t).length());
    let points = || own.iter().flat_map(|t| corners(*t));
    if !is_flat {
        let (lo, hi) = points().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(p), hi.max(p)));
        let mut extents = (hi - lo).to_array();
        extents.sort_by(f64::total_cmp);
        return Part { normal: None, area_m2, width_m: extents[1], sagitta_m: found.sagitta_m[i] };
    }
    let across = own
        .iter()
        .map(|t| corners(*t))
        .flat_map(|[a, b, c]| [b - a, c - b, a - c])
        .filter_map(|e| e.try_normalize())
        .take(MOST_EDGES)
        .map(|e| normal.cross(e));
    // The least distance of two parallel lines that hold the face lies along one of its edges.
    let width = |d: DVec3| {
        let along = points().map(|p| d.dot(p));
        let ends = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        ends.1 - ends.0
    };
    let widest = across.map(width).fold(f64::INFINITY, f64::min);
    // A lattice is as wide as its bars: a strip has twice its area over its border.
    let border_m = found.border_m[i];
    let width_m = if 4.0 * area_m2 < 0.5 * widest * border_m { 2.0 * area_m2 / border_m } else { widest };
    Part { normal: Some(normal), area_m2, width_m, sagitta_m: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::rcs::{Distance, Ground};
    use crate::scene::Material;

    fn rectangle(width_m: f64, height_m: f64) -> Scene {
        let (w, h) = (0.5 * width_m, 0.5 * height_m);
        let corners = [(-w, -h), (w, -h), (w, h), (-w, h)];
        let mut scene = Scene::default();
        let material = scene.material_index(&Material::pec());
        let mesh = Mesh {
            positions_m: corners.iter().map(|(y, z)| DVec3::new(0.0, *y, *z)).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: vec![material; 2],
            normals: Vec::new(),
        };
        scene.add_mesh("plate", "", mesh, Pose::IDENTITY);
        scene
    }

    fn said(scene: &Scene, freq_hz: f64, azimuth_deg: f64) -> Vec<String> {
        let aspect = Aspect { azimuth: azimuth_deg.to_radians(), elevation: 0.0 };
        Faces::of(scene).validity(&[freq_hz], &[aspect], false, &RcsOptions::default()).lines()
    }

    #[test]
    fn a_face_is_measured_across_and_not_by_its_triangles() {
        let faces = Faces::of(&rectangle(0.1, 0.02));
        assert_eq!(faces.parts.len(), 1);
        assert!((faces.parts[0].width_m - 0.02).abs() < 1e-12, "{faces:?}");
        assert!((faces.parts[0].area_m2 - 0.002).abs() < 1e-12);
    }

    #[test]
    fn small_and_grazing_faces_are_named() {
        // 12.5 mm at 24 GHz: 3 mm are a quarter of it.
        let small = said(&rectangle(0.1, 0.003), 24e9, 0.0);
        assert!(small.len() == 1 && small[0].contains("3.00 mm, 0.24 wavelengths"), "{small:?}");
        assert!(said(&rectangle(0.1, 0.05), 24e9, 0.0).is_empty());
        let grazing = said(&rectangle(0.1, 0.05), 24e9, 85.0);
        assert!(grazing.len() == 1 && grazing[0].contains("the minimum is 5.0 deg"), "{grazing:?}");
        // The worst of several is kept.
        let mut all = Validity::default();
        for h in [0.003, 0.006, 0.1] {
            let v = Faces::of(&rectangle(0.1, h));
            let ahead = Aspect { azimuth: 0.0, elevation: 0.0 };
            all.add(&v.validity(&[24e9], &[ahead], false, &RcsOptions::default()));
        }
        assert!(all.lines()[0].contains("3.00 to 6.00 mm, 0.24 to 0.48 wavelengths"), "{all:?}");
    }

    #[test]
    fn the_ground_is_judged_at_the_targets_height() {
        let options = |height_m: f64| RcsOptions {
            ground: Ground::Plane(Material::pec()),
            distance: Distance::At(40.0),
            height_m,
            ..Default::default()
        };
        let low = Aspect { azimuth: 0.0, elevation: 1f64.to_radians() };
        let faces = Faces::of(&rectangle(0.1, 0.1));
        let lines = |h: f64| faces.validity(&[77e9], &[low], false, &options(h)).lines();
        assert!(
            lines(0.001).iter().any(|l| l.starts_with("ground: at elevation 1.000 deg")),
            "{:?}",
            lines(0.001)
        );
        assert!(lines(3.0).is_empty(), "{:?}", lines(3.0));
    }
}
