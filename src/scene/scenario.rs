//! Scenario TOML.
