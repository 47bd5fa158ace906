//! The font of all pictures: widths and outlines of lines of text.
//!
//! `fonts/DejaVuSans-subset.ttf` is DejaVu Sans 2.37 (its licence lies beside it), cut by fonttools 4.68 to what names, units
//! and formulas of pictures can hold: Latin-1, Latin Extended-A, accents, Greek, Cyrillic, punctuation, super- and subscripts,
//! arrows, mathematical signs and geometric shapes.
//!
//! ```sh
//! pyftsubset DejaVuSans.ttf --output-file=DejaVuSans-subset.ttf --no-hinting --layout-features= --notdef-outline \
//!   --drop-tables+=GSUB,GPOS,GDEF,kern,FFTM,MATH,gasp --name-IDs=0,1,2,5,14 \
//!   --unicodes=U+0020-007E,U+00A0-017F,U+0192,U+01CD-01DC,U+0218-021B,U+0259,U+02C6-02DD,U+0300-0328,U+0370-03FF,\
//! U+0400-045F,U+0490-0491,U+1E9E,U+2010-2027,U+202F-203A,U+2044,U+2070-209C,U+20AC,U+2103,U+2113,U+2116,U+2122,U+2126,\
//! U+212B,U+2190-2199,U+21D0-21D5,U+2200-222B,U+2234-2265,U+226A-226B,U+2282-2287,U+2295-2299,U+22A5,U+22C5,\
//! U+25A0-25CF,U+2713-2718,U+FFFD
//! ```

use std::sync::LazyLock;
use tiny_skia::{Path, PathBuilder};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

static FACE: LazyLock<Face<'static>> = LazyLock::new(|| {
    let file = include_bytes!("../fonts/DejaVuSans-subset.ttf");
    Face::parse(file, 0).expect("the font that is built in is sound")
});

/// The glyph of a character; that of none, a box, for what the font lacks.
fn glyph(c: char) -> GlyphId {
    FACE.glyph_index(c).unwrap_or(GlyphId(0))
}

/// In units of the font.
fn advance(glyph: GlyphId) -> f64 {
    f64::from(FACE.glyph_hor_advance(glyph).unwrap_or(0))
}

/// Width of a line of text in logical pixels: the sum of its advances.
pub fn text_width(text: &str, size: u32) -> f64 {
    let units: f64 = text.chars().map(|c| advance(glyph(c))).sum();
    units * f64::from(size) / f64::from(FACE.units_per_em())
}

/// Outlines of a line of text whose em is `em` pixels: it begins at the origin, y down from the baseline. None without ink.
pub fn outline(text: &str, em: f64) -> Option<Path> {
    let scale = em / f64::from(FACE.units_per_em());
    let mut pen = GlyphPen { path: PathBuilder::new(), scale: scale as f32, x: 0.0 };
    let mut units = 0.0;
    for c in text.chars() {
        let glyph = glyph(c);
        pen.x = (units * scale) as f32;
        // No outline: a space.
        let _ = FACE.outline_glyph(glyph, &mut pen);
        units += advance(glyph);
    }
    pen.path.finish()
}

/// Takes a glyph's outline, in units of the font with y up, into the path of its line.
struct GlyphPen {
    path: PathBuilder,
    scale: f32,
    /// Where the glyph begins, pixels.
    x: f32,
}

impl GlyphPen {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, -self.scale * y)
    }
}

impl OutlineBuilder for GlyphPen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }
    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_dejavu_sans() {
        // Advances from the font's description: digits 0.636 em, minus 0.838, degree 0.5.
        assert!((text_width("−12°", 1000) - (838.0 + 2.0 * 636.0 + 500.0)).abs() < 2.0);
        assert_eq!(text_width("", 12), 0.0);
        // A combining accent stands on the letter before it.
        assert_eq!(text_width("e\u{301}", 12), text_width("e", 12));
    }

    #[test]
    fn what_pictures_can_hold_is_in_the_font() {
        let held = "Range–Doppler 0.5 µs λ/4 σ ±3° ≥ ≤ ≈ × · ⋅ ² ³ ⁻¹ ₀ → ← ↑ ↓ ∞ √ ∑ Δ Ω ° ′ ″ € äöüßéñçøåłžğőčæ “x” … ─ Жук";
        let missing: Vec<char> = held.chars().filter(|c| FACE.glyph_index(*c).is_none()).collect();
        assert_eq!(missing, ['─']);
    }

    #[test]
    fn a_character_that_the_font_lacks_is_a_box() {
        for text in ["車", "🚗", "\u{10FFFF}", "\n", "\u{0}"] {
            let ink = outline(text, 20.0).unwrap().bounds();
            assert!(ink.width() > 5.0 && ink.height() > 10.0 && text_width(text, 20) > 10.0, "{text:?}");
        }
        assert!(outline(" ", 20.0).is_none() && outline("", 20.0).is_none());
    }
}
