//! A training as its TOML file says it.

use crate::augment::Augment;
use crate::cloud::{Feature, Sight, Step};
use crate::data::{Classes, GridKind, Input, Split};
use crate::segnet::Shape;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::sha256_of_bytes;
use catseye::scene::toml_file::{At, Document, RangeText, read_text};
use serde::Deserialize;
use std::fmt::Display;
use std::ops::{Range, RangeBounds};
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

/// The tables of a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tables {
    network: NetworkTable,
    training: Training,
    data: Data,
}

/// Kinds of networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Kind {
    /// Encoders and decoders with unpooling, for grids.
    #[serde(rename = "segnet")]
    Segnet,
    /// Perceptrons for each point and a maximum over the frame.
    #[serde(rename = "pointnet")]
    Pointnet,
    /// The same in groups around centroids, step by step.
    #[serde(rename = "pointnet++")]
    PointnetPlus,
}

impl Kind {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Segnet => "segnet",
            Kind::Pointnet => "pointnet",
            Kind::PointnetPlus => "pointnet++",
        }
    }
}

/// The table `[network]`.
#[derive(Debug, Clone, PartialEq)]
pub enum Network {
    /// `kind = "segnet"`.
    Grids(GridNetwork),
    /// `kind = "pointnet"` or `kind = "pointnet++"`.
    Points(PointNetwork),
}

/// A network of grids.
#[derive(Debug, Clone, PartialEq)]
pub struct GridNetwork {
    /// Number of encoders and of decoders, 1 to 6.
    pub layers: At<usize>,
    /// Channels between them, 1 to 512.
    pub channels: At<usize>,
    /// Width of the square kernels, cells, odd, 1 to 15.
    pub kernel: At<usize>,
    /// Planes of the grid that it sees.
    pub input: Input,
}

impl GridNetwork {
    /// The size of the network for so many classes.
    pub fn shape(&self, classes: usize) -> Shape {
        Shape {
            layers: self.layers.value,
            channels: self.channels.value,
            kernel: self.kernel.value,
            planes: self.input.planes(),
            classes,
        }
    }
}

/// A network of points.
#[derive(Debug, Clone, PartialEq)]
pub struct PointNetwork {
    /// Channels between layers, 1 to 512.
    pub channels: At<usize>,
    /// What it is told of a point beside its place, each at most once.
    pub features: At<Vec<Feature>>,
    /// Radii of the circles in which neighbours are counted, m, 1 to 8 of them.
    pub circles_m: Option<At<Vec<f64>>>,
    /// Points nearer than this are of the same lobe for r_min, m, 0 to 64.
    pub threshold_m: Option<At<f64>>,
    /// Groups of PointNet++; None is PointNet.
    pub groups: Option<Groups>,
}

/// How PointNet++ groups points.
#[derive(Debug, Clone, PartialEq)]
pub struct Groups {
    /// Radius of the groups of each level, m, 1 to 5 of them.
    pub radii_m: At<Vec<f64>>,
    /// Largest number of centroids of a frame at each level.
    pub centroids: At<Vec<usize>>,
    /// Points of a group, 1 to 512.
    pub samples: At<usize>,
}

impl PointNetwork {
    /// What the network sees.
    pub fn sight(&self) -> Sight {
        let pair =
            |(radius_m, centroids): (&f64, &usize)| Step { radius_m: *radius_m, centroids: *centroids };
        let steps = |g: &Groups| g.radii_m.value.iter().zip(&g.centroids.value).map(pair).collect();
        Sight {
            features: self.features.value.clone(),
            circles_m: self.circles_m.as_ref().map(|c| c.value.clone()).unwrap_or_default(),
            threshold_m: self.threshold_m.as_ref().map_or(LOBE_M, |t| t.value),
            steps: self.groups.as_ref().map(steps).unwrap_or_default(),
            samples: self.groups.as_ref().map_or(1, |g| g.samples.value),
        }
    }

    /// What may be turned and shifted with the points, where a feature depends on their places.
    fn fixed(&self) -> Option<&'static str> {
        let fixed = [Feature::Amplitude, Feature::RangeRate];
        self.features.value.iter().any(|f| fixed.contains(f)).then_some(
            "0, unless network.features has neither amplitude nor range_rate, which would not move with the points",
        )
    }
}

/// Points so near to each other are of one lobe, where the file does not say it, m.
const LOBE_M: f64 = 0.5;
/// Centroids of the levels where the file does not say them.
const CENTROIDS: [usize; 5] = [256, 64, 16, 8, 4];
/// Points of a group where the file does not say it.
const SAMPLES: usize = 32;

/// The table `[network]` as it stands in the file, with the keys of all kinds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NetworkTable {
    kind: At<Kind>,
    channels: At<usize>,
    layers: Option<At<usize>>,
    kernel: Option<At<usize>>,
    input: Option<At<Input>>,
    features: Option<At<Vec<Feature>>>,
    circles_m: Option<At<Vec<f64>>>,
    r_threshold_m: Option<At<f64>>,
    radii_m: Option<At<Vec<f64>>>,
    centroids: Option<At<Vec<usize>>>,
    samples: Option<At<usize>>,
}

impl Network {
    /// The network of a table whose keys all belong to its kind.
    fn of(doc: &Document<'_>, t: NetworkTable) -> Result<Network> {
        let kind = t.kind.value;
        let groups = [
            t.radii_m.as_ref().map(|k| &k.span),
            t.centroids.as_ref().map(|k| &k.span),
            t.samples.as_ref().map(|k| &k.span),
        ];
        let grids = [
            t.layers.as_ref().map(|k| &k.span),
            t.kernel.as_ref().map(|k| &k.span),
            t.input.as_ref().map(|k| &k.span),
        ];
        let points = [
            t.features.as_ref().map(|k| &k.span),
            t.circles_m.as_ref().map(|k| &k.span),
            t.r_threshold_m.as_ref().map(|k| &k.span),
        ];
        let foreign = match kind {
            Kind::Segnet => [groups, points].concat(),
            Kind::Pointnet => [groups, grids].concat(),
            Kind::PointnetPlus => grids.to_vec(),
        };
        if let Some(span) = foreign.into_iter().flatten().next() {
            let bad = doc.bad(span, format!("is no key of a {}", kind.name()));
            return Err(bad.remedy("take it out").into());
        }
        let missing = |key: &str| {
            let mut bad = doc.bad(&t.kind.span, format!("is missing for a {}", kind.name()));
            bad.value = None;
            bad.key(format!("network.{key}")).remedy("add it")
        };
        if kind == Kind::Segnet {
            return Ok(Network::Grids(GridNetwork {
                layers: t.layers.ok_or_else(|| missing("layers"))?,
                channels: t.channels,
                kernel: t.kernel.ok_or_else(|| missing("kernel"))?,
                input: t.input.ok_or_else(|| missing("input"))?.value,
            }));
        }
        let groups = match kind {
            Kind::PointnetPlus => {
                let radii_m = t.radii_m.ok_or_else(|| missing("radii_m"))?;
                let usual = || CENTROIDS.iter().copied().take(radii_m.value.len()).collect::<Vec<_>>().into();
                Some(Groups {
                    centroids: t.centroids.unwrap_or_else(usual),
                    samples: t.samples.unwrap_or_else(|| SAMPLES.into()),
                    radii_m,
                })
            }
            _ => None,
        };
        Ok(Network::Points(PointNetwork {
            channels: t.channels,
            features: t.features.unwrap_or_else(|| Vec::new().into()),
            circles_m: t.circles_m,
            threshold_m: t.r_threshold_m,
            groups,
        }))
    }
}

/// The table `[training]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Largest number of passes over the training set.
    pub epochs: At<usize>,
    /// Number of frames in a batch.
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
    /// Which grid is learned; a network of grids needs it, and one of points has none.
    pub grid: Option<At<GridKind>>,
    /// Folders of runs and datasets, relative to that of the file; once read, as they can be opened.
    pub runs: Vec<At<String>>,
    /// So many rows and columns become one; only for grids, where it is 1 unless given.
    pub scale: Option<At<usize>>,
    /// Names of the classes, "undefined" first; of points "others" first.
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
        let fixed = match network {
            Network::Grids(n) => {
                check_grids(doc, n, d)?;
                n.input.fixed()
            }
            Network::Points(n) => {
                check_points(doc, n, d)?;
                n.fixed()
            }
        };
        within(doc, &t.epochs, 1..=100_000)?;
        within(doc, &t.batch, 1..=4_096)?;
        within(doc, &t.patience, 1..=100_000)?;
        within(doc, &t.rate, 1e-8..=1.0)?;
        within(doc, &t.balance, 0.0..=1.0)?;
        if let Some(a) = &t.augment
            && let Some((key, value, allowed)) = a.value.wrong(fixed)
        {
            let mut bad = doc.bad(&a.span, format!("training.augment.{key} cannot be used"));
            bad.value = Some(format!("{key} = {value}"));
            return Err(bad.allowed(allowed).remedy("change it or take it out").into());
        }
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
    /// Returns the errors of [`Classes::named`] or [`Classes::of_points`].
    pub fn classes(&self) -> Result<Classes> {
        match self.network {
            Network::Grids(_) => Classes::named(&self.data.classes.value),
            Network::Points(_) => Classes::of_points(&self.data.classes.value),
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

    /// What tells one training from another: the text and where its runs lie.
    pub fn identity(&self) -> String {
        sha256_of_bytes(format!("{}\n{:?}", self.text, self.runs()).as_bytes())
    }
}

fn check_grids(doc: &Document<'_>, n: &GridNetwork, d: &Data) -> Result<()> {
    within(doc, &n.layers, 1..=6)?;
    within(doc, &n.channels, 1..=512)?;
    within(doc, &n.kernel, 1..=15)?;
    if n.kernel.value.is_multiple_of(2) {
        let bad = doc.bad(&n.kernel.span, "is even, and such a kernel has no middle");
        return Err(bad.allowed("1, 3, 5 and so on to 15").remedy("give an odd number").into());
    }
    if d.grid.is_none() {
        let bad = doc.bad(&(0..0), "is missing").key("data.grid").allowed("road, markers");
        return Err(bad.remedy("say which grid a network of grids learns").into());
    }
    d.scale.as_ref().map_or(Ok(()), |scale| within(doc, scale, 1..=64))
}

fn check_points(doc: &Document<'_>, n: &PointNetwork, d: &Data) -> Result<()> {
    let spans = [d.grid.as_ref().map(|g| &g.span), d.scale.as_ref().map(|s| &s.span)];
    if let Some(span) = spans.into_iter().flatten().next() {
        let bad = doc.bad(span, "belongs to networks of grids, and this one learns points");
        return Err(bad.remedy("take it out").into());
    }
    within(doc, &n.channels, 1..=512)?;
    let features = &n.features.value;
    if let Some(twice) = (1..features.len()).find(|k| features[..*k].contains(&features[*k])) {
        let bad = doc.bad(&n.features.span, format!("names {} twice", features[twice].name()));
        return Err(bad.remedy("name it once").into());
    }
    let has = |wanted: &[Feature]| wanted.iter().any(|f| features.contains(f));
    match (&n.circles_m, has(&[Feature::Counts, Feature::Covariance])) {
        (None, true) => {
            let bad = doc.bad(&n.features.span, "needs the radii of the circles");
            return Err(bad.remedy("add circles_m, as in circles_m = [1.0, 2.0, 4.0]").into());
        }
        (Some(c), false) => return Err(unread(doc, &c.span, "counts or covariance")),
        (Some(c), true) => list(doc, c, 8, "larger than 0 and at most 1000", |r| *r > 0.0 && *r <= 1e3)?,
        (None, false) => {}
    }
    match &n.threshold_m {
        Some(t) if !has(&[Feature::RMin]) => return Err(unread(doc, &t.span, "r_min")),
        Some(t) => within(doc, t, 0.0..=64.0)?,
        None => {}
    }
    let Some(g) = &n.groups else { return Ok(()) };
    list(doc, &g.radii_m, 5, "larger than 0 and at most 1000", |r| *r > 0.0 && *r <= 1e3)?;
    list(doc, &g.centroids, 5, "1 to 4096", |c| (1..=4096).contains(c))?;
    if g.centroids.value.len() != g.radii_m.value.len() {
        let bad = doc.bad(&g.centroids.span, "has another length than radii_m");
        let allowed = format!("{} numbers", g.radii_m.value.len());
        return Err(bad.allowed(allowed).remedy("give one number for each level").into());
    }
    within(doc, &g.samples, 1..=512)
}

/// A key of a feature that is not asked for.
fn unread(doc: &Document<'_>, span: &Range<usize>, feature: &str) -> Error {
    let bad = doc.bad(span, format!("is not used, because network.features has no {feature}"));
    bad.remedy("take it out, or add the feature").into()
}

/// Checks the length and the values of a list.
fn list<T>(
    doc: &Document<'_>,
    at: &At<Vec<T>>,
    most: usize,
    range: &str,
    fits: impl Fn(&T) -> bool,
) -> Result<()> {
    if (1..=most).contains(&at.value.len()) && at.value.iter().all(fits) {
        return Ok(());
    }
    let bad = doc.bad(&at.span, "is no list of such numbers");
    Err(bad.allowed(format!("1 to {most} numbers, each {range}")).remedy("change the list").into())
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
            ("\"lane\"", "\"lan\"", "data.classes = \"lan\": is no class"),
            ("\"road\"", "\"rode\"", "allowed: road, markers"),
            ("kind = \"segnet\"\n", "", "network.kind: is missing"),
            ("kernel = 7\n", "", "training.toml:3: network.kernel: is missing for a segnet"),
            ("grid = \"road\"\n", "", "data.grid: is missing; allowed: road, markers"),
            (
                "kernel = 7",
                "kernel = 7\nsamples = 3",
                "training.toml:7: network.samples = 3: is no key of a segnet; take it out",
            ),
        ] {
            let e = read(&TEXT.replace(from, to)).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(words), "{text}");
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
            ("pointnet++", "pointnet", "network.radii_m = [8, 16]: is no key of a pointnet; take it out"),
            ("channels = 8", "channels = 8\nkernel = 3", "network.kernel = 3: is no key of a pointnet++"),
            ("radii_m = [8, 16]\n", "", "network.radii_m: is missing"),
            ("radii_m = [8, 16]\n", "radii_m = [8, 0]\n", "allowed: 1 to 5 numbers, each larger than 0"),
            ("radii_m = [8, 16]\n", "radii_m = []\n", "network.radii_m = []: is no list"),
            ("radii_m = [8, 16]\n", "radii_m = [8, nan]\n", "is no list of such numbers"),
            (
                "radii_m = [8, 16]",
                "radii_m = [8, 16]\ncentroids = [9]",
                "network.centroids = [9]: has another length than radii_m; allowed: 2 numbers",
            ),
            ("radii_m = [8, 16]", "radii_m = [8, 16]\nsamples = 0", "allowed: 1..=512"),
            ("\"r_min\"", "\"r_mid\"", "did you mean 'r_min'?"),
            ("\"r_min\"", "\"counts\"", "names counts twice"),
            ("circles_m = [1.0, 2.0]\n", "", "needs the radii of the circles"),
            ("[\"counts\", \"r_min\"]", "[\"r_min\"]", "network.features has no counts or covariance"),
            (
                "[\"counts\", \"r_min\"]",
                "[\"counts\"]\nr_threshold_m = 1.0",
                "network.r_threshold_m = 1.0: is not used",
            ),
            ("channels = 8", "channels = 0", "network.channels = 0: is out of range; allowed: 1..=512"),
            ("runs = ", "grid = \"road\"\nruns = ", "data.grid = \"road\": belongs to networks of grids"),
            ("\"others\"", "\"undefined\"", "\"undefined\": is no class; allowed: others, vehicle"),
            ("\"guard rail\"", "\"lane\"", "\"lane\": is no class"),
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
