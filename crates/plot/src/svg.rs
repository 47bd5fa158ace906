//! Drawings as SVG. Text is outlines, so that it looks the same without the font; its words are in `aria-label`.

use super::drawing::Step;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use catseye::base::error::{Error, Result};
use image::{ImageFormat, RgbImage};
use std::fmt::Write as _;
use tiny_skia::{Path, PathSegment};

/// A drawing of `size` device pixels as an SVG file of `size` / `scale` pixels of the browser, on white.
///
/// # Errors
/// An image that cannot be encoded.
pub fn svg(size: (u32, u32), scale: f64, steps: &[Step]) -> Result<String> {
    let (w, h) = size;
    let [width, height] = [w, h].map(|v| f64::from(v) / scale);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {w} {h}\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n"
    );
    write_steps(&mut out, steps)?;
    out += "</svg>\n";
    Ok(out)
}

fn write_steps(out: &mut String, steps: &[Step]) -> Result<()> {
    for step in steps {
        match step {
            Step::Fill { path, colour, opacity, text } => {
                *out += &format!("<path d=\"{}\" fill=\"{}\"", data(path), hex(*colour));
                if *opacity < 255 {
                    *out += &format!(" fill-opacity=\"{:.3}\"", f64::from(*opacity) / 255.0);
                }
                if let Some(text) = text {
                    *out += &format!(" role=\"img\" aria-label=\"{}\"", escaped(text));
                }
                *out += "/>\n";
            }
            Step::Stroke { path, colour, width, dash } => {
                *out += &format!(
                    "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"",
                    data(path),
                    hex(*colour),
                    number(*width)
                );
                *out += &match dash {
                    None => " stroke-linecap=\"round\"".into(),
                    Some([on, off]) => format!(" stroke-dasharray=\"{} {}\"", number(*on), number(*off)),
                };
                *out += "/>\n";
            }
            Step::Pixels { corner: (x, y), image } => {
                let (w, h) = image.dimensions();
                *out += &format!(
                    "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" style=\"image-rendering:pixelated\" \
                     href=\"data:image/png;base64,{}\"/>\n",
                    STANDARD.encode(png(image)?)
                );
            }
            Step::Clip { corner: (x, y), size: (w, h), steps } => {
                // An inner svg element moves its content and cuts it off.
                *out += &format!("<svg x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\">\n");
                write_steps(out, steps)?;
                *out += "</svg>\n";
            }
        }
    }
    Ok(())
}

/// An image as the bytes of a PNG file.
///
/// # Errors
/// An image that cannot be encoded.
pub fn png(image: &RgbImage) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    image
        .write_to(&mut std::io::Cursor::new(&mut bytes), ImageFormat::Png)
        .map_err(|e| Error::Failed(format!("the image cannot be encoded: {e}")))?;
    Ok(bytes)
}

/// A path in the words of the attribute `d`.
fn data(path: &Path) -> String {
    let mut d = String::new();
    for segment in path.segments() {
        let (letter, points): (char, &[tiny_skia::Point]) = match &segment {
            PathSegment::MoveTo(p) => ('M', &[*p]),
            PathSegment::LineTo(p) => ('L', &[*p]),
            PathSegment::QuadTo(a, p) => ('Q', &[*a, *p]),
            PathSegment::CubicTo(a, b, p) => ('C', &[*a, *b, *p]),
            PathSegment::Close => ('Z', &[]),
        };
        d.push(letter);
        for (i, p) in points.iter().enumerate() {
            let gap = if i > 0 { " " } else { "" };
            // Writing to a string cannot fail.
            let _ = write!(d, "{gap}{} {}", number(p.x), number(p.y));
        }
    }
    d
}

/// To a hundredth of a device pixel, which no eye resolves.
fn number(x: f32) -> String {
    ((f64::from(x) * 100.0).round() / 100.0 + 0.0).to_string()
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            // XML has no other control characters and not the last two of the first plane.
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_leave_their_attribute() {
        assert_eq!(escaped("a<b>&\"\u{1b}\n°"), "a&lt;b&gt;&amp;&quot;\u{fffd}\u{fffd}°");
        assert_eq!([number(-0.001), number(12.3456), number(1e5)], ["0", "12.35", "100000"]);
    }
}
