//! Plane wave on a stack of homogeneous layers (CONVENTIONS eq. 21-23).
//!
//! The recursion of partial reflections from the innermost boundary outwards (Balanis, *Advanced
//! Engineering Electromagnetics*, 2nd ed., section 5.5.2; Born and Wolf, *Principles of Optics*, 7th ed.,
//! section 1.6.4) holds only decaying exponentials, so it does not overflow in thick lossy layers, as a
//! product of transfer matrices does.

use num_complex::Complex64;

/// What stands behind the innermost layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Backing {
    /// Perfect electric conductor.
    Pec,
    /// A half-space of relative permittivity eps' - j eps''.
    HalfSpace(Complex64),
    /// Air: the layers are a free-standing sheet, and a part of the wave goes on behind it.
    Air,
}

/// A homogeneous plane layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Relative permittivity eps' - j eps''.
    pub eps_r: Complex64,
    /// Thickness, m.
    pub thickness_m: f64,
}

/// Layers between air in front and a backing, the outermost first.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    /// Layers, the outermost first.
    pub layers: Vec<Layer>,
    /// What lies behind the last layer.
    pub backing: Backing,
}

/// Response of a stack to a plane wave, as factors on E (perpendicular to the plane of incidence, in it) in the vectors
/// of CONVENTIONS eq. (4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Reflection, with its phase on the front surface.
    pub reflection: (Complex64, Complex64),
    /// Transmission behind the innermost boundary, relative to free propagation over the stack's
    /// thickness: behind a sheet the field is that without the sheet times this factor, in the same
    /// direction. Zero for a perfect conductor.
    pub transmission: (Complex64, Complex64),
    /// Power through the innermost boundary over incident power, both per area of the surface.
    pub transmitted_power: (f64, f64),
}

impl Stack {
    /// A perfect conductor without layers.
    pub const PEC: Stack = Stack { layers: Vec::new(), backing: Backing::Pec };

    /// A half-space of relative permittivity eps' - j eps'' without layers.
    pub fn half_space(eps_r: Complex64) -> Stack {
        Stack { layers: Vec::new(), backing: Backing::HalfSpace(eps_r) }
    }

    /// Sum of the layers' thicknesses, m.
    pub fn thickness_m(&self) -> f64 {
        self.layers.iter().map(|l| l.thickness_m).sum()
    }

    /// Reflection coefficients (R_perp, R_par) at incidence cosine `cos_i` in (0, 1], without the transmission.
    pub fn reflection(&self, wavenumber: f64, cos_i: f64) -> (Complex64, Complex64) {
        if self.layers.is_empty() && self.backing == Backing::Pec {
            return (-Complex64::ONE, Complex64::ONE);
        }
        let [perp, par] = self.front(wavenumber, cos_i).map(|(a, b)| (a * cos_i - b) / (a * cos_i + b));
        (perp, par)
    }

    /// (A, B) for both polarisations with R = (A cos - B)/(A cos + B): the front's H and E for E
    /// perpendicular to the plane of incidence, E and H for the other, but for a common factor. They vary
    /// slowly with the angle, also where R does not: near grazing and at resonances.
    pub fn front(&self, wavenumber: f64, cos_i: f64) -> [(Complex64, Complex64); 2] {
        let one = Complex64::ONE;
        let zero = Complex64::ZERO;
        let sin2 = 1.0 - cos_i * cos_i;
        let admittance = |eps: Complex64| {
            let q = normal_wavenumber(eps, sin2);
            [q, q / eps]
        };
        let backing = match self.backing {
            Backing::Pec => [(zero, one), (one, zero)],
            Backing::Air => [(one, Complex64::from(cos_i)); 2],
            Backing::HalfSpace(eps) => admittance(eps).map(|a| (one, a)),
        };
        self.layers.iter().rev().fold(backing, |pairs, layer| {
            let admittance = admittance(layer.eps_r);
            // Once down and up the layer: E perpendicular has q for its admittance.
            let round = (Complex64::new(0.0, -2.0 * wavenumber * layer.thickness_m) * admittance[0]).exp();
            [0, 1].map(|p| {
                let ((a, b), own) = (pairs[p], admittance[p]);
                let r = (a * own - b) / (a * own + b) * round;
                (one + r, own * (one - r))
            })
        })
    }

    /// Reflection and transmission of a wave of `wavenumber` (rad/m, in air) at incidence cosine
    /// `cos_i` in (0, 1].
    ///
    /// # Example
    /// A radome half a wavelength thick (in the plastic) lets a wave through without reflection. With a quarter of a
    /// wavelength the reflections of both sides add up to (ε − 1)/(ε + 1), and the power that is not reflected passes.
    ///
    /// ```
    /// use catseye::base::units::{wavelength_m, wavenumber};
    /// use catseye::em::layers::{Backing, Layer, Stack};
    /// use num_complex::Complex64;
    ///
    /// let (eps, freq_hz) = (2.8_f64, 77e9);
    /// let radome = |wavelengths: f64| {
    ///     let thickness_m = wavelengths * wavelength_m(freq_hz) / eps.sqrt();
    ///     let layer = Layer { eps_r: Complex64::from(eps), thickness_m };
    ///     Stack { layers: vec![layer], backing: Backing::Air }.response(wavenumber(freq_hz), 1.0)
    /// };
    /// let (half, quarter) = (radome(0.5), radome(0.25));
    /// assert!(half.reflection.0.norm() < 1e-12 && (half.transmission.0.norm() - 1.0).abs() < 1e-12);
    /// assert!((quarter.reflection.0.norm() - (eps - 1.0) / (eps + 1.0)).abs() < 1e-12);
    /// assert!((quarter.reflection.0.norm_sqr() + quarter.transmitted_power.0 - 1.0).abs() < 1e-12);
    /// ```
    pub fn response(&self, wavenumber: f64, cos_i: f64) -> Response {
        let one = Complex64::ONE;
        let sin2 = 1.0 - cos_i * cos_i;
        // Both polarisations by one recursion on admittances: q for E perpendicular, and for E in the
        // plane of incidence, where H takes its place, q/eps.
        let medium = |eps: Complex64| {
            let q = normal_wavenumber(eps, sin2);
            (q, [q, q / eps])
        };
        let free = [Complex64::from(cos_i); 2];
        let (mut r, mut t, mut inner) = match self.backing {
            Backing::Pec => ([-one, one], [Complex64::ZERO; 2], None),
            Backing::HalfSpace(eps) => ([Complex64::ZERO; 2], [one; 2], Some(medium(eps).1)),
            Backing::Air => ([Complex64::ZERO; 2], [one; 2], Some(free)),
        };
        let last = inner;
        // `inner` is the medium behind the boundary at hand, and r, t belong to what lies behind that
        // boundary, seen from it. A perfect conductor is no medium: its reflection is its boundary's.
        let mut boundary = |outer: [Complex64; 2], r: &mut [Complex64; 2], t: &mut [Complex64; 2]| {
            if let Some(inner) = inner {
                for p in 0..2 {
                    let sum = outer[p] + inner[p];
                    let step = (outer[p] - inner[p]) / sum;
                    let round = one + step * r[p];
                    t[p] = 2.0 * outer[p] / sum * t[p] / round;
                    r[p] = (step + r[p]) / round;
                }
            }
            inner = Some(outer);
        };
        for layer in self.layers.iter().rev() {
            let (q, admittance) = medium(layer.eps_r);
            boundary(admittance, &mut r, &mut t);
            let depth = wavenumber * layer.thickness_m;
            let once = (Complex64::new(0.0, -depth) * q).exp();
            let behind_free = (Complex64::new(0.0, -depth) * (q - cos_i)).exp();
            for p in 0..2 {
                r[p] *= once * once;
                t[p] *= behind_free;
            }
        }
        boundary(free, &mut r, &mut t);
        let power = |p: usize| last.map_or(0.0, |a| (a[p].re / cos_i) * t[p].norm_sqr());
        // |behind_free| is that of `once`, so t has the true magnitude.
        let transmitted_power = (power(0), power(1));
        // From H to E behind a half-space: the ratio of wave impedances.
        let to_e = match self.backing {
            Backing::HalfSpace(eps) => one / eps.sqrt(),
            _ => one,
        };
        Response { reflection: (r[0], r[1]), transmission: (t[0], t[1] * to_e), transmitted_power }
    }
}

/// Response of the boundary between two media to a plane wave, as factors on E in the vectors of CONVENTIONS eq. (4)
/// before and after it; (perpendicular, parallel).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Factors of the reflected wave.
    pub reflection: (Complex64, Complex64),
    /// Factors of the transmitted wave.
    pub transmission: (Complex64, Complex64),
}

/// Reflection and transmission from the medium `front` to the medium `back` through `layers`, the first met first
/// (CONVENTIONS eq. 56). `tangential` is the wavenumber along the boundary over that in air. Phases are those on the
/// layers' front; for the transmission those on their back. (Balanis, section 5.5.2.)
pub fn crossing(
    front: Complex64,
    layers: &[Layer],
    back: Complex64,
    wavenumber: f64,
    tangential: f64,
) -> Crossing {
    let one = Complex64::ONE;
    let medium = |eps: Complex64| {
        let q = normal_wavenumber(eps, tangential * tangential);
        (q, [q, q / eps])
    };
    let (mut r, mut t, mut inner) = ([Complex64::ZERO; 2], [one; 2], medium(back).1);
    let mut boundary = |outer: [Complex64; 2], r: &mut [Complex64; 2], t: &mut [Complex64; 2]| {
        for p in 0..2 {
            let sum = outer[p] + inner[p];
            let step = (outer[p] - inner[p]) / sum;
            let round = one + step * r[p];
            t[p] = 2.0 * outer[p] / sum * t[p] / round;
            r[p] = (step + r[p]) / round;
        }
        inner = outer;
    };
    for layer in layers.iter().rev() {
        let (q, admittance) = medium(layer.eps_r);
        boundary(admittance, &mut r, &mut t);
        let once = (Complex64::new(0.0, -wavenumber * layer.thickness_m) * q).exp();
        for p in 0..2 {
            r[p] *= once * once;
            t[p] *= once;
        }
    }
    boundary(medium(front).1, &mut r, &mut t);
    // From H to E: the ratio of wave impedances.
    let to_e = (front / back).sqrt();
    Crossing { reflection: (r[0], r[1]), transmission: (t[0], t[1] * to_e) }
}

/// q = sqrt(eps - sin^2) on the branch that decays into the medium. At the critical angle, where the
/// waves up and down a layer become one, q is kept off zero; it enters squared, so this is below 1e-10.
fn normal_wavenumber(eps: Complex64, sin2: f64) -> Complex64 {
    let mut q2 = eps - sin2;
    if q2.norm_sqr() < 1e-24 {
        q2 = Complex64::new(1e-12, 0.0);
    }
    let q = q2.sqrt();
    if q.im > 0.0 { -q } else { q }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::wavenumber;
    use crate::em::fresnel;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const F: f64 = 77e9;

    fn z(re: f64, im: f64) -> Complex64 {
        Complex64::new(re, im)
    }

    fn layer(eps: Complex64, thickness_m: f64) -> Layer {
        Layer { eps_r: eps, thickness_m }
    }

    fn near(a: (Complex64, Complex64), b: (Complex64, Complex64), tolerance: f64) {
        assert!((a.0 - b.0).norm() < tolerance && (a.1 - b.1).norm() < tolerance, "{a:?} {b:?}");
    }

    /// Chain matrices of the tangential fields (E, H) from front to back: Pozar's ABCD form, valid while
    /// the layers are thin. Returns (R, T without the phase of the thickness) as E ratios for a sheet in
    /// air, and R alone on metal.
    fn transfer_matrix(s: &Stack, k: f64, cos_i: f64) -> ((Complex64, Complex64), Option<[Complex64; 2]>) {
        let sin2 = 1.0 - cos_i * cos_i;
        let solve = |par: bool| {
            let wave_admittance = |eps: Complex64, q: Complex64| if par { eps / q } else { q };
            let mut m = [[Complex64::ONE, Complex64::ZERO], [Complex64::ZERO, Complex64::ONE]];
            for l in &s.layers {
                let q = (l.eps_r - sin2).sqrt();
                let y = wave_admittance(l.eps_r, q);
                let phase = q * k * l.thickness_m;
                let (c, js) = (phase.cos(), Complex64::I * phase.sin());
                let n = [[c, js / y], [js * y, c]];
                let mul = |i: usize, j: usize| m[i][0] * n[0][j] + m[i][1] * n[1][j];
                m = [[mul(0, 0), mul(0, 1)], [mul(1, 0), mul(1, 1)]];
            }
            // (E, H) at the back is (1, y_back), or (0, 1) on metal.
            let back = match s.backing {
                Backing::Pec => [Complex64::ZERO, Complex64::ONE],
                Backing::HalfSpace(e) => [Complex64::ONE, wave_admittance(e, (e - sin2).sqrt())],
                Backing::Air => [Complex64::ONE, wave_admittance(Complex64::ONE, z(cos_i, 0.0))],
            };
            let e = m[0][0] * back[0] + m[0][1] * back[1];
            let h = m[1][0] * back[0] + m[1][1] * back[1];
            let y0 = wave_admittance(Complex64::ONE, z(cos_i, 0.0));
            // Tangential E reflects with the sign of R_perp; R_par of eq. (4) has the other one.
            let r = (y0 * e - h) / (y0 * e + h);
            let t = 2.0 * y0 * back[0] / (y0 * e + h);
            (if par { -r } else { r }, t)
        };
        let (perp, par) = (solve(false), solve(true));
        ((perp.0, par.0), (s.backing == Backing::Air).then_some([perp.1, par.1]))
    }

    #[test]
    fn without_layers_it_is_fresnel() {
        for cos_i in [1e-6, 0.02, 0.3, 0.8, 1.0] {
            for eps in [z(4.0, 0.0), z(2.5, -3.0), z(1.0, -2.3e6), z(0.5, 0.0)] {
                let r = Stack::half_space(eps).reflection(wavenumber(F), cos_i);
                near(r, fresnel::reflection(Some(eps), cos_i), 1e-14);
            }
            near(Stack::PEC.reflection(wavenumber(F), cos_i), fresnel::reflection(None, cos_i), 1e-16);
        }
    }

    /// One slab in air: the summed series of Airy, with Fresnel's coefficients written out here.
    #[test]
    fn slab_is_airys_formula() {
        let k = wavenumber(F);
        for (eps, d) in [(z(2.56, -0.0189), 2e-3), (z(6.0, 0.0), 0.7e-3), (z(8.0, -14.0), 2e-4)] {
            for cos_i in [0.05, 0.4, 0.9, 1.0] {
                let (r1, p1) = fresnel::reflection(Some(eps), cos_i);
                let q = (eps - (1.0 - cos_i * cos_i)).sqrt();
                let once = (-Complex64::I * k * d * q).exp();
                let airy = |r: Complex64| r * (1.0 - once * once) / (1.0 - r * r * once * once);
                let pass = |r: Complex64| {
                    (1.0 - r * r) * once / (1.0 - r * r * once * once) * Complex64::cis(k * d * cos_i)
                };
                let s = Stack { layers: vec![layer(eps, d)], backing: Backing::Air };
                let found = s.response(k, cos_i);
                near(found.reflection, (airy(r1), airy(p1)), 1e-13);
                near(found.transmission, (pass(r1), pass(p1)), 1e-13);
            }
        }
    }

    #[test]
    fn quarter_and_half_waves() {
        let k = wavenumber(F);
        // A quarter wave of sqrt(eps) over a half-space eps matches it; a half wave is not seen.
        let quarter = layer(z(2.0, 0.0), PI / 2.0 / (k * 2f64.sqrt()));
        let matched = Stack { layers: vec![quarter], backing: Backing::HalfSpace(z(4.0, 0.0)) };
        assert!(matched.reflection(k, 1.0).0.norm() < 1e-15);
        let half = Stack { layers: vec![layer(z(9.0, 0.0), PI / (3.0 * k))], backing: Backing::Air };
        let r = half.response(k, 1.0);
        assert!(r.reflection.0.norm() < 1e-15);
        assert!((r.transmission.0.norm() - 1.0).abs() < 1e-15);
        // Metal behind a quarter wave looks like a magnetic wall.
        let wall = Stack { layers: vec![quarter], backing: Backing::Pec };
        near(wall.reflection(k, 1.0), (z(1.0, 0.0), z(-1.0, 0.0)), 1e-15);
    }

    #[test]
    fn sheets_of_nothing_change_nothing() {
        let k = wavenumber(F);
        for cos_i in [0.01, 0.5, 1.0] {
            for layers in [vec![], vec![layer(z(1.0, 0.0), 0.01)], vec![layer(z(7.0, -1.0), 0.0)]] {
                let r = Stack { layers, backing: Backing::Air }.response(k, cos_i);
                near(r.transmission, (Complex64::ONE, Complex64::ONE), 1e-13);
                near(r.reflection, (Complex64::ZERO, Complex64::ZERO), 1e-13);
            }
        }
    }

    /// Metal under a millimetre of air is metal a millimetre farther away.
    #[test]
    fn reflection_is_referred_to_the_front() {
        let k = wavenumber(F);
        let s = Stack { layers: vec![layer(Complex64::ONE, 1e-3)], backing: Backing::Pec };
        for cos_i in [0.1, 0.7, 1.0] {
            let delay = Complex64::cis(-2.0 * k * 1e-3 * cos_i);
            near(s.reflection(k, cos_i), (-delay, delay), 1e-13);
        }
    }

    #[test]
    fn thick_lossy_layers_hide_what_is_behind() {
        let k = wavenumber(F);
        let water = z(7.6, -13.9);
        for d in [0.01, 1.0, 1e3, 1e9] {
            let s = Stack { layers: vec![layer(water, d)], backing: Backing::Pec };
            near(s.reflection(k, 0.3), fresnel::reflection(Some(water), 0.3), 1e-12);
            let sheet = Stack { layers: vec![layer(water, d)], backing: Backing::Air }.response(k, 0.3);
            assert!(sheet.transmission.0.norm() < 1e-12 && sheet.transmission.0.is_finite());
        }
    }

    /// Near q = 0 in a layer the result is continuous.
    #[test]
    fn critical_angle_of_a_thin_medium() {
        let k = wavenumber(F);
        let cos_i = 0.5f64.sqrt();
        let at = |eps: f64| {
            let s =
                Stack { layers: vec![layer(z(eps, 0.0), 1e-3)], backing: Backing::HalfSpace(z(4.0, 0.0)) };
            s.reflection(k, cos_i)
        };
        let exact = 1.0 - cos_i * cos_i;
        near(at(exact), at(exact + 1e-9), 1e-8);
        near(at(exact), at(exact - 1e-9), 1e-8);
    }

    #[test]
    fn crossings_from_air_are_stacks() {
        let k = wavenumber(F);
        let coat = [layer(z(4.0, -0.2), 3e-4), layer(z(2.0, 0.0), 7e-4)];
        for layers in [&coat[..], &[]] {
            for cos_i in [0.1f64, 0.6, 1.0] {
                let tau = (1.0 - cos_i * cos_i).sqrt();
                for back in [z(2.2, -0.01), z(6.0, 0.0)] {
                    let s = Stack { layers: layers.to_vec(), backing: Backing::HalfSpace(back) };
                    let c = crossing(Complex64::ONE, layers, back, k, tau);
                    near(c.reflection, s.reflection(k, cos_i), 1e-13);
                    // The stack's transmission is relative to free propagation over the thickness.
                    let free = Complex64::cis(-k * s.thickness_m() * cos_i);
                    let t = s.response(k, cos_i).transmission;
                    near(c.transmission, (t.0 * free, t.1 * free), 1e-13);
                }
                let sheet = Stack { layers: layers.to_vec(), backing: Backing::Air };
                let c = crossing(Complex64::ONE, layers, Complex64::ONE, k, tau);
                near(c.reflection, sheet.reflection(k, cos_i), 1e-13);
            }
        }
    }

    proptest! {
        /// Power in is power out without loss, from either side; q2 t21 = q1 t12 for E perpendicular, and the
        /// same for E in the plane; beyond the critical angle |r| is one.
        #[test]
        fn crossings_keep_power_and_are_reciprocal(
            a in 1.0..9.0f64, b in 1.0..9.0f64, share in 0.0..1.0f64, coat in 1.0..5.0f64, d in 0.0..2e-3f64,
        ) {
            let k = wavenumber(F);
            let layers = [layer(z(coat, 0.0), d)];
            let tau = share * a.min(b).sqrt() * 0.999;
            let (ca, cb) = (crossing(z(a, 0.0), &layers, z(b, 0.0), k, tau), crossing(z(b, 0.0), &layers, z(a, 0.0), k, tau));
            let q = |e: f64| (e - tau * tau).sqrt();
            for (r, there, back) in [
                (ca.reflection.0, ca.transmission.0, cb.transmission.0),
                (ca.reflection.1, ca.transmission.1, cb.transmission.1),
            ] {
                prop_assert!((r.norm_sqr() + q(b) / q(a) * there.norm_sqr() - 1.0).abs() < 1e-9);
                prop_assert!((there * q(b) - back * q(a)).norm() < 1e-9 * (1.0 + there.norm()));
            }
            let (dense, thin) = (a.max(b) + 0.1, a.min(b));
            let beyond = 0.5 * (dense + thin).sqrt() + 0.5 * thin.sqrt() + 1e-3;
            if beyond < dense.sqrt() && beyond > thin.sqrt() {
                let c = crossing(z(dense, 0.0), &[], z(thin, 0.0), k, beyond);
                prop_assert!((c.reflection.0.norm() - 1.0).abs() < 1e-9 && (c.reflection.1.norm() - 1.0).abs() < 1e-9);
            }
        }
    }

    fn stacks() -> impl Strategy<Value = (Vec<Layer>, f64)> {
        let one = (1.0..12.0f64, 0.0..3.0f64, 0.0..3e-3f64);
        (proptest::collection::vec(one, 1..5), 0.01..1.0f64)
            .prop_map(|(l, c)| (l.into_iter().map(|(re, loss, d)| layer(z(re, -loss), d)).collect(), c))
    }

    proptest! {
        #[test]
        fn agrees_with_transfer_matrices((layers, cos_i) in stacks()) {
            let k = wavenumber(F);
            for backing in [Backing::Pec, Backing::Air, Backing::HalfSpace(z(3.0, -0.4))] {
                let s = Stack { layers: layers.clone(), backing };
                let (r, t) = transfer_matrix(&s, k, cos_i);
                let found = s.response(k, cos_i);
                near(found.reflection, r, 1e-9);
                near(s.reflection(k, cos_i), found.reflection, 1e-11);
                if let Some(t) = t {
                    let free = Complex64::cis(k * cos_i * s.thickness_m());
                    near(found.transmission, (t[0] * free, t[1] * free), 1e-9);
                }
            }
        }

        /// Lossless: R + T = 1. With loss the rest is absorbed, never made.
        #[test]
        fn energy((layers, cos_i) in stacks(), back in 1.0..9.0f64) {
            let k = wavenumber(F);
            for lossy in [false, true] {
                let layers: Vec<Layer> = layers
                    .iter()
                    .map(|l| layer(z(l.eps_r.re, if lossy { l.eps_r.im } else { 0.0 }), l.thickness_m))
                    .collect();
                for backing in [Backing::Pec, Backing::Air, Backing::HalfSpace(z(back, 0.0))] {
                    let r = Stack { layers: layers.clone(), backing }.response(k, cos_i);
                    for (r, t) in [
                        (r.reflection.0, r.transmitted_power.0),
                        (r.reflection.1, r.transmitted_power.1),
                    ] {
                        let total = r.norm_sqr() + t;
                        if lossy {
                            prop_assert!(total <= 1.0 + 1e-12, "{total}");
                        } else {
                            prop_assert!((total - 1.0).abs() < 1e-11, "{total}");
                        }
                    }
                }
            }
        }

        /// A sheet transmits the same from both sides, lossy or not (Lorentz).
        #[test]
        fn reciprocity((layers, cos_i) in stacks()) {
            let k = wavenumber(F);
            let mut turned = layers.clone();
            turned.reverse();
            let there = Stack { layers, backing: Backing::Air }.response(k, cos_i);
            let back = Stack { layers: turned, backing: Backing::Air }.response(k, cos_i);
            near(there.transmission, back.transmission, 1e-12);
        }
    }

    /// The factor of E behind a half-space: T_perp = 1 + R_perp, and T_par from the balance of power.
    #[test]
    fn into_a_half_space() {
        let k = wavenumber(F);
        let s = Stack::half_space(z(4.0, 0.0));
        for cos_i in [0.2, 0.9] {
            let r = s.response(k, cos_i);
            assert!((r.transmission.0 - (1.0 + r.reflection.0)).norm() < 1e-14);
            let cos_t = (1.0 - (1.0 - cos_i * cos_i) / 4.0f64).sqrt();
            // n cos_t |T|^2 = cos_i (1 - R^2); at normal incidence T = 2/(1 + n).
            let power = 2.0 * cos_t * r.transmission.1.norm_sqr() / cos_i;
            assert!((power - (1.0 - r.reflection.1.norm_sqr())).abs() < 1e-14);
            assert!((power - r.transmitted_power.1).abs() < 1e-14);
        }
        let t = s.response(k, 1.0).transmission;
        near(t, (z(2.0 / 3.0, 0.0), z(2.0 / 3.0, 0.0)), 1e-15);
    }
}
