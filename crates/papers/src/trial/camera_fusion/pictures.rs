//! The document's figures: the picture with its trapezoid and lines (1, 11, 13), the lane on the ground (2, 12, 14), the fits to a way
//! (4), recognition step by step (15, 16); and what each sensor sees by day, by night, in fog and against the sun.

use crate::trial::kit::*;
use catseye_lane::camera_fusion::{Camera, Image, Insight, Part, Trapezoid, compare_fits};
use catseye_lane::camera_fusion::{CameraFusionOptions, Condition};

/// The sensors that an estimator uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensors {
    CameraAlone,
    Both,
    RadarAlone,
}

impl Sensors {
    pub const ALL: [Sensors; 3] = [Sensors::CameraAlone, Sensors::Both, Sensors::RadarAlone];

    pub fn name(self) -> &'static str {
        ["camera alone", "camera and radar", "radar alone"][self as usize]
    }
}

/// The data from which pictures are drawn.
pub struct Shown {
    pub time_s: f64,
    pub image: Image,
    pub condition: Condition,
    pub sensors: Sensors,
    pub step: Step,
    pub insight: Insight,
}

const YELLOW: Rgb = [250, 210, 0];
const GREYS: usize = 64;

pub(super) fn draw(settings: &CameraFusionOptions, shown: &[Shown], trial: &mut Trial) -> Result<()> {
    let camera = settings.camera.camera();
    let Ok(trapezoid) =
        Trapezoid::of_ground(&camera, settings.seen_m[0], settings.seen_m[1], settings.half_width_m)
    else {
        return Ok(());
    };
    let main: Vec<&Shown> = shown
        .iter()
        .filter(|s| s.sensors == Sensors::Both && s.condition == settings.conditions[0])
        .collect();
    // The look that shows most: the parts joined, and as late as can be.
    let Some(best) = main.iter().rev().find(|s| joined(s)).or(main.last()) else { return Ok(()) };
    let title = format!("Picture at {:.1} s", best.time_s);
    let picture = image_chart(&title, best, &camera, &trapezoid, 2);
    let title = format!("Lane at {:.1} s: camera, built middle, radar", best.time_s);
    let lane = ground(&title, best, 760.0, 520.0, true);
    for (name, chart) in [("picture", Some(picture)), ("lane", Some(lane)), ("fits", fits(best))] {
        if let Some(chart) = chart {
            trial.pictures.push((name.into(), chart.draw()?));
        }
    }
    let step = |s: &&Shown| ground(&format!("Step at {:.1} s", s.time_s), s, 430.0, 330.0, false).draw();
    let steps: Vec<Picture> = main.iter().take(6).map(step).collect::<Result<_>>()?;
    if steps.len() > 1 {
        trial.pictures.push(("steps".into(), Picture::sheet(&steps, 3)));
    }
    if settings.conditions.len() > 1 {
        trial.pictures.push(("conditions".into(), conditions(settings, shown, best, &camera, &trapezoid)?));
    }
    Ok(())
}

fn joined(s: &Shown) -> bool {
    s.insight.recognition.as_ref().is_some_and(|r| r.choice.is_some())
}

/// For each condition a row: the picture, and the lane by the camera, by both and by the radar, at the time of `best`.
fn conditions(
    settings: &CameraFusionOptions,
    shown: &[Shown],
    best: &Shown,
    camera: &Camera,
    trapezoid: &Trapezoid,
) -> Result<Picture> {
    let mut out = Vec::new();
    for condition in &settings.conditions {
        for (k, sensors) in Sensors::ALL.iter().enumerate() {
            let at =
                |s: &&Shown| s.time_s == best.time_s && s.condition == *condition && s.sensors == *sensors;
            let Some(s) = shown.iter().find(at) else { continue };
            if k == 0 {
                let title = format!("{}, {:.1} s", condition.name(), s.time_s);
                out.push(image_chart(&title, s, camera, trapezoid, 3).draw()?);
            }
            let none = if s.step.estimate.no_lane.is_some() { ", no lane" } else { "" };
            let title = format!("{}: {}{none}", condition.name(), sensors.name());
            out.push(ground(&title, s, 330.0, 260.0, false).draw()?);
        }
    }
    Ok(Picture::sheet(&out, 4))
}

/// The grey picture, every pixel `1 / coarse` of its side in the file, with the trapezoid and the lines that were found.
fn image_chart(title: &str, shown: &Shown, camera: &Camera, t: &Trapezoid, coarse: usize) -> Chart {
    let Shown { image, insight, .. } = shown;
    let (w, h) = (image.width_px(), image.height_px());
    let (columns, rows) = (w / coarse, h / coarse);
    let mut values = Vec::with_capacity(rows * columns);
    for r in 0..rows {
        for c in 0..columns {
            let block = (0..coarse).flat_map(|k| &image.row(r * coarse + k)[c * coarse..(c + 1) * coarse]);
            let mean = f64::from(block.sum::<f32>()) / (coarse * coarse) as f64;
            // As screens show it.
            values.push((mean.clamp(0.0, 1.0).powf(1.0 / 2.2) * (GREYS - 1) as f64).round());
        }
    }
    let colours = (0..GREYS).map(|k| [(k * 255 / (GREYS - 1)) as u8; 3]).collect();
    let (wide, high) = (w as f64, h as f64);
    let width = if coarse > 2 { 360.0 } else { 720.0 };
    let mut chart =
        Chart::new(title, Axis::new("u (px)", 0.0, wide), Axis::new("v (px)", 0.0, high).reversed())
            .sized(width, width * high / wide);
    chart.grid = false;
    let (x, y) = ((0.0, (columns * coarse) as f64), (0.0, (rows * coarse) as f64));
    chart.layers.push(Layer::Classes { x, y, rows, columns, values, colours });
    let top = t.top_u_px.map(|u| [u, t.top_v_px]);
    let bottom = t.bottom_u_px.map(|u| [u, t.bottom_v_px]);
    let corners = vec![top[0], top[1], bottom[1], bottom[0], top[0]];
    chart.named_line("trapezoid", corners, Pen::solid(YELLOW, 1.5));
    let green = Pen::solid(OTHER, 2.0);
    for line in insight.near.iter().flat_map(|n| [&n.left, &n.right]).flatten() {
        let points = line.curve.samples(40, 0.0).into_iter();
        let points = points.filter_map(|p| camera.pixel_from_ground(p).ok()).map(|p| p.to_array());
        chart.line(points.collect(), green);
    }
    if insight.near.is_some() {
        chart.key("lane lines found", Symbol::Line(green));
    }
    chart
}

/// Bounds that hold the lane and the ways.
fn bounds(truth: &TrueLanes, insight: &Insight) -> ([f64; 2], [f64; 2]) {
    let reach = truth.range_m[1];
    let near = |p: &DVec2| p.x > -5.0 && p.length() < 1.3 * reach;
    let lines = truth.lines.iter().flatten().map(|p| DVec2::from_array(*p)).filter(near);
    let ways = insight.ways.iter().flat_map(|w| w.points_m.iter().copied()).filter(near);
    let (mut lo, mut hi) = (DVec2::new(0.0, -6.0), DVec2::new(30.0, 6.0));
    for p in lines.chain(ways) {
        (lo, hi) = (lo.min(p), hi.max(p));
    }
    ([lo.x, hi.x + 2.0], [lo.y - 2.0, hi.y + 2.0])
}

/// The lane from above; `key` for a legend.
fn ground(title: &str, s: &Shown, width: f64, height: f64, key: bool) -> Chart {
    let (truth, insight) = (&s.step.truth, &s.insight);
    let (x, y) = bounds(truth, insight);
    let mut chart =
        Chart::new(title, Axis::new("x forward (m)", x[0], x[1]), Axis::new("y left (m)", y[0], y[1]))
            .equal_scale(width, height);
    let grey = Pen::solid(TRUE, 3.0);
    truth.lines.iter().for_each(|line| chart.line(line.clone(), grey));
    for way in &insight.ways {
        chart.dots(way.points_m.iter().map(DVec2::to_array).collect(), Mark::Dot { radius: 2.0 }, SEEN);
    }
    let pen = |part: Part| match part {
        Part::Camera => Pen::solid(OTHER, 2.0),
        Part::Middle => Pen::dashed(FOUND, 2.0, [7.0, 4.0]),
        Part::Radar => Pen::solid(SEEN, 2.0),
    };
    if let Some(r) = insight.recognition.as_ref().filter(|_| s.step.estimate.no_lane.is_none()) {
        for points in [&r.left_m, &r.right_m] {
            let mut from = 0;
            for i in 1..=points.len() {
                if i == points.len() || r.parts[i] != r.parts[from] {
                    // On to the next part's first point, so that no gap shows.
                    let to = (i + 1).min(points.len());
                    chart.line(points[from..to].iter().map(DVec2::to_array).collect(), pen(r.parts[from]));
                    from = i;
                }
            }
        }
    }
    if key {
        chart.key("true lines", Symbol::Line(grey));
        chart.key("camera", Symbol::Line(pen(Part::Camera)));
        chart.key("built middle", Symbol::Line(pen(Part::Middle)));
        chart.key("radar", Symbol::Line(pen(Part::Radar)));
        if !insight.ways.is_empty() {
            chart.key("tracks of cars ahead", Symbol::Mark(DOT, SEEN));
        }
    }
    chart
}

/// A way with its parabola and its spline, in the way's own frame: along it and across it, which is drawn larger.
fn fits(s: &Shown) -> Option<Chart> {
    let way = s.insight.ways.iter().max_by_key(|w| w.points_m.len())?;
    let c = compare_fits(&way.points_m, 5).ok()?;
    let e = DVec2::from_angle(c.parabola.axis_rad);
    let own = |p: DVec2| [(p - c.parabola.origin_m).dot(e), (p - c.parabola.origin_m).dot(e.perp())];
    let points: Vec<[f64; 2]> = way.points_m.iter().map(|p| own(*p)).collect();
    let [a, b] = c.parabola.span_m;
    let along = (0..=100).map(|i| a + (b - a) * f64::from(i) / 100.0);
    let parabola: Vec<[f64; 2]> = along.clone().map(|u| own(c.parabola.point(u))).collect();
    let spline: Vec<[f64; 2]> = along.map(|u| own(c.spline.point(u))).collect();
    let all = || points.iter().chain(&parabola).chain(&spline);
    let most = all().map(|p| p[1].abs()).fold(0.05, f64::max);
    let title = format!(
        "Track of a car ahead: left-out errors {:.3} m (parabola), {:.3} m (B-spline)",
        c.parabola_left_out_rms_m, c.spline_left_out_rms_m
    );
    let x = Axis::new("along the track (m)", a - 1.0, b + 1.0);
    let y = Axis::new("across (m)", -1.2 * most, 1.2 * most);
    let mut chart = Chart::new(title, x, y).sized(680.0, 330.0);
    let (red, green) = (Pen::solid(FOUND, 2.0), Pen::solid(OTHER, 2.0));
    chart.line(spline, green);
    chart.line(parabola, red);
    chart.marks("track", points, DOT, SEEN);
    chart.key("parabola, least squares", Symbol::Line(red));
    chart.key("cubic B-spline", Symbol::Line(green));
    Some(chart)
}
