//! Which echoes of a frame may be left out: the weakest, as long as all of them together cannot show (CONVENTIONS eq. 67).

use super::synthesis::{Levels, passes};
use crate::base::tasks::in_parts;
use crate::base::units::wavenumber;
use crate::geom::hash::firsts;
use crate::scene::radar::Radar;
use crate::trace::{Echo, Echoes, strength};
use num_complex::Complex64;

/// What may be left out of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// Nothing is left out.
    Nothing,
    /// The weakest echoes, as long as the sum of their powers in a channel stays below this, W.
    Sum(f64),
    /// Echoes may be left out up to this share of the power of all echoes.
    Share(f64),
    /// Each echo is left out whose power would be below this in the antennas' main directions, W.
    Each(f64),
}

/// Leaves out what the budget allows of the echoes that the receiver hears; what its filter stops stays, to be counted there. The others
/// keep their order.
///
/// The bound is on the sum of powers, whatever the phases: echoes that are left out add up like noise over the cells of the map, so
/// their sum in any cell stays below the sum of all unless they conspire. Echoes of one place have to be one echo before
/// (`trace::merge`).
pub fn trim(radar: &Radar, echoes: &mut Echoes, budget: Budget) {
    if budget == Budget::Nothing {
        return;
    }
    let levels = Levels::new(radar);
    let ramps: Vec<Radar> = (0..radar.waveform.parts()).map(|i| radar.part(i)).collect();
    let received = |r: &Echo| ramps.iter().any(|ramp| passes(ramp, r));
    let power = |r: &Echo| levels.amplitude(r).norm_sqr();
    let one = |r: &Echo| received(r).then(|| power(r));
    let powers: Vec<Option<f64>> = in_parts(&echoes.list, one);
    // What an echo is measured by, and from where on it stays.
    let (least, full) = match budget {
        Budget::Nothing => return,
        Budget::Each(w) => (w, Some(levels.full_gain())),
        Budget::Sum(w) => (below(&powers, w), None),
        Budget::Share(s) => (below(&powers, s * powers.iter().flatten().sum::<f64>()), None),
    };
    let is_weak = |r: &Echo, p: f64| full.map_or(p, |gain| (strength(r) * gain).powi(2)) < least;
    let mut power = powers.iter();
    let Echoes { list, left_out, left_out_power_w, .. } = echoes;
    list.retain(|r| match power.next() {
        Some(Some(p)) if is_weak(r, *p) => {
            *left_out += 1;
            *left_out_power_w += p;
            false
        }
        _ => true,
    });
}

/// Power of echoes in a channel, mean over channels, W. Those of one chain of objects in one range cell are added up with their phases
/// first: waves of the two ends of a narrow strip are each far stronger than what the strip returns.
pub fn power_w(radar: &Radar, echoes: &[Echo]) -> f64 {
    let levels = Levels::new(radar);
    summed_w(radar, echoes, |r| levels.amplitude(r))
}

/// Sum of the powers in W of echoes of which only the size is known, whatever the radar's polarisation.
pub fn unpolarised_w(radar: &Radar, echoes: &[Echo]) -> f64 {
    let levels = Levels::new(radar);
    summed_w(radar, echoes, |r| levels.unpolarised(r).into())
}

fn summed_w(radar: &Radar, echoes: &[Echo], amplitude: impl Fn(&Echo) -> Complex64 + Sync) -> f64 {
    let (k, cell_m) = (wavenumber(radar.carrier_hz), radar.range_bin_m());
    let one = |r: &Echo| passes(radar, r).then(|| amplitude(r) * Complex64::cis(-k * r.path_length_m));
    let waves: Vec<Option<Complex64>> = in_parts(echoes, one);
    let cell = |r: &Echo| (r.range_m() / cell_m).round() as i64;
    let firsts = firsts(echoes.len(), |i| waves[i].map(|_| (echoes[i].chain, cell(&echoes[i]))));
    let mut sums = vec![Complex64::ZERO; echoes.len()];
    for (first, wave) in firsts.iter().zip(&waves).filter_map(|(first, w)| Some((*first, (*w)?))) {
        sums[first as usize] += wave;
    }
    sums.iter().map(Complex64::norm_sqr).sum()
}

/// The power below which all together stay below `sum`. Powers fall into classes by their first bits, so that only those of one class have
/// to be sorted.
fn below(powers: &[Option<f64>], sum: f64) -> f64 {
    const BITS: u32 = 15;
    // Of a sign, which is 0, exponent and mantissa: numbers rise with their bits.
    let class = |p: f64| (p.abs().to_bits() >> (63 - BITS)) as usize;
    let mut of_class = vec![0.0; 1 << BITS];
    powers.iter().flatten().for_each(|p| of_class[class(*p)] += p);
    let mut so_far = 0.0;
    for (number, all) in of_class.into_iter().enumerate().filter(|(_, all)| *all != 0.0) {
        if so_far + all <= sum {
            so_far += all;
            continue;
        }
        let mut sorted: Vec<f64> = powers.iter().flatten().copied().filter(|p| class(*p) == number).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        for p in sorted {
            so_far += p;
            if so_far > sum {
                return p;
            }
        }
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::synthesis::point_echo;
    use crate::scene::radar_toml;
    use glam::DVec3;

    fn frame() -> (Radar, Echoes) {
        let radar = radar_toml::preset("demo77").unwrap();
        let at = |i: u32| point_echo(DVec3::new(10.0 + f64::from(i), 0.0, 0.0), DVec3::ZERO, 1.0, i);
        let mut list: Vec<Echo> = (0..60).map(at).collect();
        // Beyond the last range.
        list.push(point_echo(DVec3::new(500.0, 0.0, 0.0), DVec3::ZERO, 1.0, 99));
        (radar, Echoes { list, ..Default::default() })
    }

    fn trimmed(budget: Budget) -> Echoes {
        let (radar, mut all) = frame();
        trim(&radar, &mut all, budget);
        all
    }

    #[test]
    fn what_is_left_out_stays_within_the_budget() {
        let (radar, all) = frame();
        let levels = Levels::new(&radar);
        let power: Vec<f64> = all.list.iter().map(|r| levels.amplitude(r).norm_sqr()).collect();
        // Of the last five that are received, and a little more.
        let five: f64 = power[55..60].iter().sum();
        let some = trimmed(Budget::Sum(1.01 * five));
        assert_eq!((some.left_out, some.list.len()), (5, all.list.len() - 5));
        assert!((some.left_out_power_w / five - 1.0).abs() < 1e-12);
        assert_eq!(some.list[..55], all.list[..55]);
        assert_eq!(some.list[55], all.list[60]);
        let received: f64 = power[..60].iter().sum();
        assert_eq!(trimmed(Budget::Share(1.01 * five / received)).left_out, 5);
        // In the main direction, where all of them stand.
        assert_eq!(trimmed(Budget::Each(power[30] * (1.0 + 1e-9))).left_out, 30);
        assert_eq!(trimmed(Budget::Nothing), all);
        // A budget larger than everything leaves nothing but what the filter stops.
        let nothing = trimmed(Budget::Sum(1.0));
        assert_eq!((nothing.left_out, nothing.list.len()), (60, 1));
    }

    #[test]
    fn the_last_power_of_a_budget_is_that_of_the_sorted_list() {
        let powers: Vec<Option<f64>> =
            (0..5000u32).map(|i| (i % 7 != 0).then(|| 1e-12 * f64::from(i * 7919 % 5003).powi(4))).collect();
        let mut sorted: Vec<f64> = powers.iter().flatten().copied().collect();
        sorted.sort_by(f64::total_cmp);
        let all: f64 = sorted.iter().sum();
        for share in [0.0, 1e-9, 1e-3, 0.37, 0.9, 1.1] {
            let mut so_far = 0.0;
            let plain = sorted.iter().find(|p| {
                so_far += **p;
                so_far > share * all
            });
            assert_eq!(below(&powers, share * all), plain.copied().unwrap_or(f64::INFINITY), "{share}");
        }
    }

    #[test]
    fn nothing_is_left_out_of_nothing() {
        let (radar, _) = frame();
        for budget in [Budget::Sum(1.0), Budget::Share(0.1), Budget::Each(1.0)] {
            let mut none = Echoes::default();
            trim(&radar, &mut none, budget);
            assert_eq!(none, Echoes::default());
        }
    }
}
