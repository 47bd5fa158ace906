//! Values of `extras.catseye`.

use super::importer::Importer;
use crate::base::error::{BadInput, Result, nearest};
use crate::scene::toml_file::clip;
use gltf::json;
use serde_json::{Map, Value};

impl Importer<'_> {
    /// `extras.catseye` as an object.
    pub(super) fn extras(&self, extras: &json::Extras, key: &str) -> Result<Option<Map<String, Value>>> {
        let Some(raw) = extras else { return Ok(None) };
        let Ok(Value::Object(mut all)) = serde_json::from_str::<Value>(raw.get()) else { return Ok(None) };
        match all.remove("catseye") {
            None => Ok(None),
            Some(Value::Object(m)) => Ok(Some(m)),
            Some(v) => Err(self
                .bad(key, "is not an object")
                .value(clip(&v.to_string()))
                .remedy("give {\"key\": value, ...}")
                .into()),
        }
    }

    pub(super) fn unknown_key(&self, prefix: &str, key: &str, known: &[&str]) -> BadInput {
        let b = self.bad(format!("{prefix}.{}", clip(key)), "unknown key").allowed(known.join(", "));
        match nearest(key, known.iter().copied()) {
            Some(n) => b.remedy(format!("did you mean '{n}'?")),
            None => b.remedy("remove the key"),
        }
    }

    pub(super) fn number(&self, v: &Value, key: &str, range: std::ops::RangeInclusive<f64>) -> Result<f64> {
        v.as_f64().filter(|x| range.contains(x)).ok_or_else(|| {
            self.bad(key, "is not a number in range")
                .value(clip(&v.to_string()))
                .allowed(format!("{}..={}", range.start(), range.end()))
                .remedy("correct it")
                .into()
        })
    }

    pub(super) fn numbers<const N: usize>(&self, v: &Value, key: &str, limit: f64) -> Result<[f64; N]> {
        let list: Option<Vec<f64>> = v.as_array().map(|a| a.iter().filter_map(Value::as_f64).collect());
        list.filter(|l| v.as_array().is_some_and(|a| a.len() == l.len()))
            .and_then(|l| <[f64; N]>::try_from(l).ok())
            .filter(|l| l.iter().all(|x| x.abs() <= limit))
            .ok_or_else(|| {
                self.bad(key, format!("is not {N} numbers"))
                    .value(clip(&v.to_string()))
                    .allowed(format!("-{limit}..={limit} each"))
                    .remedy("correct it")
                    .into()
            })
    }
}
