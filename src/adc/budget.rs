//! Which echoes of a frame may be left out: the weakest, as long as all of them together cannot show.

use super::synthesis::{Levels, passes};
use crate::scene::radar::Radar;
use crate::trace::Echo;
use rayon::prelude::*;

/// What may be left out of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// Nothing.
    Nothing,
    /// The weakest echoes, as long as the sum of their powers in a channel stays below this, W.
    Sum(f64),
    /// The same as a share of the power of all.
    Share(f64),
    /// Each echo whose power is below this, W.
    Each(f64),
}

/// What was left out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LeftOut {
    /// Number of echoes.
    pub echoes: u64,
    /// Sum of their powers in a channel, mean over channels, W.
    pub power_w: f64,
}

/// Leaves out what the budget allows of the echoes that the receiver hears; what its filter stops stays, to be counted there. The others
/// keep their order.
///
/// The bound is on the sum of powers, whatever the phases: echoes that are left out add up like noise over the cells of the map, so
/// their sum in any cell stays below the sum of all unless they conspire. Echoes of one place have to be one echo before
/// (`trace::merge`).
pub fn trim(radar: &Radar, list: &mut Vec<Echo>, budget: Budget) -> LeftOut {
    if budget == Budget::Nothing {
        return LeftOut::default();
    }
    let levels = Levels::new(radar);
    let power = |r: &Echo| levels.amplitude(r).norm_sqr();
    let powers: Vec<Option<f64>> = list.par_iter().map(|r| passes(radar, r).then(|| power(r))).collect();
    let most = match budget {
        Budget::Nothing => return LeftOut::default(),
        Budget::Each(w) => w,
        Budget::Sum(w) => below(&powers, w),
        Budget::Share(s) => below(&powers, s * powers.iter().flatten().sum::<f64>()),
    };
    let mut left_out = LeftOut::default();
    let mut power = powers.iter();
    list.retain(|_| match power.next() {
        Some(Some(p)) if *p < most => {
            left_out.echoes += 1;
            left_out.power_w += p;
            false
        }
        _ => true,
    });
    left_out
}

/// The power below which all together stay below `sum`.
fn below(powers: &[Option<f64>], sum: f64) -> f64 {
    let mut sorted: Vec<f64> = powers.iter().flatten().copied().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut so_far = 0.0;
    let first = sorted.iter().find(|p| {
        so_far += **p;
        so_far > sum
    });
    first.copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::synthesis::point_echo;
    use crate::scene::radar_toml;
    use glam::DVec3;

    fn frame() -> (Radar, Vec<Echo>) {
        let radar = radar_toml::preset("demo77").unwrap();
        let at = |i: u32| point_echo(DVec3::new(10.0 + f64::from(i), 0.0, 0.0), DVec3::ZERO, 1.0, i);
        let mut list: Vec<Echo> = (0..60).map(at).collect();
        // Beyond the last range.
        list.push(point_echo(DVec3::new(500.0, 0.0, 0.0), DVec3::ZERO, 1.0, 99));
        (radar, list)
    }

    #[test]
    fn what_is_left_out_stays_within_the_budget() {
        let (radar, all) = frame();
        let levels = Levels::new(&radar);
        let power: Vec<f64> = all.iter().map(|r| levels.amplitude(r).norm_sqr()).collect();
        // Of the last five that are heard, and a little more.
        let five: f64 = power[55..60].iter().sum();
        let mut list = all.clone();
        let left = trim(&radar, &mut list, Budget::Sum(1.01 * five));
        assert_eq!((left.echoes, list.len()), (5, all.len() - 5));
        assert!((left.power_w / five - 1.0).abs() < 1e-12);
        assert_eq!(list[..55], all[..55]);
        assert_eq!(list[55], all[60]);
        let heard: f64 = power[..60].iter().sum();
        let mut list = all.clone();
        assert_eq!(trim(&radar, &mut list, Budget::Share(1.01 * five / heard)).echoes, 5);
        let mut list = all.clone();
        assert_eq!(trim(&radar, &mut list, Budget::Each(power[30])).echoes, 29);
        let mut list = all.clone();
        assert_eq!(trim(&radar, &mut list, Budget::Nothing), LeftOut::default());
        assert_eq!(list, all);
    }

    #[test]
    fn nothing_is_left_out_of_nothing() {
        let (radar, _) = frame();
        for budget in [Budget::Sum(1.0), Budget::Share(0.1), Budget::Each(1.0)] {
            assert_eq!(trim(&radar, &mut Vec::new(), budget), LeftOut::default());
        }
        // A budget larger than everything leaves nothing but what the filter stops.
        let (radar, mut all) = frame();
        assert_eq!(trim(&radar, &mut all, Budget::Sum(1.0)).echoes, 60);
        assert_eq!(all.len(), 1);
    }
}
