//! Shaded pictures of bodies with their axes and outer dimensions, in parallel projection. Metal is blue
//! grey on its front, brown on the back of a sheet, so that the picture shows which way a sheet looks;
//! further materials are green and let the metal shine through.

use super::canvas::{Anchor, BLACK, Canvas, GREY, Pen, Picture, Rgb, SCALE, text_width};
use catseye::base::error::{BadInput, Result};
use catseye::base::frames::direction_from_angles;
use catseye::scene::Mesh;
use glam::{DVec2, DVec3};
use image::{Rgb as Pixel, RgbImage};
use std::collections::HashMap;

/// What is drawn, and from where.
#[derive(Debug, Clone, Copy)]
pub struct SolidView<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Smaller lines under the title; long ones are broken at spaces.
    pub lines: &'a [String],
    /// The body.
    pub mesh: &'a Mesh,
    /// Where the eye is, in the target frame.
    pub azimuth_deg: f64,
    /// Elevation of the eye, degrees.
    pub elevation_deg: f64,
}

impl<'a> SolidView<'a> {
    /// From the front, from the reflector's right and from above: x comes out of the page to the right.
    pub fn new(title: &'a str, lines: &'a [String], mesh: &'a Mesh) -> Self {
        SolidView { title, lines, mesh, azimuth_deg: -38.0, elevation_deg: 28.0 }
    }
}

/// Samples across a device pixel.
const SAMPLES: usize = 2;
/// Cosine of the angle between two facets from which on their edge is drawn.
const CREASE: f64 = 0.94;
/// With more edges than this they are drawn finer.
const MANY_EDGES: usize = 1500;

const FRONT: Rgb = [150, 172, 196];
const BACK: Rgb = [201, 172, 142];
const FILLING: Rgb = [120, 190, 130];
const FILLING_OPACITY: f64 = 0.45;
const EDGE: Rgb = [38, 46, 58];
const AXIS_COLOURS: [Rgb; 3] = [[190, 40, 40], [30, 130, 60], [40, 70, 180]];

/// One body with its dimensions.
///
/// # Errors
/// A mesh without a finite extent.
pub fn solid_picture(view: &SolidView) -> Result<Picture> {
    let (width, margin) = (640.0, 16.0);
    let lines = broken(view.lines, 11, width - 2.0 * margin);
    let head = 30.0 + 15.0 * lines.len() as f64;
    let height = head + 420.0;
    let mut c = Canvas::new(width, height);
    c.text((margin, 24.0), view.title, 15, Anchor::Start, BLACK);
    for (i, line) in lines.iter().enumerate() {
        c.text((margin, 41.0 + 15.0 * i as f64), line, 11, Anchor::Start, GREY);
    }
    draw(&mut c, view, (0.0, head), (width, height - head), true)?;
    c.finish()
}

/// Many bodies on one sheet, each under its title, without dimensions but with their extents.
///
/// # Errors
/// As [`solid_picture`].
pub fn solid_sheet(title: &str, views: &[SolidView], columns: usize) -> Result<Picture> {
    let (w, h, head) = (230.0, 190.0, 40.0);
    let columns = columns.max(1);
    let rows = views.len().div_ceil(columns);
    let mut c = Canvas::new(w * columns as f64, head + h * rows as f64);
    c.text((14.0, 26.0), title, 16, Anchor::Start, BLACK);
    for (i, view) in views.iter().enumerate() {
        let (x, y) = ((i % columns) as f64 * w, head + (i / columns) as f64 * h);
        c.text((x + 14.0, y + 16.0), view.title, 13, Anchor::Start, BLACK);
        let (lo, hi) = bounds(view.mesh)?;
        let size = (hi - lo).to_array().map(length_text).join(" x ");
        c.text((x + 14.0, y + 31.0), &size, 10, Anchor::Start, GREY);
        draw(&mut c, view, (x, y + 36.0), (w, h - 36.0), false)?;
    }
    c.finish()
}

fn bounds(mesh: &Mesh) -> Result<(DVec3, DVec3)> {
    let used = mesh.triangles.iter().flatten().filter_map(|&i| mesh.positions_m.get(i as usize));
    let (lo, hi) = used.fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    if !(hi - lo).is_finite() || (hi - lo).min_element() < 0.0 {
        return Err(BadInput::new("the mesh has no finite extent and cannot be drawn").into());
    }
    Ok((lo, hi))
}

/// The projection: from metres to logical pixels, and the depth towards the eye.
struct Projection {
    right: DVec3,
    up: DVec3,
    to_eye: DVec3,
    scale: f64,
    /// What is drawn at `middle`.
    centre_m: DVec3,
    middle: DVec2,
}

impl Projection {
    fn axes(view: &SolidView) -> (DVec3, DVec3, DVec3) {
        let to_eye = direction_from_angles(view.azimuth_deg.to_radians(), view.elevation_deg.to_radians());
        let right = DVec3::Z.cross(to_eye).try_normalize().unwrap_or(DVec3::Y);
        (right, to_eye.cross(right), to_eye)
    }

    fn at(&self, p: DVec3) -> DVec2 {
        let d = p - self.centre_m;
        self.middle + self.scale * DVec2::new(d.dot(self.right), -d.dot(self.up))
    }

    /// A direction on the page.
    fn along(&self, d: DVec3) -> DVec2 {
        DVec2::new(d.dot(self.right), -d.dot(self.up))
    }
}

fn draw(
    c: &mut Canvas,
    view: &SolidView,
    corner: (f64, f64),
    size: (f64, f64),
    dimensions: bool,
) -> Result<()> {
    let (lo, hi) = bounds(view.mesh)?;
    let (right, up, to_eye) = Projection::axes(view);
    let half = 0.5 * (hi - lo);
    // The box's half extents on the page.
    let (w, h) = (half.dot(right.abs()), half.dot(up.abs()));
    let margin = if dimensions { (86.0, 62.0) } else { (14.0, 10.0) };
    let scale = ((0.5 * size.0 - margin.0) / w.max(1e-300)).min((0.5 * size.1 - margin.1) / h.max(1e-300));
    let eye = Projection {
        right,
        up,
        to_eye,
        scale,
        centre_m: 0.5 * (lo + hi),
        middle: DVec2::new(0.5 * size.0, 0.5 * size.1),
    };
    c.image(corner, raster(view.mesh, &eye, size));
    let page = DVec2::new(corner.0, corner.1);
    if dimensions {
        draw_dimensions(c, &eye, page, (lo, hi));
        draw_axes(c, &eye, page + DVec2::new(40.0, 64.0));
    }
    Ok(())
}

/// Dimension lines along three edges of the box: the near one of x, that of y and the upright one at
/// the rim of the picture.
fn draw_dimensions(c: &mut Canvas, eye: &Projection, page: DVec2, (lo, hi): (DVec3, DVec3)) {
    let near = |d: usize, e: DVec3| if e[d] > 0.0 { hi[d] } else { lo[d] };
    let (x, y) = (near(0, eye.to_eye), near(1, eye.to_eye));
    // On the page the outer end of the box lies to the right of its right-hand upright edge.
    let right_edge = |a: DVec3, b: DVec3| if eye.along(a - b).x > 0.0 { a } else { b };
    let corner = right_edge(DVec3::new(hi.x, hi.y, lo.z), DVec3::new(lo.x, lo.y, lo.z));
    let lines = [
        (DVec3::new(lo.x, y, lo.z), DVec3::new(hi.x, y, lo.z), DVec3::Y * eye.to_eye.y.signum()),
        (DVec3::new(x, lo.y, lo.z), DVec3::new(x, hi.y, lo.z), DVec3::X * eye.to_eye.x.signum()),
        (corner, corner.with_z(hi.z), eye.right),
    ];
    let pen = Pen::solid(GREY, 1.0);
    for (a, b, outwards) in lines {
        let extent = (b - a).length();
        let (a, b) = (page + eye.at(a), page + eye.at(b));
        if extent <= 1e-9 {
            continue;
        }
        let mut out = eye.along(outwards).normalize_or(DVec2::Y);
        if out.y < 0.0 && out.x.abs() < 0.99 {
            out = -out;
        }
        let text = length_text(extent);
        let (p, q) = (a + 16.0 * out, b + 16.0 * out);
        for (from, to) in [(a, p), (b, q)] {
            let (from, to) = (from + 4.0 * out, to + 4.0 * out);
            c.polyline(&[(from.x, from.y), (to.x, to.y)], Pen::solid([170, 170, 170], 0.8));
        }
        c.polyline(&[(p.x, p.y), (q.x, q.y)], pen);
        for (end, other) in [(p, q), (q, p)] {
            let back = (other - end).normalize_or_zero() * 6.0f64.min(0.4 * (other - end).length());
            let side = back.perp() * 0.35;
            let [u, v] = [end + back + side, end + back - side];
            c.polygon(&[(end.x, end.y), (u.x, u.y), (v.x, v.y)], Some((GREY, 1.0)), None);
        }
        let anchor = match out.x {
            x if x > 0.3 => Anchor::Start,
            x if x < -0.3 => Anchor::End,
            _ => Anchor::Middle,
        };
        let at = 0.5 * (p + q) + 10.0 * out + DVec2::Y * 4.0;
        c.text((at.x, at.y), &text, 12, anchor, BLACK);
    }
}

/// The three axes; x is where the radar stands on boresight.
fn draw_axes(c: &mut Canvas, eye: &Projection, at: DVec2) {
    let names = ["x: radar", "y", "z"];
    for (k, axis) in DVec3::AXES.into_iter().enumerate() {
        let tip = at + 30.0 * eye.along(axis);
        let pen = Pen::solid(AXIS_COLOURS[k], 1.6);
        c.polyline(&[(at.x, at.y), (tip.x, tip.y)], pen);
        let along = (tip - at).normalize_or_zero();
        let [u, v] = [1.0, -1.0].map(|s| tip - 7.0 * along + s * 2.6 * along.perp());
        c.polygon(&[(tip.x, tip.y), (u.x, u.y), (v.x, v.y)], Some((AXIS_COLOURS[k], 1.0)), None);
        let text = tip + 8.0 * along + DVec2::Y * 4.0;
        let anchor = if along.x < -0.3 { Anchor::Middle } else { Anchor::Start };
        let text = if k == 0 { text + DVec2::Y * 7.0 } else { text };
        c.text((text.x, text.y), names[k], 11, anchor, AXIS_COLOURS[k]);
    }
}

/// "160 mm", "4.3 mm", "2.6 m": three digits.
fn length_text(m: f64) -> String {
    let (value, unit) = if m < 0.9995 { (m * 1e3, "mm") } else { (m, "m") };
    let digits = if value < 1e-9 { 0 } else { (2.0 - value.log10().floor()).clamp(0.0, 4.0) as usize };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} {unit}")
}

fn broken(lines: &[String], size: u32, width: f64) -> Vec<String> {
    let mut out = Vec::new();
    for line in lines {
        let mut row = String::new();
        for word in line.split(' ') {
            let longer = if row.is_empty() { word.to_string() } else { format!("{row} {word}") };
            if !row.is_empty() && text_width(&longer, size) > width {
                out.push(std::mem::replace(&mut row, word.to_string()));
            } else {
                row = longer;
            }
        }
        out.push(row);
    }
    out
}

/// Colour and depth at more points than pixels.
struct Raster {
    width: usize,
    height: usize,
    colour: Vec<[f32; 3]>,
    /// Towards the eye, metres.
    depth: Vec<f64>,
}

/// A corner on the raster: place in samples, depth, light.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec2,
    depth: f64,
    light: f64,
}

fn raster(mesh: &Mesh, eye: &Projection, size: (f64, f64)) -> RgbImage {
    let per_pixel = SCALE * SAMPLES as f64;
    let (width, height) = ((size.0 * per_pixel) as usize, (size.1 * per_pixel) as usize);
    let mut r = Raster {
        width,
        height,
        colour: vec![[1.0; 3]; width * height],
        depth: vec![f64::NEG_INFINITY; width * height],
    };
    let facet_normal = |t: usize| {
        let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let lamp = (0.8 * eye.to_eye + 0.5 * eye.up + 0.15 * eye.right).normalize();
    // The filling comes last, over what is behind it.
    for filling in [false, true] {
        for t in 0..mesh.triangles.len() {
            if (mesh.material.get(t).is_some_and(|m| *m > 0)) != filling {
                continue;
            }
            let flat = facet_normal(t);
            let side = if flat.dot(eye.to_eye) < 0.0 { -1.0 } else { 1.0 };
            let normals = mesh.corner_normals(t).unwrap_or([flat; 3]);
            let mut k = 0;
            let corners = mesh.triangles[t].map(|i| {
                let p = mesh.positions_m[i as usize];
                k += 1;
                Corner {
                    at: eye.at(p) * per_pixel,
                    depth: (p - eye.centre_m).dot(eye.to_eye),
                    light: 0.5 + 0.5 * (side * normals[k - 1].dot(lamp)).max(-0.6),
                }
            });
            let colour = match (filling, side > 0.0) {
                (true, _) => FILLING,
                (_, true) => FRONT,
                (_, false) => BACK,
            };
            r.triangle(corners, colour, if filling { FILLING_OPACITY } else { 1.0 });
        }
    }
    let edges = creases(mesh, facet_normal);
    let half_width = SAMPLES as f64 * if edges.len() > MANY_EDGES { 0.45 } else { 0.9 };
    // Edges lie on the facets that they bound: this much nearer counts as in front.
    let bias = 0.7 / eye.scale;
    for (a, b) in edges {
        let [p, q] = [a, b].map(|i| mesh.positions_m[i as usize]);
        let end = |p: DVec3| Corner {
            at: eye.at(p) * per_pixel,
            depth: (p - eye.centre_m).dot(eye.to_eye) + bias,
            light: 1.0,
        };
        r.line(end(p), end(q), half_width);
    }
    r.image()
}

/// Edges at rims, between facets at an angle, and where three facets meet, as vertex pairs.
fn creases(mesh: &Mesh, normal: impl Fn(usize) -> DVec3) -> Vec<(u32, u32)> {
    let mut place: HashMap<[u64; 3], u32> = HashMap::new();
    let at: Vec<u32> = (mesh.positions_m.iter().enumerate())
        .map(|(i, p)| *place.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(i as u32))
        .collect();
    // First facet at an edge, and whether the edge is to be drawn so far; true with one facet.
    let mut edges: HashMap<(u32, u32), (usize, bool)> = HashMap::new();
    for (t, c) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (c[k], c[(k + 1) % 3]);
            let key = (at[a as usize].min(at[b as usize]), at[a as usize].max(at[b as usize]));
            match edges.get_mut(&key) {
                None => {
                    edges.insert(key, (t, true));
                }
                Some((other, drawn)) => {
                    let smooth = mesh.corner_normals(t).is_some() && mesh.corner_normals(*other).is_some();
                    let bend = normal(t).dot(normal(*other)).abs();
                    *drawn = bend < if smooth { 0.7 } else { CREASE };
                }
            }
        }
    }
    let mut drawn: Vec<(u32, u32)> = edges.into_iter().filter(|e| e.1.1).map(|e| e.0).collect();
    drawn.sort_unstable();
    drawn
}

impl Raster {
    fn triangle(&mut self, c: [Corner; 3], colour: Rgb, opacity: f64) {
        let area = (c[1].at - c[0].at).perp_dot(c[2].at - c[0].at);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let rows = c.map(|c| c.at.y);
        let (top, bottom) = (rows[0].min(rows[1]).min(rows[2]), rows[0].max(rows[1]).max(rows[2]));
        for y in self.span(top, bottom, self.height) {
            // Where the row enters and leaves the triangle: long thin ones have mostly empty boxes.
            let row = y as f64 + 0.5;
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for i in 0..3 {
                let (a, b) = (c[i].at, c[(i + 1) % 3].at);
                if (a.y <= row) != (b.y <= row) {
                    let x = a.x + (b.x - a.x) * (row - a.y) / (b.y - a.y);
                    (from, to) = (from.min(x), to.max(x));
                }
            }
            if from > to {
                continue;
            }
            for x in self.span(from, to, self.width) {
                let p = DVec2::new(x as f64 + 0.5, row);
                let w = [1, 2, 0].map(|i: usize| {
                    let (a, b) = (c[i].at, c[(i + 1) % 3].at);
                    (b - a).perp_dot(p - a) / area
                });
                if w.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let depth = w[0] * c[0].depth + w[1] * c[1].depth + w[2] * c[2].depth;
                let light = w[0] * c[0].light + w[1] * c[1].light + w[2] * c[2].light;
                let k = y * self.width + x;
                if depth <= self.depth[k] {
                    continue;
                }
                if opacity >= 1.0 {
                    self.depth[k] = depth;
                }
                for (to, from) in self.colour[k].iter_mut().zip(colour) {
                    let lit = (f64::from(from) / 255.0 * light.clamp(0.2, 1.15)).min(1.0);
                    *to = (f64::from(*to) * (1.0 - opacity) + lit * opacity) as f32;
                }
            }
        }
    }

    /// The samples between two coordinates that are on the raster.
    fn span(&self, lo: f64, hi: f64, end: usize) -> std::ops::Range<usize> {
        let clamp = |x: f64| x.clamp(0.0, end as f64) as usize;
        clamp(lo.floor())..clamp(hi.ceil() + 1.0)
    }

    fn line(&mut self, a: Corner, b: Corner, half_width: f64) {
        let length = (b.at - a.at).length();
        if !length.is_finite() {
            return;
        }
        let along = (b.at - a.at).normalize_or_zero();
        let lo = a.at.min(b.at) - half_width;
        let hi = a.at.max(b.at) + half_width;
        // Upright strips of the box are cut to the line, so that long slanted lines stay cheap.
        let step = 8.0 * half_width;
        let pieces = (length / step).ceil().max(1.0) as usize;
        for piece in 0..pieces {
            let [from, to] = [piece, piece + 1].map(|i| a.at + along * length * i as f64 / pieces as f64);
            let (low, high) = (lo.max(from.min(to) - half_width), hi.min(from.max(to) + half_width));
            for y in self.span(low.y, high.y, self.height) {
                for x in self.span(low.x, high.x, self.width) {
                    let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let s = (p - a.at).dot(along).clamp(0.0, length);
                    let t = if length > 0.0 { s / length } else { 0.0 };
                    let k = y * self.width + x;
                    if (a.at + along * s).distance(p) <= half_width
                        && a.depth + (b.depth - a.depth) * t >= self.depth[k]
                    {
                        self.colour[k] = EDGE.map(|v| f32::from(v) / 255.0);
                    }
                }
            }
        }
    }

    fn image(&self) -> RgbImage {
        let (w, h) = (self.width / SAMPLES, self.height / SAMPLES);
        RgbImage::from_fn(w as u32, h as u32, |x, y| {
            let mut sum = [0.0f32; 3];
            for i in 0..SAMPLES * SAMPLES {
                let (sx, sy) = (x as usize * SAMPLES + i % SAMPLES, y as usize * SAMPLES + i / SAMPLES);
                let c = self.colour[sy * self.width + sx];
                sum = [sum[0] + c[0], sum[1] + c[1], sum[2] + c[2]];
            }
            Pixel(sum.map(|s| (s / (SAMPLES * SAMPLES) as f32 * 255.0).round() as u8))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate() -> Mesh {
        let at = |y: f64, z: f64| DVec3::new(0.0, y, z);
        Mesh {
            positions_m: vec![at(-0.1, -0.1), at(0.1, -0.1), at(0.1, 0.1), at(-0.1, 0.1)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: vec![0, 0],
            ..Mesh::default()
        }
    }

    fn from(mesh: &Mesh, azimuth_deg: f64) -> RgbImage {
        let view = SolidView { azimuth_deg, elevation_deg: 0.0, ..SolidView::new("t", &[], mesh) };
        solid_picture(&view).unwrap().pixels().clone()
    }

    fn middle(p: &RgbImage) -> [u8; 3] {
        p.get_pixel(p.width() / 2, (p.height() + 60) / 2).0
    }

    #[test]
    fn front_is_blue_and_back_is_brown() {
        let m = plate();
        let (front, back) = (middle(&from(&m, 0.0)), middle(&from(&m, 180.0)));
        assert!(front[2] > front[0] + 15, "{front:?}");
        assert!(back[0] > back[2] + 15, "{back:?}");
    }

    #[test]
    fn the_nearer_facet_hides_the_other_whatever_their_order() {
        let mut behind = plate();
        behind.positions_m.iter_mut().for_each(|p| *p = *p * 0.5 - DVec3::X * 0.1);
        for swap in [false, true] {
            let (mut a, mut b) = (plate(), behind.clone());
            if swap {
                std::mem::swap(&mut a, &mut b);
            }
            // The one behind is seen from its back, so that it would show.
            if swap {
                a.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            } else {
                b.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            }
            let base = a.positions_m.len() as u32;
            a.positions_m.extend(&b.positions_m);
            a.triangles.extend(b.triangles.iter().map(|t| t.map(|i| i + base)));
            a.material.extend(b.material);
            let seen = middle(&from(&a, 0.0));
            assert!(seen[2] > seen[0] + 15, "{swap}: {seen:?}");
        }
    }

    #[test]
    fn lengths_in_three_digits() {
        let texts = [0.16, 0.0043, 2.6, 0.0001557, 12.0, 0.9999, 0.1234].map(length_text);
        assert_eq!(texts, ["160 mm", "4.3 mm", "2.6 m", "0.156 mm", "12 m", "1 m", "123 mm"]);
        assert_eq!(length_text(0.0), "0 mm");
    }

    #[test]
    fn flat_coplanar_and_curved_facets_have_no_seams() {
        let m = plate();
        let edges = creases(&m, |_| DVec3::X);
        assert_eq!(edges.len(), 4, "the rim without the diagonal");
        assert!(solid_picture(&SolidView::new("t", &[], &Mesh::default())).is_err());
    }

    #[test]
    fn long_lines_are_broken() {
        let words = "word ".repeat(60);
        let rows = broken(&[words.trim_end().to_string(), "end".into()], 11, 300.0);
        assert!(rows.len() > 4 && rows.last().unwrap() == "end");
        assert!(rows.iter().all(|r| text_width(r, 11) <= 300.0));
    }
}
