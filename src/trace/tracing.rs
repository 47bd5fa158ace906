//! The ways in which frames can be traced.

use crate::base::error::{BadInput, Result};

/// Where the beams of frames are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tracing {
    /// On this machine's processor, in f64.
    Host,
    /// By compute shaders of the gpu engine's adapter, in f32.
    Device,
    /// By compute shaders of the gpu engine's adapter, as lines in place of polygons and decided in f64 or pairs of f32. Experimental: it is
    /// not measured on a GPU yet.
    Lines,
}

impl Tracing {
    /// Its word: `host`, `device` or `lines`.
    pub fn word(self) -> &'static str {
        match self {
            Tracing::Host => "host",
            Tracing::Device => "device",
            Tracing::Lines => "lines",
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
            "lines" => Ok(Tracing::Lines),
            other => Err(BadInput::new("unknown place")
                .key("trace")
                .value(other)
                .allowed("host, device, lines")
                .into()),
        }
    }
}
