//! Points as a task: PointNet and PointNet++ give each point of a frame a class.

use crate::augment::Move;
use crate::class_aim::ClassAim;
use crate::classes::Classes;
use crate::cloud::{Cloud, MeasuredPoint, PointFeatures, Sight};
use crate::config::Config;
use crate::data::Labels;
use crate::frame_points::{read_cloud, read_truth};
use crate::network::PointNetwork;
use crate::pointnet::{PointNet, PointShape};
use crate::source::{Source, point_sources};
use crate::task::Task;
use burn::tensor::{Device, Tensor};
use catseye::base::error::Result;
use catseye::road::mask::CellClass;
use std::path::PathBuf;

/// The points of one frame with their classes.
#[derive(Debug, Clone)]
pub struct PointExample {
    cloud: Cloud,
    truth: Vec<CellClass>,
}

/// Classes of points.
pub struct PointTask {
    sight: Sight,
    shape: PointShape,
    classes: Classes,
    aim: ClassAim,
}

impl PointTask {
    /// The task of a training.
    ///
    /// # Errors
    /// Returns the errors of [`Config::classes`].
    pub fn new(config: &Config, network: &PointNetwork) -> Result<PointTask> {
        let (classes, sight) = (config.classes()?, network.sight());
        let shape = PointShape {
            width: sight.width(),
            channels: network.channels.value,
            steps: sight.steps.len(),
            classes: classes.count(),
        };
        Ok(PointTask { sight, shape, aim: ClassAim::new(&classes), classes })
    }

    /// What the network sees of a frame, whose truth is not looked at.
    ///
    /// # Errors
    /// Returns the errors of [`read_cloud`].
    pub fn seen(&self, source: &Source) -> Result<PointFeatures> {
        Ok(PointFeatures::new(&self.sight, &read_cloud(source)?))
    }
}

impl Task for PointTask {
    type Net = PointNet;
    type Example = PointExample;
    type Seen = PointFeatures;
    type Aim = ClassAim;

    fn classes(&self) -> &Classes {
        &self.classes
    }

    fn net(&self, seed: u32, device: &Device) -> PointNet {
        PointNet::new(self.shape, seed, device)
    }

    fn find(&self, folders: &[PathBuf]) -> Result<Vec<Source>> {
        point_sources(folders)
    }

    fn read(&self, source: &Source) -> Result<PointExample> {
        Ok(PointExample { cloud: read_cloud(source)?, truth: read_truth(source)? })
    }

    fn given(&self, example: &PointExample, moved: &Move) -> (PointFeatures, Labels) {
        let kept = moved.places(example.cloud.points.iter().map(|p| p.at_m));
        let point = |(k, at_m): &(usize, _)| MeasuredPoint { at_m: *at_m, ..example.cloud.points[*k] };
        let cloud = Cloud { points: kept.iter().map(point).collect() };
        let labels = Labels::of_points(&self.classes, kept.iter().map(|(k, _)| example.truth[*k]));
        (PointFeatures::new(&self.sight, &cloud), labels)
    }

    fn aim(&self) -> &ClassAim {
        &self.aim
    }

    fn outputs(&self, net: &PointNet, seen: &[&PointFeatures], device: &Device) -> Tensor<2> {
        net.forward(&self.sight, seen, device)
    }

    fn words(&self) -> String {
        let (s, shape) = (&self.sight, &self.shape);
        let list = |names: Vec<String>| names.join(", ");
        let mut text = match s.steps.is_empty() {
            true => format!("A PointNet of {} channels", shape.channels),
            false => format!(
                "A PointNet++ of {} channels and {} levels (radii {} m, at most {} centroids, groups of {} points)",
                shape.channels,
                s.steps.len(),
                list(s.steps.iter().map(|l| l.radius_m.to_string()).collect()),
                list(s.steps.iter().map(|l| l.centroids.to_string()).collect()),
                s.samples
            ),
        };
        text += " that gives each point of a frame a class. It sees the place of each point";
        if !s.features.is_empty() {
            text +=
                &format!(", and of it {}", list(s.features.iter().map(|f| f.name().to_string()).collect()));
        }
        if !s.circles_m.is_empty() {
            text += &format!(" (circles of {} m)", list(s.circles_m.iter().map(f64::to_string).collect()));
        }
        text + "."
    }
}
