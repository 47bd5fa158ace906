//! Where things of a scenario are and how they go: a position with a velocity, or a trajectory.

use super::toml_file::{At, Document};
use super::trajectory::{self, Outside, Trajectory, TrajectoryTable};
use crate::error::Result;
use glam::DVec3;
use std::ops::Range;

/// Reads where things are and how they go, and remembers what the reader should be told of it.
pub(super) struct Courses<'a, 'b> {
    pub(super) doc: &'a Document<'b>,
    /// Time of the middle of the last frame, s.
    last_s: f64,
    /// What the reader should be told.
    pub(super) notes: Vec<String>,
}

/// Keys of a place: position, velocity, and the trajectory that takes the place of both.
pub(super) type PlaceKeys<'t> = (&'t Option<At<[f64; 3]>>, &'t At<[f64; 3]>, &'t Option<TrajectoryTable>);

impl<'a, 'b> Courses<'a, 'b> {
    /// Of a document whose last frame has its middle at `last_s`.
    pub(super) fn new(doc: &'a Document<'b>, last_s: f64) -> Courses<'a, 'b> {
        Courses { doc, last_s, notes: Vec::new() }
    }

    /// A trajectory, known from a second before the first to a second after the last frame.
    pub(super) fn along(&mut self, key: &str, name: &str, t: &TrajectoryTable) -> Result<Trajectory> {
        let last_s = self.last_s;
        let made = trajectory::build(self.doc, key, t, -1.0..last_s + 1.0)?;
        let (from, to) = made.span_s;
        if from > 0.0 || to < last_s {
            let then = match t.outside {
                Outside::GoOn => "outside of its times it goes straight on",
                Outside::Stay => "outside of its times it stands still",
            };
            self.notes.push(format!(
                "the trajectory of {name} lasts from {from} to {to} s, the frames from 0 to {last_s} s: {then}"
            ));
        }
        Ok(made)
    }

    /// Position, velocity and trajectory; `span` is a value of the table to which they belong.
    pub(super) fn of(
        &mut self,
        key: &str,
        name: &str,
        (position, velocity, trajectory): PlaceKeys<'_>,
        span: &Range<usize>,
    ) -> Result<(DVec3, DVec3, Option<Trajectory>)> {
        let doc = self.doc;
        match (position, trajectory) {
            (Some(p), None) => Ok((doc.vector(p)?, speed(doc, velocity)?, None)),
            (None, Some(t)) if velocity.value == [0.0; 3] => {
                let made = self.along(&format!("{key}.trajectory"), name, t)?;
                Ok((DVec3::ZERO, DVec3::ZERO, Some(made)))
            }
            (None, Some(_)) => {
                let e = doc.bad(&velocity.span, "the motion is given twice");
                Err(e.remedy("keep velocity_mps with position_m, or the trajectory").into())
            }
            (Some(p), Some(_)) => {
                let e = doc.bad(&p.span, "the place is given twice");
                Err(e.remedy("keep position_m, or the trajectory").into())
            }
            (None, None) => Err(doc
                .bad(span, format!("{name} has no place"))
                .key(format!("{key}.position_m"))
                .remedy("give position_m = [x, y, z], or a trajectory")
                .into()),
        }
    }
}

fn speed(doc: &Document<'_>, at: &At<[f64; 3]>) -> Result<DVec3> {
    let v = doc.vector(at)?;
    if v.length() < 1e5 {
        return Ok(v);
    }
    Err(doc.bad(&at.span, "is too fast").allowed("below 1e5 m/s").remedy("give metres per second").into())
}
