//! Pictures in the form of the document's figures 2 to 7.

use crate::trial::kit::*;
use catseye_lane::road_shape::image::SlopeImage;
use catseye_lane::road_shape::{HoughSettings, RoadShape, Side, VoteMap};

const RING: Mark = Mark::Ring { radius: 5.0 };

/// Data for the picture of one image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptImage {
    pub rows: usize,
    pub range_bin_m: f64,
    /// Azimuths of the first and the last column, rad.
    pub azimuth_rad: [f64; 2],
    /// Levels `[row, azimuth]`, dB above the least value.
    pub level_db: Vec<f32>,
    /// Azimuth (rad) and row of the peaks.
    pub peaks: Vec<[f64; 2]>,
}

impl KeptImage {
    pub fn of(image: &SlopeImage) -> KeptImage {
        let db = |v: &f64| (10.0 * v.max(1.0).log10()) as f32;
        let ends = [image.azimuth_rad.first(), image.azimuth_rad.last()].map(|a| a.copied().unwrap_or(0.0));
        KeptImage {
            rows: image.row_w.len(),
            range_bin_m: image.range_bin_m,
            azimuth_rad: ends,
            level_db: image.spectrum.iter().map(db).collect(),
            peaks: image.peaks.iter().map(|p| [p.source.azimuth_rad, p.range_bin]).collect(),
        }
    }
}

/// Fig. 3: angle over beat frequency, here as the range cell; peaks ringed.
pub fn image(kept: &KeptImage, max_range_m: f64) -> Result<Picture> {
    let columns = kept.level_db.len().checked_div(kept.rows).unwrap_or(0);
    // Left is left: azimuth grows to the left.
    let mirrored = |v: &[f32]| v.iter().rev().map(|x| f64::from(*x)).collect::<Vec<_>>();
    let values: Vec<f64> = kept.level_db.chunks_exact(columns.max(1)).flat_map(mirrored).collect();
    let [first, last] = kept.azimuth_rad.map(|a| -a.to_degrees());
    let last_m = (kept.rows.max(1) - 1) as f64 * kept.range_bin_m;
    let scale = Scale::new(ColourMap::Viridis, "MUSIC spectrum (dB)", 0.0, 30.0);
    let mut chart = heat_map(
        "Radar image of the rising slope (M, Fig. 3)",
        ("direction to the right (deg)", (last, first)),
        ("beat frequency as range (m)", (0.0, last_m)),
        (kept.rows, columns),
        values,
        scale,
    );
    chart.y.hi = chart.y.hi.min(max_range_m);
    let points = kept.peaks.iter().map(|[a, r]| [-a.to_degrees(), r * kept.range_bin_m]);
    chart.marks("peaks", points.filter(|p| p[1] <= max_range_m).collect(), RING, FOUND);
    chart.sized(520.0, 560.0).draw()
}

/// Fig. 4: votes over (a, b), the edges found as rings.
pub fn votes(shape: &RoadShape, settings: &HoughSettings) -> Result<Option<Picture>> {
    let Ok(map) = VoteMap::new(&shape.points, settings) else { return Ok(None) };
    let (columns, rows) = (map.columns(), map.rows());
    // Right below, left above, nothing between them.
    let step = (map.b_m(Side::Left, 1) - map.b_m(Side::Left, 0)).abs().max(1e-3);
    let gap = ((2.0 * map.b_m(Side::Left, 0) / step).round() as usize).saturating_sub(1);
    let all = 2 * rows + gap;
    let mut values = vec![0.0; all * columns];
    for column in 0..columns {
        for row in 0..rows {
            values[(rows - 1 - row) * columns + column] = map.votes(Side::Right)[column * rows + row];
            values[(rows + gap + row) * columns + column] = map.votes(Side::Left)[column * rows + row];
        }
    }
    let top = values.iter().copied().fold(1e-9, f64::max);
    let scale = Scale::new(ColourMap::Viridis, "votes (1/m)", 0.0, top);
    let (a, b) = (map.a_per_m(columns - 1) * 1e3, map.b_m(Side::Left, rows - 1));
    let mut chart = heat_map(
        "Votes for x = a y² + b (M, Fig. 4)",
        ("a to the left (1/km)", (-a, a)),
        ("b to the left (m)", (-b, b)),
        (all, columns),
        values,
        scale,
    );
    chart.height = 460.0;
    let edges = Side::BOTH.into_iter().filter_map(|side| map.edge(side).ok());
    let found = edges.map(|e| [e.a_per_m * 1e3, e.b_m]).collect();
    chart.marks("edges", found, Mark::Ring { radius: 8.0 }, FOUND);
    Ok(Some(chart.draw()?))
}

/// Figs. 5 and 6: the estimated edges over the true ones, with standing points and what moves.
pub fn road(
    points: &[LanePoint],
    step: &Step,
    shape: Option<&RoadShape>,
    cars: &[[f64; 2]],
) -> Result<Picture> {
    let truth = &step.truth;
    let rest: Vec<[f64; 2]> =
        shape.map_or(&[][..], |s| &s.points[..]).iter().map(|p| [p.x_m, p.y_m]).collect();
    let near = |p: &[f64; 2]| rest.iter().any(|q| (p[0] - q[0]).hypot(p[1] - q[1]) < 0.3);
    let other: Vec<[f64; 2]> = points.iter().map(|p| p.at_m).filter(|p| !near(p)).collect();
    let reach = truth.range_m[1] + 20.0;
    let ahead = truth.lines.iter().flatten().filter(|p| p[0] > 0.0 && p[0] < reach);
    let top = ahead.map(|p| p[1].abs()).fold(20.0, f64::max);
    let x = Axis::new("x forward (m)", 0.0, reach);
    let y = Axis::new("y left (m)", -top - 5.0, top + 5.0);
    // Not to scale: a road is long and narrow.
    let mut chart = Chart::new("Estimated and true edges (M, Figs. 5 and 6)", x, y).sized(720.0, 400.0);
    let (grey, red) = (Pen::solid(TRUE, 4.0), Pen::solid(FOUND, 1.8));
    truth.lines.iter().for_each(|line| chart.line(line.clone(), grey));
    chart.estimate(&step.estimate, red);
    let (dot, diamond) = (Mark::Dot { radius: 3.0 }, Mark::Diamond { radius: 6.0 });
    chart.dots(cars.to_vec(), diamond, class_colour("vehicle"));
    chart.key("true edges", Symbol::Line(grey));
    chart.key("estimate, 2σ", Symbol::Area { fill: (FOUND, 0.15), stroke: red });
    chart.marks("standing", rest, dot, SEEN);
    chart.marks("moving", other, dot, OTHER);
    if !cars.is_empty() {
        chart.key("vehicles (true)", Symbol::Mark(diamond, class_colour("vehicle")));
    }
    chart.draw()
}

/// A look of the drive for [`curvature`].
#[derive(Debug, Clone, Copy)]
pub struct Tracked {
    pub time_s: f64,
    pub truth_per_m: Option<f64>,
    /// Curvature c0 (1/m) of the right and the left edge, with its standard deviation.
    pub edges_per_m: [Option<[f64; 2]>; 2],
}

/// Fig. 7: tracked curvature against time over the true one.
pub fn curvature(looks: &[Tracked]) -> Result<Picture> {
    let truth: Vec<[f64; 2]> =
        looks.iter().map(|l| [l.time_s, 1e3 * l.truth_per_m.unwrap_or(f64::NAN)]).collect();
    let (from, to) = (looks.first().map_or(0.0, |l| l.time_s), looks.last().map_or(1.0, |l| l.time_s));
    let of = |k: usize, sigma: f64| -> Vec<[f64; 2]> {
        let value = |l: &Tracked| l.edges_per_m[k].map_or(f64::NAN, |[v, s]| 1e3 * (v + sigma * s));
        looks.iter().map(|l| [l.time_s, value(l)]).collect()
    };
    let curves = [0, 1].map(|k| of(k, 0.0));
    let all = curves.iter().chain([&truth]).flatten().map(|p| p[1]).filter(|v| v.is_finite());
    let (low, high) = all.fold((0.0_f64, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
    // The deviations of a straight road, some 0.1 1/km, are to be seen, too.
    let pad = (0.1 * (high - low)).max(0.25);
    let x = Axis::new("time (s)", from, to.max(from + 0.1));
    let y = Axis::new("curvature to the left (1/km)", low - pad, high + pad);
    let mut chart = Chart::new("Tracked curvature (M, Fig. 7)", x, y);
    chart.width = 680.0;
    chart.named_line("true", truth, Pen::solid(TRUE, 4.0));
    for (k, name) in ["right edge, 1σ", "left edge, 1σ"].into_iter().enumerate() {
        if curves[k].iter().all(|p| !p[1].is_finite()) {
            continue;
        }
        let pen = Pen { width: 1.8, ..curve_pen(k) };
        let (upper, lower) = (of(k, 1.0), of(k, -1.0));
        let bounds: Vec<([f64; 2], [f64; 2])> = upper.into_iter().zip(lower).collect();
        for piece in bounds.split(|b| !b.0[1].is_finite()).filter(|piece| piece.len() > 1) {
            let back = piece.iter().rev().map(|b| b.1);
            chart.area(piece.iter().map(|b| b.0).chain(back).collect(), (pen.colour, 0.15), None);
        }
        chart.named_line(name, curves[k].clone(), pen);
    }
    chart.draw()
}
