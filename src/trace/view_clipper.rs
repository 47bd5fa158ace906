//! Beams of frames clipped on the device, level by level: which faces stand ahead (`view_ahead`), what the lines of a beam hold of them
//! (`view_target`) and what nearer faces leave of that (`view_hide`). The host works corners out from their lines
//! (`cpu::levels`), and makes the views behind the next mirrors.
//!
//! Frames that are traced together share every kernel and every submission: their scenes stand one behind the other, and a beam meets
//! only what is of its own. A level is one submission where its beams meet as much as is expected; what goes beyond that goes again.
//! What comes out has the same order in every run, however many frames are traced together.

use super::beams::{BeamOptions, Frame};
use super::cpu::beams::{Clipped, Ends};
use super::cpu::levels::{Levels, LitPolygon, Numbers, Onward};
use super::cpu::topology::Shared;
use super::views::{PIECE, SLOTS, ViewArrays, ViewParams};
use super::{scan, view_ahead, view_gather, view_hide, view_target};
use crate::base::error::Result;
use crate::base::tasks::Tasks;
use crate::geom::faces::Faces;
use crate::gpu::{AnyBuffer, Buffer, Done, Gpu, Kernel, Pending, Recorder, Threads};
use rayon::prelude::*;

/// Kernels of all paths; the last one serves paths of several bounces alone.
static KERNELS: [&Kernel; 5] =
    [&view_target::KERNEL, &scan::KERNEL, &view_hide::KERNEL, &view_gather::KERNEL, &view_ahead::KERNEL];

/// Kernels that follow beams over so many bounces.
pub fn kernels(bounces: usize) -> &'static [&'static Kernel] {
    match bounces {
        0 => &[],
        1 => &KERNELS[..4],
        _ => &KERNELS,
    }
}

/// Pairs of a beam and a face that are looked at together.
const PAIRS: usize = 1 << 18;
/// Pairs for which there is room before it is known how many there are: so many, or so many a beam.
const LEAST_PAIRS: usize = 1 << 10;
const PAIRS_OF_BEAM: usize = 8;
/// Beams that look for faces together, and threads that do.
const BEAMS: usize = 1 << 16;
const WALKS: usize = 1 << 20;
/// Nodes of the tree that a thread of `view_ahead` walks through: drivers on the cpu end loops after 65,535 steps.
const NODES: [usize; 2] = [1 << 12, 1 << 8];
/// Threads of `view_hide` that run together: many for a GPU, few for a driver on the cpu.
const THREADS: [usize; 2] = [1 << 16, 1 << 12];
/// Steps that a thread of `view_hide` may take at a time. A driver on the cpu has no use for handing on, but ends loops after 65,535 steps
/// of threads that take them together.
const BUDGET: [u32; 2] = [1 << 17, 1 << 12];
/// Rounds in which what goes on is followed in one submission, those after the first with an eighth of its threads: in the windows, where a
/// road may be hidden by hundreds of faces, and behind mirrors.
const ROUNDS: [usize; 2] = [6, 3];
/// Least number of threads of a round.
const LEAST_THREADS: usize = 256;
/// Runs of rounds in one submission; and in the first one, before it is known how many of them have something to do, on a GPU and on a
/// driver on the cpu: each costs a GPU what comes back of it.
const RUNS: usize = 32;
const FIRST_RUNS: [usize; 2] = [1, 16];
/// Words of what is through for which a thread has room, of a polygon of seven corners. Where that is too little it goes again with four
/// times as much, up to what all its slots hold.
const WORDS: usize = 16;

/// What beams of a frame meet, or why the device cannot tell.
pub enum Traced {
    /// All of it.
    Whole(Clipped),
    /// It met with something that it has no room for.
    Refused(&'static str),
}

/// The beams of a radar that stands amid faces.
#[derive(Clone, Copy)]
pub struct Beams<'a> {
    /// What they meet.
    pub faces: &'a Faces,
    /// What the radar looks at.
    pub windows: &'a [Frame],
    /// How far they are followed.
    pub options: &'a BeamOptions,
    /// What tells of beams that the limit of bounces ends; None leaves them out.
    pub ends: Option<Ends<'a>>,
}

/// Follows the beams of a radar that may stand amid the faces, as [`super::cpu::beams::clip_windows`] does, on the device.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn clip_windows(
    gpu: &Gpu,
    faces: &Faces,
    windows: &[Frame],
    options: &BeamOptions,
    ends: Option<Ends<'_>>,
) -> Result<Traced> {
    let mut all = clip_all(gpu, &[Beams { faces, windows, options, ends }])?;
    Ok(all.pop().unwrap_or(Traced::Refused("nothing to trace")))
}

/// [`clip_windows`] of several radars in scenes of their own, to the bit, in shared submissions.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn clip_all(gpu: &Gpu, all: &[Beams<'_>]) -> Result<Vec<Traced>> {
    let shared: Vec<Option<Shared<'_>>> = all
        .par_iter()
        .map_tasks(|b| {
            let root = b.windows.first().filter(|_| !b.faces.faces.is_empty())?;
            Some(Shared::new(b.faces, root, b.options))
        })
        .collect();
    let scenes: Vec<Scene<'_>> = all
        .iter()
        .zip(&shared)
        .filter_map(|(b, shared)| Some(Scene { shared: shared.as_ref()?, windows: b.windows, ends: b.ends }))
        .collect();
    let mut traced = traced(gpu, &scenes)?.into_iter();
    let of = |shared: &Option<_>| match shared {
        Some(_) => traced.next().unwrap_or(Traced::Refused("nothing to trace")),
        None => Traced::Whole(Clipped::default()),
    };
    Ok(shared.iter().map(of).collect())
}

/// A scene with something to see.
#[derive(Clone, Copy)]
struct Scene<'a> {
    shared: &'a Shared<'a>,
    windows: &'a [Frame],
    ends: Option<Ends<'a>>,
}

/// What the beams of each scene meet. Scenes that the device refuses together are tried by halves.
fn traced(gpu: &Gpu, scenes: &[Scene<'_>]) -> Result<Vec<Traced>> {
    if scenes.is_empty() {
        return Ok(Vec::new());
    }
    match together(gpu, scenes)? {
        Ok(all) => Ok(all.into_iter().map(Traced::Whole).collect()),
        Err(why) if scenes.len() == 1 => Ok(vec![Traced::Refused(why)]),
        Err(_) => {
            let (first, second) = scenes.split_at(scenes.len() / 2);
            let mut all = traced(gpu, first)?;
            all.extend(traced(gpu, second)?);
            Ok(all)
        }
    }
}

fn together(gpu: &Gpu, scenes: &[Scene<'_>]) -> Able<Vec<Clipped>> {
    let limit = gpu.max_binding_bytes() as usize;
    if 64 * SLOTS * PIECE * size_of::<[u32; 4]>() > limit {
        return Ok(Err("bindings of the adapter that are too small for its polygons"));
    }
    let shared: Vec<&Shared<'_>> = scenes.iter().map(|s| s.shared).collect();
    let Some(arrays) = ViewArrays::new(&shared) else {
        return Ok(Err("more faces than it can number"));
    };
    let items: usize = scenes.iter().map(|s| s.shared.faces.faces.len() * s.windows.len()).sum();
    if size_of_val(&arrays.body[..]) > limit || (items + 1) * size_of::<[u32; 2]>() > limit {
        return Ok(Err("a scene that is larger than one binding of the adapter"));
    }
    let numbers = arrays.numbers;
    let mut levels: Vec<Levels<'_>> =
        scenes.iter().zip(&numbers).map(|(s, n)| Levels::new(s.shared, *n, s.windows, s.ends)).collect();
    let mut recorder = gpu.recorder("views of a scene");
    let body = recorder.upload("faces", &arrays.body);
    let most_nodes = numbers.iter().map(|n| n.nodes[1] - n.nodes[0]).max().unwrap_or(0);
    let device = Device::new(gpu, arrays.params, body, most_nodes as usize);

    let (views, firsts) = views_of(&levels);
    let level = Level { level: 0, views: recorder.upload("views", &views) };
    let mut pairs = Vec::with_capacity(items + 1);
    pairs.push([items as u32, 0]);
    for ((s, n), first) in scenes.iter().zip(&numbers).zip(&firsts) {
        let faces = s.shared.faces.faces.len() as u32;
        let of_window = |window: u32| (0..faces).map(move |face| [first + window, n.faces + face]);
        pairs.extend((0..s.windows.len() as u32).flat_map(of_window));
    }
    let pairs = Pairs { list: recorder.upload("pairs", &pairs), beams: recorder.zeros("none", 1) };
    let mut found = Vec::new();
    let mut recorder = Some(recorder);
    for from in (0..items).step_by(device.pairs) {
        let count = device.pairs.min(items - from);
        let recorder = recorder.take().unwrap_or_else(|| gpu.recorder("views of a scene"));
        if let Err(refused) = device.lit(recorder, &level, &pairs, (from, count), None, &mut found)? {
            return Ok(Err(refused));
        }
    }
    let mut beams: Vec<Vec<Onward>> = levels
        .par_iter_mut()
        .zip(of_scenes(found, &numbers, &firsts, None))
        .map_tasks(|(levels, found)| levels.first(found))
        .collect();
    for level in 1.. {
        for (beams, levels) in beams.iter_mut().zip(&levels) {
            if level >= levels.most() {
                beams.clear();
            }
        }
        let all: Vec<(usize, &Onward)> =
            beams.iter().enumerate().flat_map(|(i, of)| of.iter().map(move |b| (i, b))).collect();
        if all.is_empty() {
            break;
        }
        let (views, firsts) = views_of(&levels);
        if size_of_val(&views[..]) > limit {
            return Ok(Err("more mirrors than one binding of the adapter holds"));
        }
        let mut found = Vec::new();
        let pieces = limit / (PIECE * size_of::<[u32; 4]>());
        let walks = WALKS.min(limit / size_of::<u32>() - 1);
        let most = BEAMS.min(pieces).min(walks / device.parts).max(1);
        let mut stack: Vec<(usize, usize)> =
            (0..all.len()).step_by(most).map(|from| (from, most.min(all.len() - from))).collect();
        stack.reverse();
        while let Some((from, count)) = stack.pop() {
            let mut recorder = gpu.recorder("beams of a scene");
            let level = Level { level: level as u32, views: recorder.upload("views", &views) };
            let some = &all[from..from + count];
            let words = words_of(some, &numbers, &firsts);
            let mut new = Vec::new();
            match device.follow(recorder, &level, &words, &mut new)? {
                Ok(true) => {
                    found.extend(new.into_iter().map(|p| LitPolygon { from: p.from + from as u32, ..p }))
                }
                // They meet more than one buffer holds.
                Ok(false) => stack.extend([(from + count / 2, count - count / 2), (from, count / 2)]),
                Err(refused) => return Ok(Err(refused)),
            }
        }
        let mut behind = 0;
        let begins: Vec<u32> = beams
            .iter()
            .map(|of| {
                behind += of.len() as u32;
                behind - of.len() as u32
            })
            .collect();
        let found = of_scenes(found, &numbers, &firsts, Some(&begins));
        beams = levels
            .par_iter_mut()
            .zip(found)
            .zip(&beams)
            .map_tasks(|((levels, found), beams)| levels.next(beams, found))
            .collect();
    }
    Ok(Ok(levels.into_iter().map(Levels::finish).collect()))
}

/// The views of all scenes, and the number of the first of each.
fn views_of(levels: &[Levels<'_>]) -> (Vec<[u32; 4]>, Vec<u32>) {
    let (mut words, mut firsts, mut behind) = (Vec::new(), Vec::with_capacity(levels.len()), 0);
    for of in levels {
        firsts.push(behind);
        words.extend(of.views(behind));
        behind += of.view_count();
    }
    (words, firsts)
}

/// Beams, each with the number of its scene, as the kernels read them.
fn words_of(beams: &[(usize, &Onward)], numbers: &[Numbers], firsts: &[u32]) -> Vec<[u32; 4]> {
    let mut words = vec![[0u32; 4]; beams.len() * PIECE];
    for (to, (scene, beam)) in words.chunks_exact_mut(PIECE).zip(beams) {
        to[0] = [0, firsts[*scene] + beam.view, beam.corners.len() as u32 / 2, 0];
        to[1] = [0, 0, (numbers[*scene].faces + beam.face) | u32::from(beam.turned) << 31, 0];
        to[2..2 + beam.corners.len()].copy_from_slice(&beam.corners);
    }
    words
}

/// What is lit of each scene, numbered as the scene does. `begins` are the first beams of all scenes; windows without.
fn of_scenes(
    found: Vec<LitPolygon>,
    numbers: &[Numbers],
    firsts: &[u32],
    begins: Option<&[u32]>,
) -> Vec<Vec<LitPolygon>> {
    let mut out: Vec<Vec<LitPolygon>> = numbers.iter().map(|_| Vec::new()).collect();
    for p in found {
        let scene = firsts.partition_point(|first| *first <= p.view) - 1;
        let from = p.from - begins.map_or(firsts[scene], |begins| begins[scene]);
        let (view, face) = (p.view - firsts[scene], p.face - numbers[scene].faces);
        out[scene].push(LitPolygon { face, view, from, ..p });
    }
    out
}

/// What holds for all polygons of one level.
struct Level {
    level: u32,
    views: Buffer<[u32; 4]>,
}

/// Beams, and pairs of one of them and a face ahead, or of a window and a face, behind the number of pairs.
struct Pairs {
    beams: Buffer<[u32; 4]>,
    list: Buffer<[u32; 2]>,
}

/// Polygons that have not seen all of the tree.
#[derive(Clone)]
struct Going {
    pieces: Buffer<[u32; 4]>,
    first: usize,
    count: usize,
    /// Where the device has the number of all pieces, unless all `count` are there.
    number: Option<(Buffer<u32>, usize)>,
    /// Times `WORDS` for each thread.
    room: usize,
}

/// One run of `view_hide` over some polygons, as it was recorded.
struct Round {
    of: Going,
    /// Words of what is through, and pieces that go on.
    sums: [Pending<u32>; 2],
    words: usize,
    through: Pending<[u32; 4]>,
    on: Buffer<[u32; 4]>,
}

struct Device<'a> {
    gpu: &'a Gpu,
    params: ViewParams,
    body: Buffer<[u32; 4]>,
    threads: usize,
    pairs: usize,
    /// Parts of the tree that threads of `view_ahead` share out.
    parts: usize,
    first_runs: usize,
}

/// A result, or why the device refuses.
type Able<T> = Result<std::result::Result<T, &'static str>>;

impl<'a> Device<'a> {
    fn new(gpu: &'a Gpu, params: ViewParams, body: Buffer<[u32; 4]>, nodes: usize) -> Device<'a> {
        let kind = usize::from(!gpu.is_hardware());
        let slots = (gpu.max_binding_bytes() / (16 * PIECE * SLOTS) as u64) as usize;
        let pieces = (gpu.max_binding_bytes() / (16 * PIECE) as u64) as usize;
        Device {
            gpu,
            params: ViewParams { budget: BUDGET[kind], ..params },
            body,
            threads: THREADS[kind].min(slots).max(64),
            pairs: PAIRS.min(pieces).max(64),
            parts: nodes.div_ceil(NODES[kind]).max(1),
            first_runs: FIRST_RUNS[kind],
        }
    }

    /// Follows some beams to what they light. False if they meet more faces than one buffer holds pairs.
    fn follow(
        &self,
        mut recorder: Recorder<'a>,
        level: &Level,
        words: &[[u32; 4]],
        found: &mut Vec<LitPolygon>,
    ) -> Able<bool> {
        let beams = recorder.upload("beams", words);
        let count = words.len() / PIECE;
        let walks = count * self.parts;
        let expected = (count * PAIRS_OF_BEAM).max(LEAST_PAIRS).min(self.pairs);
        let params = ViewParams {
            count: walks as u32,
            threads: walks as u32,
            level: level.level,
            budget: u32::MAX,
            parts: self.parts as u32,
            total_at: walks as u32,
            room: expected as u32,
            ..self.params
        };
        let threads = Threads::Linear(walks as u64);
        let counts = recorder.zeros("faces ahead", walks + 1);
        let troubles = recorder.zeros("troubles", 1);
        let ahead = |recorder: &mut Recorder<'a>, params: &ViewParams, pairs: &Buffer<[u32; 2]>| {
            let storage: [&dyn AnyBuffer; 6] = [&self.body, &level.views, &beams, &counts, pairs, &troubles];
            recorder.dispatch(&view_ahead::KERNEL, params, &storage, threads);
        };
        let pairs = recorder.buffer("pairs", expected + 1);
        ahead(&mut recorder, &params, &pairs);
        let total = scan::record(&mut recorder, &counts, walks + 1);
        ahead(&mut recorder, &ViewParams { mode: 1, ..params }, &pairs);
        let reads = [recorder.read(&total), recorder.read(&troubles)];
        let pairs = Pairs { beams: beams.clone(), list: pairs };
        let [total, troubled] = match self.lit(recorder, level, &pairs, (0, expected), Some(reads), found)? {
            Ok(first) => first,
            Err(refused) => return Ok(Err(refused)),
        };
        if let Some(refused) = trouble(troubled) {
            return Ok(Err(refused));
        }
        let total = total as usize;
        if total <= expected {
            return Ok(Ok(true));
        }
        // Nothing was looked at: there was no room for all of them.
        if ((total + 1) * size_of::<[u32; 2]>()) as u64 > self.gpu.max_binding_bytes() && count > 1 {
            return Ok(Ok(false));
        }
        let mut recorder = self.gpu.recorder("beams of a scene");
        let list = recorder.buffer("pairs", total + 1);
        ahead(&mut recorder, &ViewParams { mode: 1, room: total as u32, ..params }, &list);
        let pairs = Pairs { beams: beams.clone(), list };
        let mut recorder = Some(recorder);
        for from in (0..total).step_by(self.pairs) {
            let recorder = recorder.take().unwrap_or_else(|| self.gpu.recorder("beams of a scene"));
            let count = self.pairs.min(total - from);
            if let Err(refused) = self.lit(recorder, level, &pairs, (from, count), None, found)? {
                return Ok(Err(refused));
            }
        }
        Ok(Ok(true))
    }

    /// What is lit of `count` pairs from number `from` on, or of as many as there are; and the first words of what is read first.
    fn lit(
        &self,
        mut recorder: Recorder<'a>,
        level: &Level,
        pairs: &Pairs,
        (from, count): (usize, usize),
        mut first: Option<[Pending<u32>; 2]>,
        found: &mut Vec<LitPolygon>,
    ) -> Able<[u32; 2]> {
        let params = ViewParams {
            first: from as u32,
            count: (from + count) as u32,
            threads: count as u32,
            level: level.level,
            ..self.params
        };
        let counts = recorder.zeros("polygons", count + 1);
        let troubles = recorder.zeros("troubles", 1);
        let none = recorder.zeros("none", 1);
        let pieces = recorder.buffer("polygons", count * PIECE);
        let mut number = None;
        for mode in [0, 1] {
            let to = if mode == 0 { &none } else { &pieces };
            recorder.dispatch(
                &view_target::KERNEL,
                &ViewParams { mode, ..params },
                &[&self.body, &level.views, &pairs.beams, &pairs.list, &counts, to, &troubles],
                Threads::Linear(count as u64),
            );
            if mode == 0 {
                let total = scan::record(&mut recorder, &counts, count + 1);
                // How many polygons there are only the device knows so far.
                number = Some(recorder.read(&total));
            }
        }
        let number_at = Some((counts.clone(), count));
        let mut queue = vec![Going { pieces: pieces.clone(), first: 0, count, number: number_at, room: 1 }];
        let mut read = [0; 2];
        loop {
            let mut runs = Vec::new();
            let most = if number.is_some() { self.first_runs } else { RUNS };
            while runs.len() < most
                && let Some(going) = queue.pop()
            {
                let threads = (self.threads / going.room).max(1).min(going.count);
                if going.count > threads {
                    let (first, count) = (going.first + threads, going.count - threads);
                    queue.push(Going { first, count, ..going.clone() });
                }
                runs.push(self.run(&mut recorder, level, Going { count: threads, ..going }, &troubles));
            }
            let troubled = recorder.read(&troubles);
            let mut done = recorder.submit()?;
            if let Some(refused) = trouble(done.take(troubled)[0]) {
                return Ok(Err(refused));
            }
            if let Some(words) = first.take() {
                read = words.map(|word| done.take(word)[0]);
            }
            let all = number.take().map(|number| done.take(number)[0] as usize);
            for going in &mut queue {
                *going = going.known(all);
            }
            for run in runs {
                take(&mut done, run, all, found, &mut queue);
            }
            queue.retain(|going| going.count > 0);
            if queue.is_empty() {
                return Ok(Ok(read));
            }
            recorder = self.gpu.recorder("hidden parts");
        }
    }

    /// Records what nearer faces hide of some polygons, and a few times of what goes on.
    fn run(
        &self,
        recorder: &mut Recorder<'a>,
        level: &Level,
        mut going: Going,
        troubles: &Buffer<u32>,
    ) -> Vec<Round> {
        let most = ROUNDS[usize::from(level.level > 0)];
        let mut rounds = Vec::with_capacity(most);
        let of_later = (going.count / 8).max(LEAST_THREADS).min(self.threads);
        let no_limit = recorder.upload("no limit", &[u32::MAX]);
        for _ in 0..most {
            let threads = going.count;
            let (limit, total_at) = going.number.clone().unwrap_or_else(|| (no_limit.clone(), 0));
            // No more than the slots hold.
            let (room, slots) = (threads.max(LEAST_THREADS) * going.room, threads * SLOTS);
            let (words, pieces_on) = ((WORDS * room).min(slots * PIECE), room.min(slots));
            let params = ViewParams {
                first: going.first as u32,
                count: (going.first + threads) as u32,
                threads: threads as u32,
                level: level.level,
                total_at: total_at as u32,
                room: words as u32,
                room_on: pieces_on as u32,
                ..self.params
            };
            let scratch = recorder.buffer::<[u32; 4]>("slots", threads * SLOTS * PIECE);
            let (done, on) =
                (recorder.zeros("through", threads + 1), recorder.zeros("going on", threads + 1));
            recorder.dispatch(
                &view_hide::KERNEL,
                &params,
                &[&self.body, &level.views, &going.pieces, &scratch, &done, &on, &limit, troubles],
                Threads::Linear(threads as u64),
            );
            let sums = [&done, &on].map(|counts| scan::record(recorder, counts, threads + 1));
            let through = recorder.buffer("polygons that are through", words);
            let pieces = recorder.buffer("polygons that go on", pieces_on * PIECE);
            recorder.dispatch(
                &view_gather::KERNEL,
                &params,
                &[&scratch, &done, &on, &through, &pieces],
                Threads::Linear(threads as u64),
            );
            let next = Going {
                pieces: pieces.clone(),
                first: 0,
                count: of_later,
                number: Some((on, threads)),
                room: 1,
            };
            let sums = sums.map(|sum| recorder.read(&sum));
            let through = recorder.read(&through);
            rounds.push(Round { of: going, sums, words, through, on: pieces });
            going = next;
        }
        rounds
    }
}

/// Takes what a run found, and queues what is left of it. `all` is the number of polygons, if the run could not know it.
fn take(
    done: &mut Done,
    run: Vec<Round>,
    all: Option<usize>,
    found: &mut Vec<LitPolygon>,
    queue: &mut Vec<Going>,
) {
    let mut run = run.into_iter().peekable();
    // What the round before has handed on.
    let mut left = run.peek().map_or(0, |round| round.of.known(all).count);
    while let Some(round) = run.next().filter(|_| left > 0) {
        let of = Going { count: left, number: None, ..round.of };
        let [words, on] = round.sums.map(|sum| done.take(sum)[0] as usize);
        if words > round.words || on * PIECE > round.on.len() {
            queue.push(Going { room: 4 * of.room, ..of });
            return;
        }
        let through = done.take(round.through);
        let mut rest = &through[..words];
        while let [[_, _, n, _], ..] = rest {
            let (polygon, behind) = rest.split_at(2 + 2 * (n & 0xff) as usize);
            found.push(lit_polygon(polygon));
            rest = behind;
        }
        left = run.peek().map_or(0, |next| next.of.count.min(on));
        queue.push(Going { pieces: round.on, first: left, count: on - left, number: None, room: 1 });
    }
}

impl Going {
    /// The same where the number of all pieces is known.
    fn known(&self, all: Option<usize>) -> Going {
        match (&self.number, all) {
            (Some(_), Some(all)) => {
                let count = self.count.min(all.saturating_sub(self.first));
                Going { count, number: None, ..self.clone() }
            }
            _ => self.clone(),
        }
    }
}

fn lit_polygon(words: &[[u32; 4]]) -> LitPolygon {
    let ([face, view, n, _], [.., from]) = (words[0], words[1]);
    LitPolygon { face, view, whole: n & 0x100 != 0, from, corners: words[2..].to_vec() }
}

/// What a thread had no room for, by the word that threads mark.
fn trouble(word: u32) -> Option<&'static str> {
    let causes = [
        "polygons of more than 16 corners",
        "more steps than the adapter's driver allows a thread",
        "a polygon that is not finite",
    ];
    (0..causes.len()).find(|i| word >> i & 1 != 0).map(|i| causes[i])
}
