//! Trains a network: passes over the training set, a checkpoint after each, and the folder of the result.
//!
//! Everything random is a counter-based draw: the first weights follow from the seed, the order of an epoch from seed and epoch. A
//! training that was killed and goes on ends with the bytes of one that was not.

use crate::augment::{Augment, Move};
use crate::card::card;
use crate::config::Config;
use crate::data::{Sets, shuffle, split};
use crate::detect_task::DetectTask;
use crate::grid_task::GridTask;
use crate::model::{CONFIG, WEIGHTS, foreign, load_weights};
use crate::network::Network;
use crate::point_task::PointTask;
use crate::score::{cell, column_name};
use crate::task::{Aim, Task, TruthOf, Verdict, VerdictOf, judge};
use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::store::RecordError;
use burn::tensor::{Bytes, Device};
use catseye::base::control::Control;
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::rng::Draws;
use catseye::formats::stage::{StagedDir, sync_tree};
use catseye::formats::{csv, input};
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::Relaxed;

/// Table of scores, a row for each epoch.
pub const SCORES: &str = "scores.csv";
/// What the network is and what it reached.
pub const CARD: &str = "model_card.md";

/// Files of a checkpoint beside the weights.
const BEST: &str = "best.bpk";
const OPTIMISER: &str = "optimiser.bpk";
const STATE: &str = "state.json";
/// Largest file of a checkpoint that is read, bytes.
const MOST_BYTES: u64 = 1 << 33;
/// The stream of draws for the order of the first epoch; the next ones follow. Weights have the streams from 1 on.
const ORDER_STREAM: u32 = 1 << 16;

/// What one epoch reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpochRow {
    /// The epoch, from 1.
    pub epoch: usize,
    /// Mean loss of the training set, while it was learned.
    pub loss: f64,
    /// The figure of each class in the validation set (F1, or the average precision at an intersection over union of 0.5); None where
    /// the set does not tell it.
    pub figures: Vec<Option<f64>>,
    /// Their mean.
    pub mean: f64,
}

/// What a training reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Folder of the result.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub folder: PathBuf,
    /// All epochs.
    pub epochs: Vec<EpochRow>,
    /// The epoch whose weights were kept.
    pub best_epoch: usize,
    /// Names of the classes.
    pub classes: Vec<String>,
    /// What the figures are: "F1" or "AP50".
    pub figure: &'static str,
    /// The figure of each class in the test set.
    pub test: Vec<Option<f64>>,
    /// Numbers of frames for training, validation and test.
    pub frames: [usize; 3],
}

/// What a checkpoint says beside its tensors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct State {
    rows: Vec<EpochRow>,
    best_epoch: usize,
    /// The stream of draws of the next epoch.
    next_stream: u32,
}

/// A network while it learns.
struct Trainer<'a, T: Task> {
    config: &'a Config,
    task: &'a T,
    device: Device,
    examples: &'a [T::Example],
    sets: &'a Sets,
    net: T::Net,
    optimiser: ModuleOptimizer,
    loss: <T::Aim as Aim>::Loss,
    /// Weights of the best epoch as bytes of a file.
    best: Vec<u8>,
    state: State,
}

fn failed(e: &RecordError) -> Error {
    Error::Failed(format!("the weights cannot be written: {e}"))
}

/// Weights and running means as the bytes of a file. The network is one without gradients, whose running means are up to date.
fn weights(net: impl Module) -> Result<Vec<u8>> {
    net.into_record().into_bytes().map(|b| b.to_vec()).map_err(|e| failed(&e))
}

impl<'a, T: Task> Trainer<'a, T> {
    fn new(
        config: &'a Config,
        task: &'a T,
        examples: &'a [T::Example],
        sets: &'a Sets,
        device: &Device,
    ) -> Trainer<'a, T> {
        let device = device.clone().autodiff();
        let mut truths = sets.training.iter().map(|p| task.given(&examples[*p], &Move::NONE).1);
        Trainer {
            net: task.net(config.training.seed.value, &device),
            optimiser: AdamConfig::new().with_epsilon(1e-8).init(),
            loss: task.aim().loss(&mut truths, config.training.balance.value, &device),
            best: Vec::new(),
            state: State { next_stream: ORDER_STREAM, ..State::default() },
            config,
            task,
            device,
            examples,
            sets,
        }
    }

    /// One pass over the training set, then a look at the validation set.
    fn epoch(&mut self, control: &Control<'_>) -> Result<()> {
        let t = &self.config.training;
        let mut order = self.sets.training.clone();
        let mut draws = Draws::new(t.seed.value, self.state.next_stream);
        shuffle(&mut order, &mut draws);
        let augment = t.augment.as_ref().map_or_else(Augment::default, |a| a.value);
        self.state.next_stream += 1;
        let (mut sum, mut learned) = (0.0, 0);
        for (done, batch) in order.chunks(t.batch.value).enumerate() {
            if control.cancel.is_some_and(|c| c.load(Relaxed)) {
                return Err(interrupted(self.state.rows.len()));
            }
            let moves: Vec<Move> = batch.iter().map(|_| augment.draw(&mut draws)).collect();
            let mut given: Vec<(T::Seen, TruthOf<T>)> = batch
                .iter()
                .zip(&moves)
                .map(|(place, moved)| self.task.given(&self.examples[*place], moved))
                .collect();
            given.retain(|g| self.task.aim().counts(&g.1));
            if given.is_empty() {
                continue;
            }
            let seen: Vec<&T::Seen> = given.iter().map(|g| &g.0).collect();
            let truths: Vec<&TruthOf<T>> = given.iter().map(|g| &g.1).collect();
            let outputs = self.task.outputs(&self.net, &seen, &self.device);
            let loss = self.task.aim().lost(&self.loss, outputs, &truths);
            let value = f64::from(loss.clone().into_scalar::<f32>());
            if !value.is_finite() {
                let epoch = self.state.rows.len() + 1;
                let problem =
                    format!("the loss of epoch {epoch} is not finite: give a smaller training.rate");
                return Err(Error::Failed(problem));
            }
            sum += value * given.len() as f64;
            learned += given.len();
            let grads = GradientsParams::from_grads(loss.backward(), &self.net);
            self.net = self.optimiser.step(t.rate.value, self.net.clone(), grads);
            if let Some(progress) = control.progress {
                progress(((done + 1) * t.batch.value).min(order.len()) as u64, order.len() as u64);
            }
        }
        if learned == 0 {
            let bad = BadInput::new("no frame of the training set contains a point").key("data.runs");
            return Err(bad.remedy("give runs whose radar detects something").into());
        }
        let fixed = self.net.valid();
        let verdict = self.judged(&fixed, &self.sets.validation);
        let row = EpochRow {
            epoch: self.state.rows.len() + 1,
            loss: sum / learned as f64,
            figures: verdict.figures(),
            mean: verdict.mean(),
        };
        let best = self.state.rows.iter().map(|r| r.mean).fold(f64::NEG_INFINITY, f64::max);
        if row.mean > best {
            self.best = weights(fixed)?;
            self.state.best_epoch = row.epoch;
        }
        self.state.rows.push(row);
        Ok(())
    }

    fn judged(&self, fixed: &T::Net, places: &[usize]) -> VerdictOf<T> {
        let mut verdict = self.task.aim().verdict();
        let given = places.iter().map(|p| self.task.given(&self.examples[*p], &Move::NONE));
        judge(self.task, fixed, &self.device.clone().without_autodiff(), given, &mut verdict);
        verdict
    }

    fn is_over(&self) -> bool {
        let t = &self.config.training;
        let epochs = self.state.rows.len();
        epochs >= t.epochs.value || epochs >= self.state.best_epoch + t.patience.value && epochs > 0
    }

    /// Writes a checkpoint under a hidden name, renames it and takes the one before away.
    fn save(&self, notes: &Path) -> Result<()> {
        let name = format!("epoch_{:06}", self.state.rows.len());
        let (made, at) = (notes.join(format!(".{name}")), notes.join(&name));
        for rest in [&made, &at].into_iter().filter(|p| p.exists()) {
            fs::remove_dir_all(rest).map_err(|e| Error::io(rest, e))?;
        }
        fs::create_dir(&made).map_err(|e| Error::io(&made, e))?;
        let optimiser = self.optimiser.into_bytes().map_err(|e| failed(&e))?;
        let state = serde_json::to_vec_pretty(&self.state).map_err(|e| Error::Failed(e.to_string()))?;
        let files: [(&str, &[u8]); 4] = [
            (WEIGHTS, &weights(self.net.valid())?),
            (BEST, &self.best),
            (OPTIMISER, &optimiser),
            (STATE, &state),
        ];
        for (file, bytes) in files {
            let path = made.join(file);
            fs::write(&path, bytes).map_err(|e| Error::io(&path, e))?;
        }
        sync_tree(&made)?;
        fs::rename(&made, &at).map_err(|e| Error::io(&at, e))?;
        for old in checkpoints(notes)?.into_iter().filter(|p| *p != at) {
            fs::remove_dir_all(&old).map_err(|e| Error::io(&old, e))?;
        }
        Ok(())
    }

    /// Goes on from the last checkpoint, where there is one.
    fn resume(&mut self, notes: &Path) -> Result<()> {
        let Some(at) = checkpoints(notes)?.pop() else { return Ok(()) };
        let read = |file: &str| input::read(&at.join(file), "a file of a checkpoint", MOST_BYTES);
        self.net = load_weights(self.net.clone(), &at.join(WEIGHTS))?;
        let optimiser = AdamConfig::new().with_epsilon(1e-8).init();
        self.optimiser = optimiser
            .from_bytes(Bytes::from_bytes_vec(read(OPTIMISER)?))
            .map_err(|e| foreign(&at.join(OPTIMISER), &e))?;
        self.best = read(BEST)?;
        self.state = serde_json::from_slice(&read(STATE)?).map_err(|e| {
            BadInput::new(format!("is not the state of a training: {e}")).file(at.join(STATE))
        })?;
        Ok(())
    }
}

/// Complete checkpoints in their order.
fn checkpoints(notes: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(notes).map_err(|e| Error::io(notes, e))?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|e| e.ok())
        .filter(|e| e.file_name().to_string_lossy().starts_with("epoch_"))
        .map(|e| e.path())
        .collect();
    found.sort();
    Ok(found)
}

fn interrupted(epochs: usize) -> Error {
    Error::Interrupted(format!("{epochs} epochs are complete; the same command continues"))
}

/// Trains the network of a file and writes the folder `out`: weights of the best epoch, the file itself, scores of each epoch, the
/// confusion matrix of the test set and a model card. An interrupted training goes on when it is started again with the same file.
/// `control.progress` counts the frames of an epoch; `tell` gets each epoch when its checkpoint stands.
///
/// # Errors
/// Returns the errors of [`Task::find`], [`Task::read`] and [`split`], an error if a file cannot be written or the loss is not finite, and
/// [`Error::Interrupted`] when `control.cancel` is set.
pub fn train(
    config: &Config,
    out: &Path,
    force: bool,
    device: &Device,
    control: Control<'_>,
    tell: &dyn Fn(&EpochRow),
) -> Result<Report> {
    match &config.network {
        Network::Grids(network) => {
            let task = GridTask::new(config, network, config.grid()?)?;
            train_task(config, &task, out, force, device, &control, tell)
        }
        Network::Objects(network) => {
            let task = DetectTask::new(config, network, config.grid()?)?;
            train_task(config, &task, out, force, device, &control, tell)
        }
        Network::Points(network) => {
            let task = PointTask::new(config, network)?;
            train_task(config, &task, out, force, device, &control, tell)
        }
    }
}

fn train_task<T: Task>(
    config: &Config,
    task: &T,
    out: &Path,
    force: bool,
    device: &Device,
    control: &Control<'_>,
    tell: &dyn Fn(&EpochRow),
) -> Result<Report> {
    let d = &config.data;
    let (staged, notes) = StagedDir::resumable(out, force, "learn", &config.identity())?;
    let sources = task.find(&config.runs())?;
    let examples = sources.iter().map(|s| task.read(s)).collect::<Result<Vec<T::Example>>>()?;
    let sets = split(&sources, d.split, d.block_frames.value, config.training.seed.value)?;
    let mut trainer = Trainer::new(config, task, &examples, &sets, device);
    trainer.resume(&notes)?;
    trainer.state.rows.iter().for_each(tell);
    while !trainer.is_over() {
        trainer.epoch(control)?;
        trainer.save(&notes)?;
        if let Some(row) = trainer.state.rows.last() {
            tell(row);
        }
        if control.cancel.is_some_and(|c| c.load(Relaxed)) && !trainer.is_over() {
            return Err(interrupted(trainer.state.rows.len()));
        }
    }
    let at = |file: &str| staged.path().join(file);
    let write = |file: &str, bytes: &[u8]| fs::write(at(file), bytes).map_err(|e| Error::io(at(file), e));
    write(WEIGHTS, &trainer.best)?;
    write(CONFIG, config.text.as_bytes())?;
    let plain = device.clone().without_autodiff();
    let best = load_weights(task.net(0, &plain).valid(), &at(WEIGHTS))?;
    let verdict = trainer.judged(&best, &sets.test);
    verdict.write(staged.path())?;
    let State { rows, best_epoch, .. } = &trainer.state;
    write_scores(&at(SCORES), &verdict, rows)?;
    let frames = [sets.training.len(), sets.validation.len(), sets.test.len()];
    let best = (*best_epoch, rows.get(best_epoch.wrapping_sub(1)).map(|r| r.mean));
    let text = card(config, &task.words(), &verdict, rows.len(), best, &sets, &sources);
    write(CARD, text.as_bytes())?;
    let report = Report {
        epochs: rows.clone(),
        best_epoch: *best_epoch,
        classes: verdict.names().to_vec(),
        figure: VerdictOf::<T>::FIGURE,
        test: verdict.figures(),
        frames,
        folder: PathBuf::new(),
    };
    let folder = staged.commit()?;
    Ok(Report { folder, ..report })
}

fn write_scores<V: Verdict>(path: &Path, verdict: &V, rows: &[EpochRow]) -> Result<()> {
    let io = |e| Error::io(path, e);
    let figure = V::FIGURE.to_lowercase();
    let mut header = vec!["epoch".to_string(), "loss".into(), format!("mean_{figure}")];
    header.extend(verdict.names().iter().map(|c| format!("{figure}_{}", column_name(c))));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let mut table =
        csv::Writer::new(BufWriter::new(File::create(path).map_err(io)?), &[], &header).map_err(io)?;
    for row in rows {
        let mut cells = vec![row.epoch.to_string(), cell(Some(row.loss)), cell(Some(row.mean))];
        cells.extend(row.figures.iter().map(|f| cell(*f)));
        table.row(cells.iter().map(|c| c as &dyn Display)).map_err(io)?;
    }
    table.finish().map_err(io)?;
    Ok(())
}
