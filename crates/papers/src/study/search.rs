//! Design search: the best parameters of a reflector for each value of a cost parameter.
//!
//! The front of cost against worth is found by the epsilon-constraint method (Haimes, Lasdon and Wismer
//! 1971): the cost is fixed at each of its values, and the other parameters are sought by the simplex of
//! Nelder and Mead (1965) from several starts, because a cross section has many local maxima. Points that
//! another one beats in both are not on the front. The same seed gives the same numbers.

use super::outcome::{Work, detection_range, lines_along};
use super::parameter::{Value, Values, rounded_to};
use super::spec::{Goal, LimitTable, Quantity, SearchTable, Study};
use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;
use argmin_math::{ArgminAdd, ArgminMul, ArgminSub};
use catseye::base::error::{Error, Result};
use catseye::base::rng::philox4x32_10;
use catseye::engine::solver::Solver;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;

/// The best design for one value of the cost parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Design {
    /// Value of the cost parameter.
    pub cost: f64,
    /// Values of the sought parameters, in the order of the search's limits.
    pub parameters: Vec<f64>,
    /// Value of the goal.
    pub worth: f64,
    /// Number of designs tried.
    pub tried: u64,
    /// Limits of physical optics for this design, in words.
    #[serde(default)]
    pub remarks: Vec<String>,
    /// Parameters that end at a limit of their range, in words.
    #[serde(default)]
    pub limits: Vec<String>,
}

impl Design {
    /// Whether no other design costs no more and is worth more, or costs less and is worth as much.
    pub fn is_on_front(&self, all: &[Design]) -> bool {
        self.worth.is_finite()
            && !all.iter().any(|o| {
                o.cost <= self.cost && o.worth >= self.worth && (o.cost < self.cost || o.worth > self.worth)
            })
    }
}

/// The goal, and a smooth value that leads to it.
#[derive(Debug, Clone, Copy)]
struct Score {
    worth: f64,
    guide: f64,
}

/// A least value is looked for between samples so many times, in so many steps along each axis.
const REFINED_TIMES: usize = 2;
const REFINED_STEPS: usize = 8;

/// Best result of a search so far.
#[derive(Debug, Default)]
struct BestSoFar {
    best: Option<(Vec<f64>, Score)>,
    tried: u64,
}

/// The studies of the designs with the lowest and with the highest parameters of a search, for each value of its front; a study
/// without a search as it is.
pub fn designs_at_limits(study: &Study) -> Vec<Study> {
    let Some(search) = &study.search else { return vec![study.clone()] };
    let design = |cost: f64, end: &dyn Fn(&LimitTable) -> f64| {
        let mut fixed = study.fixed.clone();
        fixed.insert(search.front.value.clone(), Value::Number(cost));
        fixed.extend(search.parameter.iter().map(|l| (l.name.value.clone(), Value::Number(end(l)))));
        Study { fixed, ..study.clone() }
    };
    let costs = search.front_values.value.iter();
    costs.flat_map(|&c| [design(c, &|l| l.min.value), design(c, &|l| l.max.value)]).collect()
}

struct Problem<'a> {
    solver: &'a dyn Solver,
    study: &'a Study,
    search: &'a SearchTable,
    cost: f64,
    found: RefCell<BestSoFar>,
    /// The first real failure; the optimiser has its own error type.
    failed: RefCell<Option<Error>>,
}

impl Problem<'_> {
    /// Parameters for a point of the unit cube; points outside are mirrored back into it.
    fn parameters(&self, unit: &[f64]) -> Vec<f64> {
        unit.iter()
            .zip(&self.search.parameter)
            .map(|(u, l)| {
                let folded = u.rem_euclid(2.0);
                let inside = if folded > 1.0 { 2.0 - folded } else { folded };
                let width = l.max.value - l.min.value;
                // A power of ten between a millionth and a hundred-thousandth of the interval: finer than any workshop, and
                // tables hold the very design that was tried.
                let grain = (1e-6 * width).log10().ceil() as i32;
                rounded_to(l.min.value + width * inside, grain).clamp(l.min.value, l.max.value)
            })
            .collect()
    }

    /// The study of one design.
    fn study(&self, parameters: &[f64]) -> Study {
        let mut fixed: Values = self.study.fixed.clone();
        fixed.insert(self.search.front.value.clone(), Value::Number(self.cost));
        for (l, x) in self.search.parameter.iter().zip(parameters) {
            fixed.insert(l.name.value.clone(), Value::Number(*x));
        }
        Study { fixed, ..self.study.clone() }
    }

    /// The parameters that end at a limit: within a hundredth of the interval.
    fn limits(&self, parameters: &[f64]) -> Vec<String> {
        let at = |l: &LimitTable, x: f64| {
            let near = 1e-2 * (l.max.value - l.min.value);
            let (side, way) = match x {
                x if x - l.min.value <= near => ("least", "smaller"),
                x if l.max.value - x <= near => ("largest", "larger"),
                _ => return None,
            };
            let name = &l.name.value;
            Some(format!(
                "the search ends at {name} = {x}, the {side} value of its range; a {way} one may be better"
            ))
        };
        self.search.parameter.iter().zip(parameters).filter_map(|(l, x)| at(l, *x)).collect()
    }

    /// A quantity at every point of a study's sweeps.
    fn field(&self, study: &Study, quantity: Quantity) -> Result<Vec<f64>> {
        let mut work = Work::collect(study, study.points(), &|i| study.values_at(i))?;
        Ok(work.fields(self.solver, study, &[quantity], None, &|_, _| {})?.remove(0))
    }

    /// The least value of a quantity in the window, whose values at the sweeps' points are `field`: about the least of them, between
    /// its neighbours on each axis of numbers in turn. A null is narrower than the steps of a sweep.
    fn least_between(&self, study: &Study, quantity: Quantity, field: &[f64]) -> Result<f64> {
        let Some((at, mut least)) = field.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
        else {
            return Ok(f64::INFINITY);
        };
        let mut here = study.clone();
        let mut rest = at;
        for s in here.sweeps.iter_mut().rev() {
            let n = s.values.len();
            s.values = vec![s.values[rest % n].clone()];
            rest /= n;
        }
        // Between which values of each axis it lies.
        let mut spans: Vec<Option<[f64; 2]>> = study
            .sweeps
            .iter()
            .zip(&here.sweeps)
            .map(|(all, one)| {
                let middle = one.values[0].number()?;
                let numbers: Vec<f64> = all.values.iter().filter_map(Value::number).collect();
                let below = numbers.iter().copied().filter(|x| *x < middle).fold(f64::NEG_INFINITY, f64::max);
                let above = numbers.iter().copied().filter(|x| *x > middle).fold(f64::INFINITY, f64::min);
                let span = [below, above].map(|x| if x.is_finite() { x } else { middle });
                (numbers.len() == all.values.len() && span[0] < span[1]).then_some(span)
            })
            .collect();
        for _ in 0..REFINED_TIMES {
            for (axis, span) in spans.iter_mut().enumerate() {
                let Some([from, to]) = *span else { continue };
                let step = (to - from) / REFINED_STEPS as f64;
                let values: Vec<f64> = (0..=REFINED_STEPS).map(|i| from + step * i as f64).collect();
                let middle = here.sweeps[axis].values.clone();
                here.sweeps[axis].values = values.iter().map(|x| Value::Number(*x)).collect();
                let found = self.field(&here, quantity)?;
                here.sweeps[axis].values = middle;
                let best = (0..found.len()).min_by(|a, b| found[*a].total_cmp(&found[*b]));
                let Some(best) = best.filter(|i| found[*i] <= least) else { continue };
                least = found[best];
                here.sweeps[axis].values = vec![Value::Number(values[best])];
                *span = Some([values[best.saturating_sub(1)], values[(best + 1).min(REFINED_STEPS)]]);
            }
        }
        Ok(least)
    }

    fn score(&self, parameters: &[f64]) -> Result<Score> {
        let study = self.study(parameters);
        let quantity = match self.search.goal {
            Goal::LeastRcs => Quantity::Rcs,
            _ => Quantity::Margin,
        };
        let field = self.field(&study, quantity)?;
        Ok(match self.search.goal {
            Goal::LeastRcs | Goal::LeastMargin => {
                let least = self.least_between(&study, quantity, &field)?;
                Score { worth: least, guide: least }
            }
            Goal::Coverage => {
                let n = field.len() as f64;
                let worth = 100.0 * field.iter().filter(|m| **m >= 0.0).count() as f64 / n;
                // What is missing, so that designs with equal coverage differ.
                let missing = field.iter().map(|m| m.clamp(-60.0, 0.0)).sum::<f64>() / n;
                Score { worth, guide: worth + 0.1 * missing }
            }
            Goal::DetectionRange => {
                let worth = worst_range(&study, &field);
                let mean = field.iter().map(|m| m.clamp(-60.0, 0.0)).sum::<f64>() / field.len() as f64;
                Score { worth, guide: worth + 0.01 * mean }
            }
        })
    }
}

/// A remark if the design is detected up to the end of the sweep, so that its range may be longer.
fn sweep_end(study: &Study, goal: Goal, range_m: f64) -> Option<String> {
    let sweep = study.sweeps.iter().find(|s| s.parameter == "longitudinal_m")?;
    let last_m = sweep.values.iter().filter_map(|v| v.number()).fold(f64::NEG_INFINITY, f64::max);
    (goal == Goal::DetectionRange && range_m >= last_m).then(|| {
        format!(
            "the design is detected up to {last_m} m, the end of the sweep of longitudinal_m: its range is at least that, \
             and designs that reach it cannot be told apart; a longer sweep may tell them"
        )
    })
}

/// Detection range along `longitudinal_m` in the worst of the other sweeps, m; 0 where nothing is detected.
fn worst_range(study: &Study, margin: &[f64]) -> f64 {
    let Some(axis) = study.sweeps.iter().position(|s| s.parameter == "longitudinal_m") else {
        return f64::NAN;
    };
    let x: Vec<f64> = study.sweeps[axis].values.iter().map(|v| v.number().unwrap_or(f64::NAN)).collect();
    let inner: usize = study.sweeps[axis + 1..].iter().map(|s| s.values.len()).product();
    let ranges = lines_along(margin, x.len(), inner).map(|along| detection_range(&x, &along));
    ranges.map(|r| if r.is_nan() { 0.0 } else { r }).fold(f64::INFINITY, f64::min)
}

/// A place in the unit cube, with the arithmetic that the simplex needs.
#[derive(Debug, Clone)]
struct UnitCubePoint(Vec<f64>);

impl ArgminAdd<UnitCubePoint, UnitCubePoint> for UnitCubePoint {
    fn add(&self, other: &UnitCubePoint) -> UnitCubePoint {
        UnitCubePoint(self.0.iter().zip(&other.0).map(|(a, b)| a + b).collect())
    }
}

impl ArgminSub<UnitCubePoint, UnitCubePoint> for UnitCubePoint {
    fn sub(&self, other: &UnitCubePoint) -> UnitCubePoint {
        UnitCubePoint(self.0.iter().zip(&other.0).map(|(a, b)| a - b).collect())
    }
}

impl ArgminMul<f64, UnitCubePoint> for UnitCubePoint {
    fn mul(&self, factor: &f64) -> UnitCubePoint {
        UnitCubePoint(self.0.iter().map(|a| a * factor).collect())
    }
}

impl CostFunction for &Problem<'_> {
    type Param = UnitCubePoint;
    type Output = f64;

    fn cost(&self, unit: &UnitCubePoint) -> Result<f64, argmin::core::Error> {
        let parameters = self.parameters(&unit.0);
        match self.score(&parameters) {
            Ok(score) => {
                let mut found = self.found.borrow_mut();
                found.tried += 1;
                if found.best.as_ref().is_none_or(|b| score.guide > b.1.guide) {
                    found.best = Some((parameters, score));
                }
                // A simplex cannot step on infinities.
                Ok(-score.guide.clamp(-1e6, 1e6))
            }
            // A shape that the reflector's builder refuses is a bad design, not a failure.
            Err(Error::Input(_)) => Ok(1e6),
            Err(e) => {
                let text = e.to_string();
                self.failed.borrow_mut().get_or_insert(e);
                Err(argmin::core::Error::msg(text))
            }
        }
    }
}

/// Finds the best design of `study` at `cost`.
///
/// # Errors
/// Returns the errors of the solver, and an error if no design can be built.
pub fn best(
    solver: &dyn Solver,
    study: &Study,
    search: &SearchTable,
    cost: f64,
    index: u32,
) -> Result<Design> {
    let problem =
        Problem { solver, study, search, cost, found: RefCell::default(), failed: RefCell::new(None) };
    let n = search.parameter.len();
    for start in 0..search.starts {
        let origin: Vec<f64> = (0..n).map(|i| uniform(search.seed, index, start as u32, i as u32)).collect();
        // A simplex of a quarter of each interval, towards the inside.
        let mut simplex = vec![UnitCubePoint(origin.clone())];
        for i in 0..n {
            let mut corner = origin.clone();
            corner[i] += if corner[i] > 0.5 { -0.25 } else { 0.25 };
            simplex.push(UnitCubePoint(corner));
        }
        let solver = NelderMead::new(simplex)
            .with_sd_tolerance(1e-4)
            .map_err(|e| Error::Failed(format!("the search cannot start: {e}")))?;
        let run = Executor::new(&problem, solver).configure(|s| s.max_iters(search.steps)).run();
        if let Some(e) = problem.failed.take() {
            return Err(e);
        }
        run.map(|r| r.state.get_iter()).map_err(|e| Error::Failed(format!("the search failed: {e}")))?;
    }
    let BestSoFar { best, tried } = problem.found.take();
    let (parameters, score) = best.ok_or_else(|| {
        Error::Failed(format!(
            "no design with {} = {cost} within the limits can be built",
            search.front.value
        ))
    })?;
    let study = problem.study(&parameters);
    let remarks = Work::collect(&study, study.points(), &|i| study.values_at(i))?.remarks(&study)?;
    let mut limits = problem.limits(&parameters);
    limits.extend(sweep_end(&study, search.goal, score.worth));
    Ok(Design { cost, parameters, worth: score.worth, tried, remarks, limits })
}

/// Uniform random number in 0..1, the same for the same seed and indices.
fn uniform(seed: u64, front: u32, start: u32, parameter: u32) -> f64 {
    let word = philox4x32_10([front, start, parameter, 0x7365_6172], [seed as u32, (seed >> 32) as u32])[0];
    f64::from(word) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn designs_that_another_one_beats_are_left_out() {
        let d = |cost: f64, worth: f64| Design {
            cost,
            worth,
            parameters: vec![],
            tried: 1,
            remarks: vec![],
            limits: vec![],
        };
        let all = [d(1.0, 10.0), d(2.0, 9.0), d(3.0, 30.0), d(4.0, 30.0), d(5.0, f64::NAN), d(6.0, 31.0)];
        let front: Vec<f64> = all.iter().filter(|x| x.is_on_front(&all)).map(|x| x.cost).collect();
        assert_eq!(front, [1.0, 3.0, 6.0]);
    }

    #[test]
    fn starts_differ_and_repeat() {
        assert_eq!(uniform(1, 2, 3, 4), uniform(1, 2, 3, 4));
        let mut all: Vec<u64> = (0..100).map(|i| uniform(7, 0, i, 0).to_bits()).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 100);
        assert!((0..100).all(|i| (0.0..1.0).contains(&uniform(7, 0, i, 0))));
    }
}
