//! Pictures of labels: boxes, lanes and labelled points from above, and masks of classes.

use super::Axis;
use super::birds_eye::{BirdsEye, birds_eye_turned};
use super::canvas::{Pen, Picture, Rgb};
use super::chart::{Chart, Layer, Mark, Symbol};
use super::classes::{class_colour, class_name, whole};
use catseye::base::error::{Error, Result};

/// A line on the road, (x forward, y left) in m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RoadLine {
    /// Points of the line, m.
    pub points_m: Vec<[f64; 2]>,
    /// The edge of a lane, not paint.
    pub edge: bool,
}

/// Flags of points that are not on their objects, with the legend's word, and the ring that marks them: radius in pixels and colour.
const FLAGS: [(&str, &str, f64, Rgb); 4] = [
    ("ghost", "ghosts", 6.0, [220, 20, 30]),
    ("side_lobe", "side lobes", 5.0, [130, 130, 130]),
    ("folded", "folded", 7.5, [0, 60, 200]),
    ("aliased", "aliased", 9.0, [140, 0, 170]),
];

/// A point of the cloud with its label.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LabelledPoint {
    /// Forward and to the left, m.
    pub at_m: [f64; 2],
    /// Decides the colour; "" for none.
    pub class: String,
    /// The flag that says why it is not on its object: `ghost`, `side_lobe`, `folded`, `aliased`; "" for none.
    pub flag: &'static str,
}

/// What is true of a scene and what the radar made of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels<'a> {
    /// Title, boxes, radars and limits; its points are left out.
    pub scene: BirdsEye<'a>,
    /// Lines on the road.
    pub lines: &'a [RoadLine],
    /// A polygon round the radar; empty for none.
    pub free_space_m: &'a [[f64; 2]],
    /// Detected points.
    pub points: &'a [LabelledPoint],
}

/// The scene from above: boxes, lanes and lines, free space, points coloured by the class of their object, those that
/// are not on it ringed.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn labels(input: &Labels) -> Result<Picture> {
    let (mut chart, turned) = birds_eye_turned(&BirdsEye { points: &[], ..input.scene.clone() });
    let all = |points: &[[f64; 2]]| -> Vec<[f64; 2]> { points.iter().map(|p| turned(*p)).collect() };
    // Under everything that stands.
    let mut below = Vec::new();
    let free = class_colour("free space");
    if !input.free_space_m.is_empty() {
        let pen = Pen::solid(free, 0.8);
        below.push(Layer::Area {
            polygon: all(input.free_space_m),
            fill: Some((free, 0.25)),
            stroke: Some(pen),
        });
        chart.key("free space", Symbol::Area { fill: (free, 0.25), stroke: pen });
    }
    for (edge, name, pen) in [
        (true, "lane", Pen::solid([150, 150, 150], 0.8)),
        (false, "lane line", Pen::solid([40, 40, 40], 1.2)),
    ] {
        for line in input.lines.iter().filter(|l| l.edge == edge) {
            below.push(Layer::Line { points: all(&line.points_m), pen });
        }
        if input.lines.iter().any(|l| l.edge == edge) {
            chart.key(name, Symbol::Line(pen));
        }
    }
    chart.layers.splice(0..0, below);
    add_points(&mut chart, input.points, &turned);
    chart.draw()
}

fn add_points(chart: &mut Chart, points: &[LabelledPoint], place: &dyn Fn([f64; 2]) -> [f64; 2]) {
    let mut classes: Vec<&str> = points.iter().map(|p| whole(&p.class)).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let list: Vec<[f64; 2]> =
            points.iter().filter(|p| whole(&p.class) == class).map(|p| place(p.at_m)).collect();
        let label = format!("points: {} ({})", class_name(class), list.len());
        chart.marks(label, list, Mark::Dot { radius: 3.0 }, class_colour(class));
    }
    for (flag, word, radius, colour) in FLAGS {
        let list: Vec<[f64; 2]> = points.iter().filter(|p| p.flag == flag).map(|p| place(p.at_m)).collect();
        if !list.is_empty() {
            chart.marks(format!("{word} ({})", list.len()), list, Mark::Ring { radius }, colour);
        }
    }
}

/// Cells with a class each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MaskPicture<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// `[row, column]`: row 0 at the radar, column 0 farthest left.
    pub cells: &'a [u8],
    /// Number of rows, ahead.
    pub rows: usize,
    /// Number of columns, across.
    pub columns: usize,
    /// Length ahead, m.
    pub ahead_m: f64,
    /// Width across, m.
    pub across_m: f64,
    /// Name of each class number; number 0 is left white.
    pub names: &'a [&'a str],
    /// In the mask's axes, x forward and y left of the radar.
    pub points: &'a [LabelledPoint],
}

/// A mask as seen from above, forward up, left on the left, with points on it.
///
/// # Errors
/// When the cells are not as many as rows times columns, or hold a class without a name.
pub fn mask_picture(input: &MaskPicture) -> Result<Picture> {
    // Names are classes in words.
    let colours: Vec<Rgb> = input.names.iter().map(|n| class_colour(&n.replace(' ', "_"))).collect();
    let known = colours.len();
    let fits = input.cells.len() == input.rows * input.columns && input.rows * input.columns > 0;
    if !fits || input.cells.iter().any(|c| usize::from(*c) >= known) {
        return Err(Error::Failed(format!(
            "a mask of {} cells does not fit {} x {} cells of {known} classes",
            input.cells.len(),
            input.rows,
            input.columns
        )));
    }
    let half = 0.5 * input.across_m;
    let across = Axis::new("y left (m)", -half, half).reversed();
    let ahead = Axis::new("x forward (m)", 0.0, input.ahead_m);
    let mut chart = Chart::new(input.title, across, ahead).equal_scale(560.0, 640.0);
    chart.layers.push(Layer::Classes {
        x: (half, -half),
        y: (0.0, input.ahead_m),
        rows: input.rows,
        columns: input.columns,
        values: input.cells.iter().map(|c| f64::from(*c)).collect(),
        colours: colours.clone(),
    });
    for (i, name) in input.names.iter().enumerate().skip(1) {
        if input.cells.iter().any(|c| usize::from(*c) == i) {
            let colour = colours[i];
            chart.key(*name, Symbol::Area { fill: (colour, 1.0), stroke: Pen::solid(colour, 0.8) });
        }
    }
    add_points(&mut chart, input.points, &|p| [p[1], p[0]]);
    chart.draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_the_entry_of_their_whole() {
        let axis = || Axis::new("m", 0.0, 1.0);
        let mut chart = Chart::new("", axis(), axis());
        let point = |class: &str| LabelledPoint { class: class.into(), ..Default::default() };
        add_points(&mut chart, &["car", "car.wheel", "pedestrian.arm", ""].map(point), &|p| p);
        let labels: Vec<&str> = chart.keys.iter().map(|k| k.label.as_str()).collect();
        assert_eq!(labels, ["points: no object (1)", "points: car (2)", "points: pedestrian (1)"]);
    }
}
