//! The scene from above: what stands there, what the radar sees of it, and where the radar looks.

use super::axis::Axis;
use super::canvas::{BLACK, Pen, Picture, Rgb};
use super::chart::{Chart, ColourMap, Layer, Mark, Paint, Scale, Symbol, finite_range};
use crate::error::Result;

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

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BirdsEyePoint {
    pub x_m: f64,
    pub y_m: f64,
    /// What the colour shows: range rate in m/s, or what `BirdsEye::colour_label` says.
    pub value: f64,
}

/// Where a radar stands and looks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldOfView {
    pub x_m: f64,
    pub y_m: f64,
    /// Direction of boresight, positive left.
    pub yaw_rad: f64,
    /// Half of the opening angle; zero draws only the radar.
    pub half_angle_rad: f64,
    pub range_m: f64,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct BirdsEye<'a> {
    pub title: &'a str,
    pub objects: &'a [Outline],
    pub points: &'a [BirdsEyePoint],
    pub radars: &'a [FieldOfView],
    /// Lower-left and upper-right corner of what is shown, (x, y) in m; everything when None.
    pub limits_m: Option<[[f64; 2]; 2]>,
    /// Label of the colour bar when the values are not range rates.
    pub colour_label: Option<&'a str>,
}

/// Top view with equal scales. Long scenes lie with x to the right and y (left) up; others stand with
/// x up and y growing to the left: both are what one sees from above.
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
    let classes = classes(&objects);
    for o in &objects {
        let colour = class_colour(&o.class, &classes);
        if let [only] = o.polygon[..] {
            let mark = Mark::Diamond { radius: 5.0 };
            chart.layers.push(Layer::Marks { points: vec![turned(only)], mark, paint: Paint::Fixed(colour) });
            continue;
        }
        let (mut fill, stroke) = area_style(&o.class, colour);
        if o.piece {
            fill = on_white(fill);
        }
        let polygon = o.polygon.iter().map(|p| turned(*p)).collect();
        chart.layers.push(Layer::Area { polygon, fill: Some(fill), stroke: (!o.piece).then_some(stroke) });
    }
    for class in &classes {
        let colour = class_colour(class, &classes);
        let (fill, stroke) = area_style(class, colour);
        let name = if class.is_empty() { "other".to_string() } else { class.replace('_', " ") };
        chart.key(name, Symbol::Area { fill, stroke });
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
        let mark = Mark::Diamond { radius: 6.5 };
        let points = input.radars.iter().map(|r| turned([r.x_m, r.y_m])).collect();
        chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(RADAR) });
        chart.key("radar", Symbol::Mark(mark, RADAR));
    }
    (chart, turned)
}

const RADAR: Rgb = [230, 159, 0];

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

/// In order of first appearance, which is from large to small.
fn classes(objects: &[&Outline]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for o in objects {
        if !out.contains(&o.class) {
            out.push(o.class.clone());
        }
    }
    out
}

fn class_colour(class: &str, all: &[String]) -> Rgb {
    const KNOWN: [(&str, Rgb); 16] = [
        ("ground", [196, 198, 196]),
        ("road", [196, 198, 196]),
        ("asphalt", [196, 198, 196]),
        ("terrain", [196, 210, 188]),
        ("grass", [150, 190, 130]),
        ("guard_rail", [70, 84, 104]),
        ("post", [40, 46, 56]),
        ("marker", [214, 130, 0]),
        ("type1", [214, 130, 0]),
        ("car", [92, 140, 190]),
        ("truck", [120, 100, 170]),
        ("vehicle", [92, 140, 190]),
        ("wall", [170, 140, 110]),
        ("manhole", [150, 70, 50]),
        ("pole", [60, 110, 100]),
        ("pedestrian", [190, 70, 140]),
    ];
    if let Some((_, c)) = KNOWN.iter().find(|(name, _)| class.starts_with(name)) {
        return *c;
    }
    let i = all.iter().position(|c| c == class).unwrap_or(0);
    let c = colorous::SET2[i % colorous::SET2.len()];
    [c.r, c.g, c.b]
}

/// Ground is pale and without an edge; the rest is filled lightly and edged darker, so that an object
/// smaller than a pixel still shows.
/// The same colour without transparency: pieces of one thing overlap.
fn on_white((colour, opacity): (Rgb, f64)) -> (Rgb, f64) {
    (colour.map(|c| (255.0 - opacity * (255.0 - f64::from(c))).round() as u8), 1.0)
}

fn area_style(class: &str, colour: Rgb) -> ((Rgb, f64), Pen) {
    let ground = ["ground", "road", "asphalt", "terrain", "grass"].iter().any(|g| class.starts_with(g));
    if ground {
        return ((colour, 0.3), Pen::solid(colour, 0.8));
    }
    let darker = [0, 1, 2].map(|i| (f64::from(colour[i]) * 0.72) as u8);
    ((colour, 0.55), Pen::solid(if class.is_empty() { BLACK } else { darker }, 1.0))
}
