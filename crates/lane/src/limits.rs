//! Options of the lane methods as text: reading them from JSON, and the ranges of their numbers. A range that does not depend on other
//! options is stated beside its field and checked by [`check_bounds`].

use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::scene::toml_file::Document;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt;

/// Key below the method's table, value, least and largest allowed value, and what to write instead.
pub type Limit<'a> = (&'a str, f64, f64, f64, &'a str);

/// Remedy for most values out of range.
pub const LEAVE_OUT: &str = "leave it out to use its default";

/// Checks values against their limits; `method` is named in errors.
///
/// # Errors
/// Returns an error for the first value outside its range, with its key in `lane.METHOD`.
pub fn check(method: &str, limits: &[Limit<'_>]) -> Result<()> {
    let is_out = |l: &&Limit<'_>| !(l.2..=l.3).contains(&l.1);
    match limits.iter().find(is_out) {
        None => Ok(()),
        Some((key, value, low, high, remedy)) => {
            Err(wrong(method, key, *value).allowed(format!("{low}..={high}")).remedy(*remedy).into())
        }
    }
}

/// Compares the settings of a method with the bounds that their type states (`#[schemars(range(…))]`).
///
/// # Errors
/// Returns an error for the first value outside its bounds, with its key in `lane.METHOD` and what that means.
pub fn check_bounds<T: Serialize + JsonSchema + 'static>(method: &str, settings: &T) -> Result<()> {
    Document::check_bounds(&format!("lane.{method}"), settings)
}

/// Makes the error for a value of `lane.METHOD` outside its range.
pub fn wrong(method: &str, key: &str, value: impl ToString) -> BadInput {
    BadInput::new("is out of range").key(format!("lane.{method}.{key}")).value(value.to_string())
}

/// Reads the options of a method from JSON.
///
/// # Errors
/// Returns an error for text that is not JSON, and for keys that are unknown or missing or hold another kind
/// of value than they need.
pub fn read_json<T: DeserializeOwned>(method: &str, options: &str) -> Result<T> {
    serde_json::from_str(options).map_err(|e| refused(method, json_in_words(&e)))
}

/// Makes the error for options that a method refuses, with the reason in words.
pub fn refused(method: &str, why: impl fmt::Display) -> Error {
    let key = format!("options of '{method}'");
    BadInput::new(why.to_string()).key(key).remedy("see docs/lanes.md").into()
}
