//! The table `[lane]` of a scenario file, and the methods by it.

use crate::trial::context::{TrialContext, settings};
use crate::trial::drive::Drive;
use crate::trial::method::Method;
use crate::trial::ready::ReadyMethod;
use crate::trial::report::Trial;
use crate::trial::{camera_fusion, hd_map, markers, range_doppler, road_shape, signature, uwb};
use catseye::error::{BadInput, Error, Result};
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

/// The table `[lane]` of a scenario file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LaneTable {
    /// How often the drive is made, each time with another seed. Default 1.
    pub runs: Option<u32>,
    pub uwb: uwb::Settings,
    pub markers: markers::Settings,
    pub range_doppler: range_doppler::Settings,
    pub signature: signature::Settings,
    pub road_shape: road_shape::Settings,
    pub hd_map: hd_map::Settings,
    pub camera_fusion: camera_fusion::Settings,
}

impl LaneTable {
    /// Of a scenario file. Errors: keys and values that are not known or not allowed.
    pub fn load(path: &Path) -> Result<LaneTable> {
        let table: LaneTable = settings(path)?;
        let checked = [
            table.uwb.check(),
            table.markers.check(),
            table.range_doppler.check(),
            table.signature.check(),
            table.road_shape.check(),
            table.hd_map.check(),
            table.camera_fusion.check(),
        ];
        for check in checked {
            check.map_err(|e| match e {
                Error::Input(b) => BadInput { file: b.file.clone().or(Some(path.into())), ..*b }.into(),
                e => e,
            })?;
        }
        if table.runs.is_some_and(|n| !(1..=10_000).contains(&n)) {
            let n = table.runs.unwrap_or(0);
            return Err(BadInput::new("is no number of drives")
                .file(path)
                .key("lane.runs")
                .value(n)
                .allowed("1..=10000")
                .into());
        }
        Ok(table)
    }

    /// The method ready for a drive of a comparison, by variant: one, or one for each choice of sensors and light.
    ///
    /// Errors: what the scenario lacks for it, as bad input.
    pub fn ready_methods(
        &self,
        method: Method,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let only = |ready: ReadyMethod| vec![(String::new(), ready)];
        match method {
            Method::Uwb => uwb::ready_method(given, &self.uwb, drive, run).map(only),
            Method::Markers => markers::ready_method(given, &self.markers, drive, run).map(only),
            Method::RangeDoppler => {
                range_doppler::ready_method(given, &self.range_doppler, drive, run).map(only)
            }
            Method::Signature => signature::ready_method(given, &self.signature, drive, run).map(only),
            Method::RoadShape => road_shape::ready_method(given, &self.road_shape, drive, run)
                .map(|r| vec![("road edges".into(), r)]),
            Method::HdMap => hd_map::ready_method(given, &self.hd_map, drive, run).map(only),
            Method::CameraFusion => camera_fusion::ready_methods(given, &self.camera_fusion, drive, run),
        }
    }

    /// Drives the scenario and lets the method say what it finds.
    pub fn trial(&self, method: Method, given: &TrialContext<'_>) -> Result<Trial> {
        match method {
            Method::Uwb => uwb::run(given, &self.uwb),
            Method::Markers => markers::run(given, &self.markers),
            Method::RangeDoppler => range_doppler::run(given, &self.range_doppler),
            Method::Signature => signature::run(given, &self.signature),
            Method::RoadShape => road_shape::run(given, &self.road_shape),
            Method::HdMap => hd_map::run(given, &self.hd_map),
            Method::CameraFusion => camera_fusion::run(given, &self.camera_fusion),
        }
    }
}

/// JSON schemas of radar and scenario files, the table `[lane]` with them: (file name in `schema/`, text).
pub fn schemas() -> [(&'static str, String); 2] {
    catseye::scene::scenario::schemas(|g| g.subschema_for::<LaneTable>())
}
