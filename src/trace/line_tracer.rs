//! Chains of mirrors followed by lines on the device, as [`super::cpu::chains::follow`] does on the host.
//!
//! All views of one bounce go together. Their edges ahead are split where bounds and nearer silhouettes cross them (`line_split`), each
//! part is decided by rays (`line_sides`), what throws shadows is split where edges cross beyond it, and one ray finds the face behind
//! each piece (`line_shadow`). Every list is a flat one: a thread takes one segment, counts, and writes behind the sums of the counts.
//! What comes out names lines and shares of them (`line_gather`); positions follow in f64.

use super::cpu::chains::{self, Chain};
use super::cpu::lines::{Fragment, Line, Name, Scene, View};
use super::line_arrays::{self, LineArrays, LineParams, OF_EDGE, OF_OUTLINE, OF_WALL, Word, segment, shares};
use super::{line_ahead, line_gather, line_shadow, line_sides, line_split, scan};
use crate::base::error::{Error, Result};
use crate::geom::edge_table::EdgeTable;
use crate::geom::faces::Faces;
use crate::gpu::{Buffer, Gpu, Recorder, Threads};
use crate::trace::beams::{BeamOptions, Frame};

// As in shaders/shared/line_params.wgsl.
const ALONG: u32 = 4;
const FREE_POSITIVE: u32 = 8;
const IS_SIDE: u32 = 32;
const HALVES: u32 = 8;

/// Nodes of the tree over edges that a thread of `line_ahead` walks through.
const CHUNK: u32 = 256;
/// Lists of `line_split`.
const BOUNDS: u32 = 0;
const NEARER: u32 = 1;
const BEYOND: u32 = 2;
/// Lists of `line_gather`.
const SIDES: u32 = 0;
const CASTERS: u32 = 1;
const SHADOWS: u32 = 2;

/// Follows all chains of a radar that looks through windows from one point on the device.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn follow(
    gpu: &Gpu,
    faces: &Faces,
    table: &EdgeTable,
    windows: &[Frame],
    options: &BeamOptions,
) -> Result<Followed> {
    let Some(scene) = Scene::new(faces, table, windows) else { return Ok(Followed::Whole(Vec::new())) };
    let Some(arrays) = LineArrays::new(&[&scene]) else {
        return Ok(Followed::Refused("more faces than it can number"));
    };
    let mut recorder = gpu.recorder("a scene of edges");
    let body = recorder.upload("scene", &arrays.body);
    recorder.submit()?;
    let tracer = Tracer { gpu, arrays: &arrays, body };
    match chains::follow_with(&scene, options, |views| tracer.fragments(views)) {
        Ok(chains) => Ok(Followed::Whole(chains)),
        Err(Stop::Refused(why)) => Ok(Followed::Refused(why)),
        Err(Stop::Failed(e)) => Err(e),
    }
}

/// The chains of a frame, or why the device cannot follow them.
pub enum Followed {
    /// All of them.
    Whole(Vec<Chain>),
    /// It met with something that it has no room for.
    Refused(&'static str),
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

struct Tracer<'a> {
    gpu: &'a Gpu,
    arrays: &'a LineArrays,
    body: Buffer<Word>,
}

/// Segments on the device, two words each.
#[derive(Clone)]
struct List {
    words: Buffer<Word>,
    count: usize,
}

/// What all kernels of a run read.
struct Views {
    words: Buffer<Word>,
    params: LineParams,
    troubles: Buffer<u32>,
}

impl Tracer<'_> {
    /// The fragments of each view.
    fn fragments(&self, views: &[View<'_>]) -> std::result::Result<Vec<Vec<Fragment>>, Stop> {
        let Some((words, at)) = line_arrays::views(views, &vec![0; views.len()], &self.arrays.numbers) else {
            return Err(Stop::Refused("more outlines than it can number"));
        };
        let params = LineParams {
            legs_at: at.legs_at,
            spaces_at: at.spaces_at,
            outlines_at: at.outlines_at,
            ..self.arrays.params
        };
        let mut recorder = self.gpu.recorder("visibility by lines");
        let words = recorder.upload("views", &words);
        let troubles = recorder.zeros("troubles", 1);
        let run = Views { words, params, troubles };
        let numbers = &self.arrays.numbers[0];
        let mut chunks: Vec<[u32; 2]> = Vec::new();
        let mut outlines: Vec<Word> = Vec::new();
        let mut first = 0;
        let mut firsts = Vec::with_capacity(views.len());
        for (v, view) in views.iter().enumerate() {
            let v = v as u32;
            let [first_node, end] = self.arrays.edge_nodes[0];
            chunks.extend((first_node..end).step_by(CHUNK as usize).map(|node| [v, node]));
            firsts.push(first);
            if view.legs.len() == 1 {
                let walls = 0..4 * view.scene.windows.len() as u32;
                outlines.extend(walls.flat_map(|w| segment(v, OF_WALL, 4 * numbers.windows + w, [0.0, 1.0])));
            } else {
                let of = first..first + view.outline().len() as u32;
                first = of.end;
                outlines.extend(of.flat_map(|f| segment(v, OF_OUTLINE, f, [0.0, 1.0])));
            }
        }
        let list = |recorder: &mut Recorder<'_>, label, words: &[Word]| List {
            words: recorder.upload(label, words),
            count: words.len() / 2,
        };
        let chunks = recorder.upload("chunks", &chunks);
        let outlines = list(&mut recorder, "outlines", &outlines);
        let edges = self.ahead(recorder, &run, &chunks)?;
        let parts = self.split(self.recorder(), &run, BOUNDS, &edges)?;
        let parts = self.split(self.recorder(), &run, NEARER, &parts)?;
        let mut recorder = self.recorder();
        self.dispatch_on(&mut recorder, &line_sides::KERNEL, &run, &parts);
        let sides = self.gather(recorder, &run, SIDES, &parts)?;
        let casters = self.gather(self.recorder(), &run, CASTERS, &parts)?;
        let mut found = vec![sides];
        for casters in [casters, outlines] {
            let parts = self.split(self.recorder(), &run, BEYOND, &casters)?;
            let mut recorder = self.recorder();
            self.dispatch_on(&mut recorder, &line_shadow::KERNEL, &run, &parts);
            found.push(self.gather(recorder, &run, SHADOWS, &parts)?);
        }
        let mut recorder = self.recorder();
        let reads: Vec<_> = found.iter().map(|l| recorder.read(&l.words)).collect();
        let troubles = recorder.read(&run.troubles);
        let mut done = recorder.submit()?;
        match done.take(troubles)[0] {
            0 => {}
            2 => return Err(Stop::Refused("loops that its driver ends early")),
            _ => return Err(Stop::Refused("an edge in which more than 24 faces meet")),
        }
        let mut fragments: Vec<Vec<Fragment>> = views.iter().map(|_| Vec::new()).collect();
        for (read, list) in reads.into_iter().zip(&found) {
            for words in done.take(read)[..2 * list.count].chunks_exact(2) {
                let [view, named, state, face] = words[0];
                let (kind, number) = (named >> 30, named & 0x3fff_ffff);
                let v = view as usize;
                let line = match kind {
                    OF_EDGE if state & IS_SIDE != 0 => {
                        Line::Side { edge: number - numbers.edges, half: state >> HALVES }
                    }
                    OF_EDGE => {
                        let side = if state & FREE_POSITIVE != 0 { 1.0 } else { -1.0 };
                        Line::Shadow { edge: number - numbers.edges, side }
                    }
                    OF_WALL => Line::Wall { window: number / 4 - numbers.windows, wall: number % 4 },
                    _ => Line::Outline(number - firsts[v]),
                };
                let name = Name {
                    line,
                    shares: shares(words[1]),
                    face: face - numbers.faces,
                    is_along: state & ALONG != 0,
                };
                fragments[v].push(views[v].fragment_named(&name));
            }
        }
        Ok(fragments)
    }

    fn recorder(&self) -> Recorder<'_> {
        self.gpu.recorder("visibility by lines")
    }

    /// Runs a kernel that works on the states of a list.
    fn dispatch_on(
        &self,
        recorder: &mut Recorder<'_>,
        kernel: &'static crate::gpu::Kernel,
        run: &Views,
        list: &List,
    ) {
        let params = LineParams { count: list.count as u32, ..run.params };
        let threads = Threads::Linear(list.count as u64);
        recorder.dispatch(kernel, &params, &[&self.body, &run.words, &list.words, &run.troubles], threads);
    }

    /// The edges ahead of all views, as segments.
    fn ahead(&self, mut recorder: Recorder<'_>, run: &Views, chunks: &Buffer<[u32; 2]>) -> Result<List> {
        let params = LineParams { count: chunks.len() as u32, stage: CHUNK, ..run.params };
        let threads = Threads::Linear(chunks.len() as u64);
        let counts = recorder.zeros::<u32>("counts", chunks.len() + 1);
        let nothing = recorder.buffer::<Word>("nothing", 2);
        recorder.dispatch(
            &line_ahead::KERNEL,
            &params,
            &[&self.body, &run.words, chunks, &counts, &nothing, &run.troubles],
            threads,
        );
        let total = scan::record(&mut recorder, &counts, chunks.len() + 1);
        let total = recorder.read(&total);
        let mut done = recorder.submit()?;
        let count = done.take(total)[0] as usize;
        let mut recorder = self.recorder();
        let words = recorder.buffer::<Word>("edges ahead", 2 * count);
        recorder.dispatch(
            &line_ahead::KERNEL,
            &LineParams { mode: 1, ..params },
            &[&self.body, &run.words, chunks, &counts, &words, &run.troubles],
            threads,
        );
        recorder.submit()?;
        Ok(List { words, count })
    }

    /// The parts of segments.
    fn split(&self, mut recorder: Recorder<'_>, run: &Views, stage: u32, list: &List) -> Result<List> {
        let params = LineParams { count: list.count as u32, stage, ..run.params };
        let threads = Threads::Linear(list.count as u64);
        let counts = recorder.zeros::<u32>("counts", list.count + 1);
        let nothing = recorder.buffer::<[f32; 2]>("no shares", 1);
        let no_parts = recorder.buffer::<Word>("no parts", 2);
        recorder.dispatch(
            &line_split::KERNEL,
            &params,
            &[&self.body, &run.words, &list.words, &counts, &nothing, &no_parts, &run.troubles],
            threads,
        );
        let total = scan::record(&mut recorder, &counts, list.count + 1);
        let total = recorder.read(&total);
        let mut done = recorder.submit()?;
        let total = done.take(total)[0] as usize;
        let mut recorder = self.recorder();
        let shares = recorder.buffer::<[f32; 2]>("shares", total);
        let count = total + list.count;
        let words = recorder.buffer::<Word>("parts", 2 * count);
        recorder.dispatch(
            &line_split::KERNEL,
            &LineParams { mode: 1, ..params },
            &[&self.body, &run.words, &list.words, &counts, &shares, &words, &run.troubles],
            threads,
        );
        recorder.submit()?;
        Ok(List { words, count })
    }

    /// What a list has brought, side by side.
    fn gather(&self, mut recorder: Recorder<'_>, run: &Views, stage: u32, list: &List) -> Result<List> {
        let params = LineParams { count: list.count as u32, stage, ..run.params };
        let threads = Threads::Linear(list.count as u64);
        let counts = recorder.zeros::<u32>("counts", list.count + 1);
        let nothing = recorder.buffer::<Word>("nothing", 2);
        recorder.dispatch(
            &line_gather::KERNEL,
            &params,
            &[&self.body, &list.words, &counts, &nothing],
            threads,
        );
        let total = scan::record(&mut recorder, &counts, list.count + 1);
        let total = recorder.read(&total);
        let mut done = recorder.submit()?;
        let count = done.take(total)[0] as usize;
        let mut recorder = self.recorder();
        let words = recorder.buffer::<Word>("gathered", 2 * count);
        recorder.dispatch(
            &line_gather::KERNEL,
            &LineParams { mode: 1, ..params },
            &[&self.body, &list.words, &counts, &words],
            threads,
        );
        recorder.submit()?;
        Ok(List { words, count })
    }
}
