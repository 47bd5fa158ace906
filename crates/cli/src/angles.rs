//! Lists of numbers on the command line: a value, `start:stop:step` (STOP included if a step falls on it), or values
//! with commas between.

use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::sweep::MAX_LOOKS;

/// Longest list that one option may stand for.
pub const LONGEST: usize = MAX_LOOKS;

/// Reads the list of option `key`.
pub fn parse_list(key: &str, text: &str) -> Result<Vec<f64>> {
    let bad = |problem: &str| {
        BadInput::new(problem)
            .key(format!("--{key}"))
            .value(format!("'{text}'"))
            .allowed("VALUE, START:STOP:STEP, or VALUE,VALUE,...")
    };
    let number = |s: &str| match s.trim().parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(Error::from(bad(&format!("'{}' is not a finite number", s.trim())))),
    };
    let mut out = Vec::new();
    for item in text.split(',') {
        let parts: Vec<&str> = item.split(':').collect();
        match parts[..] {
            [one] => out.push(number(one)?),
            [a, b, step] => {
                let (a, b, step) = (number(a)?, number(b)?, number(step)?);
                if step == 0.0 || (b - a) / step < 0.0 {
                    return Err(bad("the step does not lead from START to STOP").into());
                }
                // The end is included when it lies within rounding of a step.
                let steps = ((b - a) / step * (1.0 + 1e-12) + 1e-9).floor();
                if steps >= LONGEST as f64 {
                    return Err(bad(&format!("{:.0} values are too many", steps + 1.0))
                        .remedy(format!("at most {LONGEST} values; use a larger step"))
                        .into());
                }
                // Rounded to a millionth of the step: 0.30000000000000004 would end up in files.
                let grain = 10f64.powf(step.abs().log10().floor() - 9.0);
                out.extend((0..=steps as usize).map(|i| ((a + i as f64 * step) / grain).round() * grain));
            }
            _ => return Err(bad("is not a list of numbers").into()),
        }
        if out.len() > LONGEST {
            return Err(bad("too many values").remedy(format!("at most {LONGEST}")).into());
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn forms() {
        assert_eq!(parse_list("x", "-3.5").unwrap(), [-3.5]);
        assert_eq!(parse_list("x", "1,2,-4e9").unwrap(), [1.0, 2.0, -4e9]);
        let l = parse_list("azimuth-deg", "-45:0:0.1").unwrap();
        assert_eq!((l.len(), l[0], l[450]), (451, -45.0, 0.0));
        assert!((l[447] + 0.3).abs() < 1e-12);
        assert_eq!(parse_list("x", "76e9:78e9:1e9").unwrap(), [76e9, 77e9, 78e9]);
        assert_eq!(parse_list("x", "5:1:-2").unwrap(), [5.0, 3.0, 1.0]);
        for wrong in ["", "a", "1:2", "0:1:0", "0:1:-1", "nan", "inf", "0:1e9:1e-9", "1:2:3:4", "1,,2"] {
            assert!(parse_list("x", wrong).is_err(), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn never_panics(s in ".{0,24}") {
            let _ = parse_list("x", &s);
        }
    }
}
