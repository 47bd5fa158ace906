//! Takes the numbers of a study that are compared with a document's statements.

use super::outcome::Outcome;
use super::parameter::Value;
use super::spec::{Fact, FactKind, StudySweep};
use catseye::base::error::BadInput;

impl Fact {
    /// Checks whether the fact is meaningful for a study with `axes` axes.
    ///
    /// # Errors
    /// Returns an error if too many or too few axes are chosen, if a level is missing, or if `at` and `minus`
    /// choose different axes.
    pub fn check(&self, axes: usize) -> Result<(), BadInput> {
        let left = axes - self.at.len();
        match self.kind {
            FactKind::Value if left > 0 => {
                Err(BadInput::new(format!("a value needs a single point, and {left} axes are not fixed"))
                    .remedy("give a value for each axis in at"))
            }
            FactKind::Location | FactKind::Width | FactKind::Crossing | FactKind::FirstCrossing
                if left != 1 =>
            {
                Err(BadInput::new(format!("needs exactly one free axis, and {left} are not fixed"))
                    .remedy("give a value for each other axis in at"))
            }
            FactKind::Width | FactKind::Crossing | FactKind::FirstCrossing | FactKind::Share
                if self.level.is_none() =>
            {
                Err(BadInput::new("needs a level").remedy("give level"))
            }
            _ if !self.minus.is_empty() && self.minus.len() != self.at.len() => {
                Err(BadInput::new("at and minus name different axes").remedy("give both the same axes"))
            }
            _ => Ok(()),
        }
    }

    /// This study's number for the fact; NaN where there is none (nothing crosses, no point in the window).
    pub fn ours(&self, outcome: &Outcome) -> f64 {
        let at = self.taken(outcome, &self.at);
        if self.minus.is_empty() { at } else { at - self.taken(outcome, &self.minus) }
    }

    fn taken(&self, outcome: &Outcome, at: &[(usize, Value)]) -> f64 {
        let (x, y) = self.chosen(outcome, at);
        let level = self.level.unwrap_or(f64::NAN);
        let Some(best) = (0..y.len()).filter(|&i| !y[i].is_nan()).max_by(|&a, &b| y[a].total_cmp(&y[b]))
        else {
            return f64::NAN;
        };
        let finite = || y.iter().copied().filter(|v| !v.is_nan());
        match self.kind {
            FactKind::Value | FactKind::Maximum => y[best],
            FactKind::Minimum => finite().fold(f64::INFINITY, f64::min),
            FactKind::Mean => finite().sum::<f64>() / finite().count() as f64,
            FactKind::Median => {
                let mut v: Vec<f64> = finite().collect();
                v.sort_by(f64::total_cmp);
                let n = v.len();
                0.5 * (v[(n - 1) / 2] + v[n / 2])
            }
            FactKind::Spread => y[best] - finite().fold(f64::INFINITY, f64::min),
            FactKind::Location => x.get(best).copied().unwrap_or(f64::NAN),
            FactKind::Width => {
                let limit = y[best] - level;
                let side = |order: &mut dyn Iterator<Item = usize>| -> f64 {
                    let mut last = best;
                    for i in order {
                        if y[i] < limit {
                            return x[last] + (x[i] - x[last]) * (y[last] - limit) / (y[last] - y[i]);
                        }
                        last = i;
                    }
                    x[last]
                };
                (side(&mut (best + 1..y.len())) - side(&mut (0..best).rev())).abs()
            }
            FactKind::Crossing | FactKind::FirstCrossing => {
                let pairs = y.windows(2).enumerate().filter(|(_, w)| (w[0] >= level) != (w[1] >= level));
                let mut all = pairs.map(|(i, w)| x[i] + (x[i + 1] - x[i]) * (level - w[0]) / (w[1] - w[0]));
                let found = match self.kind {
                    FactKind::Crossing => all.next_back(),
                    _ => all.next(),
                };
                found.unwrap_or(f64::NAN)
            }
            FactKind::Share => {
                100.0 * finite().filter(|v| *v >= level).count() as f64 / finite().count() as f64
            }
        }
    }

    /// The places along the last remaining axis, and the values of all chosen points.
    fn chosen(&self, outcome: &Outcome, at: &[(usize, Value)]) -> (Vec<f64>, Vec<f64>) {
        let mut shape = outcome.shape();
        let mut y = outcome.fields[self.quantity].values.clone();
        let mut places: Vec<Vec<f64>> = outcome.axes.iter().map(StudySweep::places).collect();
        let mut keep: Vec<Vec<usize>> = shape.iter().map(|n| (0..*n).collect()).collect();
        for (axis, [lo, hi]) in &self.within {
            keep[*axis].retain(|&i| (*lo..=*hi).contains(&places[*axis][i]));
        }
        for axis in (0..shape.len()).rev() {
            let n = shape[axis];
            let inner: usize = shape[axis + 1..].iter().product();
            let outer = y.len() / (n * inner).max(1);
            let weights: Vec<Vec<(usize, f64)>> = match at.iter().find(|(a, _)| *a == axis) {
                Some((_, value)) => vec![weights(outcome, axis, value)],
                None => keep[axis].iter().map(|&i| vec![(i, 1.0)]).collect(),
            };
            let mut out = Vec::with_capacity(outer * weights.len() * inner);
            for o in 0..outer {
                for w in &weights {
                    for k in 0..inner {
                        out.push(w.iter().map(|(i, f)| f * y[(o * n + i) * inner + k]).sum());
                    }
                }
            }
            y = out;
            shape[axis] = weights.len();
            places[axis] = keep[axis].iter().map(|&i| places[axis][i]).collect();
        }
        let left = (0..outcome.axes.len()).rev().find(|a| !at.iter().any(|(b, _)| a == b));
        (left.map_or(Vec::new(), |a| places[a].clone()), y)
    }
}

/// Entries of an axis, with weights, that interpolate the place `value`.
fn weights(outcome: &Outcome, axis: usize, value: &Value) -> Vec<(usize, f64)> {
    let a = &outcome.axes[axis];
    if let Some(i) = a.names.iter().position(|n| *n == value.to_string()) {
        return vec![(i, 1.0)];
    }
    let (Value::Number(x), Some(v)) = (value, a.numbers()) else { return vec![(0, f64::NAN)] };
    // The axis may run either way.
    if let Some(i) = v.iter().position(|v| (v - x).abs() <= 1e-9 * x.abs().max(1e-3)) {
        return vec![(i, 1.0)];
    }
    for i in 1..v.len() {
        if (v[i - 1] - x) * (v[i] - x) < 0.0 {
            let t = (x - v[i - 1]) / (v[i] - v[i - 1]);
            return vec![(i - 1, 1.0 - t), (i, t)];
        }
    }
    vec![(0, f64::NAN)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::outcome::Field;

    fn outcome() -> Outcome {
        let axis = |name: &str, v: &[f64], names: &[&str]| StudySweep {
            parameter: name.into(),
            label: name.into(),
            values: v.iter().map(|x| Value::Number(*x)).collect(),
            names: names.iter().map(|n| n.to_string()).collect(),
            reduce: None,
        };
        Outcome {
            axes: vec![
                axis("x", &[0.0, 1.0, 2.0, 3.0, 4.0], &["0", "1", "2", "3", "4"]),
                axis("y", &[1.0, 2.0], &["low", "high"]),
            ],
            // y = low: 0 4 10 4 0; y = high: -8 -4 -2 -4 -8.
            fields: vec![Field {
                name: "rcs_dbsm".into(),
                label: String::new(),
                values: vec![0.0, -8.0, 4.0, -4.0, 10.0, -2.0, 4.0, -4.0, 0.0, -8.0],
            }],
            solved: 0,
            remarks: vec![],
            targets: vec![],
        }
    }

    fn fact(kind: FactKind, at: &[(usize, Value)], level: Option<f64>) -> Fact {
        Fact {
            text: String::new(),
            document: None,
            unit: String::new(),
            kind,
            quantity: 0,
            at: at.to_vec(),
            minus: vec![],
            within: vec![],
            level,
            why: String::new(),
        }
    }

    #[test]
    fn numbers_from_a_table() {
        let o = outcome();
        let low = (1, Value::Word("low".into()));
        let high = (1, Value::Number(2.0));
        let ours = |f: Fact| f.ours(&o);
        let at = |x: f64, y: &(usize, Value)| vec![(0, Value::Number(x)), y.clone()];
        assert_eq!(ours(fact(FactKind::Value, &at(1.0, &low), None)), 4.0);
        assert_eq!(ours(fact(FactKind::Value, &at(1.5, &low), None)), 7.0);
        assert_eq!(ours(fact(FactKind::Value, &at(2.0, &(1, Value::Number(1.5))), None)), 4.0);
        assert_eq!(ours(fact(FactKind::Maximum, &[], None)), 10.0);
        assert_eq!(ours(fact(FactKind::Minimum, std::slice::from_ref(&high), None)), -8.0);
        assert_eq!(ours(fact(FactKind::Mean, std::slice::from_ref(&low), None)), 3.6);
        assert_eq!(ours(fact(FactKind::Median, std::slice::from_ref(&low), None)), 4.0);
        assert_eq!(ours(fact(FactKind::Spread, std::slice::from_ref(&low), None)), 10.0);
        assert_eq!(ours(fact(FactKind::Location, std::slice::from_ref(&low), None)), 2.0);
        // 3 dB below 10 is 7, half way to the neighbours on both sides.
        assert_eq!(ours(fact(FactKind::Width, std::slice::from_ref(&low), Some(3.0))), 1.0);
        assert_eq!(ours(fact(FactKind::Crossing, std::slice::from_ref(&low), Some(2.0))), 3.5);
        assert_eq!(ours(fact(FactKind::FirstCrossing, std::slice::from_ref(&low), Some(2.0))), 0.5);
        assert!(ours(fact(FactKind::Crossing, std::slice::from_ref(&low), Some(20.0))).is_nan());
        assert_eq!(ours(fact(FactKind::Share, &[], Some(0.0))), 50.0);
        let mut f = fact(FactKind::Maximum, std::slice::from_ref(&low), None);
        f.minus = vec![high.clone()];
        assert_eq!(ours(f), 12.0);
        let mut f = fact(FactKind::Maximum, std::slice::from_ref(&low), None);
        f.within = vec![(0, [2.5, 4.0])];
        assert_eq!(ours(f), 4.0);
        let mut f = fact(FactKind::Location, std::slice::from_ref(&high), None);
        f.within = vec![(0, [2.5, 4.0])];
        assert_eq!(ours(f), 3.0);
    }

    #[test]
    fn senseless_facts_are_refused() {
        assert!(fact(FactKind::Value, &[], None).check(1).is_err());
        assert!(fact(FactKind::Width, &[], None).check(1).is_err());
        assert!(fact(FactKind::Location, &[], None).check(2).is_err());
        assert!(fact(FactKind::Share, &[], Some(1.0)).check(2).is_ok());
    }
}
