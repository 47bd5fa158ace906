//! The lane methods by their names on the command line.

use catseye::base::error::{BadInput, Result};
use serde::{Deserialize, Serialize};

/// A method of [`catseye_lane`], as on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Impulse radar above metal plates (Kim 2020)
    Uwb,
    /// Rows of markers in the point cloud (Feng 2019, section 5.1)
    Markers,
    /// Position in a marked lane from the range-Doppler map alone (Feng 2019, section 3.6)
    RangeDoppler,
    /// Map of static points, localisation in it, code words (Feng 2019, section 4.3)
    Signature,
    /// Road edges by MUSIC and a clothoid filter (Miyake)
    RoadShape,
    /// Lane numbers from radar tracks and a map (Li 2022)
    HdMap,
    /// Camera in the near range, radar tracks in the far range (Sangeetha Lakshmi)
    CameraFusion,
    /// Lane edges by a trained network (needs a build with `--features learn`)
    Segmentation,
}

/// Names of the methods in order.
const NAMES: [&str; 8] =
    ["uwb", "markers", "range-doppler", "signature", "road-shape", "hd-map", "camera-fusion", "segmentation"];

impl Method {
    /// All methods in the order in which they are listed.
    pub const ALL: [Method; 8] = [
        Method::Uwb,
        Method::Markers,
        Method::RangeDoppler,
        Method::Signature,
        Method::RoadShape,
        Method::HdMap,
        Method::CameraFusion,
        Method::Segmentation,
    ];

    /// Whether this build has the method: segmentation belongs to the cargo feature `learn`. A comparison leaves out what a
    /// build has not.
    pub fn is_built(self) -> bool {
        self != Method::Segmentation || cfg!(feature = "learn")
    }

    /// Checks that this build has the method.
    ///
    /// # Errors
    /// Returns `BadInput` with the command that builds it.
    pub fn check_built(self) -> Result<()> {
        if self.is_built() {
            return Ok(());
        }
        let bad = BadInput::new("this program was built without networks").key("method").value(self.name());
        Err(bad.remedy("cargo install --path crates/cli --locked --features learn").into())
    }

    /// Name of the method on the command line.
    pub fn name(self) -> &'static str {
        NAMES[self as usize]
    }

    /// Finds the method of this name.
    ///
    /// # Errors
    /// Returns an error for an unknown name.
    pub fn named(name: &str) -> Result<Method> {
        Method::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            BadInput::new("is not a lane method").key("method").value(name).allowed(NAMES.join(", ")).into()
        })
    }
}
