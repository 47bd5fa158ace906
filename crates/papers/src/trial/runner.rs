//! A drive look by look: each frame is simulated, what a method keeps of it is kept, and the method takes its look.

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, Level};
use catseye::base::error::Result;
use catseye::simulate::Frame;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Where a drive is at one look.
pub struct Now<'a> {
    /// The drive.
    pub drive: &'a Drive<'a>,
    /// Number of the run.
    pub run: u32,
    /// Number of the frame.
    pub frame: u32,
    /// Time of the frame, s.
    pub time_s: f64,
    /// Of the vehicle, as true.
    pub level: Level,
}

/// What a method adds to a drive.
pub trait Looks {
    /// What a frame leaves, so that an interrupted trial goes on.
    type Kept: Serialize + DeserializeOwned;

    /// Takes from a frame what the method needs of it.
    fn keep(&self, now: &Now<'_>, frame: &Frame) -> Self::Kept;

    /// Takes a look, and judges it.
    ///
    /// # Errors
    /// What a frame or the method reports.
    fn look(&mut self, now: &Now<'_>, kept: Self::Kept) -> Result<()>;
}

/// Takes one look with radar number `which`; what is kept of the frame is kept under `key`.
///
/// # Errors
/// Those of the frame and of the look; what is kept cannot be written.
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

/// Goes through the first `frames` looks of a run with radar number `which`, and tells of each.
///
/// # Errors
/// As [`one_look`].
pub fn drive_through<L: Looks>(
    given: &TrialContext<'_>,
    (drive, which): (&Drive<'_>, usize),
    (run, frames): (u32, u32),
    looks: &mut L,
) -> Result<()> {
    (0..frames).try_for_each(|frame| {
        one_look(given, (drive, which), (run, frame), &format!("run{run}_frame{frame}"), looks)?;
        given.told(run, frame, frames);
        Ok(())
    })
}
