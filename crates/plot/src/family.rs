//! Curves that share one chart: their pens and the legend that explains them.

use super::canvas::{BLACK, Pen, Rgb};
use super::chart::{CURVE_COLOURS, ColourMap, Curve, Key, Scale, Symbol, curve_pen};

/// Curves with their pens.
pub struct Family {
    pub curves: Vec<Curve>,
    pub pens: Vec<Pen>,
    /// Names of polarisations and of frequencies, of which curve number `polarisation · frequencies + frequency` belongs to a pair; None
    /// for curves that each have a name of their own.
    grid: Option<[Vec<String>; 2]>,
}

/// More curves than this have one entry for each polarisation and each frequency, not one for each pair.
const MOST_KEYS: usize = 14;
/// Frequencies that the legend names at most; of more it names these, evenly spread.
const MOST_FREQUENCIES: usize = 8;

impl Family {
    /// Curves that each have an entry of the legend.
    pub fn new(curves: Vec<Curve>) -> Family {
        let pens = (0..curves.len()).map(curve_pen).collect();
        Family { curves, pens, grid: None }
    }

    /// Curves with these pens.
    pub fn with_pens(curves: Vec<Curve>, pens: Vec<Pen>) -> Family {
        Family { curves, pens, grid: None }
    }

    /// A curve for each polarisation at each frequency, frequencies innermost. Colours are those of frequencies, and widths and dashes those of
    /// polarisations; of one frequency each polarisation has its own colour.
    pub fn grid(
        polarisations: Vec<String>,
        frequencies: Vec<String>,
        points: impl Fn(usize, usize) -> Curve,
    ) -> Family {
        let (p, f) = (polarisations.len(), frequencies.len());
        let pairs = || (0..p).flat_map(|i| (0..f).map(move |j| (i, j)));
        let curves = pairs()
            .map(|(i, j)| {
                let label = match f {
                    1 => polarisations[i].clone(),
                    _ => format!("{}, {}", polarisations[i], frequencies[j]),
                };
                Curve { label, ..points(i, j) }
            })
            .collect();
        let pen = |(i, j)| match (p, f) {
            (_, 1) => curve_pen(i),
            (1, 2..=21) => curve_pen(j),
            _ => polarisation_pen(i, frequency_colour(j, f)),
        };
        Family { curves, pens: pairs().map(pen).collect(), grid: Some([polarisations, frequencies]) }
    }

    /// Curves in the order in which they are drawn: thin ones over broad ones.
    pub fn drawn(&self, mut shown: Vec<usize>) -> Vec<usize> {
        shown.sort_by(|a, b| self.pens[*b].width.total_cmp(&self.pens[*a].width));
        shown
    }

    /// Entries of the legend when `shown` are the curves that are drawn. Those that are under the scale altogether, whose lower end is
    /// `bottom_db`, are named. `axis`: with the unit in brackets, as `RCS (dBsm)`.
    pub fn keys(&self, shown: &[usize], bottom_db: f64, axis: &str) -> Vec<Key> {
        let each =
            |i: &usize| Key { label: self.curves[*i].label.clone(), symbol: Symbol::Line(self.pens[*i]) };
        let hidden = |i: &usize| !shown.contains(i);
        let Some([polarisations, frequencies]) = &self.grid else {
            let names = (0..self.curves.len()).filter(hidden).map(|i| self.curves[i].label.clone()).collect();
            return shown.iter().map(each).chain(left_out(names, bottom_db, axis)).collect();
        };
        let f = frequencies.len();
        let drawn: Vec<usize> =
            (0..polarisations.len()).filter(|p| shown.iter().any(|i| i / f == *p)).collect();
        // A polarisation that is drawn at no frequency is named once.
        let names = (0..polarisations.len()).flat_map(|p| match drawn.contains(&p) {
            false => vec![polarisations[p].clone()],
            true => (p * f..(p + 1) * f).filter(hidden).map(|i| self.curves[i].label.clone()).collect(),
        });
        let note = left_out(names.collect(), bottom_db, axis);
        if f == 1 || shown.len() <= MOST_KEYS {
            return shown.iter().map(each).chain(note).collect();
        }
        let named = spread(f, MOST_FREQUENCIES).into_iter().map(|j| Key {
            label: frequencies[j].clone(),
            symbol: Symbol::Line(Pen::solid(frequency_colour(j, f), 2.2)),
        });
        let several = polarisations.len() > 1;
        let styles = drawn.iter().map(|p| {
            let pen = if several { polarisation_pen(*p, BLACK) } else { Pen::solid(BLACK, 1.2) };
            Key { label: polarisations[*p].clone(), symbol: Symbol::Line(pen) }
        });
        named.chain(styles).chain(note).collect()
    }
}

/// At most `most` of `count` numbers, with the first and the last.
fn spread(count: usize, most: usize) -> Vec<usize> {
    let n = count.min(most);
    (0..n).map(|i| if n > 1 { (i * (count - 1) + (n - 1) / 2) / (n - 1) } else { 0 }).collect()
}

fn frequency_colour(j: usize, count: usize) -> Rgb {
    if count <= CURVE_COLOURS.len() {
        return CURVE_COLOURS[j];
    }
    // The bright end of the map is too pale for a line on white.
    let scale = Scale::new(ColourMap::Viridis, "", 0.0, (count - 1) as f64 / 0.9);
    scale.colour(j as f64).unwrap_or(BLACK)
}

/// A pen for each of twelve polarisations. Of a pair one is broad and pale and one thin and full, so that both are seen where they are equal.
fn polarisation_pen(i: usize, colour: Rgb) -> Pen {
    const DASHES: [Option<[f64; 2]>; 6] =
        [None, Some([9.0, 5.0]), Some([3.0, 5.0]), Some([16.0, 4.0]), Some([1.5, 8.0]), Some([24.0, 9.0])];
    let dash = DASHES[i / 2 % DASHES.len()];
    match i % 2 {
        0 => Pen { colour: pale(colour), width: 3.4, dash },
        _ => Pen { colour, width: 1.2, dash },
    }
}

/// The same colour, halfway to white.
pub fn pale(colour: Rgb) -> Rgb {
    colour.map(|c| c / 2 + 127)
}

/// An entry of the legend for what is not drawn. The unit is that of the axis, `RCS (dBsm)`.
pub fn left_out(names: Vec<String>, bottom_db: f64, axis: &str) -> Option<Key> {
    let unit = axis.rsplit_once('(').map_or("", |(_, unit)| unit.trim_end_matches(')'));
    let bottom = format!("{bottom_db:.0}").replace('-', "−");
    let label = format!("left out, below {bottom} {unit}: {}", names.join(", "));
    (!names.is_empty()).then_some(Key { label, symbol: Symbol::Note })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(polarisations: usize, frequencies: usize) -> Family {
        let names = |prefix: &str, n: usize| (0..n).map(|i| format!("{prefix}{i}")).collect();
        Family::grid(names("p", polarisations), names("f", frequencies), |_, _| Curve::default())
    }

    #[test]
    fn every_curve_has_a_pen_of_its_own() {
        for (p, f) in [(4, 1), (12, 1), (1, 21), (4, 2), (12, 7), (12, 40)] {
            let made = family(p, f);
            assert_eq!(made.curves.len(), p * f);
            for (i, pen) in made.pens.iter().enumerate() {
                assert!(!made.pens[..i].contains(pen), "{p} {f} {i}");
            }
        }
    }

    #[test]
    fn few_curves_have_an_entry_each_and_many_one_for_each_name() {
        let labels = |f: &Family, shown: &[usize]| -> Vec<String> {
            f.keys(shown, -40.0, "RCS (dBsm)").into_iter().map(|k| k.label).collect()
        };
        let two = family(2, 2);
        assert_eq!(labels(&two, &[0, 1, 2, 3]), ["p0, f0", "p0, f1", "p1, f0", "p1, f1"]);
        assert_eq!(labels(&two, &[0, 1]), ["p0, f0", "p0, f1", "left out, below −40 dBsm: p1"]);
        assert_eq!(labels(&two, &[0, 1, 3])[3], "left out, below −40 dBsm: p1, f0");
        let many = family(2, 100);
        let all: Vec<usize> = (0..200).collect();
        assert_eq!(labels(&many, &all), ["f0", "f14", "f28", "f42", "f57", "f71", "f85", "f99", "p0", "p1"]);
        assert_eq!(spread(1, 8), [0]);
    }
}
