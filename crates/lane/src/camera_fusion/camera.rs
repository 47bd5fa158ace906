//! Pinhole camera over a flat road: projects between pixels and the ground.

use crate::error::{LaneError, finite, positive, within};
use glam::{DMat3, DVec2, DVec3};

/// A pinhole camera without lens distortion (Sangeetha Lakshmi section 2.2). Its own axes are x along the optical axis, y
/// left, z up; the document's camera has z_c = x, x_c = -y, y_c = -z. Pixels count u to the right and v down
/// from the image's upper left corner, so that the centre of the first pixel is (0.5, 0.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Width of the image in pixels.
    pub width_px: usize,
    /// Height of the image in pixels.
    pub height_px: usize,
    /// Focal length divided by the pixel's width and by its height.
    pub focal_px: DVec2,
    /// Pixel at which the optical axis meets the image.
    pub centre_px: DVec2,
    /// Position in the vehicle frame, m; z is the height above the road.
    pub position_m: DVec3,
    /// Yaw angle, rad, positive to the left.
    pub yaw_rad: f64,
    /// Pitch angle, rad, positive nose down.
    pub pitch_rad: f64,
    /// Roll angle, rad, positive left side up.
    pub roll_rad: f64,
}

impl Camera {
    /// Checks that the camera can form an image: sides of 1 to 20000 pixels, positive focal lengths and
    /// height, finite position and angles.
    ///
    /// # Errors
    /// Returns an error for the first value that is non-finite or outside its range.
    pub fn validate(&self) -> Result<(), LaneError> {
        for side in [self.width_px, self.height_px] {
            within("the image's side in pixels", side as f64, 1.0..=20_000.0)?;
        }
        positive("the focal length", self.focal_px.x.min(self.focal_px.y))?;
        positive("the camera's height", self.position_m.z)?;
        if !(self.focal_px.is_finite() && self.centre_px.is_finite() && self.position_m.is_finite()) {
            return Err(LaneError::not_finite("a length of the camera"));
        }
        finite("an angle of the camera", self.yaw_rad + self.pitch_rad + self.roll_rad).map(|_| ())
    }

    /// Rotation from camera axes to vehicle axes: roll, then pitch, then yaw.
    pub(super) fn rotation(&self) -> DMat3 {
        DMat3::from_rotation_z(self.yaw_rad)
            * DMat3::from_rotation_y(self.pitch_rad)
            * DMat3::from_rotation_x(self.roll_rad)
    }

    /// Projects a point of the vehicle frame (m) to its pixel, which may lie outside the image.
    ///
    /// # Errors
    /// Returns an error if the point is non-finite or not in front of the camera.
    pub fn pixel_from_point(&self, point_m: DVec3) -> Result<DVec2, LaneError> {
        let c = self.rotation().transpose() * (point_m - self.position_m);
        if !c.is_finite() {
            return Err(LaneError::not_finite("the point to be projected"));
        }
        if c.x <= 1e-6 {
            return Err(LaneError::refused("the point is not in front of the camera"));
        }
        Ok(self.centre_px - self.focal_px * DVec2::new(c.y, c.z) / c.x)
    }

    /// Projects a point of the ground z = 0 (m) to its pixel, which may lie outside the image.
    ///
    /// # Errors
    /// Returns an error if the point is non-finite or not in front of the camera.
    pub fn pixel_from_ground(&self, ground_m: DVec2) -> Result<DVec2, LaneError> {
        self.pixel_from_point(ground_m.extend(0.0))
    }

    /// Direction of a pixel's ray in the vehicle frame, scaled so that its component along the optical axis
    /// is 1.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        let q = (self.centre_px - pixel) / self.focal_px;
        self.rotation() * DVec3::new(1.0, q.x, q.y)
    }

    /// Projects a pixel to the ground z = 0; the result is in the vehicle frame, m.
    ///
    /// # Errors
    /// Returns an error if the pixel is non-finite or its ray does not meet the ground: at or above the
    /// horizon.
    pub fn ground_from_pixel(&self, pixel: DVec2) -> Result<DVec2, LaneError> {
        let d = self.ray(pixel);
        if !d.is_finite() {
            return Err(LaneError::not_finite("the pixel"));
        }
        if d.z >= -1e-9 {
            return Err(LaneError::refused("the pixel's ray does not meet the ground ahead"));
        }
        Ok((self.position_m - d * (self.position_m.z / d.z)).truncate())
    }

    /// Ground point of a pixel and the shift of that point for one pixel to the right and one down, for many
    /// pixels with the camera's `rotation` computed once. None at or above the horizon.
    pub(super) fn ground_at(&self, rotation: &DMat3, pixel: DVec2) -> Option<(DVec2, [DVec2; 2])> {
        let q = (self.centre_px - pixel) / self.focal_px;
        let d = *rotation * DVec3::new(1.0, q.x, q.y);
        if d.z.is_nan() || d.z >= -1e-9 {
            return None;
        }
        let t = -self.position_m.z / d.z;
        let shift = |dd: DVec3| (t * (dd - d * (dd.z / d.z))).truncate();
        let per_pixel =
            [shift(-rotation.y_axis / self.focal_px.x), shift(-rotation.z_axis / self.focal_px.y)];
        Some(((self.position_m + d * t).truncate(), per_pixel))
    }
}

/// A grey-scale image, 0 black to 1 white, stored row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width_px: usize,
    height_px: usize,
    grey: Vec<f32>,
}

impl Image {
    /// Makes an image from its grey values, row by row from the top.
    ///
    /// # Errors
    /// Returns an error if the number of values is not `width_px * height_px`, if there is none, or if one is
    /// non-finite.
    pub fn new(width_px: usize, height_px: usize, grey: Vec<f32>) -> Result<Image, LaneError> {
        let need = width_px.saturating_mul(height_px);
        if grey.len() != need || need == 0 {
            return Err(LaneError::too_few("pixels", grey.len(), need.max(1)));
        }
        match grey.iter().all(|g| g.is_finite()) {
            true => Ok(Image { width_px, height_px, grey }),
            false => Err(LaneError::not_finite("a pixel's grey")),
        }
    }

    /// Width of the image in pixels.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Height of the image in pixels.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Grey values of row `v`, counted from the top.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, v: usize) -> &[f32] {
        &self.grey[v * self.width_px..(v + 1) * self.width_px]
    }

    #[cfg(test)]
    pub(super) fn mean(&self) -> f64 {
        self.grey.iter().map(|g| f64::from(*g)).sum::<f64>() / self.grey.len() as f64
    }
}

/// The part of the image in which lines are sought, with two level and two slanting sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trapezoid {
    /// Height of the top side in the image, pixels from the top.
    pub top_v_px: f64,
    /// Height of the bottom side in the image, pixels from the top.
    pub bottom_v_px: f64,
    /// Columns of the left and right end of the top side, pixels.
    pub top_u_px: [f64; 2],
    /// Columns of the left and right end of the bottom side, pixels.
    pub bottom_u_px: [f64; 2],
}

impl Trapezoid {
    /// The image region of the ground from `near_m` to `far_m` ahead and up to `half_width_m` to both sides.
    /// A roll angle tilts the sides of that rectangle's image; the trapezoid then takes the mean height of
    /// the corners.
    ///
    /// # Errors
    /// Returns an error if the camera fails [`Camera::validate`], a distance is out of range or out of order,
    /// or a corner cannot be seen.
    pub fn of_ground(
        camera: &Camera,
        near_m: f64,
        far_m: f64,
        half_width_m: f64,
    ) -> Result<Trapezoid, LaneError> {
        camera.validate()?;
        positive("the trapezoid's half width", half_width_m)?;
        if near_m.is_nan() || far_m.is_nan() || near_m >= far_m {
            return Err(LaneError::out_of_range(
                "the trapezoid's near side",
                near_m,
                "less than its far side",
            ));
        }
        let at = |x: f64, y: f64| camera.pixel_from_ground(DVec2::new(x, y));
        let (a, b) = (at(far_m, half_width_m)?, at(far_m, -half_width_m)?);
        let (c, d) = (at(near_m, half_width_m)?, at(near_m, -half_width_m)?);
        let t = Trapezoid {
            top_v_px: 0.5 * (a.y + b.y),
            bottom_v_px: 0.5 * (c.y + d.y),
            top_u_px: [a.x, b.x],
            bottom_u_px: [c.x, d.x],
        };
        t.validate()?;
        Ok(t)
    }

    /// Checks that the corners are finite and in order.
    ///
    /// # Errors
    /// Returns an error if a corner is non-finite or the corners are out of order.
    pub fn validate(&self) -> Result<(), LaneError> {
        let all = [
            self.top_v_px,
            self.bottom_v_px,
            self.top_u_px[0],
            self.top_u_px[1],
            self.bottom_u_px[0],
            self.bottom_u_px[1],
        ];
        if all.iter().any(|v| !v.is_finite()) {
            return Err(LaneError::not_finite("a corner of the trapezoid"));
        }
        let open = self.top_v_px < self.bottom_v_px
            && self.top_u_px[0] <= self.top_u_px[1]
            && self.bottom_u_px[0] < self.bottom_u_px[1];
        if open {
            Ok(())
        } else {
            Err(LaneError::undetermined("the trapezoid, because its corners are not in order"))
        }
    }

    /// Columns of the left and right side at row `v_px`. None where that row lies outside the trapezoid.
    pub fn row(&self, v_px: f64) -> Option<[f64; 2]> {
        let t = (v_px - self.top_v_px) / (self.bottom_v_px - self.top_v_px);
        let at = |i: usize| self.top_u_px[i] + t * (self.bottom_u_px[i] - self.top_u_px[i]);
        (0.0..=1.0).contains(&t).then(|| [at(0), at(1)])
    }

    /// Whether a pixel lies inside the trapezoid.
    pub fn contains(&self, pixel: DVec2) -> bool {
        self.row(pixel.y).is_some_and(|[l, r]| (l..=r).contains(&pixel.x))
    }
}

#[cfg(test)]
mod tests {
    use super::super::synth::{Draws, camera};
    use super::*;

    #[test]
    fn signs_and_closed_form() {
        let mut c = camera();
        (c.yaw_rad, c.pitch_rad, c.roll_rad) = (0.0, 0.0, 0.0);
        let p = c.pixel_from_ground(DVec2::new(c.position_m.x + 20.0, c.position_m.y + 2.0)).unwrap();
        // u = cu - f y / x, v = cv + f h / x.
        assert!((p.x - (c.centre_px.x - c.focal_px.x * 0.1)).abs() < 1e-9);
        assert!((p.y - (c.centre_px.y + c.focal_px.y * c.position_m.z / 20.0)).abs() < 1e-9);
        let far = DVec3::new(1e6, 0.0, c.position_m.z);
        c.pitch_rad = 0.05;
        assert!(c.pixel_from_point(far).unwrap().y < c.centre_px.y, "nose down lifts the horizon");
        (c.pitch_rad, c.yaw_rad) = (0.0, 0.05);
        assert!(
            c.pixel_from_point(far).unwrap().x > c.centre_px.x,
            "a camera turned left sees ahead on its right"
        );
        assert_eq!(
            c.ground_from_pixel(c.centre_px - DVec2::Y),
            Err(LaneError::refused("the pixel's ray does not meet the ground ahead"))
        );
        assert_eq!(
            c.pixel_from_ground(DVec2::new(-5.0, 0.0)),
            Err(LaneError::refused("the point is not in front of the camera"))
        );
    }

    #[test]
    fn there_and_back_for_any_pose() {
        let mut draws = Draws::new(1, 0);
        let mut seen = 0;
        for _ in 0..500 {
            let mut c = camera();
            (c.yaw_rad, c.pitch_rad, c.roll_rad) =
                (0.3 * draws.normal(), 0.1 * draws.normal(), 0.1 * draws.normal());
            let g = DVec2::new(4.0 + 50.0 * draws.uniform(), 8.0 * draws.normal());
            let Ok(p) = c.pixel_from_ground(g) else { continue };
            let back = c.ground_from_pixel(p).unwrap();
            assert!(back.distance(g) < 1e-8 * (1.0 + g.length_squared()), "{g} {back}");
            // The derivative against a difference quotient.
            for (e, d) in [DVec2::X, DVec2::Y].into_iter().zip(c.ground_at(&c.rotation(), p).unwrap().1) {
                let (a, b) =
                    (c.ground_from_pixel(p + e * 1e-4).unwrap(), c.ground_from_pixel(p - e * 1e-4).unwrap());
                assert!(((a - b) / 2e-4).distance(d) < 1e-4 * (1.0 + d.length()));
            }
            seen += 1;
        }
        assert!(seen > 450);
    }

    #[test]
    fn trapezoid_holds_its_ground() {
        let c = camera();
        let t = Trapezoid::of_ground(&c, 6.0, 40.0, 5.0).unwrap();
        for (x, y, inside) in
            [(20.0, 0.0, true), (20.0, 4.9, true), (20.0, -5.2, false), (5.0, 0.0, false), (42.0, 0.0, false)]
        {
            assert_eq!(t.contains(c.pixel_from_ground(DVec2::new(x, y)).unwrap()), inside, "{x} {y}");
        }
        assert!(
            Trapezoid::of_ground(&c, 40.0, 6.0, 5.0).is_err()
                && Trapezoid::of_ground(&c, -9.0, 6.0, 5.0).is_err()
        );
        assert!(!t.contains(DVec2::splat(f64::NAN)));
    }

    #[test]
    fn hostile_cameras_and_images() {
        assert!(Image::new(2, 2, vec![0.0; 3]).is_err() && Image::new(0, 2, vec![]).is_err());
        assert!(Image::new(usize::MAX, 2, vec![]).is_err());
        assert!(Image::new(1, 1, vec![f32::NAN]).is_err());
        for spoil in [
            (|c: &mut Camera| c.focal_px.x = 0.0) as fn(&mut Camera),
            |c| c.position_m.z = -1.0,
            |c| c.pitch_rad = f64::NAN,
            |c| c.width_px = 0,
            |c| c.centre_px.y = f64::INFINITY,
        ] {
            let mut c = camera();
            spoil(&mut c);
            assert!(c.validate().is_err() && Trapezoid::of_ground(&c, 6.0, 40.0, 5.0).is_err());
        }
        assert!(camera().ground_from_pixel(DVec2::splat(f64::NAN)).is_err());
        assert!(camera().pixel_from_ground(DVec2::splat(f64::INFINITY)).is_err());
    }
}
