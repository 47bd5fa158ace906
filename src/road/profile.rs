//! A quantity along a road as a chain of cubics: heights, cross slopes, widths of lanes, lateral offsets.

use crate::base::error::{BadInput, Result};

/// A chain of cubics along the road: value(s) = c0 + c1 u + c2 u² + c3 u³ with u = s - s0 of the last piece that begins
/// at or before s; the first piece serves before its beginning only with its first value.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    pieces: Vec<Piece>,
}

/// One cubic of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it begins, m.
    pub s0_m: f64,
    /// Coefficients of rising powers of the distance from there.
    pub coefficients: [f64; 4],
}

impl Profile {
    /// A profile of one value.
    pub fn constant(value: f64) -> Profile {
        Profile { pieces: vec![Piece { s0_m: 0.0, coefficients: [value, 0.0, 0.0, 0.0] }] }
    }

    /// A profile that is straight between the points (s, value), constant before the first and after the last. Two
    /// points at one s are a step.
    ///
    /// # Errors
    /// Returns an error if there is no point, s falls, or a number is not finite.
    ///
    /// # Example
    /// A lane that widens from 3.5 m to 7 m between 100 m and 150 m.
    ///
    /// ```
    /// use catseye::road::profile::Profile;
    ///
    /// let width_m = Profile::linear(&[[100.0, 3.5], [150.0, 7.0]])?;
    /// assert_eq!([0.0, 125.0, 400.0].map(|s_m| width_m.value(s_m)), [3.5, 5.25, 7.0]);
    /// assert!((width_m.slope(125.0) - 0.07).abs() < 1e-12);
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn linear(points: &[[f64; 2]]) -> Result<Profile> {
        if points.is_empty() || points.iter().flatten().any(|x| !x.is_finite()) {
            return Err(BadInput::new("needs at least one pair of finite numbers [s, value]").into());
        }
        let mut pieces = Vec::with_capacity(points.len());
        for (i, p) in points.iter().enumerate() {
            let slope = match points.get(i + 1) {
                Some(q) if q[0] > p[0] => (q[1] - p[1]) / (q[0] - p[0]),
                Some(q) if q[0] < p[0] => {
                    return Err(BadInput::new("runs backwards")
                        .value(format!("[{}, {}] after [{}, {}]", q[0], q[1], p[0], p[1]))
                        .remedy("list the pairs [s, value] with s growing")
                        .into());
                }
                _ => 0.0,
            };
            pieces.push(Piece { s0_m: p[0], coefficients: [p[1], slope, 0.0, 0.0] });
        }
        Ok(Profile { pieces })
    }

    /// A chain of cubics in the order of their beginnings.
    ///
    /// # Errors
    /// Returns an error if there are no cubics, a cubic begins before the one ahead of it, or a number is not finite.
    pub fn cubics(pieces: Vec<Piece>) -> Result<Profile> {
        let finite = |p: &Piece| p.s0_m.is_finite() && p.coefficients.iter().all(|c| c.is_finite());
        if pieces.is_empty() || !pieces.iter().all(finite) {
            return Err(BadInput::new("a chain of cubics needs finite numbers").into());
        }
        if let Some(w) = pieces.windows(2).find(|w| w[1].s0_m < w[0].s0_m) {
            return Err(BadInput::new("the positions of a chain of cubics do not ascend")
                .value(w[1].s0_m)
                .into());
        }
        Ok(Profile { pieces })
    }

    fn piece(&self, s_m: f64) -> (&Piece, f64) {
        let i = self.pieces.partition_point(|p| p.s0_m <= s_m);
        let piece = &self.pieces[i.saturating_sub(1)];
        (piece, (s_m - piece.s0_m).max(0.0))
    }

    /// The value at a place, m along the road.
    pub fn value(&self, s_m: f64) -> f64 {
        let (p, u) = self.piece(s_m);
        let [a, b, c, d] = p.coefficients;
        a + u * (b + u * (c + u * d))
    }

    /// First derivative at a place, to the right of a break.
    pub fn slope(&self, s_m: f64) -> f64 {
        let (p, u) = self.piece(s_m);
        let [_, b, c, d] = p.coefficients;
        if s_m < self.pieces[0].s0_m { 0.0 } else { b + u * (2.0 * c + 3.0 * u * d) }
    }

    /// The greatest amount of the second derivative between two places of one piece.
    pub fn bend(&self, from_m: f64, to_m: f64) -> f64 {
        let (p, u) = self.piece(0.5 * (from_m + to_m));
        let half = 0.5 * (to_m - from_m);
        let [_, _, c, d] = p.coefficients;
        let at = |u: f64| (2.0 * c + 6.0 * d * u).abs();
        at(u - half).max(at(u + half))
    }

    /// The coefficients of the cubic that holds just behind a place, counted from there.
    pub fn from_here(&self, s_m: f64) -> [f64; 4] {
        let (p, u) = self.piece(s_m);
        let [a, b, c, d] = p.coefficients;
        if s_m < p.s0_m {
            return [a, 0.0, 0.0, 0.0];
        }
        [a + u * (b + u * (c + u * d)), b + u * (2.0 * c + 3.0 * u * d), c + 3.0 * u * d, d]
    }

    /// This profile plus `factor` times another.
    pub fn plus(&self, other: &Profile, factor: f64) -> Profile {
        let mut breaks: Vec<f64> = self.breaks_m().chain(other.breaks_m()).collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        let sum = |s0_m: f64| {
            let (a, b) = (self.from_here(s0_m), other.from_here(s0_m));
            Piece { s0_m, coefficients: std::array::from_fn(|k| a[k] + factor * b[k]) }
        };
        Profile { pieces: breaks.into_iter().map(sum).collect() }
    }

    /// Checks that amounts and slopes stay below their limits.
    ///
    /// # Errors
    /// Returns an error for an amount over `most` or a slope over `steepest` somewhere in 0..=`end_m`. Who divides a
    /// road by its bends needs a number of steps that grows with them.
    pub fn check_gentle(&self, end_m: f64, most: f64, steepest: f64) -> Result<()> {
        for (i, p) in self.pieces.iter().enumerate() {
            let next_m = self.pieces.get(i + 1).map_or(end_m, |n| n.s0_m.min(end_m));
            let (from, to) = ((-p.s0_m).max(0.0), next_m - p.s0_m);
            if from > to {
                continue;
            }
            let [a, b, c, d] = p.coefficients;
            // A slope is greatest at the ends or where it turns.
            let turn = (-c / (3.0 * d)).clamp(from, to);
            for u in [from, to, if turn.is_nan() { from } else { turn }] {
                let (value, slope) = (a + u * (b + u * (c + u * d)), b + u * (2.0 * c + 3.0 * u * d));
                for (what, x, limit) in
                    [("the value is too large", value, most), ("the slope is too steep", slope, steepest)]
                {
                    if x.is_nan() || x.abs() > limit {
                        return Err(BadInput::new(what)
                            .value(format!("{x:.3e} at s = {:.3} m", p.s0_m + u))
                            .allowed(format!("up to {limit}"))
                            .into());
                    }
                }
            }
        }
        Ok(())
    }

    /// The places where pieces begin.
    pub fn breaks_m(&self) -> impl Iterator<Item = f64> + '_ {
        self.pieces.iter().map(|p| p.s0_m)
    }

    /// Whether the value is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.pieces
            .iter()
            .all(|p| p.coefficients[1..] == [0.0; 3] && p.coefficients[0] == self.pieces[0].coefficients[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_between_points_and_constant_beyond() {
        let p = Profile::linear(&[[10.0, 0.0], [20.0, 3.5], [50.0, 3.5], [50.0, 1.0]]).unwrap();
        let got: Vec<f64> = [0.0, 10.0, 15.0, 20.0, 49.0, 50.0, 90.0].map(|s| p.value(s)).to_vec();
        assert_eq!(got, [0.0, 0.0, 1.75, 3.5, 3.5, 1.0, 1.0]);
        assert_eq!((p.slope(0.0), p.slope(12.0), p.slope(60.0)), (0.0, 0.35, 0.0));
        assert!(Profile::linear(&[]).is_err() && Profile::linear(&[[1.0, f64::NAN]]).is_err());
        let e = Profile::linear(&[[5.0, 0.0], [4.0, 0.0]]).unwrap_err().to_string();
        assert!(e.contains("runs backwards"), "{e}");
    }

    #[test]
    fn cubics_are_their_polynomials() {
        let piece = |s0_m, coefficients| Piece { s0_m, coefficients };
        let p = Profile::cubics(vec![piece(0.0, [1.0, 0.5, 0.25, 0.125]), piece(2.0, [7.0, 0.0, 0.0, 0.0])])
            .unwrap();
        assert_eq!(p.value(1.0), 1.875);
        assert_eq!(p.slope(1.0), 0.5 + 0.5 + 0.375);
        assert_eq!(p.value(2.0), 7.0);
        // The second derivative 0.5 + 0.75 u.
        assert!((p.bend(0.5, 1.5) - 1.625).abs() < 1e-15);
        assert!(!p.is_constant() && Profile::constant(3.0).is_constant());
    }

    #[test]
    fn sums_are_the_sums_of_the_values() {
        let piece = |s0_m, coefficients| Piece { s0_m, coefficients };
        let p = Profile::cubics(vec![piece(0.0, [1.0, 0.5, 0.25, 0.125]), piece(2.0, [7.0, 0.0, 0.0, 0.0])])
            .unwrap();
        let q = Profile::cubics(vec![piece(1.0, [0.5, -1.0, 0.0, 0.25]), piece(3.0, [0.0, 2.0, 0.0, 0.0])])
            .unwrap();
        let sum = p.plus(&q, -2.0);
        for s in [-1.0, 0.0, 0.7, 1.0, 1.9, 2.0, 2.6, 3.0, 9.0] {
            assert!((sum.value(s) - (p.value(s) - 2.0 * q.value(s))).abs() < 1e-12, "{s}");
        }
    }
}
