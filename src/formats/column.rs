//! A column of a table as every output of the project has it: name, unit, type, meaning, and how a row gives its value.

use crate::base::convention::MAX_BOUNCES;
use std::borrow::Cow;

/// How a row gives the value of a column, and so which type the column has.
pub enum Get<T> {
    /// A double; a value that is not a number leaves its cell of a CSV file empty.
    Number(fn(&T) -> f64),
    /// A double that is infinite where there is none; an infinite value leaves its cell of a CSV file empty.
    Bound(fn(&T) -> f64),
    /// A whole number of 32 bits.
    Count(fn(&T) -> u32),
    /// A whole number of 8 bits.
    Small(fn(&T) -> u8),
    /// True or false; 1 or 0 in CSV files.
    Flag(fn(&T) -> bool),
    /// Text of at most so many characters.
    Text(usize, fn(&T) -> Cow<'_, str>),
    /// Numbers of the objects that an echo met, of which the first zero is the end; text with blanks between in tables of text.
    Ids(fn(&T) -> [u32; MAX_BOUNCES]),
}

/// A column of a table with rows of `T`.
pub struct Column<T> {
    /// Name of the column, which ends with the unit.
    pub name: &'static str,
    /// What it holds, in words.
    pub about: &'static str,
    /// How a row gives its value.
    pub get: Get<T>,
}

impl<T> Column<T> {
    /// A column of doubles.
    pub const fn number(name: &'static str, about: &'static str, get: fn(&T) -> f64) -> Column<T> {
        Column { name, about, get: Get::Number(get) }
    }

    /// A column of flags.
    pub const fn flag(name: &'static str, about: &'static str, get: fn(&T) -> bool) -> Column<T> {
        Column { name, about, get: Get::Flag(get) }
    }

    /// The cell of a row in a CSV file.
    pub fn cell<'a>(&self, row: &'a T) -> Cow<'a, str> {
        match &self.get {
            Get::Number(get) => number(get(row), f64::is_nan),
            Get::Bound(get) => number(get(row), |x| !x.is_finite()),
            Get::Count(get) => get(row).to_string().into(),
            Get::Small(get) => get(row).to_string().into(),
            Get::Flag(get) => if get(row) { "1" } else { "0" }.into(),
            Get::Text(_, get) => get(row),
            Get::Ids(get) => ids(&get(row)).into(),
        }
    }

    /// The unit of its values as a reader of plots expects it; empty for what has none.
    pub fn unit(&self) -> &'static str {
        unit(self.name)
    }
}

fn number(value: f64, is_blank: fn(f64) -> bool) -> Cow<'static, str> {
    if is_blank(value) { "".into() } else { value.to_string().into() }
}

/// Numbers of objects with blanks between, up to the first zero.
pub fn ids(list: &[u32]) -> String {
    let ids: Vec<String> = list.iter().take_while(|id| **id != 0).map(u32::to_string).collect();
    ids.join(" ")
}

/// Ends of names, and the units that they say; longer ends come first.
const UNITS: [(&str, &str); 10] = [
    ("_rad_per_s", "rad/s"),
    ("_mps", "m/s"),
    ("_deg", "°"),
    ("_dbsm", "dBsm"),
    ("_dbm", "dBm"),
    ("_db", "dB"),
    ("_hz", "Hz"),
    ("_ns", "ns"),
    ("_m", "m"),
    ("_s", "s"),
];

/// The unit that the end of a column's name says; empty where it says none.
///
/// ```
/// use catseye::formats::column::unit;
/// assert_eq!((unit("range_rate_mps"), unit("rcs_dbsm"), unit("bounces")), ("m/s", "dBsm", ""));
/// ```
pub fn unit(name: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit)
}
