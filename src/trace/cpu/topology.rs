//! What f32 needs to decide which beam meets what, and what f64 makes of the decisions.
//!
//! Places of computed corners in f32 would err by micrometres at 100 m, which is hundredths of a radian at 77 GHz and more near grazing.
//! So a device without f64 keeps no computed corner as a place. Its coordinates of view say which side of a line a corner is on, and nothing
//! else; a corner is the pair of lines that it lies on (an edge of a face, the crossing of two planes, a wall of a window, a line that
//! halves a polygon), as seen through a chain of mirrors, and its place is worked out from these here.
//!
//! Rules without which corners are wrong: a line knows the view in which it was seen; the direction of an edge comes from the stored edge,
//! never from two corners, and the side on which a polygon lies from how faces are wound; a target is cut by the sides of its beam, not
//! the beam by those of the target; a corner is on a line that is no farther than what rounding makes of its coordinates
//! (`shaders/shared/views.wgsl`).

use super::beams::Clipper;
use crate::geom::faces::{Face, Faces, LIES_M};
use crate::geom::hash::FastMap;
use crate::trace::beams::{BeamOptions, Frame};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};

/// A corner's place from its lines, seen from the radar, lies no farther from its coordinates than this; else the lines all but coincide,
/// and the coordinates decide.
const ASTRAY: f64 = 3e-5;
/// Share of the scene's radius by which boxes may be off in f32.
pub(crate) const PAD: f64 = 1e-6;
/// Farthest from a face's corner that a corner of a piece may be, m: beyond lies the horizon.
const FARTHEST_M: f64 = 1e5;

/// Walls of a window: inside where positive, in coordinates along (u, v, k).
const WALLS: [DVec3; 4] = [
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(-1.0, 0.0, 1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, -1.0, 1.0),
];

/// A line from which its plane of view can be had again exactly, and the view in which it was seen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Line {
    pub of: Of,
    pub view: u32,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Of {
    Edge(u32),
    /// Where the planes of two patches cross.
    Crossing([u32; 2]),
    /// A wall of the window.
    Wall(u32),
    /// Where u (axis 0) or v (1) has this value, as the bits of an f32: polygons of many corners are halved there.
    Halving {
        axis: u32,
        bits: u32,
    },
}

/// A corner of a polygon in the coordinates of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub at: Vec2,
    /// The two lines that it lies on.
    pub on: [Line; 2],
}

/// 1 where a plane's front is lit, which faces the radar with less than zero.
pub(super) fn front(facing: f32) -> f32 {
    if facing < 0.0 { 1.0 } else { -1.0 }
}

/// A view along rays from the radar or one of its images.
pub(super) struct View {
    pub frame: Frame,
    /// Rows that take places from the radar along the sensor's axes to (u, v, k).
    pub rows: [Vec4; 3],
    /// Its origin from the radar along the sensor's axes, m.
    pub origin: Vec3,
    /// The view that the last mirror turned into this one; u32::MAX for a window.
    pub parent: u32,
}

/// The scene as f32 sees it, along the axes of the first window and from the radar, with names for what lines are made of.
pub(crate) struct Shared<'a> {
    pub faces: &'a Faces,
    pub(super) options: &'a BeamOptions,
    /// What decides in f64.
    pub(super) exact: Clipper<'a>,
    axes: [DVec3; 3],
    radar: DVec3,
    pub corners: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub offsets: Vec<f32>,
    /// The edge that begins at each corner.
    pub edge_of: Vec<u32>,
    /// Numbers of its two ends.
    edges: Vec<[u32; 2]>,
    /// From the first of them to the second.
    pub along: Vec<Vec3>,
    vertices: Vec<DVec3>,
    /// A face of each patch, whose plane stands for it.
    pub face_of_patch: Vec<u32>,
}

impl<'a> Shared<'a> {
    pub fn new(faces: &'a Faces, root: &Frame, options: &'a BeamOptions) -> Shared<'a> {
        let (axes, radar) = ([root.k, root.u, root.v], root.origin);
        let turn = |d: DVec3| DVec3::from(axes.map(|a| a.dot(d))).as_vec3();
        let mut numbers: FastMap<[u64; 3], u32> = FastMap::default();
        let mut vertices = Vec::new();
        let ids: Vec<u32> = faces
            .corners
            .iter()
            .map(|c| {
                *numbers.entry(c.to_array().map(f64::to_bits)).or_insert_with(|| {
                    vertices.push(*c);
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        let mut edge_numbers: FastMap<(u32, u32), u32> = FastMap::default();
        let (mut edges, mut along, mut edge_of) = (Vec::new(), Vec::new(), vec![0; faces.corners.len()]);
        let mut face_of_patch = vec![u32::MAX; faces.patch_area_m2.len()];
        for (i, f) in faces.faces.iter().enumerate() {
            let of_patch = &mut face_of_patch[f.patch as usize];
            *of_patch = (*of_patch).min(i as u32);
            for j in 0..f.count {
                let at = |j: u32| ids[(f.first + j % f.count) as usize];
                let (a, b) = (at(j).min(at(j + 1)), at(j).max(at(j + 1)));
                edge_of[(f.first + j) as usize] = *edge_numbers.entry((a, b)).or_insert_with(|| {
                    edges.push([a, b]);
                    along.push(turn(vertices[b as usize] - vertices[a as usize]));
                    edges.len() as u32 - 1
                });
            }
        }
        Shared {
            exact: Clipper { faces, eps: 1e-12, lies_m: LIES_M, options, ends: None, later: false },
            corners: faces.corners.iter().map(|c| turn(*c - radar)).collect(),
            normals: faces.faces.iter().map(|f| turn(f.normal)).collect(),
            offsets: faces.faces.iter().map(|f| (f.offset_m - f.normal.dot(radar)) as f32).collect(),
            faces,
            options,
            axes,
            radar,
            edge_of,
            edges,
            along,
            vertices,
            face_of_patch,
        }
    }

    /// Whether the edge that begins at corner `i` of a face is stored from its other end.
    pub fn runs_back(&self, f: &Face, i: u32) -> bool {
        let begins = self.faces.corners[(f.first + i) as usize];
        let [first, _] = self.edges[self.edge_of[(f.first + i) as usize] as usize];
        self.vertices[first as usize] != begins
    }

    fn turned(&self, d: DVec3) -> Vec3 {
        DVec3::from(self.axes.map(|a| a.dot(d))).as_vec3()
    }

    fn view(&self, frame: Frame, parent: u32) -> View {
        let row = |a: DVec3| self.turned(a).extend(a.dot(self.radar - frame.origin) as f32);
        View {
            rows: [row(frame.u), row(frame.v), row(frame.k)],
            origin: self.turned(frame.origin - self.radar),
            frame,
            parent,
        }
    }
}

/// Views that beams look along.
pub(super) struct Views<'a> {
    pub shared: &'a Shared<'a>,
    /// Those of the windows first.
    pub list: Vec<View>,
    /// By view and patch of the mirror.
    of_mirror: FastMap<(u32, u32), u32>,
}

impl<'a> Views<'a> {
    pub fn new(shared: &'a Shared<'a>, windows: &[Frame]) -> Views<'a> {
        let list = windows.iter().map(|w| shared.view(*w, u32::MAX)).collect();
        Views { shared, list, of_mirror: FastMap::default() }
    }

    /// The view behind the mirror that a face is. Mirrors of one patch have one.
    pub fn mirrored(&mut self, view: u32, face: u32, normal: DVec3) -> u32 {
        let f = &self.shared.faces.faces[face as usize];
        if let Some(known) = self.of_mirror.get(&(view, f.patch)) {
            return *known;
        }
        let frame = self.list[view as usize].frame.mirrored(normal, normal.dot(f.normal) * f.offset_m);
        self.list.push(self.shared.view(frame, view));
        let new = self.list.len() as u32 - 1;
        self.of_mirror.insert((view, f.patch), new);
        new
    }

    /// A view and those before it.
    pub fn behind(&self, view: u32) -> impl Iterator<Item = u32> {
        let before = |v: &u32| Some(self.list[*v as usize].parent).filter(|p| *p != u32::MAX);
        std::iter::successors(Some(view), before)
    }

    /// How a plane faces a view: less than zero where its front is lit, m.
    pub fn facing(&self, view: u32, f: u32) -> f32 {
        let shared = self.shared;
        shared.offsets[f as usize] - shared.normals[f as usize].dot(self.list[view as usize].origin)
    }

    /// A direction seen along one view, after the mirrors that lead on to another.
    fn carried(&self, d: DVec3, from: u32, to: u32) -> DVec3 {
        if from == to {
            return d;
        }
        let (then, now) = (&self.list[from as usize].frame, &self.list[to as usize].frame);
        now.u * d.dot(then.u) + now.v * d.dot(then.v) + now.k * d.dot(then.k)
    }

    /// The normal of the plane of view of a line, for what is lit along `view`.
    fn plane(&self, line: Line, view: u32) -> DVec3 {
        let (frame, shared) = (&self.list[line.view as usize].frame, self.shared);
        let normal = match line.of {
            Of::Edge(edge) => {
                let [a, b] = shared.edges[edge as usize].map(|v| shared.vertices[v as usize]);
                (a - frame.origin).cross(b - a)
            }
            Of::Crossing(patches) => {
                let [p, q] = patches.map(|p| {
                    let f = &shared.faces.faces[shared.face_of_patch[p as usize] as usize];
                    f.normal / (f.offset_m - f.normal.dot(frame.origin))
                });
                p - q
            }
            Of::Wall(wall) => {
                let w = WALLS[wall as usize];
                frame.u * w.x + frame.v * w.y + frame.k * w.z
            }
            Of::Halving { axis, bits } => {
                let along = if axis == 0 { frame.u } else { frame.v };
                along - frame.k * f64::from(f32::from_bits(bits))
            }
        };
        self.carried(normal, line.view, view)
    }

    /// The direction to the vertex that two edges of one view share, for what is lit along `view`.
    fn vertex(&self, [k, l]: [Line; 2], view: u32) -> Option<DVec3> {
        let (Of::Edge(e), Of::Edge(f)) = (k.of, l.of) else { return None };
        if k.view != l.view || e == f {
            return None;
        }
        let [first, second] = [e, f].map(|e| self.shared.edges[e as usize]);
        let vertex = first.into_iter().find(|v| second.contains(v))?;
        let d = self.shared.vertices[vertex as usize] - self.list[k.view as usize].frame.origin;
        Some(self.carried(d, k.view, view))
    }

    /// The place of a corner on a face that is lit along a view. None where it lies on the horizon.
    pub fn place(&self, corner: &Corner, view: u32, face: &Face) -> Option<DVec3> {
        let frame = &self.list[view as usize].frame;
        let (origin, begins) = (frame.origin, self.shared.faces.corners[face.first as usize]);
        let by_vertex = || {
            let d = self.vertex(corner.on, view)?;
            Some(origin + d * ((face.offset_m - face.normal.dot(origin)) / face.normal.dot(d)))
        };
        let by_lines = || {
            // Each plane of view cuts the face in a line: a x + b y + c = 0.
            let row = |line: Line| {
                let m = self.plane(line, view);
                let r = DVec3::new(m.dot(face.axis[0]), m.dot(face.axis[1]), m.dot(begins - origin));
                let l = r.truncate().length();
                (l > 0.0).then(|| r / l)
            };
            let (r, s) = (row(corner.on[0])?, row(corner.on[1])?);
            let det = r.x * s.y - r.y * s.x;
            let (x, y) = ((r.y * s.z - s.y * r.z) / det, (s.x * r.z - r.x * s.z) / det);
            (det.abs() > 1e-14).then(|| begins + face.axis[0] * x + face.axis[1] * y)
        };
        let is_near = |p: &DVec3| {
            frame.k.dot(*p - origin) > 0.0 && frame.project(*p).distance(corner.at.as_dvec2()) <= ASTRAY
        };
        let by_coordinates = || frame.lift(corner.at.as_dvec2(), frame.nearness(face.normal, face.offset_m));
        let place = by_vertex().or_else(by_lines).filter(is_near).unwrap_or_else(by_coordinates);
        (place.distance(begins) < FARTHEST_M).then_some(place)
    }

    /// The coordinates of a polygon on a face that is lit along a view. None where it reaches the horizon.
    pub fn exactly(&self, corners: &[Corner], view: u32, face: &Face) -> Option<Vec<DVec2>> {
        let frame = &self.list[view as usize].frame;
        corners.iter().map(|c| Some(frame.project(self.place(c, view, face)?))).collect()
    }
}
