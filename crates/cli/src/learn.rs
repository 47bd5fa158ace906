//! `catseye learn`: networks that learn from runs and datasets.

use super::global::Global;
use catseye::base::error::Result;
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Train a network on runs or datasets, score it, or apply it (needs a build with `--features learn`)
#[derive(Debug, Args)]
pub struct Learn {
    #[command(subcommand)]
    pub what: What,
}

#[derive(Debug, Subcommand)]
pub enum What {
    /// Train the network of a training file
    Train {
        /// Training file (TOML)
        config: PathBuf,
        /// Folder to write; the same command continues an interrupted training
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
    },
    /// Train several networks with several seeds each, score all on the same frames, and report the differences with confidence intervals
    Study {
        /// Training files (TOML); differences are relative to the first
        #[arg(required = true, value_name = "CONFIG")]
        configs: Vec<PathBuf>,
        /// Folder to write; the same command continues an interrupted study
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
        /// Number of seeds N: train each network with the seeds 1 to N
        #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100))]
        seeds: u32,
        /// Score all networks on this run or dataset as well (repeatable)
        #[arg(long, value_name = "RUN")]
        on: Vec<PathBuf>,
    },
    /// Score a trained network on runs or datasets with truth: precision, recall and F1 of each class, or object detection metrics
    Eval {
        /// Folder written by `catseye learn train`, or the name of a built-in network: road, markers, points
        dir: PathBuf,
        /// Folders written by `catseye simulate` or `catseye dataset`
        #[arg(required = true, value_name = "RUN")]
        runs: Vec<PathBuf>,
        /// Number of consecutive scans to accumulate (networks that classify cells)
        #[arg(long, value_name = "N", default_value_t = 1)]
        scans: usize,
    },
    /// Score a trained network on synthetic scans of a lane with other point spacings, widths, noise and objects (Feng 2019, table 5.6)
    Robustness {
        /// Folder written by `catseye learn train`, or the name of a built-in network: road, markers, points
        dir: PathBuf,
        /// Number of scans of each set
        #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=10_000))]
        pictures: u32,
    },
    /// Write the classes that a trained network predicts for the cells or points of a run, or the objects that it detects
    Predict {
        /// Folder written by `catseye learn train`, or the name of a built-in network: road, markers, points
        dir: PathBuf,
        /// Folder written by `catseye simulate` or `catseye dataset`; its truth is not used
        run: PathBuf,
        /// File to write: for grids an array (.npy), uint8 [frame, row, column]; for points and objects a table (.csv)
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Number of consecutive scans to accumulate (networks that classify cells)
        #[arg(long, value_name = "N", default_value_t = 1)]
        scans: usize,
    },
}

#[cfg(not(feature = "learn"))]
impl Learn {
    pub fn run(&self, _: &Global) -> Result<()> {
        Err(catseye::base::error::BadInput::new("this program was built without networks")
            .key("learn")
            .remedy("cargo install --path crates/cli --locked --features learn")
            .into())
    }
}

#[cfg(feature = "learn")]
impl Learn {
    pub fn run(&self, global: &Global) -> Result<()> {
        let device = with_networks::device_of(global)?;
        match &self.what {
            What::Train { config, output } => with_networks::train(global, config, output, &device),
            What::Study { configs, output, seeds, on } => {
                with_networks::study(global, configs, output, *seeds, on, &device)
            }
            What::Eval { dir, runs, scans } => with_networks::eval(global, dir, runs, *scans, &device),
            What::Robustness { dir, pictures } => with_networks::robustness(global, dir, *pictures, &device),
            What::Predict { dir, run, output, scans } => {
                with_networks::predict(global, dir, run, output, *scans, &device)
            }
        }
    }
}

#[cfg(feature = "learn")]
mod with_networks {
    use crate::bar::{self, Kept};
    use crate::global::Global;
    use catseye::base::control::Control;
    use catseye::base::error::{BadInput, Result};
    use catseye::formats::check_extension;
    use catseye_learn::Device;
    use catseye_learn::class_aim::Judged;
    use catseye_learn::config::Config;
    use catseye_learn::detection::{Detected, of_document};
    use catseye_learn::model::{Evaluation, Model};
    use catseye_learn::robustness::RobustnessSet;
    use catseye_learn::score::figure;
    use catseye_learn::study::Study;
    use catseye_learn::task::Verdict;
    use catseye_learn::train::EpochRow;
    use std::path::{Path, PathBuf};

    /// Where the network runs. A GPU is taken only when it is asked for.
    pub fn device_of(global: &Global) -> Result<Device> {
        match global.device.as_str() {
            "auto" | "cpu" => catseye_learn::device(false),
            "gpu" => catseye_learn::device(true),
            other => Err(BadInput::new("is not a device for networks")
                .key("--device")
                .value(other)
                .allowed("auto, cpu, gpu")
                .remedy("leave it out for the CPU")
                .into()),
        }
    }

    /// The seed of the command line.
    fn seed_of(global: &Global) -> Result<Option<u32>> {
        let one = |seed: u64| {
            let bad = BadInput::new("is out of range for networks").key("--seed").value(seed);
            u32::try_from(seed).map_err(|_| bad.allowed(format!("0 to {}", u32::MAX)).into())
        };
        global.seed.map(one).transpose()
    }

    fn by_class(classes: &[String], f1: &[Option<f64>]) -> String {
        let one = |(class, f): (&String, &Option<f64>)| format!("{class} {}", figure(*f));
        classes.iter().zip(f1).map(one).collect::<Vec<_>>().join(", ")
    }

    pub fn train(global: &Global, config: &Path, output: &Path, device: &Device) -> Result<()> {
        let config = Config::read(config)?;
        let config = seed_of(global)?.map_or(Ok(config.clone()), |seed| config.with_seed(seed))?;
        let (names, figure) = config.figures();
        let bar = global.bar("frames of an epoch", 0, Kept::Itself);
        let progress = |done, all| {
            bar.set_length(all);
            bar.set_position(done);
        };
        let control = Control { progress: Some(&progress), cancel: Some(bar::cancel()) };
        let tell = |row: &EpochRow| {
            let figures = by_class(&names, &row.figures);
            bar.suspend(|| {
                global.say(&format!("epoch {}: loss {:.4}, {figure} {figures}", row.epoch, row.loss))
            });
        };
        let report = catseye_learn::train::train(&config, output, global.force, device, control, &tell)?;
        drop(bar);
        global.answer(&report, || {
            format!(
                "best of {} epochs: {}; {} of the test set: {}\nwrote {}",
                report.epochs.len(),
                report.best_epoch,
                report.figure,
                by_class(&report.classes, &report.test),
                report.folder.display()
            )
        })
    }

    pub fn study(
        global: &Global,
        configs: &[PathBuf],
        output: &Path,
        seeds: u32,
        on: &[PathBuf],
        device: &Device,
    ) -> Result<()> {
        if let Some(seed) = global.seed {
            let bad =
                BadInput::new("a study trains with the seeds from 1 to --seeds").key("--seed").value(seed);
            return Err(bad.remedy("leave it out").into());
        }
        let study = Study::new(configs, seeds, on)?;
        let all = study.trainings.len() as u64 * u64::from(seeds);
        let bar = global.bar("trainings", all, Kept::Itself);
        let control = Control { progress: None, cancel: Some(bar::cancel()) };
        let tell = |training: &str, seed: u32, row: Option<&EpochRow>| match row {
            Some(row) => bar.set_message(format!("{training}, seed {seed}, epoch {}", row.epoch)),
            None => bar.inc(1),
        };
        let (folder, rows) = study.run(output, global.force, device, &control, &tell)?;
        drop(bar);
        let answer = serde_json::json!({ "folder": folder.display().to_string(), "rows": rows });
        global.answer(&answer, || format!("{}wrote {}", study.page(&rows), folder.display()))
    }

    pub fn eval(global: &Global, dir: &Path, runs: &[PathBuf], scans: usize, device: &Device) -> Result<()> {
        let judged = match Model::open(Path::new(""), dir, device)?.with_scans(scans)?.evaluate(runs)? {
            Evaluation::Classes(judged) => judged,
            Evaluation::Objects(detected) => return eval_objects(global, &detected),
        };
        let found = &judged.confusion;
        let rows: Vec<serde_json::Value> = (0..found.classes().len()).map(|k| row(&judged, k)).collect();
        global.answer(&serde_json::json!({ "mean_f1": found.mean_f1(), "classes": rows }), || {
            let line = |k: usize| {
                let [p, r, f] = [found.precision(k), found.recall(k), found.f1(k)].map(figure);
                let average = figure(judged.curves.average_precision(k));
                format!(
                    "{:12} precision {p}, recall {r}, F1 {f}, average precision {average}",
                    found.classes()[k]
                )
            };
            (0..found.classes().len()).map(line).collect::<Vec<_>>().join("\n")
        })
    }

    /// The figures of a detector beside those of table 5.7 of Feng (2019).
    fn eval_objects(global: &Global, found: &Detected) -> Result<()> {
        let (fit, misfits) = found.truth_fit();
        let row = |k: usize| {
            let name = &found.classes()[k];
            let [ap50, ap75, ap90, mean_iou] = found.row(k);
            let document = of_document(name).map(|[ap50, ap75, ap90, mean_iou]| {
                serde_json::json!({ "ap50": ap50, "ap75": ap75, "ap90": ap90, "mean_iou": mean_iou })
            });
            serde_json::json!({
                "class": name, "objects": found.objects(k), "ap50": ap50, "ap75": ap75, "ap90": ap90,
                "mean_iou": mean_iou, "document": document,
            })
        };
        let rows: Vec<serde_json::Value> = (0..found.classes().len()).map(row).collect();
        let answer = serde_json::json!({
            "mean_ap50": found.mean(), "truth_fit": fit, "left_out": misfits, "classes": rows,
        });
        global.answer(&answer, || {
            let mut lines = vec!["class         objects   AP50   AP75   AP90   mIoU   document's".to_string()];
            for (k, name) in found.classes().iter().enumerate() {
                let [a, b, c, iou] = found.row(k).map(figure);
                let theirs = of_document(name)
                    .map(|all| all.map(|v| format!("{v:.2}")).join(" "))
                    .unwrap_or_else(|| "none".into());
                lines.push(format!("{name:12} {:>8}  {a:>5}  {b:>5}  {c:>5}  {iou:>5}   {theirs}", found.objects(k)));
            }
            lines.push(format!(
                "true contours share {} with their cells; {misfits} objects that no quadrilateral fits are left out",
                figure(fit)
            ));
            lines.join("\n")
        })
    }

    pub fn robustness(global: &Global, dir: &Path, pictures: u32, device: &Device) -> Result<()> {
        let seed = seed_of(global)?.unwrap_or(1);
        let found = Model::open(Path::new(""), dir, device)?.robustness(pictures, seed)?;
        let lane = |judged: &Judged| {
            let m = &judged.confusion;
            let place = m.classes().iter().position(|c| c == "lane").unwrap_or(0);
            [m.precision(place), m.recall(place), m.f1(place)]
        };
        let rows: Vec<serde_json::Value> = found
            .iter()
            .map(|(set, judged)| {
                let ([precision, recall, f1], document) = (lane(judged), set.document);
                serde_json::json!({
                    "set": set.number,
                    "spacing_m": set.spacing_m,
                    "width_m": set.width_m,
                    "noise_points": set.noise,
                    "object_points": set.objects,
                    "precision": precision,
                    "recall": recall,
                    "f1": f1,
                    "document": { "precision": document[0], "recall": document[1], "f1": document[2] },
                })
            })
            .collect();
        global.answer(&serde_json::json!({ "pictures": pictures, "sets": rows }), || {
            let head = "set  spacing (left, right)  width  noise  objects   precision  recall     F1   document's F1";
            let line = |(set, judged): &(RobustnessSet, Judged)| {
                let [p, r, f] = lane(judged).map(figure);
                let [left, right] = set.spacing_m;
                format!(
                    "{:>3}  {left:>10.1} m, {right:>5.1} m  {:>4.1} m  {:>5}  {:>7}   {p:>9}  {r:>6}  {f:>5}   {:.2}",
                    set.number, set.width_m, set.noise, set.objects, set.document[2]
                )
            };
            std::iter::once(head.to_string()).chain(found.iter().map(line)).collect::<Vec<_>>().join("\n")
        })
    }

    fn row(judged: &Judged, k: usize) -> serde_json::Value {
        let found = &judged.confusion;
        serde_json::json!({
            "average_precision": judged.curves.average_precision(k),
            "class": found.classes()[k],
            "precision": found.precision(k),
            "recall": found.recall(k),
            "f1": found.f1(k),
            "predicted_as": (0..found.classes().len()).map(|p| found.count(k, p)).collect::<Vec<_>>(),
        })
    }

    pub fn predict(
        global: &Global,
        dir: &Path,
        run: &Path,
        output: &Path,
        scans: usize,
        device: &Device,
    ) -> Result<()> {
        check_extension(output, &["npy", "csv"])?;
        let frames =
            Model::open(Path::new(""), dir, device)?.with_scans(scans)?.predict(run, output, global.force)?;
        let answer = serde_json::json!({ "file": output.display().to_string(), "frames": frames });
        global.answer(&answer, || format!("wrote {} ({frames} frames)", output.display()))
    }
}
