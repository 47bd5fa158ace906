//! Drawings as PDF: one page, whose content is compressed. Text is outlines.

use super::drawing::Step;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use image::RgbImage;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref};
use std::collections::BTreeSet;
use std::io::Write as _;
use tiny_skia::{Path, PathSegment};

/// A drawing of `size` device pixels as a PDF file, `point` points (1/72 inch) to a device pixel. Equal drawings give equal bytes: the
/// file has no date.
pub fn pdf(size: (u32, u32), point: f64, steps: &[Step]) -> Vec<u8> {
    let [width, height] = [size.0, size.1].map(|v| (f64::from(v) * point) as f32);
    let mut page = Page { content: Content::new(), images: Vec::new(), opacities: BTreeSet::new() };
    // A page of PDF has y upwards.
    page.content.transform([point as f32, 0.0, 0.0, -point as f32, 0.0, height]);
    page.draw(steps);

    let (catalog, pages, leaf, content) = (Ref::new(1), Ref::new(2), Ref::new(3), Ref::new(4));
    let image_ref = |i: usize| Ref::new(5 + i as i32);
    let mut file = Pdf::new();
    file.catalog(catalog).pages(pages);
    file.pages(pages).kids([leaf]).count(1);
    let mut sheet = file.page(leaf);
    sheet.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(content);
    let mut resources = sheet.resources();
    let mut images = resources.x_objects();
    for i in 0..page.images.len() {
        images.pair(Name(&image_name(i)), image_ref(i));
    }
    images.finish();
    let mut states = resources.ext_g_states();
    for opacity in &page.opacities {
        let mut state =
            states.insert(Name(&state_name(*opacity))).start::<pdf_writer::writers::ExtGraphicsState<'_>>();
        state.non_stroking_alpha(f32::from(*opacity) / 255.0);
    }
    states.finish();
    resources.finish();
    sheet.finish();
    file.stream(content, &deflated(&page.content.finish())).filter(Filter::FlateDecode);
    for (i, image) in page.images.iter().enumerate() {
        let bytes = deflated(image.as_raw());
        let mut object = file.image_xobject(image_ref(i), &bytes);
        object.filter(Filter::FlateDecode);
        object.width(image.width() as i32).height(image.height() as i32);
        object.color_space().device_rgb();
        object.bits_per_component(8);
    }
    file.finish()
}

/// The page's content, and what it refers to.
struct Page<'a> {
    content: Content,
    images: Vec<&'a RgbImage>,
    opacities: BTreeSet<u8>,
}

impl<'a> Page<'a> {
    fn draw(&mut self, steps: &'a [Step]) {
        for step in steps {
            self.content.save_state();
            match step {
                Step::Fill { path, colour, opacity, text: _ } => {
                    let [r, g, b] = shares(*colour);
                    self.content.set_fill_rgb(r, g, b);
                    if *opacity < 255 {
                        self.opacities.insert(*opacity);
                        self.content.set_parameters(Name(&state_name(*opacity)));
                    }
                    self.path(path);
                    self.content.fill_nonzero();
                }
                Step::Stroke { path, colour, width, dash } => {
                    let [r, g, b] = shares(*colour);
                    self.content.set_stroke_rgb(r, g, b).set_line_width(*width);
                    self.content.set_line_join(LineJoinStyle::RoundJoin);
                    match dash {
                        None => self.content.set_line_cap(LineCapStyle::RoundCap),
                        Some(lengths) => self.content.set_dash_pattern(*lengths, 0.0),
                    };
                    self.path(path);
                    self.content.stroke();
                }
                Step::Pixels { corner: (x, y), image } => {
                    let [x, y, w, h] = [*x, *y, image.width(), image.height()].map(|v| v as f32);
                    // An image fills the unit square, its first row at the top, where y is 1.
                    self.content.transform([w, 0.0, 0.0, -h, x, y + h]);
                    self.content.x_object(Name(&image_name(self.images.len())));
                    self.images.push(image);
                }
                Step::Clip { corner: (x, y), size: (w, h), steps } => {
                    let [x, y, w, h] = [*x, *y, *w, *h].map(|v| v as f32);
                    self.content.rect(x, y, w, h).clip_nonzero().end_path();
                    self.content.transform([1.0, 0.0, 0.0, 1.0, x, y]);
                    self.draw(steps);
                }
            }
            self.content.restore_state();
        }
    }

    fn path(&mut self, path: &Path) {
        let (mut x, mut y) = (0.0, 0.0);
        for segment in path.segments() {
            match segment {
                PathSegment::MoveTo(p) => self.content.move_to(p.x, p.y),
                PathSegment::LineTo(p) => self.content.line_to(p.x, p.y),
                // PDF has curves of the third order only, of which this is one.
                PathSegment::QuadTo(a, p) => {
                    let near = |end: f32, control: f32| end + 2.0 / 3.0 * (control - end);
                    let (x1, y1) = (near(x, a.x), near(y, a.y));
                    self.content.cubic_to(x1, y1, near(p.x, a.x), near(p.y, a.y), p.x, p.y)
                }
                PathSegment::CubicTo(a, b, p) => self.content.cubic_to(a.x, a.y, b.x, b.y, p.x, p.y),
                PathSegment::Close => self.content.close_path(),
            };
            if let PathSegment::MoveTo(p)
            | PathSegment::LineTo(p)
            | PathSegment::QuadTo(_, p)
            | PathSegment::CubicTo(_, _, p) = segment
            {
                (x, y) = (p.x, p.y);
            }
        }
    }
}

fn image_name(i: usize) -> Vec<u8> {
    format!("I{i}").into_bytes()
}

fn state_name(opacity: u8) -> Vec<u8> {
    format!("O{opacity}").into_bytes()
}

/// Shares of red, green and blue, 0 to 1.
fn shares(colour: [u8; 3]) -> [f32; 3] {
    colour.map(|v| f32::from(v) / 255.0)
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    // A vector takes every byte.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}
