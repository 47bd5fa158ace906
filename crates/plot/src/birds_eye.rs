//! The scene from above: what stands there, what the radar sees of it, and where the radar looks.

use super::axis::Axis;
use super::canvas::{Pen, Picture, Rgb};
use super::chart::{Chart, ColourMap, Layer, Mark, Paint, Scale, Symbol, finite_range};
use super::classes::{class_colour, class_name, is_ground, whole};
use catseye::base::error::Result;

/// A true object seen from above.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outline {
    /// As in the scene, e.g. `car`; decides the colour.
    pub class: String,
    /// Corners (x forward, y left) in m; a single corner stands for a point target.
    pub polygon: Vec<[f64; 2]>,
    /// One of several that make up an object: drawn without its edge.
    pub piece: bool,
}

impl Outline {
    /// All of an object.
    pub fn whole(class: impl Into<String>, polygon: Vec<[f64; 2]>) -> Outline {
        Outline { class: class.into(), polygon, piece: false }
    }
}

/// A point with the value that colours it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BirdsEyePoint {
    /// Forward, m.
    pub x_m: f64,
    /// To the left, m.
    pub y_m: f64,
    /// What the colour shows: range rate in m/s, or what `BirdsEye::colour_label` says.
    pub value: f64,
}

/// Where a radar stands and looks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldOfView {
    /// Forward, m.
    pub x_m: f64,
    /// To the left, m.
    pub y_m: f64,
    /// Direction of boresight, positive left.
    pub yaw_rad: f64,
    /// Half of the opening angle; zero draws only the radar.
    pub half_angle_rad: f64,
    /// Largest range, m.
    pub range_m: f64,
}

/// What is drawn from above.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BirdsEye<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Outlines of objects.
    pub objects: &'a [Outline],
    /// Detected points.
    pub points: &'a [BirdsEyePoint],
    /// Where radars stand and look.
    pub radars: &'a [FieldOfView],
    /// Lower-left and upper-right corner of what is shown, (x, y) in m; everything when None.
    pub limits_m: Option<[[f64; 2]; 2]>,
    /// Label of the colour bar when the values are not range rates.
    pub colour_label: Option<&'a str>,
}

/// Top view with equal scales; what would be smaller than some pixels is drawn larger. Long scenes lie with x to the right and y (left) up; others stand with
/// x up and y growing to the left: both are what one sees from above.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn birds_eye(input: &BirdsEye) -> Result<Picture> {
    birds_eye_chart(input).draw()
}

pub(super) fn birds_eye_chart(input: &BirdsEye) -> Chart {
    birds_eye_turned(input).0
}

/// The chart, and where a place (x forward, y left) stands in it.
pub(super) fn birds_eye_turned(input: &BirdsEye) -> (Chart, impl Fn([f64; 2]) -> [f64; 2] + use<>) {
    let [[x0, y0], [x1, y1]] = input.limits_m.unwrap_or_else(|| bounds(input));
    let x = Axis::new("x forward (m)", x0, x1);
    let y = Axis::new("y left (m)", y0, y1);
    let lying = x.hi - x.lo > 1.25 * (y.hi - y.lo);
    let mut chart = if lying {
        Chart::new(input.title, x, y).equal_scale(860.0, 460.0)
    } else {
        Chart::new(input.title, y.reversed(), x).equal_scale(560.0, 640.0)
    };
    let turned = move |p: [f64; 2]| if lying { p } else { [p[1], p[0]] };

    // Large areas first, so that a road does not hide what stands on it.
    let mut objects: Vec<&Outline> = input.objects.iter().filter(|o| shown(o, [x0, y0], [x1, y1])).collect();
    objects.sort_by(|a, b| area(&b.polygon).total_cmp(&area(&a.polygon)));
    let metres_per_pixel = (chart.x.hi - chart.x.lo).abs() / chart.width;
    let diamond = Mark::Diamond { radius: 5.0 };
    // What the legend names, from large to small: a class, whether as points, and how it is drawn.
    let mut named: Vec<(&str, bool, Symbol)> = Vec::new();
    let mut enlarged: Vec<&str> = Vec::new();
    for o in &objects {
        let colour = class_colour(&o.class);
        let symbol = if let [only] = o.polygon[..] {
            let paint = Paint::Fixed(colour);
            chart.layers.push(Layer::Marks { points: vec![turned(only)], mark: diamond, paint });
            Symbol::Mark(diamond, colour)
        } else {
            let (fill, stroke) = area_style(&o.class, colour, o.piece);
            let polygon = if o.piece { o.polygon.clone() } else { visible(&o.polygon, metres_per_pixel) };
            if polygon != o.polygon {
                enlarged.push(whole(&o.class));
            }
            let polygon = polygon.into_iter().map(turned).collect();
            let edge = (!o.piece).then_some(stroke);
            chart.layers.push(Layer::Area { polygon, fill: Some(fill), stroke: edge });
            Symbol::Area { fill, stroke }
        };
        let (class, point) = (whole(&o.class), matches!(symbol, Symbol::Mark(..)));
        if !named.iter().any(|n| (n.0, n.1) == (class, point)) {
            named.push((class, point, symbol));
        }
    }
    for (class, point, symbol) in &named {
        let both = *point && named.iter().any(|n| n.0 == *class && !n.1);
        let name = if class.is_empty() { "other".to_string() } else { class_name(class) };
        let more = match (both, !point && enlarged.contains(class)) {
            (true, _) => ", point",
            (_, true) => " (enlarged)",
            _ => "",
        };
        chart.key(name + more, *symbol);
    }

    let sight = Pen::dashed([90, 90, 90], 1.2, [6.0, 4.0]);
    for r in input.radars.iter().filter(|r| r.half_angle_rad > 0.0) {
        let polygon = sector(r).into_iter().map(turned).collect();
        chart.layers.push(Layer::Area { polygon, fill: None, stroke: Some(sight) });
    }
    if input.radars.iter().any(|r| r.half_angle_rad > 0.0) {
        chart.key("field of view", Symbol::Line(sight));
    }

    if !input.points.is_empty() {
        let label = input.colour_label.unwrap_or("range rate (m/s), positive receding");
        let (points, values): (Vec<_>, Vec<_>) =
            input.points.iter().map(|p| (turned([p.x_m, p.y_m]), p.value)).unzip();
        let (lo, hi) = finite_range(values.iter().copied()).unwrap_or((-1.0, 1.0));
        chart.scale = Some(if input.colour_label.is_some() {
            let axis = Axis::new(label, lo, hi).to_ticks(8);
            Scale { map: ColourMap::Viridis, axis }
        } else {
            let most = lo.abs().max(hi.abs()).max(1.0);
            let axis = Axis::new(label, -most, most).to_ticks(8);
            Scale { map: ColourMap::BlueWhiteRed, axis }
        });
        let mark = Mark::Dot { radius: 3.2 };
        chart.layers.push(Layer::Marks { points, mark, paint: Paint::Scaled(values) });
        chart.key(format!("points ({})", input.points.len()), Symbol::Mark(mark, [150, 180, 215]));
    }
    if !input.radars.is_empty() {
        let points = input.radars.iter().map(|r| turned([r.x_m, r.y_m])).collect();
        chart.marks("radar", points, Mark::Diamond { radius: 6.5 }, class_colour("radar"));
    }
    (chart, turned)
}

/// Logical pixels that the larger side of a thing has at least.
pub(super) const SMALLEST: f64 = 6.0;

/// A polygon that would be too small to see, larger about its middle.
fn visible(polygon: &[[f64; 2]], metres_per_pixel: f64) -> Vec<[f64; 2]> {
    let sides = [0, 1].map(|i| finite_range(polygon.iter().map(|p| p[i])).unwrap_or((0.0, 0.0)));
    let least = SMALLEST * metres_per_pixel;
    let larger = sides.iter().map(|(lo, hi)| hi - lo).fold(0.0, f64::max);
    if larger >= least {
        return polygon.to_vec();
    }
    // In its own proportions, but not as a line.
    let grown = |v: f64, (lo, hi): (f64, f64)| {
        let (middle, side) = (0.5 * (lo + hi), hi - lo);
        let wanted = (side * least / larger).max(0.5 * least);
        if side > 0.0 { middle + (v - middle) * wanted / side } else { middle }
    };
    polygon.iter().map(|p| [grown(p[0], sides[0]), grown(p[1], sides[1])]).collect()
}

/// Everything but the fields of view, which often reach far beyond the scene.
fn bounds(input: &BirdsEye) -> [[f64; 2]; 2] {
    let points = input.points.iter().map(|p| [p.x_m, p.y_m]);
    let radars = input.radars.iter().map(|r| [r.x_m, r.y_m]);
    let corners = input.objects.iter().flat_map(|o| o.polygon.iter().copied());
    let all: Vec<[f64; 2]> = points.chain(radars).chain(corners).collect();
    let range = |i: usize| finite_range(all.iter().map(|p| p[i])).unwrap_or((-10.0, 10.0));
    let ((x0, x1), (y0, y1)) = (range(0), range(1));
    let pad = 0.03 * (x1 - x0).max(y1 - y0).max(1.0);
    [[x0 - pad, y0 - pad], [x1 + pad, y1 + pad]]
}

/// Whether the box around an object meets the box that is shown, so that the legend names no class
/// that is not there.
fn shown(o: &Outline, lower: [f64; 2], upper: [f64; 2]) -> bool {
    (0..2).all(|i| {
        finite_range(o.polygon.iter().map(|p| p[i])).is_some_and(|(lo, hi)| hi >= lower[i] && lo <= upper[i])
    })
}

/// Twice the area of a polygon, by the shoelace formula.
fn area(p: &[[f64; 2]]) -> f64 {
    (0..p.len())
        .map(|i| {
            let (a, b) = (p[i], p[(i + 1) % p.len()]);
            a[0] * b[1] - a[1] * b[0]
        })
        .sum::<f64>()
        .abs()
}

fn sector(r: &FieldOfView) -> Vec<[f64; 2]> {
    let half = r.half_angle_rad.min(std::f64::consts::PI);
    let steps = ((half.to_degrees() / 2.0).ceil() as usize).max(1) * 2;
    let arc = (0..=steps).map(|i| {
        let a = r.yaw_rad - half + 2.0 * half * i as f64 / steps as f64;
        [r.x_m + r.range_m * a.cos(), r.y_m + r.range_m * a.sin()]
    });
    std::iter::once([r.x_m, r.y_m]).chain(arc).collect()
}

/// Fill and edge. Ground is pale; the rest is filled lightly and edged darker. Pieces of one thing overlap, so their
/// colour is not transparent.
fn area_style(class: &str, colour: Rgb, piece: bool) -> ((Rgb, f64), Pen) {
    let (opacity, pen) = match is_ground(class) {
        true => (0.35, Pen::solid(colour, 0.8)),
        false => (0.55, Pen::solid(colour.map(|c| (f64::from(c) * 0.72) as u8), 1.0)),
    };
    let on_white = |c: u8| (255.0 - opacity * (255.0 - f64::from(c))).round() as u8;
    (if piece { (colour.map(on_white), 1.0) } else { (colour, opacity) }, pen)
}
