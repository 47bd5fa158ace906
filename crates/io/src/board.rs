//! Distributes the work. Workers claim runs of frames of one scene: of their own shard, then of one that
//! nobody has begun, and at the end of those on which others work. A shard's writer gets the runs in order,
//! whoever makes them.

use super::recipe::Recipe;
use super::store::DatasetLayout;
use std::collections::{HashMap, VecDeque};
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::Duration;

/// Largest size of the arrays of one run, bytes; a few runs of each worker may wait to be written.
const RUN_BYTES: usize = 32 << 20;
/// Least number of runs for each worker, so that none is idle while others have much to do.
const RUNS_OF_WORKER: u64 = 2;
/// Interval at which a waiting worker checks whether the work was stopped.
const LOOK: Duration = Duration::from_millis(50);

/// Frames that are to be made, and where they are sent. All of them may be sent without anybody's taking one.
pub struct Claim<T> {
    pub shard: u64,
    pub scene: u32,
    /// Frames within the scene.
    pub frames: Range<u32>,
    pub to: SyncSender<T>,
}

/// The queue from which the writer of a shard takes its frames.
pub struct Queue<T> {
    shard: u64,
    /// Runs in order, each with the number of frames that are still to come.
    runs: VecDeque<(Receiver<T>, usize)>,
}

struct Open<T> {
    waiting: VecDeque<Claim<T>>,
    /// Number of runs that are claimed and not yet all written.
    begun: usize,
    workers: usize,
    /// Largest number of runs that a worker has claimed together.
    together: usize,
}

impl<T> Open<T> {
    /// Whether another worker may claim: beside what those at work make, as much as one of them makes at a time may wait to be
    /// written. So a batch is written while the next is made, and no more than that is held.
    fn has_room(&self) -> bool {
        self.begun <= (self.workers + 1) * self.together
    }
}

struct State<T> {
    /// Shards that nobody has begun.
    fresh: VecDeque<u64>,
    open: HashMap<u64, Open<T>>,
    closed: bool,
}

pub struct Board<'a, T> {
    recipe: &'a Recipe,
    layout: &'a DatasetLayout,
    /// Largest number of frames of a run.
    most: u64,
    workers: usize,
    state: Mutex<State<T>>,
    moved: Condvar,
}

impl<'a, T> Board<'a, T> {
    /// Makes a board for this many workers: where whole scenes are too few for them, the frames of one are
    /// divided.
    pub fn new(
        recipe: &'a Recipe,
        layout: &'a DatasetLayout,
        shards: &[u64],
        workers: usize,
    ) -> Board<'a, T> {
        let fresh = shards.iter().copied().collect();
        let state = Mutex::new(State { fresh, open: HashMap::new(), closed: false });
        let most = (RUN_BYTES / layout.array_bytes().max(1)).max(1) as u64;
        let mut board = Board { recipe, layout, most, workers, state, moved: Condvar::new() };
        let wanted = RUNS_OF_WORKER * workers as u64;
        if workers > 1 && (board.most_workers(shards) as u64) < wanted {
            let count = |s: &u64| layout.frames_of(*s).end - layout.frames_of(*s).start;
            board.most = most.min((shards.iter().map(count).sum::<u64>() / wanted).max(1));
        }
        board
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// The runs of a shard, each of frames of one scene.
    fn runs(&self, shard: u64) -> Vec<(u32, Range<u32>)> {
        let mut left = self.layout.frames_of(shard);
        let mut runs = Vec::new();
        while !left.is_empty() {
            let (scene, first) = self.recipe.place(left.start);
            let of_scene = u64::from(self.recipe.frames_per_scene - first);
            let n = of_scene.min(left.end - left.start).min(self.most);
            runs.push((scene, first..first + n as u32));
            left.start += n;
        }
        runs
    }

    /// Largest number of workers that can be busy at once.
    pub fn most_workers(&self, shards: &[u64]) -> usize {
        shards.iter().map(|s| self.runs(*s).len()).sum()
    }

    /// Claims the next run for a worker that was at shard `own` before; returns the shard's queue too when
    /// the claim begins it. None when all runs are claimed or the work was `stopped`.
    pub fn claim(
        &self,
        mut own: Option<u64>,
        stopped: &dyn Fn() -> bool,
    ) -> Option<(Claim<T>, Option<Queue<T>>)> {
        let mut state = self.state();
        if let Some(open) = own.and_then(|s| state.open.get_mut(&s)) {
            open.workers -= 1;
        }
        loop {
            if state.closed || stopped() {
                return None;
            }
            let idle = |s: &u64, state: &State<T>| state.open.get(s).is_none_or(|o| o.waiting.is_empty());
            own = own.filter(|s| !idle(s, &state));
            let (shard, queue) = if let Some(own) = own {
                (own, None)
            } else if let Some(shard) = state.fresh.pop_front() {
                let queue = self.open(shard, &mut state);
                (shard, Some(queue))
            } else {
                let left = state.open.iter().filter(|(_, o)| !o.waiting.is_empty());
                // The lowest of those with most to do, for the same choice at every call.
                let most = left.max_by_key(|(s, o)| (o.waiting.len(), std::cmp::Reverse(**s)));
                (*most?.0, None)
            };
            if let Some(open) = state.open.get_mut(&shard).filter(|o| o.has_room())
                && let Some(claim) = open.waiting.pop_front()
            {
                open.begun += 1;
                open.workers += 1;
                return Some((claim, queue));
            }
            state = self.moved.wait_timeout(state, LOOK).unwrap_or_else(|e| e.into_inner()).0;
        }
    }

    /// Claims runs of `shard` that follow the one that a worker has just claimed, with at most `frames` frames together, and no more than its
    /// share of those that are left. They are made at once and written in turn, so nothing is waited for.
    pub fn claim_more(&self, shard: u64, mut frames: u64) -> Vec<Claim<T>> {
        let mut state = self.state();
        let Some(open) = state.open.get_mut(&shard) else { return Vec::new() };
        let mut share = (open.waiting.len() + 1).div_ceil(self.workers.max(1)) - 1;
        let mut claims = Vec::new();
        while share > 0
            && open.waiting.front().is_some_and(|c| c.frames.len() as u64 <= frames)
            && let Some(claim) = open.waiting.pop_front()
        {
            frames -= claim.frames.len() as u64;
            share -= 1;
            open.begun += 1;
            claims.push(claim);
        }
        open.together = open.together.max(1 + claims.len());
        claims
    }

    fn open(&self, shard: u64, state: &mut State<T>) -> Queue<T> {
        let (mut waiting, mut runs) = (VecDeque::new(), VecDeque::new());
        for (scene, frames) in self.runs(shard) {
            let (to, from) = sync_channel(frames.len());
            runs.push_back((from, frames.len()));
            waiting.push_back(Claim { shard, scene, frames, to });
        }
        state.open.insert(shard, Open { waiting, begun: 0, workers: 0, together: 1 });
        Queue { shard, runs }
    }

    /// Reports that a run of the shard is written.
    pub fn written(&self, shard: u64) {
        let mut state = self.state();
        if let Some(open) = state.open.get_mut(&shard) {
            open.begun -= 1;
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
        self.moved.notify_all();
    }
}

impl<T> Queue<T> {
    pub fn shard(&self) -> u64 {
        self.shard
    }

    /// Takes the next frame in order; None at the end or when its maker was stopped. The board is told of
    /// every run's end.
    pub fn take(&mut self, board: &Board<'_, T>) -> Option<T> {
        let (run, left) = self.runs.front_mut()?;
        let frame = run.recv().ok()?;
        *left -= 1;
        if *left == 0 {
            self.runs.pop_front();
            board.written(self.shard);
        }
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{Compression, Format};
    use std::cell::Cell;
    use std::path::Path;

    /// A worker makes a batch while its last one waits to be written, and no third one before that is written.
    #[test]
    fn one_batch_is_made_while_another_is_written() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/recipes/tiny.toml");
        let mut recipe = Recipe::load(&path, None).unwrap();
        recipe.scenes = 8;
        let layout = DatasetLayout {
            format: Format::Frames,
            compression: Compression::None,
            frames: recipe.frames(),
            frames_per_shard: recipe.frames(),
            arrays: Vec::new(),
            tables: Vec::new(),
            attributes: Default::default(),
        };
        let board: Board<'_, u32> = Board::new(&recipe, &layout, &[0], 1);
        let looks = Cell::new(0);
        let a_run = recipe.frames_per_scene;
        let claim = |own: Option<u64>| {
            looks.set(0);
            // A claim that has to wait is stopped after a few looks.
            let (first, queue) = board.claim(own, &|| looks.replace(looks.get() + 1) > 2)?;
            let mut claims = vec![first];
            claims.extend(board.claim_more(0, u64::from(a_run)));
            claims.iter().for_each(|c| c.frames.clone().for_each(|n| c.to.send(n).unwrap()));
            Some((claims.len(), queue))
        };
        let (runs, queue) = claim(None).unwrap();
        let mut queue = queue.unwrap();
        assert_eq!(runs, 2);
        assert_eq!(claim(Some(0)).unwrap().0, 2);
        assert!(claim(Some(0)).is_none());
        (0..a_run).for_each(|n| assert_eq!(queue.take(&board), Some(n)));
        assert!(claim(None).is_none());
        (0..a_run).for_each(|n| assert_eq!(queue.take(&board), Some(n)));
        assert_eq!(claim(None).unwrap().0, 2);
    }
}
