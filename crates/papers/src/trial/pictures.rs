//! Pictures that several trials share.

use catseye_lane::score::TrueLanes;
use catseye_lane::{LaneEstimate, LanePoint};
use catseye_plot::{Axis, Chart, Layer, Mark, Paint, Pen, Rgb, Symbol, curve_pen};

/// Colours: truth, estimate, points, and further rows.
pub const TRUE: Rgb = [150, 150, 150];
pub const FOUND: Rgb = [214, 39, 40];
pub const SEEN: Rgb = [31, 119, 180];
pub const OTHER: Rgb = [44, 160, 44];
pub const DOT: Mark = Mark::Dot { radius: 2.5 };

/// The road from above, x forward to the right, y left upwards: true lines in grey, points, estimated lines with the band of two
/// standard deviations.
pub fn lanes_chart(title: &str, points: &[LanePoint], truth: &TrueLanes, estimate: &LaneEstimate) -> Chart {
    let reach = truth.range_m[1].max(10.0);
    let x = Axis::new("x forward (m)", 0.0, reach);
    let y = Axis::new("y left (m)", -0.5 * reach, 0.5 * reach);
    let mut chart = Chart::new(title, x, y).equal_scale(760.0, 560.0);
    let grey = Pen::solid(TRUE, 1.5);
    for line in &truth.lines {
        chart.layers.push(Layer::Line { points: line.clone(), pen: grey });
    }
    let dots = points.iter().map(|p| p.at_m).collect();
    chart.layers.push(Layer::Marks { points: dots, mark: DOT, paint: Paint::Fixed(SEEN) });
    let red = Pen::solid(FOUND, 2.0);
    for line in &estimate.lines {
        let curve = &line.fitted.curve;
        let count = (curve.length_m / 0.5).ceil().max(1.0) as usize;
        let at = |i: usize| curve.length_m * i as f64 / count as f64;
        let side = |k: f64| {
            (0..=count).map(move |i| {
                let place = curve.at(at(i));
                let left = glam::DVec2::from_angle(place.heading_rad).perp();
                (place.at_m + left * (k * line.fitted.lateral_std_m(at(i)))).to_array()
            })
        };
        let band: Vec<[f64; 2]> = side(2.0).chain(side(-2.0).collect::<Vec<_>>().into_iter().rev()).collect();
        chart.layers.push(Layer::Area { polygon: band, fill: Some((FOUND, 0.15)), stroke: None });
        chart.layers.push(Layer::Line { points: side(0.0).collect(), pen: red });
    }
    chart.key("true lines", Symbol::Line(grey));
    chart.key("points", Symbol::Mark(DOT, SEEN));
    chart.key("estimate, 2σ", Symbol::Area { fill: (FOUND, 0.15), stroke: red });
    chart
}

/// Lines that several methods state at one time, over the true ones of the first.
pub fn all_methods(title: &str, of: &[(String, &LaneEstimate, &TrueLanes)]) -> Chart {
    let reach = of.first().map_or(40.0, |o| o.2.range_m[1]).max(10.0);
    let (x, y) =
        (Axis::new("x forward (m)", -5.0, reach), Axis::new("y left (m)", -0.3 * reach, 0.3 * reach));
    let mut chart = Chart::new(title, x, y).equal_scale(900.0, 600.0);
    let grey = Pen::solid(TRUE, 1.5);
    let faint = Pen::dashed([200, 200, 200], 1.0, [4.0, 4.0]);
    if let Some((_, _, truth)) = of.first() {
        for line in &truth.also {
            chart.layers.push(Layer::Line { points: line.clone(), pen: faint });
        }
        for line in &truth.lines {
            chart.layers.push(Layer::Line { points: line.clone(), pen: grey });
        }
        chart.key("own lane", Symbol::Line(grey));
        chart.key("other lines", Symbol::Line(faint));
    }
    for (i, (name, estimate, _)) in of.iter().enumerate() {
        let pen = curve_pen(i);
        for line in &estimate.lines {
            let points = line.fitted.curve.sample(0.5).iter().map(glam::DVec2::to_array).collect();
            chart.layers.push(Layer::Line { points, pen });
        }
        let label = if estimate.no_lane.is_some() { format!("{name}: none") } else { name.clone() };
        chart.key(label, Symbol::Line(pen));
    }
    chart
}
