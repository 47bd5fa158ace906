//! The program as users run it.

mod commands;
mod common;
mod dataset;
mod diff;
mod export;
mod hostile_values;
mod lane;
mod learn;
mod radar_cli;
