//! Frames of runs as examples: what the radar measured in each cell, and the class that the simulation knows for it.
//!
//! [`Features`] are made of points alone. Nothing turns labels into features:
//!
//! ```compile_fail
//! use catseye_learn::data::{Features, Input, Labels};
//! fn leak(labels: &Labels) -> Features {
//!     Features::new(Input::A, labels, 1)
//! }
//! ```

use crate::augment::Move;
use crate::classes::Classes;
use crate::objects::Objects;
pub use crate::scan::{GridKind, Input, Scan, ScanCell};
use crate::source::Source;
use catseye::base::error::{BadInput, Result};
use catseye::base::rng::Draws;
use catseye::road::mask::{CellClass, Grid};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// What a network sees of one frame, `[plane, row, column]`, each value from -1 to 1. It is made of measured points alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    values: Vec<f32>,
    planes: usize,
    rows: usize,
    columns: usize,
}

impl Features {
    /// The features of a scan: squares of `scale` x `scale` cells are one cell, in which counts add up, the largest amplitude stays and
    /// ranges and azimuths are means over points. Counts n become n/(n + 1), ranges a share of the grid's farthest corner, azimuths
    /// a share of a quarter turn.
    pub fn new(input: Input, scan: &Scan, scale: usize) -> Features {
        let g = &scan.grid;
        let (rows, columns) = (g.rows.div_ceil(scale), g.columns.div_ceil(scale));
        let zero = vec![0f64; rows * columns];
        let [mut count, mut amplitude, mut range, mut azimuth] =
            [zero.clone(), zero.clone(), zero.clone(), zero];
        for c in &scan.cells {
            let (cell, n) = (c.cell as usize, f64::from(c.count));
            let at = (cell / g.columns / scale) * columns + cell % g.columns / scale;
            count[at] += n;
            amplitude[at] = amplitude[at].max(c.amplitude.into());
            range[at] += n * f64::from(c.range_m);
            azimuth[at] += n * f64::from(c.azimuth_rad);
        }
        let farthest_m = g.ahead_m.hypot(0.5 * g.across_m);
        let full = |n: &f64| n / (n + 1.0);
        let mean = |sums: &[f64], unit: f64| -> Vec<f64> {
            sums.iter().zip(&count).map(|(s, n)| s / n.max(1.0) / unit).collect()
        };
        let planes: Vec<Vec<f64>> = match input {
            Input::B => vec![count.iter().map(|n| f64::from(u8::from(*n > 0.0))).collect()],
            Input::A => vec![amplitude],
            Input::C2 => vec![count.iter().map(full).collect(), amplitude],
            Input::C4 => vec![
                count.iter().map(full).collect(),
                amplitude,
                mean(&range, farthest_m),
                mean(&azimuth, FRAC_PI_2),
            ],
        };
        let values = planes.iter().flatten().map(|v| v.clamp(-1.0, 1.0) as f32).collect();
        Features { values, planes: input.planes(), rows, columns }
    }

    /// All values, `[plane, row, column]`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Numbers of planes, rows and columns.
    pub fn shape(&self) -> [usize; 3] {
        [self.planes, self.rows, self.columns]
    }
}

/// The true class of each cell, `[row, column]`, or of each point, as places in the list of classes. Networks are judged by it and
/// never see it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    places: Vec<u8>,
}

impl Labels {
    /// The labels of a mask of [`CellClass`] numbers. Squares of `scale` x `scale` cells become one cell: of a guard rail or a marker,
    /// which are narrower than a cell, where any cell is; else of what most of its cells are, the lower number where two are as many.
    ///
    /// # Errors
    /// Returns `BadInput` if the mask is of another size than the grid, or holds a number of no class.
    pub fn new(classes: &Classes, grid: &Grid, mask: &[u8], scale: usize) -> Result<Labels> {
        if mask.len() != grid.cells() {
            let bad = BadInput::new("the mask has another size than the grid").value(mask.len());
            return Err(bad.allowed(format!("{} cells", grid.cells())).into());
        }
        check_classes(mask)?;
        Ok(Labels::of(classes, grid, mask, scale))
    }

    /// The labels of a mask that was checked.
    fn of(classes: &Classes, grid: &Grid, mask: &[u8], scale: usize) -> Labels {
        let (rows, columns) = (grid.rows.div_ceil(scale), grid.columns.div_ceil(scale));
        let mut tallies = vec![[0u32; CellClass::ALL.len()]; rows * columns];
        for (cell, class) in mask.iter().enumerate() {
            tallies[(cell / grid.columns / scale) * columns + cell % grid.columns / scale]
                [usize::from(*class)] += 1;
        }
        Labels { places: tallies.iter().map(|t| classes.place(class_of(t))).collect() }
    }

    /// The labels of points, in their order.
    pub fn of_points(classes: &Classes, truth: impl IntoIterator<Item = CellClass>) -> Labels {
        Labels { places: truth.into_iter().map(|class| classes.place(class)).collect() }
    }

    /// Places of the classes in the list: of cells `[row, column]`, of points in their order.
    pub fn places(&self) -> &[u8] {
        &self.places
    }
}

fn check_classes(mask: &[u8]) -> Result<()> {
    let Some(wrong) = mask.iter().find(|c| usize::from(**c) >= CellClass::ALL.len()) else { return Ok(()) };
    let bad = BadInput::new("is not the number of a class").key("class").value(wrong);
    let allowed = format!("0 to {}", CellClass::ALL.len() - 1);
    Err(bad.allowed(allowed).remedy("simulate again with this version").into())
}

/// The class of a square of cells, from how many of each class it holds.
fn class_of(tally: &[u32; CellClass::ALL.len()]) -> CellClass {
    let narrow = [CellClass::Marker, CellClass::Pedestrian, CellClass::Cyclist, CellClass::GuardRail];
    if let Some(class) = narrow.into_iter().find(|c| tally[*c as usize] > 0) {
        return class;
    }
    let wide = [CellClass::Vehicle, CellClass::Lane, CellClass::Undefined];
    // The last of equal ones is taken, which has the lowest number.
    wide.into_iter().max_by_key(|c| tally[*c as usize]).unwrap_or(CellClass::Undefined)
}

/// One frame of one radar.
#[derive(Debug, Clone)]
pub struct Example {
    /// What the radar measured.
    scan: Scan,
    /// What the simulation knows: the number of each cell's class.
    mask: Vec<u8>,
}

impl Example {
    /// A scan with the number of each cell's class, all of them known ones.
    pub(crate) fn new(scan: Scan, mask: Vec<u8>) -> Example {
        Example { scan, mask }
    }

    /// Reads a frame with its mask.
    ///
    /// # Errors
    /// Returns the errors of [`Source::points`] and [`Source::mask`], and `BadInput` for a number of no class.
    pub fn read(source: &Source, kind: GridKind) -> Result<Example> {
        let scan = Scan::new(&source.points(kind)?);
        let (mask, path) = source.mask(kind)?;
        check_classes(&mask).map_err(|e| e.in_file(&path))?;
        Ok(Example { scan, mask })
    }

    /// What a network sees of it, moved.
    pub fn features(&self, input: Input, scale: usize, moved: &Move) -> Features {
        Features::new(input, &moved.scan(&self.scan), scale)
    }

    /// What it is judged by, moved in the same way.
    pub fn labels(&self, classes: &Classes, scale: usize, moved: &Move) -> Labels {
        let mask = moved.mask(&self.scan.grid, &self.mask);
        Labels::of(classes, &self.scan.grid, &mask, scale)
    }

    /// The objects that it holds, moved in the same way.
    pub fn objects(&self, classes: &Classes, moved: &Move) -> Objects {
        Objects::new(classes, &self.scan.grid, &moved.mask(&self.scan.grid, &self.mask))
    }
}

/// What is divided among training, validation and test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Whole runs, or whole scenes of datasets: no scene is in two sets.
    Runs,
    /// Blocks of successive frames: neighbouring blocks of a scene may be in different sets.
    Blocks,
    /// The split in the recipe of the dataset.
    Dataset,
}

impl Split {
    /// What it is called in sentences.
    pub fn words(self) -> &'static str {
        match self {
            Split::Runs => "whole runs and scenes",
            Split::Blocks => "blocks of frames",
            Split::Dataset => "their dataset's own split",
        }
    }
}

/// Places of examples in the three sets.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sets {
    /// What is learned: 64 of 100.
    pub training: Vec<usize>,
    /// By which the best epoch is chosen: 16 of 100.
    pub validation: Vec<usize>,
    /// What nothing was chosen by: 20 of 100.
    pub test: Vec<usize>,
}

/// Shares frames out 64 : 16 : 20, as the seed says, or as their dataset says; `block` is the number of frames of a block.
///
/// # Errors
/// Returns `BadInput` if there are fewer than three scenes or blocks, or if a dataset leaves a set without frames.
pub fn split(frames: &[Source], how: Split, block: usize, seed: u32) -> Result<Sets> {
    if how == Split::Dataset {
        return as_the_dataset_says(frames);
    }
    let scenes: Vec<usize> = frames.iter().map(|f| f.scene).collect();
    shared_out(&scenes, how, block, seed)
}

fn as_the_dataset_says(frames: &[Source]) -> Result<Sets> {
    let set = |name: &str| -> Result<Vec<usize>> {
        let held = |(place, f): (usize, &Source)| (f.split.as_deref() == Some(name)).then_some(place);
        let places: Vec<usize> = frames.iter().enumerate().filter_map(held).collect();
        if places.is_empty() {
            let bad =
                BadInput::new(format!("the set {name} has no frames")).key("data.split").value("dataset");
            let remedy = "give a dataset whose recipe has [split] with train, validation and test, or split = \"runs\"";
            return Err(bad.remedy(remedy).into());
        }
        Ok(places)
    };
    Ok(Sets { training: set("train")?, validation: set("validation")?, test: set("test")? })
}

/// `runs` gives the scene of each example.
fn shared_out(runs: &[usize], how: Split, block: usize, seed: u32) -> Result<Sets> {
    let mut units: Vec<Vec<usize>> = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        let full = how == Split::Blocks && units.last().is_some_and(|u| u.len() >= block);
        match units.last_mut().filter(|u| !full && runs[u[0]] == *run) {
            Some(unit) => unit.push(place),
            None => units.push(vec![place]),
        }
    }
    if units.len() < 3 {
        let (what, remedy) = match how {
            Split::Blocks => ("blocks", "give more runs, or a smaller block_frames"),
            _ => ("runs or scenes", "give more runs, or split = \"blocks\""),
        };
        let bad = BadInput::new(format!("there are too few {what} for training, validation and test"));
        return Err(bad.key("data.runs").value(units.len()).allowed("3 or more").remedy(remedy).into());
    }
    shuffle(&mut units, &mut Draws::new(seed, SPLIT_STREAM));
    let share = |part: f64| ((units.len() as f64 * part).round() as usize).max(1);
    let (test, validation) = (share(0.2), share(0.16));
    let set = |units: &[Vec<usize>]| {
        let mut places: Vec<usize> = units.concat();
        places.sort_unstable();
        places
    };
    Ok(Sets {
        test: set(&units[..test]),
        validation: set(&units[test..test + validation]),
        training: set(&units[test + validation..]),
    })
}

/// The stream of draws that shares examples out. Weights have the streams from 1 on, orders of epochs those from 65536 on.
const SPLIT_STREAM: u32 = u32::MAX;

/// Brings a list into an order at random (Fisher and Yates).
pub fn shuffle<T>(list: &mut [T], draws: &mut Draws) {
    for k in (1..list.len()).rev() {
        list.swap(k, (draws.uniform() * (k + 1) as f64) as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::sources;
    use catseye::detect::grid::PointGrid;
    use catseye::formats::npy;
    use std::path::PathBuf;

    fn load(folders: &[PathBuf], kind: GridKind) -> Result<Vec<Example>> {
        sources(folders, kind)?.iter().map(|s| Example::read(s, kind)).collect()
    }

    const SMALL: Grid = Grid { rows: 3, columns: 5, ahead_m: 30.0, across_m: 50.0 };

    fn classes(names: &[&str]) -> Result<Classes> {
        Classes::named(&names.iter().map(|n| n.to_string()).collect::<Vec<_>>())
    }

    /// Two points in one cell and one in its neighbour, joined by a scale of 2.
    #[test]
    fn features_by_hand() {
        let zero = vec![0f32; 15];
        let mut g = PointGrid {
            grid: SMALL,
            count: zero.clone(),
            amplitude: zero.clone(),
            range_m: zero.clone(),
            azimuth_rad: zero,
        };
        for (cell, n, a, r, phi) in [(0, 2.0, 0.5, 10.0, 0.3), (6, 1.0, 1.0, 16.0, -0.3)] {
            (g.count[cell], g.amplitude[cell], g.range_m[cell], g.azimuth_rad[cell]) = (n, a, r, phi);
        }
        let g = Scan::new(&g);
        let f = Features::new(Input::C4, &g, 2);
        assert_eq!(f.shape(), [4, 2, 3]);
        let near =
            |at: usize, wanted: f64| assert!((f64::from(f.values()[at]) - wanted).abs() < 1e-6, "{at}");
        near(0, 0.75);
        near(6, 1.0);
        near(12, 12.0 / 30f64.hypot(25.0));
        near(18, 0.1 / FRAC_PI_2);
        assert_eq!(f.values().iter().filter(|v| **v != 0.0).count(), 4);
        assert_eq!(Features::new(Input::B, &g, 1).values().iter().sum::<f32>(), 2.0);
        assert_eq!(Features::new(Input::A, &g, 1).values()[6], 1.0);
        assert_eq!(Features::new(Input::C2, &g, 2).values()[0], 0.75);
    }

    #[test]
    fn labels_by_hand() {
        let all = classes(&["undefined", "lane", "vehicle", "guard rail"]).unwrap();
        #[rustfmt::skip]
        let mask = [
            1, 1,  0, 3,  2,
            1, 0,  1, 1,  1,
            2, 2,  1, 0,  4,
        ];
        let l = Labels::new(&all, &SMALL, &mask, 2).unwrap();
        assert_eq!(l.places(), [1, 3, 1, 2, 0, 0]);
        // Without rails a cell with one is undefined.
        let lanes = classes(&["undefined", "lane"]).unwrap();
        assert_eq!(Labels::new(&lanes, &SMALL, &mask, 2).unwrap().places(), [1, 0, 1, 0, 0, 0]);
    }

    /// A run of one frame, with these parts.
    fn run(grid: Option<(&[usize], f32)>, mask: Option<(&[usize], u8)>) -> tempfile::TempDir {
        let t = tempfile::tempdir().unwrap();
        let frame = t.path().join("frame_000000");
        std::fs::create_dir(&frame).unwrap();
        if let Some((shape, value)) = grid {
            let data = vec![value; shape.iter().product()];
            npy::write(frame.join("grid_road.npy"), shape, &data).unwrap();
        }
        if let Some((shape, value)) = mask {
            let data = vec![value; shape.iter().product()];
            npy::write(frame.join("mask_road.npy"), shape, &data).unwrap();
        }
        t
    }

    #[test]
    fn wrong_runs_are_refused_in_one_line() {
        let (whole, cells): (&[usize], &[usize]) = (&[4, 450, 300], &[450, 300]);
        let all = classes(&["undefined", "lane"]).unwrap();
        let read = |t: &tempfile::TempDir| load(&[t.path().to_path_buf()], GridKind::Road);
        let fine = read(&run(Some((whole, 0.0)), Some((cells, 1)))).unwrap();
        let features = fine[0].features(Input::A, 4, &Move::NONE);
        assert_eq!((fine.len(), features.shape()), (1, [1, 113, 75]));
        assert_eq!(fine[0].labels(&all, 4, &Move::NONE).places().len(), 113 * 75);
        for (made, words) in [
            (run(None, None), "masks = false: the run has no masks; allowed: true; set masks = true"),
            (run(Some((whole, 0.0)), None), "the run has no masks"),
            (
                run(Some((&[4, 10, 300], 0.0)), None),
                "shape = [4, 10, 300]: the grid has another size; allowed: [4, 450, 300]",
            ),
            (run(Some((whole, f32::NAN)), None), "NaN or infinite value"),
            (
                run(Some((whole, 0.0)), Some((&[300, 450], 0))),
                "shape = [300, 450]: the grid has another size",
            ),
            (
                run(Some((whole, 0.0)), Some((cells, 9))),
                "class = 9: is not the number of a class; allowed: 0 to 6",
            ),
            (tempfile::tempdir().unwrap(), "contains no frames"),
        ] {
            let e = read(&made).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(words), "{text}");
            assert!(text.contains(made.path().file_name().unwrap().to_str().unwrap()), "{text}");
        }
        let gone = load(&["nowhere".into()], GridKind::Road).unwrap_err().to_string();
        assert!(gone.contains("nowhere: is not the folder of a run or a dataset"), "{gone}");
    }

    #[test]
    fn sets_are_shares_of_whole_units() {
        // 25 runs of 4 frames.
        let runs: Vec<usize> = (0..100).map(|k| k / 4).collect();
        let s = shared_out(&runs, Split::Runs, 1, 3).unwrap();
        assert_eq!((s.training.len(), s.validation.len(), s.test.len()), (64, 16, 20));
        let mut all = [s.training.clone(), s.validation.clone(), s.test.clone()].concat();
        all.sort_unstable();
        assert_eq!(all, (0..100).collect::<Vec<_>>());
        let of = |set: &[usize]| set.iter().map(|p| runs[*p]).collect::<std::collections::BTreeSet<_>>();
        assert!(of(&s.training).is_disjoint(&of(&s.test)) && of(&s.training).is_disjoint(&of(&s.validation)));
        assert_eq!(s, shared_out(&runs, Split::Runs, 1, 3).unwrap());
        assert_ne!(s, shared_out(&runs, Split::Runs, 1, 4).unwrap());
        // One run of 12 frames in blocks of 4: three units.
        let s = shared_out(&[0; 12], Split::Blocks, 4, 1).unwrap();
        assert_eq!((s.training.len(), s.validation.len(), s.test.len()), (4, 4, 4));
        assert_eq!(s.test[3] - s.test[0], 3);
        let e = shared_out(&[0, 0, 1], Split::Runs, 1, 1).unwrap_err().to_string();
        assert!(e.contains("data.runs = 2") && e.contains("split = \"blocks\""), "{e}");
    }
}
