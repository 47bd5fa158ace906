//! A training as its TOML file says it.

use crate::augment::Augment;
use crate::class_aim::Judged;
use crate::classes::Classes;
use crate::data::{GridKind, Split};
use crate::detection::Detected;
use crate::network::{Network, NetworkTable};
use crate::task::Verdict;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::sha256_of_bytes;
use catseye::scene::toml_file::{At, Document, read_text};
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A training: the network, how it learns and from what.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The network.
    pub network: Network,
    /// How it learns.
    pub training: Training,
    /// What it learns from.
    pub data: Data,
    /// The text of the file.
    pub text: String,
}

/// A training file: the network, its training and its data.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye training")]
struct Tables {
    /// The network.
    network: NetworkTable,
    /// How the network is trained.
    training: Training,
    /// What the network is trained on.
    data: Data,
}

/// JSON schema of the file: (file name in `schema/`, text).
pub fn schema() -> (&'static str, String) {
    let schema = schemars::schema_for!(Tables);
    ("training.schema.json", serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n")
}

/// How the network is trained.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Maximum number of passes over the training set.
    #[schemars(range(min = 1, max = 100_000))]
    pub epochs: At<usize>,
    /// Number of frames in a batch.
    #[schemars(range(min = 1, max = 4_096))]
    pub batch: At<usize>,
    /// Learning rate of Adam.
    #[serde(default = "rate")]
    #[schemars(range(min = 1e-8, max = 1.0))]
    pub rate: At<f64>,
    /// Seed of the initial weights, of the sets and of the order of the batches; default 0.
    #[serde(default)]
    pub seed: At<u32>,
    /// Number of epochs without a better mean score of the validation set after which the training ends.
    #[serde(default = "patience")]
    #[schemars(range(min = 1, max = 100_000))]
    pub patience: At<usize>,
    /// Exponent of the class weights: a class is weighted with its share of cells to the power of minus this. 0 weights all cells
    /// equally, 1 all classes.
    #[serde(default = "balance")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub balance: At<f64>,
    /// Random changes of the examples, new in each epoch; default none.
    pub augment: Option<At<Augment>>,
}

/// What the network is trained on.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Data {
    /// Grid that the network is trained on; required by networks of grids, and not allowed for networks of points.
    pub grid: Option<At<GridKind>>,
    /// Folders of runs and datasets, relative to the file.
    pub runs: Vec<At<String>>,
    /// Number of rows and columns of the grid that are combined into one; for grids only, default 1.
    #[schemars(range(min = 1, max = 64))]
    pub scale: Option<At<usize>>,
    /// Names of the classes: for grids "undefined" first, for points "others" first.
    pub classes: At<Vec<String>>,
    /// What is divided among training, validation and test; default "runs".
    #[serde(default = "runs")]
    pub split: Split,
    /// "blocks": number of frames in a block.
    #[serde(default = "block_frames")]
    #[schemars(range(min = 1, max = 100_000))]
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
        Config::parse(path, read_text(path)?)
    }

    /// Checks the text of a file at `path`, which errors name and to whose folder runs are relative.
    ///
    /// # Errors
    /// Returns the errors of [`Config::read`] but for those of the file itself.
    pub fn parse(path: &Path, text: String) -> Result<Config> {
        let doc = Document::parse(path, &text)?;
        let Tables { network, training, data } = doc.read()?;
        let mut config = Config { network: Network::of(&doc, network)?, training, data, text: String::new() };
        config.check(&doc)?;
        for run in &mut config.data.runs {
            run.value = path.parent().unwrap_or(Path::new("")).join(&run.value).display().to_string();
        }
        config.text = text;
        Ok(config)
    }

    fn check(&self, doc: &Document<'_>) -> Result<()> {
        let Config { network, training: t, data: d, .. } = self;
        network.check(doc)?;
        let spans = [d.grid.as_ref().map(|g| &g.span), d.scale.as_ref().map(|s| &s.span)];
        match (network, spans.into_iter().flatten().next()) {
            (Network::Points(_), Some(span)) => {
                let bad = doc.bad(span, "applies to networks of grids, and this network learns points");
                return Err(bad.remedy("remove it").into());
            }
            (Network::Grids(_) | Network::Objects(_), _) if d.grid.is_none() => {
                let bad = doc.bad(&(0..0), "is missing").key("data.grid").allowed("road, markers");
                return Err(bad.remedy("choose the grid that the network learns").into());
            }
            _ => {}
        }
        let of_points = matches!(network, Network::Points(_));
        let wrong = |a: &Augment| match a.noise {
            0 => a.wrong(network.fixed()),
            n if of_points => {
                Some(("noise", n.to_string(), "0, because noise points are added only to grids"))
            }
            _ => a.wrong(network.fixed()),
        };
        if let Some(a) = &t.augment
            && let Some((key, value, allowed)) = wrong(&a.value)
        {
            let mut bad = doc.bad(&a.span, format!("training.augment.{key} cannot be used"));
            bad.value = Some(format!("{key} = {value}"));
            return Err(bad.allowed(allowed).remedy("change it or remove it").into());
        }
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
    /// Returns the errors of [`Classes::named`], [`Classes::of_objects`] or [`Classes::of_points`].
    pub fn classes(&self) -> Result<Classes> {
        match self.network {
            Network::Grids(_) => Classes::named(&self.data.classes.value),
            Network::Objects(_) => Classes::of_objects(&self.data.classes.value),
            Network::Points(_) => Classes::of_points(&self.data.classes.value),
        }
    }

    /// Names of the classes that have figures, and what these are called: F1, or the average precision at an intersection over union of 0.5
    /// for the classes of a detector that have objects.
    pub fn figures(&self) -> (Vec<String>, &'static str) {
        let names = &self.data.classes.value;
        match self.network {
            Network::Objects(_) => (names.iter().skip(1).cloned().collect(), Detected::FIGURE),
            Network::Grids(_) | Network::Points(_) => (names.clone(), Judged::FIGURE),
        }
    }

    /// Which grid a network of grids learns.
    ///
    /// # Errors
    /// Returns `BadInput` if none is given.
    pub fn grid(&self) -> Result<GridKind> {
        let missing = || BadInput::new("is missing").key("data.grid").allowed("road, markers");
        self.data.grid.as_ref().map(|g| g.value).ok_or_else(|| missing().into())
    }

    /// Folders of the runs.
    pub fn runs(&self) -> Vec<PathBuf> {
        self.data.runs.iter().map(|r| PathBuf::from(&r.value)).collect()
    }

    /// The same training with another seed, in its text as well.
    ///
    /// # Errors
    /// Returns an error if the text has no place for a seed, which no text has that was read.
    pub fn with_seed(&self, seed: u32) -> Result<Config> {
        let mut config = self.clone();
        let given = &self.training.seed.span;
        config.text = if given.is_empty() {
            // Before the key epochs, which every training has.
            let value = self.training.epochs.span.start;
            let key = self.text.get(..value).and_then(|t| t.rfind("epochs"));
            let key = key.ok_or_else(|| {
                Error::Failed("the key epochs is not found, before which the seed is written".into())
            })?;
            let alone = self.text[..key].rsplit('\n').next().is_some_and(|line| line.trim().is_empty());
            let end = if alone { "\n" } else { ", " };
            format!("{}seed = {seed}{end}{}", &self.text[..key], &self.text[key..])
        } else {
            format!("{}{seed}{}", &self.text[..given.start], &self.text[given.end..])
        };
        config.training.seed.value = seed;
        Ok(config)
    }

    /// What tells one training from another: the text and where its runs lie.
    pub fn identity(&self) -> String {
        sha256_of_bytes(format!("{}\n{:?}", self.text, self.runs()).as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Step;
    use crate::segnet::Shape;

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
    fn the_committed_schema_is_that_of_the_code() {
        let (name, text) = schema();
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../schema")).join(name);
        if std::env::var_os("CATSEYE_WRITE_SCHEMA").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(committed == text, "{name} is out of date: run this test with CATSEYE_WRITE_SCHEMA=1");
    }

    #[test]
    fn a_file_is_read_and_wrong_values_are_placed() {
        let c = read(TEXT).unwrap();
        assert_eq!(
            (c.training.rate.value, c.training.patience.value, c.data.scale.is_none()),
            (1e-3, 10, true)
        );
        assert!(c.runs()[1].is_absolute() && c.runs()[1].ends_with("b"));
        let Network::Grids(n) = &c.network else { panic!("{:?}", c.network) };
        assert_eq!(n.shape(2), Shape { layers: 2, channels: 8, kernel: 7, planes: 1, classes: 2 });
        for (from, to, words) in [
            (
                "layers = 2",
                "layers = 7",
                "training.toml:4: network.layers = 7: is out of range; allowed: 1..=6",
            ),
            ("kernel = 7", "kernel = 4", "network.kernel = 4: is even"),
            ("batch = 4", "batch = 4\nrat = 1", "did you mean 'rate'?"),
            ("\"A\"", "\"D\"", "allowed: B, A, C2, C4"),
            ("\"lane\"", "\"lan\"", "data.classes = \"lan\": is not a class"),
            ("\"road\"", "\"rode\"", "allowed: road, markers"),
            ("kind = \"segnet\"\n", "", "network.kind: is missing"),
            ("kernel = 7\n", "", "training.toml:3: network.kernel: is missing for a segnet"),
            ("grid = \"road\"\n", "", "data.grid: is missing; allowed: road, markers"),
            (
                "kernel = 7",
                "kernel = 7\nsamples = 3",
                "training.toml:7: network.samples = 3: is not a key of a segnet; remove it",
            ),
        ] {
            let e = read(&TEXT.replace(from, to)).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(words), "{text}");
        }
    }

    #[test]
    fn detectors_are_read_and_wrong_values_are_placed() {
        let text = TEXT.replace("segnet", "detector");
        let Network::Objects(n) = read(&text).unwrap().network else { panic!("{text}") };
        assert_eq!((n.layers.value, n.kernel.value), (2, 7));
        for (from, to, words) in [
            ("kernel = 7\n", "", "training.toml:3: network.kernel: is missing for a detector"),
            (
                "layers = 2",
                "layers = 0",
                "training.toml:4: network.layers = 0: is out of range; allowed: 1..=6",
            ),
            (
                "kernel = 7",
                "kernel = 7\ncircles_m = [1]",
                "network.circles_m = [1]: is not a key of a detector",
            ),
            (
                "\"lane\"",
                "\"marker\"",
                "data.classes = \"marker\": is not a class; allowed: undefined, lane, vehicle, guard rail",
            ),
            ("grid = \"road\"\n", "", "data.grid: is missing; allowed: road, markers"),
            ("batch = 4", "batch = 4\naugment = { shift_m = 2 }", "unless network.input is B"),
        ] {
            let e = read(&text.replace(from, to)).unwrap_err();
            let told = e.to_string();
            assert!(e.exit_code() == 2 && told.contains(words), "{told}");
        }
    }

    #[test]
    fn another_seed_stands_in_the_text_too() {
        let inline =
            TEXT.replace("[training]\nepochs = 3\nbatch = 4\n", "training = { epochs = 3, batch = 4 }\n");
        let inline = format!(
            "{}{}",
            "training = { epochs = 3, batch = 4 }",
            inline.replace("training = { epochs = 3, batch = 4 }\n", "")
        );
        for text in [TEXT.to_string(), TEXT.replace("epochs = 3", "epochs = 3\nseed = 123 # as once"), inline]
        {
            let c = read(&text).unwrap();
            let other = c.with_seed(7).unwrap();
            assert_eq!(other.training.seed.value, 7);
            let again = read(&other.text).unwrap();
            assert_eq!((again.training.seed.value, again.training.epochs.value), (7, 3), "{}", other.text);
            // And where one stands already.
            assert_eq!(read(&again.with_seed(12).unwrap().text).unwrap().training.seed.value, 12);
            assert_eq!(again.with_seed(7).unwrap().text, other.text);
        }
    }

    const POINTS: &str = r#"
[network]
kind = "pointnet++"
channels = 8
radii_m = [8, 16]
features = ["counts", "r_min"]
circles_m = [1.0, 2.0]

[training]
epochs = 3
batch = 4

[data]
runs = ["a"]
classes = ["others", "guard rail"]
"#;

    #[test]
    fn networks_of_points_are_read_and_wrong_values_are_placed() {
        let c = read(POINTS).unwrap();
        let Network::Points(n) = &c.network else { panic!("{:?}", c.network) };
        let sight = n.sight();
        assert_eq!((sight.samples, sight.threshold_m, sight.width()), (32, 0.5, 5));
        let step = |radius_m, centroids| Step { radius_m, centroids };
        assert_eq!(sight.steps, [step(8.0, 256), step(16.0, 64)]);
        let turned = POINTS.replace("batch = 4", "batch = 4\naugment = { turn_deg = 5 }");
        assert!(read(&turned).is_ok());
        let flat = POINTS.replace("pointnet++", "pointnet");
        let bare = flat.replace("radii_m = [8, 16]\n", "");
        assert!(matches!(read(&bare).unwrap().network, Network::Points(n) if n.sight().steps.is_empty()));
        for (from, to, words) in [
            ("pointnet++", "pointnets", "network.kind = \"pointnets\": is not one of the choices"),
            ("pointnet++", "pointnet", "network.radii_m = [8, 16]: is not a key of a pointnet; remove it"),
            ("channels = 8", "channels = 8\nkernel = 3", "network.kernel = 3: is not a key of a pointnet++"),
            ("radii_m = [8, 16]\n", "", "network.radii_m: is missing"),
            ("radii_m = [8, 16]\n", "radii_m = [8, 0]\n", "network.radii_m[1] = 0: is out of range"),
            ("radii_m = [8, 16]\n", "radii_m = []\n", "network.radii_m = []: has 0 elements"),
            ("radii_m = [8, 16]\n", "radii_m = [8, nan]\n", "network.radii_m[1] = nan: is out of range"),
            (
                "radii_m = [8, 16]",
                "radii_m = [8, 16]\ncentroids = [9]",
                "network.centroids = [9]: must have the length of radii_m; allowed: 2 numbers",
            ),
            ("radii_m = [8, 16]", "radii_m = [8, 16]\nsamples = 0", "allowed: 1..=512"),
            ("\"r_min\"", "\"r_mid\"", "did you mean 'r_min'?"),
            ("\"r_min\"", "\"counts\"", "names counts twice"),
            ("circles_m = [1.0, 2.0]\n", "", "the features need circles_m, the radii of the circles"),
            ("[\"counts\", \"r_min\"]", "[\"r_min\"]", "network.features has no counts or covariance"),
            (
                "[\"counts\", \"r_min\"]",
                "[\"counts\"]\nr_threshold_m = 1.0",
                "network.r_threshold_m = 1.0: is not used",
            ),
            (
                "batch = 4",
                "batch = 4\naugment = { noise = 9 }",
                "allowed: 0, because noise points are added only to grids",
            ),
            ("channels = 8", "channels = 0", "network.channels = 0: is out of range; allowed: 1..=512"),
            ("runs = ", "grid = \"road\"\nruns = ", "data.grid = \"road\": applies to networks of grids"),
            ("\"others\"", "\"undefined\"", "\"undefined\": is not a class; allowed: others, vehicle"),
            ("\"guard rail\"", "\"lane\"", "\"lane\": is not a class"),
        ] {
            let e = read(&POINTS.replace(from, to)).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(words), "{to}: {text}");
        }
        let strength = turned.replace("\"r_min\"", "\"amplitude\"");
        let text = read(&strength).unwrap_err().to_string();
        assert!(text.contains("turn_deg = 5") && text.contains("neither amplitude nor range_rate"), "{text}");
    }
}
