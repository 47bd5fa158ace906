//! What a material says of its backscatter per area, where it says more than its roughness.

use crate::base::error::{BadInput, Result, nearest};
use std::fmt;

/// A kind of ground in Kulemin's model (CONVENTIONS eq. 146).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ground {
    /// Concrete.
    Concrete,
    /// Arable land.
    ArableLand,
    /// Snow.
    Snow,
    /// Forest in summer.
    ForestInSummer,
    /// Forest in winter.
    ForestInWinter,
    /// Grass above half a metre.
    HighGrass,
    /// Grass below half a metre.
    LowGrass,
    /// A town.
    Town,
}

impl Ground {
    /// All kinds of ground, each with the name that files use.
    pub const ALL: [(&'static str, Ground); 8] = [
        ("concrete", Ground::Concrete),
        ("arable-land", Ground::ArableLand),
        ("snow", Ground::Snow),
        ("forest-in-summer", Ground::ForestInSummer),
        ("forest-in-winter", Ground::ForestInWinter),
        ("high-grass", Ground::HighGrass),
        ("low-grass", Ground::LowGrass),
        ("town", Ground::Town),
    ];
}

/// The law of the backscatter against the grazing angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// sigma0 = gamma sin(grazing angle) (CONVENTIONS eq. 145).
    ConstantGamma {
        /// Backscatter per area over the sine of the grazing angle, dB.
        gamma_db: f64,
    },
    /// Measured over kinds of ground, 3-100 GHz (CONVENTIONS eq. 146).
    Kulemin(Ground),
    /// From roughness and permittivity of the material (CONVENTIONS eq. 147).
    Oh,
}

/// The backscatter of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backscatter {
    /// The law.
    pub law: Law,
    /// Cross-polar over co-polar backscatter, dB, where the law does not say; None: nothing is scattered across.
    pub cross_db: Option<f64>,
    /// Correlation of the complex amplitudes of VV and HH.
    pub copolar_correlation: f64,
}

/// Largest gamma, dB: with more the half-space would get more power back than came.
pub const GAMMA_DB_MAX: f64 = 3.0;

impl Backscatter {
    /// The backscatter of a law, the same in all polarisations.
    pub const fn of(law: Law) -> Backscatter {
        Backscatter { law, cross_db: None, copolar_correlation: 0.0 }
    }

    /// Reads `oh`, `kulemin:GROUND` or `gamma:DB`, with options after commas: `gamma:-20,cross_db=-8,correlation=0.5`.
    ///
    /// # Errors
    /// Returns an error for an unknown law, ground or option, for a gamma above [`GAMMA_DB_MAX`], for cross_db outside
    /// -100..0, a correlation outside -1..1, or for cross_db for a law that says it itself.
    pub fn parse(spec: &str) -> Result<Backscatter> {
        let bad =
            |problem: &str, value: &str| BadInput::new(problem.to_string()).key("backscatter").value(value);
        let mut parts = spec.split(',').map(str::trim);
        let law = parts.next().unwrap_or_default();
        let number = |text: &str, lo: f64, hi: f64| -> Result<f64> {
            let value = text.trim().parse().ok().filter(|x| (lo..=hi).contains(x));
            Ok(value.ok_or_else(|| {
                bad("is not a number in range", text)
                    .allowed(format!("{lo}..{hi}"))
                    .remedy("write for example gamma:-20,cross_db=-8,correlation=0.5")
            })?)
        };
        let law = match law.split_once(':') {
            None if law == "oh" => Law::Oh,
            Some(("kulemin", ground)) => {
                let names = || Ground::ALL.iter().map(|(n, _)| *n);
                let found = Ground::ALL.iter().find(|(n, _)| *n == ground).map(|(_, g)| Law::Kulemin(*g));
                found.ok_or_else(|| {
                    bad("is not a kind of ground", ground)
                        .allowed(names().collect::<Vec<_>>().join(", "))
                        .remedy(match nearest(ground, names()) {
                            Some(n) => format!("did you mean '{n}'?"),
                            None => "choose one of them".into(),
                        })
                })?
            }
            Some(("gamma", db)) => Law::ConstantGamma { gamma_db: number(db, -200.0, GAMMA_DB_MAX)? },
            _ => {
                return Err(bad("is not a law of backscatter", law)
                    .allowed("oh, kulemin:GROUND, gamma:DB")
                    .remedy("write for example kulemin:concrete")
                    .into());
            }
        };
        let mut all = Backscatter::of(law);
        for option in parts {
            match option.split_once('=') {
                Some(("cross_db", _)) if law == Law::Oh => {
                    return Err(bad("the law itself determines the cross-polarised part", option)
                        .remedy("remove cross_db")
                        .into());
                }
                Some(("cross_db", v)) => all.cross_db = Some(number(v, -100.0, 0.0)?),
                Some(("correlation", v)) => all.copolar_correlation = number(v, -1.0, 1.0)?,
                _ => {
                    return Err(bad("is not an option of a backscatter", option)
                        .allowed("cross_db=DB, correlation=NUMBER")
                        .remedy("write for example gamma:-20,cross_db=-8")
                        .into());
                }
            }
        }
        Ok(all)
    }
}

/// As [`Backscatter::parse`] reads it.
impl fmt::Display for Backscatter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.law {
            Law::ConstantGamma { gamma_db } => write!(f, "gamma:{gamma_db}")?,
            Law::Kulemin(ground) => {
                let name = Ground::ALL.iter().find(|(_, g)| *g == ground).map_or("", |(n, _)| n);
                write!(f, "kulemin:{name}")?;
            }
            Law::Oh => write!(f, "oh")?,
        }
        if let Some(db) = self.cross_db {
            write!(f, ",cross_db={db}")?;
        }
        if self.copolar_correlation != 0.0 {
            write!(f, ",correlation={}", self.copolar_correlation)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_it_writes() {
        for spec in ["oh", "oh,correlation=0.5", "gamma:-20,cross_db=-8.5,correlation=-0.25"] {
            assert_eq!(Backscatter::parse(spec).unwrap().to_string(), spec);
        }
        for (name, ground) in Ground::ALL {
            let b = Backscatter::parse(&format!("kulemin:{name}")).unwrap();
            assert_eq!(b, Backscatter::of(Law::Kulemin(ground)));
            assert_eq!(Backscatter::parse(&b.to_string()).unwrap(), b);
        }
    }

    #[test]
    fn complaints() {
        for (spec, part) in [
            ("", "oh, kulemin:GROUND, gamma:DB"),
            ("lambert", "is not a law"),
            ("kulemin:concret", "did you mean 'concrete'?"),
            ("gamma:7", "-200..3"),
            ("gamma:nan", "-200..3"),
            ("gamma:-20,cross_db=1", "-100..0"),
            ("gamma:-20,correlation=1.5", "-1..1"),
            ("gamma:-20,phase=1", "cross_db=DB"),
            ("oh,cross_db=-10", "remove cross_db"),
        ] {
            let e = Backscatter::parse(spec).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains(part) && !e.to_string().contains('\n'), "{spec}: {e}");
        }
    }
}
