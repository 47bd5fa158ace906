//! Pictures common to several trials, and how layers with their keys are added to a chart.

use catseye_lane::score::TrueLanes;
use catseye_lane::{LaneEstimate, LanePoint};
use catseye_plot::{Axis, Chart, Layer, Mark, Paint, Pen, Rgb, Symbol, curve_pen};
use glam::DVec2;

/// Colours: truth, estimate, points, and further rows.
pub const TRUE: Rgb = [150, 150, 150];
pub const FOUND: Rgb = [214, 39, 40];
pub const SEEN: Rgb = [31, 119, 180];
pub const OTHER: Rgb = [44, 160, 44];
pub const DOT: Mark = Mark::Dot { radius: 2.5 };

/// Adds layers and keys to a chart.
pub trait Draw {
    /// Adds a line without a key.
    fn line(&mut self, points: Vec<[f64; 2]>, pen: Pen);

    /// Adds a line and its key.
    fn named_line(&mut self, label: impl Into<String>, points: Vec<[f64; 2]>, pen: Pen);

    /// Adds marks without a key.
    fn dots(&mut self, points: Vec<[f64; 2]>, mark: Mark, colour: Rgb);

    /// Adds an area without a key.
    fn area(&mut self, polygon: Vec<[f64; 2]>, fill: (Rgb, f64), stroke: Option<Pen>);

    /// Adds the estimated lines, each with the band of two standard deviations.
    fn estimate(&mut self, estimate: &LaneEstimate, pen: Pen);

    /// Sets the size of the frame, pixels.
    fn sized(self, width: f64, height: f64) -> Self;
}

impl Draw for Chart {
    fn line(&mut self, points: Vec<[f64; 2]>, pen: Pen) {
        self.layers.push(Layer::Line { points, pen });
    }

    fn named_line(&mut self, label: impl Into<String>, points: Vec<[f64; 2]>, pen: Pen) {
        self.line(points, pen);
        self.key(label, Symbol::Line(pen));
    }

    fn dots(&mut self, points: Vec<[f64; 2]>, mark: Mark, colour: Rgb) {
        self.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(colour) });
    }

    fn area(&mut self, polygon: Vec<[f64; 2]>, fill: (Rgb, f64), stroke: Option<Pen>) {
        self.layers.push(Layer::Area { polygon, fill: Some(fill), stroke });
    }

    fn estimate(&mut self, estimate: &LaneEstimate, pen: Pen) {
        for line in &estimate.lines {
            let curve = &line.fitted.curve;
            let count = (curve.length_m / 0.5).ceil().clamp(1.0, 1000.0) as usize;
            let side = |k: f64| -> Vec<[f64; 2]> {
                let beside = |i: usize| {
                    let s_m = curve.length_m * i as f64 / count as f64;
                    let place = curve.at(s_m);
                    let left = DVec2::from_angle(place.heading_rad).perp();
                    (place.at_m + left * (k * line.fitted.lateral_std_m(s_m))).to_array()
                };
                (0..=count).map(beside).collect()
            };
            let band = side(2.0).into_iter().chain(side(-2.0).into_iter().rev()).collect();
            self.area(band, (pen.colour, 0.15), None);
            self.line(side(0.0), pen);
        }
    }

    fn sized(mut self, width: f64, height: f64) -> Self {
        (self.width, self.height) = (width, height);
        self
    }
}

/// The road from above, x forward to the right, y left upwards: true lines in grey, points, and estimated
/// lines with the band of two standard deviations.
pub fn lanes_chart(title: &str, points: &[LanePoint], truth: &TrueLanes, estimate: &LaneEstimate) -> Chart {
    let reach = truth.range_m[1].max(10.0);
    let x = Axis::new("x forward (m)", 0.0, reach);
    let y = Axis::new("y left (m)", -0.5 * reach, 0.5 * reach);
    let mut chart = Chart::new(title, x, y).equal_scale(760.0, 560.0);
    let (grey, red) = (Pen::solid(TRUE, 1.5), Pen::solid(FOUND, 2.0));
    truth.lines.iter().for_each(|line| chart.line(line.clone(), grey));
    chart.dots(points.iter().map(|p| p.at_m).collect(), DOT, SEEN);
    chart.estimate(estimate, red);
    chart.key("true lines", Symbol::Line(grey));
    chart.key("points", Symbol::Mark(DOT, SEEN));
    chart.key("estimate, 2σ", Symbol::Area { fill: (FOUND, 0.15), stroke: red });
    chart
}

/// Lines that several methods estimate at one time, over the true ones of the first.
pub fn all_methods(title: &str, of: &[(String, &LaneEstimate, &TrueLanes)]) -> Chart {
    let reach = of.first().map_or(40.0, |o| o.2.range_m[1]).max(10.0);
    let (x, y) =
        (Axis::new("x forward (m)", -5.0, reach), Axis::new("y left (m)", -0.3 * reach, 0.3 * reach));
    let mut chart = Chart::new(title, x, y).equal_scale(900.0, 600.0);
    if let Some((_, _, truth)) = of.first() {
        let (grey, faint) = (Pen::solid(TRUE, 1.5), Pen::dashed([200, 200, 200], 1.0, [4.0, 4.0]));
        truth.also.iter().for_each(|line| chart.line(line.clone(), faint));
        truth.lines.iter().for_each(|line| chart.line(line.clone(), grey));
        chart.key("own lane", Symbol::Line(grey));
        chart.key("other lines", Symbol::Line(faint));
    }
    for (i, (name, estimate, _)) in of.iter().enumerate() {
        let pen = curve_pen(i);
        for line in &estimate.lines {
            chart.line(line.fitted.curve.sample(0.5).iter().map(DVec2::to_array).collect(), pen);
        }
        let label = if estimate.no_lane.is_some() { format!("{name}: none") } else { name.clone() };
        chart.key(label, Symbol::Line(pen));
    }
    chart
}
