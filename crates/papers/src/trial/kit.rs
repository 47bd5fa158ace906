//! Common tools of the lane methods' trials, for drives, tables, values and pictures.

pub use crate::trial::context::TrialContext;
pub use crate::trial::drive::{Drive, Level, lane_point, mount, own_alone, point_radar};
pub use crate::trial::pictures::{DOT, Draw, FOUND, OTHER, SEEN, TRUE, lanes_chart};
pub use crate::trial::ready::{LaneMethod, ReadyMethod, chirp_radar, needed, no_radar};
pub use crate::trial::report::{Row, Rows, Sheet, Step, Trial, common_rows, fixed};
pub use crate::trial::runner::{Looks, Now, drive_through, one_look};
pub use crate::trial::sensors::{Bus, BusSensor, OwnedInput, look_of};
pub use crate::trial::stats::{draws, mean, over_runs, rms, timed};
pub use catseye::base::error::{BadInput, Error, Result};
pub use catseye::base::rng::Draws;
pub use catseye::road::labels::RoadTruth;
pub use catseye::road::plan::ScenePlan;
pub use catseye::road::scene_toml;
pub use catseye::road::site::Site;
pub use catseye::scene::radar::Radar;
pub use catseye::scene::scenario::{Scenario, SceneSource};
pub use catseye::scene::waveform::Waveform;
pub use catseye::simulate::Frame;
pub use catseye_lane::limits;
pub use catseye_lane::limits::LEAVE_OUT;
pub use catseye_lane::score::TrueLanes;
pub use catseye_lane::{LaneError, LaneEstimate, LaneEstimator, LanePoint, Measured, SensorInput};
pub use catseye_plot::{
    Axis, Chart, ColourMap, Layer, Mark, Pen, Picture, Rgb, Scale, Symbol, class_colour, curve_pen,
    finite_range, heat_map, noise_scale,
};
pub use glam::{DVec2, DVec3};
pub use schemars::JsonSchema;
pub use serde::{Deserialize, Serialize};
