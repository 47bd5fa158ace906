//! The table `[lane]` of a scenario file, and the methods with its settings.

use crate::trial::context::settings;
use crate::trial::method::Method;
use crate::trial::ready::LaneMethod;
use crate::trial::{camera_fusion, hd_map, markers, range_doppler, road_shape, segmentation, signature, uwb};
use catseye::base::error::{BadInput, Error, Result};
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

/// The table `[lane]` of a scenario file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LaneTable {
    /// Number of drives, each with a different seed. Default 1.
    pub runs: Option<u32>,
    /// Settings of the method uwb.
    pub uwb: uwb::Settings,
    /// Settings of the method markers.
    pub markers: markers::MarkersOptions,
    /// Settings of the method range-doppler.
    pub range_doppler: range_doppler::Settings,
    /// Settings of the method signature.
    pub signature: signature::Settings,
    /// Settings of the method road-shape.
    pub road_shape: road_shape::RoadShapeOptions,
    /// Settings of the method hd-map.
    pub hd_map: hd_map::Settings,
    /// Settings of the method camera-fusion.
    pub camera_fusion: camera_fusion::CameraFusionOptions,
    /// Settings of the method segmentation, which needs a build with the feature `learn`.
    pub segmentation: segmentation::SegmentationOptions,
}

impl LaneTable {
    /// Reads the table of a scenario file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, or for keys and values that are unknown or not allowed.
    pub fn load(path: &Path) -> Result<LaneTable> {
        let table: LaneTable = settings(path)?;
        let LaneTable { uwb, markers, range_doppler, signature, .. } = &table;
        let LaneTable { road_shape, hd_map, camera_fusion, segmentation, .. } = &table;
        let first = [uwb.check(), markers.check_in_scenario(), range_doppler.check(), signature.check()];
        let rest =
            [road_shape.check(), hd_map.check(), camera_fusion.check(), segmentation.check_in_scenario()];
        first.into_iter().chain(rest).collect::<Result<()>>().map_err(|e| match e {
            Error::Input(b) => BadInput { file: b.file.clone().or(Some(path.into())), ..*b }.into(),
            e => e,
        })?;
        match table.runs {
            Some(n) if !(1..=10_000).contains(&n) => {
                let bad = BadInput::new("is out of range").file(path).key("lane.runs").value(n);
                Err(bad.allowed("1..=10000").into())
            }
            _ => Ok(table),
        }
    }

    /// A method with its settings.
    pub fn method(&self, method: Method) -> &dyn LaneMethod {
        match method {
            Method::Uwb => &self.uwb,
            Method::Markers => &self.markers,
            Method::RangeDoppler => &self.range_doppler,
            Method::Signature => &self.signature,
            Method::RoadShape => &self.road_shape,
            Method::HdMap => &self.hd_map,
            Method::CameraFusion => &self.camera_fusion,
            Method::Segmentation => &self.segmentation,
        }
    }
}

/// JSON schemas of radar and scenario files including the table `[lane]`: (file name in `schema/`, text).
pub fn schemas() -> [(&'static str, String); 2] {
    catseye::scene::scenario::schemas(|g| g.subschema_for::<LaneTable>())
}
