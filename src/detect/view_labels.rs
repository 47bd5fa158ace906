//! Labels of tensors: the cells over range, Doppler and azimuth that a body fills, and confidence maps of where bodies are (CONVENTIONS
//! eq. 166, 167).

use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, Sensor, World};
use crate::scene::radar::Radar;
use glam::{DQuat, DVec3};

/// A body as a radar sees it, in the sensor's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenBody {
    /// Number of its class, from 0.
    pub class: usize,
    /// Middle of its box, m.
    pub centre_m: DVec3,
    /// Length, width and height of its box, m; zeros for a point.
    pub size_m: DVec3,
    /// From its own axes to those of the sensor.
    pub rotation: DQuat,
    /// Velocity of the middle relative to the radar, m/s.
    pub velocity_mps: DVec3,
    /// Turn rate, rad/s, along the sensor's axes.
    pub spin_rad_per_s: DVec3,
}

impl SeenBody {
    /// A body of the world as a radar sees it. The radar's own turn changes no range rate and is left out.
    pub fn of_world(&self, radar: &Pose<Sensor, World>, radar_velocity_mps: DVec3) -> SeenBody {
        let back = radar.inverse();
        SeenBody {
            centre_m: back.point(self.centre_m),
            rotation: back.rotation * self.rotation,
            velocity_mps: back.direction(self.velocity_mps - radar_velocity_mps),
            spin_rad_per_s: back.direction(self.spin_rad_per_s),
            ..*self
        }
    }

    /// A place of the body, given in half sizes along its own axes, and its velocity there.
    fn place(&self, of_half: DVec3) -> (DVec3, DVec3) {
        let arm = self.rotation * (0.5 * of_half * self.size_m);
        (self.centre_m + arm, self.velocity_mps + self.spin_rad_per_s.cross(arm))
    }

    /// Range, m, and range rate, m/s, of the middle.
    pub fn range_and_rate(&self) -> (f64, f64) {
        let range = self.centre_m.length();
        (range, self.velocity_mps.dot(self.centre_m) / range.max(f64::MIN_POSITIVE))
    }
}

/// Where a place shows in a radar's tensors; None where that is outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewCell {
    /// Doppler row, into which range rates are folded.
    pub doppler: usize,
    /// Range column.
    pub range: Option<usize>,
    /// Column of azimuth.
    pub azimuth: Option<usize>,
}

/// The axes of a radar's tensors.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    range: [f64; 2],
    range_bins: usize,
    rows: usize,
    velocity_bin_mps: f64,
    /// What a range rate adds to the range of the map, s.
    coupling_s: f64,
    sines: Vec<f64>,
}

impl View {
    /// The axes of one ramp's tensors (`radar` is [`Radar::part`] of it) with these azimuths, rad.
    ///
    /// # Errors
    /// Returns an error for azimuths that are none, not finite or not in order.
    pub fn new(radar: &Radar, azimuth_rad: &[f64]) -> Result<View> {
        let sines: Vec<f64> = azimuth_rad.iter().map(|a| a.sin()).collect();
        if sines.is_empty() || sines.iter().any(|s| !s.is_finite()) || !sines.windows(2).all(|w| w[0] < w[1])
        {
            return Err(BadInput::new("the azimuths do not form an axis")
                .key("azimuth")
                .value(format!("{} angles", sines.len()))
                .allowed("one or more angles from -90 to 90 deg, ascending")
                .into());
        }
        Ok(View {
            range: [radar.first_range_m(), radar.range_bin_m()],
            range_bins: radar.range_bins(),
            rows: radar.doppler_rows(),
            velocity_bin_mps: radar.velocity_bin_mps(),
            coupling_s: radar.range_per_rate_s(),
            sines,
        })
    }

    /// Range columns, Doppler rows and azimuths.
    pub fn size(&self) -> [usize; 3] {
        [self.range_bins, self.rows, self.sines.len()]
    }

    /// The cell of a place with its velocity, in the sensor's frame (eq. 166).
    pub fn cell(&self, place_m: DVec3, velocity_mps: DVec3) -> ViewCell {
        let range = place_m.length();
        let u = place_m / range.max(f64::MIN_POSITIVE);
        let rate = velocity_mps.dot(u);
        let column = ((range + rate * self.coupling_s - self.range[0]) / self.range[1]).round();
        let row = (rate / self.velocity_bin_mps).round() as i64 + (self.rows / 2) as i64;
        let inside = column >= 0.0 && column < self.range_bins as f64;
        let ahead = u.x > 0.0;
        ViewCell {
            doppler: row.rem_euclid(self.rows as i64) as usize,
            range: inside.then_some(column as usize),
            azimuth: if ahead { self.azimuth(u.y) } else { None },
        }
    }

    /// The nearest of the axis' sines, to half a step outside of it.
    fn azimuth(&self, sine: f64) -> Option<usize> {
        let n = self.sines.len();
        if n == 1 {
            return Some(0);
        }
        let after = self.sines.partition_point(|s| *s < sine).clamp(1, n - 1);
        let nearest =
            if sine - self.sines[after - 1] <= self.sines[after] - sine { after - 1 } else { after };
        ((sine - self.sines[nearest]).abs() <= 0.5 * self.step(nearest) * (1.0 + 1e-9)).then_some(nearest)
    }

    /// Step of the sines about a column of azimuth.
    fn step(&self, at: usize) -> f64 {
        let n = self.sines.len();
        match n {
            1 => 2.0,
            _ => {
                let (a, b) = (at.saturating_sub(1), (at + 1).min(n - 1));
                (self.sines[b] - self.sines[a]) / (b - a) as f64
            }
        }
    }
}

/// Class of each cell, 1 more than the number of the body's class, 0 where no body is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Masks {
    /// `[range, azimuth]`.
    pub range_azimuth: Vec<u8>,
    /// `[doppler, range]`.
    pub range_doppler: Vec<u8>,
    /// `[azimuth, doppler]`.
    pub angle_doppler: Vec<u8>,
}

/// Most places of a body that are looked at along one of its axes.
const MOST_PLACES: f64 = 512.0;

/// Marks the cells that bodies fill: those of places no farther apart than half a cell all over each box (eq. 166). Nearer bodies hide
/// farther ones.
///
/// # Errors
/// Returns an error for more than 255 classes, and for a body whose place, size or velocity is not finite.
pub fn masks(view: &View, bodies: &[SeenBody]) -> Result<Masks> {
    check(bodies)?;
    let [ranges, rows, azimuths] = view.size();
    let mut out = Masks {
        range_azimuth: vec![0; ranges * azimuths],
        range_doppler: vec![0; rows * ranges],
        angle_doppler: vec![0; azimuths * rows],
    };
    let mut order: Vec<&SeenBody> = bodies.iter().collect();
    order.sort_by(|a, b| b.centre_m.length_squared().total_cmp(&a.centre_m.length_squared()));
    for body in order {
        let class = body.class as u8 + 1;
        for (place, velocity) in places(view, body) {
            let cell = view.cell(place, velocity);
            if let (Some(r), Some(a)) = (cell.range, cell.azimuth) {
                out.range_azimuth[r * azimuths + a] = class;
                out.angle_doppler[a * rows + cell.doppler] = class;
                out.range_doppler[cell.doppler * ranges + r] = class;
            }
        }
    }
    Ok(out)
}

/// Places all over a body's box with the velocity of each.
fn places(view: &View, body: &SeenBody) -> Vec<(DVec3, DVec3)> {
    let nearest = (body.centre_m.length() - 0.5 * body.size_m.length()).max(0.0);
    let across = nearest * view.sines.windows(2).map(|w| w[1] - w[0]).fold(2.0, f64::min);
    let step = 0.5 * view.range[1].min(across.max(1e-3));
    // An odd number, so that the middle is one of them.
    let counts =
        body.size_m.to_array().map(|s| 2 * (0.5 * s / step).ceil().min(MOST_PLACES / 2.0) as usize + 1);
    let along = |i: usize, n: usize| if n == 1 { 0.0 } else { 2.0 * i as f64 / (n - 1) as f64 - 1.0 };
    let [nx, ny, nz] = counts;
    // Height moves a place little in range and azimuth: its ends and its middle are enough.
    let nz = nz.min(3);
    (0..nx * ny * nz)
        .map(|i| {
            let [x, y, z] = [along(i / (ny * nz), nx), along(i / nz % ny, ny), along(i % nz, nz)];
            body.place(DVec3::new(x, y, z))
        })
        .collect()
}

/// Confidence that a body of each class is in a cell, `[class, range, azimuth]`: the largest of a Gaussian about each body, 1 in the cell of
/// its middle (eq. 167). `sigma_m` is the deviation of each body's place on the ground; in cells it is at least 1.
///
/// # Errors
/// Returns an error for other numbers of deviations than bodies, for one that is not positive, for a class beyond `classes`, and the errors
/// of [`masks`].
pub fn confidence(view: &View, bodies: &[SeenBody], classes: usize, sigma_m: &[f64]) -> Result<Vec<f32>> {
    check(bodies)?;
    if sigma_m.len() != bodies.len() || sigma_m.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(BadInput::new(
            "the number of position deviations differs from the number of objects, or one is not positive",
        )
        .key("sigma_m")
        .value(format!("{} values", sigma_m.len()))
        .allowed(format!("{} positive numbers", bodies.len()))
        .into());
    }
    if let Some(body) = bodies.iter().find(|b| b.class >= classes) {
        return Err(BadInput::new("no such class")
            .key("class")
            .value(body.class)
            .allowed(format!("below {classes}"))
            .into());
    }
    let [ranges, _, azimuths] = view.size();
    let mut out = vec![0f32; classes * ranges * azimuths];
    for (body, sigma) in bodies.iter().zip(sigma_m) {
        let cell = view.cell(body.centre_m, body.velocity_mps);
        let (Some(r0), Some(a0)) = (cell.range, cell.azimuth) else { continue };
        let range = body.centre_m.length();
        // A way across the line of sight turns the sine by cos a over the range.
        let turn = sigma * (1.0 - view.sines[a0].powi(2)).max(0.01).sqrt() / range.max(f64::MIN_POSITIVE);
        let deviation = [(sigma / view.range[1]).max(1.0), (turn / view.step(a0)).max(1.0)];
        let plane = &mut out[body.class * ranges * azimuths..][..ranges * azimuths];
        for (i, value) in plane.iter_mut().enumerate() {
            let x = ((i / azimuths) as f64 - r0 as f64) / deviation[0];
            let y = ((i % azimuths) as f64 - a0 as f64) / deviation[1];
            *value = value.max((-0.5 * (x * x + y * y)).exp() as f32);
        }
    }
    Ok(out)
}

fn check(bodies: &[SeenBody]) -> Result<()> {
    for (i, b) in bodies.iter().enumerate() {
        let finite = [b.centre_m, b.size_m, b.velocity_mps, b.spin_rad_per_s].iter().all(|v| v.is_finite())
            && b.rotation.is_finite();
        if !finite || b.size_m.min_element() < 0.0 {
            return Err(BadInput::new("a position, size or velocity is not finite, or a size is negative")
                .key(format!("object {i}"))
                .remedy("leave out the object")
                .into());
        }
        if b.class > 254 {
            return Err(BadInput::new("a mask can have up to 255 classes")
                .key(format!("object {i}: class"))
                .value(b.class)
                .allowed("0 to 254")
                .into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::tensors::fourier_azimuths;
    use crate::scene::radar_toml::preset;

    fn body(class: usize, centre_m: DVec3, size_m: DVec3, velocity_mps: DVec3) -> SeenBody {
        let (rotation, spin_rad_per_s) = (DQuat::IDENTITY, DVec3::ZERO);
        SeenBody { class, centre_m, size_m, rotation, velocity_mps, spin_rad_per_s }
    }

    fn view() -> View {
        View::new(&preset("demo77").unwrap(), &fourier_azimuths(64)).unwrap()
    }

    #[test]
    fn a_point_has_its_cell() {
        let radar = preset("demo77").unwrap();
        let (range, azimuth, rate) = (30.0, 0.25f64, -4.0);
        let u = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let cell = view().cell(range * u, rate * u + DVec3::new(-u.y, u.x, 0.0));
        let column = (range + rate * radar.range_per_rate_s()) / radar.range_bin_m();
        assert_eq!(cell.range, Some(column.round() as usize));
        assert_eq!(cell.doppler as f64, (rate / radar.velocity_bin_mps()).round() + 64.0);
        assert_eq!(cell.azimuth, Some((32.0 + 32.0 * azimuth.sin()).round() as usize));
        // Twice the unambiguous range rate later it is the same row again.
        let again = view().cell(range * u, (rate + 2.0 * radar.max_velocity_mps()) * u);
        assert_eq!(again.doppler, cell.doppler);
        assert_eq!(view().cell(-range * u, DVec3::ZERO).azimuth, None);
        assert_eq!(view().cell(1e6 * u, DVec3::ZERO).range, None);
        let points = masks(&view(), &[body(2, range * u, DVec3::ZERO, rate * u)]).unwrap();
        let marked = |m: &[u8]| m.iter().filter(|c| **c == 3).count();
        assert_eq!(
            [&points.range_azimuth, &points.range_doppler, &points.angle_doppler].map(|m| marked(m)),
            [1; 3]
        );
    }

    #[test]
    fn a_box_fills_what_it_covers_and_the_nearer_one_hides() {
        let v = view();
        let (range_m, azimuths) = (v.range[1], v.size()[2]);
        let car = body(0, DVec3::new(20.0, 0.0, 0.0), DVec3::new(4.5, 1.8, 1.5), DVec3::ZERO);
        let m = masks(&v, &[car]).unwrap();
        for r in 0..v.size()[0] {
            let inside = |slack: f64| (r as f64 * range_m - 20.0).abs() < 2.25 + slack;
            let middle = m.range_azimuth[r * azimuths + 32] == 1;
            // Every column well inside and none well outside: there are no holes.
            assert!(!inside(-range_m) || middle, "{r}");
            assert!(inside(range_m) || !middle, "{r}");
        }
        let behind = body(1, DVec3::new(21.0, 0.0, 0.0), DVec3::new(4.0, 3.0, 1.0), DVec3::ZERO);
        for list in [[car, behind], [behind, car]] {
            let m = masks(&v, &list).unwrap();
            let at = v.cell(car.centre_m, DVec3::ZERO);
            assert_eq!(m.range_azimuth[at.range.unwrap() * azimuths + 32], 1);
            assert!(m.range_azimuth.contains(&2));
        }
        // One that turns on the spot shows rates on both sides of zero.
        let turning = SeenBody { spin_rad_per_s: DVec3::new(0.0, 0.0, 1.0), ..behind };
        let rows = |b| {
            let m = masks(&v, &[b]).unwrap().range_doppler;
            (0..v.size()[1]).filter(|d| m[d * v.size()[0]..][..v.size()[0]].contains(&2)).count()
        };
        assert!(rows(behind) == 1 && rows(turning) > 3);
    }

    #[test]
    fn confidence_is_one_at_the_body_and_falls_as_stated() {
        let v = view();
        let [ranges, _, azimuths] = v.size();
        let at = DVec3::new(25.0, 0.0, 0.0);
        let map = confidence(&v, &[body(1, at, DVec3::ZERO, DVec3::ZERO)], 2, &[2.0]).unwrap();
        let (r0, a0) = ((25.0 / v.range[1]).round() as usize, 32);
        let value = |r: usize, a: usize| map[(ranges + r) * azimuths + a];
        assert_eq!(value(r0, a0), 1.0);
        assert!(map[..ranges * azimuths].iter().all(|c| *c == 0.0));
        let along = (-0.5 * (3.0 * v.range[1] / 2.0f64).powi(2)).exp();
        assert!((f64::from(value(r0 + 3, a0)) - along).abs() < 1e-6);
        let across = (-0.5 * (1.0f64 / (2.0 / 25.0 / (2.0 / 64.0))).powi(2)).exp();
        assert!((f64::from(value(r0, a0 - 1)) - across).abs() < 1e-6);
        assert_eq!(map.iter().filter(|c| **c == 1.0).count(), 1);
        for (classes, sigma) in [(1, vec![2.0]), (2, vec![0.0]), (2, vec![])] {
            let e = confidence(&v, &[body(1, at, DVec3::ZERO, DVec3::ZERO)], classes, &sigma).unwrap_err();
            assert_eq!(e.exit_code(), 2);
        }
        let nan = body(0, DVec3::NAN, DVec3::ZERO, DVec3::ZERO);
        assert_eq!(masks(&v, &[nan]).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn the_world_is_seen_from_the_radar() {
        let pose =
            Pose::from_yaw_pitch_roll(DVec3::new(1.0, 2.0, 0.5), std::f64::consts::FRAC_PI_2, 0.0, 0.0);
        let b = body(0, DVec3::new(1.0, 12.0, 0.5), DVec3::ONE, DVec3::new(0.0, -3.0, 0.0));
        let seen = b.of_world(&pose, DVec3::new(0.0, 2.0, 0.0));
        assert!((seen.centre_m - DVec3::new(10.0, 0.0, 0.0)).length() < 1e-12);
        let (range, rate) = seen.range_and_rate();
        assert!((range - 10.0).abs() < 1e-12 && (rate + 5.0).abs() < 1e-12);
    }
}
