//! The near part: the painted lines of the own lane, found in one image and fitted on the ground.

use super::camera::{Camera, Image, Trapezoid};
use super::curve::{Parabola, least_squares};
use super::edges::{Edge, EdgeSettings, HoughLine, HoughSettings, edges, hough_lines};
use crate::error::{LaneError, positive};
use crate::numeric::wrapped;
use glam::{DMat2, DVec2};

/// Settings of [`find_near_lane`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearSettings {
    /// Settings of the edge detection.
    pub edges: EdgeSettings,
    /// Settings of the search for straight lines.
    pub hough: HoughSettings,
    /// Least and largest width of a painted line, m.
    pub stripe_m: [f64; 2],
    /// Least and largest distance between the lane's lines, m.
    pub lane_m: [f64; 2],
    /// Largest angle of a line to the vehicle's axis at the vehicle, rad.
    pub steepest_rad: f64,
    /// Largest angle between the left and the right line, rad.
    pub apart_rad: f64,
}

impl Default for NearSettings {
    fn default() -> Self {
        NearSettings {
            edges: EdgeSettings::default(),
            hough: HoughSettings::default(),
            stripe_m: [0.05, 0.4],
            lane_m: [2.5, 4.5],
            steepest_rad: 0.35,
            apart_rad: 0.07,
        }
    }
}

/// The middle of one painted line on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct NearLine {
    /// The line's centre on the ground.
    pub curve: Parabola,
    /// Fitted width of the paint, m.
    pub stripe_m: f64,
    /// The two straight lines in the image: left edge and right edge of the paint.
    pub hough: [HoughLine; 2],
}

/// The own lane as the camera sees it; at least one line is present.
#[derive(Debug, Clone, PartialEq)]
pub struct NearLane {
    /// The line to the left of the car.
    pub left: Option<NearLine>,
    /// The line to the right of the car.
    pub right: Option<NearLine>,
}

/// Largest number of edge pairs, the strongest first, that are fitted on the ground.
const MOST_STRIPES: usize = 8;

/// A painted line as two straight edges in the image, with its direction on the ground.
struct Stripe {
    hough: [HoughLine; 2],
    heading_rad: f64,
    votes: usize,
}

/// Finds the left and right line of the own lane. The steps are: edges, Hough lines inside the trapezoid,
/// pairs of edges that are the two sides of one paint (dark to bright, then bright to dark), and the pair of
/// paints left and right of the car at a lane's distance. Last comes a parabola on the ground through the
/// edges of each paint, as Hough lines alone make every road straight (Sangeetha Lakshmi section 4.3 names
/// that as the method's limit).
///
/// # Errors
/// Returns an error if the camera, the trapezoid or a setting is invalid, if the image does not have the
/// camera's size, or [`LaneError::NoLaneLine`] if no line is found.
pub fn find_near_lane(
    camera: &Camera,
    image: &Image,
    trapezoid: &Trapezoid,
    settings: &NearSettings,
) -> Result<NearLane, LaneError> {
    camera.validate()?;
    positive("the minimum width of a painted line", settings.stripe_m[0])?;
    positive("the minimum width of a lane", settings.lane_m[0])?;
    if (image.width_px(), image.height_px()) != (camera.width_px, camera.height_px) {
        let value = image.width_px() as f64;
        return Err(LaneError::out_of_range("the image's width", value, "the camera's size"));
    }
    let found = edges(image, trapezoid, &settings.edges)?;
    let lines = hough_lines(&found.edges, &settings.hough)?;
    let mut stripes = stripes(camera, trapezoid, &lines, settings);
    stripes.sort_by_key(|s| std::cmp::Reverse(s.votes));
    stripes.truncate(MOST_STRIPES);
    let on_ground_plane = ground_edges(camera, &found.edges);
    let fitted: Vec<(usize, NearLine)> = stripes
        .iter()
        .filter_map(|s| Some((s.votes, on_ground(camera, &on_ground_plane, s, settings)?)))
        .collect();
    let mut best: Option<(usize, usize, usize, f64)> = None;
    for (i, (vl, l)) in fitted.iter().enumerate() {
        for (j, (vr, r)) in fitted.iter().enumerate() {
            let Some((width, apart, offset)) = pair(l, r) else { continue };
            // The car stands between the two.
            let fits = (settings.lane_m[0]..=settings.lane_m[1]).contains(&width)
                && apart <= settings.apart_rad
                && offset > -width
                && offset <= 0.0;
            if i != j && fits && best.is_none_or(|(v, ..)| vl + vr > v) {
                best = Some((vl + vr, i, j, width));
            }
        }
    }
    let lane = match best {
        Some((_, i, j, width)) => {
            // So far a dashed line is one dash; the others are found along its partner.
            let (l, r) = (&fitted[i].1, &fitted[j].1);
            let (mut left, mut right) = (l.clone(), r.clone());
            if l.curve.length_m() < r.curve.length_m() {
                left = longer(l, &beside(&r.curve, width), &on_ground_plane, settings);
            } else {
                right = longer(r, &beside(&l.curve, -width), &on_ground_plane, settings);
            }
            NearLane { left: Some(left), right: Some(right) }
        }
        None => {
            // One line alone must lie within a lane's width of the car.
            let y_car = |l: &NearLine| offset_of(&l.curve);
            let one = fitted
                .iter()
                .filter(|(_, l)| y_car(l).abs() <= 0.75 * settings.lane_m[1])
                .max_by_key(|(votes, _)| *votes)
                .map(|(_, l)| l.clone());
            match one {
                Some(l) if y_car(&l) > 0.0 => NearLane { left: Some(l), right: None },
                other => NearLane { left: None, right: other },
            }
        }
    };
    if lane.left.is_none() && lane.right.is_none() { Err(LaneError::NoLaneLine) } else { Ok(lane) }
}

/// Distance of a line to the left of the car where it passes beside it, m.
fn offset_of(curve: &Parabola) -> f64 {
    let u = curve.coordinate(DVec2::ZERO);
    // A parabola is not trusted farther back than its own length.
    let u = u.max(curve.span_m[0] - curve.length_m());
    let normal = DVec2::from_angle(curve.heading_rad(u)).perp();
    curve.point(u).dot(normal)
}

/// Distance between a left and a right line (m) and the angle between them (rad), at the middle of the
/// shorter one, and how far to the left of the car the right one runs (m). Lines of a bend differ in heading
/// when they are seen at different distances, so they are compared at one place.
fn pair(left: &NearLine, right: &NearLine) -> Option<(f64, f64, f64)> {
    let left_is_short = left.curve.length_m() < right.curve.length_m();
    let (short, long) = if left_is_short { (&left.curve, &right.curve) } else { (&right.curve, &left.curve) };
    let u = 0.5 * (short.span_m[0] + short.span_m[1]);
    let p = short.point(u);
    let v = foot(long, p);
    let heading = long.heading_rad(v);
    let across = (p - long.point(v)).dot(DVec2::from_angle(heading).perp());
    let width = if left_is_short { across } else { -across };
    let apart = wrapped(short.heading_rad(u) - heading).abs();
    let at_car = offset_of(long);
    let offset = if left_is_short { at_car } else { at_car - width };
    (width.is_finite() && apart.is_finite()).then_some((width, apart, offset))
}

/// The coordinate u at which a parabola is closest to a point.
fn foot(curve: &Parabola, p: DVec2) -> f64 {
    let mut u = curve.coordinate(p);
    for _ in 0..4 {
        let heading = DVec2::from_angle(curve.heading_rad(u));
        u += (p - curve.point(u)).dot(heading);
    }
    u
}

/// The line moved to the left, as a start of a fit.
fn beside(curve: &Parabola, left_m: f64) -> Parabola {
    let u = 0.5 * (curve.span_m[0] + curve.span_m[1]);
    let normal = DVec2::from_angle(curve.heading_rad(u)).perp();
    Parabola { origin_m: curve.origin_m + normal * left_m, ..curve.clone() }
}

/// The line fitted again along a curve, if that fit holds more of its edges.
fn longer(line: &NearLine, along: &Parabola, edges: &[GroundEdge], settings: &NearSettings) -> NearLine {
    // The paint that was found stays where it is: the start is moved onto it.
    let u = 0.5 * (line.curve.span_m[0] + line.curve.span_m[1]);
    let v = foot(along, line.curve.point(u));
    let off = line.curve.point(u) - along.point(v);
    let start = Parabola { origin_m: along.origin_m + off, ..along.clone() };
    match fit_along(start, line.stripe_m, edges, settings, &line.hough) {
        Some(new) if new.curve.count > line.curve.count => new,
        _ => line.clone(),
    }
}

/// Ground points of a straight image line at its lowest and topmost edge, m.
fn ground_ends(camera: &Camera, line: &HoughLine) -> Option<[DVec2; 2]> {
    let at = |v: f64| camera.ground_from_pixel(DVec2::new(line.column(v)?, v)).ok();
    Some([at(line.rows_px[1])?, at(line.rows_px[0])?])
}

fn stripes(
    camera: &Camera,
    trapezoid: &Trapezoid,
    lines: &[HoughLine],
    settings: &NearSettings,
) -> Vec<Stripe> {
    // Lines are compared on the ground in the lower third of the trapezoid, where a pixel is small.
    let v = trapezoid.bottom_v_px.min(camera.height_px as f64) * 0.67 + trapezoid.top_v_px * 0.33;
    let Ok(reference) = camera.ground_from_pixel(DVec2::new(camera.centre_px.x, v)) else {
        return Vec::new();
    };
    let grounded: Vec<(&HoughLine, f64, f64)> = lines
        .iter()
        .filter_map(|l| {
            let [a, b] = ground_ends(camera, l)?;
            let d = b - a;
            let heading = d.y.atan2(d.x);
            let y = a.y + (reference.x - a.x) * heading.tan();
            (heading.abs() <= settings.steepest_rad && d.x > 1.0).then_some((l, y, heading))
        })
        .collect();
    let mut out = Vec::new();
    for (l, y, heading) in grounded.iter().filter(|g| g.0.theta_rad.cos() > 0.0) {
        let partner = grounded
            .iter()
            .filter(|(r, yr, hr)| {
                r.theta_rad.cos() < 0.0
                    && (settings.stripe_m[0]..=settings.stripe_m[1]).contains(&(y - yr))
                    && (heading - hr).abs() < 0.5 * settings.apart_rad
                    // Both edges are seen over common rows.
                    && r.rows_px[0].max(l.rows_px[0]) < r.rows_px[1].min(l.rows_px[1])
            })
            .collect::<Vec<_>>();
        // Paint ends at the first edge from bright to dark; a kerb's may be the stronger one behind it.
        let most = partner.iter().map(|p| p.0.votes).max().unwrap_or(0);
        let first = partner.into_iter().filter(|p| 3 * p.0.votes >= most).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((r, _, hr)) = first {
            out.push(Stripe {
                hough: [(*l).clone(), (*r).clone()],
                heading_rad: 0.5 * (heading + hr),
                votes: l.votes.min(r.votes),
            });
        }
    }
    out
}

/// An edge projected to the ground.
struct GroundEdge {
    point_m: DVec2,
    /// Position across the paint in paint widths: 0.5 on its left edge, -0.5 on its right edge.
    side: f64,
    /// Shift on the ground for one pixel along the edge's normal, m.
    shift_m: DVec2,
    /// Matrix from ground metres to pixels.
    to_pixel: DMat2,
    normal: DVec2,
}

/// Projects the edges below the horizon to the ground.
fn ground_edges(camera: &Camera, all: &[Edge]) -> Vec<GroundEdge> {
    let turned = camera.rotation();
    let of = |e: &Edge| {
        let (point_m, [du, dv]) = camera.ground_at(&turned, e.pixel)?;
        let normal = DVec2::from_angle(e.normal_rad);
        Some(GroundEdge {
            point_m,
            side: if normal.x > 0.0 { 0.5 } else { -0.5 },
            shift_m: du * normal.x + dv * normal.y,
            to_pixel: DMat2::from_cols(du, dv).inverse(),
            normal,
        })
    };
    all.iter().filter_map(of).collect()
}

/// Fits a parabola to the paint's centre, and its width, from edges near it. The fit starts from the straight
/// line over the rows where that was seen and takes in more edges as the curve improves. Its axis follows the
/// curve, since a parabola in a frame along its chord stays close to a circle for longest.
fn on_ground(
    camera: &Camera,
    edges: &[GroundEdge],
    stripe: &Stripe,
    settings: &NearSettings,
) -> Option<NearLine> {
    let [a, b] = ground_ends(camera, &stripe.hough[0])?;
    let [c, d] = ground_ends(camera, &stripe.hough[1])?;
    let half = 0.5 * (b.distance(a)).max(d.distance(c));
    let start = Parabola {
        origin_m: 0.25 * (a + b + c + d),
        axis_rad: stripe.heading_rad,
        a: [0.0; 3],
        span_m: [-half, half],
        covariance: [[0.0; 3]; 3],
        residual_m: 0.0,
        count: 0,
    };
    fit_along(start, 0.15, edges, settings, &stripe.hough)
}

/// Fits a line from a start curve that lies near the paint's centre over its span.
fn fit_along(
    start: Parabola,
    paint_m: f64,
    edges: &[GroundEdge],
    settings: &NearSettings,
    hough: &[HoughLine; 2],
) -> Option<NearLine> {
    let (mut curve, mut stripe_m) = (start, paint_m);
    let half = 0.5 * curve.length_m();
    let mut noise_px = f64::INFINITY;
    for round in 0..8 {
        let gate: f64 = if round < 2 { 0.12 } else { 0.07 };
        // Each round reaches a quarter farther: no farther than the curve so far can be trusted.
        let grow = if round == 0 { 0.5 } else { 0.25 * curve.length_m() };
        let reach = [curve.span_m[0] - grow, curve.span_m[1] + grow];
        let centre = curve.point(0.5 * (curve.span_m[0] + curve.span_m[1]));
        let axis_rad = curve.heading_rad(0.5 * (curve.span_m[0] + curve.span_m[1]));
        let e = DVec2::from_angle(axis_rad);
        let mut columns = vec![Vec::new(); 4];
        let (mut rhs, mut sigmas, mut span) = (Vec::new(), 0.0, [f64::INFINITY, f64::NEG_INFINITY]);
        let scale = half.max(1.0);
        let along = DVec2::from_angle(curve.axis_rad);
        for g in edges {
            let d = g.point_m - curve.origin_m;
            let u = d.dot(along);
            let w = curve.a[0] + u * (curve.a[1] + u * curve.a[2]);
            let aside = along.perp_dot(d) - w;
            if !(reach[0]..=reach[1]).contains(&u) || aside.abs() > 1.0 {
                continue;
            }
            let slope = curve.a[1] + 2.0 * u * curve.a[2];
            let cosine = 1.0 / (1.0 + slope * slope).sqrt();
            let heading = (along + along.perp() * slope) * cosine;
            let off = aside * cosine - g.side * stripe_m;
            let sigma = g.shift_m.dot(heading.perp()).abs().max(1e-3);
            // The ends of a dash run across the line and say nothing about its course.
            let across = (g.to_pixel * heading).normalize_or_zero().dot(g.normal).abs();
            if !(off.abs() < gate.max(2.0 * sigma) && across < 0.2) {
                continue;
            }
            let p = g.point_m - centre;
            let (u, w, root) = (p.dot(e), p.dot(e.perp()), 1.0 / sigma);
            columns
                .iter_mut()
                .zip([1.0, u / scale, (u / scale).powi(2), g.side])
                .for_each(|(c, v)| c.push(v * root));
            rhs.push(w * root);
            sigmas += sigma;
            span = [span[0].min(u), span[1].max(u)];
        }
        let Ok(s) = least_squares(&columns, &rhs) else { break };
        let variance = s.variance();
        // A road that departs from the parabola shows in the residual; then the last curve stays.
        if variance.sqrt() > (1.5 * noise_px).max(0.4) {
            break;
        }
        noise_px = noise_px.min(variance.sqrt());
        let unit = [1.0, 1.0 / scale, 1.0 / (scale * scale), 1.0];
        stripe_m = s.coefficients[3];
        curve = Parabola {
            origin_m: centre,
            axis_rad,
            a: std::array::from_fn(|i| s.coefficients[i] * unit[i]),
            span_m: span,
            covariance: std::array::from_fn(|i| {
                std::array::from_fn(|j| s.inverse_normal[i * 4 + j] * variance * unit[i] * unit[j])
            }),
            residual_m: variance.sqrt() * sigmas / rhs.len() as f64,
            count: rhs.len(),
        };
    }
    let whole = (settings.stripe_m[0]..=settings.stripe_m[1]).contains(&stripe_m);
    (whole && curve.count > 0 && curve.length_m() > 2.0).then(|| NearLine {
        curve,
        stripe_m,
        hough: hough.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::synth::{CLEAR, Road, Weather, camera, render};
    use super::*;

    const LINES: [(f64, bool); 3] = [(1.75, true), (-1.75, false), (5.25, false)];

    fn see(road: &Road, weather: &Weather, seed: u64) -> Result<NearLane, LaneError> {
        let c = camera();
        let t = Trapezoid::of_ground(&c, 6.0, 35.0, 6.0).unwrap();
        find_near_lane(&c, &render(&c, road, &LINES, weather, seed), &t, &NearSettings::default())
    }

    /// (root mean square, largest) distance of a line from where it was painted, from 6 m to its far end.
    fn error(line: &NearLine, road: &Road, left_m: f64) -> (f64, f64) {
        let e: Vec<f64> = line.curve.samples(40, 0.0).iter().map(|p| road.frenet(*p).1 - left_m).collect();
        ((e.iter().map(|e| e * e).sum::<f64>() / 40.0).sqrt(), e.iter().fold(0.0, |a, e| e.abs().max(a)))
    }

    fn measure(name: &str, road: &Road, weather: &Weather) -> (f64, f64, f64) {
        let (mut sum, mut worst, mut found, mut far) = (0.0f64, 0.0f64, 0, 0.0);
        for seed in 0..2 {
            let Ok(lane) = see(road, weather, seed) else { continue };
            for (line, left) in [(&lane.left, 1.75), (&lane.right, -1.75)] {
                let Some(line) = line else { continue };
                let (rms, most) = error(line, road, left);
                (sum, worst, found) = (sum + rms * rms, worst.max(most), found + 1);
                far += line.curve.point(line.curve.span_m[1]).x;
            }
        }
        let n = f64::from(found).max(1.0);
        println!(
            "{name}: {found} of 4 lines, rms {:.3} m, worst {worst:.3} m, seen to {:.1} m",
            (sum / n).sqrt(),
            far / n
        );
        (n, (sum / n).sqrt(), worst)
    }

    #[test]
    fn lines_of_straight_and_curved_roads() {
        let slanted = Road { offset_m: -0.5, heading_rad: 0.03, ..Road::straight() };
        for (name, road) in [
            ("straight", Road::straight()),
            ("straight, car turned", slanted),
            ("left curve of 150 m", Road::curve(150.0, true)),
            ("right curve of 150 m", Road::curve(150.0, false)),
            ("right curve of 400 m", Road::curve(400.0, false)),
        ] {
            let (found, rms, worst) = measure(name, &road, &CLEAR);
            assert!(found == 4.0 && rms < 0.05 && worst < 0.2, "{name}");
        }
    }

    #[test]
    fn a_line_that_is_straight_says_so() {
        let lane = see(&Road::straight(), &CLEAR, 9).unwrap();
        let c = &lane.right.unwrap().curve;
        assert!(c.curvature_1pm(0.0).abs() < 5.0 * c.sigma_curvature_1pm().max(2e-5), "{c:?}");
        let lane = see(&Road::curve(150.0, true), &CLEAR, 9).unwrap();
        let k = lane.right.unwrap().curve.curvature_1pm(0.0);
        assert!((k * 151.75 - 1.0).abs() < 0.05, "{k}");
    }

    #[test]
    fn noise_glare_fog_and_night() {
        for (name, weather, least) in [
            ("noise 0.05", Weather { noise: 0.05, ..CLEAR }, 3.0),
            ("noise 0.10", Weather { noise: 0.1, ..CLEAR }, 1.0),
            ("glare 0.3", Weather { glare: 0.3, ..CLEAR }, 3.0),
            ("fog of 0.03 1/m", Weather { fog_1pm: 0.03, ..CLEAR }, 3.0),
            ("dusk, light 0.2", Weather { light: 0.2, noise: 0.01, ..CLEAR }, 3.0),
        ] {
            let (found, rms, _) = measure(name, &Road::straight(), &weather);
            assert!(found >= least && rms < 0.12, "{name}");
        }
        for (name, weather) in [
            ("night", Weather { light: 0.0, ..CLEAR }),
            ("dense fog", Weather { fog_1pm: 0.6, ..CLEAR }),
            ("blinding light", Weather { glare: 30.0, ..CLEAR }),
        ] {
            assert_eq!(see(&Road::straight(), &weather, 1), Err(LaneError::NoLaneLine), "{name}");
        }
        let night = render(&camera(), &Road::straight(), &LINES, &Weather { light: 0.0, ..CLEAR }, 1);
        assert!(night.mean() < 0.02);
    }

    #[test]
    fn the_image_must_be_the_cameras() {
        let c = camera();
        let t = Trapezoid::of_ground(&c, 6.0, 35.0, 6.0).unwrap();
        let image = Image::new(20, 20, vec![0.0; 400]).unwrap();
        assert!(find_near_lane(&c, &image, &t, &NearSettings::default()).is_err());
    }
}
