//! An estimator's setup for one radar, with background and threshold from scans of the bare road.

use super::{Background, Centre, OffsetSource, RangeAxis, RangeGate, Threshold, UwbConfig, UwbSetup};
use crate::error::LaneError;
use crate::side::Side;

/// What is known of a radar, its lane and its plates before scans of the bare road have been seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuning {
    /// Range axis of the samples.
    pub axis: RangeAxis,
    /// Ranges over which echoes are summed.
    pub gate: RangeGate,
    /// Side of the line that the radar observes.
    pub side: Side,
    /// Height of the radar above the road, m.
    pub height_m: f64,
    /// Position of the radar in the vehicle's level frame, m.
    pub at_m: [f64; 2],
    /// Distance from the start of one plate to the start of the next, m.
    pub spacing_m: f64,
    /// Length of a plate, m.
    pub plate_length_m: f64,
    /// Width of the lane, m.
    pub lane_width_m: f64,
    /// Whether the mean scan of the bare road is subtracted from each scan.
    pub take_background: bool,
    /// Definition of the centre of a pass.
    pub centre: Centre,
    /// Largest error of a spacing that counts as right, m.
    pub largest_error_m: f64,
    /// Number of successive correct spacings that confirm a lane.
    pub confirm_spacings: usize,
    /// Number of successive missing plates that trigger the departure warning.
    pub misses_to_warn: usize,
    /// Share of scans of the bare road that may exceed the threshold; None: none of those seen.
    pub false_alarm_probability: Option<f64>,
    /// Standard deviation of the lateral distance to a line, m.
    pub offset_std_m: f64,
}

/// The setup of one radar, and what it rests on.
pub struct Tuned {
    /// The estimator's setup.
    pub options: UwbSetup,
    /// The threshold in it.
    pub threshold: Threshold,
    /// Energies of the bare road.
    pub bare: Vec<f64>,
}

impl Tuning {
    /// Makes the setup, with its threshold from scans of the bare road.
    ///
    /// # Errors
    /// Returns the name of what cannot be made, with the reason.
    pub fn tune(&self, quiet: &[Vec<f64>]) -> Result<Tuned, (&'static str, LaneError)> {
        let of = |what: &'static str| move |r: LaneError| (what, r);
        let background = match self.take_background {
            true => Some(Background::of(quiet.iter().map(Vec::as_slice)).map_err(of("background"))?),
            false => None,
        };
        // For the energies alone, until the threshold is known.
        let floor = Threshold::maximum(&[0.0, 1.0]).map_err(of("threshold"))?;
        let config = |t: &Threshold| {
            UwbConfig::new(self.spacing_m, self.plate_length_m, t).map(|c| UwbConfig {
                max_spacing_error_m: self.largest_error_m,
                least_distance_m: c.least_distance_m.min(self.spacing_m - self.largest_error_m),
                centre: self.centre,
                confirm_spacings: self.confirm_spacings,
                misses_to_warn: self.misses_to_warn,
                // With the mirror reflection in the scan the strongest echo is always that.
                offset: match self.take_background {
                    true => OffsetSource::Range { height_m: self.height_m },
                    false => OffsetSource::None,
                },
                ..c
            })
        };
        let mut options = UwbSetup {
            axis: self.axis,
            gate: self.gate,
            background,
            config: config(&floor).map_err(of("lane.uwb"))?,
            side: self.side,
            at_m: self.at_m,
            offset_std_m: self.offset_std_m,
            lane_width_m: Some(self.lane_width_m),
        };
        let bare = quiet.iter().map(|s| options.echo(s).map(|e| e.energy));
        let bare = bare.collect::<Result<Vec<f64>, _>>().map_err(of("a scan's energy"))?;
        let threshold = match self.false_alarm_probability {
            None => Threshold::maximum(&bare),
            Some(p) => Threshold::extreme_value(&bare, p),
        };
        let threshold = threshold.map_err(of("threshold"))?;
        options.config = config(&threshold).map_err(of("lane.uwb"))?;
        Ok(Tuned { options, threshold, bare })
    }
}
