//! Pictures of labels: boxes, lanes and labelled points from above, and masks of classes.

use super::Axis;
use super::birds_eye::{BirdsEye, birds_eye_turned};
use super::canvas::{Pen, Picture, Rgb};
use super::chart::{CURVE_COLOURS, Chart, Layer, Mark, Paint, Symbol};
use crate::error::{Error, Result};

/// A line on the road, (x forward, y left) in m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RoadLine {
    pub points_m: Vec<[f64; 2]>,
    /// The edge of a lane, not paint.
    pub edge: bool,
}

/// A point of the cloud with its label.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LabelledPoint {
    pub at_m: [f64; 2],
    /// Decides the colour; "" for none.
    pub class: String,
    pub ghost: bool,
}

/// What is true of a scene and what the radar made of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels<'a> {
    /// Title, boxes, radars and limits; its points are left out.
    pub scene: BirdsEye<'a>,
    pub lines: &'a [RoadLine],
    /// A polygon round the radar; empty for none.
    pub free_space_m: &'a [[f64; 2]],
    pub points: &'a [LabelledPoint],
}

const FREE: Rgb = [120, 190, 120];
const GHOST: Rgb = [220, 30, 30];
const NONE: Rgb = [190, 190, 190];

/// Colour of each class of the points, in the order of their names.
fn classes(points: &[LabelledPoint]) -> Vec<(&str, Rgb)> {
    let mut names: Vec<&str> = points.iter().map(|p| p.class.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let mut colours = CURVE_COLOURS.iter().cycle();
    names
        .into_iter()
        .map(|n| (n, if n.is_empty() { NONE } else { colours.next().copied().unwrap_or(NONE) }))
        .collect()
}

/// The scene from above: boxes, lanes and lines, free space, points coloured by the class of their object, ghosts ringed.
pub fn labels(input: &Labels) -> Result<Picture> {
    let (mut chart, turned) = birds_eye_turned(&BirdsEye { points: &[], ..input.scene.clone() });
    let all = |points: &[[f64; 2]]| -> Vec<[f64; 2]> { points.iter().map(|p| turned(*p)).collect() };
    // Under everything that stands.
    let mut below = Vec::new();
    if !input.free_space_m.is_empty() {
        let pen = Pen::solid(FREE, 0.8);
        below.push(Layer::Area {
            polygon: all(input.free_space_m),
            fill: Some((FREE, 0.25)),
            stroke: Some(pen),
        });
        chart.key("free space", Symbol::Area { fill: (FREE, 0.25), stroke: pen });
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
    let dot = Mark::Dot { radius: 3.0 };
    for (class, colour) in classes(points) {
        let mine = points.iter().filter(|p| p.class == class);
        let list: Vec<[f64; 2]> = mine.map(|p| place(p.at_m)).collect();
        let name = if class.is_empty() { "no object".into() } else { class.replace('_', " ") };
        chart.key(format!("{name} ({})", list.len()), Symbol::Mark(dot, colour));
        chart.layers.push(Layer::Marks { points: list, mark: dot, paint: Paint::Fixed(colour) });
    }
    let ghosts: Vec<[f64; 2]> = points.iter().filter(|p| p.ghost).map(|p| place(p.at_m)).collect();
    if !ghosts.is_empty() {
        let mark = Mark::Ring { radius: 6.0 };
        chart.key(format!("ghosts ({})", ghosts.len()), Symbol::Mark(mark, GHOST));
        chart.layers.push(Layer::Marks { points: ghosts, mark, paint: Paint::Fixed(GHOST) });
    }
}

/// Cells with a class each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MaskPicture<'a> {
    pub title: &'a str,
    /// `[row, column]`: row 0 at the radar, column 0 farthest left.
    pub cells: &'a [u8],
    pub rows: usize,
    pub columns: usize,
    pub ahead_m: f64,
    pub across_m: f64,
    /// Name of each class number; number 0 is left white.
    pub names: &'a [&'a str],
    /// In the mask's axes, x forward and y left of the radar.
    pub points: &'a [LabelledPoint],
}

const MASK_COLOURS: [Rgb; 5] =
    [[255, 255, 255], [200, 212, 224], [92, 140, 190], [70, 84, 104], [214, 130, 0]];

/// A mask as seen from above, forward up, left on the left, with points on it.
///
/// # Errors
/// When the cells are not as many as rows times columns, or hold a class without a name or colour.
pub fn mask_picture(input: &MaskPicture) -> Result<Picture> {
    let known = input.names.len().min(MASK_COLOURS.len());
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
        colours: MASK_COLOURS.to_vec(),
    });
    for (i, name) in input.names.iter().enumerate().skip(1) {
        if input.cells.iter().any(|c| usize::from(*c) == i) {
            let colour = MASK_COLOURS[i];
            chart.key(*name, Symbol::Area { fill: (colour, 1.0), stroke: Pen::solid(colour, 0.8) });
        }
    }
    add_points(&mut chart, input.points, &|p| [p[1], p[0]]);
    chart.draw()
}
