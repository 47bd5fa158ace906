//! Plots: what a scan says of one object in the plane of the road, with standard deviations, from
//! points or from clusters of them (CONVENTIONS eq. 123).

use super::accuracy::PointStd;
use super::cluster::members;
use super::points::Point;
use crate::base::error::{BadInput, Result};
use glam::DVec2;

/// A measured place in the plane of the sensor's x and y axes, with independent errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plot {
    /// Ground range, along the plane.
    pub range_m: f64,
    /// Azimuth from the sensor's boresight, rad, positive to the left.
    pub azimuth_rad: f64,
    /// Rate of the ground range, positive when receding.
    pub range_rate_mps: f64,
    /// Standard deviation of the range, m.
    pub range_std_m: f64,
    /// Standard deviation of the azimuth, rad.
    pub azimuth_std_rad: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
    /// Points that it stands for.
    pub points: usize,
}

impl Plot {
    /// Makes a plot of a point at (range, azimuth, elevation) with its standard deviations: ρ = R cos e and, for bodies
    /// that move in the plane, ρ̇ = Ṙ/cos e. The error of elevation is left out: it changes ρ by R sin e σ_e.
    pub fn of_point(
        [range_m, range_rate_mps, azimuth_rad, elevation_rad]: [f64; 4],
        [range_std_m, range_rate_std_mps, azimuth_std_rad]: [f64; 3],
    ) -> Plot {
        let c = elevation_rad.cos();
        Plot {
            range_m: range_m * c,
            azimuth_rad,
            range_rate_mps: range_rate_mps / c,
            range_std_m: range_std_m * c,
            azimuth_std_rad,
            range_rate_std_mps: range_rate_std_mps / c,
            points: 1,
        }
    }

    /// Makes a plot of a point of the cloud with its standard deviations; None when the array cannot tell azimuths or
    /// the result is no plot ([`Self::check`]).
    pub fn of(point: &Point, std: &PointStd) -> Option<Plot> {
        let plot = Plot::of_point(
            [point.range_m, point.range_rate_mps, point.azimuth_rad, point.elevation_rad],
            [std.range_m, std.range_rate_mps, std.azimuth_rad?],
        );
        plot.check(0).is_ok().then_some(plot)
    }

    /// Place of the plot in the sensor's plane, m.
    pub fn position_m(&self) -> DVec2 {
        self.range_m * DVec2::from_angle(self.azimuth_rad)
    }

    /// Checks plot number `index`.
    ///
    /// # Errors
    /// Returns an error for a value that is not finite or beyond 10⁹, a range or a standard deviation below 10⁻⁹.
    pub fn check(&self, index: usize) -> Result<()> {
        let positive = [
            ("range_m", self.range_m),
            ("range_std_m", self.range_std_m),
            ("azimuth_std_rad", self.azimuth_std_rad),
            ("range_rate_std_mps", self.range_rate_std_mps),
        ];
        let any = [("azimuth_rad", self.azimuth_rad), ("range_rate_mps", self.range_rate_mps)];
        let wrong = positive
            .into_iter()
            .find(|(_, v)| !(1e-9..=1e9).contains(v))
            .map(|w| (w, "1e-9 to 1e9"))
            .or_else(|| any.into_iter().find(|(_, v)| !(-1e9..=1e9).contains(v)).map(|w| (w, "-1e9 to 1e9")));
        match wrong {
            None => Ok(()),
            Some(((key, value), allowed)) => Err(BadInput::new("the plot has a value that is out of range")
                .key(format!("plot {index}: {key}"))
                .value(value)
                .allowed(allowed)
                .remedy("leave out points without a value")
                .into()),
        }
    }

    /// One plot for several of the same body, None for none: the centre of their places, the mean of
    /// their range rates. Variance of each coordinate: Σσ²/n² + s²/n with s² their sample variance, since
    /// the parts of a body that echo change from scan to scan (eq. 123).
    pub fn of_members(plots: &[Plot]) -> Option<Plot> {
        let n = plots.len() as f64;
        let first = plots.first()?;
        let mean = |f: &dyn Fn(&Plot) -> f64| plots.iter().map(f).sum::<f64>() / n;
        let centre = plots.iter().map(Plot::position_m).sum::<DVec2>() / n;
        let (range_m, azimuth_rad) = (centre.length(), centre.to_angle());
        // Azimuths as turned from the centre's: no jump at ±π.
        let off = |p: &Plot| DVec2::from_angle(p.azimuth_rad - azimuth_rad).to_angle();
        let deviation = |value: &dyn Fn(&Plot) -> f64, std: &dyn Fn(&Plot) -> f64| {
            let (m, own) = (mean(value), mean(&|p| std(p).powi(2)));
            let spread =
                if plots.len() > 1 { mean(&|p| (value(p) - m).powi(2)) * n / (n - 1.0) } else { 0.0 };
            ((own + spread) / n).sqrt()
        };
        if plots.len() == 1 {
            return Some(*first);
        }
        Some(Plot {
            range_m,
            azimuth_rad,
            range_rate_mps: mean(&|p| p.range_rate_mps),
            range_std_m: deviation(&|p| p.range_m, &|p| p.range_std_m),
            azimuth_std_rad: deviation(&off, &|p| p.azimuth_std_rad),
            range_rate_std_mps: deviation(&|p| p.range_rate_mps, &|p| p.range_rate_std_mps),
            points: plots.iter().map(|p| p.points).sum(),
        })
    }
}

/// One plot for each cluster of [`super::cluster::Dbscan::labels`], in their order; noise is left out.
pub fn plots_of_clusters(plots: &[Plot], labels: &[Option<usize>]) -> Vec<Plot> {
    members(labels)
        .iter()
        .filter_map(|m| Plot::of_members(&m.iter().map(|i| plots[*i]).collect::<Vec<_>>()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn plot(range_m: f64, azimuth_rad: f64, range_rate_mps: f64) -> Plot {
        Plot::of_point([range_m, range_rate_mps, azimuth_rad, 0.0], [0.1, 0.2, 0.01])
    }

    #[test]
    fn planar_motion_keeps_its_rate() {
        // A body at (30, 0, 4) that moves along x at 5 m/s.
        let (range, e) = (30f64.hypot(4.0), (4.0f64 / 30.0).atan());
        let p = Plot::of_point([range, 5.0 * e.cos(), 0.0, e], [0.1, 0.1, 0.01]);
        assert!((p.range_m - 30.0).abs() < 1e-12 && (p.range_rate_mps - 5.0).abs() < 1e-12);
    }

    #[test]
    fn members_become_one() {
        assert_eq!(Plot::of_members(&[]), None);
        let one = plot(10.0, 0.2, 1.0);
        assert_eq!(Plot::of_members(&[one]), Some(one));
        // Behind the sensor, on both sides of ±π.
        let p = Plot::of_members(&[plot(10.0, PI - 0.1, 1.0), plot(10.0, 0.1 - PI, 3.0)]).unwrap();
        assert!((p.azimuth_rad.abs() - PI).abs() < 1e-12, "{p:?}");
        assert!((p.range_m - 10.0 * 0.1f64.cos()).abs() < 1e-12);
        assert!((p.range_rate_mps - 2.0).abs() < 1e-12);
        // s² = 2, own variance 0.04: √((0.04 + 2)/2).
        assert!((p.range_rate_std_mps - 1.02f64.sqrt()).abs() < 1e-12);
        assert!((p.azimuth_std_rad - ((1e-4 + 0.02) / 2.0f64).sqrt()).abs() < 1e-12);
        assert_eq!(p.points, 2);
        let all = [plot(10.0, 0.0, 0.0), plot(50.0, 0.0, 0.0), plot(10.2, 0.0, 0.0)];
        let made = plots_of_clusters(&all, &[Some(0), None, Some(0)]);
        assert_eq!(made.len(), 1);
        assert!((made[0].range_m - 10.1).abs() < 1e-12);
    }

    #[test]
    fn points_become_plots_where_they_can() {
        let mut point = Point {
            range_m: 30.0,
            range_rate_mps: -2.0,
            azimuth_rad: 0.3,
            elevation_rad: 0.0,
            position_m: glam::DVec3::ZERO,
            power_dbm: -80.0,
            snr_db: 20.0,
            rcs_dbsm: 0.0,
            object_id: 0,
            class: String::new(),
            bounces: 0,
            ghost: false,
            side_lobe: false,
            folded: false,
            aliased: false,
            share: 0.0,
            angle_ambiguity: None,
            other_angles_rad: vec![],
            at_search_edge: false,
            others_std_rad: [0.0; 2],
            cell: None,
            std: PointStd::default(),
            beat_std_cells: 0.0,
            ambiguity: crate::detect::ambiguity::Ambiguity::Unresolved,
            modulo_mps: f64::INFINITY,
        };
        let std =
            |azimuth_rad| PointStd { range_m: 0.1, range_rate_mps: 0.2, azimuth_rad, elevation_rad: None };
        assert_eq!(Plot::of(&point, &std(Some(0.01))), Some(plot(30.0, 0.3, -2.0)));
        assert_eq!(Plot::of(&point, &std(None)), None);
        point.range_m = -0.02;
        assert_eq!(Plot::of(&point, &std(Some(0.01))), None);
    }

    #[test]
    fn bad_plots_are_named() {
        let e = plot(f64::NAN, 0.0, 0.0).check(3).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert!(e.to_string().starts_with("plot 3: range_m = NaN: "), "{e}");
        assert!(plot(1.0, f64::INFINITY, 0.0).check(0).is_err());
        assert!(Plot { azimuth_std_rad: 0.0, ..plot(1.0, 0.0, 0.0) }.check(0).is_err());
        assert!(plot(1.0, 0.0, 0.0).check(0).is_ok());
    }
}
