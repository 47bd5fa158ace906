//! Pictures of results as PNG, SVG and PDF. Charts take plain numbers and do no physics; every chart is drawn by
//! `chart` (or `polar`) on one `canvas`.

mod axis;
mod birds_eye;
mod canvas;
mod chart;
mod classes;
mod drawing;
mod family;
mod file;
mod font;
mod labels;
mod overlay;
mod pdf;
mod polar;
mod profile;
mod range_doppler;
mod rcs;
mod solid;
mod study;
mod svg;

pub use axis::Axis;
pub use birds_eye::{BirdsEye, BirdsEyePoint, FieldOfView, Outline, birds_eye};
pub use canvas::{PICTURE_EXTENSIONS, Pen, Picture, Rgb};
pub use chart::{
    Chart, ColourMap, Curve, Key, Layer, Mark, Paint, Scale, Symbol, curve_pen, finite_range, heat_map, lines,
};
pub use classes::{class_colour, class_name};
pub use file::{PlotOptions, Plotted, plot_file};
pub use labels::{LabelledPoint, Labels, MaskPicture, RoadLine, labels, mask_picture};
pub use overlay::{overlay_files, points_overlay, rcs_overlay};
pub use polar::polar;
pub use profile::{RangeProfile, range_profile};
pub use range_doppler::{RangeDoppler, Unmarked, noise_scale, range_doppler};
pub use rcs::{RcsRow, RcsStyle, rcs_lines, rcs_picture, rcs_polar};
pub use solid::{SolidView, solid_picture, solid_sheet};
pub use study::{Panel, study_picture};

#[cfg(test)]
mod tests;
