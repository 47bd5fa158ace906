//! The frame that all rectangular charts share: title, legend, axes, colour bar, and layers drawn in
//! data coordinates.

use super::axis::{Axis, tick_labels};
use super::canvas::{Anchor, BLACK, Canvas, GREY, GRID, Pen, Picture, Rect, Rgb, SCALE, text_width};
use catseye::base::error::Result;
use serde::Serialize;

pub const TICK_SIZE: u32 = 12;
pub const LABEL_SIZE: u32 = 13;
pub const TITLE_SIZE: u32 = 15;
const LEGEND_ROW: f64 = 19.0;

/// Curve colours that stay apart in print and for colour-blind readers (Okabe and Ito 2008).
pub const CURVE_COLOURS: [Rgb; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [60, 60, 60],
];

/// A sequence of colours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ColourMap {
    /// Dark to bright, even steps in lightness.
    Viridis,
    /// Blue below, red above, white in the middle.
    BlueWhiteRed,
}

/// Values to colours, and the colour bar that explains them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scale {
    /// The colours.
    pub map: ColourMap,
    /// Axis of the values.
    pub axis: Axis,
}

impl Scale {
    /// A scale from `lo` to `hi`.
    pub fn new(map: ColourMap, label: impl Into<String>, lo: f64, hi: f64) -> Self {
        Scale { map, axis: Axis::new(label, lo, hi) }
    }

    /// NaN has no colour; values outside the limits take the end colours.
    pub fn colour(&self, value: f64) -> Option<Rgb> {
        // Steps of 1/255 let equal neighbours of a heat map join.
        let t = (self.axis.fraction(value).clamp(0.0, 1.0) * 255.0).round() / 255.0;
        let c = match self.map {
            _ if value.is_nan() => return None,
            ColourMap::Viridis => colorous::VIRIDIS.eval_continuous(t),
            ColourMap::BlueWhiteRed => colorous::RED_BLUE.eval_continuous(1.0 - t),
        };
        Some([c.r, c.g, c.b])
    }
}

/// What colours marks.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Paint {
    /// One colour for all.
    Fixed(Rgb),
    /// One value a point, coloured by the chart's scale.
    Scaled(Vec<f64>),
}

/// Shape of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "kebab-case")]
pub enum Mark {
    /// A filled circle.
    Dot {
        /// Radius, pixels.
        radius: f64,
    },
    /// An open circle that shows on dark and on bright ground.
    Ring {
        /// Radius, pixels.
        radius: f64,
    },
    /// A filled diamond.
    Diamond {
        /// Half its height, pixels.
        radius: f64,
    },
    /// Two strokes that show on dark and on bright ground.
    Cross {
        /// Half its height, pixels.
        radius: f64,
    },
}

/// One layer of a chart, in the units of its axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "layer", rename_all = "kebab-case")]
pub enum Layer {
    /// Cells of equal size between the given edges, `[row, column]`, row 0 at `y.0`.
    Cells {
        /// Outer edges along x.
        x: (f64, f64),
        /// Outer edges along y.
        y: (f64, f64),
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
        /// Value of each cell.
        values: Vec<f64>,
    },
    /// Like `Cells`, each value the number of its colour; white where there is none.
    Classes {
        /// Outer edges along x.
        x: (f64, f64),
        /// Outer edges along y.
        y: (f64, f64),
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
        /// Number of each cell's colour.
        values: Vec<f64>,
        /// The colours.
        colours: Vec<Rgb>,
    },
    /// Breaks where a coordinate is not finite.
    Line {
        /// Points in order.
        points: Vec<[f64; 2]>,
        /// Stroke of the line.
        pen: Pen,
    },
    /// Marks at points.
    Marks {
        /// Where they stand.
        points: Vec<[f64; 2]>,
        /// Their shape.
        mark: Mark,
        /// Their colours.
        paint: Paint,
    },
    /// A polygon.
    Area {
        /// Corners in order.
        polygon: Vec<[f64; 2]>,
        /// Colour and opacity of its area.
        fill: Option<(Rgb, f64)>,
        /// Stroke of its outline.
        stroke: Option<Pen>,
    },
}

/// One entry of the legend.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Key {
    /// Text of the entry.
    pub label: String,
    /// What stands before the text.
    pub symbol: Symbol,
}

/// What stands before an entry of the legend.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Symbol {
    /// A short line.
    Line(Pen),
    /// A line with marks on it in its colour.
    Marked(Pen, Mark),
    /// A mark in a colour.
    Mark(Mark, Rgb),
    /// A small area.
    Area {
        /// Colour and opacity of its area.
        fill: (Rgb, f64),
        /// Stroke of its outline.
        stroke: Pen,
    },
    /// Words alone, of what is not drawn.
    Note,
}

/// A chart as plain data; [`draw`](Chart::draw) makes the picture. As JSON it is what another program needs to draw it, such as a page
/// in a browser: axes, layers in data coordinates, colours as [red, green, blue]. A number that is not finite becomes null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// Title above the frame.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Size of the frame in logical pixels.
    pub width: f64,
    /// Height of the picture, pixels.
    pub height: f64,
    /// Whether lines are drawn at ticks.
    pub grid: bool,
    /// Colours of values, with their bar.
    pub scale: Option<Scale>,
    /// Layers, the lowest first.
    pub layers: Vec<Layer>,
    /// Entries of the legend.
    pub keys: Vec<Key>,
}

impl Chart {
    /// A chart without layers.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Chart {
            title: title.into(),
            x,
            y,
            width: 600.0,
            height: 400.0,
            grid: true,
            scale: None,
            layers: Vec::new(),
            keys: Vec::new(),
        }
    }

    /// Adds an entry to the legend.
    pub fn key(&mut self, label: impl Into<String>, symbol: Symbol) {
        self.keys.push(Key { label: label.into(), symbol });
    }

    /// Sizes the frame so that both axes have the same scale, within a box of `width` by `height`;
    /// a frame that would be too thin gets more of its axis instead.
    pub fn equal_scale(mut self, width: f64, height: f64) -> Self {
        const THINNEST: f64 = 200.0;
        let (dx, dy) = ((self.x.hi - self.x.lo).abs(), (self.y.hi - self.y.lo).abs());
        let per_metre = (width / dx).min(height / dy);
        for (axis, d, pixels) in [(&mut self.x, dx, &mut self.width), (&mut self.y, dy, &mut self.height)] {
            *pixels = (d * per_metre).max(THINNEST).round();
            let more = 0.5 * (*pixels / per_metre - d) * (axis.hi - axis.lo).signum();
            axis.lo -= more;
            axis.hi += more;
        }
        self
    }

    /// Marks and what the legend says of them.
    pub fn marks(&mut self, label: impl Into<String>, points: Vec<[f64; 2]>, mark: Mark, colour: Rgb) {
        self.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(colour) });
        self.key(label, Symbol::Mark(mark, colour));
    }

    /// Labels of the legend whose symbol is drawn nowhere.
    #[cfg(test)]
    pub fn unfounded_keys(&self) -> Vec<&str> {
        let drawn = |key: &Key| {
            key.symbol == Symbol::Note
                || self.layers.iter().any(|layer| match (layer, &key.symbol) {
                    (Layer::Line { pen, .. }, Symbol::Line(p)) => pen == p,
                    (Layer::Line { pen, .. }, Symbol::Marked(p, _)) => pen == p,
                    (Layer::Area { fill: None, stroke: Some(pen), .. }, Symbol::Line(p)) => pen == p,
                    (Layer::Marks { mark, paint: Paint::Fixed(c), .. }, Symbol::Mark(m, k)) => {
                        (mark, c) == (m, k)
                    }
                    (Layer::Marks { mark, paint: Paint::Scaled(_), .. }, Symbol::Mark(m, _)) => mark == m,
                    (Layer::Area { fill: Some(f), stroke, .. }, Symbol::Area { fill, stroke: s }) => {
                        f == fill && stroke.is_none_or(|d| d == *s)
                    }
                    (Layer::Classes { colours, .. }, Symbol::Area { fill, .. }) => colours.contains(&fill.0),
                    _ => false,
                })
        };
        self.keys.iter().filter(|k| !drawn(k)).map(|k| k.label.as_str()).collect()
    }

    /// Draws the chart.
    ///
    /// # Errors
    /// Only when the rasteriser fails.
    pub fn draw(&self) -> Result<Picture> {
        let x_ticks = fitting_ticks(&self.x, self.width);
        let y_ticks = self.y.ticks(((self.height / 38.0) as usize).max(2));
        let (x_labels, y_labels) = (self.x.labels(&x_ticks), self.y.labels(&y_ticks));
        let widest = |labels: &[String]| labels.iter().map(|l| text_width(l, TICK_SIZE)).fold(0.0, f64::max);

        let left = (12.0 + 16.0 + 8.0 + widest(&y_labels) + 9.0).ceil();
        let rows = legend_rows(&self.keys, self.width);
        let top = header_height(&self.title, self.width.round(), rows.len());
        let bottom = 52.0;
        let mut right = (8.0 + x_labels.last().map_or(0.0, |l| 0.5 * text_width(l, TICK_SIZE))).max(18.0);
        let bar = self.scale.as_ref().map(|scale| {
            let ticks = scale.axis.ticks(((self.height / 38.0) as usize).max(2));
            let labels = tick_labels(&ticks);
            right = (16.0 + 14.0 + 9.0 + widest(&labels) + 8.0 + 16.0 + 8.0).ceil();
            (scale, ticks, labels)
        });
        let frame = Rect { x: left, y: top, w: self.width.round(), h: self.height.round() };
        let mut c = Canvas::new(left + frame.w + right, top + frame.h + bottom);
        draw_header(&mut c, &self.title, &rows, frame);

        let at = |p: [f64; 2]| {
            (frame.x + self.x.fraction(p[0]) * frame.w, frame.bottom() - self.y.fraction(p[1]) * frame.h)
        };
        let grid_lines = |c: &mut Canvas, opacity: f64| {
            for t in &x_ticks {
                let x = at([*t, self.y.lo]).0.round();
                c.rect(Rect { x: x - 0.5, y: frame.y, w: 1.0, h: frame.h }, GRID, opacity);
            }
            for t in &y_ticks {
                let y = at([self.x.lo, *t]).1.round();
                c.rect(Rect { x: frame.x, y: y - 0.5, w: frame.w, h: 1.0 }, GRID, opacity);
            }
        };
        if self.grid {
            grid_lines(&mut c, 1.0);
        }
        c.clipped(frame, |c| {
            for layer in &self.layers {
                self.draw_layer(c, layer, frame, &at);
            }
        });
        c.border(frame, BLACK, 1.0);

        for (t, label) in x_ticks.iter().zip(&x_labels) {
            let x = at([*t, self.y.lo]).0;
            c.rect(Rect { x: x.round() - 0.5, y: frame.bottom(), w: 1.0, h: 5.0 }, BLACK, 1.0);
            c.text((x, frame.bottom() + 18.0), label, TICK_SIZE, Anchor::Middle, BLACK);
        }
        c.text(
            (frame.x + 0.5 * frame.w, frame.bottom() + 40.0),
            fitting_label(&self.x.label, self.width),
            LABEL_SIZE,
            Anchor::Middle,
            BLACK,
        );
        for (t, label) in y_ticks.iter().zip(&y_labels) {
            let y = at([self.x.lo, *t]).1;
            c.rect(Rect { x: frame.x - 5.0, y: y.round() - 0.5, w: 5.0, h: 1.0 }, BLACK, 1.0);
            c.text((frame.x - 9.0, y + 4.5), label, TICK_SIZE, Anchor::End, BLACK);
        }
        let label = fitting_label(&self.y.label, self.height);
        c.text_upwards((22.0, frame.y + 0.5 * frame.h), label, LABEL_SIZE, BLACK);
        if let Some((scale, ticks, labels)) = bar {
            let bar = Rect { x: frame.right() + 16.0, y: frame.y, w: 14.0, h: frame.h };
            draw_colour_bar(&mut c, bar, scale, &ticks, &labels);
        }
        c.finish()
    }

    fn draw_layer(&self, c: &mut Canvas, layer: &Layer, frame: Rect, at: &dyn Fn([f64; 2]) -> (f64, f64)) {
        let colour = |value: f64| self.scale.as_ref().map_or(Some(GREY), |s| s.colour(value));
        match layer {
            Layer::Cells { x, y, rows, columns, values } => {
                c.boxes(self.cell_boxes(frame, (*x, *y), (*rows, *columns), values, &colour));
            }
            Layer::Classes { x, y, rows, columns, values, colours } => {
                let of = |value: f64| colours.get(value as usize).copied();
                c.boxes(self.cell_boxes(frame, (*x, *y), (*rows, *columns), values, &of));
            }
            Layer::Line { points, pen } => {
                let inside = frame.grown(8.0);
                for piece in points.split(|p| !(p[0].is_finite() && p[1].is_finite())) {
                    let pixels: Vec<_> = piece.iter().map(|p| at(*p)).collect();
                    for run in clip_polyline(&pixels, inside) {
                        c.polyline(&run, *pen);
                    }
                }
            }
            Layer::Marks { points, mark, paint } => {
                let near = frame.grown(8.0);
                for (i, p) in points.iter().enumerate() {
                    let centre = at(*p);
                    let within = (near.x..=near.right()).contains(&centre.0)
                        && (near.y..=near.bottom()).contains(&centre.1);
                    let fill = match paint {
                        Paint::Fixed(rgb) => Some(*rgb),
                        Paint::Scaled(v) => v.get(i).and_then(|v| colour(*v)),
                    };
                    if let Some(fill) = fill.filter(|_| within) {
                        draw_mark(c, centre, *mark, fill);
                    }
                }
            }
            Layer::Area { polygon, fill, stroke } => {
                if polygon.iter().any(|p| !(p[0].is_finite() && p[1].is_finite())) {
                    return;
                }
                let pixels: Vec<_> = polygon.iter().map(|p| at(*p)).collect();
                c.polygon(&clip_polygon(&pixels, frame.grown(8.0)), *fill, *stroke);
            }
        }
    }

    /// Boxes on whole device pixels, of cells between the edges (x, y). Where cells are smaller than a pixel, the
    /// largest one shows, so that a peak is never lost.
    fn cell_boxes(
        &self,
        frame: Rect,
        edges: ((f64, f64), (f64, f64)),
        (rows, columns): (usize, usize),
        values: &[f64],
        colour: &dyn Fn(f64) -> Option<Rgb>,
    ) -> Vec<(Rect, Rgb)> {
        let across = spans(&self.x, frame.w, edges.0, columns, false);
        let mut boxes: Vec<(Rect, Rgb)> = Vec::new();
        for row in spans(&self.y, frame.h, edges.1, rows, true) {
            let y = frame.y + row.from as f64 / SCALE;
            let h = (row.to - row.from) as f64 / SCALE;
            // The right-hand end and the colour of the box that may still grow.
            let mut open: Option<(usize, Rgb)> = None;
            for column in &across {
                let mut largest = f64::NAN;
                for r in row.cells.0..=row.cells.1 {
                    let line = r * columns;
                    for v in values.get(line + column.cells.0..=line + column.cells.1).unwrap_or(&[]) {
                        largest = largest.max(*v);
                    }
                }
                let rgb = colour(largest);
                let (x, x1) = (frame.x + column.from as f64 / SCALE, frame.x + column.to as f64 / SCALE);
                match (rgb, boxes.last_mut()) {
                    (Some(rgb), Some((r, _))) if open == Some((column.from, rgb)) => r.w = x1 - r.x,
                    (Some(rgb), _) => boxes.push((Rect { x, y, w: x1 - x, h }, rgb)),
                    (None, _) => {}
                }
                open = rgb.map(|rgb| (column.to, rgb));
            }
        }
        boxes
    }
}

/// The label, or what stands before its comma where there is no room for all of it.
fn fitting_label(label: &str, room: f64) -> &str {
    match label.split_once(", ") {
        Some((short, _)) if text_width(label, LABEL_SIZE) > room => short,
        _ => label,
    }
}

/// As many ticks as fit without their labels touching.
fn fitting_ticks(axis: &Axis, width: f64) -> Vec<f64> {
    let mut count = ((width / 60.0) as usize).max(2);
    if !axis.names.is_empty() {
        return axis.ticks(count);
    }
    loop {
        let ticks = axis.ticks(count);
        let widest = tick_labels(&ticks).iter().map(|l| text_width(l, TICK_SIZE)).fold(0.0, f64::max);
        let spacing = ticks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        if count <= 2 || spacing / (axis.hi - axis.lo).abs() * width > widest + 14.0 {
            return ticks;
        }
        count -= 1;
    }
}

/// Height of title and legend above a frame.
pub(super) fn header_height(title: &str, width: f64, legend_rows: usize) -> f64 {
    title_height(title_lines(title, width).len())
        + if legend_rows > 0 { LEGEND_ROW * legend_rows as f64 + 5.0 } else { 0.0 }
}

const TITLE_ROW: f64 = 20.0;

fn title_height(lines: usize) -> f64 {
    if lines == 0 { 12.0 } else { 16.0 + TITLE_ROW * lines as f64 }
}

/// Title and legend above `frame`.
pub(super) fn draw_header(c: &mut Canvas, title: &str, rows: &[Vec<(f64, Key)>], frame: Rect) {
    let lines = title_lines(title, frame.w);
    let mut y = frame.y - header_height(title, frame.w, rows.len());
    for (i, line) in lines.iter().enumerate() {
        c.text((frame.x, y + 24.0 + TITLE_ROW * i as f64), line, TITLE_SIZE, Anchor::Start, BLACK);
    }
    y += title_height(lines.len());
    for row in rows {
        for (x, key) in row {
            let x = frame.x + x;
            let middle = y + 0.5 * LEGEND_ROW - 2.0;
            match key.symbol {
                Symbol::Line(pen) => {
                    if pen.colour.iter().all(|v| *v > 235) {
                        // A pale line is made for heat maps, so it is shown on their darkest colour.
                        let ground = Rect { x, y: middle - 5.0, w: SYMBOL, h: 10.0 };
                        c.rect(ground, [68, 1, 84], 1.0);
                    }
                    c.polyline(&[(x, middle), (x + SYMBOL, middle)], pen);
                }
                Symbol::Marked(pen, mark) => {
                    c.polyline(&[(x, middle), (x + SYMBOL, middle)], pen);
                    draw_mark(c, (x + 0.5 * SYMBOL, middle), mark, pen.colour);
                }
                Symbol::Mark(mark, colour) => draw_mark(c, (x + 0.5 * SYMBOL, middle), mark, colour),
                Symbol::Area { fill, stroke } => {
                    let (x0, x1, y0, y1) = (x + 2.0, x + SYMBOL - 2.0, middle - 5.0, middle + 5.0);
                    c.polygon(&[(x0, y0), (x1, y0), (x1, y1), (x0, y1)], Some(fill), Some(stroke));
                }
                Symbol::Note => {}
            }
            c.text((x + indent(key), middle + 4.5), &key.label, TICK_SIZE, Anchor::Start, BLACK);
        }
        y += LEGEND_ROW;
    }
}

const SYMBOL: f64 = 24.0;

/// What stands before an entry's words.
fn indent(key: &Key) -> f64 {
    if key.symbol == Symbol::Note { 0.0 } else { SYMBOL + 6.0 }
}

/// The title in lines no wider than `width`, broken after commas, else between words.
fn title_lines(title: &str, width: f64) -> Vec<String> {
    let mut lines = Vec::new();
    let mut rest = title.trim();
    while !rest.is_empty() {
        let fits = |end: usize| text_width(rest[..end].trim_end(), TITLE_SIZE) <= width;
        let ends =
            |mark: &str| rest.match_indices(mark).map(|(at, m)| at + m.len()).filter(|e| fits(*e)).last();
        let end = match fits(rest.len()) {
            true => rest.len(),
            false => ends(", ").or_else(|| ends(" ")).or_else(|| ends(",")).unwrap_or(rest.len()),
        };
        lines.push(rest[..end].trim_end().to_string());
        rest = rest[end..].trim_start();
    }
    lines
}

/// Breaks the legend into rows no wider than `width`; each entry with its offset.
pub(super) fn legend_rows(keys: &[Key], width: f64) -> Vec<Vec<(f64, Key)>> {
    let mut rows: Vec<Vec<(f64, Key)>> = Vec::new();
    let mut x = 0.0;
    for key in keys {
        let needs = indent(key) + text_width(&key.label, TICK_SIZE);
        if rows.is_empty() || x + needs > width {
            rows.push(Vec::new());
            x = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((x, key.clone()));
        }
        x += needs + 18.0;
    }
    rows
}

pub(super) fn draw_mark(c: &mut Canvas, (x, y): (f64, f64), mark: Mark, fill: Rgb) {
    match mark {
        Mark::Dot { radius } => c.circle((x, y), radius, Some((fill, 1.0)), Some((BLACK, 0.7))),
        Mark::Ring { radius } => {
            c.circle((x, y), radius, None, Some((BLACK, 2.6)));
            c.circle((x, y), radius, None, Some((fill, 1.3)));
        }
        Mark::Diamond { radius: r } => {
            let corners = [(x, y - r), (x + r, y), (x, y + r), (x - r, y)];
            c.polygon(&corners, Some((fill, 1.0)), Some(Pen::solid(BLACK, 0.8)));
        }
        Mark::Cross { radius: r } => {
            for (colour, width) in [(BLACK, 3.4), (fill, 1.6)] {
                c.polyline(&[(x - r, y - r), (x + r, y + r)], Pen::solid(colour, width));
                c.polyline(&[(x - r, y + r), (x + r, y - r)], Pen::solid(colour, width));
            }
        }
    }
}

fn draw_colour_bar(c: &mut Canvas, bar: Rect, scale: &Scale, ticks: &[f64], labels: &[String]) {
    let steps = (bar.h * SCALE) as usize;
    let (lo, hi) = (scale.axis.lo, scale.axis.hi);
    let boxes = (0..steps)
        .filter_map(|i| {
            let value = hi - (i as f64 + 0.5) / steps as f64 * (hi - lo);
            let y = bar.y + i as f64 / SCALE;
            scale.colour(value).map(|rgb| (Rect { x: bar.x, y, w: bar.w, h: 1.0 / SCALE }, rgb))
        })
        .collect();
    c.boxes(boxes);
    c.border(bar, BLACK, 1.0);
    let mut widest = 0f64;
    for (t, label) in ticks.iter().zip(labels) {
        let y = bar.bottom() - scale.axis.fraction(*t) * bar.h;
        c.rect(Rect { x: bar.right(), y: y.round() - 0.5, w: 5.0, h: 1.0 }, BLACK, 1.0);
        c.text((bar.right() + 9.0, y + 4.5), label, TICK_SIZE, Anchor::Start, BLACK);
        widest = widest.max(text_width(label, TICK_SIZE));
    }
    let x = bar.right() + 9.0 + widest + 8.0 + 12.0;
    let label = fitting_label(&scale.axis.label, bar.h);
    c.text_upwards((x, bar.y + 0.5 * bar.h), label, LABEL_SIZE, BLACK);
}

/// A run of device pixels that show the same cells.
struct Span {
    from: usize,
    to: usize,
    /// First and last cell; more than one where cells are smaller than a pixel.
    cells: (usize, usize),
}

/// Which cells each device pixel along an axis shows. Pixels are counted from the left or, with
/// `downwards`, from the top.
fn spans(axis: &Axis, length: f64, edges: (f64, f64), count: usize, downwards: bool) -> Vec<Span> {
    let pixels = (length * SCALE).round() as usize;
    let mut out: Vec<Span> = Vec::new();
    let cell_at = |pixel_edge: usize| {
        let f = pixel_edge as f64 / pixels as f64;
        let f = if downwards { 1.0 - f } else { f };
        let value = axis.lo + f * (axis.hi - axis.lo);
        (value - edges.0) / (edges.1 - edges.0) * count as f64
    };
    for p in 0..pixels {
        let (a, b) = (cell_at(p), cell_at(p + 1));
        let (a, b) = (a.min(b), a.max(b));
        let middle = 0.5 * (a + b);
        if count == 0 || !(middle >= 0.0 && middle < count as f64) {
            continue;
        }
        let cells = if b - a <= 1.0 {
            (middle as usize, middle as usize)
        } else {
            (a.max(0.0) as usize, ((b.ceil() as usize).max(1) - 1).min(count - 1))
        };
        match out.last_mut() {
            Some(s) if s.to == p && s.cells == cells => s.to = p + 1,
            _ => out.push(Span { from: p, to: p + 1, cells }),
        }
    }
    out
}

/// Parts of a polyline inside a box (Liang and Barsky 1984).
fn clip_polyline(points: &[(f64, f64)], r: Rect) -> Vec<Vec<(f64, f64)>> {
    let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in points.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let (dx, dy) = (x1 - x0, y1 - y0);
        let (mut t0, mut t1) = (0f64, 1f64);
        let mut visible = true;
        for (p, q) in [(-dx, x0 - r.x), (dx, r.right() - x0), (-dy, y0 - r.y), (dy, r.bottom() - y0)] {
            if p == 0.0 {
                visible &= q >= 0.0;
            } else if p < 0.0 {
                t0 = t0.max(q / p);
            } else {
                t1 = t1.min(q / p);
            }
        }
        if !visible || t0 > t1 {
            continue;
        }
        let (a, b) = ((x0 + t0 * dx, y0 + t0 * dy), (x0 + t1 * dx, y0 + t1 * dy));
        match runs.last_mut() {
            Some(run) if run.last() == Some(&a) => run.push(b),
            _ => runs.push(vec![a, b]),
        }
    }
    runs
}

/// A polygon cut off at a box (Sutherland and Hodgman 1974).
fn clip_polygon(points: &[(f64, f64)], r: Rect) -> Vec<(f64, f64)> {
    let mut out = points.to_vec();
    // Signed distance inwards from each side.
    let sides: [&dyn Fn((f64, f64)) -> f64; 4] =
        [&|p| p.0 - r.x, &|p| r.right() - p.0, &|p| p.1 - r.y, &|p| r.bottom() - p.1];
    for inside in sides {
        let input = std::mem::take(&mut out);
        for (i, &b) in input.iter().enumerate() {
            let a = input[(i + input.len() - 1) % input.len()];
            let (da, db) = (inside(a), inside(b));
            if (da < 0.0) != (db < 0.0) {
                let t = da / (da - db);
                out.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
            }
            if db >= 0.0 {
                out.push(b);
            }
        }
    }
    out
}

/// One curve of a line chart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Name of the curve.
    pub label: String,
    /// Points in order.
    pub points: Vec<[f64; 2]>,
}

/// Smallest and largest finite value, None when there is none.
pub fn finite_range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold(None, |r, v| r.map_or(Some((v, v)), |(lo, hi): (f64, f64)| Some((lo.min(v), hi.max(v)))))
}

/// Line chart with a legend when there is more than one curve.
pub fn lines(title: &str, x_label: &str, y_label: &str, curves: &[Curve]) -> Chart {
    let all = || curves.iter().flat_map(|c| c.points.iter());
    let (x0, x1) = finite_range(all().map(|p| p[0])).unwrap_or((0.0, 1.0));
    let (y0, y1) = finite_range(all().map(|p| p[1])).unwrap_or((0.0, 1.0));
    let mut chart = Chart::new(title, Axis::new(x_label, x0, x1), Axis::new(y_label, y0, y1).to_ticks(8));
    for (i, curve) in curves.iter().enumerate() {
        let pen = curve_pen(i);
        chart.layers.push(Layer::Line { points: curve.points.clone(), pen });
        if curves.len() > 1 {
            chart.key(&curve.label, Symbol::Line(pen));
        }
    }
    chart
}

/// The pen of the i-th curve: another colour each, and dashes once the colours are used up. The first
/// is broader, so that a second one which lies on it does not hide it.
pub fn curve_pen(i: usize) -> Pen {
    let dash = [None, Some([7.0, 4.0]), Some([2.0, 3.5])][i / CURVE_COLOURS.len() % 3];
    Pen { colour: CURVE_COLOURS[i % CURVE_COLOURS.len()], width: if i == 0 { 2.2 } else { 1.2 }, dash }
}

/// Heat map of cells whose centres run evenly from `x.0` to `x.1` and `y.0` to `y.1`; values
/// `[row, column]`.
pub fn heat_map(
    title: &str,
    (x_label, x): (&str, (f64, f64)),
    (y_label, y): (&str, (f64, f64)),
    (rows, columns): (usize, usize),
    values: Vec<f64>,
    scale: Scale,
) -> Chart {
    let edges = |(first, last): (f64, f64), n: usize| {
        let half = if n > 1 { 0.5 * (last - first) / (n - 1) as f64 } else { 0.5 };
        (first - half, last + half)
    };
    let (x, y) = (edges(x, columns), edges(y, rows));
    let mut chart = Chart::new(title, Axis::new(x_label, x.0, x.1), Axis::new(y_label, y.0, y.1));
    chart.grid = false;
    // The layer takes its edges from the axes, which are usable whatever came in.
    let (x, y) = ((chart.x.lo, chart.x.hi), (chart.y.lo, chart.y.hi));
    chart.layers.push(Layer::Cells { x, y, rows, columns, values });
    chart.scale = Some(scale);
    chart
}
