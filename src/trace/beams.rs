//! Exact beams (CONVENTIONS eq. 50-54): polygons of rays that are clipped against the faces they meet, so
//! that each chain of flat facets is one closed-form integral.

use crate::geom::faces::Faces;
use crate::gpu_struct;
use glam::{DVec2, DVec3};

/// Number of corners that a polygon may have while it is cut.
pub const CAP: usize = 24;

/// The quadratic phase, rad, that a cell may have across half its width when an error of 0.2 dB is allowed
/// at finite range.
const TAU_AT_FIFTH_DB: f64 = 0.25;

/// As `BeamOptions::followed_alone`: a face takes some 50 us.
const FOLLOWED_ALONE: usize = 128;
/// As `BeamOptions::occluders_listed`. Time hardly changes from 512 on; the limit is there for beams that meet most of a large scene.
const OCCLUDERS_LISTED: usize = 1024;

/// How to follow beams and how finely to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamOptions {
    /// Largest number of faces met by one beam.
    pub bounces: usize,
    /// Quadratic phase allowed across half a cell, rad (finite range only).
    pub tau: f64,
    /// Whether to find also where beams leave the target, for the convention "last".
    pub last: bool,
    /// Whether to list also what is lit by way of a plane beside which it is small, whether the receiver sees it or
    /// not.
    pub images: bool,
    /// Cross sections: facets of curved surfaces stand for ray tubes that reflect to other curved surfaces alone. Otherwise beams end on facets
    /// that are curved, and those that are taken for flat are as any plane.
    pub facets_reflect: bool,
    /// Number of faces ahead of a beam up to which the faces that hide one of them are looked for among them; above it,
    /// and with 0 always, in the tree of all faces. It changes only the time: both find the same.
    pub occluders_listed: usize,
    /// Number of faces that may be ahead of a beam up to which one task follows it; with 0 several follow every beam that goes on. It
    /// changes only the time.
    pub followed_alone: usize,
}

impl BeamOptions {
    /// Options for an error of `accuracy_db`: the error of the quadratic phase grows with its square.
    pub fn new(bounces: usize, accuracy_db: f64, last: bool) -> Self {
        BeamOptions {
            bounces,
            tau: TAU_AT_FIFTH_DB * (accuracy_db / 0.2).sqrt(),
            last,
            images: false,
            facets_reflect: false,
            occluders_listed: OCCLUDERS_LISTED,
            followed_alone: FOLLOWED_ALONE,
        }
    }
}

/// A place or a direction from which waves come or to which they go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Port {
    /// Unit vector from the target towards the radar at infinity.
    Far(DVec3),
    /// A port at this place, m.
    At(DVec3),
}

/// Where a beam's rays run. For a plane wave through `origin` the ray at (u, v) is
/// origin + u axis_u + v axis_v + w axis_k; from a point it is origin + t (axis_k + u axis_u + v axis_v).
///
/// A mirror takes the frame with it, and then the coordinates (u, v) of a place on the mirror are the same
/// before and after, and so is the length of the path there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin of the rays, m.
    pub origin: DVec3,
    /// Axis of u.
    pub u: DVec3,
    /// Axis of v.
    pub v: DVec3,
    /// Axis that the rays run along.
    pub k: DVec3,
    /// Whether rays spread from the origin; otherwise they run in parallel.
    pub from_point: bool,
    /// Length to add to the distance from `origin` (plane waves: phase zero is at the world's origin).
    pub lead_m: f64,
}

impl Frame {
    /// Rays from `port` towards a target around `centre`.
    pub fn new(port: Port, centre: DVec3) -> Frame {
        let (origin, k, from_point, lead_m) = match port {
            Port::Far(towards) => (centre, -towards, false, -towards.dot(centre)),
            Port::At(p) => (p, (centre - p).normalize(), true, 0.0),
        };
        let (u, v) = k.any_orthonormal_pair();
        Frame { origin, u, v, k, from_point, lead_m }
    }

    /// Tells how a plane faces the source: negative where its front is lit. For a point source it is a distance, m,
    /// else a cosine.
    #[inline]
    pub fn facing(&self, normal: DVec3, offset: f64) -> f64 {
        if self.from_point { offset - normal.dot(self.origin) } else { normal.dot(self.k) }
    }

    /// Coordinates (u, v) of the ray through a place.
    #[inline]
    pub fn project(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        let uv = DVec2::new(self.u.dot(d), self.v.dot(d));
        if self.from_point { uv / self.k.dot(d) } else { uv }
    }

    /// Coefficients (a, b, c) of nearness a u + b v + c of a plane: the larger, the nearer to the source.
    #[inline]
    pub fn nearness(&self, normal: DVec3, offset: f64) -> DVec3 {
        let (nu, nv, nk) = (normal.dot(self.u), normal.dot(self.v), normal.dot(self.k));
        let h = offset - normal.dot(self.origin);
        if self.from_point { DVec3::new(nu, nv, nk) / h } else { DVec3::new(nu, nv, -h) / nk }
    }

    /// Place where the ray at `uv` meets the plane, m.
    #[inline]
    pub fn lift(&self, uv: DVec2, nearness: DVec3) -> DVec3 {
        let q = nearness.x * uv.x + nearness.y * uv.y + nearness.z;
        let across = self.u * uv.x + self.v * uv.y;
        if self.from_point { self.origin + (self.k + across) / q } else { self.origin + across - self.k * q }
    }

    /// Direction of the ray at `uv`.
    #[inline]
    pub fn direction(&self, uv: DVec2) -> DVec3 {
        if self.from_point { (self.k + self.u * uv.x + self.v * uv.y).normalize() } else { self.k }
    }

    /// Length of the path to `p`, which the frame's mirror images share.
    #[inline]
    pub fn length_m(&self, p: DVec3) -> f64 {
        let d = p - self.origin;
        self.lead_m + if self.from_point { d.length() } else { self.k.dot(d) }
    }

    /// The frame behind the mirror where `normal . r` equals `offset`.
    pub fn mirrored(&self, normal: DVec3, offset: f64) -> Frame {
        let flip = |d: DVec3| d - normal * (2.0 * normal.dot(d));
        Frame {
            origin: self.origin - normal * (2.0 * (normal.dot(self.origin) - offset)),
            u: flip(self.u),
            v: flip(self.v),
            k: flip(self.k),
            ..*self
        }
    }
}

gpu_struct! {
    /// Uniform of the kernels of beams (`shaders/shared/beams.wgsl`).
    pub struct BeamParams {
        pub first: u32,
        pub count: u32,
        pub mode: u32,
        pub level: u32,
        pub faces: u32,
        pub nodes_at: u32,
        pub go_on: u32,
        pub last: u32,
        pub port: u32,
        pub monostatic: u32,
        pub probe: u32,
        pub flat: f32,
        pub eps: f32,
        pub wavenumber: f32,
        pub tau: f32,
        pub nodes: u32,
        pub threads: u32,
        pub sides_at: u32,
        pub halvings: u32,
        pub pad0: u32,
    }
}

/// Depths and coordinates in f32 are rounded by less than this share of the target's radius.
const ROUNDING: f64 = 1e-6;
/// Words of a record in `shaders/shared/beams.wgsl`.
pub const RECORD: usize = 9;
/// Words of scratch memory that a thread of the kernels of beams has, `shaders/shared/polygon.wgsl`.
pub const SCRATCH: usize = 440;
/// Faces that the leaves of the shaders' tree can tell apart, and faces of one leaf.
pub const MOST_FACES: usize = 1 << 24;

/// Up to so many faces there is a table of which lies on what side of which: a quarter of a million pairs.
const TABLE_FACES: usize = 512;
/// So few faces stand in one leaf: looking at their boxes would cost more than looking at them.
const LEAF_FACES: usize = 8;

/// The faces as the shaders read them.
pub struct BeamArrays {
    /// Index of the body of each face, packed.
    pub body: Vec<[u32; 4]>,
    /// Parameters that hold for every dispatch.
    pub params: BeamParams,
}

impl BeamArrays {
    /// The arrays of a scene's faces.
    pub fn new(faces: &Faces, options: &BeamOptions, monostatic: bool) -> BeamArrays {
        let word = |v: DVec3, bits: u32| {
            let [x, y, z] = v.as_vec3().to_array().map(f32::to_bits);
            [x, y, z, bits]
        };
        let mut body =
            Vec::with_capacity(3 * faces.faces.len() + faces.corners.len() + 2 * faces.nodes.len());
        for f in &faces.faces {
            let offset = f.offset_m - f.normal.dot(faces.centre_m);
            body.push(word(f.normal, (offset as f32).to_bits()));
            body.push(word(f.axis[0], f.first));
            body.push(word(f.axis[1], f.count | (f.one_sided as u32) << 8 | f.surface << 16));
        }
        let corners_at = body.len();
        body.extend(faces.corners.iter().map(|c| word(*c - faces.centre_m, 0)));
        for f in &faces.faces {
            let of_face = corners_at + f.first as usize;
            body[of_face..of_face + f.count as usize].iter_mut().for_each(|c| c[3] = f.patch);
        }
        let nodes_at = body.len() as u32;
        // In the order of a walk; each node knows where the walk goes on when it skips the branch.
        let few = faces.faces.len() <= LEAF_FACES;
        let mut stack = if faces.nodes.is_empty() { vec![] } else { vec![(0usize, true)] };
        let mut open = Vec::new();
        while let Some((i, enter)) = stack.pop() {
            if !enter {
                let next = (body.len() - nodes_at as usize) as u32 / 2;
                if let Some(at) = open.pop() {
                    let skip: &mut [u32; 4] = &mut body[at];
                    skip[3] = next;
                }
                continue;
            }
            let n = &faces.nodes[i];
            open.push(body.len());
            body.push(word(n.centre - faces.centre_m, 0));
            let (first, count) = if few { (0, faces.faces.len() as u32) } else { (n.first, n.count) };
            let leaf = if count > 0 { first | count << 24 } else { 0 };
            body.push(word(n.half + DVec3::splat(ROUNDING * faces.radius_m), leaf));
            stack.push((i, false));
            if count == 0 {
                stack.extend([(n.first as usize + 1, true), (n.first as usize, true)]);
            }
        }
        let nodes = (body.len() as u32 - nodes_at) / 2;
        let rounding = ROUNDING * faces.radius_m;
        let flat_m = faces.flat_m.max(rounding);
        let sides_at = if faces.faces.len() <= TABLE_FACES { body.len() as u32 } else { 0 };
        if sides_at > 0 {
            body.append(&mut sides(faces, flat_m));
        }
        let params = BeamParams {
            faces: faces.faces.len() as u32,
            nodes_at,
            nodes,
            last: options.last as u32,
            monostatic: monostatic as u32,
            probe: 4,
            flat: flat_m as f32,
            sides_at,
            eps: rounding as f32,
            tau: options.tau as f32,
            ..Default::default()
        };
        BeamArrays { body, params }
    }
}

/// Compares each face with each other: bit 0 is set when no corner of the other is above the plane, bit 1 when none is
/// below.
fn sides(faces: &Faces, flat_m: f64) -> Vec<[u32; 4]> {
    let n = faces.faces.len();
    let mut words = vec![[0u32; 4]; (2 * n * n).div_ceil(128)];
    for (f, plane) in faces.faces.iter().enumerate() {
        for (g, other) in faces.faces.iter().enumerate() {
            let depth = |c: &DVec3| plane.normal.dot(*c) - plane.offset_m;
            let below = faces.corners(other).iter().all(|c| depth(c) <= flat_m);
            let above = faces.corners(other).iter().all(|c| depth(c) >= -flat_m);
            let bit = 2 * (f * n + g);
            words[bit / 128][bit / 32 % 4] |= (below as u32 | (above as u32) << 1) << (bit % 32);
        }
    }
    words
}

impl Port {
    /// The frame of the port's rays towards `centre` as three words: (u, 1 / distance), (v, 0), (k, 0).
    pub fn words(self, centre: DVec3) -> [[f32; 4]; 3] {
        let (k, inv_distance) = match self {
            Port::Far(towards) => (-towards, 0.0),
            Port::At(p) => ((centre - p).normalize(), 1.0 / (centre - p).length()),
        };
        let (u, v) = k.any_orthonormal_pair();
        let word = |d: DVec3, w: f64| {
            let [x, y, z] = d.as_vec3().to_array();
            [x, y, z, w as f32]
        };
        [word(u, inv_distance), word(v, 0.0), word(k, 0.0)]
    }

    /// How much longer the way from the port to `centre` is than that to the world's origin, m (at infinity along the
    /// wave), and one over the distance to `centre` (1 at infinity).
    pub fn lead(self, centre: DVec3) -> (f64, f64) {
        match self {
            Port::Far(towards) => (-towards.dot(centre), 1.0),
            Port::At(p) => ((centre - p).length() - p.length(), 1.0 / (centre - p).length()),
        }
    }
}
