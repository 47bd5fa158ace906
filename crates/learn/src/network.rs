//! The table `[network]` of a training: which network learns, how large it is and what it sees.

use crate::cloud::{Feature, Sight, Step};
use crate::scan::Input;
use crate::segnet::Shape;
use catseye::base::error::{Error, Result};
use catseye::scene::toml_file::{At, Document};
use schemars::JsonSchema;
use serde::Deserialize;
use std::ops::Range;

/// Kinds of networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Kind {
    /// Encoders and decoders with unpooling, for grids.
    #[serde(rename = "segnet")]
    Segnet,
    /// The encoders of a segnet, and contours of objects, for grids.
    #[serde(rename = "detector")]
    Detector,
    /// A perceptron for each point and a maximum over the frame, for points.
    #[serde(rename = "pointnet")]
    Pointnet,
    /// The same in groups around centroids, level by level, for points.
    #[serde(rename = "pointnet++")]
    PointnetPlus,
}

impl Kind {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Segnet => "segnet",
            Kind::Detector => "detector",
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
    /// `kind = "detector"`.
    Objects(GridNetwork),
    /// `kind = "pointnet"` or `kind = "pointnet++"`.
    Points(PointNetwork),
}

/// A network of grids.
#[derive(Debug, Clone, PartialEq)]
pub struct GridNetwork {
    /// Number of encoders, and of the decoders of a segnet, 1 to 6.
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

/// The network, with the keys of all kinds of networks.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NetworkTable {
    /// Kind of network.
    kind: At<Kind>,
    /// Number of channels between layers.
    #[schemars(range(min = 1, max = 512))]
    channels: At<usize>,
    /// "segnet" and "detector": number of encoders, and of the decoders of a segnet.
    #[schemars(range(min = 1, max = 6))]
    layers: Option<At<usize>>,
    /// "segnet" and "detector": width of the square kernels, cells; odd.
    #[schemars(range(min = 1, max = 15))]
    kernel: Option<At<usize>>,
    /// "segnet" and "detector": planes of the grid that the network receives.
    input: Option<At<Input>>,
    /// "pointnet" and "pointnet++": features of a point in addition to its position, each at most once.
    features: Option<At<Vec<Feature>>>,
    /// Radii of the circles in which neighbours are counted, m; required by the features counts and covariance.
    #[schemars(length(min = 1, max = 8), inner(range(min = 1e-3, max = 1000.0)))]
    circles_m: Option<At<Vec<f64>>>,
    /// Points nearer than this belong to the same lobe for the feature r_min, m; default 0.5.
    #[schemars(range(min = 0.0, max = 64.0))]
    r_threshold_m: Option<At<f64>>,
    /// "pointnet++": radius of the groups of each level, m.
    #[schemars(length(min = 1, max = 5), inner(range(min = 1e-3, max = 1000.0)))]
    radii_m: Option<At<Vec<f64>>>,
    /// "pointnet++": maximum number of centroids of a frame at each level; default 256, 64, 16, 8, 4.
    #[schemars(length(min = 1, max = 5), inner(range(min = 1, max = 4096)))]
    centroids: Option<At<Vec<usize>>>,
    /// "pointnet++": number of points of a group; default 32.
    #[schemars(range(min = 1, max = 512))]
    samples: Option<At<usize>>,
}

impl Network {
    /// Checks the values of all keys.
    pub(crate) fn check(&self, doc: &Document<'_>) -> Result<()> {
        match self {
            Network::Grids(n) | Network::Objects(n) => check_grids(doc, n),
            Network::Points(n) => check_points(doc, n),
        }
    }

    /// What may be turned and shifted with the points, where something that the network sees depends on their places.
    pub(crate) fn fixed(&self) -> Option<&'static str> {
        match self {
            Network::Grids(n) | Network::Objects(n) => n.input.fixed(),
            Network::Points(n) => n.fixed(),
        }
    }

    /// The network of a table whose keys all belong to its kind.
    pub(crate) fn of(doc: &Document<'_>, t: NetworkTable) -> Result<Network> {
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
            Kind::Segnet | Kind::Detector => [groups, points].concat(),
            Kind::Pointnet => [groups, grids].concat(),
            Kind::PointnetPlus => grids.to_vec(),
        };
        if let Some(span) = foreign.into_iter().flatten().next() {
            let bad = doc.bad(span, format!("is not a key of a {}", kind.name()));
            return Err(bad.remedy("remove it").into());
        }
        let missing = |key: &str| {
            let mut bad = doc.bad(&t.kind.span, format!("is missing for a {}", kind.name()));
            bad.value = None;
            bad.key(format!("network.{key}")).remedy("add it")
        };
        if matches!(kind, Kind::Segnet | Kind::Detector) {
            let grids = GridNetwork {
                layers: t.layers.ok_or_else(|| missing("layers"))?,
                channels: t.channels,
                kernel: t.kernel.ok_or_else(|| missing("kernel"))?,
                input: t.input.ok_or_else(|| missing("input"))?.value,
            };
            return Ok(match kind {
                Kind::Detector => Network::Objects(grids),
                _ => Network::Grids(grids),
            });
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

fn check_grids(doc: &Document<'_>, n: &GridNetwork) -> Result<()> {
    if n.kernel.value.is_multiple_of(2) {
        let bad = doc.bad(&n.kernel.span, "is even, so the kernel has no middle");
        return Err(bad.allowed("1, 3, 5 and so on to 15").remedy("give an odd number").into());
    }
    Ok(())
}

fn check_points(doc: &Document<'_>, n: &PointNetwork) -> Result<()> {
    let features = &n.features.value;
    if let Some(twice) = (1..features.len()).find(|k| features[..*k].contains(&features[*k])) {
        let bad = doc.bad(&n.features.span, format!("names {} twice", features[twice].name()));
        return Err(bad.remedy("name it once").into());
    }
    let has = |wanted: &[Feature]| wanted.iter().any(|f| features.contains(f));
    match (&n.circles_m, has(&[Feature::Counts, Feature::Covariance])) {
        (None, true) => {
            let bad = doc.bad(&n.features.span, "the features need circles_m, the radii of the circles");
            return Err(bad.remedy("add it, as in circles_m = [1.0, 2.0, 4.0]").into());
        }
        (Some(c), false) => return Err(unread(doc, &c.span, "counts or covariance")),
        _ => {}
    }
    if let Some(t) = n.threshold_m.as_ref().filter(|_| !has(&[Feature::RMin])) {
        return Err(unread(doc, &t.span, "r_min"));
    }
    match &n.groups {
        Some(g) if g.centroids.value.len() != g.radii_m.value.len() => {
            let bad = doc.bad(&g.centroids.span, "must have the length of radii_m");
            let allowed = format!("{} numbers", g.radii_m.value.len());
            Err(bad.allowed(allowed).remedy("give one number for each level").into())
        }
        _ => Ok(()),
    }
}

/// A key of a feature that is not asked for.
fn unread(doc: &Document<'_>, span: &Range<usize>, feature: &str) -> Error {
    let bad = doc.bad(span, format!("is not used, because network.features has no {feature}"));
    bad.remedy("remove it, or add the feature").into()
}
