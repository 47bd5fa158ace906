//! The stages of a frame, in the order in which each needs the one before it.

/// A stage of the chain from a scene to labelled points. Each needs all that are before it, so a frame is made to the last stage
/// that somebody asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// The scene is placed and its echoes are found.
    Trace,
    /// Echoes become samples, with noise and front end.
    Synthesis,
    /// Samples become the range-Doppler spectrum and its power map.
    Transform,
    /// The detector finds cells in the map, their noise and their snapshots.
    Detection,
    /// Cells become points: Doppler ambiguity, directions, standard deviations.
    Angles,
    /// Points are labelled by the echoes that made them.
    Labels,
}

impl Stage {
    /// All stages in their order.
    pub const ALL: [Stage; 6] =
        [Stage::Trace, Stage::Synthesis, Stage::Transform, Stage::Detection, Stage::Angles, Stage::Labels];
}

/// Number of times that each stage ran, counted where it runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StageCounts([u32; Stage::ALL.len()]);

impl StageCounts {
    /// Counts one run of a stage.
    pub fn count(&mut self, stage: Stage) {
        self.0[stage as usize] += 1;
    }

    /// Number of runs of a stage.
    pub fn of(&self, stage: Stage) -> u32 {
        self.0[stage as usize]
    }

    /// Adds the counts of another part of the frame.
    pub fn add(&mut self, other: &StageCounts) {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a += b);
    }
}

/// How far an engine carries a frame, and whether it hands over the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Whether the samples are handed over.
    pub samples: bool,
    /// The last stage; what comes after [`Stage::Detection`] is not the engine's, and nothing is made before
    /// [`Stage::Synthesis`].
    pub last: Option<Stage>,
}

impl Extent {
    /// Detected cells without the samples.
    pub const CELLS: Extent = Extent { samples: false, last: Some(Stage::Detection) };
    /// Samples and detected cells.
    pub const WHOLE: Extent = Extent { samples: true, last: Some(Stage::Detection) };

    /// Whether the frame is carried at least so far.
    pub fn reaches(&self, stage: Stage) -> bool {
        self.last.is_some_and(|last| last >= stage)
    }
}
