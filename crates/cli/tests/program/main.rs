//! The program as users run it.

mod commands;
mod common;
mod dataset;
mod diff;
mod export;
mod fit_sensor;
mod hostile_values;
mod kept_echoes;
mod lane;
mod learn;
mod mcp;
mod packaging;
mod radar_cli;
mod shell;
mod skill;
mod vehicles;
