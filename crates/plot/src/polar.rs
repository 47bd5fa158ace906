//! Polar charts in decibels: zero degrees up, positive angles to the left, as azimuth runs.

use super::axis::{Axis, tick_labels};
use super::canvas::{Anchor, BLACK, Canvas, GRID, Pen, Picture, Rect, WHITE};
use super::chart::{
    Curve, Key, LABEL_SIZE, TICK_SIZE, draw_header, finite_range, header_height, legend_rows,
};
use super::family::Family;
use catseye::base::error::Result;

/// Curves of (angle in degrees, value). The rings reach from the largest value down by at most 50;
/// smaller values lie in the centre. A curve of which nothing is larger is left out, and named in the legend. Angles within -90 to 90 degrees make a half disc. A curve
/// breaks at NaN and where its angles leap.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn polar(title: &str, radial_label: &str, curves: &[Curve]) -> Result<Picture> {
    polar_family(title, radial_label, &Family::new(curves.to_vec()))
}

/// [`polar`] of curves with their pens.
///
/// # Errors
/// Those of `polar`.
pub(super) fn polar_family(title: &str, radial_label: &str, family: &Family) -> Result<Picture> {
    let Scaled { radial, shown, keys } = scaled(radial_label, family);
    let Family { curves, pens, .. } = family;
    let half = curves.iter().all(|c| c.points.iter().all(|p| p[0].is_nan() || p[0].abs() <= 90.0 + 1e-6));

    const RADIUS: f64 = 270.0;
    const AROUND: f64 = 48.0;
    let width = 2.0 * (RADIUS + AROUND);
    let rows = legend_rows(&keys, width - 32.0);
    let head = header_height(title, width - 32.0, rows.len());
    let (cx, cy) = (0.5 * width, head + 26.0 + RADIUS);
    let ruler_y = if half { cy } else { cy + RADIUS + 32.0 };
    let mut c = Canvas::new(width, ruler_y + 50.0);
    draw_header(&mut c, title, &rows, Rect { x: 16.0, y: head, w: width - 32.0, h: 0.0 });

    let reach = if half { 90.0 } else { 180.0 };
    let at = |angle_deg: f64, r: f64| {
        let a = angle_deg.to_radians();
        (cx - r * a.sin(), cy - r * a.cos())
    };
    let arc =
        |r: f64| -> Vec<(f64, f64)> { (-180..=180).map(|i| at(f64::from(i) * reach / 180.0, r)).collect() };
    let ring_values = radial.ticks(6);
    let radius = |v: f64| (radial.fraction(v) * RADIUS).clamp(0.0, RADIUS);
    for v in &ring_values {
        c.polyline(&arc(radius(*v)), Pen::solid(GRID, 1.0));
    }
    let spokes: Vec<f64> = (-12..=12)
        .map(|i| f64::from(i) * 15.0)
        .filter(|a| a.abs() <= reach && (half || a % 30.0 == 0.0) && *a > -180.0)
        .collect();
    for a in &spokes {
        // Spokes that met in the centre would make a blot.
        c.polyline(&[at(*a, 0.1 * RADIUS), at(*a, RADIUS)], Pen::solid(GRID, 1.0));
    }
    for a in &spokes {
        let (x, y) = at(*a, RADIUS + 9.0);
        let side = a.to_radians().sin();
        let anchor = match side {
            s if s > 0.1 => Anchor::End,
            s if s < -0.1 => Anchor::Start,
            _ => Anchor::Middle,
        };
        let drop = 4.5 - 5.0 * a.to_radians().cos();
        c.text((x, y + drop), &format!("{a:.0}°").replace('-', "−"), TICK_SIZE, anchor, BLACK);
    }

    for i in family.drawn(shown) {
        for piece in pieces(&curves[i].points) {
            let line: Vec<_> = piece.iter().map(|p| at(p[0], radius(p[1]))).collect();
            c.polyline(&line, pens[i]);
        }
    }
    let mut rim = arc(RADIUS);
    if half {
        rim.push(rim[0]);
    }
    c.polyline(&rim, Pen::solid(BLACK, 1.0));

    // The radial scale stands under the disc, where no curve can hide it.
    if !half {
        c.rect(Rect { x: cx, y: ruler_y - 0.5, w: RADIUS, h: 1.0 }, BLACK, 1.0);
    }
    for (v, label) in ring_values.iter().zip(tick_labels(&ring_values)) {
        let x = cx + radial.fraction(*v) * RADIUS;
        c.rect(Rect { x: x - 0.5, y: ruler_y, w: 1.0, h: 5.0 }, BLACK, 1.0);
        c.text((x, ruler_y + 18.0), &label, TICK_SIZE, Anchor::Middle, BLACK);
    }
    c.text((cx + 0.5 * RADIUS, ruler_y + 38.0), &radial.label, LABEL_SIZE, Anchor::Middle, BLACK);
    c.circle((cx, cy), 2.0, Some((BLACK, 1.0)), Some((WHITE, 0.5)));
    c.finish()
}

/// What a disc shows: its scale, which curves, and its legend.
struct Scaled {
    radial: Axis,
    shown: Vec<usize>,
    keys: Vec<Key>,
}

fn scaled(label: &str, family: &Family) -> Scaled {
    let curves = &family.curves;
    let values = curves.iter().flat_map(|c| c.points.iter().map(|p| p[1]));
    let (min, max) = finite_range(values).unwrap_or((-40.0, 0.0));
    let top = (max / 5.0).ceil() * 5.0;
    let bottom = ((min / 10.0).floor() * 10.0).clamp(top - 50.0, top - 20.0);
    let radial = Axis::new(label, bottom, top);
    let above = |c: &Curve| c.points.iter().any(|p| p[1] > radial.lo);
    let shown: Vec<usize> = (0..curves.len()).filter(|i| above(&curves[*i])).collect();
    let mut keys = family.keys(&shown, radial.lo, label);
    if curves.len() == 1 && !shown.is_empty() {
        keys.clear();
    }
    Scaled { radial, shown, keys }
}

/// Splits where a value is NaN or where the angle leaps by more than five times its usual step. The
/// curve is closed when it goes all the way round.
fn pieces(points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let mut steps: Vec<f64> = points.windows(2).map(|w| (w[1][0] - w[0][0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let mut out: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
    let mut previous: Option<f64> = None;
    for p in points {
        if p[0].is_nan() || p[1].is_nan() || p[0].is_infinite() {
            out.push(Vec::new());
            previous = None;
            continue;
        }
        if previous.is_some_and(|a| (p[0] - a).abs() > 5.0 * usual) {
            out.push(Vec::new());
        }
        previous = Some(p[0]);
        if let Some(last) = out.last_mut() {
            last.push(*p);
        }
    }
    if let ([only], Some(first), Some(last)) = (&mut out[..], points.first(), points.last())
        && (last[0] - first[0]).abs() < 360.0
        && (last[0] - first[0]).abs() >= 360.0 - 1.5 * usual
    {
        only.push(*first);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::chart::{Symbol, curve_pen};
    use super::*;

    #[test]
    fn curves_under_the_scale_are_named_and_not_drawn() {
        let flat = |label: &str, v: f64| Curve {
            label: label.into(),
            points: (-90..=90).map(|a| [f64::from(a), v]).collect(),
        };
        let curves = [flat("VV", 3.0), flat("VH", -347.0), flat("HH", -12.0), flat("HV", f64::NEG_INFINITY)];
        let made = scaled("RCS (dBsm)", &Family::new(curves.to_vec()));
        assert_eq!(((made.radial.lo, made.radial.hi), made.shown), ((-45.0, 5.0), vec![0, 2]));
        let keys: Vec<_> = made.keys.iter().map(|k| (k.label.as_str(), k.symbol)).collect();
        assert_eq!(
            keys,
            [
                ("VV", Symbol::Line(curve_pen(0))),
                ("HH", Symbol::Line(curve_pen(2))),
                ("left out, below −45 dBsm: VH, HV", Symbol::Note),
            ]
        );
        // The only curve of a picture may be empty too.
        let keys = scaled("RCS (dBsm)", &Family::new(curves[3..].to_vec())).keys;
        assert_eq!(keys[0].label, "left out, below −40 dBsm: HV");
    }

    #[test]
    fn breaks_and_closing() {
        let all_round: Vec<_> = (-180..180).map(|a| [f64::from(a), 0.0]).collect();
        let p = pieces(&all_round);
        assert!(p.len() == 1 && p[0].len() == 361 && p[0][360] == p[0][0]);
        let two: Vec<_> = (0..10).chain(40..50).map(|a| [f64::from(a), 0.0]).collect();
        assert_eq!(pieces(&two).iter().map(Vec::len).collect::<Vec<_>>(), [10, 10]);
        let mut hole: Vec<_> = (0..5).map(|a| [f64::from(a), 0.0]).collect();
        hole[2][1] = f64::NAN;
        assert_eq!(pieces(&hole).iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
    }
}
