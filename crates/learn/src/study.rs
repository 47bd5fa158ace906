//! Several trainings, each with several seeds, judged on the same frames: which input, which network and which part of the simulation make
//! a difference, and whether it is larger than what another seed does.

use crate::config::Config;
use crate::model::Model;
use crate::score::{cell, column_name};
use crate::train::{EpochRow, train};
use burn::tensor::Device;
use catseye::base::control::Control;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::csv;
use catseye::formats::stage::{StagedDir, sha256_of_bytes, write_file};
use catseye_lane::score::Figure;
use catseye_plot::{Axis, Chart, Layer, Mark, Pen, curve_pen};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Table of the result.
pub const TABLE: &str = "study.csv";
/// The same for readers.
pub const PAGE: &str = "study.md";
/// What the frames are called that each training kept back for its own test.
pub const OWN_TEST: &str = "test";

/// What is compared.
#[derive(Debug, Clone)]
pub struct Study {
    /// The trainings by their names, which are those of their files. Differences count from the first.
    pub trainings: Vec<(String, Config)>,
    /// Seeds 1 to so many.
    pub seeds: u32,
    /// Further frames on which all are judged, by the name of their folder.
    pub on: Vec<(String, PathBuf)>,
}

/// A figure of one training on some frames, over the seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyRow {
    /// Name of the training.
    pub training: String,
    /// Name of the frames.
    pub data: String,
    /// The class.
    pub class: String,
    /// What the figure is: "F1" or "AP50".
    pub figure: String,
    /// Mean over the seeds.
    pub mean: f64,
    /// Half of the 95 % interval of the mean (Student's t); None of a single seed.
    pub half: Option<f64>,
    /// Number of seeds that have the figure.
    pub seeds: usize,
    /// Mean over the seeds of the difference from the first training with the same seed, and half of its interval; None of the first one
    /// and where the frames are not the same.
    pub difference: Option<[Option<f64>; 2]>,
}

/// Figures of one training with one seed: by the frames' name, what they are, and by class.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Found {
    figure: String,
    by_data: BTreeMap<String, BTreeMap<String, Option<f64>>>,
}

impl Study {
    /// The study of some files of trainings, on some folders of runs and datasets.
    ///
    /// # Errors
    /// Returns the errors of [`Config::read`], and `BadInput` for no training, two of the same name, two folders of the same name or other
    /// than 1 to 100 seeds.
    pub fn new(files: &[PathBuf], seeds: u32, on: &[PathBuf]) -> Result<Study> {
        if !(1..=100).contains(&seeds) {
            let bad = BadInput::new("is out of range").key("--seeds").value(seeds);
            return Err(bad.allowed("1 to 100").into());
        }
        let name = |path: &Path, stem: bool| -> Result<String> {
            let name = if stem { path.file_stem() } else { path.file_name() };
            let unnamed = || BadInput::new("has no name").file(path).remedy("give the folder by its name");
            Ok(name.ok_or_else(unnamed)?.to_string_lossy().into_owned())
        };
        let twice = |what: &str, path: &Path| {
            let bad = BadInput::new(format!("has the same name as another {what}")).file(path);
            Error::from(bad.remedy("rename it, so that results can be distinguished"))
        };
        let mut study = Study { trainings: Vec::new(), seeds, on: Vec::new() };
        for file in files {
            let name = name(file, true)?;
            if study.trainings.iter().any(|t| t.0 == name) {
                return Err(twice("training", file));
            }
            study.trainings.push((name, Config::read(file)?));
        }
        if study.trainings.is_empty() {
            return Err(BadInput::new("no training is given").remedy("give training TOMLs").into());
        }
        for dir in on {
            let name = name(dir, false)?;
            if name == OWN_TEST || study.on.iter().any(|o| o.0 == name) {
                return Err(twice("set of frames", dir));
            }
            study.on.push((name, dir.clone()));
        }
        Ok(study)
    }

    fn identity(&self) -> String {
        let of = |t: &(String, Config)| format!("{} {}\n", t.0, t.1.identity());
        let trainings: String = self.trainings.iter().map(of).collect();
        sha256_of_bytes(format!("{trainings}{} {:?}", self.seeds, self.on).as_bytes())
    }

    /// Trains and judges all, and writes the folder `out`: the folders of the trainings (`NAME/seed_1`, ...), a table, the same as a page,
    /// and a picture for each set of frames. An interrupted study goes on when it is started again with the same files. `tell` gets the name
    /// of the training, its seed and each epoch, and no epoch when it is done.
    ///
    /// # Errors
    /// Returns the errors of [`train`] and of [`Model::evaluate`], and an error if a file cannot be written.
    pub fn run(
        &self,
        out: &Path,
        force: bool,
        device: &Device,
        control: &Control<'_>,
        tell: &dyn Fn(&str, u32, Option<&EpochRow>),
    ) -> Result<(PathBuf, Vec<StudyRow>)> {
        let (staged, notes) = StagedDir::resumable(out, force, "learn study", &self.identity())?;
        let mut found = Vec::new();
        for (name, config) in &self.trainings {
            let folder = staged.path().join(name);
            fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e))?;
            let by_seed = (1..=self.seeds).map(|seed| {
                let note = notes.join(format!("{name}_{seed}.json"));
                let made = match note.is_file() {
                    true => {
                        let text = fs::read(&note).map_err(|e| Error::io(&note, e))?;
                        let foreign = |e| {
                            let bad = BadInput::new(format!("is not a note of a study: {e}")).file(&note);
                            bad.remedy("delete it; its training is then repeated")
                        };
                        serde_json::from_slice(&text).map_err(foreign)?
                    }
                    false => {
                        let told = |row: &EpochRow| tell(name, seed, Some(row));
                        let made = self.judged(&folder, config, seed, device, control, &told)?;
                        let text = serde_json::to_vec(&made).map_err(|e| Error::Failed(e.to_string()))?;
                        write_file(&note, true, &text)?;
                        made
                    }
                };
                tell(name, seed, None);
                Ok(made)
            });
            found.push(by_seed.collect::<Result<Vec<Found>>>()?);
        }
        let rows = self.rows(&found);
        write_table(&staged.path().join(TABLE), &rows)?;
        let page = staged.path().join(PAGE);
        fs::write(&page, self.page(&rows)).map_err(|e| Error::io(&page, e))?;
        for data in self.data() {
            let of: Vec<&StudyRow> = rows.iter().filter(|r| r.data == data).collect();
            if !of.is_empty() {
                let file = format!("study_{}.png", column_name(data));
                self.chart(data, &of).draw()?.write(staged.path().join(file), true)?;
            }
        }
        Ok((staged.commit()?, rows))
    }

    /// Trains with one seed, and judges.
    fn judged(
        &self,
        folder: &Path,
        config: &Config,
        seed: u32,
        device: &Device,
        control: &Control<'_>,
        tell: &dyn Fn(&EpochRow),
    ) -> Result<Found> {
        let at = folder.join(format!("seed_{seed}"));
        let report = train(&config.with_seed(seed)?, &at, true, device, *control, tell)?;
        let by_class =
            |names: &[String], figures: Vec<Option<f64>>| names.iter().cloned().zip(figures).collect();
        let mut found = Found { figure: report.figure.into(), ..Found::default() };
        found.by_data.insert(OWN_TEST.into(), by_class(&report.classes, report.test));
        let model = Model::load(&at, device)?;
        for (name, runs) in &self.on {
            let judged = model.evaluate(std::slice::from_ref(runs))?;
            found.by_data.insert(name.clone(), by_class(judged.names(), judged.figures()));
        }
        Ok(found)
    }

    /// Names of the frames.
    fn data(&self) -> impl Iterator<Item = &str> {
        std::iter::once(OWN_TEST).chain(self.on.iter().map(|o| o.0.as_str()))
    }

    fn rows(&self, found: &[Vec<Found>]) -> Vec<StudyRow> {
        let mut rows = Vec::new();
        let first = &self.trainings[0].1;
        for data in self.data() {
            for ((name, config), by_seed) in self.trainings.iter().zip(found) {
                let same = config.data.runs == first.data.runs && config.data.split == first.data.split;
                for class in &config.data.classes.value {
                    let of = |f: &Found| f.by_data.get(data).and_then(|c| c.get(class).copied()).flatten();
                    let values: Vec<f64> = by_seed.iter().filter_map(of).collect();
                    let Some(figure) = Figure::of(&values) else { continue };
                    let pairs = by_seed.iter().zip(&found[0]);
                    let differences: Vec<f64> = pairs.filter_map(|(f, g)| Some(of(f)? - of(g)?)).collect();
                    let half = |f: &Figure| Some(f.half).filter(|h| h.is_finite());
                    let compared = name != &self.trainings[0].0 && (data != OWN_TEST || same);
                    let difference = Figure::of(&differences).filter(|_| compared);
                    rows.push(StudyRow {
                        training: name.clone(),
                        data: data.into(),
                        class: class.clone(),
                        figure: by_seed[0].figure.clone(),
                        mean: figure.mean,
                        half: half(&figure),
                        seeds: figure.runs,
                        difference: difference.map(|d| [Some(d.mean), half(&d)]),
                    });
                }
            }
        }
        rows
    }

    /// The table as Markdown.
    pub fn page(&self, rows: &[StudyRow]) -> String {
        let with = |mean: f64, half: Option<f64>| match half {
            Some(half) => format!("{mean:.3} ± {half:.3}"),
            None => format!("{mean:.3}"),
        };
        let mut text = format!(
            "# Study\n\nMeans over {} seeds with 95 % intervals of the mean. Differences are from `{}`, seed by seed, on the same frames.\n\n\
             | frames | training | class | figure | mean | difference |\n|---|---|---|---|---:|---:|\n",
            self.seeds, self.trainings[0].0
        );
        for r in rows {
            let difference = match r.difference {
                Some([Some(mean), half]) => with(mean, half),
                _ => String::new(),
            };
            text += &format!(
                "| {} | {} | {} | {} | {} | {difference} |\n",
                r.data,
                r.training,
                r.class,
                r.figure,
                with(r.mean, r.half)
            );
        }
        text
    }

    fn chart(&self, data: &str, rows: &[&StudyRow]) -> Chart {
        let count = self.trainings.len();
        let names = self.trainings.iter().enumerate().map(|(k, t)| (k as f64, t.0.clone()));
        let x = Axis::new(rows[0].figure.clone(), 0.0, 1.0);
        // The first on top.
        let y = Axis::new("", count as f64 - 0.4, -0.6).named(names);
        let mut chart = Chart::new(format!("Frames: {data}"), x, y);
        let mut classes: Vec<&str> = Vec::new();
        rows.iter().for_each(|r| {
            if !classes.contains(&r.class.as_str()) {
                classes.push(&r.class)
            }
        });
        let step = 0.6 / classes.len() as f64;
        for (k, class) in classes.iter().enumerate() {
            let pen = curve_pen(k);
            let aside = step * (k as f64 - 0.5 * (classes.len() as f64 - 1.0));
            let mut dots = Vec::new();
            for r in rows.iter().filter(|r| r.class == *class) {
                let place = self.trainings.iter().position(|t| t.0 == r.training).unwrap_or(0) as f64;
                let (at, half) = (place + aside, r.half.unwrap_or(0.0));
                let bar = vec![[(r.mean - half).max(0.0), at], [(r.mean + half).min(1.0), at]];
                chart.layers.push(Layer::Line { points: bar, pen: Pen::solid(pen.colour, 2.0) });
                dots.push([r.mean, at]);
            }
            chart.marks(*class, dots, Mark::Dot { radius: 4.0 }, pen.colour);
        }
        chart
    }
}

fn write_table(path: &Path, rows: &[StudyRow]) -> Result<()> {
    let io = |e| Error::io(path, e);
    let header = [
        "training",
        "data",
        "class",
        "figure",
        "mean",
        "half_95",
        "seeds",
        "difference",
        "difference_half_95",
    ];
    let file = BufWriter::new(File::create(path).map_err(io)?);
    let mut table = csv::Writer::new(file, &[], &header).map_err(io)?;
    for r in rows {
        let [difference, half] = r.difference.unwrap_or([None, None]).map(cell);
        let (mean, own_half) = (cell(Some(r.mean)), cell(r.half));
        let row: [&dyn Display; 9] =
            [&r.training, &r.data, &r.class, &r.figure, &mean, &own_half, &r.seeds, &difference, &half];
        table.row(row).map_err(io)?;
    }
    table.finish().map_err(io)?;
    Ok(())
}
