//! Echoes of a frame's smooth surfaces, from exact beams (CONVENTIONS eq. 50-52, 60-63).
//!
//! What beams light of one plane by one chain of mirrors is one region, whatever faces and windows it is
//! made of. Its physical-optics integral is that of its outline, so that a wall costs as many echoes as it
//! has corners and places of stationary phase.

use super::beams::{Clipped, Ends, Node, Polygon, overlaps};
use super::bend::{Bends, End, Mirror, PathEnd};
use super::boundary::{Holds, Plane, Wave, spread_for};
use super::chains::Chain;
use super::curved::{Curved, ON_CREASE};
use super::diffuse;
use super::ended;
use super::field::{Bounce, sent};
use super::points::{Reflecting, SAME, TAU, point_echoes_over};
use super::regions::{Region, RegionNumbers, Regions, clipped_by_lines, on_axes, outline_of};
use super::shine::{Shine, clip_shining};
use super::specular::{self, Specular};
use super::two_curved;
use crate::base::convention::Convention;
use crate::base::frames::{Pose, Sensor, World};
use crate::base::matrix::Matrix2;
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::geom::Geometry;
use crate::geom::faces::{Face, Faces, NOT_CURVED, NearFaces};
use crate::geom::hash::FastMap;
use crate::trace::beams::{BeamOptions, Frame};
use crate::trace::{Echo, Echoes, MAX_BOUNCES, TraceOptions, strength, strong};
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::convert::Infallible;
use std::f64::consts::PI;

/// Radians from the place of mirror reflection to a wave up to which the amplitude's change about that place
/// is looked at.
const NEAR: f64 = 12.0;
/// More than what 1 m^2 radiates back of a unit field, but for k / 4 pi: a conductor's current is twice the field across it.
const MOST_RADIATED: f64 = 4.0;
/// Share of the distance over which the amplitude is that of one place, and step of its derivative.
const STEP: f64 = 1e-3;

/// Planes of which the radar sees less mirror no point, m²: at 3 m such a plane brings 4 % of the field, farther away less.
const LEAST_MIRROR_M2: f64 = 3e-4;
/// What stands so near to a plane lies on it, m.
const LEAST_HEIGHT_M: f64 = 1e-6;
/// Share of a way by which rounding may put a place in a corner behind the plane before it.
const AT_PLACE: f64 = 1e-9;
/// Share of the time until the frame's end up to which a wave has to stand for the same places: windows leave little of the ends.
const DRIFT: f64 = 0.5;
fn is_finite(r: &Echo) -> bool {
    r.path_gain.iter().flatten().all(|z| z.is_finite())
        && r.path_rate_mps.is_finite()
        && r.path_acceleration_and_jerk.iter().all(|b| b.is_finite())
        && r.first_velocity_mps.is_finite()
        && r.last_velocity_mps.is_finite()
}

/// Echoes at the radar `pose` moving with `velocity_mps` (world), from the directions in `windows`, in the
/// same order whatever the number of threads. Point targets and scattering tables included.
pub fn echoes(
    geometry: &Geometry,
    windows: &[Frame],
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Echoes {
    let shine = Shine::of(geometry);
    let clip = |faces: &Faces, beams: &BeamOptions, ends: Option<Ends<'_>>| {
        Ok::<_, Infallible>(clip_shining(faces, windows, beams, ends, shine))
    };
    match echoes_by(geometry, clip, pose, velocity_mps, options) {
        Ok(echoes) => echoes,
        Err(never) => match never {},
    }
}

/// The same with beams that `clip` follows against the faces it is given.
///
/// # Errors
/// Returns the errors of `clip`.
pub fn echoes_by<E>(
    geometry: &Geometry,
    clip: impl Fn(&Faces, &BeamOptions, Option<Ends<'_>>) -> Result<Clipped, E>,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Result<Echoes, E> {
    let beams = FrameBeams::new(geometry, pose.translation_m, options);
    let clipped = clip(beams.faces(), &beams.options, beams.ends)?;
    Ok(beams.echoes(clipped, pose, velocity_mps, options))
}

/// What the beams of a frame may meet, and how far they are followed.
pub struct FrameBeams<'a> {
    geometry: &'a Geometry,
    /// None where all faces are within reach.
    near: Option<NearFaces>,
    /// How far the beams are followed.
    pub options: BeamOptions,
    /// What tells of beams that the limit of bounces ends, if they are asked.
    pub ends: Option<Ends<'a>>,
    /// Facets of curved surfaces.
    pub shine: Shine<'a>,
}

impl<'a> FrameBeams<'a> {
    /// The beams of a radar at `place_m`.
    pub fn new(geometry: &'a Geometry, place_m: DVec3, options: &TraceOptions) -> FrameBeams<'a> {
        let last = options.convention == Convention::Last;
        let images = options.images && !last;
        let wavenumber = wavenumber(geometry.freq_hz);
        let ends = |least| Ends { surfaces: &geometry.surfaces, wavenumber, least, keeps_weak: false };
        let faces = geometry.faces();
        let is_rough = |f: &Face| geometry.surfaces[f.surface as usize].is_rough();
        FrameBeams {
            geometry,
            near: match options.rays > 0 && faces.faces.iter().any(is_rough) {
                true => None,
                // An echo may stand for paths that are longer by the spread.
                false => faces.near(place_m, options.reach_m + spread_for(options.bandwidth_hz)),
            },
            options: BeamOptions { images, ..BeamOptions::new(options.bounces, options.accuracy_db, last) },
            ends: options.least_cut.filter(|_| !last).map(ends),
            shine: Shine::of(geometry),
        }
    }

    /// The faces against which the beams are to be clipped.
    pub fn faces(&self) -> &Faces {
        self.near.as_ref().map_or_else(|| self.geometry.faces(), |near| &near.faces)
    }

    /// Echoes of what chains by lines light of [`FrameBeams::faces`], seen through windows.
    pub(crate) fn echoes_from_lines(
        &self,
        mut chains: Vec<Chain>,
        windows: &[Frame],
        pose: &Pose<Sensor, World>,
        velocity_mps: DVec3,
        options: &TraceOptions,
    ) -> Echoes {
        let mut beyond_reach = 0;
        if let Some(near) = &self.near {
            chains = chains.into_iter().map(|c| c.renumbered(&near.numbers)).collect();
            beyond_reach = (self.geometry.faces().faces.len() - near.numbers.len()) as u64;
        }
        let echoes = from_lines(self.geometry, (&chains, windows), pose, velocity_mps, options);
        Echoes { beyond_reach, ..echoes }
    }

    /// Echoes of what the beams have met of [`FrameBeams::faces`].
    pub fn echoes(
        &self,
        mut clipped: Clipped,
        pose: &Pose<Sensor, World>,
        velocity_mps: DVec3,
        options: &TraceOptions,
    ) -> Echoes {
        let mut beyond_reach = 0;
        if let Some(near) = &self.near {
            clipped.nodes.iter_mut().for_each(|n| n.face = near.numbers[n.face as usize]);
            clipped.ended.iter_mut().for_each(|e| e.face = near.numbers[e.face as usize]);
            beyond_reach = (self.geometry.faces().faces.len() - near.numbers.len()) as u64;
        }
        Echoes { beyond_reach, ..from_clipped(self.geometry, &clipped, pose, velocity_mps, options) }
    }
}

/// Computes echoes from what beams have met.
pub fn from_clipped(
    geometry: &Geometry,
    clipped: &Clipped,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Echoes {
    let last = options.convention == Convention::Last;
    of_regions(geometry, clipped, &Regions::of_beams(geometry, clipped, last), pose, velocity_mps, options)
}

/// As [`echoes`], from chains by lines and the windows through which the radar looks ([`super::chains::follow`] with all faces of `geometry`
/// and [`FrameBeams::options`]). Faces beyond `TraceOptions::reach_m` count, too.
pub fn from_lines(
    geometry: &Geometry,
    lines: (&[Chain], &[Frame]),
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Echoes {
    let beams = FrameBeams::new(geometry, pose.translation_m, options);
    let clipped = clipped_by_lines(geometry.faces(), lines, &beams.options, beams.ends, options.rays > 0);
    of_regions(geometry, &clipped, &Regions::of_lines(geometry, lines.0), pose, velocity_mps, options)
}

fn of_regions(
    geometry: &Geometry,
    clipped: &Clipped,
    regions: &Regions,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Echoes {
    let last = options.convention == Convention::Last;
    let Regions { direct, imaged, of_facets, numbers } = regions;
    let same_face =
        |a: &Region, b: &Region| clipped.nodes[a.node as usize].face == clipped.nodes[b.node as usize].face;
    let facets: Vec<&[Region]> = of_facets.chunk_by(same_face).collect();
    let images = options.images && !last;
    let radar = Station::new(geometry, clipped, direct, pose, velocity_mps, options);
    // What counts of a region's echoes, and how many are broken.
    let counted = |mut list: Vec<Echo>| {
        let before = list.len();
        list.retain(is_finite);
        let broken = (before - list.len()) as u64;
        list.retain(|r| strength(r) >= options.least);
        (list, broken)
    };
    let all = direct.par_iter().map_tasks(|r| match images {
        true => counted(radar.with_reciprocals(r)),
        false => counted(radar.echoes(r, false)),
    });
    let over = imaged.par_iter().map_tasks(|r| counted(radar.echoes(r, true)));
    let mut lists: Vec<(Vec<Echo>, u64)> = all.chain(over).collect();
    let of_facets: Vec<OfFacet> = facets.par_iter().map_tasks(|f| radar.of_facet(f, numbers)).collect();
    let (mut apart, mut shares) = (Vec::new(), Vec::new());
    for of in of_facets {
        apart.push(of.edges);
        shares.extend(of.inner);
    }
    // Of one specular point side by side, in the order of the facets.
    shares.sort_by_key(|s| s.surface);
    let same = |a: &InnerEcho, b: &InnerEcho| a.surface.is_some() && a.surface == b.surface;
    let surfaces: Vec<&[InnerEcho]> = shares.chunk_by(same).collect();
    let together = surfaces.par_iter().map_tasks(|s| counted(radar.of_surface(s)));
    lists.par_extend(together.chain(apart.into_par_iter().map_tasks(counted)));
    let mut broken: u64 = lists.iter().map(|l| l.1).sum();
    let mut others = diffuse::echoes(geometry, clipped, pose, velocity_mps, options);
    let rays = others.len() as u64;
    others.extend(two_curved::echoes(geometry, &clipped.windows, pose, velocity_mps, &radar.bends, options));
    let is_pointed = !(geometry.points.is_empty() && geometry.tables.is_empty());
    let planes = if images && is_pointed { radar.lit_planes(direct) } else { Vec::new() };
    others.extend(point_echoes_over(&planes, geometry, pose, velocity_mps, options));
    let before = others.len();
    others.retain(is_finite);
    broken += (before - others.len()) as u64;
    let all: Vec<&Echo> = lists.iter().flat_map(|(list, _)| list).chain(&others).collect();
    let list = strong(&all, options.amplitude_floor);
    let cut = ended::estimates(geometry, clipped, pose);
    Echoes { list, rays, cut, broken, bounces: options.bounces, ..Default::default() }
}

/// What a radar lights, as beams or as lines have it.
#[derive(Clone, Copy)]
pub enum Lit<'a> {
    /// Polygons.
    Beams(&'a Clipped),
    /// Chains with their outlines, and the windows through which the radar looks.
    Lines(&'a [Chain], &'a [Frame]),
}

/// The echoes of one chain of flat patches.
#[derive(Debug, Clone)]
pub struct ChainEchoes {
    /// The patches, from the first bounce on.
    pub patches: Vec<u32>,
    /// The way back leads over the first of them.
    pub over: bool,
    /// Echoes, unfiltered.
    pub list: Vec<Echo>,
}

/// Echoes of flat patches chain by chain, without those of the chains reversed (CONVENTIONS eq. 65).
pub fn echoes_by_chain(
    geometry: &Geometry,
    lit: Lit<'_>,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Vec<ChainEchoes> {
    let of_lines;
    let (clipped, regions) = match lit {
        Lit::Beams(clipped) => (clipped, Regions::of_beams(geometry, clipped, false)),
        Lit::Lines(chains, windows) => {
            let beams = BeamOptions::new(options.bounces, options.accuracy_db, false);
            of_lines = clipped_by_lines(geometry.faces(), (chains, windows), &beams, None, false);
            (&of_lines, Regions::of_lines(geometry, chains))
        }
    };
    let Regions { direct, imaged, .. } = &regions;
    let radar = Station::new(geometry, clipped, direct, pose, velocity_mps, options);
    let patch = |node: &u32| geometry.faces().faces[clipped.nodes[*node as usize].face as usize].patch;
    let of = |(region, over): (&Region, bool)| {
        let patches = radar.chain(region.node).iter().map(patch).collect();
        ChainEchoes { patches, over, list: radar.echoes(region, over) }
    };
    let all: Vec<(&Region, bool)> =
        direct.iter().map(|r| (r, false)).chain(imaged.iter().map(|r| (r, true))).collect();
    all.into_par_iter().map_tasks(of).collect()
}

/// Ways back of a chain: straight, or over its first plane.
fn back_over(chain: &[u32], over: bool) -> &[u32] {
    &chain[..if over { 2 } else { 1 }]
}

/// What the radar sees at first hand of each small plane that mirrors what follows it in a chain, by its patch. The outlines of large
/// ones are those of shadows, too: of what stands on them, and is not lit by half for that.
fn lit(geometry: &Geometry, clipped: &Clipped, regions: &[Region]) -> FastMap<u32, Reflecting> {
    let faces = geometry.faces();
    let patch = |node: u32| faces.faces[clipped.nodes[node as usize].face as usize].patch;
    let begins = |n: &&Node| n.bounce == 2 && n.imaged;
    let mut mirrors: Vec<u32> = clipped.nodes.iter().filter(begins).map(|n| patch(n.parent)).collect();
    mirrors.retain(|p| !faces.is_large(*p));
    mirrors.sort_unstable();
    mirrors.dedup();
    let is_lit = |r: &&Region| {
        let node = &clipped.nodes[r.node as usize];
        node.bounce == 1 && mirrors.binary_search(&patch(r.node)).is_ok()
    };
    let found: Vec<&Region> = regions.iter().filter(is_lit).collect();
    let of = |r: &&Region| {
        let face = clipped.nodes[r.node as usize].face;
        let outline = r.sides(SAME * faces.radius_m);
        (patch(r.node), Reflecting { face, outline, is_seen: true })
    };
    found.par_iter().map_tasks(of).collect::<Vec<_>>().into_iter().collect()
}

/// What a facet of a curved surface returns.
#[derive(Default)]
struct OfFacet {
    /// Echoes of its creases.
    edges: Vec<Echo>,
    /// One echo for each pair of ways.
    inner: Vec<InnerEcho>,
}

/// The echo of the inside of a facet, by one way there and one back.
struct InnerEcho {
    /// Without the facet's motion.
    echo: Echo,
    chain: Vec<u32>,
    back: Vec<u32>,
    /// The two ways differ, so that there is another echo the other way round.
    is_pair: bool,
    place_m: DVec3,
    keeps: PathEnd,
    /// Face of the specular point of the smooth surface, and the regions before the facet on the way there and back; None where no
    /// specular point was found.
    surface: Option<(u32, [u32; 2])>,
    /// The specular point, where it lies on the facet's own lit part.
    specular: Option<Specular>,
}

/// What the place of a wave on a face keeps to.
fn keeps(faces: &Faces, face: &Face, holds: Holds, normal: DVec3) -> PathEnd {
    let longest_m = || {
        let corners = faces.corners(face);
        corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f64::max)
    };
    match holds {
        Holds::Corner => PathEnd::Place,
        Holds::Side(d) => PathEnd::Side(face.axis[0] * d.x + face.axis[1] * d.y, longest_m()),
        Holds::Mirror => PathEnd::Plane(normal),
    }
}

/// Change of the amplitude with the gradient of the path about a place (CONVENTIONS eq. 61), from what an area returns `at` places.
fn slopes(plane: &Plane, about: DVec2, at: &dyn Fn(DVec2) -> Echo) -> [Matrix2; 2] {
    let path = plane.path(about);
    let step = STEP * path.nearest;
    let [x, y] = [DVec2::X, DVec2::Y].map(|d| {
        let (a, b) = (at(about - d * step).path_gain, at(about + d * step).path_gain);
        [0, 1].map(|rx| [0, 1].map(|tx| (b[rx][tx] - a[rx][tx]) / (2.0 * step)))
    });
    // From places to gradients of the path: the inverse of its second derivatives.
    let [xx, yy, xy] = path.bend;
    let det = xx * yy - xy * xy;
    let turned = |p: f64, q: f64| [0, 1].map(|rx| [0, 1].map(|tx| (x[rx][tx] * p + y[rx][tx] * q) / det));
    [turned(yy, -xy), turned(-xy, xx)]
}

/// The radar of one frame.
struct Station<'a> {
    geometry: &'a Geometry,
    clipped: &'a Clipped,
    pose: &'a Pose<Sensor, World>,
    velocity_mps: DVec3,
    bends: Bends,
    tau: f64,
    spread_m: f64,
    /// As `TraceOptions::least`.
    least: f64,
    /// As `TraceOptions::places`.
    places: bool,
    /// As `TraceOptions::bounces`.
    bounces: usize,
    /// What the radar sees at first hand of small planes that mirror, by their patches.
    lit: FastMap<u32, Reflecting>,
}

impl<'a> Station<'a> {
    /// The radar of a frame that sees `direct` at first hand.
    fn new(
        geometry: &'a Geometry,
        clipped: &'a Clipped,
        direct: &[Region],
        pose: &'a Pose<Sensor, World>,
        velocity_mps: DVec3,
        options: &TraceOptions,
    ) -> Station<'a> {
        let last = options.convention == Convention::Last;
        let images = options.images && !last;
        Station {
            geometry,
            clipped,
            pose,
            velocity_mps,
            bends: Bends::new(geometry, pose.translation_m, velocity_mps, options),
            tau: BeamOptions::new(options.bounces, options.accuracy_db, last).tau,
            spread_m: spread_for(options.bandwidth_hz),
            least: options.least,
            places: options.places,
            bounces: options.bounces,
            lit: if images { lit(geometry, clipped, direct) } else { FastMap::default() },
        }
    }

    /// Echoes of a region to a radar that ways back over large planes reach by reciprocity (CONVENTIONS eq. 65): where the chain
    /// begins with a mirror of what follows, also those of the chain the other way round, which then give none of their own.
    fn with_reciprocals(&self, region: &Region) -> Vec<Echo> {
        let faces = self.geometry.faces();
        let patch = |i: &u32| faces.faces[self.clipped.nodes[*i as usize].face as usize].patch;
        let chain: Vec<u32> = self.chain(region.node).iter().map(patch).collect();
        let n = chain.len();
        if n < 2 {
            return self.echoes(region, false);
        }
        let begins = faces.mirrors(chain[0], chain[1]);
        let ends = faces.mirrors(chain[n - 1], chain[n - 2]);
        match (begins, ends) {
            (true, true) if chain[0] == chain[n - 1] => Vec::new(),
            (false, true) => Vec::new(),
            (true, false) => {
                let mut list = self.echoes(region, false);
                let back: Vec<Echo> = list.iter().map(Echo::reversed).collect();
                list.extend(back);
                list
            }
            _ => self.echoes(region, false),
        }
    }

    /// `over`: the way back leads over the first plane of the chain.
    fn echoes(&self, region: &Region, over: bool) -> Vec<Echo> {
        let faces = self.geometry.faces();
        let node = &self.clipped.nodes[region.node as usize];
        let face = &faces.faces[node.face as usize];
        let corner = faces.corners[face.first as usize];
        let chain = self.chain(region.node);
        let back = back_over(&chain, over);
        let receiver = self.origin(back);
        let stations = [node.frame.origin, receiver].map(|p| p - corner);
        let height = stations.map(|d| node.normal.dot(d));
        if height.iter().any(|h| *h <= 0.0) {
            return Vec::new();
        }
        let k = wavenumber(self.geometry.freq_hz);
        let place = |p: DVec2| corner + face.axis[0] * p.x + face.axis[1] * p.y;
        if over && (chain.len() == MAX_BOUNCES || !self.is_seen_over(&chain, region, place)) {
            return Vec::new();
        }
        let plane = Plane::new(k, stations.map(|d| on_axes(face, d)), height, self.tau, self.spread_m)
            .drifting(self.drifts(&chain, back));
        let at = |p: DVec2| self.echo(&chain, back, place(p), node.normal);
        let sides = region.sides(SAME * faces.radius_m);
        let mut waves: Vec<Wave> = Vec::new();
        // The waves of the two sides of a corner are one echo.
        let mut numbers: FastMap<[u64; 2], usize> = FastMap::default();
        plane.waves(&sides, |w| {
            let i = *numbers.entry(w.place.to_array().map(f64::to_bits)).or_insert(waves.len());
            match waves.get_mut(i) {
                Some(first) => {
                    first.value += w.value;
                    first.flux.iter_mut().zip(w.flux).for_each(|(a, b)| *a += b);
                }
                None => waves.push(w),
            }
        });
        let over_k = Complex64::new(0.0, -k / (4.0 * PI));
        let together = self.together(&plane, region);
        if let Some((centre, true)) = together {
            let mut whole = at(centre);
            let turned = |w: &Wave| w.value * Complex64::cis(-k * (w.length_m - whole.path_length_m));
            let value = waves.iter().map(turned).sum::<Complex64>() * over_k;
            whole.path_gain.as_flattened_mut().iter_mut().for_each(|a| *a *= value);
            self.bend(&chain, back, (place(centre), PathEnd::Place), &mut whole);
            return vec![whole];
        }
        // Far from the place of mirror reflection the amplitude in a wave's own place says enough.
        let near = |w: &Wave| k * (w.length_m - plane.mirror_m) <= NEAR;
        let about = waves.iter().any(near).then(|| {
            let leads_there = self.leads_to(&chain, place(plane.mirror));
            slopes(&plane, if leads_there { plane.mirror } else { plane.nearest(&sides) }, &at)
        });
        let counts = |w: &&Wave| {
            let [out, back] = plane.ranges(w.place);
            near(w) || MOST_RADIATED * k / (4.0 * PI) * w.value.norm() >= self.least * out * back
        };
        let radiated = |w: &Wave| {
            let mut echo = at(w.place);
            let slopes = about.filter(|_| near(w)).unwrap_or_default();
            let change = plane.path(w.place).slope;
            for (rx, row) in echo.path_gain.iter_mut().enumerate() {
                for (tx, a) in row.iter_mut().enumerate() {
                    let [x, y] = slopes.map(|s| s[rx][tx]);
                    *a = (*a - x * change.x - y * change.y) * w.value + x * w.flux[0] + y * w.flux[1];
                    *a *= over_k;
                }
            }
            echo.path_length_m = w.length_m;
            echo
        };
        if let Some((centre, _)) = together {
            let mut whole = at(centre);
            whole.path_gain = Matrix2::default();
            for echo in waves.iter().map(radiated) {
                let turn = Complex64::cis(-k * (echo.path_length_m - whole.path_length_m));
                for (sum, a) in
                    whole.path_gain.as_flattened_mut().iter_mut().zip(echo.path_gain.as_flattened())
                {
                    *sum += a * turn;
                }
            }
            self.bend(&chain, back, (place(centre), PathEnd::Place), &mut whole);
            return vec![whole];
        }
        waves
            .iter()
            .filter(counts)
            .map(|w| {
                let mut echo = radiated(w);
                let keeps = keeps(self.geometry.faces(), face, w.holds, node.normal);
                self.bend(&chain, back, (place(w.place), keeps), &mut echo);
                echo
            })
            .collect()
    }

    /// How far the source and the receiver of a chain's last face go from it until the end of the frame, along the face's axes and
    /// over its lit side. Mirrors count as if they stood still.
    fn drifts(&self, chain: &[u32], back: &[u32]) -> [(DVec2, f64); 2] {
        let last = chain[chain.len() - 1];
        let (face, normal) = (self.face(last), self.clipped.nodes[last as usize].normal);
        let own = self.geometry.bodies[face.body as usize]
            .velocity_at(self.geometry.faces().corners[face.first as usize]);
        let first = &self.clipped.nodes[chain[0] as usize].frame;
        let v = self.velocity_mps;
        let of_image = |i: u32| {
            let f = &self.clipped.nodes[i as usize].frame;
            f.u * first.u.dot(v) + f.v * first.v.dot(v) + f.k * first.k.dot(v)
        };
        [last, back[back.len() - 1]].map(of_image).map(|v| {
            let way = (v - own) * (DRIFT * self.geometry.reach_s);
            (on_axes(face, way), normal.dot(way))
        })
    }

    /// Place from which the last wave of a way comes: the radar, or its image in the planes before.
    fn origin(&self, way: &[u32]) -> DVec3 {
        self.clipped.nodes[way[way.len() - 1] as usize].frame.origin
    }

    /// Echoes of a facet of a curved surface, of which these are the parts that the radar lights straight and over planes: by every pair
    /// of a way there and a way back, the images of the radar being exact for planes. A pair of two ways is one the other way round, too.
    fn of_facet(&self, lit: &[Region], numbers: &RegionNumbers) -> OfFacet {
        let ways: Vec<Vec<u32>> = lit.iter().map(|r| self.chain(r.node)).collect();
        let last = |way: &[u32]| &self.clipped.nodes[way[way.len() - 1] as usize];
        let mut found = OfFacet::default();
        for (i, out) in ways.iter().enumerate() {
            for (j, back) in ways[..=i].iter().enumerate() {
                // Planes that are as good as endless come on top, as for beams.
                let free = [out, back].iter().filter(|way| last(way).imaged).count();
                let bounces = out.len() + back.len() - 1;
                let are_one_side = last(out).normal.dot(last(back).normal) > 0.0;
                if bounces > (self.bounces + free).min(MAX_BOUNCES) || !are_one_side {
                    continue;
                }
                let before = [out, back].map(|way| match last(way).parent {
                    u32::MAX => u32::MAX,
                    parent => numbers.of_node[parent as usize],
                });
                match i == j {
                    true => self.curved((out, back), before, lit[i].pieces(), true, &mut found),
                    // An edge lit over a plane and seen over another is left out.
                    false => {
                        let both = overlaps(lit[i].pieces(), lit[j].pieces());
                        self.curved((out, back), before, &both, back.len() == 1, &mut found);
                    }
                }
            }
        }
        found
    }

    /// Echoes of a lit part of a curved facet by one way there and one back, with `edges` those of its creases, too. `before` are the
    /// regions that the ways meet before it.
    fn curved(
        &self,
        (chain, back): (&[u32], &[u32]),
        before: [u32; 2],
        pieces: &[Polygon],
        edges: bool,
        found: &mut OfFacet,
    ) {
        let faces = self.geometry.faces();
        let last = chain[chain.len() - 1];
        let (face, flat) = (self.face(last), self.clipped.nodes[last as usize].normal);
        let Some(facet) = faces.curved.get(face.curved as usize).filter(|_| !pieces.is_empty()) else {
            return;
        };
        let stations = [self.origin(chain), self.origin(back)];
        let corner = faces.corners[face.first as usize];
        if stations.iter().any(|s| flat.dot(*s - corner) <= 0.0) {
            return;
        }
        let k = wavenumber(self.geometry.freq_hz);
        let sign = flat.dot(face.normal).signum();
        let facet = Curved::new((facet, faces.corners(face), face.axis), sign, stations, (k, self.tau));
        let is_pair = chain != back;
        let radiated = |place: DVec2, value: Complex64, holds: Holds| {
            let spot = facet.at(place);
            let [out_m, back_m] = facet.ranges(&spot);
            if MOST_RADIATED * k / (4.0 * PI) * value.norm() < self.least * out_m * back_m {
                return None;
            }
            let normal = facet.lit_normal(&spot).unwrap_or(flat);
            let mut echo = self.echo(chain, back, spot.place, normal);
            let turn = value * Complex64::new(0.0, -k / (4.0 * PI)) * self.shares(chain, back, spot.place);
            echo.path_gain.as_flattened_mut().iter_mut().for_each(|a| *a *= turn);
            Some((echo, spot.place, keeps(self.geometry.faces(), face, holds, normal)))
        };
        if let Some(inner) = facet.inner(pieces)
            && let Some((echo, place_m, keeps)) = radiated(inner.place, inner.value, inner.holds)
        {
            let number = self.clipped.nodes[last as usize].face;
            // Whether a point so near to a crease is lit hangs on rounding.
            let border_m = ON_CREASE / k;
            let start = Specular { face: number, at: inner.place };
            let found_at = specular::find(faces, start, stations, border_m);
            found.inner.push(InnerEcho {
                echo,
                chain: chain.to_vec(),
                back: back.to_vec(),
                is_pair,
                place_m,
                keeps,
                surface: found_at.map(|s| (s.face, before)),
                specular: found_at.filter(|s| {
                    s.face == number && pieces.iter().any(|p| p.holds(s.at, specular::NEAR_SIDE_M))
                }),
            });
        }
        if edges && facet.has_crease() {
            let near_m = SAME * faces.radius_m;
            let mut radiate_from = |side| {
                if let Some(crease) = facet.crease(side, near_m) {
                    facet.edge(side, crease, pieces, |w| {
                        if let Some((mut echo, place_m, keeps)) = radiated(w.place, w.value, w.holds) {
                            self.moves(chain, back, (place_m, keeps), &mut echo);
                            found.edges.extend(is_pair.then(|| echo.reversed()));
                            found.edges.push(echo);
                        }
                    });
                }
            };
            outline_of(pieces, near_m).into_iter().for_each(&mut radiate_from);
        }
    }

    /// Echoes of the insides of facets that share one specular point of a smooth surface: one echo, whose path goes by way of that
    /// point wherever it travels over the surface. Where the point is in the shadow or leaves the surface within the frame, each facet
    /// has an echo of its own that keeps its place on the body.
    fn of_surface(&self, shares: &[InnerEcho]) -> Vec<Echo> {
        let mut list = match self.of_specular(shares) {
            Some(echo) => vec![echo],
            None => shares
                .iter()
                .map(|s| {
                    let mut echo = s.echo.clone();
                    self.moves(&s.chain, &s.back, (s.place_m, s.keeps), &mut echo);
                    echo
                })
                .collect(),
        };
        if shares[0].is_pair {
            list.extend(list.iter().map(Echo::reversed).collect::<Vec<_>>());
        }
        list
    }

    /// The echo of a specular point.
    fn of_specular(&self, shares: &[InnerEcho]) -> Option<Echo> {
        let (own, at) = shares.iter().find_map(|s| Some((s, s.specular?)))?;
        let (faces, k) = (self.geometry.faces(), wavenumber(self.geometry.freq_hz));
        let (chain, back) = (&own.chain[..], &own.back[..]);
        let stations = [self.origin(chain), self.origin(back)];
        let facet = specular::facet(faces, at.face, stations, (k, self.tau))?;
        let spot = facet.at(at.at);
        let normal = facet.lit_normal(&spot)?;
        let body = &self.geometry.bodies[faces.faces[at.face as usize].body as usize];
        let mirrors = [self.mirrors(chain), self.mirrors(back)];
        let ends = [&mirrors[0][..chain.len() - 1], &mirrors[1][..back.len() - 1]];
        let keeps = match self.bends.stations_of_body(ends, &body.shifts) {
            None => PathEnd::Place,
            Some(moved) => {
                let travelled = moved.map(|stations| {
                    let there = specular::find(faces, at, stations, 0.0)?;
                    let facet = specular::facet(faces, there.face, stations, (k, self.tau))?;
                    Some(facet.at(there.at).place)
                });
                PathEnd::Surface([travelled[0]?, travelled[1]?])
            }
        };
        let mut whole = self.echo(chain, back, spot.place, normal);
        whole.path_gain = Matrix2::default();
        for share in shares {
            let turn = Complex64::cis(-k * (share.echo.path_length_m - whole.path_length_m));
            let gains = share.echo.path_gain.as_flattened();
            for (sum, a) in whole.path_gain.as_flattened_mut().iter_mut().zip(gains) {
                *sum += a * turn;
            }
        }
        self.moves(chain, back, (spot.place, keeps), &mut whole);
        Some(whole)
    }

    /// The centre of a region whose paths are so nearly of one length that one echo stands for all of them all over the band, and
    /// whether it is so small that the amplitude in its centre is that of every place.
    fn together(&self, plane: &Plane, region: &Region) -> Option<(DVec2, bool)> {
        let centre = region.centre()?;
        let path = plane.path(centre);
        let mut radius = 0f64;
        for p in region.corners() {
            if (plane.path(p).length - path.length).abs() > self.spread_m {
                return None;
            }
            radius = radius.max(p.distance(centre));
        }
        Some((centre, radius <= STEP * path.nearest))
    }

    fn face(&self, node: u32) -> &Face {
        &self.geometry.faces().faces[self.clipped.nodes[node as usize].face as usize]
    }

    /// The planes that the radar sees at first hand and that are large enough to mirror anything.
    fn lit_planes(&self, regions: &[Region]) -> Vec<Reflecting> {
        let faces = self.geometry.faces();
        let lit = |r: &Region| {
            let node = &self.clipped.nodes[r.node as usize];
            let face = self.face(r.node);
            if node.bounce > 1 || face.curved != NOT_CURVED || r.area_m2() < LEAST_MIRROR_M2 {
                return None;
            }
            Some(Reflecting { face: node.face, outline: r.sides(SAME * faces.radius_m), is_seen: true })
        };
        regions.par_iter().filter_map_tasks(lit).collect()
    }

    /// Nodes from the first bounce to this one.
    fn chain(&self, node: u32) -> Vec<u32> {
        let parent = |i: u32| Some(self.clipped.nodes[i as usize].parent).filter(|p| *p != u32::MAX);
        let mut chain: Vec<u32> = std::iter::successors(Some(node), |i| parent(*i)).collect();
        chain.reverse();
        chain
    }

    /// Whether the middle of what a chain lights is seen from the radar over the chain's first plane. With two places on the chain
    /// the way back is the way out.
    fn is_seen_over(&self, chain: &[u32], region: &Region, place: impl Fn(DVec2) -> DVec3) -> bool {
        if chain.len() == 2 {
            return true;
        }
        let Some(centre) = region.centre() else { return false };
        let from = place(centre);
        let foot = self.foot(chain, from);
        let radar = self.pose.translation_m;
        self.geometry.faces().is_on_mirror(self.face(chain[0]).patch, foot)
            && [from, radar].iter().all(|p| self.geometry.sees(*p, foot))
    }

    /// Whether the straight lines from the radar's images to a place on the chain's last plane cross its planes in their order.
    fn leads_to(&self, chain: &[u32], mut place: DVec3) -> bool {
        chain.windows(2).rev().all(|pair| {
            let from = self.clipped.nodes[pair[1] as usize].frame.origin;
            let (d, f) = (place - from, self.face(pair[0]));
            let t = (f.offset_m - f.normal.dot(from)) / f.normal.dot(d);
            place = from + d * t;
            t > 0.0 && t < 1.0 + AT_PLACE
        })
    }

    /// What the first plane of a way that begins with a mirror of the next brings of an endless mirror.
    fn share(&self, chain: &[u32], place: DVec3) -> Complex64 {
        let node = |i: u32| &self.clipped.nodes[i as usize];
        let last = node(chain[chain.len() - 1]);
        let (&[first, second, ..], true) = (chain, last.imaged) else {
            return Complex64::ONE;
        };
        let faces = self.geometry.faces();
        let Some(lit) = self.lit.get(&self.face(first).patch) else { return Complex64::ONE };
        let (k, radar) = (wavenumber(self.geometry.freq_hz), self.pose.translation_m);
        let face = &faces.faces[lit.face as usize];
        let corner = faces.corners[face.first as usize];
        let of = |target: DVec3| {
            let height = [radar, target].map(|p| (face.normal.dot(p) - face.offset_m).abs());
            let feet = [radar, target].map(|p| on_axes(face, p - corner));
            if height[1] < LEAST_HEIGHT_M {
                return Complex64::ONE;
            }
            let plane = Plane::new(k, feet, height, TAU, f64::INFINITY);
            plane.share(&lit.outline).map_or(Complex64::ZERO, |(share, _)| share)
        };
        let image = node(second).frame.origin;
        // The way behind the second place goes on straight.
        let mut met = place;
        for pair in chain[1..].windows(2).rev() {
            let from = node(pair[1]).frame.origin;
            let (d, f) = (met - from, self.face(pair[0]));
            met = from + d * ((f.offset_m - f.normal.dot(from)) / f.normal.dot(d));
        }
        let length_m = place.distance(last.frame.origin);
        of(image + (met - image).normalize() * length_m)
    }

    /// Where the line from `place` to the radar's image crosses the chain's first plane.
    fn foot(&self, chain: &[u32], place: DVec3) -> DVec3 {
        let image = self.clipped.nodes[chain[1] as usize].frame.origin;
        let (d, f) = (place - image, self.face(chain[0]));
        image + d * ((f.offset_m - f.normal.dot(image)) / f.normal.dot(d))
    }

    /// Completes an echo of a place by one way there and one `back`: what the first plane of each brings of an endless mirror
    /// (CONVENTIONS eq. 65a) if it mirrors what follows, and how the path changes over the frame, and its directions.
    fn bend(&self, chain: &[u32], back: &[u32], (place_m, keeps): (DVec3, PathEnd), echo: &mut Echo) {
        let shares = self.shares(chain, back, place_m);
        echo.path_gain.as_flattened_mut().iter_mut().for_each(|a| *a *= shares);
        self.moves(chain, back, (place_m, keeps), echo);
    }

    /// What the first planes of both ways bring of an endless mirror.
    fn shares(&self, chain: &[u32], back: &[u32], place_m: DVec3) -> Complex64 {
        self.share(chain, place_m) * self.share(back, place_m)
    }

    /// The planes that a way meets before its last face.
    fn mirrors(&self, way: &[u32]) -> [Mirror<'_>; MAX_BOUNCES] {
        let faces = self.geometry.faces();
        let mirror = |i: u32| Mirror {
            body: &self.geometry.bodies[self.face(i).body as usize],
            place_m: faces.corners[self.face(i).first as usize],
            normal: self.clipped.nodes[i as usize].normal,
        };
        let mut mirrors = [mirror(way[way.len() - 1]); MAX_BOUNCES];
        for (m, &i) in mirrors.iter_mut().zip(&way[..way.len() - 1]) {
            *m = mirror(i);
        }
        mirrors
    }

    /// Completes an echo with how its path changes over the frame, and its directions.
    fn moves(&self, chain: &[u32], back: &[u32], (place_m, keeps): (DVec3, PathEnd), echo: &mut Echo) {
        let body = &self.geometry.bodies[self.face(chain[chain.len() - 1]).body as usize];
        let (out_mirrors, back_mirrors) = (self.mirrors(chain), self.mirrors(back));
        let mirrors = [&out_mirrors[..chain.len() - 1], &back_mirrors[..back.len() - 1]];
        let end = End { shifts: &body.shifts, place_m, keeps };
        let ranges_m = [echo.first_range_m, echo.last_range_m];
        let motion = self.bends.of(mirrors, end, echo.path_length_m, ranges_m, echo.path_rate_mps);
        (echo.path_rate_mps, echo.path_acceleration_and_jerk) =
            (motion.rate_mps, motion.acceleration_and_jerk);
        let to_sensor = self.pose.rotation.inverse();
        [echo.first_velocity_mps, echo.last_velocity_mps] = motion.velocities_mps.map(|v| to_sensor * v);
    }

    /// Places at which the way of a chain from the radar to `place`, on its last face, meets its planes; the last of them is `place`.
    fn places_on(&self, chain: &[u32], place: DVec3) -> [DVec3; MAX_BOUNCES] {
        // From the last place back along the straight line from each image of the radar.
        let mut points = [place; MAX_BOUNCES];
        for b in (0..chain.len() - 1).rev() {
            let from = self.clipped.nodes[chain[b + 1] as usize].frame.origin;
            let (d, f) = (points[b + 1] - from, self.face(chain[b]));
            let t = (f.offset_m - f.normal.dot(from)) / f.normal.dot(d);
            points[b] = from + d * t;
        }
        points
    }

    /// The echo of an area of 1 m^2 at `place` on the last face of two ways from the radar, with this unit normal on its lit side, but for
    /// -j k / 4 pi: along `chain` there, over the planes of `back` and back to the radar.
    fn echo(&self, chain: &[u32], back: &[u32], place: DVec3, normal: DVec3) -> Echo {
        let (faces, radar) = (self.geometry.faces(), self.pose.translation_m);
        let node = |i: u32| &self.clipped.nodes[i as usize];
        let face = |i: u32| &faces.faces[node(i).face as usize];
        let (count, over) = (chain.len(), back.len() - 1);
        let (points, back_points) = (self.places_on(chain, place), self.places_on(back, place));
        let k = wavenumber(self.geometry.freq_hz);
        let to_sensor = self.pose.rotation.inverse();
        // What the radar receives comes from the first place of the way back, as if it had been sent there.
        let (out, last) = (points[0] - radar, back_points[0] - radar);
        let (first_range_m, last_range_m) = (out.length(), last.length());
        let departure = out / first_range_m;
        let arrival = last / last_range_m;
        let receiver = self.origin(back);
        let back_m = receiver.distance(place);
        let leaves = (receiver - place) / back_m;

        let mut ids = [0; MAX_BOUNCES];
        let mut rate = -self.velocity_mps.dot(arrival + departure);
        let of = |i: u32| {
            let body = &self.geometry.bodies[face(i).body as usize];
            (body, &self.geometry.surfaces[face(i).surface as usize])
        };
        // Direction behind a bounce, from the image: places of neighbours along the chain may coincide in a corner.
        let next = |way: &[u32], points: &[DVec3], b: usize| {
            (points[b + 1] - node(way[b + 1]).frame.origin).normalize()
        };
        // Of V and H at the place that radiates back, by reciprocity.
        let mut seen_by = sent(self.pose, arrival);
        let mut dir = arrival;
        for (b, &i) in back[..over].iter().enumerate() {
            let (body, surface) = of(i);
            seen_by = Bounce::new(seen_by, dir, node(i).normal, surface, k).reflected;
            let on = next(back, &back_points, b);
            rate += body.velocity_at(back_points[b]).dot(dir - on);
            dir = on;
            ids[count + over - 1 - b] = body.id;
        }
        let mut field = sent(self.pose, departure);
        let mut dir = departure;
        let mut radiated = [[Complex64::ZERO; 2]; 2];
        for (b, &i) in chain.iter().enumerate() {
            let (body, surface) = of(i);
            ids[b] = body.id;
            let normal = if b + 1 == count { normal } else { node(i).normal };
            let bounce = Bounce::new(field, dir, normal, surface, k);
            let on = if b + 1 == count {
                radiated = bounce.received(leaves, &seen_by);
                leaves
            } else {
                next(chain, &points, b)
            };
            rate += body.velocity_at(points[b]).dot(dir - on);
            field = bounce.reflected;
            dir = on;
        }
        let unfolded = place.distance(node(chain[count - 1]).frame.origin);
        let to_sensor_m = |p: &DVec3| to_sensor * (*p - radar);
        Echo {
            path_length_m: unfolded + back_m,
            path_rate_mps: rate,
            path_acceleration_and_jerk: [0.0; 2],
            departure: to_sensor * departure,
            first_range_m,
            first_velocity_mps: DVec3::ZERO,
            arrival: to_sensor * arrival,
            last_range_m,
            last_velocity_mps: DVec3::ZERO,
            path_gain: radiated.map(|row| row.map(|m| m / (unfolded * back_m))),
            chain: ids,
            bounces: (count + over) as u8,
            between_m: match self.places {
                false => Box::default(),
                true => {
                    let all = points[..count].iter().chain(back_points[..over].iter().rev());
                    all.take(count + over - 1).skip(1).map(to_sensor_m).collect()
                }
            },
        }
    }
}
