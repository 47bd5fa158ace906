//! Frames of reference and the rigid motions between them. All are ISO 8855: x forward, y left,
//! z up, metres. The marker types make a point of one frame unusable in another by mistake.
//!
//! A radar at the front right corner of a car, turned by 45° to the right, sees a target on its boresight. In the
//! car's frame the target is 10 m in front of the radar and 10 m to its right; the car itself heads along the world's
//! y axis:
//!
//! ```
//! use catseye::base::frames::{Pose, Sensor, Vehicle, World};
//! use glam::DVec3;
//!
//! let right_rad = -45f64.to_radians();
//! let mounting = Pose::<Sensor, Vehicle>::from_yaw_pitch_roll(DVec3::new(3.7, -0.8, 0.5), right_rad, 0.0, 0.0);
//! let left_rad = 90f64.to_radians();
//! let car = Pose::<Vehicle, World>::from_yaw_pitch_roll(DVec3::new(100.0, 0.0, 0.0), left_rad, 0.0, 0.0);
//! let target_m = DVec3::new(200f64.sqrt(), 0.0, 0.0);
//! assert!(mounting.point(target_m).distance(DVec3::new(13.7, -10.8, 0.5)) < 1e-12);
//! assert!(mounting.then(&car).point(target_m).distance(DVec3::new(110.8, 13.7, 0.5)) < 1e-12);
//! ```

use glam::{DMat3, DQuat, DVec3};
use std::marker::PhantomData;

/// The road-fixed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct World;
/// The frame of the car that carries the radar, with its origin at the rear-axle centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle;
/// The frame of the radar, with its origin at the phase centre and x along boresight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor;
/// The frame of a scatterer, x along its boresight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target;

/// The rigid motion that takes coordinates in `From` to coordinates in `To`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose<From, To> {
    /// Rotation, applied first.
    pub rotation: DQuat,
    /// Translation, m, applied after the rotation.
    pub translation_m: DVec3,
    frames: PhantomData<(From, To)>,
}

impl<A, B> Pose<A, B> {
    /// The motion that leaves everything where it is.
    pub const IDENTITY: Self = Self::new(DQuat::IDENTITY, DVec3::ZERO);

    /// The motion by a rotation and, after it, a translation in m.
    pub const fn new(rotation: DQuat, translation_m: DVec3) -> Self {
        Pose { rotation, translation_m, frames: PhantomData }
    }

    /// The pose with yaw about z, then pitch about the new y, then roll about the new x (ISO 8855), rad. Positive yaw
    /// turns left; positive pitch turns the nose **down** (right-hand rule about y left).
    pub fn from_yaw_pitch_roll(position_m: DVec3, yaw: f64, pitch: f64, roll: f64) -> Self {
        let q = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch) * DQuat::from_rotation_x(roll);
        Self::new(q, position_m)
    }

    /// Coordinates of a point in `To`, m.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation_m
    }

    /// Components of a direction in `To`.
    pub fn direction(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }

    /// The inverse motion.
    pub fn inverse(&self) -> Pose<B, A> {
        let r = self.rotation.inverse();
        Pose::new(r, -(r * self.translation_m))
    }

    /// The motion by `self` (A to B) and after it by `next` (B to C).
    pub fn then<C>(&self, next: &Pose<B, C>) -> Pose<A, C> {
        Pose::new(next.rotation * self.rotation, next.point(self.translation_m))
    }
}

/// Unit vector from azimuth (positive left) and elevation (positive up), radians (CONVENTIONS eq. 1).
///
/// # Example
/// ```
/// use catseye::base::frames::{angles_from_direction, direction_from_angles};
///
/// let u = direction_from_angles(10f64.to_radians(), -5f64.to_radians());
/// // To the left of boresight is +y, below the horizon is -z.
/// assert!(u.y > 0.0 && u.z < 0.0);
/// let (azimuth_rad, elevation_rad) = angles_from_direction(20.0 * u);
/// assert!((azimuth_rad.to_degrees() - 10.0).abs() < 1e-12);
/// assert!((elevation_rad.to_degrees() + 5.0).abs() < 1e-12);
/// ```
pub fn direction_from_angles(azimuth: f64, elevation: f64) -> DVec3 {
    let (sa, ca) = azimuth.sin_cos();
    let (se, ce) = elevation.sin_cos();
    DVec3::new(ce * ca, ce * sa, se)
}

/// Azimuth and elevation of a non-zero vector, rad.
pub fn angles_from_direction(d: DVec3) -> (f64, f64) {
    (d.y.atan2(d.x), d.z.atan2(d.x.hypot(d.y)))
}

/// The linear polarisation vectors (V, H) of the ray to or from direction `d` as seen from the
/// radar: V = -theta-hat (up), H = phi-hat (left, for a look along +x). The same two serve for
/// receive (backscatter alignment; CONVENTIONS eq. 2). At the poles azimuth is taken as zero.
///
/// # Example
/// For a level direction V is vertical, and H is horizontal and at right angles to the direction.
///
/// ```
/// use catseye::base::frames::polarisation_basis;
/// use glam::DVec3;
///
/// assert_eq!(polarisation_basis(DVec3::X), (DVec3::Z, DVec3::Y));
/// let (v, h) = polarisation_basis(DVec3::new(0.6, 0.0, 0.8));
/// assert!(v.distance(DVec3::new(-0.8, 0.0, 0.6)) < 1e-15 && h.distance(DVec3::Y) < 1e-15);
/// ```
pub fn polarisation_basis(d: DVec3) -> (DVec3, DVec3) {
    let rho = d.x.hypot(d.y);
    let (sa, ca) = if rho > 1e-12 { (d.y / rho, d.x / rho) } else { (0.0, 1.0) };
    let v = DVec3::new(-d.z * ca, -d.z * sa, rho);
    let h = DVec3::new(-sa, ca, 0.0);
    (v, h)
}

/// Rotation matrix of a pose, columns the images of x, y, z.
pub fn matrix_from_rotation(q: DQuat) -> DMat3 {
    DMat3::from_quat(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_is_orthonormal_and_up() {
        for (az, el) in [(0.0, 0.0), (0.4, -0.2), (-2.0, 1.2), (3.0, -1.5)] {
            let d = direction_from_angles(az, el);
            let (v, h) = polarisation_basis(d);
            assert!(v.dot(d).abs() < 1e-15 && h.dot(d).abs() < 1e-15 && v.dot(h).abs() < 1e-15);
            assert!((v.length() - 1.0).abs() < 1e-15 && (h.length() - 1.0).abs() < 1e-15);
            assert!(v.z >= 0.0);
            let (a, e) = angles_from_direction(d);
            assert!((a - az).abs() < 1e-14 && (e - el).abs() < 1e-14);
        }
    }

    #[test]
    fn poses_compose_and_invert() {
        let a = Pose::<Sensor, Vehicle>::from_yaw_pitch_roll(DVec3::new(3.0, 0.1, 0.5), 0.3, -0.1, 0.05);
        let b = Pose::<Vehicle, World>::from_yaw_pitch_roll(DVec3::new(-8.0, 2.0, 0.0), 1.3, 0.0, 0.0);
        let c = a.then(&b);
        let p = DVec3::new(1.0, 2.0, 3.0);
        assert!((c.point(p) - b.point(a.point(p))).length() < 1e-12);
        assert!((c.inverse().point(c.point(p)) - p).length() < 1e-12);
    }
}
