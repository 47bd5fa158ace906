//! catseye simulates automotive radar: glTF road scenes in, radar cross sections, ADC cubes,
//! range-Doppler maps, detections and points out, on a GPU through wgpu or on the CPU.
//!
//! Waves are physical optics on exact beams, with Fresnel reflection and several bounces; samples follow from the
//! echoes' path lengths over the frame; processing is the chain of a radar, from the range transform to points with
//! standard deviations. Numbers such as *eq. 9* refer to the equations of CONVENTIONS.md. Units are SI and stand in
//! the names; angles are in rad inside; axes are ISO 8855 (x forward, y left, z up).
//!
//! Where to begin:
//!
//! * a scenario to points: [`simulate::simulate`]; its stages one by one: [`engine::Engine`], [`dsp`];
//! * a radar cross section: [`engine::Engine::rcs`]; closed forms: [`rcs::closed_form`]; known reflectors:
//!   [`road::reflector`];
//! * what a radar can do: [`scene::radar_figures::RadarFigures`] of a preset or a radar file;
//! * formulas: [`em`] for surfaces, layers, rain and spheres, [`dsp`] for windows, CFAR and directions of arrival;
//! * points of any radar to tracks: [`detect`].
//!
//! The cross section of a corner reflector, and the power at which the radar of a preset receives it:
//!
//! ```
//! use catseye::base::units::{db_from_power, dbsm_from_amplitude};
//! use catseye::engine::{Engine, Precision};
//! use catseye::rcs::{Aspect, BistaticAspect, RcsOptions};
//! use catseye::road::reflector::{CORNER_ELEVATION_DEG, Reflector};
//! use catseye::scene::{material, radar_toml::preset};
//!
//! let corner = Reflector::parse("trihedral:leg_m=0.1")?.to_scene(&material::by_name)?;
//! let boresight = Aspect { azimuth: 0.0, elevation: CORNER_ELEVATION_DEG.to_radians() };
//! let engine = Engine::open("cpu", Precision::F32)?;
//! let aspects = [BistaticAspect::monostatic(boresight)];
//! let s = engine.rcs(&corner, &[77e9], &aspects, &RcsOptions::default())?[0];
//! let rcs_dbsm = dbsm_from_amplitude(s.every[0][0].norm());
//! assert!((rcs_dbsm - 14.53).abs() < 0.01);
//!
//! let radar = preset("demo77")?;
//! let gain_dbi = radar.tx[0].gain_dbi + radar.rx[0].gain_dbi;
//! let spread_db = db_from_power((4.0 * std::f64::consts::PI).powi(3) * 40f64.powi(4));
//! let area_db = db_from_power(radar.wavelength_m().powi(2)) + rcs_dbsm;
//! let received_dbm = radar.tx_power_dbm + gain_dbi + area_db - spread_db;
//! assert!((received_dbm + 94.7).abs() < 0.1);
//! # Ok::<(), catseye::Error>(())
//! ```
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
