//! Chains of mirrors followed by lines on the device, as [`super::cpu::chains::follow`] does on the host.
//!
//! All views of one bounce go together. Their edges ahead are split where bounds and nearer silhouettes cross them (`line_split`), each
//! part is decided by rays (`line_sides`), what throws shadows is split where edges cross beyond it, and one ray finds the face behind
//! each piece (`line_shadow`). Every list is a flat one: a thread takes one segment, counts, and writes behind the sums of the counts.
//! What comes out names lines and shares of them (`line_gather`); positions follow in f64.

use super::cpu::chains::{Chain, Follower};
use super::cpu::lines::{Fragment, Line, Name, Scene, View, wall_of};
use super::line_arrays::{
    self, LineArrays, LineParams, Numbers, OF_EDGE, OF_OUTLINE, OF_WALL, Word, segment, shares,
};
use super::{line_ahead, line_gather, line_shadow, line_sides, line_split, scan};
use crate::base::error::{Error, Result};
use crate::base::tasks::Tasks;
use crate::geom::edge_table::EdgeTable;
use crate::geom::faces::Faces;
use crate::gpu::{Buffer, Gpu, Kernel, Pending, Recorder, Threads};
use crate::trace::beams::{BeamOptions, Frame};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

// As in shaders/shared/line_params.wgsl.
const ALONG: u32 = 4;
const FREE_POSITIVE: u32 = 8;
const IS_SIDE: u32 = 32;
const HALVES: u32 = 8;

/// Outlines and walls are cut into as many equal parts as they span this in view, rad.
const WIDEST: f64 = 0.1;
/// Lists of `line_ahead`.
const GROUPS_AHEAD: u32 = 0;
const EDGES_AHEAD: u32 = 1;
/// Lists of `line_split`.
const BOUNDS: u32 = 0;
const NEARER: u32 = 1;
const BEYOND: u32 = 2;
/// Lists of `line_gather`.
const SIDES: u32 = 0;
const CASTERS: u32 = 1;
const SHADOWS: u32 = 2;

/// How the tests of boxes, faces and edges are shared out among the threads of a kernel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    /// The kernel and its stage.
    pub name: &'static str,
    /// Threads with something to do.
    pub threads: u64,
    /// Tests of all threads.
    pub tests: u64,
    /// Tests of the thread that makes most.
    pub longest: u64,
}

impl Balance {
    /// The longest thread's tests over their mean.
    pub fn longest_over_mean(&self) -> f64 {
        self.longest as f64 * self.threads.max(1) as f64 / self.tests.max(1) as f64
    }

    fn add(&mut self, work: &[u32]) {
        let some = work.iter().map(|w| u64::from(*w)).filter(|w| *w > 0);
        for w in some {
            self.threads += 1;
            self.tests += w;
            self.longest = self.longest.max(w);
        }
    }
}

/// Kernels that follow chains.
pub fn kernels() -> &'static [&'static Kernel] {
    static KERNELS: [&Kernel; 6] = [
        &line_ahead::KERNEL,
        &line_split::KERNEL,
        &line_sides::KERNEL,
        &line_shadow::KERNEL,
        &line_gather::KERNEL,
        &scan::KERNEL,
    ];
    &KERNELS
}

/// A radar amid faces.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// The faces.
    pub faces: &'a Faces,
    /// Their edges.
    pub table: &'a EdgeTable,
    /// The directions in which the radar transmits, from one point.
    pub windows: &'a [Frame],
    /// How far chains are followed.
    pub options: &'a BeamOptions,
}

/// Follows the chains of radars, each amid faces of its own, in shared submissions; to the bit as each alone.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn follow_all(gpu: &Gpu, all: &[Sight<'_>]) -> Result<Vec<Followed>> {
    let scenes: Vec<Option<Scene<'_>>> =
        all.par_iter().map_tasks(|s| Scene::new(s.faces, s.table, s.windows)).collect();
    let some: Vec<usize> = (0..all.len()).filter(|i| scenes[*i].is_some()).collect();
    let of_some: Vec<(&Scene<'_>, &BeamOptions)> =
        some.iter().filter_map(|i| Some((scenes[*i].as_ref()?, all[*i].options))).collect();
    let mut followed: Vec<Followed> = all.iter().map(|_| Followed::Whole(Vec::new())).collect();
    for (i, of) in some.into_iter().zip(followed_together(gpu, &of_some)?) {
        followed[i] = of;
    }
    Ok(followed)
}

/// How the work of [`follow`] is shared out, kernel by kernel, all bounces together; none where it is refused.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn balance(gpu: &Gpu, sight: Sight<'_>) -> Result<Vec<Balance>> {
    let Some(scene) = Scene::new(sight.faces, sight.table, sight.windows) else { return Ok(Vec::new()) };
    let balance = Mutex::new(Vec::new());
    match together(gpu, &[(&scene, sight.options)], Some(&balance)) {
        Err(Stop::Failed(e)) => Err(e),
        Err(Stop::Refused(_)) => Ok(Vec::new()),
        Ok(_) => Ok(balance.into_inner().unwrap_or_default()),
    }
}

/// [`follow_all`] of one radar.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn follow(gpu: &Gpu, sight: Sight<'_>) -> Result<Followed> {
    Ok(follow_all(gpu, &[sight])?.pop().unwrap_or(Followed::Refused("nothing to follow")))
}

/// Scenes that the device refuses together are tried by halves.
fn followed_together(gpu: &Gpu, scenes: &[(&Scene<'_>, &BeamOptions)]) -> Result<Vec<Followed>> {
    match together(gpu, scenes, None) {
        Ok(all) => Ok(all.into_iter().map(Followed::Whole).collect()),
        Err(Stop::Failed(e)) => Err(e),
        Err(Stop::Refused(why)) if scenes.len() == 1 => Ok(vec![Followed::Refused(why)]),
        Err(Stop::Refused(_)) => {
            let (first, second) = scenes.split_at(scenes.len() / 2);
            let mut all = followed_together(gpu, first)?;
            all.extend(followed_together(gpu, second)?);
            Ok(all)
        }
    }
}

fn together(
    gpu: &Gpu,
    scenes: &[(&Scene<'_>, &BeamOptions)],
    balance: Option<&Mutex<Vec<Balance>>>,
) -> std::result::Result<Vec<Vec<Chain>>, Stop> {
    if scenes.is_empty() {
        return Ok(Vec::new());
    }
    let of_all: Vec<&Scene<'_>> = scenes.iter().map(|s| s.0).collect();
    let arrays = LineArrays::new(&of_all).ok_or(Stop::Refused("more faces than it can number"))?;
    if size_of_val(&arrays.body[..]) as u64 > gpu.max_binding_bytes() {
        return Err(Stop::Refused("a scene that is larger than one binding of the adapter"));
    }
    let mut recorder = gpu.recorder("scenes of edges");
    let body = recorder.upload("scenes", &arrays.body);
    recorder.submit()?;
    let mut tracer = Tracer { gpu, arrays: &arrays, body, ratios: FIRST, balance };
    let mut followers: Vec<Follower<'_>> =
        scenes.iter().map(|(scene, options)| Follower::new(scene, options)).collect();
    loop {
        let new: Vec<Vec<Vec<Chain>>> = {
            let views: Vec<Vec<(usize, View<'_>)>> =
                followers.par_iter().map_tasks(Follower::views).collect();
            let asked: Vec<(u32, &View<'_>)> = views
                .iter()
                .enumerate()
                .flat_map(|(scene, views)| views.iter().map(move |(_, view)| (scene as u32, view)))
                .collect();
            if asked.is_empty() {
                break;
            }
            let mut lit = tracer.fragments(&asked)?.into_iter();
            let of_scenes: Vec<Vec<Vec<Fragment>>> =
                views.iter().map(|views| lit.by_ref().take(views.len()).collect()).collect();
            let of_scenes = followers.par_iter().zip(&views).zip(of_scenes);
            of_scenes.map_tasks(|((follower, views), lit)| follower.children(views, lit)).collect()
        };
        followers.iter_mut().zip(new).for_each(|(follower, new)| follower.extend(new));
        tracer.ratios = MIRRORS;
    }
    Ok(followers.into_iter().map(|f| f.chains).collect())
}

/// The chains of a frame, or why the device cannot follow them.
pub enum Followed {
    /// All of them.
    Whole(Vec<Chain>),
    /// It met with something that it has no room for.
    Refused(&'static str),
}

fn lock(balance: &Mutex<Vec<Balance>>) -> MutexGuard<'_, Vec<Balance>> {
    balance.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The shares between which a segment is cut, into as many equal parts as it spans [`WIDEST`] in view.
fn parts(source: DVec3, ends_m: [DVec3; 2]) -> impl Iterator<Item = [f64; 2]> {
    let [a, b] = ends_m.map(|p| p - source);
    // No angle where an end is the source.
    let count = (a.angle_between(b) / WIDEST).ceil();
    let count = if count > 1.0 { count.min(32.0) } else { 1.0 };
    (0..count as u32).map(move |k| [f64::from(k) / count, f64::from(k + 1) / count])
}

/// The name of a fragment that the device has found in a scene with such numbers, the outline of whose view begins with the fragment `first`.
fn name_of(words: &[Word; 2], numbers: &Numbers, first: u32) -> Name {
    let [_, named, state, face] = words[0];
    let (kind, number) = (named >> 30, named & 0x3fff_ffff);
    let line = match kind {
        OF_EDGE if state & IS_SIDE != 0 => Line::Side { edge: number - numbers.edges, half: state >> HALVES },
        OF_EDGE => {
            let side = if state & FREE_POSITIVE != 0 { 1.0 } else { -1.0 };
            Line::Shadow { edge: number - numbers.edges, side }
        }
        OF_WALL => Line::Wall { window: number / 4 - numbers.windows, wall: number % 4 },
        _ => Line::Outline(number - first),
    };
    Name { line, shares: shares(words[1]), face: face - numbers.faces, is_along: state & ALONG != 0 }
}

/// Why a run ends.
enum Stop {
    Failed(Error),
    Refused(&'static str),
}

impl From<Error> for Stop {
    fn from(e: Error) -> Stop {
        Stop::Failed(e)
    }
}

/// The lists of a run, by their places in `sizes`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Of {
    /// Groups of edges ahead, and these edges.
    Groups,
    Ahead,
    /// Their parts between bounds, and between nearer silhouettes.
    Bounds,
    Nearer,
    /// Fragments along edges.
    Sides,
    /// Silhouettes that throw shadows, their parts, and the shadows.
    Casters,
    CasterParts,
    Shadows,
    /// Outlines and walls, their parts, and the shadows.
    Outlines,
    OutlineParts,
    Windows,
}

const LISTS: usize = 11;
/// Words of `sizes`: trouble, sizes, and from `NEEDED` on what they would be.
const SIZES: usize = 32;
const NEEDED: usize = 16;
/// Room of a list before it is known how long it is: so much, and so much for each edge of the scenes at the first bounce and for each
/// fragment of an outline at later ones, which is enough for most frames. What has no room goes again.
const LEAST_ROOM: usize = 1 << 12;
const FIRST: [f64; LISTS] = [0.1, 1.0, 1.2, 3.5, 1.3, 0.6, 1.1, 0.8, 0.0, 0.1, 0.1];
const MIRRORS: [f64; LISTS] = [16.0, 16.0, 20.0, 24.0, 6.0, 1.5, 3.0, 2.5, 0.0, 7.0, 6.0];

struct Tracer<'a> {
    gpu: &'a Gpu,
    arrays: &'a LineArrays,
    body: Buffer<Word>,
    /// Room of each list for each edge, or for each fragment of an outline.
    ratios: [f64; LISTS],
    /// Where the work of threads is counted, if it is.
    balance: Option<&'a Mutex<Vec<Balance>>>,
}

/// One run of the kernels over the views of one bounce.
struct Run<'a> {
    recorder: Recorder<'a>,
    body: Buffer<Word>,
    views: Buffer<Word>,
    sizes: Buffer<u32>,
    params: LineParams,
    rooms: [usize; LISTS],
    counts_work: bool,
    work: Vec<(&'static str, Pending<u32>)>,
}

impl Tracer<'_> {
    /// The fragments of views, each of the scene with a number.
    fn fragments(&self, views: &[(u32, &View<'_>)]) -> std::result::Result<Vec<Vec<Fragment>>, Stop> {
        // Fewer views have shorter lists, until one alone is too much.
        match self.fragments_together(views) {
            Err(Stop::Refused(_)) if views.len() > 1 => {
                let (first, second) = views.split_at(views.len() / 2);
                let mut all = self.fragments(first)?;
                all.extend(self.fragments(second)?);
                Ok(all)
            }
            other => other,
        }
    }

    fn fragments_together(
        &self,
        views: &[(u32, &View<'_>)],
    ) -> std::result::Result<Vec<Vec<Fragment>>, Stop> {
        let numbers = &self.arrays.numbers;
        let Some((words, at)) = line_arrays::views(views, numbers) else {
            return Err(Stop::Refused("more outlines than it can number"));
        };
        let params = LineParams {
            legs_at: at.legs_at,
            spaces_at: at.spaces_at,
            outlines_at: at.outlines_at,
            hulls_at: at.hulls_at,
            views: at.views,
            ..self.arrays.params
        };
        let firsts: Vec<u32> = views
            .iter()
            .scan(0, |next, (_, view)| {
                let first = *next;
                *next += view.outline().len() as u32;
                Some(first)
            })
            .collect();
        let edges: usize =
            views.iter().filter(|(_, v)| v.legs.len() == 1).map(|(_, v)| v.scene.table.edges.len()).sum();
        let outlines = (0..views.len()).into_par_iter().map_tasks(|v| {
            let (scene, view) = views[v];
            let cut = |kind: u32, number: u32, ends_m: [DVec3; 2]| {
                parts(view.source(), ends_m).flat_map(move |shares| segment(v as u32, kind, number, shares))
            };
            if view.legs.len() > 1 {
                let fragments = (firsts[v]..).zip(view.outline());
                return fragments.flat_map(|(number, f)| cut(OF_OUTLINE, number, f.ends_m)).collect();
            }
            let walls = (0..4 * view.scene.windows.len()).flat_map(|number| {
                let (ends_m, _) = wall_of(&view.scene.windows[number / 4], number % 4);
                cut(OF_WALL, 4 * numbers[scene as usize].windows + number as u32, ends_m)
            });
            walls.collect()
        });
        let outlines: Vec<Vec<Word>> = outlines.collect();
        let outlines = outlines.concat();
        let basis = (outlines.len() / 2 + edges) as f64;
        let mut rooms = self.ratios.map(|ratio| LEAST_ROOM + (ratio * basis) as usize);
        let found = loop {
            match self.run(&words, params, at.count, &outlines, rooms)? {
                Ok(found) => break found,
                // What comes behind a list that had no room is not known yet.
                Err(needed) => {
                    let short = (0..LISTS).find(|i| needed[*i] > rooms[*i]).unwrap_or(0);
                    let more = needed[short] as f64 / rooms[short] as f64;
                    for room in &mut rooms[short..] {
                        *room = (1.1 * more * *room as f64) as usize + 1;
                    }
                }
            }
        };
        // Each list has what a view has found side by side.
        let (found, _) = found.as_chunks::<2>();
        let mut of_views: Vec<Vec<&[[Word; 2]]>> = vec![Vec::new(); views.len()];
        found.chunk_by(|a, b| a[0][0] == b[0][0]).for_each(|run| of_views[run[0][0][0] as usize].push(run));
        let named =
            of_views.par_iter().zip(views).zip(&firsts).map_tasks(|((runs, (scene, view)), first)| {
                let name = |words: &[Word; 2]| {
                    view.fragment_named(&name_of(words, &numbers[*scene as usize], *first))
                };
                runs.iter().flat_map(|run| run.iter().map(name)).collect()
            });
        Ok(named.collect())
    }

    /// Follows the rays of views, in one submission: the fragments, or how long each list would have to be.
    fn run(
        &self,
        views: &[Word],
        params: LineParams,
        threads: u32,
        outlines: &[Word],
        rooms: [usize; LISTS],
    ) -> std::result::Result<std::result::Result<Vec<Word>, [usize; LISTS]>, Stop> {
        let lists = rooms.iter().max().copied().unwrap_or(0) * 2 * size_of::<Word>();
        let uploads = size_of_val(views).max(size_of_val(outlines)).max(size_of::<u32>() * threads as usize);
        if lists.max(uploads) as u64 > self.gpu.max_binding_bytes() {
            return Err(Stop::Refused("more to see than one binding of the adapter holds"));
        }
        let mut recorder = self.gpu.recorder("visibility by lines");
        let mut sizes = [0; SIZES];
        sizes[1 + Of::Outlines as usize] = outlines.len() as u32 / 2;
        let (views, sizes) = (recorder.upload("views", views), recorder.upload("sizes", &sizes));
        let outlines = recorder.upload("outlines", outlines);
        let counts_work = self.balance.is_some();
        let params = LineParams { counts_work: counts_work.into(), ..params };
        let body = self.body.clone();
        let mut run = Run { recorder, body, views, sizes, params, rooms, counts_work, work: Vec::new() };
        let groups = run.ahead(GROUPS_AHEAD, None, threads as usize);
        let edges = run.ahead(EDGES_AHEAD, Some(&groups), run.room(Of::Groups));
        let parts = run.split(BOUNDS, [Of::Ahead, Of::Bounds], &edges);
        let parts = run.split(NEARER, [Of::Bounds, Of::Nearer], &parts);
        run.decide(&line_sides::KERNEL, Of::Nearer, &parts);
        let sides = run.gather(SIDES, [Of::Nearer, Of::Sides], &parts);
        let casters = run.gather(CASTERS, [Of::Nearer, Of::Casters], &parts);
        let parts = run.split(BEYOND, [Of::Casters, Of::CasterParts], &casters);
        run.decide(&line_shadow::KERNEL, Of::CasterParts, &parts);
        let shadows = run.gather(SHADOWS, [Of::CasterParts, Of::Shadows], &parts);
        let parts = run.split(BEYOND, [Of::Outlines, Of::OutlineParts], &outlines);
        run.decide(&line_shadow::KERNEL, Of::OutlineParts, &parts);
        let windows = run.gather(SHADOWS, [Of::OutlineParts, Of::Windows], &parts);
        let lists = [(Of::Sides, sides), (Of::Shadows, shadows), (Of::Windows, windows)];
        let Run { mut recorder, sizes, work, .. } = run;
        let reads = lists.map(|(of, words)| (of, recorder.read(&words)));
        let sizes = recorder.read(&sizes);
        let mut done = recorder.submit()?;
        let sizes = done.take(sizes);
        match sizes[0] {
            0 => {}
            2 => return Err(Stop::Refused("loops that its driver ends early")),
            _ => return Err(Stop::Refused("an edge in which more than 24 faces meet")),
        }
        let mut needed = [0; LISTS];
        needed.iter_mut().zip(&sizes[NEEDED + 1..]).for_each(|(n, size)| *n = *size as usize);
        if needed.iter().zip(rooms).any(|(n, room)| *n > room) {
            return Ok(Err(needed));
        }
        if let Some(balance) = self.balance {
            let mut all = lock(balance);
            for (name, read) in work {
                let work = done.take(read);
                match all.iter_mut().find(|b| b.name == name) {
                    Some(of) => of.add(&work),
                    None => {
                        let mut of = Balance { name, ..Balance::default() };
                        of.add(&work);
                        all.push(of);
                    }
                }
            }
        }
        let mut found = Vec::new();
        for (of, read) in reads {
            found.extend_from_slice(&done.take(read)[..2 * needed[of as usize]]);
        }
        Ok(Ok(found))
    }
}

impl Run<'_> {
    fn room(&self, of: Of) -> usize {
        self.rooms[of as usize]
    }

    /// How many records a list may have.
    fn most(&self, of: Of, words: &Buffer<Word>) -> usize {
        if of == Of::Outlines { words.len() / 2 } else { self.room(of) }
    }

    /// Where threads say how many tests they made.
    fn work(&mut self, threads: usize) -> Buffer<u32> {
        self.recorder.zeros("work", if self.counts_work { threads } else { 1 })
    }

    fn read_work(&mut self, name: &'static str, work: &Buffer<u32>) {
        if self.counts_work {
            let read = self.recorder.read(work);
            self.work.push((name, read));
        }
    }

    fn list(&mut self, of: Of) -> Buffer<Word> {
        self.recorder.buffer("segments", 2 * self.room(of))
    }

    /// The groups of edges ahead of all views, or the edges of such groups as segments.
    fn ahead(&mut self, stage: u32, groups: Option<&Buffer<Word>>, count: usize) -> Buffer<Word> {
        let (of, words, name) = match groups {
            None => (Of::Groups, 1, "line_ahead, groups"),
            Some(_) => (Of::Ahead, 2, "line_ahead, edges"),
        };
        let counts = self.recorder.zeros::<u32>("counts", count + 1);
        let ahead = self.recorder.buffer("ahead", words * self.room(of));
        let work = self.work(count);
        for mode in [0, 1] {
            let params = LineParams {
                count: count as u32,
                mode,
                stage,
                list_in: Of::Groups as u32,
                list_out: of as u32,
                room: self.room(of) as u32,
                ..self.params
            };
            let groups = groups.unwrap_or(&self.views);
            self.recorder.dispatch(
                &line_ahead::KERNEL,
                &params,
                &[&self.body, &self.views, groups, &counts, &ahead, &self.sizes, &work],
                Threads::Linear(count as u64),
            );
            if mode == 0 {
                scan::record(&mut self.recorder, &counts, count + 1);
            }
        }
        self.read_work(name, &work);
        ahead
    }

    /// The parts of segments.
    fn split(&mut self, stage: u32, [from, to]: [Of; 2], segments: &Buffer<Word>) -> Buffer<Word> {
        let count = self.most(from, segments);
        let counts = self.recorder.zeros::<u32>("counts", count + 1);
        let shares = self.recorder.buffer::<[f32; 2]>("shares", self.room(to));
        let words = self.list(to);
        let work = self.work(count);
        for mode in [0, 1] {
            let params = LineParams {
                count: count as u32,
                mode,
                stage,
                list_in: from as u32,
                list_out: to as u32,
                room: self.room(to) as u32,
                ..self.params
            };
            self.recorder.dispatch(
                &line_split::KERNEL,
                &params,
                &[&self.body, &self.views, segments, &counts, &shares, &words, &self.sizes, &work],
                Threads::Linear(count as u64),
            );
            if mode == 0 {
                scan::record(&mut self.recorder, &counts, count + 1);
            }
        }
        let name = match (stage, to) {
            (BOUNDS, _) => "line_split, bounds",
            (NEARER, _) => "line_split, nearer edges",
            (_, Of::CasterParts) => "line_split, edges beyond silhouettes",
            _ => "line_split, edges beyond outlines",
        };
        self.read_work(name, &work);
        words
    }

    /// Runs a kernel that decides on the segments of a list.
    fn decide(&mut self, kernel: &'static Kernel, of: Of, segments: &Buffer<Word>) {
        let params = LineParams { list_in: of as u32, ..self.params };
        let work = self.work(self.room(of));
        self.recorder.dispatch(
            kernel,
            &params,
            &[&self.body, &self.views, segments, &self.sizes, &work],
            Threads::Linear(self.room(of) as u64),
        );
        let name = match of {
            Of::Nearer => "line_sides",
            Of::CasterParts => "line_shadow, silhouettes",
            _ => "line_shadow, outlines",
        };
        self.read_work(name, &work);
    }

    /// What a list has brought, side by side.
    fn gather(&mut self, stage: u32, [from, to]: [Of; 2], segments: &Buffer<Word>) -> Buffer<Word> {
        let count = self.room(from);
        let counts = self.recorder.zeros::<u32>("counts", count + 1);
        let words = self.list(to);
        for mode in [0, 1] {
            let params = LineParams {
                count: count as u32,
                mode,
                stage,
                list_in: from as u32,
                list_out: to as u32,
                room: self.room(to) as u32,
                ..self.params
            };
            self.recorder.dispatch(
                &line_gather::KERNEL,
                &params,
                &[&self.body, segments, &counts, &words, &self.sizes],
                Threads::Linear(count as u64),
            );
            if mode == 0 {
                scan::record(&mut self.recorder, &counts, count + 1);
            }
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use super::super::line_arrays::{GROUP, GROUPS, HULL};
    use super::*;
    use crate::gpu::shader_constant;

    #[test]
    fn the_shaders_have_the_same_states_and_lists() {
        let of = |source: &str, name: &str| shader_constant(source, name).unwrap_or(f64::NAN) as u32;
        let params = include_str!("../../shaders/shared/line_params.wgsl");
        let states = [("ALONG", ALONG), ("FREE_POSITIVE", FREE_POSITIVE), ("IS_SIDE", IS_SIDE)];
        let numbers = [("HALVES", HALVES), ("NEEDED", NEEDED as u32)];
        let kinds = [("OF_EDGE", OF_EDGE), ("OF_WALL", OF_WALL), ("OF_OUTLINE", OF_OUTLINE)];
        for (name, value) in states.into_iter().chain(numbers).chain(kinds) {
            assert_eq!(of(params, name), value, "{name}");
        }
        for (name, value) in [("GROUP", GROUP), ("GROUPS", GROUPS), ("HULL", HULL)] {
            assert_eq!(of(params, name), value, "{name}");
        }
        assert_eq!(shader_constant(params, "WIDEST"), Some(WIDEST));
        let ahead = include_str!("../../shaders/trace/line_ahead.wgsl");
        for (name, value) in [("GROUPS_AHEAD", GROUPS_AHEAD), ("EDGES_AHEAD", EDGES_AHEAD)] {
            assert_eq!(of(ahead, name), value, "{name}");
        }
        let split = include_str!("../../shaders/trace/line_split.wgsl");
        for (name, value) in [("BOUNDS", BOUNDS), ("NEARER", NEARER), ("BEYOND", BEYOND)] {
            assert_eq!(of(split, name), value, "{name}");
        }
        let gather = include_str!("../../shaders/trace/line_gather.wgsl");
        for (name, value) in [("SIDES", SIDES), ("CASTERS", CASTERS), ("SHADOWS", SHADOWS)] {
            assert_eq!(of(gather, name), value, "{name}");
        }
    }
}
