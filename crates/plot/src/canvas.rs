//! The one drawing surface of all charts: kuva's scene and rasteriser, with its embedded font.
//! Coordinates are logical pixels, y down; a picture has [`SCALE`] device pixels for each.

use catseye::base::error::{Error, Result};
use catseye::formats::{check_extension, stage};
use image::RgbImage;
use kuva::RasterBackend;
use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};
use std::path::{Path, PathBuf};

/// Device pixels for each logical pixel.
pub const SCALE: f64 = 2.0;

/// Red, green and blue, 0 to 255.
pub type Rgb = [u8; 3];

pub const BLACK: Rgb = [25, 25, 25];
pub const GREY: Rgb = [105, 105, 105];
pub const GRID: Rgb = [226, 226, 226];
pub const WHITE: Rgb = [255, 255, 255];

/// A finished picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pixels: RgbImage,
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
        for (i, p) in pictures.iter().enumerate() {
            let (x, y) = ((i % columns) as u32 * w, (i / columns) as u32 * h);
            image::imageops::replace(&mut pixels, &p.pixels, i64::from(x), i64::from(y));
        }
        Picture { pixels }
    }

    /// Encoded as PNG.
    ///
    /// # Errors
    /// A picture that is too large, or nothing that can be drawn.
    pub fn png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.pixels
            .write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png)
            .map_err(|e| Error::Failed(format!("the picture cannot be encoded: {e}")))?;
        Ok(bytes)
    }

    /// Writes the PNG; an existing file is replaced only with `force`.
    ///
    /// # Errors
    /// A name that ends otherwise than .png.
    pub fn write(&self, path: impl AsRef<Path>, force: bool) -> Result<PathBuf> {
        check_extension(path.as_ref(), &["png"])?;
        stage::write_file(path, force, &self.png()?)
    }
}

/// Stroke of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
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

pub struct Canvas {
    scene: Scene,
    clips: usize,
    upwards: Vec<Upwards>,
    images: Vec<((f64, f64), RgbImage)>,
}

/// A line of text that runs upwards.
struct Upwards {
    baseline_x: f64,
    middle_y: f64,
    content: String,
    size: u32,
    colour: Rgb,
}

impl Canvas {
    pub fn new(width: f64, height: f64) -> Self {
        let scene = Scene::new(width.ceil().max(1.0), height.ceil().max(1.0));
        Canvas { scene, clips: 0, upwards: Vec::new(), images: Vec::new() }
    }

    pub fn finish(self) -> Result<Picture> {
        let mut pixels = rasterised(&self.scene)?;
        for text in &self.upwards {
            stamp_upwards(&mut pixels, text)?;
        }
        for ((x, y), image) in &self.images {
            multiply(&mut pixels, image, (x * SCALE).round() as i64, (y * SCALE).round() as i64);
        }
        Ok(Picture { pixels })
    }

    /// A filled box.
    pub fn rect(&mut self, r: Rect, fill: Rgb, opacity: f64) {
        self.scene.add(Primitive::Rect {
            x: r.x,
            y: r.y,
            width: r.w,
            height: r.h,
            fill: color(fill),
            stroke: None,
            stroke_width: None,
            opacity: Some(opacity),
        });
    }

    /// The four sides of a box, centred on its edges, with square corners.
    pub fn border(&mut self, r: Rect, colour: Rgb, width: f64) {
        let h = 0.5 * width;
        self.rect(Rect { x: r.x - h, y: r.y - h, w: r.w + width, h: width }, colour, 1.0);
        self.rect(Rect { x: r.x - h, y: r.bottom() - h, w: r.w + width, h: width }, colour, 1.0);
        self.rect(Rect { x: r.x - h, y: r.y - h, w: width, h: r.h + width }, colour, 1.0);
        self.rect(Rect { x: r.right() - h, y: r.y - h, w: width, h: r.h + width }, colour, 1.0);
    }

    /// Boxes of many colours that share no border line, as a heat map has.
    pub fn boxes(&mut self, boxes: Vec<(Rect, Rgb)>) {
        self.scene.add(Primitive::RectBatch {
            x: boxes.iter().map(|b| b.0.x).collect(),
            y: boxes.iter().map(|b| b.0.y).collect(),
            w: boxes.iter().map(|b| b.0.w).collect(),
            h: boxes.iter().map(|b| b.0.h).collect(),
            fills: boxes.iter().map(|b| color(b.1)).collect(),
        });
    }

    pub fn polyline(&mut self, points: &[(f64, f64)], pen: Pen) {
        // The rasteriser restarts its dashes at each point, so they are cut here.
        let pieces = match pen.dash {
            Some(dash) => dashes(points, dash),
            None => vec![points.to_vec()],
        };
        for points in pieces.into_iter().filter(|p| p.len() > 1) {
            self.scene.add(Primitive::PolyLine {
                points,
                stroke: color(pen.colour),
                stroke_width: pen.width,
                stroke_dasharray: None,
            });
        }
    }

    pub fn polygon(&mut self, points: &[(f64, f64)], fill: Option<(Rgb, f64)>, stroke: Option<Pen>) {
        if points.len() < 2 {
            return;
        }
        if let Some((fill, opacity)) = fill.filter(|_| points.len() > 2) {
            let mut d = String::new();
            for (i, (x, y)) in points.iter().enumerate() {
                d.push_str(&format!("{}{x:.3} {y:.3} ", if i == 0 { 'M' } else { 'L' }));
            }
            d.push('Z');
            self.scene.add(Primitive::Path(Box::new(PathData {
                d,
                fill: Some(color(fill)),
                stroke: Color::None,
                stroke_width: 0.0,
                opacity: Some(opacity),
                stroke_dasharray: None,
            })));
        }
        if let Some(pen) = stroke {
            let mut closed = points.to_vec();
            closed.push(points[0]);
            self.polyline(&closed, pen);
        }
    }

    pub fn circle(
        &mut self,
        (cx, cy): (f64, f64),
        r: f64,
        fill: Option<(Rgb, f64)>,
        stroke: Option<(Rgb, f64)>,
    ) {
        self.scene.add(Primitive::Circle {
            cx,
            cy,
            r,
            fill: fill.map_or(Color::None, |f| color(f.0)),
            fill_opacity: fill.map(|f| f.1),
            stroke: stroke.map(|s| color(s.0)),
            stroke_width: stroke.map(|s| s.1),
        });
    }

    /// Text with its baseline at `y`.
    pub fn text(&mut self, (x, y): (f64, f64), content: &str, size: u32, anchor: Anchor, colour: Rgb) {
        self.scene.add(Primitive::Text {
            x,
            y,
            // A dollar would start a formula.
            content: content.replace('$', "\\$"),
            size,
            anchor: match anchor {
                Anchor::Start => TextAnchor::Start,
                Anchor::Middle => TextAnchor::Middle,
                Anchor::End => TextAnchor::End,
            },
            rotate: None,
            bold: false,
            color: Some(color(colour)),
        });
    }

    /// Text that runs upwards, its baseline at `x` and its middle at `y`.
    pub fn text_upwards(&mut self, (x, y): (f64, f64), content: &str, size: u32, colour: Rgb) {
        self.upwards.push(Upwards { baseline_x: x, middle_y: y, content: content.into(), size, colour });
    }

    /// An image in device pixels on a white ground, multiplied into the picture with its upper left
    /// corner at (x, y).
    pub fn image(&mut self, at: (f64, f64), image: RgbImage) {
        self.images.push((at, image));
    }

    /// What `draw` draws is cut off at `r`.
    pub fn clipped(&mut self, r: Rect, draw: impl FnOnce(&mut Canvas)) {
        self.clips += 1;
        let id = format!("clip{}", self.clips);
        self.scene.add(Primitive::ClipStart { x: r.x, y: r.y, width: r.w, height: r.h, id });
        draw(self);
        self.scene.add(Primitive::ClipEnd);
    }
}

fn rasterised(scene: &Scene) -> Result<RgbImage> {
    let failed = |e: String| Error::Failed(format!("the picture cannot be drawn: {e}"));
    let png = RasterBackend::new().with_scale(SCALE as f32).render_scene(scene).map_err(failed)?;
    image::load_from_memory_with_format(&png, image::ImageFormat::Png)
        .map(|i| i.into_rgb8())
        .map_err(|e| failed(e.to_string()))
}

/// The rasteriser loses the smooth edges of text that it turns, so such text is drawn level, on white,
/// turned by whole pixels and multiplied into the picture.
fn stamp_upwards(pixels: &mut RgbImage, text: &Upwards) -> Result<()> {
    let width = (text_width(&text.content, text.size) + 16.0).ceil();
    let baseline = f64::from(text.size) * 1.2;
    let mut level = Canvas::new(width, baseline + f64::from(text.size) * 0.5);
    level.text((0.5 * width, baseline), &text.content, text.size, Anchor::Middle, text.colour);
    let turned = image::imageops::rotate270(&rasterised(&level.scene)?);
    let left = ((text.baseline_x - baseline) * SCALE).round() as i64;
    let top = (text.middle_y * SCALE).round() as i64 - i64::from(turned.height() / 2);
    multiply(pixels, &turned, left, top);
    Ok(())
}

/// Multiplies an image on white into a picture; what falls outside is cut off.
fn multiply(pixels: &mut RgbImage, image: &RgbImage, left: i64, top: i64) {
    for (x, y, ink) in image.enumerate_pixels() {
        let at = (u32::try_from(left + i64::from(x)), u32::try_from(top + i64::from(y)));
        if let (Ok(x), Ok(y)) = at
            && let Some(p) = pixels.get_pixel_mut_checked(x, y)
        {
            for (p, ink) in p.0.iter_mut().zip(ink.0) {
                *p = (u16::from(*p) * u16::from(ink) / 255) as u8;
            }
        }
    }
}

fn color(c: Rgb) -> Color {
    Color::Rgb(c[0], c[1], c[2])
}

fn dashes(points: &[(f64, f64)], [on, off]: [f64; 2]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let (mut drawing, mut left) = (true, on);
    let mut piece: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let ((mut x, mut y), (x1, y1)) = (pair[0], pair[1]);
        loop {
            let length = (x1 - x).hypot(y1 - y);
            if length <= left {
                left -= length;
                if drawing {
                    piece.push((x1, y1));
                }
                break;
            }
            x += (x1 - x) * left / length;
            y += (y1 - y) * left / length;
            if drawing {
                piece.push((x, y));
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![(x, y)];
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
    }
    pieces.push(piece);
    pieces
}

/// Width of a line of text in logical pixels, from the advance widths of DejaVu Sans.
pub fn text_width(text: &str, size: u32) -> f64 {
    // Thousandths of an em for ' ' to '~'.
    #[rustfmt::skip]
    const ADVANCE: [u16; 95] = [
        318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636,
        636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632,
        575, 775, 752, 295, 295, 656, 557, 863, 748, 787, 603, 787, 695, 635, 611, 732, 684, 989, 685,
        611, 685, 390, 337, 390, 838, 500, 500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579,
        278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
    ];
    let thousandths: u32 = text
        .chars()
        .map(|c| match c {
            ' '..='~' => u32::from(ADVANCE[c as usize - 32]),
            '−' | '≥' | '±' => 838,
            '°' => 500,
            _ => 636,
        })
        .sum();
    f64::from(thousandths) * 1e-3 * f64::from(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_run_on_over_corners() {
        // Ten units of path with a corner in the middle: 3 on, 1 off.
        let pieces = dashes(&[(0.0, 0.0), (5.0, 0.0), (5.0, 5.0)], [3.0, 1.0]);
        assert_eq!(pieces[0], [(0.0, 0.0), (3.0, 0.0)]);
        assert_eq!(pieces[1], [(4.0, 0.0), (5.0, 0.0), (5.0, 2.0)]);
        assert_eq!(pieces[2], [(5.0, 3.0), (5.0, 5.0)]);
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
