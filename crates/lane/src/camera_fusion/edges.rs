//! Edges of a grey image (Canny 1986, with sub-pixel positions) and straight lines through them (Hough
//! transform).

use super::camera::{Image, Trapezoid};
use crate::error::{LaneError, checked, positive, within};
use crate::numeric::{principal_axis, wrapped};
use glam::DVec2;
use std::f64::consts::{PI, TAU};

/// Settings of [`edges`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSettings {
    /// Standard deviation of the Gaussian that smooths the image before the gradient, pixels.
    pub smooth_px: f64,
    /// An edge starts where the gradient exceeds this many times its noise and is followed down to half of
    /// that.
    pub noise_factor: f64,
    /// Least gradient of an edge whatever the noise, grey value per pixel.
    pub least_gradient: f64,
}

impl Default for EdgeSettings {
    fn default() -> Self {
        EdgeSettings { smooth_px: 1.2, noise_factor: 5.0, least_gradient: 0.008 }
    }
}

/// The edge at one pixel, with a sub-pixel position along the gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Sub-pixel position in the image, pixels.
    pub pixel: DVec2,
    /// Direction from dark to bright, rad, from the u axis towards the v axis.
    pub normal_rad: f64,
    /// Gradient magnitude, grey value per pixel.
    pub gradient: f64,
}

/// The edges of one image and statistics of that image.
#[derive(Debug, Clone, PartialEq)]
pub struct Edges {
    /// The edges, row by row from the top.
    pub edges: Vec<Edge>,
    /// Standard deviation of one component of the gradient where there is no edge, estimated from the median,
    /// grey value per pixel.
    pub gradient_noise: f64,
    /// Share of the trapezoid's pixels with a grey value of 0.98 or more.
    pub bright_share: f64,
    /// Share of the trapezoid's pixels with a grey value of 0.02 or less.
    pub dark_share: f64,
}

/// Finds the edges inside a trapezoid by Gaussian smoothing, Sobel gradient, thinning across the edge and two
/// thresholds that follow the image's noise. The noise is the median gradient, which lines hardly raise since
/// they cover little of the image.
///
/// # Errors
/// Returns an error if the trapezoid fails [`Trapezoid::validate`], a setting is outside its range, or the
/// trapezoid holds less than 8 x 8 pixels of the image.
pub fn edges(image: &Image, trapezoid: &Trapezoid, settings: &EdgeSettings) -> Result<Edges, LaneError> {
    trapezoid.validate()?;
    positive("the edge's noise factor", settings.noise_factor)?;
    positive("the minimum gradient", settings.least_gradient)?;
    within("the smoothing in pixels", settings.smooth_px, 0.3..=5.0)?;
    // The window is the trapezoid's bounding box plus what the filters need around it; beyond the image the
    // border pixels are repeated.
    let (w, h) = (image.width_px() as f64, image.height_px() as f64);
    let left = trapezoid.top_u_px[0].min(trapezoid.bottom_u_px[0]).clamp(0.0, w).floor() as usize;
    let right = trapezoid.top_u_px[1].max(trapezoid.bottom_u_px[1]).clamp(0.0, w).ceil() as usize;
    let top = trapezoid.top_v_px.clamp(0.0, h).floor() as usize;
    let bottom = trapezoid.bottom_v_px.clamp(0.0, h).ceil() as usize;
    if right < left + 8 || bottom < top + 8 {
        return Err(LaneError::undetermined(
            "the edges, because the trapezoid covers less than 8 x 8 pixels of the image",
        ));
    }
    let (nu, nv) = (right - left, bottom - top);
    let smooth = smoothed(image, left, top, nu, nv, settings.smooth_px);
    let stride = nu + 2;
    let mut gradient = Gradient { x: vec![0.0; nu * nv], y: vec![0.0; nu * nv], size: vec![0.0; nu * nv] };
    let mut inside = Vec::with_capacity(nu * nv);
    let (mut bright, mut dark) = (0usize, 0usize);
    for v in 0..nv {
        let Some(span) = trapezoid.row((top + v) as f64 + 0.5) else { continue };
        // Pixels whose centre lies inside, and one more to each side for the thinning.
        let first = (span[0] - 0.5 - left as f64).ceil().clamp(0.0, nu as f64) as usize;
        let last = ((span[1] - 0.5 - left as f64).floor() + 1.0).clamp(0.0, nu as f64) as usize;
        if first >= last {
            continue;
        }
        let (from, to) = (first.saturating_sub(2), (last + 2).min(nu));
        let row = |k: usize| &smooth[(v + k) * stride + from..(v + k) * stride + to + 2];
        let (a, b, c) = (row(0), row(1), row(2));
        let at = v * nu + from..v * nu + to;
        let (gx, gy, g) = (&mut gradient.x[at.clone()], &mut gradient.y[at.clone()], &mut gradient.size[at]);
        for u in 0..to - from {
            gx[u] = 0.125 * (a[u + 2] - a[u] + 2.0 * (b[u + 2] - b[u]) + c[u + 2] - c[u]);
            gy[u] = 0.125 * (c[u] - a[u] + 2.0 * (c[u + 1] - a[u + 1]) + c[u + 2] - a[u + 2]);
            g[u] = (gx[u] * gx[u] + gy[u] * gy[u]).sqrt();
        }
        inside.extend_from_slice(&gradient.size[v * nu + first..v * nu + last]);
        for grey in &image.row(top + v)[left + first..left + last] {
            bright += usize::from(*grey >= 0.98);
            dark += usize::from(*grey <= 0.02);
        }
    }
    if inside.is_empty() {
        return Err(LaneError::undetermined("the edges, because the trapezoid is outside the image"));
    }
    let count = inside.len() as f64;
    let middle = inside.len() / 2;
    // The median length of a two-dimensional Gaussian vector is sqrt(2 ln 2) standard deviations.
    let median = f64::from(*inside.select_nth_unstable_by(middle, f32::total_cmp).1);
    let gradient_noise = median / (2.0 * 2f64.ln()).sqrt();
    let high = (settings.noise_factor * gradient_noise).max(settings.least_gradient);
    let edges = thin_and_follow(&gradient, nu, nv, high as f32)
        .into_iter()
        .map(|mut e| {
            e.pixel += DVec2::new(left as f64, top as f64);
            e
        })
        .filter(|e| trapezoid.contains(e.pixel))
        .collect();
    Ok(Edges { edges, gradient_noise, bright_share: bright as f64 / count, dark_share: dark as f64 / count })
}

/// The image gradient in the window, row by row.
struct Gradient {
    x: Vec<f32>,
    y: Vec<f32>,
    size: Vec<f32>,
}

/// The smoothed window with one pixel around it: filtered along rows, then along columns.
fn smoothed(image: &Image, left: usize, top: usize, nu: usize, nv: usize, sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as usize;
    let raw: Vec<f64> =
        (0..=2 * reach).map(|i| (-0.5 * ((i as f64 - reach as f64) / sigma).powi(2)).exp()).collect();
    let sum: f64 = raw.iter().sum();
    let taps: Vec<f32> = raw.iter().map(|t| (t / sum) as f32).collect();
    let (w, h) = (image.width_px(), image.height_px());
    let (wide, high) = (nu + 2, nv + 2);
    let margin = reach + 1;
    // Whole rows are added up tap by tap, which the compiler turns into vector code.
    let add = |sum: &mut [f32], part: &[f32], tap: f32| {
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += tap * p);
    };
    let mut padded = vec![0.0f32; nu + 2 * margin];
    let mut across = vec![0.0f32; (high + 2 * reach) * wide];
    for (v, out) in across.chunks_exact_mut(wide).enumerate() {
        let row = image.row((top + v).saturating_sub(margin).min(h - 1));
        for (i, p) in padded.iter_mut().enumerate() {
            *p = row[(left + i).saturating_sub(margin).min(w - 1)];
        }
        taps.iter().enumerate().for_each(|(i, t)| add(out, &padded[i..i + wide], *t));
    }
    let mut out = vec![0.0f32; wide * high];
    for (v, out) in out.chunks_exact_mut(wide).enumerate() {
        taps.iter().enumerate().for_each(|(i, t)| add(out, &across[(v + i) * wide..(v + i + 1) * wide], *t));
    }
    out
}

/// Keeps what is a maximum across the edge and above `high`, or is joined to such by pixels above half of it.
fn thin_and_follow(gradient: &Gradient, nu: usize, nv: usize, high: f32) -> Vec<Edge> {
    let size = |u: f32, v: f32| {
        let (u0, v0) = ((u.floor() as usize).min(nu - 2), (v.floor() as usize).min(nv - 2));
        let (a, b) = (u - u0 as f32, v - v0 as f32);
        let g = |du: usize, dv: usize| gradient.size[(v0 + dv) * nu + u0 + du];
        (g(0, 0) * (1.0 - a) + g(1, 0) * a) * (1.0 - b) + (g(0, 1) * (1.0 - a) + g(1, 1) * a) * b
    };
    let mut thin: Vec<Edge> = Vec::new();
    // Index of a pixel's edge in `thin`, counted from 1; 0 for none.
    let mut number = vec![0u32; nu * nv];
    let mut open = Vec::new();
    let mut kept: Vec<bool> = Vec::new();
    for v in 1..nv - 1 {
        for u in 1..nu - 1 {
            let g = gradient.size[v * nu + u];
            if g.is_nan() || g <= 0.5 * high {
                continue;
            }
            let (dx, dy) = (gradient.x[v * nu + u] / g, gradient.y[v * nu + u] / g);
            let (x, y) = (u as f32, v as f32);
            let (before, after) = (size(x - dx, y - dy), size(x + dx, y + dy));
            // One side may tie, so that of two equal pixels across an edge one stays.
            if g < before || g <= after {
                continue;
            }
            let shift = f64::from(0.5 * (before - after) / (before - 2.0 * g + after)).clamp(-0.5, 0.5);
            let pixel =
                DVec2::new(u as f64 + 0.5, v as f64 + 0.5) + DVec2::new(f64::from(dx), f64::from(dy)) * shift;
            thin.push(Edge { pixel, normal_rad: f64::from(dy).atan2(f64::from(dx)), gradient: f64::from(g) });
            number[v * nu + u] = thin.len() as u32;
            kept.push(g >= high);
            if g >= high {
                open.push(v * nu + u);
            }
        }
    }
    while let Some(i) = open.pop() {
        for dv in [-1isize, 0, 1] {
            for du in [-1isize, 0, 1] {
                // Thinned pixels keep off the window's border, so the neighbour exists.
                let j = (i as isize + dv * nu as isize + du) as usize;
                if let Some(k) = (number[j] as usize).checked_sub(1)
                    && !kept[k]
                {
                    kept[k] = true;
                    open.push(j);
                }
            }
        }
    }
    thin.into_iter().zip(kept).filter_map(|(e, k)| k.then_some(e)).collect()
}

/// Settings of [`hough_lines`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoughSettings {
    /// Width of a cell in angle, rad.
    pub angle_step_rad: f64,
    /// Width of a cell in distance, pixels.
    pub distance_step_px: f64,
    /// Largest angle between an edge's normal and that of a line for which it votes, rad.
    pub angle_reach_rad: f64,
    /// Angle within which a peak suppresses smaller ones that also lie within `suppress_px`, rad.
    pub suppress_rad: f64,
    /// Distance within which a peak suppresses smaller ones that also lie within `suppress_rad`, pixels.
    pub suppress_px: f64,
    /// Least number of edges on a line.
    pub least_votes: usize,
    /// Largest number of lines.
    pub most_lines: usize,
}

impl Default for HoughSettings {
    fn default() -> Self {
        HoughSettings {
            angle_step_rad: 0.5f64.to_radians(),
            distance_step_px: 1.0,
            angle_reach_rad: 8f64.to_radians(),
            suppress_rad: 3f64.to_radians(),
            suppress_px: 3.0,
            least_votes: 15,
            most_lines: 40,
        }
    }
}

/// The line x cos θ + y sin θ = ρ (Sangeetha Lakshmi section 2.1), with x = u and y = v from the image's
/// upper left corner. The normal points from dark to bright, so θ covers the whole circle and ρ may be
/// negative.
#[derive(Debug, Clone, PartialEq)]
pub struct HoughLine {
    /// Direction θ of the line's normal, rad.
    pub theta_rad: f64,
    /// Signed distance ρ of the line from the image's corner, pixels.
    pub rho_px: f64,
    /// Number of edges on the line.
    pub votes: usize,
    /// Rows v of the topmost and the lowest edge on the line, pixels.
    pub rows_px: [f64; 2],
}

impl HoughLine {
    /// Distance of a pixel from the line, pixels, positive on the bright side.
    pub fn distance_px(&self, pixel: DVec2) -> f64 {
        pixel.dot(DVec2::from_angle(self.theta_rad)) - self.rho_px
    }

    /// Column u of the line at row `v_px`. None for a level line.
    pub fn column(&self, v_px: f64) -> Option<f64> {
        let c = self.theta_rad.cos();
        (c.abs() > 1e-3).then(|| (self.rho_px - v_px * self.theta_rad.sin()) / c)
    }
}

/// Finds straight lines by the votes of the edges. Each peak is the largest in its neighbourhood and is
/// refined by total least squares on the edges within two pixels of it. Lines with most votes come first.
///
/// # Errors
/// Returns an error if a setting is outside its range, an edge is non-finite, or the edges' spread needs more
/// than 5e7 cells.
pub fn hough_lines(edges: &[Edge], settings: &HoughSettings) -> Result<Vec<HoughLine>, LaneError> {
    let s = settings;
    within("the Hough angle step", s.angle_step_rad, 1e-3..=0.2)?;
    within("the Hough distance step", s.distance_step_px, 0.1..=20.0)?;
    within("the Hough angle reach", s.angle_reach_rad, 0.0..=PI)?;
    within("the suppressed angle", s.suppress_rad, 0.0..=PI)?;
    within("the suppressed distance", s.suppress_px, 0.0..=1e3)?;
    if edges.iter().any(|e| !(e.pixel.is_finite() && e.normal_rad.is_finite())) {
        return Err(LaneError::not_finite("an edge"));
    }
    if edges.is_empty() {
        return Ok(Vec::new());
    }
    // Votes are counted about the edges' centroid, where angle and distance are least correlated.
    let middle = edges.iter().map(|e| e.pixel).sum::<DVec2>() / edges.len() as f64;
    let reach = edges.iter().map(|e| e.pixel.distance(middle)).fold(1.0, f64::max);
    checked("the spread of the edges in pixels", reach, reach <= 1e5, "at most 1e5")?;
    let turns = (TAU / s.angle_step_rad).round().max(4.0) as usize;
    let half = (reach / s.distance_step_px).ceil() as usize + 1;
    let width = 2 * half + 1;
    if turns.saturating_mul(width) > 50_000_000 {
        let value = turns as f64 * width as f64;
        return Err(LaneError::out_of_range("the number of Hough cells", value, "at most 5e7"));
    }
    let angles: Vec<DVec2> = (0..turns).map(|i| DVec2::from_angle(TAU * i as f64 / turns as f64)).collect();
    let spread = (s.angle_reach_rad / TAU * turns as f64).round().min(turns as f64 / 2.0 - 1.0) as isize;
    let mut votes = vec![0u32; turns * width];
    for e in edges {
        let centre = (e.normal_rad.rem_euclid(TAU) / TAU * turns as f64).round() as isize;
        for k in -spread..=spread {
            let t = (centre + k).rem_euclid(turns as isize) as usize;
            let r = ((e.pixel - middle).dot(angles[t]) / s.distance_step_px).round() as isize + half as isize;
            votes[t * width + r as usize] += 1;
        }
    }
    let (dt, dr) = (
        (s.suppress_rad / TAU * turns as f64).round() as isize,
        (s.suppress_px / s.distance_step_px).round() as isize,
    );
    let least = s.least_votes.max(3) as u32;
    let mut lines: Vec<HoughLine> = Vec::new();
    let mut peaks: Vec<(u32, usize, usize)> = Vec::new();
    for t in 0..turns {
        for r in 0..width {
            let n = votes[t * width + r];
            if n < least / 2 {
                continue;
            }
            let largest = (-dt..=dt).all(|kt| {
                let other = (t as isize + kt).rem_euclid(turns as isize) as usize;
                let rows = (r as isize - dr).max(0) as usize..=((r as isize + dr) as usize).min(width - 1);
                // Of equal cells the first in memory order stays.
                rows.into_iter().all(|q| {
                    let m = votes[other * width + q];
                    m < n || (m == n && (other, q) >= (t, r))
                })
            });
            if largest {
                peaks.push((n, t, r));
            }
        }
    }
    peaks.sort_by_key(|p| (std::cmp::Reverse(p.0), p.1, p.2));
    for (_, t, r) in peaks.into_iter().take(s.most_lines.saturating_mul(4)) {
        let rho = (r as f64 - half as f64) * s.distance_step_px + middle.dot(angles[t]);
        let start = HoughLine {
            theta_rad: wrapped(TAU * t as f64 / turns as f64),
            rho_px: rho,
            votes: 0,
            rows_px: [0.0; 2],
        };
        // Most peaks lie beside a line that is already found.
        let found = |line: &HoughLine, v: f64| {
            lines.iter().any(|l| {
                let m = DVec2::new(line.column(v).unwrap_or(middle.x), v);
                wrapped(l.theta_rad - line.theta_rad).abs() < s.suppress_rad
                    && l.distance_px(m).abs() < s.suppress_px
            })
        };
        if lines.iter().any(|l| {
            wrapped(l.theta_rad - start.theta_rad).abs() < s.suppress_rad
                && l.rows_px.iter().all(|v| {
                    let m = DVec2::new(l.column(*v).unwrap_or(middle.x), *v);
                    start.distance_px(m).abs() < s.suppress_px
                })
        }) {
            continue;
        }
        let Some(line) = set_to_edges(start, edges, s.angle_reach_rad) else { continue };
        if line.votes >= s.least_votes.max(3) && !found(&line, line.rows_px[1]) {
            lines.push(line);
        }
    }
    lines.sort_by(|a, b| b.votes.cmp(&a.votes).then(a.rho_px.total_cmp(&b.rho_px)));
    lines.truncate(s.most_lines);
    Ok(lines)
}

/// Refines a line three times by total least squares on the edges within two pixels whose normals agree.
fn set_to_edges(mut line: HoughLine, edges: &[Edge], angle_reach_rad: f64) -> Option<HoughLine> {
    let mut on: Vec<DVec2> = Vec::new();
    for _ in 0..3 {
        let normal = DVec2::from_angle(line.theta_rad);
        on.clear();
        for e in edges {
            if (e.pixel.dot(normal) - line.rho_px).abs() < 2.0
                && wrapped(e.normal_rad - line.theta_rad).abs() <= angle_reach_rad
            {
                on.push(e.pixel);
            }
        }
        if on.len() < 3 {
            return None;
        }
        let (mean, along) = principal_axis(&on);
        let mut theta = wrapped(along + 0.5 * PI);
        if wrapped(theta - line.theta_rad).abs() > 0.5 * PI {
            theta = wrapped(theta + PI);
        }
        let rows_px =
            on.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p.y), b.max(p.y)]);
        line = HoughLine {
            theta_rad: theta,
            rho_px: mean.dot(DVec2::from_angle(theta)),
            votes: on.len(),
            rows_px,
        };
    }
    Some(line)
}

#[cfg(test)]
mod tests {
    use super::super::synth::Draws;
    use super::*;

    fn whole(n: f64) -> Trapezoid {
        Trapezoid { top_v_px: 0.0, bottom_v_px: n, top_u_px: [0.0, n], bottom_u_px: [0.0, n] }
    }

    /// A bright half plane beyond x cos t + y sin t = rho, with each pixel its covered share.
    fn half_plane(n: usize, theta: f64, rho: f64, noise: f64, seed: u64) -> Image {
        let mut draws = Draws::new(seed as u32, 0);
        let e = DVec2::from_angle(theta);
        let grey = (0..n * n).map(|i| {
            let share = (0..25).filter(|k| {
                let p = DVec2::new(
                    (i % n) as f64 + (*k % 5) as f64 / 5.0 + 0.1,
                    (i / n) as f64 + (*k / 5) as f64 / 5.0 + 0.1,
                );
                p.dot(e) > rho
            });
            (0.3 + 0.4 * share.count() as f64 / 25.0 + noise * draws.normal()) as f32
        });
        Image::new(n, n, grey.collect()).unwrap()
    }

    #[test]
    fn a_step_is_found_between_pixels_with_its_side() {
        let mut draws = Draws::new(3, 0);
        let mut worst: f64 = 0.0;
        for i in 0..40 {
            let theta = TAU * draws.uniform() - PI;
            let rho = DVec2::splat(40.0).dot(DVec2::from_angle(theta)) + 10.0 * draws.normal();
            let image = half_plane(80, theta, rho, 0.02, i);
            let found = edges(&image, &whole(80.0), &EdgeSettings::default()).unwrap();
            let lines = hough_lines(&found.edges, &HoughSettings::default()).unwrap();
            let l = &lines[0];
            assert!(wrapped(l.theta_rad - theta).abs() < 0.01, "{theta} {l:?}");
            worst = worst.max(
                l.distance_px(
                    DVec2::from_angle(theta) * rho
                        + DVec2::from_angle(theta).perp()
                            * DVec2::splat(40.0).dot(DVec2::from_angle(theta).perp()),
                )
                .abs(),
            );
            assert_eq!(lines.iter().filter(|m| wrapped(m.theta_rad - theta).abs() < 0.05).count(), 1);
        }
        println!("a step's line lies {worst:.3} px off at worst");
        assert!(worst < 0.15, "{worst}");
    }

    #[test]
    fn noise_alone_gives_no_line_and_flat_grey_no_edge() {
        let mut draws = Draws::new(4, 0);
        for light in [0.1, 0.5] {
            let grey = (0..200 * 200).map(|_| (0.5 + light * draws.normal()) as f32).collect();
            let found =
                edges(&Image::new(200, 200, grey).unwrap(), &whole(200.0), &EdgeSettings::default()).unwrap();
            // P(Rayleigh > 5 sigma) = exp(-12.5) = 4e-6 for each of 4e4 pixels: 0.15 starts expected.
            assert!(found.edges.len() < 30, "{}", found.edges.len());
            assert!(hough_lines(&found.edges, &HoughSettings::default()).unwrap().is_empty());
        }
        let flat = Image::new(50, 50, vec![0.4; 2500]).unwrap();
        let found = edges(&flat, &whole(50.0), &EdgeSettings::default()).unwrap();
        assert!(found.edges.is_empty() && found.gradient_noise < 1e-6);
    }

    #[test]
    fn suppression_keeps_two_near_lines_and_drops_echoes() {
        let mut points = Vec::new();
        for i in 0..100 {
            for u in [50.0, 58.0] {
                points.push(Edge { pixel: DVec2::new(u, i as f64), normal_rad: 0.0, gradient: 1.0 });
            }
        }
        let lines = hough_lines(&points, &HoughSettings::default()).unwrap();
        assert_eq!(lines.len(), 2, "{lines:?}");
        for l in &lines {
            assert!(l.theta_rad.abs() < 1e-9 && l.votes == 100 && l.rows_px == [0.0, 99.0]);
        }
        let mut at: Vec<f64> = lines.iter().map(|l| l.rho_px).collect();
        at.sort_by(f64::total_cmp);
        assert!((at[0] - 50.0).abs() < 1e-9 && (at[1] - 58.0).abs() < 1e-9);
    }

    #[test]
    fn hostile_input() {
        let image = Image::new(20, 20, vec![0.1; 400]).unwrap();
        let bad = Trapezoid { top_v_px: f64::NAN, ..whole(20.0) };
        assert!(edges(&image, &bad, &EdgeSettings::default()).is_err());
        let away = Trapezoid { top_v_px: 100.0, bottom_v_px: 200.0, ..whole(20.0) };
        assert!(edges(&image, &away, &EdgeSettings::default()).is_err());
        assert!(
            edges(&image, &whole(20.0), &EdgeSettings { smooth_px: f64::NAN, ..Default::default() }).is_err()
        );
        assert!(edges(&image, &whole(1e9), &EdgeSettings::default()).is_ok());
        let e = Edge { pixel: DVec2::splat(f64::NAN), normal_rad: 0.0, gradient: 1.0 };
        assert!(hough_lines(&[e], &HoughSettings::default()).is_err());
        assert!(
            hough_lines(
                &[Edge { pixel: DVec2::splat(1e300), ..e }, Edge { pixel: DVec2::ZERO, ..e }],
                &HoughSettings::default()
            )
            .is_err()
        );
        assert!(hough_lines(&[Edge { pixel: DVec2::X, ..e }], &HoughSettings::default()).unwrap().is_empty());
        assert!(hough_lines(&[], &HoughSettings { angle_step_rad: 0.0, ..Default::default() }).is_err());
    }
}
