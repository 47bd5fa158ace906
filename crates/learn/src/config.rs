//! A training as its TOML file says it.

use crate::augment::Augment;
use crate::data::{Classes, GridKind, Input, Split};
use crate::segnet::Shape;
use catseye::base::error::{Error, Result};
use catseye::formats::stage::sha256_of_bytes;
use catseye::scene::toml_file::{At, Document, RangeText, read_text};
use serde::Deserialize;
use std::fmt::Display;
use std::ops::RangeBounds;
use std::path::{Path, PathBuf};

/// A training: the network, how it learns and from what.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The network.
    pub network: Network,
    /// How it learns.
    pub training: Training,
    /// What it learns from.
    pub data: Data,
    /// The text of the file.
    #[serde(skip)]
    pub text: String,
}

/// Kinds of networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Encoders and decoders with unpooling.
    Segnet,
}

/// The table `[network]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Network {
    /// Kind of the network.
    pub kind: Kind,
    /// Number of encoders and of decoders, 1 to 6.
    pub layers: At<usize>,
    /// Channels between them, 1 to 512.
    pub channels: At<usize>,
    /// Width of the square kernels, cells, odd, 1 to 15.
    pub kernel: At<usize>,
    /// Planes of the grid that it sees.
    pub input: Input,
}

/// The table `[training]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Largest number of passes over the training set.
    pub epochs: At<usize>,
    /// Number of grids in a batch.
    pub batch: At<usize>,
    /// Learning rate of Adam.
    #[serde(default = "rate")]
    pub rate: At<f64>,
    /// Seed of the first weights, of the sets and of the order of the batches.
    #[serde(default)]
    pub seed: u32,
    /// The training ends after so many epochs without a better mean F1 of the validation set.
    #[serde(default = "patience")]
    pub patience: At<usize>,
    /// Classes are weighted with their share of cells to the power of minus this, 0 to 1: 0 weighs all cells the same, 1 all classes.
    #[serde(default = "balance")]
    pub balance: At<f64>,
    /// How pictures are moved before they are learned.
    pub augment: Option<At<Augment>>,
}

/// The table `[data]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Data {
    /// Which grid is learned.
    pub grid: GridKind,
    /// Folders of runs and datasets, relative to that of the file; once read, as they can be opened.
    pub runs: Vec<At<String>>,
    /// So many rows and columns become one.
    #[serde(default = "one")]
    pub scale: At<usize>,
    /// Names of the classes, "undefined" first.
    pub classes: At<Vec<String>>,
    /// What is shared out among the sets.
    #[serde(default = "runs")]
    pub split: Split,
    /// Number of frames in a block.
    #[serde(default = "block_frames")]
    pub block_frames: At<usize>,
}

fn rate() -> At<f64> {
    1e-3.into()
}

fn patience() -> At<usize> {
    10.into()
}

fn balance() -> At<f64> {
    0.5.into()
}

fn one() -> At<usize> {
    1.into()
}

fn runs() -> Split {
    Split::Runs
}

fn block_frames() -> At<usize> {
    5.into()
}

impl Config {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// Returns `BadInput` with line, key and value for what is not TOML, an unknown or missing key, or a value out of its range.
    pub fn read(path: &Path) -> Result<Config> {
        let text = read_text(path)?;
        let doc = Document::parse(path, &text)?;
        let mut config: Config = doc.read()?;
        config.check(&doc)?;
        for run in &mut config.data.runs {
            run.value = path.parent().unwrap_or(Path::new("")).join(&run.value).display().to_string();
        }
        config.text = text;
        Ok(config)
    }

    fn check(&self, doc: &Document<'_>) -> Result<()> {
        let Config { network: n, training: t, data: d, .. } = self;
        within(doc, &n.layers, 1..=6)?;
        within(doc, &n.channels, 1..=512)?;
        within(doc, &n.kernel, 1..=15)?;
        if n.kernel.value.is_multiple_of(2) {
            let bad = doc.bad(&n.kernel.span, "is even, and such a kernel has no middle");
            return Err(bad.allowed("1, 3, 5 and so on to 15").remedy("give an odd number").into());
        }
        within(doc, &t.epochs, 1..=100_000)?;
        within(doc, &t.batch, 1..=4_096)?;
        within(doc, &t.patience, 1..=100_000)?;
        within(doc, &t.rate, 1e-8..=1.0)?;
        within(doc, &t.balance, 0.0..=1.0)?;
        if let Some(a) = &t.augment
            && let Some((key, value, allowed)) = a.value.wrong(n.input)
        {
            let mut bad = doc.bad(&a.span, format!("training.augment.{key} cannot be used"));
            bad.value = Some(format!("{key} = {value}"));
            return Err(bad.allowed(allowed).remedy("change it or take it out").into());
        }
        within(doc, &d.scale, 1..=64)?;
        within(doc, &d.block_frames, 1..=100_000)?;
        self.classes().map(|_| ()).map_err(|e| match e {
            Error::Input(b) => {
                let place = doc.bad(&d.classes.span, "");
                let value = b.value.clone();
                let mut placed = b.placed(place);
                placed.value = value.or(placed.value);
                placed.into()
            }
            e => e,
        })
    }

    /// The classes.
    ///
    /// # Errors
    /// Returns the errors of [`Classes::named`].
    pub fn classes(&self) -> Result<Classes> {
        Classes::named(&self.data.classes.value)
    }

    /// Folders of the runs.
    pub fn runs(&self) -> Vec<PathBuf> {
        self.data.runs.iter().map(|r| PathBuf::from(&r.value)).collect()
    }

    /// The size of the network.
    pub fn shape(&self) -> Shape {
        let n = &self.network;
        Shape {
            layers: n.layers.value,
            channels: n.channels.value,
            kernel: n.kernel.value,
            planes: n.input.planes(),
            classes: self.data.classes.value.len(),
        }
    }

    /// What tells one training from another: the text and where its runs lie.
    pub fn identity(&self) -> String {
        sha256_of_bytes(format!("{}\n{:?}", self.text, self.runs()).as_bytes())
    }
}

fn within<T, R>(doc: &Document<'_>, at: &At<T>, range: R) -> Result<()>
where
    T: PartialOrd + Copy + Display,
    R: RangeBounds<T> + RangeText,
{
    doc.in_range(at, range, "give a value in this range").map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
[network]
kind = "segnet"
layers = 2
channels = 8
kernel = 7
input = "A"

[training]
epochs = 3
batch = 4

[data]
grid = "road"
runs = ["a", "b"]
classes = ["undefined", "lane"]
"#;

    fn read(text: &str) -> Result<Config> {
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("training.toml");
        std::fs::write(&path, text).unwrap();
        Config::read(&path)
    }

    #[test]
    fn a_file_is_read_and_wrong_values_are_placed() {
        let c = read(TEXT).unwrap();
        assert_eq!((c.training.rate.value, c.training.patience.value, c.data.scale.value), (1e-3, 10, 1));
        assert!(c.runs()[1].is_absolute() && c.runs()[1].ends_with("b"));
        assert_eq!(c.shape(), Shape { layers: 2, channels: 8, kernel: 7, planes: 1, classes: 2 });
        for (from, to, words) in [
            (
                "layers = 2",
                "layers = 7",
                "training.toml:4: network.layers = 7: is out of range; allowed: 1..=6",
            ),
            ("kernel = 7", "kernel = 4", "network.kernel = 4: is even"),
            ("batch = 4", "batch = 4\nrat = 1", "did you mean 'rate'?"),
            ("\"A\"", "\"D\"", "allowed: B, A, C2, C4"),
            ("\"lane\"", "\"lan\"", "data.classes = \"lan\": is no class"),
            ("\"road\"", "\"rode\"", "allowed: road, markers"),
            ("kind = \"segnet\"\n", "", "network.kind: is missing"),
        ] {
            let e = read(&TEXT.replace(from, to)).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(words), "{text}");
        }
    }
}
