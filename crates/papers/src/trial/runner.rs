//! A drive look by look: each frame is simulated, the method's part of it is kept, and the method processes
//! its look.

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, Level};
use catseye::base::error::Result;
use catseye::simulate::Frame;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// State of a drive at one look.
pub struct Now<'a> {
    /// The drive.
    pub drive: &'a Drive<'a>,
    /// Number of the run.
    pub run: u32,
    /// Number of the frame.
    pub frame: u32,
    /// Time of the frame, s.
    pub time_s: f64,
    /// True position and motion of the vehicle.
    pub level: Level,
}

/// The part of a drive that a method provides.
pub trait Looks {
    /// Data kept of a frame, so that an interrupted trial continues.
    type Kept: Serialize + DeserializeOwned;

    /// Extracts from a frame what the method needs.
    fn keep(&self, now: &Now<'_>, frame: &Frame) -> Self::Kept;

    /// Processes a look and scores it.
    ///
    /// # Errors
    /// Returns the errors of the method and of its sensors.
    fn look(&mut self, now: &Now<'_>, kept: Self::Kept) -> Result<()>;
}

/// Processes one look with radar number `which`; the data of the frame are kept under `key`.
///
/// # Errors
/// Returns the errors of the frame and of the look, and an error if the data cannot be written.
pub fn one_look<L: Looks>(
    given: &TrialContext<'_>,
    (drive, which): (&Drive<'_>, usize),
    (run, frame): (u32, u32),
    key: &str,
    looks: &mut L,
) -> Result<()> {
    let time_s = drive.time_s(frame);
    let now = Now { drive, run, frame, time_s, level: drive.level(time_s) };
    let kept = given.kept(key, || Ok(looks.keep(&now, &drive.frame(which, frame)?)))?;
    looks.look(&now, kept)
}

/// Processes the first `frames` looks of a run with radar number `which` and reports each.
///
/// # Errors
/// Returns the errors of [`one_look`].
pub fn drive_through<L: Looks>(
    given: &TrialContext<'_>,
    (drive, which): (&Drive<'_>, usize),
    (run, frames): (u32, u32),
    looks: &mut L,
) -> Result<()> {
    (0..frames).try_for_each(|frame| {
        one_look(given, (drive, which), (run, frame), &format!("run{run}_frame{frame}"), looks)?;
        given.report_frame(run, frame, frames);
        Ok(())
    })
}
