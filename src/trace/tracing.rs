//! The two places where the beams of frames can be followed.

use crate::base::error::{BadInput, Result};

/// Where the beams of frames are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tracing {
    /// On this machine's processor, in f64.
    Host,
    /// By compute shaders of the gpu engine's adapter, in f32.
    Device,
}

impl Tracing {
    /// Its word: `host` or `device`.
    pub fn word(self) -> &'static str {
        match self {
            Tracing::Host => "host",
            Tracing::Device => "device",
        }
    }

    /// Reads its word.
    ///
    /// # Errors
    /// Returns an error for any other word.
    pub fn parse(word: &str) -> Result<Tracing> {
        match word {
            "host" => Ok(Tracing::Host),
            "device" => Ok(Tracing::Device),
            other => {
                Err(BadInput::new("unknown place").key("trace").value(other).allowed("host, device").into())
            }
        }
    }
}
