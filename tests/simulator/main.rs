//! The simulator against closed forms, reference data and itself on other engines.

mod accuracy;
mod adc;
mod beams;
mod closest;
mod clutter;
mod curved;
mod detect;
mod doa;
mod doppler_bands;
mod dsp;
mod floor;
mod front_end;
mod gpu_trace;
mod gridding;
mod ground;
mod hostile;
mod labels;
mod materials;
mod mie;
mod mirrors;
mod motion;
mod refraction;
mod road;
mod scattering_table;
mod vehicles;
mod waveforms;
