//! Pictures of studies: panels of curves or of maps.

use super::axis::Axis;
use super::canvas::{Pen, Picture};
use super::chart::{
    Chart, ColourMap, Curve, Layer, Mark, Paint, Scale, Symbol, curve_pen, finite_range, heat_map, lines,
};
use super::family::left_out;
use catseye::base::error::Result;

/// One panel of a sheet.
#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    /// Curves over one axis.
    Curves {
        /// Title of the panel.
        title: String,
        /// Label of the horizontal axis.
        x_label: String,
        /// Label of the vertical axis.
        y_label: String,
        /// The curves.
        curves: Vec<Curve>,
        /// Ends of the vertical axis, where they are set.
        limits: Option<[f64; 2]>,
        /// The axis then ends 60 dB below its top.
        decibels: bool,
    },
    /// `values` as `[y, x]`; both axes evenly spaced.
    Map {
        /// Title of the panel.
        title: String,
        /// Label and values of the horizontal axis.
        x: (String, Vec<f64>),
        /// Label and values of the vertical axis.
        y: (String, Vec<f64>),
        /// Value of each cell.
        values: Vec<f64>,
        /// Label of the values.
        label: String,
        /// Ends of the values' colours, where they are set.
        limits: Option<[f64; 2]>,
        /// Levels to outline.
        contours: Vec<f64>,
    },
}

/// Dynamic range of charts in decibels without limits of their own.
const SPAN_DB: f64 = 60.0;
/// Curves of so few points show them.
const FEW: usize = 24;

/// The panels on one sheet, `columns` side by side.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn study_picture(panels: &[Panel], columns: usize) -> Result<Picture> {
    let pictures = panels.iter().map(|p| chart(p).draw()).collect::<Result<Vec<_>>>()?;
    Ok(Picture::sheet(&pictures, columns))
}

fn chart(panel: &Panel) -> Chart {
    match panel {
        Panel::Curves { title, x_label, y_label, curves, limits, decibels } => {
            let mut chart = lines(title, x_label, y_label, curves);
            let (lo, hi) = match limits {
                Some([lo, hi]) => (*lo, *hi),
                None => {
                    let all = curves.iter().flat_map(|c| c.points.iter().map(|p| p[1]));
                    let (lo, hi) = finite_range(all).unwrap_or((0.0, 1.0));
                    (if *decibels { lo.max(hi - SPAN_DB) } else { lo }, hi)
                }
            };
            let y = Axis::new(y_label.clone(), lo, hi);
            chart.y = if limits.is_some() { y } else { y.to_ticks(8) };
            let bottom = chart.y.lo;
            let dot = Mark::Dot { radius: 3.0 };
            let seen = |c: &Curve| !*decibels || c.points.iter().any(|p| p[1] >= bottom);
            chart.keys.clear();
            for (i, c) in curves.iter().enumerate().filter(|(_, c)| curves.len() > 1 && seen(c)) {
                let pen = curve_pen(i);
                let few = c.points.len() <= FEW;
                chart.key(c.label.clone(), if few { Symbol::Marked(pen, dot) } else { Symbol::Line(pen) });
            }
            let hidden = curves.iter().filter(|c| !seen(c)).map(|c| c.label.clone()).collect();
            chart.keys.extend(left_out(hidden, bottom, y_label));
            for layer in &mut chart.layers {
                if let Layer::Line { points, .. } = layer {
                    // A zero amplitude is a point far below, not a gap.
                    points.iter_mut().filter(|p| p[1] == f64::NEG_INFINITY).for_each(|p| p[1] = bottom - 1e3);
                }
            }
            for (i, c) in curves.iter().enumerate().filter(|(_, c)| c.points.len() <= FEW) {
                chart.layers.push(Layer::Marks {
                    points: c.points.clone(),
                    mark: dot,
                    paint: Paint::Fixed(curve_pen(i).colour),
                });
            }
            chart
        }
        Panel::Map { title, x, y, values, label, limits, contours } => {
            let ends = |v: &[f64]| (v.first().copied().unwrap_or(0.0), v.last().copied().unwrap_or(1.0));
            let (lo, hi) = match limits {
                Some([lo, hi]) => (*lo, *hi),
                None => {
                    let (lo, hi) = finite_range(values.iter().copied()).unwrap_or((0.0, 1.0));
                    (lo.max(hi - SPAN_DB), hi)
                }
            };
            let mut chart = heat_map(
                title,
                (&x.0, ends(&x.1)),
                (&y.0, ends(&y.1)),
                (y.1.len(), x.1.len()),
                values.clone(),
                Scale::new(ColourMap::Viridis, label.clone(), lo, hi),
            );
            let pen = Pen::solid([220, 30, 30], 1.4);
            let mut outlined = Vec::new();
            for &level in contours {
                let pieces = outline(&x.1, &y.1, values, level);
                if !pieces.is_empty() {
                    outlined.push(level.to_string().replace('-', "−"));
                }
                chart
                    .layers
                    .extend(pieces.into_iter().map(|line| Layer::Line { points: line.to_vec(), pen }));
            }
            if !outlined.is_empty() {
                chart.key(format!("{label} = {}", outlined.join(", ")), Symbol::Line(pen));
            }
            chart
        }
    }
}

/// Pieces of the line on which the map has a level (marching squares; the saddle is cut both ways).
fn outline(x: &[f64], y: &[f64], values: &[f64], level: f64) -> Vec<[[f64; 2]; 2]> {
    let mut pieces = Vec::new();
    let v = |i: usize, j: usize| values[j * x.len() + i];
    let cut = |a: f64, b: f64, va: f64, vb: f64| {
        let t = (level - va) / (vb - va);
        a + (b - a) * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
    };
    for j in 1..y.len() {
        for i in 1..x.len() {
            let corners = [v(i - 1, j - 1), v(i, j - 1), v(i, j), v(i - 1, j)];
            if corners.iter().any(|c| c.is_nan()) {
                continue;
            }
            let [a, b, c, d] = corners;
            let (x0, x1, y0, y1) = (x[i - 1], x[i], y[j - 1], y[j]);
            // Where the level crosses the four sides.
            let sides = [
                (a, b, [cut(x0, x1, a, b), y0]),
                (b, c, [x1, cut(y0, y1, b, c)]),
                (d, c, [cut(x0, x1, d, c), y1]),
                (a, d, [x0, cut(y0, y1, a, d)]),
            ];
            let crossed = sides.iter().filter(|(p, q, _)| (*p >= level) != (*q >= level));
            let ends: Vec<[f64; 2]> = crossed.map(|s| s.2).collect();
            pieces.extend(ends.chunks_exact(2).map(|e| [e[0], e[1]]));
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_of_a_cone_is_a_circle() {
        let axis: Vec<f64> = (-20..=20).map(|i| f64::from(i) * 0.1).collect();
        let values: Vec<f64> =
            axis.iter().flat_map(|y| axis.iter().map(move |x| -(x * x + y * y).sqrt())).collect();
        let pieces = outline(&axis, &axis, &values, -1.0);
        assert!(pieces.len() > 40);
        let mut length = 0.0;
        for [a, b] in pieces {
            assert!((a[0].hypot(a[1]) - 1.0).abs() < 0.01, "{a:?}");
            length += (a[0] - b[0]).hypot(a[1] - b[1]);
        }
        assert!((length - std::f64::consts::TAU).abs() < 0.05, "{length}");
    }

    #[test]
    fn legends_of_panels_show_dots_levels_and_what_is_left_out() {
        let flat = |label: &str, v: f64, n: usize| Curve {
            label: label.into(),
            points: (0..n).map(|i| [i as f64, v]).collect(),
        };
        let panel = Panel::Curves {
            title: String::new(),
            x_label: "x".into(),
            y_label: "RCS (dBsm)".into(),
            curves: vec![flat("few", 3.0, 5), flat("many", -10.0, 99), flat("none", -300.0, 99)],
            limits: None,
            decibels: true,
        };
        let drawn = chart(&panel);
        let dot = Mark::Dot { radius: 3.0 };
        let symbols: Vec<Symbol> = drawn.keys.iter().map(|k| k.symbol).collect();
        assert_eq!(symbols, [Symbol::Marked(curve_pen(0), dot), Symbol::Line(curve_pen(1)), Symbol::Note]);
        assert!(drawn.keys[2].label.ends_with("dBsm: none"), "{:?}", drawn.keys);
        let map = Panel::Map {
            title: String::new(),
            x: ("x".into(), vec![0.0, 1.0]),
            y: ("y".into(), vec![0.0, 1.0]),
            values: vec![-20.0, 0.0, -20.0, 0.0],
            label: "RCS (dBsm)".into(),
            limits: None,
            contours: vec![-10.0, 50.0],
        };
        let labels: Vec<String> = chart(&map).keys.into_iter().map(|k| k.label).collect();
        assert_eq!(labels, ["RCS (dBsm) = −10"]);
    }

    #[test]
    fn panels_stand_side_by_side() {
        let panel = Panel::Curves {
            title: "a".into(),
            x_label: "x (m)".into(),
            y_label: "RCS (dBsm)".into(),
            curves: vec![Curve {
                label: "c".into(),
                points: vec![[0.0, f64::NEG_INFINITY], [1.0, -10.0], [2.0, f64::NAN]],
            }],
            limits: None,
            decibels: true,
        };
        let one = study_picture(std::slice::from_ref(&panel), 2).unwrap();
        let three = study_picture(&[panel.clone(), panel.clone(), panel], 2).unwrap();
        assert_eq!(three.pixels().width(), 2 * one.pixels().width());
        assert_eq!(three.pixels().height(), 2 * one.pixels().height());
    }
}
