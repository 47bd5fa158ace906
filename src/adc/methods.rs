//! How the echoes of a frame were summed.

/// How a set of echoes was summed.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Every echo is summed at every sample.
    #[default]
    Direct,
    /// The echoes are spread on a grid, whose size this holds.
    Gridded(Gridded),
}

/// Size and error of a grid that [`Method::Gridded`] used.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gridded {
    /// Grids, each with echoes of its own; `blocks` is that of the finest and `lines` the largest.
    #[serde(default = "one")]
    pub grids: usize,
    /// Blocks of chirps.
    pub blocks: usize,
    /// Range transforms of each block and channel: lines of slow-time frequency.
    pub lines: usize,
    /// Cells of a line per sample.
    pub oversampling: f64,
    /// Cells, and lines, over which an echo is spread.
    pub taps: usize,
    /// Estimate of the error as a share of the root of Σ|A|², the squares of all echoes' amplitudes; rounding included.
    pub error: f64,
}

fn one() -> usize {
    1
}

/// How the echoes of one frame were summed.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Methods {
    /// Method for the echoes that do not move against the radar.
    pub still: Method,
    /// Method for the echoes that move.
    pub moving: Method,
}
