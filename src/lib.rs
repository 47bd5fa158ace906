//! catseye simulates automotive radar: glTF road scenes in, radar cross sections, ADC cubes,
//! range-Doppler maps, detections and points out, on a GPU through wgpu or on the CPU.
//!
//! Data flows one way, and a module imports only modules that stand above it in this list.
#![deny(unsafe_code)]

pub mod base;

pub mod gpu;

pub mod formats;

pub mod scene;

pub mod road;

pub mod em;

pub mod geom;

pub mod trace;

pub mod rcs;

pub mod adc;

pub mod dsp;

pub mod engine;

pub mod detect;

pub mod simulate;

pub use base::error::{Error, Result};
