//! The grids that are learned and the cells of a scan that hold points.

use catseye::detect::grid::PointGrid;
use catseye::road::mask::Grid;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Planes of a grid that a network receives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Input {
    /// 1 where there is a point, else 0.
    B,
    /// Normalised amplitude.
    A,
    /// Count and amplitude.
    C2,
    /// Count, amplitude, range and azimuth.
    C4,
}

impl Input {
    /// Number of planes.
    pub fn planes(self) -> usize {
        match self {
            Input::B | Input::A => 1,
            Input::C2 => 2,
            Input::C4 => 4,
        }
    }

    /// What may be turned and shifted with the points, where something of the input depends on their places.
    pub fn fixed(self) -> Option<&'static str> {
        (self != Input::B)
            .then_some("0, unless network.input is B, because amplitudes would not move with the points")
    }
}

/// Grid of a frame that a network is trained on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GridKind {
    /// `grid_road.npy` with `mask_road.npy`, 450 x 300 cells over 60 x 40 m.
    Road,
    /// `grid_markers.npy` with `mask_markers.npy`, 227 x 227 cells over 40 x 40 m.
    Markers,
}

impl GridKind {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            GridKind::Road => "road",
            GridKind::Markers => "markers",
        }
    }

    /// The cells.
    pub fn grid(self) -> Grid {
        match self {
            GridKind::Road => Grid::ROAD,
            GridKind::Markers => Grid::MARKERS,
        }
    }
}

/// What the points of a scan tell of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanCell {
    /// Place of the cell in the grid, `[row, column]`.
    pub cell: u32,
    /// Number of points.
    pub count: f32,
    /// The largest amplitude over that of the scan, 0 to 1.
    pub amplitude: f32,
    /// Mean range, m.
    pub range_m: f32,
    /// Mean azimuth, rad.
    pub azimuth_rad: f32,
}

/// The cells of a grid that hold points, in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// The grid.
    pub grid: Grid,
    /// Cells with points.
    pub cells: Vec<ScanCell>,
}

impl Scan {
    /// The cells with points of a grid.
    pub fn new(points: &PointGrid) -> Scan {
        let of = |cell: usize| ScanCell {
            cell: cell as u32,
            count: points.count[cell],
            amplitude: points.amplitude[cell],
            range_m: points.range_m[cell],
            azimuth_rad: points.azimuth_rad[cell],
        };
        let held = (0..points.grid.cells()).filter(|c| points.count[*c] != 0.0);
        Scan { grid: points.grid, cells: held.map(of).collect() }
    }
}
