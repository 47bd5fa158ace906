//! What a canvas has drawn, as a list of steps that vector files are written from.

use image::RgbImage;
use tiny_skia::Path;

/// One step of a drawing. Coordinates are device pixels from the upper left corner of the drawing, or of the clip that the step is
/// part of; y is positive downwards.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// The inside of a path, by the non-zero rule.
    Fill {
        path: Path,
        colour: [u8; 3],
        /// 255 is opaque.
        opacity: u8,
        /// The words whose outlines the path has.
        text: Option<String>,
    },
    /// The line of a path: round joins, round ends, or dashes with flat ends.
    Stroke {
        path: Path,
        colour: [u8; 3],
        width: f32,
        /// Lengths of dash and gap; None for a solid line.
        dash: Option<[f32; 2]>,
    },
    /// An image over whatever was drawn before.
    Pixels { corner: (u32, u32), image: RgbImage },
    /// Steps that are cut off at a box.
    Clip { corner: (u32, u32), size: (u32, u32), steps: Vec<Step> },
}
