//! Beams of a frame clipped on the device, level by level: which faces stand ahead (`view_ahead`), what the lines of a beam hold of them
//! (`view_target`) and what nearer faces leave of that (`view_hide`). The host works corners out from their lines
//! (`cpu::levels`), and makes the views behind the next mirrors.
//!
//! What comes out has the same order in every run: pieces of a thread stand together where prefix sums put them.

use super::beams::{BeamOptions, Frame};
use super::cpu::beams::{Clipped, Ends};
use super::cpu::levels::{Levels, LitPolygon, Onward};
use super::cpu::topology::Shared;
use super::views::{PIECE, SLOTS, ViewArrays, ViewParams};
use super::{scan, view_ahead, view_gather, view_hide, view_target};
use crate::base::error::Result;
use crate::geom::faces::Faces;
use crate::gpu::{Buffer, Gpu, Recorder, Threads};

/// Pairs of a beam and a face that are looked at together, on a GPU and on a driver on the cpu.
const PAIRS: [usize; 2] = [1 << 18, 1 << 16];
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

/// What beams of a frame meet, or why the device cannot tell.
pub enum Traced {
    /// All of it.
    Whole(Clipped),
    /// It met with something that it has no room for.
    Refused(&'static str),
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
    let Some(root) = windows.first().filter(|_| !faces.faces.is_empty()) else {
        return Ok(Traced::Whole(Clipped::default()));
    };
    let limit = gpu.max_binding_bytes();
    if ((64 * SLOTS * PIECE) * size_of::<[u32; 4]>()) as u64 > limit {
        return Ok(Traced::Refused("bindings of the adapter that are too small for its polygons"));
    }
    let shared = Shared::new(faces, root, options);
    let Some(arrays) = ViewArrays::new(&shared) else {
        return Ok(Traced::Refused("more faces than it can tell apart"));
    };
    if size_of_val(&arrays.body[..]) as u64 > limit {
        return Ok(Traced::Refused("a scene that is larger than one binding of the adapter"));
    }
    let mut levels = Levels::new(&shared, windows, ends);
    let mut recorder = gpu.recorder("views of a scene");
    let body = recorder.upload("faces", &arrays.body);
    let first = Level { level: 0, endless: false, views: recorder.upload("views", &levels.views()) };
    let device = Device::new(gpu, arrays.params, body);
    let mut found = Vec::new();
    let mut recorder = Some(recorder);
    let items = faces.faces.len() * windows.len();
    for from in (0..items).step_by(device.pairs) {
        let count = device.pairs.min(items - from);
        let recorder = recorder.take().unwrap_or_else(|| gpu.recorder("views of a scene"));
        if let Err(refused) = device.lit(recorder, &first, None, (from, count), &mut found)? {
            return Ok(Traced::Refused(refused));
        }
    }
    let mut beams = levels.first(found);
    let most = levels.most();
    for level in 1..most {
        if beams.is_empty() {
            break;
        }
        let views = levels.views();
        if size_of_val(&views[..]) as u64 > limit {
            return Ok(Traced::Refused("more mirrors than one binding of the adapter holds"));
        }
        let mut found = Vec::new();
        let endless = level >= options.bounces;
        let pieces = limit as usize / (PIECE * size_of::<[u32; 4]>());
        let walks = WALKS.min(limit as usize / size_of::<u32>() - 1);
        let together = BEAMS.min(pieces).min(walks / device.parts()).max(1);
        let mut stack: Vec<(usize, usize)> =
            (0..beams.len()).step_by(together).map(|from| (from, together.min(beams.len() - from))).collect();
        stack.reverse();
        while let Some((from, count)) = stack.pop() {
            let mut recorder = gpu.recorder("beams of a scene");
            let level = Level { level: level as u32, endless, views: recorder.upload("views", &views) };
            match device.follow(recorder, &level, (&beams, from, count), &mut found)? {
                Ok(true) => {}
                // They meet more than one buffer holds.
                Ok(false) => stack.extend([(from + count / 2, count - count / 2), (from, count / 2)]),
                Err(refused) => return Ok(Traced::Refused(refused)),
            }
        }
        beams = levels.next(&beams, found);
    }
    Ok(Traced::Whole(levels.finish()))
}

/// What holds for all polygons of one level.
struct Level {
    level: u32,
    endless: bool,
    views: Buffer<[u32; 4]>,
}

/// Beams, and pairs of one of them and a face ahead.
struct Pairs<'a> {
    beams: &'a Buffer<[u32; 4]>,
    pairs: &'a Buffer<[u32; 2]>,
    /// Number of the first beam.
    from: usize,
}

/// Pieces that have not seen all of the tree.
struct Going {
    pieces: Buffer<[u32; 4]>,
    first: usize,
    count: usize,
}

/// Threads of `view_hide` whose pieces are still in their slots.
struct Hidden {
    scratch: Buffer<[u32; 4]>,
    done: Buffer<u32>,
    going: Buffer<u32>,
    threads: usize,
    /// Pieces of all of them that are through, and that go on.
    through: usize,
    on: usize,
}

struct Device<'a> {
    gpu: &'a Gpu,
    params: ViewParams,
    body: Buffer<[u32; 4]>,
    threads: usize,
    pairs: usize,
    nodes: usize,
}

/// A result, or why the device refuses.
type Able<T> = Result<std::result::Result<T, &'static str>>;

impl<'a> Device<'a> {
    fn new(gpu: &'a Gpu, params: ViewParams, body: Buffer<[u32; 4]>) -> Device<'a> {
        let kind = usize::from(!gpu.is_hardware());
        let slots = (gpu.max_binding_bytes() / (16 * PIECE * SLOTS) as u64) as usize;
        let pieces = (gpu.max_binding_bytes() / (16 * PIECE) as u64) as usize;
        let pairs = PAIRS[kind].min(pieces).max(64);
        let params = ViewParams { budget: BUDGET[kind], ..params };
        Device { gpu, params, body, threads: THREADS[kind].min(slots).max(64), pairs, nodes: NODES[kind] }
    }

    /// Parts of the tree that threads of `view_ahead` share out.
    fn parts(&self) -> usize {
        (self.params.nodes as usize).div_ceil(self.nodes).max(1)
    }

    /// Follows some beams to what they light. False if they meet more faces than one buffer holds pairs.
    fn follow(
        &self,
        mut recorder: Recorder<'a>,
        level: &Level,
        (all, from, count): (&[Onward], usize, usize),
        found: &mut Vec<LitPolygon>,
    ) -> Able<bool> {
        let mut words = vec![[0u32; 4]; count * PIECE];
        for (to, beam) in words.chunks_exact_mut(PIECE).zip(&all[from..from + count]) {
            to[0] = [0, beam.view, beam.corners.len() as u32 / 2, 0];
            to[1] = [0, 0, beam.face | u32::from(beam.turned) << 31, 0];
            to[2..2 + beam.corners.len()].copy_from_slice(&beam.corners);
        }
        let beams = recorder.upload("beams", &words);
        let parts = self.parts();
        let walks = count * parts;
        let params = ViewParams {
            count: walks as u32,
            threads: walks as u32,
            level: level.level,
            endless: level.endless.into(),
            budget: u32::MAX,
            parts: parts as u32,
            ..self.params
        };
        let threads = Threads::Linear(walks as u64);
        let counts = recorder.zeros("faces ahead", walks + 1);
        let none = recorder.zeros::<[u32; 2]>("none", 1);
        let troubles = recorder.zeros("troubles", 1);
        let storage = [&self.body, &level.views, &beams];
        recorder.dispatch(
            &view_ahead::KERNEL,
            &params,
            &[storage[0], storage[1], storage[2], &counts, &none, &troubles],
            threads,
        );
        let total = scan::record(&mut recorder, &counts, walks + 1);
        let (total, troubled) = (recorder.read(&total), recorder.read(&troubles));
        let mut done = recorder.submit()?;
        if let Some(refused) = trouble(done.take(troubled)[0]) {
            return Ok(Err(refused));
        }
        let total = done.take(total)[0] as usize;
        if (total * size_of::<[u32; 2]>()) as u64 > self.gpu.max_binding_bytes() && count > 1 {
            return Ok(Ok(false));
        }
        let mut recorder = self.gpu.recorder("beams of a scene");
        let pairs = recorder.buffer("pairs", total);
        recorder.dispatch(
            &view_ahead::KERNEL,
            &ViewParams { mode: 1, ..params },
            &[storage[0], storage[1], storage[2], &counts, &pairs, &troubles],
            threads,
        );
        let pairs = Pairs { beams: &beams, pairs: &pairs, from };
        let mut recorder = Some(recorder);
        for from in (0..total).step_by(self.pairs) {
            let recorder = recorder.take().unwrap_or_else(|| self.gpu.recorder("beams of a scene"));
            let count = self.pairs.min(total - from);
            if let Err(refused) = self.lit(recorder, level, Some(&pairs), (from, count), found)? {
                return Ok(Err(refused));
            }
        }
        Ok(Ok(true))
    }

    /// What is lit of `count` pairs of a beam and a face, or of a window and a face, from number `from` on.
    fn lit(
        &self,
        mut recorder: Recorder<'a>,
        level: &Level,
        pairs: Option<&Pairs<'_>>,
        (from, count): (usize, usize),
        found: &mut Vec<LitPolygon>,
    ) -> Able<()> {
        let (no_beams, no_pairs) = (recorder.zeros("none", 1), recorder.zeros("none", 1));
        let (beams, list) = pairs.map_or((&no_beams, &no_pairs), |p| (p.beams, p.pairs));
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
        let threads = Threads::Linear(count as u64);
        for mode in [0, 1] {
            let to = if mode == 0 { &none } else { &pieces };
            recorder.dispatch(
                &view_target::KERNEL,
                &ViewParams { mode, ..params },
                &[&self.body, &level.views, beams, list, &counts, to, &troubles],
                threads,
            );
            if mode == 0 {
                scan::record(&mut recorder, &counts, count + 1);
            }
        }
        // How many polygons there are only the device knows so far.
        let mut list = vec![Going { pieces, first: 0, count }];
        let mut hidden: Option<Hidden> = None;
        let mut total = None;
        let first_beam = pairs.map_or(0, |p| p.from);
        loop {
            let mut finished = None;
            if let Some(h) = hidden.take() {
                let (through, on) = self.gather(&mut recorder, &h);
                finished = Some((recorder.read(&through), h.through));
                if h.on > 0 {
                    list.push(Going { pieces: on, first: 0, count: h.on });
                }
            }
            let mut next = None;
            if let Some(mut going) = list.pop() {
                let threads = self.threads.min(going.count);
                // Those after the first are known to be there.
                let (limit, total_at) = match total {
                    None => (counts.clone(), count as u32),
                    Some(_) => (recorder.upload("no limit", &[u32::MAX]), 0),
                };
                let range = ViewParams {
                    first: going.first as u32,
                    count: (going.first + threads) as u32,
                    threads: threads as u32,
                    total_at,
                    ..params
                };
                let scratch = recorder.buffer("slots", threads * SLOTS * PIECE);
                let (done, on) =
                    (recorder.zeros("through", threads + 1), recorder.zeros("going on", threads + 1));
                recorder.dispatch(
                    &view_hide::KERNEL,
                    &range,
                    &[&self.body, &level.views, &going.pieces, &scratch, &done, &on, &limit, &troubles],
                    Threads::Linear(threads as u64),
                );
                let sums = [&done, &on].map(|counts| scan::record(&mut recorder, counts, threads + 1));
                let sums = sums.map(|sum| recorder.read(&sum));
                going.first += threads;
                going.count -= threads;
                next = Some((Hidden { scratch, done, going: on, threads, through: 0, on: 0 }, sums, going));
            }
            let number = total.is_none().then(|| recorder.read(&counts));
            let troubled = recorder.read(&troubles);
            let mut done = recorder.submit()?;
            if let Some(refused) = trouble(done.take(troubled)[0]) {
                return Ok(Err(refused));
            }
            if let Some(number) = number {
                let all = done.take(number)[count] as usize;
                total = Some(all);
                if let Some((_, _, going)) = &mut next {
                    going.count = all.saturating_sub(going.first);
                }
            }
            if let Some((words, n)) = finished {
                let words = done.take(words);
                found.extend(words.chunks_exact(PIECE).take(n).map(|w| lit_polygon(w, level, first_beam)));
            }
            let Some((mut h, sums, going)) = next else { break };
            let [through, on] = sums.map(|sum| done.take(sum)[0] as usize);
            (h.through, h.on) = (through, on);
            if going.count > 0 {
                list.push(going);
            }
            if through + on == 0 && list.is_empty() {
                break;
            }
            hidden = Some(h);
            recorder = self.gpu.recorder("hidden parts");
        }
        Ok(Ok(()))
    }

    /// Puts the pieces of all threads side by side: those that are through, and those that go on.
    fn gather(&self, recorder: &mut Recorder<'_>, h: &Hidden) -> (Buffer<[u32; 4]>, Buffer<[u32; 4]>) {
        let through = recorder.buffer("polygons that are through", h.through * PIECE);
        let on = recorder.buffer("polygons that go on", h.on * PIECE);
        let params = ViewParams { threads: h.threads as u32, ..self.params };
        recorder.dispatch(
            &view_gather::KERNEL,
            &params,
            &[&h.scratch, &h.done, &h.going, &through, &on],
            Threads::Linear(h.threads as u64),
        );
        (through, on)
    }
}

fn lit_polygon(words: &[[u32; 4]], level: &Level, first_beam: usize) -> LitPolygon {
    let ([face, view, n, _], [.., from]) = (words[0], words[1]);
    let corners = words[2..2 + 2 * (n & 0xff) as usize].to_vec();
    let from = if level.level == 0 { from } else { from + first_beam as u32 };
    LitPolygon { face, view, whole: n & 0x100 != 0, from, corners }
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
