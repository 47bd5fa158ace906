//! Waves that pass through bodies and sheets (CONVENTIONS eq. 70-75): layered stacks, Snell's law, filled
//! corners, limits.

use catseye::base::frames::{Pose, angles_from_direction, direction_from_angles, polarisation_basis};
use catseye::base::units::wavenumber;
use catseye::em::layers::{Backing, Layer, Stack};
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::rcs::cpu::beam_sum::{FrequencyPoint, by_beams};
use catseye::rcs::{Aspect, BistaticAspect, Distance, Impassable, RcsOptions, Scattering};
use catseye::road::reflector::Reflector;
use catseye::scene::{Material, MaterialKind, Mesh, Scene, material};
use catseye::trace::beams::BeamOptions;
use glam::DVec3;
use num_complex::Complex64;

const F: f64 = 77e9;

fn dielectric(eps_real: f64, eps_loss: f64) -> Material {
    Material {
        name: format!("dielectric {eps_real} {eps_loss}"),
        kind: MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m: 0.0 },
        ..Material::pec()
    }
}

/// Polygons with a material each, welded.
fn geometry(faces: &[(&[DVec3], u32)], materials: &[Material]) -> Geometry {
    let mut m = Mesh::default();
    for (corners, material) in faces {
        let at: Vec<u32> = corners
            .iter()
            .map(|c| {
                m.positions_m.iter().position(|p| p == c).unwrap_or_else(|| {
                    m.positions_m.push(*c);
                    m.positions_m.len() - 1
                }) as u32
            })
            .collect();
        for i in 1..at.len() - 1 {
            m.triangles.push([at[0], at[i], at[i + 1]]);
            m.material.push(*material);
        }
    }
    let mut scene = Scene { materials: materials.to_vec(), ..Default::default() };
    scene.add_mesh("m", "", m, Pose::IDENTITY);
    Geometry::build(&scene, 0.0, F).unwrap()
}

/// The faces of a box, outwards: x low, x high, y low, y high, z low, z high.
fn cuboid(lo: DVec3, hi: DVec3) -> [Vec<DVec3>; 6] {
    let p = |x: bool, y: bool, z: bool| {
        DVec3::new(if x { hi.x } else { lo.x }, if y { hi.y } else { lo.y }, if z { hi.z } else { lo.z })
    };
    let (o, i) = (false, true);
    [
        vec![p(o, o, o), p(o, o, i), p(o, i, i), p(o, i, o)],
        vec![p(i, o, o), p(i, i, o), p(i, i, i), p(i, o, i)],
        vec![p(o, o, o), p(i, o, o), p(i, o, i), p(o, o, i)],
        vec![p(o, i, o), p(o, i, i), p(i, i, i), p(i, i, o)],
        vec![p(o, o, o), p(o, i, o), p(i, i, o), p(i, o, o)],
        vec![p(o, o, i), p(i, o, i), p(i, i, i), p(o, i, i)],
    ]
}

fn aspect(d: DVec3) -> Aspect {
    let (azimuth, elevation) = angles_from_direction(d);
    Aspect { azimuth, elevation }
}

fn look(transmit: DVec3, receive: DVec3) -> BistaticAspect {
    BistaticAspect { transmit: aspect(transmit), receive: aspect(receive) }
}

fn deg(azimuth: f64, elevation: f64) -> DVec3 {
    direction_from_angles(azimuth.to_radians(), elevation.to_radians())
}

fn scattered(g: &Geometry, l: BistaticAspect, bounces: usize) -> Scattering {
    let options = BeamOptions::new(bounces, 0.1, true);
    let tone = FrequencyPoint { wavenumber: wavenumber(F), surfaces: &g.surfaces };
    by_beams(g, &[tone], &[l], Distance::Infinite, &options).unwrap()[0][0]
}

fn db(z: Complex64) -> f64 {
    20.0 * z.norm().log10()
}

/// S of a plate in the plane x = 0, of the area seen face on, in its mirror direction for reflection factors
/// (perpendicular, parallel) with the phase at x: the wave comes from (x, z) and the plane of incidence is
/// y = 0, so H is perpendicular to it.
fn mirror(area_m2: f64, cos_i: f64, x: f64, r: (Complex64, Complex64)) -> [Complex64; 2] {
    let k = wavenumber(F);
    let z = Complex64::new(0.0, -k / std::f64::consts::TAU)
        * area_m2
        * cos_i
        * Complex64::cis(2.0 * k * x * cos_i);
    // Parallel: E along k x e_perp before and after; along V the two have opposite signs in x and equal ones in z.
    [z * r.1, -z * r.0]
}

const D: f64 = 2e-3;

/// A slab 20 m wide between x = -D and x = 0, with what stands at its back.
fn slab(eps: (f64, f64), side: f64, back: Option<f64>) -> Geometry {
    let h = 0.5 * side;
    let faces = cuboid(DVec3::new(-D, -h, -h), DVec3::new(0.0, h, h));
    let mut list: Vec<(&[DVec3], u32)> = faces.iter().map(|f| (f.as_slice(), 0)).collect();
    let plate = back.map(|gap| {
        let x = -D - gap;
        let p = |y: f64, z: f64| DVec3::new(x, y * h, z * h);
        // Bent out of the edges, so that it is not welded to the slab.
        vec![p(-1.1, -1.1), p(1.1, -1.1), p(1.1, 1.1), p(-1.1, 1.1)]
    });
    if let Some(p) = &plate {
        list.push((p, 1));
    }
    geometry(&list, &[dielectric(eps.0, eps.1), Material::pec()])
}

/// Interference of the waves that go to and fro in a slab, and before metal: the layered stack.
#[test]
fn a_slab_tends_to_the_stack() {
    let k = wavenumber(F);
    for (eps, elevation, back, last) in [
        ((2.56, 0.0), 0.0f64, None, 1e-9),
        ((2.56, 0.0189), 0.0, None, 1e-9),
        ((2.56, 0.0), 0.0, Some(0.0), 5e-5),
        ((2.19, 0.0074), 0.0, Some(0.0), 2e-5),
        ((2.56, 0.0), 0.0, Some(3.3e-3), 3e-3),
        ((2.56, 0.0), 35.0, None, 2e-4),
        ((6.31, 0.0), 60.0, None, 1e-3),
        ((2.56, 0.0), 35.0, Some(0.0), 1e-3),
        ((2.19, 0.0074), 50.0, Some(0.0), 2e-3),
    ] {
        let side = 20.0;
        let g = slab(eps, side, back);
        let mut layers = vec![Layer { eps_r: Complex64::new(eps.0, -eps.1), thickness_m: D }];
        if let Some(gap) = back.filter(|g| *g > 0.0) {
            layers.push(Layer { eps_r: Complex64::ONE, thickness_m: gap });
        }
        let backing = if back.is_some() { Backing::Pec } else { Backing::Air };
        let cos_i = elevation.to_radians().cos();
        let want = mirror(side * side, cos_i, 0.0, Stack { layers, backing }.reflection(k, cos_i));
        let l = look(deg(0.0, elevation), deg(0.0, -elevation));
        // The metal is wider than the slab by a fifth of its area.
        let bare = back.map_or([Complex64::ZERO; 2], |gap| {
            mirror(0.21 * side * side, cos_i, -D - gap, (-Complex64::ONE, Complex64::ONE))
        });
        let scale = want[0].norm().max(want[1].norm());
        let errors = [1, 3, 7, 13].map(|bounces| {
            let s = scattered(&g, l, bounces);
            [s.every, s.last].map(|s| {
                let off = [0, 1].map(|p| (s[p][p] - want[p] - bare[p]).norm());
                off[0].max(off[1]) / scale
            })
        });
        let text: String = errors.iter().map(|e| format!("{:.1e}/{:.1e} ", e[0], e[1])).collect();
        println!("eps {eps:?} at {elevation} deg, metal {back:?}: {text}");
        for convention in [0, 1] {
            let e = errors.map(|e| e[convention]);
            assert!(e[1] < e[0] && e[2] < 0.3 * e[1] && e[3] < 0.3 * e[2].max(1e-3), "{e:?}");
            assert!(e[3] < last, "{e:?}");
        }
    }
}

/// Lossy plastic on asphalt: another dielectric ends the body, and it is met in the plastic.
#[test]
fn plastic_on_asphalt_is_a_layer_on_it() {
    let (k, h) = (wavenumber(F), 10.0);
    let faces = cuboid(DVec3::new(-D, -h, -h), DVec3::new(0.0, h, h));
    let mut list: Vec<(&[DVec3], u32)> = faces.iter().map(|f| (f.as_slice(), 0)).collect();
    // Corner to corner, looking into the plastic.
    let ground: Vec<DVec3> = faces[0].iter().rev().copied().collect();
    list.push((&ground, 1));
    let g = geometry(&list, &[dielectric(2.19, 0.0074), material::by_name("asphalt").unwrap()]);
    assert_eq!(g.faces().cells.len(), 1);
    let eps = |m: usize| match g.surfaces[m].stack.backing {
        Backing::HalfSpace(e) => e,
        _ => Complex64::ONE,
    };
    for elevation in [0.0f64, 40.0, 75.0] {
        let cos_i = elevation.to_radians().cos();
        let stack = Stack {
            layers: vec![Layer { eps_r: eps(0), thickness_m: D }],
            backing: Backing::HalfSpace(eps(1)),
        };
        let want = mirror(4.0 * h * h, cos_i, 0.0, stack.reflection(k, cos_i));
        let s = scattered(&g, look(deg(0.0, elevation), deg(0.0, -elevation)), 13).every;
        let off = [0, 1].map(|p| (s[p][p] - want[p]).norm() / want[1].norm());
        println!("{elevation} deg: {off:?}");
        // Aslant the loss of the plastic along the real ray is not quite that of the layer.
        assert!(off.iter().all(|d| *d < if elevation == 0.0 { 1e-6 } else { 5e-3 }));
    }
}

/// A prism: in through one face straight on, out through the other, whose normal is `wedge` off. The wave
/// leaves in Snell's direction, with the amplitude of two transmissions over the lit aperture, and its phase
/// is that of the optical path.
#[test]
fn a_prism_refracts() {
    let (k, n, a) = (wavenumber(F), 1.6f64, 0.2);
    for wedge_deg in [0.0f64, 10.0, 25.0, 35.0] {
        let w = wedge_deg.to_radians();
        // The wave runs along -x; the back stands at x = -0.05 at its middle and leans by w about y.
        let back = |z: f64| -0.05 + z * w.tan();
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y * 0.5 * a, z);
        let h = 0.5 * a * 0.6;
        let (tl, tr, bl, br) = (p(0.1, 1.0, h), p(0.1, -1.0, h), p(0.1, 1.0, -h), p(0.1, -1.0, -h));
        let (utl, utr) = (p(back(h), 1.0, h), p(back(h), -1.0, h));
        let (ubl, ubr) = (p(back(-h), 1.0, -h), p(back(-h), -1.0, -h));
        let faces: [&[DVec3]; 6] = [
            &[tr, br, bl, tl],
            &[ubl, ubr, utr, utl],
            &[utl, utr, tr, tl],
            &[br, ubr, ubl, bl],
            &[bl, ubl, utl, tl],
            &[utr, ubr, br, tr],
        ];
        let g = geometry(&faces.map(|f| (f, 0)), &[dielectric(n * n, 0.0)]);
        assert_eq!(g.faces().cells.len(), 1, "{wedge_deg}");
        // Out of the back with its normal (-cos w, 0, sin w); the wave inside makes the angle w with it.
        let out = (n * w.sin()).asin();
        let normal = DVec3::new(-w.cos(), 0.0, w.sin());
        let along = DVec3::new(-w.sin(), 0.0, -w.cos());
        let towards = normal * out.cos() + along * out.sin();
        let s = scattered(&g, look(DVec3::X, towards), 0).every;
        // Fresnel's coefficients by angles (Born and Wolf, section 1.5.2): E in the plane of incidence, E across.
        let (ci, co) = (w.cos(), out.cos());
        let t = [ci + n * co, n * ci + co].map(|sum| 2.0 / (1.0 + n) * 2.0 * n * ci / sum);
        let area = a * 2.0 * h / w.cos();
        // Optical path to the middle of the back and on to the receiver.
        let middle = DVec3::new(back(0.0), 0.0, 0.0);
        let path = -0.1 + n * 0.15 - towards.dot(middle);
        // Physical optics forwards is +jk/2pi times the field over the aperture.
        let z = Complex64::new(0.0, k / std::f64::consts::TAU) * area * co * Complex64::cis(-k * path);
        // Less the wave as it would have gone on, over the same aperture (eq. 5 with its phase gradient).
        let (v0, h0) = polarisation_basis(DVec3::X);
        let (v1, h1) = polarisation_basis(towards);
        let slope = -k * (-DVec3::X - towards).dot(along);
        let x = slope * h / w.cos();
        let sinc = if x == 0.0 { 1.0 } else { x.sin() / x };
        let without = Complex64::new(0.0, -k / (2.0 * std::f64::consts::TAU))
            * (area * sinc)
            * Complex64::cis(-k * (-middle.x - towards.dot(middle)));
        let taken = |e: DVec3, p: DVec3| {
            let (j, m) = (normal.cross(-DVec3::X.cross(e)), -normal.cross(e));
            without * (j + m.cross(towards)).dot(p)
        };
        let want =
            [z * t[0] * v0.dot(v1).signum() - taken(v0, v1), z * t[1] * h0.dot(h1).signum() - taken(h0, h1)];
        let off = [0, 1].map(|p| (s[p][p] - want[p]).norm() / want[p].norm());
        println!("wedge {wedge_deg} deg: out at {:.3} deg, off by {off:?}", out.to_degrees());
        assert!(off[0] < 1e-9 && off[1] < 1e-9, "{s:?} {want:?}");
        // Half a beam width away from Snell's direction it is weaker on either side.
        for side in [-1.0, 1.0] {
            let bent = normal * (out + side * 0.02).cos() + along * (out + side * 0.02).sin();
            let there = scattered(&g, look(DVec3::X, bent), 0).every;
            assert!(there[0][0].norm() < 0.9 * s[0][0].norm());
        }
    }
}

/// Three square plates of metal, and the cube that they hold.
fn filled_cube(a: f64, filling: Option<Material>) -> Geometry {
    let f = cuboid(DVec3::ZERO, DVec3::splat(a));
    let mut list: Vec<(&[DVec3], u32)> = [0, 2, 4].iter().map(|i| (f[*i].as_slice(), 0)).collect();
    let mut materials = vec![Material::pec()];
    if let Some(m) = filling {
        list.extend([1, 3, 5].iter().map(|i| (f[*i].as_slice(), 1)));
        materials.push(m);
    }
    geometry(&list, &materials)
}

fn difference(a: &Scattering, b: &Scattering) -> f64 {
    let all = |s: &Scattering| s.every.into_iter().chain(s.last).flatten().collect::<Vec<_>>();
    let (a, b) = (all(a), all(b));
    let square = |it: Vec<Complex64>| it.iter().map(|z| z.norm_sqr()).sum::<f64>();
    let off = a.iter().zip(&b).map(|(x, y)| x - y).collect();
    (square(off) / square(b)).sqrt()
}

#[test]
fn a_filling_of_nothing_is_an_empty_corner() {
    let (empty, filled) = (filled_cube(0.03, None), filled_cube(0.03, Some(dielectric(1.0 + 1e-9, 0.0))));
    assert_eq!(filled.faces().cells.len(), 1);
    let from = [deg(45.0, 35.26), deg(20.0, 50.0), deg(70.0, 12.0), deg(100.0, 20.0), deg(-130.0, 40.0)];
    for t in from {
        for r in [t, deg(40.0, 30.0), deg(60.0, 60.0)] {
            let (e, f) = (scattered(&empty, look(t, r), 3), scattered(&filled, look(t, r), 3));
            let off = difference(&f, &e);
            println!("{:.1} {:.1}: {off:.1e}", db(e.every[0][0]), db(f.every[0][0]));
            assert!(off < 1e-6, "{t} {r}: {off}");
        }
    }
    // Seen through, from behind: nothing is there.
    let cube = cuboid(DVec3::ZERO, DVec3::splat(0.03));
    let list: Vec<(&[DVec3], u32)> = cube.iter().map(|f| (f.as_slice(), 0)).collect();
    let air = geometry(&list, &[dielectric(1.0 + 1e-9, 0.0)]);
    for (t, r) in [
        (deg(10.0, 20.0), deg(190.0, -20.0)),
        (deg(10.0, 20.0), deg(170.0, 30.0)),
        (deg(0.0, 0.0), deg(30.0, 0.0)),
    ] {
        let s = scattered(&air, look(t, r), 3).every;
        let forward = wavenumber(F) * 9e-4 / std::f64::consts::TAU;
        assert!(s.iter().flatten().all(|z| z.norm() < 1e-6 * forward), "{s:?}");
    }
}

/// A trihedral filled to its aperture, from within 12 degrees of boresight: by Snell's law and two transmissions
/// the empty one at n times the wavenumber, and the reflection of the front.
#[test]
fn a_flush_filling_is_the_empty_corner_at_snells_angle() {
    let (a, n) = (0.1, 1.48f64);
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X * a, DVec3::Y * a, DVec3::Z * a);
    let plates: [&[DVec3]; 3] = [&[o, x, y], &[o, y, z], &[o, z, x]];
    let mut list: Vec<(&[DVec3], u32)> = plates.iter().map(|p| (*p, 0)).collect();
    let empty = geometry(&list, &[Material::pec()]);
    let front = [x, y, z];
    list.push((&front, 1));
    let filled = geometry(&list, &[Material::pec(), dielectric(n * n, 0.0)]);
    let k = wavenumber(F);
    let normal = DVec3::ONE.normalize();
    for (off_deg, round_deg) in [(0.0f64, 0.0f64), (6.0, 30.0), (9.0, 200.0), (12.0, 100.0)] {
        let (so, co) = off_deg.to_radians().sin_cos();
        let (u, v) = normal.any_orthonormal_pair();
        let side = u * round_deg.to_radians().cos() + v * round_deg.to_radians().sin();
        let s = normal * co + side * so;
        let si = so / n;
        let ci = (1.0 - si * si).sqrt();
        let inside = normal * ci + side * si;
        let l = look(inside, inside);
        let tone = FrequencyPoint { wavenumber: n * k, surfaces: &empty.surfaces };
        let bare = by_beams(&empty, &[tone], &[l], Distance::Infinite, &BeamOptions::new(3, 0.1, true))
            .unwrap()[0][0];
        // Transmission by angles, with E across and in the plane of incidence (outside vectors to inside ones).
        let across = if so > 0.0 { normal.cross(side) } else { u };
        let t = [2.0 * co / (co + n * ci), 2.0 * co / (n * co + ci)];
        let basis = |d: DVec3| polarisation_basis(d);
        let into = |e: DVec3| {
            across * (t[0] * e.dot(across)) + inside.cross(across) * (t[1] * e.dot(s.cross(across)))
        };
        let found = scattered(&filled, look(s, s), 3);
        let r = [(1.0 - n) / (1.0 + n), (n - 1.0) / (1.0 + n)];
        let h = a / 3f64.sqrt();
        let face = match off_deg {
            0.0 => mirror(3f64.sqrt() / 2.0 * a * a, 1.0, h, (r[0].into(), r[1].into()))[0],
            _ => Complex64::ZERO,
        };
        // Down to the apex and back, through air to the aperture's plane and then n times.
        let ways = Complex64::cis(-2.0 * k * (n * ci - co) * h);
        for (got, inner) in [(found.last, bare.last), (found.every, bare.every)] {
            let (vi, hi) = basis(inside);
            let want = |p: DVec3| {
                let e = into(p);
                let c = [e.dot(vi), e.dot(hi)];
                let mut sum = Complex64::ZERO;
                for rx in 0..2 {
                    for tx in 0..2 {
                        sum += inner[rx][tx] * (c[rx] * c[tx]);
                    }
                }
                sum * ways
            };
            let (vo, ho) = basis(s);
            let want = [want(vo), want(ho)].map(|w| w + face);
            let off = [0, 1].map(|p| db(got[p][p]) - db(want[p]));
            let phase = [0, 1].map(|p| (got[p][p] / want[p]).arg());
            println!("{off_deg} deg: {:.3} dB, off {off:.3?} dB, {phase:.3?} rad", db(want[0]));
            assert!(off.iter().all(|d| d.abs() < 0.1) && phase.iter().all(|p| p.abs() < 0.02));
        }
    }
}

/// How far S between two directions is from the transposed S the other way round.
#[test]
fn a_filled_corner_is_as_reciprocal_as_an_empty_one() {
    let worst = |g: &Geometry| {
        let mut worst = [0.0f64; 2];
        for (t, r) in [
            (deg(45.0, 35.26), deg(45.5, 35.0)),
            (deg(40.0, 30.0), deg(41.0, 31.0)),
            (deg(50.0, 40.0), deg(49.0, 40.5)),
            (deg(35.0, 35.0), deg(36.0, 34.0)),
        ] {
            let (ab, ba) = (scattered(g, look(t, r), 3), scattered(g, look(r, t), 3));
            for (w, (ab, ba)) in worst.iter_mut().zip([(ab.every, ba.every), (ab.last, ba.last)]) {
                let mut off = (0.0, 0.0f64);
                for i in 0..2 {
                    for j in 0..2 {
                        off.0 += (ab[i][j] - ba[j][i]).norm_sqr();
                        off.1 += ab[i][j].norm_sqr();
                    }
                }
                *w = w.max((off.0 / off.1).sqrt());
            }
        }
        worst
    };
    let empty = worst(&filled_cube(0.03, None));
    let filled = worst(&filled_cube(0.03, Some(dielectric(2.19, 0.0))));
    println!("empty {empty:.4?}, filled {filled:.4?}");
    assert!(filled[0] < 2.0 * empty[0] && filled[1] < 2.0 * empty[1]);
}

/// A wedge of plastic on a mirror: in through the slanted front, mirrored, out at another angle. There and
/// back the same, and as strong as the tube of rays says.
#[test]
fn a_wedge_on_a_mirror_is_reciprocal() {
    let (k, n, a, w) = (wavenumber(F), 1.5f64, 0.4, 8f64.to_radians());
    let h = 0.5 * a;
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y * h, z * h);
    let front = |z: f64| 0.1 + z * h * w.tan();
    let (bl, br, ul, ur) = (p(0.0, 1.0, -1.0), p(0.0, -1.0, -1.0), p(0.0, 1.0, 1.0), p(0.0, -1.0, 1.0));
    let (fbl, fbr) = (p(front(-1.0), 1.0, -1.0), p(front(-1.0), -1.0, -1.0));
    let (ful, fur) = (p(front(1.0), 1.0, 1.0), p(front(1.0), -1.0, 1.0));
    let faces: [(&[DVec3], u32); 6] = [
        (&[fbl, ful, fur, fbr], 1),
        (&[br, ur, ul, bl], 0),
        (&[ur, fur, ful, ul], 1),
        (&[fbl, fbr, br, bl], 1),
        (&[ul, ful, fbl, bl], 1),
        (&[fbr, fur, ur, br], 1),
    ];
    let g = geometry(&faces, &[Material::pec(), dielectric(n * n, 0.0)]);
    assert_eq!(g.faces().cells.len(), 1);
    // Angles about y, from +x up to +z; the front's normal points w down.
    let at = |e: f64| DVec3::new(e.cos(), 0.0, e.sin());
    for from_deg in [-30.0f64, -8.0, 3.0, 20.0] {
        let from = from_deg.to_radians();
        let inside = ((from + w).sin() / n).asin() - w;
        let out = (n * (-inside + w).sin()).asin() - w;
        let (t, r) = (at(from), at(out));
        let (ab, ba) = (scattered(&g, look(t, r), 1).every, scattered(&g, look(r, t), 1).every);
        let pass = |outside: f64, inside: f64| {
            let (co, ci) = ((outside + w).cos(), (inside + w).cos());
            [2.0 * co / (n * co + ci), 2.0 * co / (co + n * ci)]
        };
        // The mirror's part that is both lit and seen, as by rays along z.
        let reach = |e: f64| {
            let z = |z: f64| z * h - front(z) * e.tan();
            (z(-1.0).max(-h), z(1.0).min(h))
        };
        let (l, s) = (reach(inside), reach(-inside));
        let area = a * (l.1.min(s.1) - l.0.max(s.0));
        for pol in [0, 1] {
            let want = k / std::f64::consts::TAU
                * n
                * inside.cos()
                * area
                * pass(from, inside)[pol]
                * pass(out, -inside)[pol];
            let (ab, ba) = (ab[pol][pol], ba[pol][pol]);
            println!(
                "{from_deg} deg, out at {:.2}: {:.5} {:.1e}",
                out.to_degrees(),
                ab.norm() / want,
                (ab - ba).norm() / want
            );
            assert!((ab.norm() / want - 1.0).abs() < 5e-3 && (ab - ba).norm() < 5e-3 * want);
        }
    }
}

/// A sheet before a trihedral: what comes back has passed it twice.
#[test]
fn a_sheet_before_a_trihedral_is_passed_twice() {
    let k = wavenumber(F);
    let a = 0.1;
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X * a, DVec3::Y * a, DVec3::Z * a);
    let s = DVec3::ONE.normalize();
    let (v, h) = polarisation_basis(s);
    let tilt = 12f64.to_radians();
    // Turned about the horizontal: V lies in the plane of incidence.
    let (n, up) = (s * tilt.cos() + v * tilt.sin(), v * tilt.cos() - s * tilt.sin());
    let p = |i: f64, j: f64| s * 0.3 + h * (0.35 * i) + up * (0.3 * j);
    let wide = [p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0)];
    let corner: [&[DVec3]; 3] = [&[o, x, y], &[o, y, z], &[o, z, x]];
    for (spec, turned) in
        [("air+pmma:0.002", false), ("air+pmma:0.002", true), ("air+polypropylene:0.0031+glass:0.001", false)]
    {
        let sheet = material::parse_spec(spec).unwrap();
        let mut w = wide.to_vec();
        if turned {
            w.reverse();
        }
        let mut list: Vec<(&[DVec3], u32)> = corner.iter().map(|p| (*p, 0)).collect();
        let bare = scattered(&geometry(&list, &[Material::pec()]), look(s, s), 3);
        let alone = scattered(&geometry(&[(&w, 0)], std::slice::from_ref(&sheet)), look(s, s), 3);
        list.push((&w, 1));
        let g = geometry(&list, &[Material::pec(), sheet]);
        let both = scattered(&g, look(s, s), 3);
        let (perp, par) = g.surfaces[1].transmission(k, n.dot(s)).unwrap();
        for (both, bare, alone) in [(both.every, bare.every, alone.every), (both.last, bare.last, alone.last)]
        {
            for (p, t) in [(0, par), (1, perp)] {
                let ratio = (both[p][p] - alone[p][p]) / bare[p][p];
                let off = 20.0 * (ratio / (t * t)).norm().log10();
                println!("{spec}: T^2 {:.3} dB, off {off:.4} dB", 40.0 * t.norm().log10());
                assert!(off.abs() < 0.1 && (ratio / (t * t)).arg().abs() < 0.02);
            }
        }
    }
}

/// Behind sheets the wave is weaker: the forward lobe of what they take away, one sheet or two.
#[test]
fn sheets_cast_the_shadow_of_what_does_not_pass() {
    let k = wavenumber(F);
    let square = |x: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(y, z)| DVec3::new(x, 0.1 * y, 0.1 * z))
            .to_vec()
    };
    let (first, second) = (square(0.0), square(-0.05));
    let sheets = ["air+pmma:0.0017", "air+glass:0.001"].map(|s| material::parse_spec(s).unwrap());
    let forward = Complex64::new(0.0, k * 0.04 / std::f64::consts::TAU);
    let one = geometry(&[(&first, 0)], &sheets);
    let two = geometry(&[(&first, 0), (&second, 1)], &sheets);
    let t = [0, 1].map(|i| two.surfaces[i].transmission(k, 1.0).unwrap().0);
    for (g, passed) in [(one, t[0]), (two, t[0] * t[1])] {
        let s = scattered(&g, look(DVec3::X, -DVec3::X), 1).every;
        let want = forward * (passed - 1.0);
        println!("{} {want}", s[0][0]);
        assert!((s[0][0].norm() - want.norm()).abs() < 1e-9 * forward.norm());
        assert!(
            (s[0][0] * s[1][1]).norm() > 0.0
                && (s[0][0] - want).norm().min((s[0][0] + want).norm()) < 1e-9 * forward.norm()
        );
    }
}

/// A plate of plastic painted on both sides, its faces the paint's: the stack of three layers.
#[test]
fn painted_plastic_is_three_layers() {
    let k = wavenumber(F);
    let (paint, coat) = (dielectric(5.0, 0.05), 3e-4);
    let core = dielectric(2.56, 0.0)
        .with_layers(vec![catseye::scene::material::Layer::new(paint, coat).unwrap()])
        .unwrap();
    let h = 10.0;
    let faces = cuboid(DVec3::new(-D, -h, -h), DVec3::new(0.0, h, h));
    let list: Vec<(&[DVec3], u32)> = faces.iter().map(|f| (f.as_slice(), 0)).collect();
    let g = geometry(&list, &[core]);
    let eps = [(5.0, -0.05, coat), (2.56, 0.0, D - 2.0 * coat), (5.0, -0.05, coat)];
    let layers = eps.map(|(re, im, thickness_m)| Layer { eps_r: Complex64::new(re, im), thickness_m });
    for elevation in [0.0f64, 40.0] {
        let cos_i = elevation.to_radians().cos();
        let stack = Stack { layers: layers.to_vec(), backing: Backing::Air };
        let want = mirror(4.0 * h * h, cos_i, 0.0, stack.reflection(k, cos_i));
        let s = scattered(&g, look(deg(0.0, elevation), deg(0.0, -elevation)), 19).every;
        let off = [0, 1].map(|p| (s[p][p] - want[p]).norm() / want[1].norm());
        println!("{elevation} deg: {off:?}");
        assert!(off.iter().all(|d| *d < if elevation == 0.0 { 1e-5 } else { 1e-3 }));
    }
}

/// What is no body, or lets nothing through, stays a half-space: an open sheet of asphalt, a block of rubber. And
/// what cannot be followed is refused.
#[test]
fn what_is_not_entered_and_what_is_refused() {
    let cube = |a: f64, at: f64| cuboid(DVec3::splat(at), DVec3::splat(at + a));
    let scene_of = |bodies: &[(&[Vec<DVec3>], Material)]| {
        let mut scene = Scene::default();
        for (faces, material) in bodies {
            let id = scene.material_index(material);
            let mut m = Mesh::default();
            for f in faces.iter() {
                let first = m.positions_m.len() as u32;
                m.positions_m.extend(f);
                m.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
                m.material.extend([id, id]);
            }
            scene.add_mesh("m", "", m, Pose::IDENTITY);
        }
        scene
    };
    let cpu = Engine::open("cpu", Precision::F64).unwrap();
    let run = |scene: &Scene, distance: Distance| {
        let options = RcsOptions { distance, ..Default::default() };
        cpu.rcs(scene, &[F], &[look(deg(20.0, 30.0), deg(20.0, 30.0))], &options)
    };
    let by = |name: &str| material::by_name(name).unwrap();
    let whole = cube(0.3, 0.0);
    for (faces, material) in
        [(&whole[5..], by("asphalt")), (&whole[..], by("rubber")), (&whole[..], by("wood"))]
    {
        let scene = scene_of(&[(faces, material)]);
        let s = run(&scene, Distance::Infinite).unwrap()[0];
        let at_range = run(&scene, Distance::At(1e5)).unwrap()[0];
        assert!((s.every[0][0].norm() / at_range.every[0][0].norm() - 1.0).abs() < 0.02);
        let g = Geometry::build(&scene, 0.0, F).unwrap();
        let look = look(deg(20.0, 30.0), deg(20.0, 30.0));
        let tone = FrequencyPoint { wavenumber: wavenumber(F), surfaces: &g.surfaces };
        let same = by_beams(&g, &[tone], &[look], Distance::Infinite, &BeamOptions::new(3, 0.1, true))
            .unwrap()[0][0];
        assert_eq!(s.every, same.every);
    }
    // Of plastic, smaller, it is entered: other numbers, and no finite range.
    let scene = scene_of(&[(&cube(0.05, 0.0), by("pmma"))]);
    assert!(run(&scene, Distance::Infinite).is_ok());
    let e = run(&scene, Distance::At(5.0)).unwrap_err();
    assert_eq!(e.exit_code(), 2);
    assert!(e.to_string().contains("pmma") && e.to_string().contains("range_m"), "{e}");
    let sheet = scene_of(&[(&cube(0.05, 0.0)[5..], material::parse_spec("air+pmma:0.002").unwrap())]);
    assert!(run(&sheet, Distance::At(5.0)).is_err() && run(&sheet, Distance::Infinite).is_ok());
    // Side by side without a gap, and one within the other.
    let next: Vec<Vec<DVec3>> =
        cube(0.05, 0.0).into_iter().map(|f| f.into_iter().map(|p| p + DVec3::Z * 0.05).collect()).collect();
    for other in [next, cube(0.02, 0.01).to_vec()] {
        let scene = scene_of(&[(&cube(0.05, 0.0), by("pmma")), (&other, by("polypropylene"))]);
        let e = run(&scene, Distance::Infinite).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("touches or contains another"), "{e}");
        // The sum itself says so, too, and not by a value.
        let g = Geometry::build(&scene, 0.0, F).unwrap();
        let tone = [FrequencyPoint { wavenumber: wavenumber(F), surfaces: &g.surfaces }];
        let look = [look(deg(20.0, 30.0), deg(20.0, 30.0))];
        for (distance, why) in
            [(Distance::Infinite, Impassable::NoBody), (Distance::At(5.0), Impassable::NearPort)]
        {
            assert_eq!(by_beams(&g, &tone, &look, distance, &BeamOptions::new(3, 0.1, true)), Err(why));
        }
    }
    // The gpu engine does not follow them.
    let gpu = Engine::Gpu(Box::new(catseye::gpu::compare::opened_for_tests()));
    for scene in [&sheet, &scene_of(&[(&cube(0.05, 0.0), by("pmma"))])] {
        let l = look(deg(20.0, 30.0), deg(20.0, 30.0));
        let e = gpu.rcs(scene, &[F], &[l], &RcsOptions::default()).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("--device cpu"), "{e}");
    }
}

/// Media that change with frequency are followed for each frequency; the others once.
#[test]
fn tones_are_those_of_single_runs() {
    let cube = cuboid(DVec3::ZERO, DVec3::new(0.02, 0.03, 0.01));
    let list: Vec<(&[DVec3], u32)> = cube.iter().map(|f| (f.as_slice(), 0)).collect();
    for name in ["ice", "polypropylene"] {
        let g = geometry(&list, &[material::by_name(name).unwrap()]);
        let f = [76e9, 78e9, 81e9];
        let surfaces = f.map(|f| g.surfaces_at(f).unwrap());
        let tone = |i: usize| FrequencyPoint { wavenumber: wavenumber(f[i]), surfaces: &surfaces[i] };
        let l = look(deg(30.0, 20.0), deg(30.0, 20.0));
        let options = BeamOptions::new(4, 0.1, true);
        let all = by_beams(&g, &[tone(0), tone(1), tone(2)], &[l], Distance::Infinite, &options).unwrap();
        for (i, together) in all[0].iter().enumerate() {
            let alone = by_beams(&g, &[tone(i)], &[l], Distance::Infinite, &options).unwrap()[0][0];
            assert_eq!(*together, alone, "{name}");
        }
    }
}

/// Figure 4.15 (a) of Feng 2019: type 1 empty, filled, let flush into asphalt and buried 5 mm deeper under its
/// filling. The asphalt's own echo is taken out, as it depends on where the sheet ends.
#[test]
fn a_marker_let_into_the_road() {
    let lookup = |name: &str| match name {
        "ideal" => Ok(dielectric(2.19, 0.0)),
        "foam" => Ok(dielectric(1.1, 0.0)),
        _ => material::by_name(name),
    };
    let marker = |spec: &str| {
        Reflector::parse(&format!("type1:length_m=0.0,height_m=0.01{spec}"))
            .unwrap()
            .to_scene(&lookup)
            .unwrap()
    };
    let road = |scene: &mut Scene, depth: f64| {
        let asphalt = scene.material_index(&material::by_name("asphalt").unwrap());
        let mut ring = Mesh::default();
        let r = 1.5;
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let outer = [p(-r, 0.0), p(0.04, -r), p(0.08 + r, 0.0), p(0.04, r)];
        ring.positions_m = [outer.to_vec(), vec![p(0.0, 0.0), p(0.08, -0.08), p(0.08, 0.08)]].concat();
        ring.triangles = vec![[0, 1, 4], [1, 5, 4], [1, 2, 5], [5, 2, 6], [2, 3, 6], [3, 4, 6], [3, 0, 4]];
        ring.material = vec![asphalt; 7];
        scene.add_mesh("road", "", ring, Pose::IDENTITY);
        if depth > 0.0 {
            let q = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
            let mut pit = Mesh::default();
            for [a, b] in
                [[(0.08, -0.08), (0.08, 0.08)], [(0.08, 0.08), (0.0, 0.0)], [(0.0, 0.0), (0.08, -0.08)]]
            {
                let n = pit.positions_m.len() as u32;
                pit.positions_m.extend([
                    q(a.0, a.1, -depth),
                    q(b.0, b.1, -depth),
                    q(b.0, b.1, 0.0),
                    q(a.0, a.1, 0.0),
                ]);
                pit.triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
            }
            pit.material = vec![asphalt; pit.triangles.len()];
            scene.add_mesh("pit", "", pit, Pose::IDENTITY);
        }
    };
    let level = |scene: &Scene, e: f64, less: Option<&Scene>| {
        let g = Geometry::build(scene, 0.0, F).unwrap();
        let at = |g: &Geometry| scattered(g, look(deg(0.0, e), deg(0.0, e)), 6).every;
        let mut s = at(&g);
        if let Some(less) = less {
            let taken = at(&Geometry::build(less, 0.0, F).unwrap());
            s.iter_mut().flatten().zip(taken.iter().flatten()).for_each(|(a, b)| *a -= b);
        }
        let sigma = |z: Complex64| db(z) + 10.0 * (4.0 * std::f64::consts::PI).log10();
        [sigma(s[0][0]), sigma(s[1][1])]
    };
    let mut bare = Scene::default();
    road(&mut bare, 0.0);
    for fill in ["foam", "ideal", "polypropylene"] {
        let free = marker(&format!(",fill={fill}"));
        let mut flush = marker(&format!(",fill={fill},depth_m=0.01"));
        road(&mut flush, 0.01);
        let mut buried = marker(&format!(",fill={fill},fill_height_m=0.015,depth_m=0.015"));
        road(&mut buried, 0.015);
        for e in [1.0, 3.0, 6.0, 10.0, 20.0] {
            let [empty, free, flush, buried] =
                [(&marker(""), None), (&free, None), (&flush, Some(&bare)), (&buried, Some(&bare))]
                    .map(|(scene, less)| level(scene, e, less));
            println!(
                "{fill} at {e} deg, VV/HH dBsm: empty {empty:.1?} filled {free:.1?} flush {flush:.1?} buried {buried:.1?}"
            );
            assert!([empty, free, flush, buried].iter().flatten().all(|x| x.is_finite()));
            // What docs/studies.md says, VV: nothing else knows these levels, so they are only held.
            let documented = match (fill, e) {
                ("foam", 3.0) => [5.7, 5.7, -18.1, -15.7],
                ("foam", 10.0) => [0.2, 1.1, -1.0, -2.5],
                ("polypropylene", 1.0) => [4.3, -2.7, -53.0, -57.2],
                ("polypropylene", 3.0) => [5.7, -3.4, -38.2, -40.1],
                ("polypropylene", 10.0) => [0.2, -17.2, -25.4, -31.9],
                _ => continue,
            };
            for (got, says) in [empty, free, flush, buried].iter().zip(documented) {
                assert!((got[0] - says).abs() < 0.06, "{fill} at {e} deg: {got:?}, documented {says}");
            }
        }
    }
}
