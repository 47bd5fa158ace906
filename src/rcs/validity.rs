//! Where physical optics ends: how large the faces that a radar sees are in wavelengths, how near to grazing they are
//! seen, and where the ground is none of a plane's. One judgement for every output of a cross section.
//!
//! A face is a plane part of a mesh, however it is cut into triangles. A face counts at a direction when it shows the radar a
//! twentieth of what the largest shows, or more; shadows are not looked for. Of a curved part the second extent of its
//! bounds counts.

use super::ground::{self, GroundRemark};
use super::{Aspect, RcsOptions};
use crate::base::frames::direction_from_angles;
use crate::base::units::wavelength_m;
use crate::geom::patches::coplanar_patches;
use crate::scene::{Mesh, Scene, Shape};
use glam::DVec3;

/// Faces of so many wavelengths and more are large.
const LARGE: f64 = 2.0;
/// Faces that are seen nearer than this to their own plane are seen at grazing, deg.
const GRAZING_DEG: f64 = 15.0;
/// Share of the largest face's shadow that makes a face count.
const COUNTS: f64 = 0.05;
/// Most directions of one sweep that are looked at.
const MOST_DIRECTIONS: usize = 181;
/// Facets whose normals differ by less are in one plane: files hold places in f32.
const COPLANAR_RAD: f64 = 1e-5;
/// Most directions of edges in which the width of one face is measured.
const MOST_EDGES: usize = 64;

/// A plane part of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Face {
    normal: DVec3,
    area_m2: f64,
    width_m: f64,
}

/// The plane and curved parts of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Faces {
    flat: Vec<Face>,
    /// Widths of the curved parts, m.
    curved: Vec<f64>,
    bounds_m: Option<(DVec3, DVec3)>,
}

/// Where the assumptions of physical optics do not hold for a sweep. The default says nothing against it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Validity {
    /// (width in m, wavelength in m) of the faces that are smallest and largest in wavelengths, of those that are too small.
    small: Option<[(f64, f64); 2]>,
    /// Angle between the direction and the nearest to upright of the faces that count, deg.
    grazing_deg: Option<f64>,
    ground: Option<GroundRemark>,
}

impl Faces {
    /// Finds the parts of a scene's meshes. Points and scattering tables have none.
    pub fn of(scene: &Scene) -> Faces {
        let (mut flat, mut curved) = (Vec::new(), Vec::new());
        for o in scene.objects.iter().filter(|o| o.radar) {
            let Shape::Mesh(m) = o.shape else { continue };
            let mesh = &scene.meshes[m];
            let world: Vec<DVec3> = mesh.positions_m.iter().map(|p| o.pose.point(*p)).collect();
            flat.extend(faces(mesh, &world));
            curved.extend(curved_width(mesh, &world));
        }
        Faces { flat, curved, bounds_m: scene.bounds_m(0.0) }
    }

    /// Judges a sweep over frequencies and directions of the transmitter.
    pub fn validity(&self, frequencies_hz: &[f64], transmit: &[Aspect], options: &RcsOptions) -> Validity {
        let mut out = Validity::default();
        let lowest = frequencies_hz.iter().copied().fold(f64::INFINITY, f64::min);
        if !lowest.is_finite() {
            return out;
        }
        let lambda = wavelength_m(lowest);
        let step = transmit.len().div_ceil(MOST_DIRECTIONS).max(1);
        for a in transmit.iter().step_by(step).chain(transmit.last()) {
            let u = direction_from_angles(a.azimuth, a.elevation);
            let shown = |f: &Face| f.area_m2 * f.normal.dot(u).abs();
            let of_curved = self.curved.iter().map(|w| w * w).fold(0.0, f64::max);
            let most = self.flat.iter().map(shown).fold(of_curved, f64::max);
            let counted = || self.flat.iter().filter(|f| shown(f) >= COUNTS * most);
            let curved = self.curved.iter().copied().filter(|w| w * w >= COUNTS * most);
            if let Some(w) = counted().map(|f| f.width_m).chain(curved).reduce(f64::min)
                && w < LARGE * lambda
            {
                out.add_small([(w, lambda); 2]);
            }
            if of_curved < COUNTS * most
                && let Some(sine) = counted().map(|f| f.normal.dot(u).abs()).reduce(f64::max)
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
}

impl Validity {
    /// Takes from `other` what is worse.
    pub fn add(&mut self, other: &Validity) {
        other.small.into_iter().for_each(|s| self.add_small(s));
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
                "size: the narrowest faces that the radar sees measure {size}: physical optics is within about 2 dB at two wavelengths and \
                 3 to 4 dB at one; at half a wavelength and below its level is not a prediction, and HH near grazing is some 14 dB too high"
            ));
        }
        if let Some(deg) = self.grazing_deg {
            out.push(format!(
                "grazing: there are directions in which no face is seen at {GRAZING_DEG} deg or more from its own plane; the least is {deg:.1} deg. Physical optics \
                 does not tell there what edges send back, nor VV from HH; --diffraction ptd is what adds the edges of metal, to first order"
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

/// The plane parts of a mesh whose corners are `world`.
fn faces(mesh: &Mesh, world: &[DVec3]) -> Vec<Face> {
    let doubled = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let corners = |t: &[u32; 3]| t.map(|v| world[v as usize]);
    let flat: Vec<[u32; 3]> = (0..mesh.triangles.len())
        .filter(|t| mesh.corner_normals(*t).is_none())
        .map(|t| mesh.triangles[t])
        .filter(|t| doubled(corners(t)).length() > 0.0)
        .collect();
    let (patch, count) = coplanar_patches(world, &flat, COPLANAR_RAD);
    let mut parts: Vec<Vec<[DVec3; 3]>> = vec![Vec::new(); count as usize];
    for (t, patch) in flat.iter().zip(patch) {
        parts[patch as usize].push(corners(t));
    }
    let face = |part: &Vec<[DVec3; 3]>| {
        let normal = doubled(part[0]).normalize();
        let across = part
            .iter()
            .flat_map(|[a, b, c]| [*b - *a, *c - *b, *a - *c])
            .filter_map(|e| e.try_normalize())
            .take(MOST_EDGES)
            .map(|e| normal.cross(e));
        // The least distance of two parallel lines that hold the face lies along one of its edges.
        let width = |d: DVec3| {
            let along = part.iter().flatten().map(|p| d.dot(*p));
            let ends = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
            ends.1 - ends.0
        };
        Face {
            normal,
            area_m2: part.iter().map(|t| 0.5 * doubled(*t).length()).sum(),
            width_m: across.map(width).fold(f64::INFINITY, f64::min),
        }
    };
    parts.iter().map(face).collect()
}

/// The second of the extents of the curved facets, if there are any.
fn curved_width(mesh: &Mesh, world: &[DVec3]) -> Option<f64> {
    let curved = (0..mesh.triangles.len()).filter(|t| mesh.corner_normals(*t).is_some());
    let points = curved.flat_map(|t| mesh.triangles[t].map(|v| world[v as usize]));
    let (lo, hi) = points.fold(None, |r: Option<(DVec3, DVec3)>, p| {
        Some(r.map_or((p, p), |(lo, hi)| (lo.min(p), hi.max(p))))
    })?;
    let mut extents = (hi - lo).to_array();
    extents.sort_by(f64::total_cmp);
    Some(extents[1])
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
        Faces::of(scene).validity(&[freq_hz], &[aspect], &RcsOptions::default()).lines()
    }

    #[test]
    fn a_face_is_measured_across_and_not_by_its_triangles() {
        let faces = Faces::of(&rectangle(0.1, 0.02));
        assert_eq!(faces.flat.len(), 1);
        assert!((faces.flat[0].width_m - 0.02).abs() < 1e-12, "{faces:?}");
        assert!((faces.flat[0].area_m2 - 0.002).abs() < 1e-12);
    }

    #[test]
    fn small_and_grazing_faces_are_named() {
        // 12.5 mm at 24 GHz: 3 mm are a quarter of it.
        let small = said(&rectangle(0.1, 0.003), 24e9, 0.0);
        assert!(small.len() == 1 && small[0].contains("3.00 mm, 0.24 wavelengths"), "{small:?}");
        assert!(said(&rectangle(0.1, 0.05), 24e9, 0.0).is_empty());
        let grazing = said(&rectangle(0.1, 0.05), 24e9, 85.0);
        assert!(grazing.len() == 1 && grazing[0].contains("the least is 5.0 deg"), "{grazing:?}");
        // The worst of several is kept.
        let mut all = Validity::default();
        for h in [0.003, 0.006, 0.1] {
            let v = Faces::of(&rectangle(0.1, h));
            let ahead = Aspect { azimuth: 0.0, elevation: 0.0 };
            all.add(&v.validity(&[24e9], &[ahead], &RcsOptions::default()));
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
        let lines = |h: f64| faces.validity(&[77e9], &[low], &options(h)).lines();
        assert!(
            lines(0.001).iter().any(|l| l.starts_with("ground: at elevation 1.000 deg")),
            "{:?}",
            lines(0.001)
        );
        assert!(lines(3.0).is_empty(), "{:?}", lines(3.0));
    }
}
