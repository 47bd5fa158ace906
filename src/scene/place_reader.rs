//! Where things of a scenario are and how they go: a position with a velocity, or a trajectory.

use super::toml_file::{At, Document};
use super::trajectory::{self, Outside, Trajectory, TrajectoryTable};
use crate::base::error::Result;
use glam::DVec3;
use std::ops::Range;

/// How long a trajectory of a scenario lasts.
#[derive(Debug, Clone, PartialEq)]
pub struct Lasting {
    /// What follows it.
    pub name: String,
    /// First and last waypoint, s.
    pub span_s: (f64, f64),
    /// What happens outside of them.
    pub outside: Outside,
}

impl Lasting {
    /// What the reader should be told when frames last from 0 to `last_s` and the trajectory does not.
    pub(super) fn note(&self, last_s: f64) -> Option<String> {
        let (from, to) = self.span_s;
        let then = match self.outside {
            Outside::GoOn => "goes straight on",
            Outside::Stay => "stands still",
        };
        (from > 0.0 || to < last_s).then(|| {
            let name = &self.name;
            format!("the trajectory of {name} lasts from {from} to {to} s, the frames from 0 to {last_s} s: outside of its times it {then}")
        })
    }
}

/// Reads where things are and how they go, and remembers how long trajectories last.
pub(super) struct PlaceReader<'a, 'b> {
    pub(super) doc: &'a Document<'b>,
    pub(super) lasting: Vec<Lasting>,
}

/// Keys of a place: position, velocity, and the trajectory that takes the place of both.
pub(super) type PlaceKeys<'t> = (&'t Option<At<[f64; 3]>>, &'t At<[f64; 3]>, &'t Option<TrajectoryTable>);

impl<'a, 'b> PlaceReader<'a, 'b> {
    pub(super) fn new(doc: &'a Document<'b>) -> PlaceReader<'a, 'b> {
        PlaceReader { doc, lasting: Vec::new() }
    }

    /// The trajectory of what has that name.
    pub(super) fn along(&mut self, key: &str, name: &str, t: &TrajectoryTable) -> Result<Trajectory> {
        let made = trajectory::build(self.doc, key, t)?;
        self.lasting.push(Lasting { name: name.into(), span_s: made.span_s, outside: t.outside });
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
