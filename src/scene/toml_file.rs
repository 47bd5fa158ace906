//! TOML with line numbers in errors.
