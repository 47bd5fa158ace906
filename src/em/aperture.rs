//! Integral of a plane wave's phase over a flat polygon, in f64 (CONVENTIONS eq. 50-54).

use glam::DVec2;
use num_complex::Complex64;

/// Phase across a polygon below which its integral is taken from its moments, rad.
const SMALL_PHASE: f64 = 1e-3;

/// Computes the integral of exp(j g . p) over a convex polygon, of either orientation (Gordon 1975).
pub fn phase_integral(p: &[DVec2], g: DVec2) -> Complex64 {
    let moments = Moments::of(p);
    let reach = p.iter().map(|q| g.dot(*q - moments.centroid).abs()).fold(0.0, f64::max);
    if reach < SMALL_PHASE {
        let quadratic = moments.quadratic(DVec2::new(g.x * g.x, g.y * g.y), g.x * g.y);
        return Complex64::cis(g.dot(moments.centroid)) * (moments.area * (1.0 - 0.5 * quadratic));
    }
    let mut sum = Complex64::ZERO;
    let mut a = p[p.len() - 1];
    let mut at_a = Complex64::cis(g.dot(a));
    for &b in p {
        let e = b - a;
        let x = 0.5 * g.dot(e);
        let at_b = Complex64::cis(g.dot(b));
        // exp(j g . middle) sin(x) / x, from the phases of both ends where they are far enough apart.
        let mean = if x.abs() < 0.1 {
            let y = x * x;
            let sinc = 1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0)));
            Complex64::cis(g.dot(0.5 * (a + b))) * sinc
        } else {
            let d = at_b - at_a;
            Complex64::new(d.im, -d.re) * (0.5 / x)
        };
        sum += mean * g.perp_dot(e);
        (a, at_a) = (b, at_b);
    }
    // 1/(j g^2) of the outline's flux; clockwise outlines count negative.
    Complex64::new(sum.im, -sum.re) * (moments.sign / g.length_squared())
}

/// Moments of a flat polygon's area.
pub struct Moments {
    /// Area, always positive.
    pub area: f64,
    sign: f64,
    /// Middle of the area, in the polygon's plane.
    pub centroid: DVec2,
    /// Mean of xx, yy and xy about the centroid.
    second: [f64; 3],
}

impl Moments {
    /// Computes the moments of a polygon given by its corners in order; their sign is that of the direction in which
    /// the corners run.
    pub fn of(p: &[DVec2]) -> Moments {
        let o = p[0];
        let (mut area, mut first, mut second) = (0.0, DVec2::ZERO, [0.0; 3]);
        for i in 1..p.len() - 1 {
            let (a, b) = (p[i] - o, p[i + 1] - o);
            let t = 0.5 * a.perp_dot(b);
            area += t;
            first += (a + b) * (t / 3.0);
            second[0] += t / 6.0 * (a.x * a.x + b.x * b.x + a.x * b.x);
            second[1] += t / 6.0 * (a.y * a.y + b.y * b.y + a.y * b.y);
            second[2] += t / 12.0 * (2.0 * a.x * a.y + 2.0 * b.x * b.y + a.x * b.y + a.y * b.x);
        }
        if area == 0.0 {
            return Moments { area: 0.0, sign: 1.0, centroid: o, second: [0.0; 3] };
        }
        let c = first / area;
        Moments {
            area: area.abs(),
            sign: area.signum(),
            centroid: o + c,
            second: [
                second[0] / area - c.x * c.x,
                second[1] / area - c.y * c.y,
                second[2] / area - c.x * c.y,
            ],
        }
    }

    /// Mean of h.x x^2 + h.y y^2 + 2 xy * `mixed`.
    pub fn quadratic(&self, h: DVec2, mixed: f64) -> f64 {
        h.x * self.second[0] + h.y * self.second[1] + 2.0 * mixed * self.second[2]
    }
}
