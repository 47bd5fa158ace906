//! The one drawing surface of all charts, drawn by tiny-skia with the font of `font`.
//! Coordinates are logical pixels, y down; a picture has [`SCALE`] device pixels for each. Whatever is drawn is recorded too
//! (`drawing`), for files of vectors.

use super::drawing::Step;
use super::font::outline;
pub use super::font::text_width;
use super::{pdf, svg};
use catseye::base::error::{Error, Result};
use catseye::formats::{check_extension, stage};
use image::RgbImage;
use serde::Serialize;
use std::path::PathBuf;
use tiny_skia::{
    Color, ColorU8, FillRule, IntRect, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke,
    StrokeDash, Transform,
};

/// Device pixels for each logical pixel.
pub const SCALE: f64 = 2.0;

/// Red, green and blue, 0 to 255.
pub type Rgb = [u8; 3];

pub const BLACK: Rgb = [25, 25, 25];
pub const GREY: Rgb = [105, 105, 105];
pub const GRID: Rgb = [226, 226, 226];
pub const WHITE: Rgb = [255, 255, 255];

/// Endings of the files that a picture is written to.
pub const PICTURE_EXTENSIONS: [&str; 3] = ["png", "svg", "pdf"];

/// A finished picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pixels: RgbImage,
    steps: Vec<Step>,
}

impl Picture {
    /// The picture's pixels.
    pub fn pixels(&self) -> &RgbImage {
        &self.pixels
    }

    /// Pictures side by side on white, `columns` to a row, each in a box as large as the largest.
    pub fn sheet(pictures: &[Picture], columns: usize) -> Picture {
        let columns = columns.clamp(1, pictures.len().max(1));
        let rows = pictures.len().div_ceil(columns);
        let largest = |f: fn(&RgbImage) -> u32| pictures.iter().map(|p| f(&p.pixels)).max().unwrap_or(1);
        let (w, h) = (largest(RgbImage::width), largest(RgbImage::height));
        let mut pixels = RgbImage::from_pixel(w * columns as u32, h * rows.max(1) as u32, image::Rgb(WHITE));
        let mut steps = Vec::new();
        for (i, p) in pictures.iter().enumerate() {
            let (x, y) = ((i % columns) as u32 * w, (i / columns) as u32 * h);
            image::imageops::replace(&mut pixels, &p.pixels, i64::from(x), i64::from(y));
            steps.push(Step::Clip { corner: (x, y), size: p.pixels.dimensions(), steps: p.steps.clone() });
        }
        Picture { pixels, steps }
    }

    /// Encoded as PNG.
    ///
    /// # Errors
    /// A picture that cannot be encoded.
    pub fn png(&self) -> Result<Vec<u8>> {
        svg::png(&self.pixels)
    }

    /// As an SVG file. Lines, areas and the outlines of text are vectors; cells of maps are images in the resolution of the PNG.
    ///
    /// # Errors
    /// A picture that cannot be encoded.
    pub fn svg(&self) -> Result<String> {
        svg::svg(self.pixels.dimensions(), SCALE, &self.steps)
    }

    /// As a PDF file of one page without margins, of the same vectors and images as [`svg`](Self::svg). A logical pixel is 1/96 inch.
    pub fn pdf(&self) -> Vec<u8> {
        pdf::pdf(self.pixels.dimensions(), 72.0 / (96.0 * SCALE), &self.steps)
    }

    /// Writes the file: PNG, or SVG or PDF when its name ends so. An existing file is replaced only with `force`.
    ///
    /// # Errors
    /// `BadInput` for a name that ends otherwise than .png, .svg or .pdf, and for a file that exists.
    pub fn write(&self, path: impl AsRef<std::path::Path>, force: bool) -> Result<PathBuf> {
        let path = path.as_ref();
        check_extension(path, &PICTURE_EXTENSIONS)?;
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let bytes = match ending.as_deref() {
            Some("svg") => self.svg()?.into_bytes(),
            Some("pdf") => self.pdf(),
            _ => self.png()?,
        };
        stage::write_file(path, force, &bytes)
    }
}

/// Stroke of a line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pen {
    /// Colour of the stroke.
    pub colour: Rgb,
    /// Width of the stroke, pixels.
    pub width: f64,
    /// Lengths of dash and gap; None for a solid line.
    pub dash: Option<[f64; 2]>,
}

impl Pen {
    /// A solid stroke.
    pub const fn solid(colour: Rgb, width: f64) -> Self {
        Pen { colour, width, dash: None }
    }
    /// A dashed stroke; lengths of dash and gap in pixels.
    pub const fn dashed(colour: Rgb, width: f64, dash: [f64; 2]) -> Self {
        Pen { colour, width, dash: Some(dash) }
    }
}

/// Axis-parallel box in logical pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub x: f64,
    pub y: f64,
    pub w: f64,
    pub h: f64,
}

impl Rect {
    pub fn right(&self) -> f64 {
        self.x + self.w
    }
    pub fn bottom(&self) -> f64 {
        self.y + self.h
    }
    pub fn grown(&self, by: f64) -> Rect {
        Rect { x: self.x - by, y: self.y - by, w: self.w + 2.0 * by, h: self.h + 2.0 * by }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// Where one draws. One that is cut off at a box has only that part of the picture.
pub struct Canvas {
    /// None when the picture is too large.
    pixels: Option<Pixmap>,
    /// The upper left corner in device pixels of the whole picture.
    corner: (i32, i32),
    /// What has been drawn; coordinates are those of `pixels`.
    steps: Vec<Step>,
}

/// A picture with more device pixels than this, of 4 bytes each, is an error.
const MOST_PIXELS: f64 = 268_435_456.0;
/// No picture is larger in device pixels and nothing is drawn farther out, so that the rasteriser need not count without end.
const FAR: f64 = 1e5;

impl Canvas {
    pub fn new(width: f64, height: f64) -> Self {
        let [w, h] = [width, height].map(|v| v.ceil().max(1.0) * SCALE);
        let mut pixels =
            if w.max(h) <= FAR && w * h <= MOST_PIXELS { Pixmap::new(w as u32, h as u32) } else { None };
        if let Some(pixels) = &mut pixels {
            pixels.fill(Color::WHITE);
        }
        Canvas { pixels, corner: (0, 0), steps: Vec::new() }
    }

    pub fn finish(self) -> Result<Picture> {
        let too_large = || Error::Failed("the image cannot be drawn: it has too many pixels".into());
        let drawn = self.pixels.ok_or_else(too_large)?;
        let rgb = drawn.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        let pixels = RgbImage::from_raw(drawn.width(), drawn.height(), rgb).ok_or_else(too_large)?;
        Ok(Picture { pixels, steps: self.steps })
    }

    /// From logical pixels of the picture to device pixels of this canvas.
    fn at(&self, (x, y): (f64, f64)) -> (f32, f32) {
        let on = |v: f64, corner: i32| (v * SCALE - f64::from(corner)).clamp(-FAR, FAR) as f32;
        (on(x, self.corner.0), on(y, self.corner.1))
    }

    fn device_rect(&self, r: Rect) -> Option<tiny_skia::Rect> {
        let ((left, top), (right, bottom)) = (self.at((r.x, r.y)), self.at((r.right(), r.bottom())));
        tiny_skia::Rect::from_ltrb(left, top, right, bottom)
    }

    /// A line through finite points, as a path.
    fn path(&self, points: &[(f64, f64)], closed: bool) -> Option<Path> {
        let mut path = PathBuilder::new();
        for (i, p) in points.iter().enumerate() {
            let (x, y) = self.at(*p);
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if closed {
            path.close();
        }
        path.finish()
    }

    /// Fills a path that is moved or turned by `place`. `text`: the words whose outlines it has.
    fn fill(&mut self, path: Option<Path>, colour: Rgb, opacity: f64, place: Transform, text: Option<&str>) {
        if let (Some(pixels), Some(path)) = (&mut self.pixels, path) {
            pixels.fill_path(&path, &paint(colour, opacity), FillRule::Winding, place, None);
            let text = text.map(String::from);
            let moved = path.transform(place);
            self.steps.extend(moved.map(|path| Step::Fill { path, colour, opacity: byte(opacity), text }));
        }
    }

    /// Strokes a path. Dashes run on over its corners.
    fn stroke(&mut self, path: Option<Path>, pen: Pen) {
        let width = (pen.width * SCALE).min(FAR) as f32;
        if let (Some(pixels), Some(path)) = (&mut self.pixels, path)
            && width > 0.0
        {
            let lengths = pen.dash.map(|d| d.map(|v| (v * SCALE) as f32));
            let dash = lengths.and_then(|d| StrokeDash::new(d.to_vec(), 0.0));
            let drawn = lengths.filter(|_| dash.is_some());
            let line_cap = if dash.is_some() { LineCap::Butt } else { LineCap::Round };
            let stroke = Stroke { width, dash, line_cap, line_join: LineJoin::Round, ..Stroke::default() };
            pixels.stroke_path(&path, &paint(pen.colour, 1.0), &stroke, Transform::identity(), None);
            self.steps.push(Step::Stroke { path, colour: pen.colour, width, dash: drawn });
        }
    }

    /// Records what the box (left, top, right, bottom) of device pixels shows.
    fn record_pixels(&mut self, (x0, y0, x1, y1): (usize, usize, usize, usize)) {
        let Some(pixels) = &self.pixels else { return };
        let width = pixels.width() as usize;
        let lines = pixels.pixels().chunks_exact(width).take(y1).skip(y0);
        let ink = lines.flat_map(|line| &line[x0..x1]).flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        let size = (x1.saturating_sub(x0) as u32, y1.saturating_sub(y0) as u32);
        if size.0 > 0
            && size.1 > 0
            && let Some(image) = RgbImage::from_raw(size.0, size.1, ink)
        {
            self.steps.push(Step::Pixels { corner: (x0 as u32, y0 as u32), image });
        }
    }

    /// A filled box.
    pub fn rect(&mut self, r: Rect, fill: Rgb, opacity: f64) {
        let r = self.device_rect(r);
        if let (Some(pixels), Some(r)) = (&mut self.pixels, r) {
            pixels.fill_rect(r, &paint(fill, opacity), Transform::identity(), None);
            let path = PathBuilder::from_rect(r);
            self.steps.push(Step::Fill { path, colour: fill, opacity: byte(opacity), text: None });
        }
    }

    /// The four sides of a box, centred on its edges, with square corners.
    pub fn border(&mut self, r: Rect, colour: Rgb, width: f64) {
        let h = 0.5 * width;
        self.rect(Rect { x: r.x - h, y: r.y - h, w: r.w + width, h: width }, colour, 1.0);
        self.rect(Rect { x: r.x - h, y: r.bottom() - h, w: r.w + width, h: width }, colour, 1.0);
        self.rect(Rect { x: r.x - h, y: r.y - h, w: width, h: r.h + width }, colour, 1.0);
        self.rect(Rect { x: r.right() - h, y: r.y - h, w: width, h: r.h + width }, colour, 1.0);
    }

    /// Boxes of many colours on whole device pixels, as a heat map has.
    pub fn boxes(&mut self, boxes: Vec<(Rect, Rgb)>) {
        let mut drawn = (usize::MAX, usize::MAX, 0, 0);
        for (r, [red, green, blue]) in boxes {
            let Some(r) = self.device_rect(r) else {
                continue;
            };
            let Some(pixels) = &mut self.pixels else {
                return;
            };
            let (width, height) = (pixels.width() as usize, pixels.height() as usize);
            // What is left of the picture, or above it, is at 0 after the cast.
            let [x0, x1] = [r.left(), r.right()].map(|v| (v.round() as usize).min(width));
            let [y0, y1] = [r.top(), r.bottom()].map(|v| (v.round() as usize).min(height));
            let colour = ColorU8::from_rgba(red, green, blue, 255).premultiply();
            for line in pixels.pixels_mut().chunks_exact_mut(width).take(y1).skip(y0) {
                line[x0..x1].fill(colour);
            }
            if x1 > x0 && y1 > y0 {
                drawn = (drawn.0.min(x0), drawn.1.min(y0), drawn.2.max(x1), drawn.3.max(y1));
            }
        }
        self.record_pixels(drawn);
    }

    /// A line through points. It is broken at those that are not finite.
    pub fn polyline(&mut self, points: &[(f64, f64)], pen: Pen) {
        for piece in points.split(|p| !(p.0.is_finite() && p.1.is_finite())) {
            self.stroke(self.path(piece, false), pen);
        }
    }

    /// A closed line; nothing when a point is not finite.
    pub fn polygon(&mut self, points: &[(f64, f64)], fill: Option<(Rgb, f64)>, stroke: Option<Pen>) {
        if points.len() < 2 {
            return;
        }
        if let Some((fill, opacity)) = fill.filter(|_| points.len() > 2) {
            self.fill(self.path(points, true), fill, opacity, Transform::identity(), None);
        }
        if let Some(pen) = stroke {
            self.stroke(self.path(points, true), pen);
        }
    }

    pub fn circle(
        &mut self,
        centre: (f64, f64),
        r: f64,
        fill: Option<(Rgb, f64)>,
        stroke: Option<(Rgb, f64)>,
    ) {
        let (x, y) = self.at(centre);
        let circle = PathBuilder::from_circle(x, y, (r * SCALE).min(FAR) as f32);
        if let Some((colour, opacity)) = fill {
            self.fill(circle.clone(), colour, opacity, Transform::identity(), None);
        }
        if let Some((colour, width)) = stroke {
            self.stroke(circle, Pen::solid(colour, width));
        }
    }

    /// Text with its baseline at `y`.
    pub fn text(&mut self, (x, y): (f64, f64), content: &str, size: u32, anchor: Anchor, colour: Rgb) {
        let before = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5,
            Anchor::End => 1.0,
        };
        let (x, y) = self.at((x - before * text_width(content, size), y));
        // On a whole pixel the feet of letters are sharp.
        let place = Transform::from_translate(x, y.round());
        self.fill(outline(content, f64::from(size) * SCALE), colour, 1.0, place, Some(content));
    }

    /// Text that runs upwards, its baseline at `x` and its middle at `y`.
    pub fn text_upwards(&mut self, (x, y): (f64, f64), content: &str, size: u32, colour: Rgb) {
        let (x, y) = self.at((x, y + 0.5 * text_width(content, size)));
        let place = Transform::from_row(0.0, -1.0, 1.0, 0.0, x.round(), y);
        self.fill(outline(content, f64::from(size) * SCALE), colour, 1.0, place, Some(content));
    }

    /// An image in device pixels on a white ground, multiplied into what is drawn so far with its upper left corner at
    /// (x, y); what falls outside is cut off.
    pub fn image(&mut self, (x, y): (f64, f64), image: RgbImage) {
        let (left, top) = self.at((x, y));
        let Some(pixels) = &mut self.pixels else {
            return;
        };
        let (width, height) = (pixels.width(), pixels.height());
        let (left, top) = (left.round() as i64, top.round() as i64);
        for (x, y, ink) in image.enumerate_pixels() {
            let at = (u32::try_from(left + i64::from(x)), u32::try_from(top + i64::from(y)));
            if let (Ok(x), Ok(y)) = at
                && x < width
                && y < height
            {
                let p = &mut pixels.pixels_mut()[y as usize * width as usize + x as usize];
                let [r, g, b] = [(p.red(), ink[0]), (p.green(), ink[1]), (p.blue(), ink[2])]
                    .map(|(p, ink)| (u16::from(p) * u16::from(ink) / 255) as u8);
                *p = ColorU8::from_rgba(r, g, b, 255).premultiply();
            }
        }
        let end = |from: i64, by: u32, limit: u32| (from + i64::from(by)).clamp(0, i64::from(limit)) as usize;
        let (x0, y0) = (end(left, 0, width), end(top, 0, height));
        self.record_pixels((x0, y0, end(left, image.width(), width), end(top, image.height(), height)));
    }

    /// What `draw` draws is cut off at `r`, outwards to whole device pixels.
    pub fn clipped(&mut self, r: Rect, draw: impl FnOnce(&mut Canvas)) {
        let inside = self.device_rect(r).and_then(|r| r.round_out());
        let Some(pixels) = &mut self.pixels else {
            return;
        };
        let whole = IntRect::from_xywh(0, 0, pixels.width(), pixels.height());
        let Some(part) = inside.zip(whole).and_then(|(r, whole)| r.intersect(&whole)) else {
            return;
        };
        let corner = (self.corner.0 + part.x(), self.corner.1 + part.y());
        let mut canvas = Canvas { pixels: pixels.clone_rect(part), corner, steps: Vec::new() };
        draw(&mut canvas);
        let Some(drawn) = canvas.pixels else {
            return;
        };
        let (width, x, w) = (pixels.width() as usize, part.x() as usize, part.width() as usize);
        let lines = pixels.pixels_mut().chunks_exact_mut(width).skip(part.y() as usize);
        for (line, drawn) in lines.zip(drawn.pixels().chunks_exact(w)) {
            line[x..x + w].copy_from_slice(drawn);
        }
        if !canvas.steps.is_empty() {
            let corner = (part.x() as u32, part.y() as u32);
            self.steps.push(Step::Clip { corner, size: (part.width(), part.height()), steps: canvas.steps });
        }
    }
}

/// An opacity of 0 to 1 as 0 to 255.
fn byte(opacity: f64) -> u8 {
    (opacity.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn paint([r, g, b]: Rgb, opacity: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, byte(opacity));
    paint
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(draw: impl FnOnce(&mut Canvas)) -> RgbImage {
        let mut c = Canvas::new(40.0, 30.0);
        draw(&mut c);
        c.finish().unwrap().pixels
    }

    /// Whether the pixel at these logical pixels is darker than grey.
    fn dark(img: &RgbImage, x: f64, y: f64) -> bool {
        img.get_pixel((x * SCALE) as u32, (y * SCALE) as u32).0[0] < 128
    }

    #[test]
    fn dashes_run_on_over_corners() {
        // 30 of path with a corner in the middle: 6 on, 3 off; the second dash ends at the corner, and the third begins 3 on.
        let pen = Pen::dashed(BLACK, 2.0, [6.0, 3.0]);
        let img = drawn(|c| c.polyline(&[(5.0, 5.0), (20.0, 5.0), (20.0, 20.0)], pen));
        for (along, on) in [(1.0, true), (5.0, true), (7.5, false), (10.0, true), (14.0, true), (16.5, false)]
        {
            let at = if along < 15.0 { (5.0 + along, 5.0) } else { (20.0, along - 10.0) };
            assert_eq!(dark(&img, at.0, at.1), on, "{along}");
        }
        assert!(dark(&img, 20.0, 9.0) && dark(&img, 20.0, 13.0) && !dark(&img, 20.0, 15.5));
    }

    #[test]
    fn shapes_are_filled_stroked_and_smooth() {
        let img = drawn(|c| c.circle((20.0, 15.0), 8.0, Some((BLACK, 0.5)), None));
        assert_eq!(img.get_pixel(40, 30).0, [140; 3]);
        assert!(img.pixels().any(|p| p.0[0] > 150 && p.0[0] < 240), "no smooth edge");
        let area = img.pixels().map(|p| f64::from(255 - p.0[0]) / 115.0).sum::<f64>() / (SCALE * SCALE);
        assert!((area - std::f64::consts::PI * 64.0).abs() < 2.0, "{area}");
        let img = drawn(|c| c.circle((20.0, 15.0), 8.0, None, Some((BLACK, 2.0))));
        assert!(dark(&img, 28.0, 15.0) && dark(&img, 20.0, 7.0) && !dark(&img, 20.0, 15.0));
        let corners = [(5.0, 5.0), (35.0, 5.0), (5.0, 25.0)];
        let img = drawn(|c| c.polygon(&corners, Some((GRID, 1.0)), Some(Pen::solid(BLACK, 1.0))));
        assert_eq!((img.get_pixel(20, 20).0, img.get_pixel(70, 50).0), (GRID, WHITE));
        assert!([(20.0, 5.0), (5.0, 15.0), (20.0, 15.0)].iter().all(|p| dark(&img, p.0, p.1)));
    }

    #[test]
    fn nothing_is_drawn_outside_a_clip() {
        let all = Rect { x: -50.0, y: -50.0, w: 200.0, h: 200.0 };
        let (outer, inner) =
            (Rect { x: 10.0, y: 5.0, w: 50.0, h: 20.0 }, Rect { x: 0.0, y: 10.0, w: 20.0, h: 50.0 });
        let ink = |img: &RgbImage| img.pixels().filter(|p| p.0 == BLACK).count();
        let fills: [&dyn Fn(&mut Canvas); 3] =
            [&|c| c.rect(all, BLACK, 1.0), &|c| c.boxes(vec![(all, BLACK)]), &|c| {
                c.image((-10.0, -10.0), RgbImage::from_pixel(200, 200, image::Rgb(BLACK)))
            }];
        for fill in fills {
            let img = drawn(|c| c.clipped(outer, |c| c.clipped(inner, fill)));
            assert_eq!(ink(&img), 20 * 30);
            assert!(dark(&img, 10.0, 10.0) && dark(&img, 19.9, 24.9) && !dark(&img, 9.9, 10.0));
        }
        // Places are those of the picture also within.
        let img =
            drawn(|c| c.clipped(outer, |c| c.boxes(vec![(Rect { x: 12.0, y: 7.0, w: 1.0, h: 1.0 }, BLACK)])));
        assert!(ink(&img) == 4 && dark(&img, 12.0, 7.0));
        let away = Rect { x: 500.0, ..outer };
        assert_eq!(ink(&drawn(|c| c.clipped(away, |c| c.rect(all, BLACK, 1.0)))), 0);
    }

    #[test]
    fn anchors_and_upwards_text() {
        let extent = |img: &RgbImage| {
            let ink = |p: &(u32, u32, &image::Rgb<u8>)| p.2.0[0] < 200;
            let (xs, ys): (Vec<u32>, Vec<u32>) =
                img.enumerate_pixels().filter(ink).map(|p| (p.0, p.1)).unzip();
            let ends = |v: &[u32]| [v.iter().min(), v.iter().max()].map(|v| f64::from(*v.unwrap()) / SCALE);
            (ends(&xs), ends(&ys))
        };
        for (anchor, middle) in [(Anchor::Start, 26.0), (Anchor::Middle, 20.0), (Anchor::End, 14.0)] {
            // Two letters as wide as high, of an advance of 6 each.
            let text = "oo";
            let width = text_width(text, 10);
            let (x, y) = extent(&drawn(|c| c.text((20.0, 20.0), text, 10, anchor, BLACK)));
            let middle = 20.0 + (middle - 20.0) / 12.0 * width;
            assert!((0.5 * (x[0] + x[1]) - middle).abs() < 0.6, "{anchor:?} {x:?}");
            assert!(y[1] > 19.0 && y[1] < 20.6 && y[0] > 13.5 && y[0] < 15.5, "{y:?}");
        }
        let (x, y) = extent(&drawn(|c| c.text_upwards((20.0, 15.0), "ooo", 10, BLACK)));
        assert!((0.5 * (y[0] + y[1]) - 15.0).abs() < 0.6 && y[1] - y[0] > 15.0, "{y:?}");
        assert!(x[1] > 19.0 && x[1] < 20.6 && x[0] > 13.5, "{x:?}");
    }

    #[test]
    fn odd_coordinates_and_characters_do_no_harm() {
        let odd =
            [0.0, -0.0, 12.5, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 3e9, -4e5, 1e-300];
        for x in odd {
            for y in odd {
                let r = Rect { x, y, w: y, h: x };
                let img = drawn(|c| {
                    c.rect(r, BLACK, x);
                    c.border(r, BLACK, y);
                    c.boxes(vec![(r, GREY), (Rect { x: 1.0, y: 1.0, w: x, h: y }, GREY)]);
                    c.circle((x, y), 3.0, Some((BLACK, y)), Some((GREY, x)));
                    c.circle((3.0, 4.0), x, Some((BLACK, 1.0)), Some((GREY, y)));
                    c.image((x, y), RgbImage::new(3, 2));
                    let points = [(x, y), (10.0, 10.0), (y, x), (20.0, y), (x, 20.0)];
                    for dash in [None, Some([3.0, 2.0]), Some([x, y])] {
                        c.polyline(&points, Pen { colour: BLACK, width: 1.5, dash });
                        c.polygon(&points, Some((GRID, 1.0)), Some(Pen { colour: BLACK, width: x, dash }));
                    }
                    for text in ["", "車両 🚗 \n\t\0$x$ e\u{301} \u{202e}שלום"] {
                        c.text((x, y), text, 12, Anchor::End, BLACK);
                        c.text_upwards((x, y), text, 12, BLACK);
                    }
                    c.clipped(r, |c| c.rect(Rect { x: 0.0, y: 0.0, w: 9.0, h: 9.0 }, BLACK, 1.0));
                });
                assert_eq!(img.dimensions(), (80, 60));
            }
        }
        assert_eq!(Canvas::new(f64::NAN, 0.0).finish().unwrap().pixels.dimensions(), (2, 2));
        for huge in [1e6, 1e300, f64::INFINITY] {
            let mut c = Canvas::new(huge, 1e6);
            c.text((5.0, 5.0), "lost", 12, Anchor::Start, BLACK);
            c.clipped(Rect { x: 0.0, y: 0.0, w: 9.0, h: 9.0 }, |c| c.circle((5.0, 5.0), 2.0, None, None));
            assert!(c.finish().is_err());
        }
    }

    #[test]
    fn a_character_that_the_font_lacks_is_seen() {
        let img = drawn(|c| c.text((5.0, 20.0), "車", 16, Anchor::Start, BLACK));
        assert!(img.pixels().filter(|p| p.0 == BLACK).count() > 20);
    }

    #[test]
    fn text_is_as_wide_as_it_is_measured() {
        let mut c = Canvas::new(300.0, 40.0);
        let text = "−12.5 range rate (m/s)|";
        c.text((10.0, 25.0), text, 14, Anchor::Start, BLACK);
        let img = c.finish().unwrap().pixels().clone();
        let last = img.enumerate_pixels().filter(|p| p.2.0[0] < 128).map(|p| p.0).max().unwrap();
        // The bar's ink ends in the middle of its advance, 0.337 em wide.
        let expected = SCALE * (10.0 + text_width(text, 14) - 0.5 * 0.337 * 14.0);
        assert!((f64::from(last) - expected).abs() < 6.0, "{last} {expected}");
    }
}
