//! Lane methods by their names, with options as JSON. A registry is open: a method that is written elsewhere
//! is registered beside those of this crate.
//!
//! ```
//! use catseye_lane::{LaneEstimator, Registry};
//!
//! let registry = Registry::of_methods();
//! let method = registry.make("markers", Some(r#"{"spacing_m": [1.5, 2.0]}"#)).unwrap();
//! assert_eq!(method.method(), "markers");
//! ```

use crate::LaneEstimator;
use crate::{camera_fusion, hd_map, markers, range_doppler, road_shape, signature, uwb};
use catseye::base::error::{BadInput, Result};
use std::fmt;

/// An estimator of any method.
pub type BoxedEstimator = Box<dyn LaneEstimator + Send>;

/// Function that makes an estimator from its options as JSON text.
pub type Maker = dyn Fn(&str) -> Result<BoxedEstimator> + Send + Sync;

/// Lane methods by name, in the order in which they were registered.
pub struct Registry {
    methods: Vec<(String, Box<Maker>)>,
}

impl Registry {
    /// Makes a registry without a method.
    pub fn empty() -> Registry {
        Registry { methods: Vec::new() }
    }

    /// Makes a registry with the methods of this crate, by their names on the command line.
    pub fn of_methods() -> Registry {
        type Function = fn(&str) -> Result<BoxedEstimator>;
        let of = |name: &str, function: Function| (name.into(), Box::new(function) as Box<Maker>);
        Registry {
            methods: vec![
                of(uwb::estimator::METHOD, uwb::from_json),
                of(markers::METHOD, markers::from_json),
                of(range_doppler::estimator::METHOD, range_doppler::from_json),
                of(signature::estimator::METHOD, signature::from_json),
                of(road_shape::estimator::METHOD, road_shape::from_json),
                of(hd_map::estimator::MapLanes::METHOD, hd_map::from_json),
                of(camera_fusion::METHOD, camera_fusion::from_json),
            ],
        }
    }

    /// Adds a method. `maker` is called with the options as JSON text, `{}` where there are none.
    ///
    /// # Errors
    /// Returns an error for an empty name and for one that is taken.
    pub fn register(
        &mut self,
        name: &str,
        maker: impl Fn(&str) -> Result<BoxedEstimator> + Send + Sync + 'static,
    ) -> Result<()> {
        if name.is_empty() || self.names().any(|n| n == name) {
            let bad = BadInput::new("the name is empty or belongs to another lane method")
                .key("method")
                .value(name);
            let taken: Vec<&str> = self.names().collect();
            return Err(bad.allowed(format!("a name other than {}", taken.join(", "))).into());
        }
        self.methods.push((name.into(), Box::new(maker)));
        Ok(())
    }

    /// Names of the methods in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.methods.iter().map(|m| m.0.as_str())
    }

    /// Makes the estimator of a method from options as JSON text. Without options it has those of its
    /// document.
    ///
    /// # Errors
    /// Returns an error for an unknown name, and for options that are unknown, missing (uwb, hd-map and
    /// signature need some) or outside their ranges.
    pub fn make(&self, name: &str, options: Option<&str>) -> Result<BoxedEstimator> {
        match self.methods.iter().find(|m| m.0 == name) {
            Some((_, maker)) => maker(options.unwrap_or("{}")),
            None => {
                let names: Vec<&str> = self.names().collect();
                let bad = BadInput::new("is not a lane method").key("method").value(name);
                Err(bad.allowed(names.join(", ")).into())
            }
        }
    }
}

impl Default for Registry {
    /// The methods of this crate.
    fn default() -> Registry {
        Registry::of_methods()
    }
}

impl fmt::Debug for Registry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits;
    use crate::{LaneError, LaneEstimate, SensorInput};
    use serde::Deserialize;

    /// A method that somebody else has written: it knows no lane and says why.
    struct Silent {
        why: String,
    }

    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct SilentOptions {
        why: String,
    }

    impl LaneEstimator for Silent {
        fn method(&self) -> &'static str {
            "silent"
        }

        fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
            LaneEstimate::none("silent", input.time_s, input.points.len(), LaneError::refused(&self.why))
        }
    }

    fn silent(options: &str) -> Result<BoxedEstimator> {
        let options: SilentOptions = limits::read_json("silent", options)?;
        Ok(Box::new(Silent { why: options.why }))
    }

    fn fault(method: &str, options: &str) -> String {
        match Registry::of_methods().make(method, Some(options)) {
            Ok(_) => panic!("{method} takes {options}"),
            Err(e) => e.to_string(),
        }
    }

    #[test]
    fn a_method_of_somebody_else() {
        let mut registry = Registry::of_methods();
        registry.register("silent", silent).unwrap();
        assert_eq!(registry.names().last(), Some("silent"));
        let mut method = registry.make("silent", Some(r#"{"why": "it does not look"}"#)).unwrap();
        let estimate = method.estimate(&SensorInput::default());
        assert_eq!(estimate.no_lane, Some(LaneError::refused("it does not look")));
        // Its own errors come through, and no name is taken twice.
        let e = registry.make("silent", None).err().unwrap().to_string();
        assert!(e.contains("'silent'") && e.contains("why"), "{e}");
        for taken in ["silent", "markers", ""] {
            assert!(registry.register(taken, silent).is_err(), "{taken}");
        }
        let e = registry.make("loud", None).err().unwrap().to_string();
        assert!(e.contains("is not a lane method") && e.contains("uwb") && e.contains("silent"), "{e}");
    }

    #[test]
    fn methods_by_name() {
        let registry = Registry::default();
        let names: Vec<&str> = registry.names().collect();
        let all = ["uwb", "markers", "range-doppler", "signature", "road-shape", "hd-map", "camera-fusion"];
        assert_eq!(names, all);
        for name in ["markers", "range-doppler", "road-shape", "camera-fusion"] {
            assert_eq!(registry.make(name, None).unwrap().method(), name);
        }
        for name in ["uwb", "signature", "hd-map"] {
            assert!(fault(name, "{}").contains(name));
        }
        assert_eq!(registry.make("signature", Some(r#"{"scans": []}"#)).unwrap().method(), "signature");
    }

    #[test]
    fn options_say_what_is_wrong() {
        for name in registry_names() {
            let e = fault(&name, r#"{"no_such_key": 1}"#);
            assert!(e.contains("no_such_key") || e.contains("missing"), "{name}: {e}");
            assert!(fault(&name, "[").contains(&name));
        }
        let wrong = [
            ("markers", r#"{"spacing_m": [0.1]}"#, "spacing_m[0] = 0.1"),
            ("markers", r#"{"spacing_m": [2.0], "tolerance_m": 1.5}"#, "tolerance_m = 1.5"),
            ("markers", r#"{"radar_height_m": -1}"#, "radar_height_m = -1"),
            ("markers", r#"{"picture_frame": 1}"#, "picture_frame"),
            ("road-shape", r#"{"forgetting": 1.0}"#, "forgetting = 1"),
            ("camera-fusion", r#"{"period_s": 0}"#, "period_s = 0"),
            ("hd-map", r#"{"map": "no.toml", "place_std_m": -1}"#, "place_std_m = -1"),
            ("range-doppler", r#"{"frame_time_s": -1}"#, "frame_time_s"),
        ];
        for (name, options, what) in wrong {
            let e = fault(name, options);
            assert!(e.contains(what), "{name}: {e}");
        }
        let radar = r#""range_start_m": 0, "range_step_m": 0.05, "height_m": 0.5, "at_m": [0, 0.8]"#;
        let e = fault("uwb", &format!("{{{radar}, \"side\": \"up\", \"quiet\": []}}"));
        assert!(e.contains("up") && e.contains("left") && e.contains("right"), "{e}");
        let e = fault("uwb", &format!("{{{radar}, \"side\": \"left\", \"quiet\": [], \"spacing_m\": 0}}"));
        assert!(e.contains("spacing_m = 0") && e.contains("allowed"), "{e}");
        // A small spacing takes the default tolerance down with it.
        assert!(Registry::default().make("markers", Some(r#"{"spacing_m": [0.3]}"#)).is_ok());
    }

    fn registry_names() -> Vec<String> {
        Registry::default().names().map(String::from).collect()
    }
}
