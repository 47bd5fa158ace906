//! From detected cells to points in SI units, and from points to what moves on the road.
//!
//! * [`points`]: range, range rate, angles, power, RCS; [`label`]: the object that each came from, and whether it is
//!   there, by the radar's own response; [`accuracy`]: standard deviations from the SNR; [`grid`]: pictures of a scan for learning.
//! * [`directions`]: angles of any snapshots; [`tensors`]: powers over range, Doppler and angle for learning, and [`view_labels`] theirs.
//! * [`unmarked`]: why peaks over the threshold became no point.
//! * [`ambiguity`]: range rates beyond one burst's, by the array of a radar whose transmitters take turns; `bursts`: by several
//!   bursts; [`slope_pairs`]: FM-CW slopes up and down; [`same_slope`]: ramps of one slope.
//! * [`ego_motion`]: the radar's own motion from standing points.
//! * [`cluster`], [`plot`]: points of one body, and one plot for each; [`tracker`] with [`kalman`] and
//!   [`assignment`]: tracks with identity; [`track_table`]: `tracks.csv`.
//!
//! Points with a NaN make no cluster and do not stand; plots with one are refused. Empty scans are scans
//! in which nothing was seen. All of it is f64 and repeats to the bit.
//!
//! A car in front drives away at 5 m/s, seen as two points in every scan:
//!
//! ```
//! use catseye::detect::cluster::{ClusterPoint, Dbscan};
//! use catseye::detect::kalman::Station;
//! use catseye::detect::plot::{Plot, plots_of_clusters};
//! use catseye::detect::tracker::{Scan, Tracker, TrackerSettings};
//!
//! let mut tracker = Tracker::new(TrackerSettings::default())?;
//! for frame in 0..10 {
//!     let time_s = 0.1 * f64::from(frame);
//!     // Range, range rate, azimuth, elevation and the standard deviations of the first three.
//!     let point = |ahead_m: f64, azimuth_rad: f64| {
//!         Plot::of_point([ahead_m + 5.0 * time_s, 5.0, azimuth_rad, 0.0], [0.1, 0.1, 0.01])
//!     };
//!     let points = [point(20.0, 0.02), point(20.3, -0.03)];
//!     let places: Vec<ClusterPoint> = points
//!         .iter()
//!         .map(|p| ClusterPoint { x_m: p.position_m().x, y_m: p.position_m().y, range_rate_mps: p.range_rate_mps })
//!         .collect();
//!     let plots = plots_of_clusters(&points, &Dbscan::default().labels(&places)?);
//!     tracker.step(&Scan { time_s, station: Station::ORIGIN, coverage: None, plots: &plots })?;
//! }
//! let cars: Vec<_> = tracker.confirmed().collect();
//! assert_eq!((cars.len(), cars[0].id, cars[0].points), (1, 1, 2));
//! assert!((cars[0].estimate.velocity_mps().x - 5.0).abs() < 0.1);
//! # Ok::<(), catseye::Error>(())
//! ```

pub mod accuracy;
pub mod ambiguity;
pub mod angle_ambiguity;
pub mod assignment;
pub mod bodies;
mod bursts;
pub mod cluster;
pub mod columns;
pub mod conjugate;
pub mod directions;
pub mod ego_motion;
pub mod files;
pub mod grid;
pub mod kalman;
pub mod label;
pub mod locate;
pub mod plot;
pub mod points;
mod response;
pub mod same_slope;
pub mod slope_pairs;
pub mod spectra;
pub mod tensors;
pub mod track_table;
pub mod tracker;
pub mod unmarked;
pub mod view_labels;

pub use bodies::Bodies;
pub use label::Labeller;
pub use points::{Detected, Point};
