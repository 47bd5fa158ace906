//! Distributes the work. Workers claim frames: of the shard at which they are, then of one that nobody has begun, and at the end of those
//! at which others work. Who claims the first frame of a scene prepares the scene for all; until it is ready, others find frames of other
//! scenes. Frames come to a shard's writer in any order and are written in theirs.
//!
//! A worker waits only while no frame can be begun: every one that is left belongs to a scene that is just being prepared, or the frames
//! that wait to be written fill the memory that they may take. With room for all, the last of n workers is therefore done no later than
//! the whole work divided by n plus the longest chain of preparing a scene and making one claim of it (R. L. Graham, Bell System Technical
//! Journal 45 (1966) 1563).

use super::recipe::Recipe;
use super::store::DatasetLayout;
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Interval at which a waiting worker checks whether the work was stopped.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

/// Frames of one scene that are to be made, and where they are sent.
pub struct Claim<T, S> {
    pub shard: u64,
    pub scene: u32,
    /// Frames within the scene.
    pub frames: Range<u32>,
    /// The scene as it was prepared; None where whoever claims has to prepare it and to hand it to [`Board::ready`].
    pub prepared: Option<Arc<S>>,
    to: Sender<(u64, T)>,
    /// Number of the first frame in the dataset.
    first: u64,
}

impl<T, S> Claim<T, S> {
    /// Hands a frame of the scene to the writer; false where nobody takes it any more.
    pub fn send(&self, index: u32, frame: T) -> bool {
        self.to.send((self.first + u64::from(index - self.frames.start), frame)).is_ok()
    }
}

/// The queue from which the writer of a shard takes its frames.
pub struct Queue<T> {
    shard: u64,
    frames: Range<u64>,
    from: Receiver<(u64, T)>,
    /// Frames that came before their turn.
    early: BTreeMap<u64, T>,
}

/// A shard that somebody works at.
struct Open<T> {
    /// Frames that nobody has claimed, by scene.
    waiting: VecDeque<(u32, Range<u32>)>,
    /// Number of frames that are claimed and not yet written.
    begun: u64,
    /// Number in the dataset of the frame that is written next.
    next: u64,
    to: Sender<(u64, T)>,
}

impl<T> Open<T> {
    fn frames_waiting(&self) -> u64 {
        self.waiting.iter().map(|(_, frames)| frames.len() as u64).sum()
    }
}

/// A scene of which frames are claimed.
struct Known<S> {
    /// Whether somebody prepares it, or has.
    begun: bool,
    /// None while it is being prepared.
    prepared: Option<Arc<S>>,
    /// Number of its frames that nobody has claimed.
    left: u64,
}

struct State<T, S> {
    /// Shards that nobody has begun.
    fresh: VecDeque<u64>,
    /// The shards that are made here.
    missing: BTreeSet<u64>,
    open: BTreeMap<u64, Open<T>>,
    scenes: HashMap<u32, Known<S>>,
    /// Number of frames that are claimed and not yet written.
    begun: u64,
    closed: bool,
}

/// Time for which workers waited, ns.
#[derive(Debug, Default)]
pub struct Waited {
    /// For scenes that others were just preparing.
    pub for_scenes_ns: AtomicU64,
    /// For frames to be written, of which as many were made as there is room for.
    pub for_writers_ns: AtomicU64,
}

/// Frames to make, and the queue of their shard where they are its first.
pub type Work<T, S> = (Vec<Claim<T, S>>, Option<Queue<T>>);

/// What comes of asking for work.
pub enum Next<T, S> {
    /// Frames to make, all of one shard, each claim of one scene; with the shard's queue where this begins it.
    Work(Vec<Claim<T, S>>, Option<Queue<T>>),
    /// Nothing can be begun now.
    Wait,
    /// Nothing is left to begin.
    End,
}

pub struct Board<'a, T, S> {
    recipe: &'a Recipe,
    layout: &'a DatasetLayout,
    workers: u64,
    /// Largest number of frames that may be begun and not yet written.
    room: u64,
    /// Whether a shard is to be begun here, asked just before; not where somebody else has it.
    begins: Box<dyn Fn(u64) -> bool + Send + Sync + 'a>,
    state: Mutex<State<T, S>>,
    moved: Condvar,
}

impl<'a, T, S> Board<'a, T, S> {
    /// Makes a board of these shards for this many workers. At most `room` frames wait to be written or are being made, beside
    /// the one that each writer waits for.
    pub fn new(
        recipe: &'a Recipe,
        layout: &'a DatasetLayout,
        shards: &[u64],
        workers: usize,
        room: u64,
        begins: Box<dyn Fn(u64) -> bool + Send + Sync + 'a>,
    ) -> Board<'a, T, S> {
        let state = State {
            fresh: shards.iter().copied().collect(),
            missing: shards.iter().copied().collect(),
            open: BTreeMap::new(),
            scenes: HashMap::new(),
            begun: 0,
            closed: false,
        };
        Board {
            recipe,
            layout,
            workers: workers.max(1) as u64,
            room: room.max(1),
            begins,
            state: Mutex::new(state),
            moved: Condvar::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State<T, S>> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// The frames of a shard by scene.
    fn scenes_of(&self, shard: u64) -> VecDeque<(u32, Range<u32>)> {
        let mut left = self.layout.frames_of(shard);
        let mut list = VecDeque::new();
        while !left.is_empty() {
            let (scene, first) = self.recipe.place(left.start);
            let of_scene = u64::from(self.recipe.frames_per_scene - first);
            let n = of_scene.min(left.end - left.start);
            list.push_back((scene, first..first + n as u32));
            left.start += n;
        }
        list
    }

    /// Number of frames of a scene that are to be made, in all of these shards.
    fn frames_of_scene(&self, missing: &BTreeSet<u64>, scene: u32) -> u64 {
        let of_scene = u64::from(self.recipe.frames_per_scene);
        let all = u64::from(scene) * of_scene..(u64::from(scene) + 1) * of_scene;
        let shards = self.layout.shard_of(all.start)..=self.layout.shard_of(all.end - 1);
        shards
            .filter(|shard| missing.contains(shard))
            .map(|shard| {
                let own = self.layout.frames_of(shard);
                own.end.min(all.end).saturating_sub(own.start.max(all.start))
            })
            .sum()
    }

    /// Claims up to `most` frames, and no more than a worker's share of those left in the shard, for a worker that was at shard `own`
    /// before. Waits while nothing can be begun, and adds the time to `waited`; None when nothing is left or the work was `stopped`.
    pub fn claim(
        &self,
        own: Option<u64>,
        most: u64,
        stopped: &dyn Fn() -> bool,
        waited: &Waited,
    ) -> Option<Work<T, S>> {
        let mut state = self.state();
        loop {
            if stopped() {
                return None;
            }
            match self.next(&mut state, own, most) {
                Next::Work(claims, queue) => return Some((claims, queue)),
                Next::End => return None,
                Next::Wait => {
                    let (start, is_full) = (Instant::now(), state.begun >= self.room);
                    let woken = self.moved.wait_timeout(state, CHECK_INTERVAL);
                    state = woken.unwrap_or_else(|e| e.into_inner()).0;
                    let for_what = if is_full { &waited.for_writers_ns } else { &waited.for_scenes_ns };
                    for_what.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
                }
            }
        }
    }

    /// [`Board::claim`] that never waits.
    #[cfg(test)]
    fn claim_now(&self, own: Option<u64>, most: u64) -> Next<T, S> {
        self.next(&mut self.state(), own, most)
    }

    fn next(&self, state: &mut State<T, S>, own: Option<u64>, most: u64) -> Next<T, S> {
        if state.closed {
            return Next::End;
        }
        if let Some(own) = own {
            let claims = self.claims_of(state, own, most);
            if !claims.is_empty() {
                return Next::Work(claims, None);
            }
        }
        // A shard whose first scene is just being prepared for another one gives nothing yet, and is not opened before.
        let is_ready = |shard: &u64| {
            let (scene, _) = self.recipe.place(self.layout.frames_of(*shard).start);
            state.scenes.get(&scene).is_none_or(|known| known.prepared.is_some())
        };
        let mut candidates: VecDeque<u64> = state.fresh.iter().copied().filter(is_ready).collect();
        while state.begun < self.room
            && let Some(shard) = candidates.pop_front()
        {
            state.fresh.retain(|s| *s != shard);
            if !(self.begins)(shard) {
                self.leave(state, shard);
                continue;
            }
            let (to, from) = channel();
            let waiting = self.scenes_of(shard);
            let frames = self.layout.frames_of(shard);
            state.open.insert(shard, Open { waiting, begun: 0, next: frames.start, to });
            let queue = Queue { shard, frames, from, early: BTreeMap::new() };
            return Next::Work(self.claims_of(state, shard, most), Some(queue));
        }
        // Those with most to do first; the lowest of equals, for the same choice at every call.
        let mut others: Vec<(u64, u64)> = state.open.iter().map(|(s, o)| (o.frames_waiting(), *s)).collect();
        others.sort_by_key(|(waiting, shard)| (std::cmp::Reverse(*waiting), *shard));
        for (_, shard) in others.iter().filter(|(waiting, _)| *waiting > 0) {
            let claims = self.claims_of(state, *shard, most);
            if !claims.is_empty() {
                return Next::Work(claims, None);
            }
        }
        match state.fresh.is_empty() && others.iter().all(|(waiting, _)| *waiting == 0) {
            true => Next::End,
            false => Next::Wait,
        }
    }

    /// Leaves a shard to others: its scenes wait for none of its frames.
    fn leave(&self, state: &mut State<T, S>, shard: u64) {
        state.missing.remove(&shard);
        for (scene, frames) in self.scenes_of(shard) {
            if let Some(known) = state.scenes.get_mut(&scene) {
                known.left = known.left.saturating_sub(frames.len() as u64);
                if known.left == 0 && known.prepared.is_some() {
                    state.scenes.remove(&scene);
                }
            }
        }
    }

    /// The next frames of a shard that can be begun.
    fn claims_of(&self, state: &mut State<T, S>, shard: u64, most: u64) -> Vec<Claim<T, S>> {
        let State { open, scenes, begun, missing, .. } = state;
        let Some(open) = open.get_mut(&shard) else { return Vec::new() };
        let share = open.frames_waiting().div_ceil(self.workers);
        // The frame that a writer waits for has room always.
        let number = |scene: u32, frame: u32| {
            u64::from(scene) * u64::from(self.recipe.frames_per_scene) + u64::from(frame)
        };
        let is_awaited =
            open.waiting.front().is_some_and(|(scene, frames)| number(*scene, frames.start) == open.next);
        let free = self.room.saturating_sub(*begun);
        let mut left = most.max(1).min(share).min(free.max(u64::from(is_awaited)));
        let mut claims = Vec::new();
        // Scenes that this call begins; their further frames come with it.
        let mut own: Vec<u32> = Vec::new();
        let mut i = 0;
        while left > 0 && i < open.waiting.len() {
            let (scene, waiting) = &mut open.waiting[i];
            let scene = *scene;
            let known = scenes.entry(scene).or_insert_with(|| Known {
                begun: false,
                prepared: None,
                left: self.frames_of_scene(missing, scene),
            });
            if known.begun && known.prepared.is_none() && !own.contains(&scene) {
                if free == 0 {
                    // The room beyond is that of the frame that the writer waits for, and of no other.
                    break;
                }
                i += 1;
                continue;
            }
            if !known.begun {
                known.begun = true;
                own.push(scene);
            }
            let n = left.min(waiting.len() as u64);
            let frames = waiting.start..waiting.start + n as u32;
            waiting.start += n as u32;
            let first = number(scene, frames.start);
            let prepared = known.prepared.clone();
            claims.push(Claim { shard, scene, frames, prepared, to: open.to.clone(), first });
            known.left -= n;
            if known.left == 0 && known.prepared.is_some() {
                scenes.remove(&scene);
            }
            if waiting.start == waiting.end {
                open.waiting.remove(i);
            }
            (open.begun, *begun) = (open.begun + n, *begun + n);
            left -= n;
        }
        claims
    }

    /// Hands over a scene whose first frames were claimed without it.
    pub fn ready(&self, scene: u32, prepared: &Arc<S>) {
        let mut state = self.state();
        if let Some(known) = state.scenes.get_mut(&scene) {
            match known.left {
                0 => drop(state.scenes.remove(&scene)),
                _ => known.prepared = Some(Arc::clone(prepared)),
            }
        }
        self.moved.notify_all();
    }

    /// Reports that a frame of the shard is written.
    fn written(&self, shard: u64) {
        let mut state = self.state();
        state.begun = state.begun.saturating_sub(1);
        if let Some(open) = state.open.get_mut(&shard) {
            (open.begun, open.next) = (open.begun - 1, open.next + 1);
            if open.begun == 0 && open.waiting.is_empty() {
                state.open.remove(&shard);
            }
        }
        self.moved.notify_all();
    }

    /// Ends all claims; writers find their queues ended.
    pub fn close(&self) {
        let mut state = self.state();
        state.closed = true;
        state.open.clear();
        state.scenes.clear();
        self.moved.notify_all();
    }
}

impl<T> Queue<T> {
    pub fn shard(&self) -> u64 {
        self.shard
    }

    /// Takes the next frame in order; None at the end or when its maker was stopped.
    pub fn take<S>(&mut self, board: &Board<'_, T, S>) -> Option<T> {
        if self.frames.is_empty() {
            return None;
        }
        let frame = loop {
            if let Some(frame) = self.early.remove(&self.frames.start) {
                break frame;
            }
            let (number, frame) = self.from.recv().ok()?;
            self.early.insert(number, frame);
        };
        self.frames.start += 1;
        board.written(self.shard);
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{Compression, Format};
    use std::path::Path;

    fn recipe(scenes: u32, frames_per_scene: u32) -> Recipe {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/recipes/tiny.toml");
        let mut recipe = Recipe::load(&path, None).unwrap();
        (recipe.scenes, recipe.frames_per_scene) = (scenes, frames_per_scene);
        recipe
    }

    fn layout(recipe: &Recipe, frames_per_shard: u64) -> DatasetLayout {
        DatasetLayout {
            format: Format::Frames,
            compression: Compression::None,
            frames: recipe.frames(),
            frames_per_shard,
            arrays: Vec::new(),
            tables: Vec::new(),
            attributes: Default::default(),
        }
    }

    /// What the workers of one simulated run did.
    struct Run {
        /// When the last was done.
        end_s: f64,
        /// All work, s.
        work_s: f64,
        /// Longest time of preparing a scene and making one claim of it, s.
        chain_s: f64,
        /// Share of the workers' time until the end in which they worked.
        busy: f64,
    }

    /// Lets workers of a board work through drawn durations, without a clock: `durations` gives the seconds that it takes to prepare a
    /// scene, and those of a frame. Each frame is made once, and written in its order.
    fn simulated(
        recipe: &Recipe,
        layout: &DatasetLayout,
        workers: usize,
        most: u64,
        room: u64,
        mut durations: impl FnMut(bool) -> f64,
    ) -> Run {
        let shards: Vec<u64> = (0..layout.shards()).collect();
        let board: Board<'_, u64, ()> =
            Board::new(recipe, layout, &shards, workers, room, Box::new(|_| true));
        let mut queues: Vec<Queue<u64>> = Vec::new();
        let (mut work_s, mut chain_s) = (0.0, 0.0f64);
        let mut now_s = 0.0;
        /// A worker that is at work until a time.
        struct Busy {
            until_s: f64,
            prepares: bool,
            claims: VecDeque<Claim<u64, ()>>,
            shard: u64,
        }
        let mut busy: Vec<Option<Busy>> = (0..workers).map(|_| None).collect();
        let mut own: Vec<Option<u64>> = vec![None; workers];
        let mut written = 0;
        loop {
            for (worker, slot) in busy.iter_mut().enumerate().filter(|(_, slot)| slot.is_none()) {
                if let Next::Work(claims, queue) = board.claim_now(own[worker], most) {
                    queues.extend(queue);
                    let Some(first) = claims.first() else { continue };
                    let shard = first.shard;
                    own[worker] = Some(shard);
                    // Scenes first, then their frames: one event for each half.
                    let new: BTreeSet<u32> =
                        claims.iter().filter(|c| c.prepared.is_none()).map(|c| c.scene).collect();
                    let claimed_s: f64 = new.iter().map(|_| durations(true)).sum();
                    work_s += claimed_s;
                    let until_s = now_s + claimed_s;
                    *slot = Some(Busy { until_s, prepares: true, claims: claims.into(), shard });
                }
            }
            let next = busy.iter().flatten().map(|b| b.until_s).fold(f64::INFINITY, f64::min);
            if !next.is_finite() {
                break;
            }
            now_s = next;
            for slot in &mut busy {
                let Some(b) = slot else { continue };
                if b.until_s > now_s {
                    continue;
                }
                if b.prepares {
                    let mut frames_s = 0.0;
                    for claim in &b.claims {
                        if claim.prepared.is_none() {
                            board.ready(claim.scene, &Arc::new(()));
                        }
                        frames_s += claim.frames.clone().map(|_| durations(false)).sum::<f64>();
                    }
                    work_s += frames_s;
                    chain_s = chain_s.max(frames_s);
                    (b.until_s, b.prepares) = (now_s + frames_s, false);
                    continue;
                }
                for claim in std::mem::take(&mut b.claims) {
                    for index in claim.frames.clone() {
                        let number =
                            u64::from(claim.scene) * u64::from(recipe.frames_per_scene) + u64::from(index);
                        assert_eq!(layout.shard_of(number), b.shard);
                        assert!(claim.send(index, number));
                    }
                }
                *slot = None;
            }
            // Writers take no time.
            for queue in &mut queues {
                while let Ok(frame) = queue.from.try_recv() {
                    assert!(queue.early.insert(frame.0, frame.1).is_none(), "frame {} came twice", frame.0);
                }
                while queue.early.contains_key(&queue.frames.start) {
                    let number = queue.frames.start;
                    assert_eq!(queue.take(&board), Some(number));
                    written += 1;
                }
            }
        }
        assert_eq!(written, recipe.frames(), "all frames are written");
        assert!(board.state().scenes.is_empty() && board.state().open.is_empty(), "nothing is kept");
        Run { end_s: now_s, work_s, chain_s, busy: work_s / (workers as f64 * now_s) }
    }

    /// Numbers in (0, 1] that repeat.
    fn draws(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            ((state >> 11) + 1) as f64 / (1u64 << 53) as f64
        }
    }

    /// With drawn durations, shapes and numbers of workers the last one ends no later than total / workers + longest chain, where there is
    /// room for all frames.
    #[test]
    fn the_last_worker_ends_in_time() {
        let mut draw = draws(7);
        for case in 0..400 {
            let mut whole = |most: u64| 1 + (draw() * most as f64) as u64 % most;
            let recipe = recipe(whole(40) as u32, whole(12) as u32);
            let layout = layout(&recipe, whole(60));
            let workers = whole(128) as usize;
            let most = if case % 3 == 0 { whole(16) } else { 1 };
            // A few long ones among many short.
            let (mut longest, mut duration) = (0.0f64, draws(case));
            let run = simulated(&recipe, &layout, workers, most, u64::MAX, |prepares| {
                let s = -duration().ln() * if prepares { 2.0 } else { 1.0 };
                if prepares {
                    longest = longest.max(s);
                }
                s
            });
            // A claim may prepare several scenes where it takes frames of several.
            let chain_s = most as f64 * longest + run.chain_s;
            let bound_s = run.work_s / workers as f64 + chain_s;
            assert!(run.end_s <= bound_s * (1.0 + 1e-12), "case {case}: {} > {bound_s}", run.end_s);
        }
    }

    /// Sixteen workers at what the workloads are made of: equal frames of many scenes, and ten scenes of four frames of unlike cost.
    #[test]
    fn sixteen_workers_are_busy() {
        let share = |scenes, frames_per_scene, prepare_s: f64, frame_s: &mut dyn FnMut() -> f64| {
            let recipe = recipe(scenes, frames_per_scene);
            let layout = layout(&recipe, 100.max(u64::from(frames_per_scene)));
            let room = 2048;
            let run = simulated(
                &recipe,
                &layout,
                16,
                1,
                room,
                |prepares| if prepares { prepare_s } else { frame_s() },
            );
            run.busy
        };
        let mut draw = draws(3);
        // W14: 100 scenes of 10 frames of 8 ms.
        assert!(share(100, 10, 0.5e-3, &mut || 8e-3) > 0.97);
        // W10: 128 scenes of 8 frames of 35 ms, give or take a half.
        assert!(share(128, 8, 5e-3, &mut || 35e-3 * (0.5 + draw())) > 0.93);
        // W11: ten scenes of four frames of 1.1 s, give or take a half: 2.5 frames for each worker.
        assert!(share(10, 4, 0.1, &mut || 1.1 * (0.5 + draw())) > 0.7);
    }

    /// No more frames are held than there is room for, and one frame that takes long holds up nobody before that.
    #[test]
    fn frames_wait_to_be_written_as_far_as_there_is_room() {
        let recipe = recipe(1, 12);
        let layout = layout(&recipe, 12);
        let board: Board<'_, u32, ()> = Board::new(&recipe, &layout, &[0], 2, 4, Box::new(|_| true));
        let Next::Work(mut first, Some(mut queue)) = board.claim_now(None, 1) else { panic!("no work") };
        let first = first.pop().unwrap();
        assert!(first.prepared.is_none() && first.frames == (0..1));
        // Others wait for the scene, and then do not wait for the frame.
        assert!(matches!(board.claim_now(Some(0), 1), Next::Wait));
        board.ready(0, &Arc::new(()));
        for index in 1..4 {
            let Next::Work(claims, None) = board.claim_now(Some(0), 1) else { panic!("no work for {index}") };
            assert!(claims[0].prepared.is_some() && claims[0].send(index, index));
        }
        assert!(matches!(board.claim_now(Some(0), 1), Next::Wait));
        assert!(first.send(0, 0));
        (0..4).for_each(|n| assert_eq!(queue.take(&board), Some(n)));
        let Next::Work(claims, None) = board.claim_now(Some(0), 8) else { panic!("no work") };
        // A worker's share of the eight that are left, as far as there is room.
        assert_eq!(claims.iter().map(|c| c.frames.len()).sum::<usize>(), 4);
        board.close();
        assert!(matches!(board.claim_now(Some(0), 1), Next::End));
        drop((first, claims));
        assert_eq!(queue.take(&board), None);
    }
}
