//! A part of a vehicle: its mesh, its paints, and the joints on which it hangs.

use super::motion::{self, Joint, PartMotion};
use crate::base::frames::{Pose, Target};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};

/// A rigid part.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of the part.
    pub name: String,
    /// Added to the class of the body with a dot; empty for the body itself.
    pub suffix: &'static str,
    /// In the part's frame, whose origin is the last joint. Materials index [`Body::materials`](super::Body::materials).
    pub mesh: Mesh,
    /// Frame in which the first joint is given, in the body's frame; of a part without joints, its own.
    pub pose: Pose<Target, Target>,
    /// Joints from the body outwards; none where the part stands still on it.
    pub joints: Vec<Joint>,
}

impl Part {
    /// A part that stands still on the body.
    pub(super) fn still(name: &str, suffix: &'static str, mesh: Mesh) -> Part {
        Part { name: name.into(), suffix, mesh, pose: Pose::IDENTITY, joints: Vec::new() }
    }

    /// A part that hangs on joints, the first one given from `at_m`.
    pub(super) fn hinged(
        name: impl Into<String>,
        suffix: &'static str,
        mesh: Mesh,
        at_m: DVec3,
        joints: &[Joint],
    ) -> Part {
        let pose = Pose::new(DQuat::IDENTITY, at_m);
        Part { name: name.into(), suffix, mesh, pose, joints: joints.to_vec() }
    }

    /// Where the part is and how it moves in its body's frame, `time_s` after the start, at a steady
    /// `speed_mps` forwards (exact closed forms).
    pub fn pose_at(&self, speed_mps: f64, time_s: f64) -> PartMotion {
        motion::follow(&self.pose, &self.joints, speed_mps, time_s)
    }

    /// Whether it moves in its body.
    pub fn moves(&self) -> bool {
        !self.joints.is_empty()
    }
}

/// What the builders paint with, before unused ones are dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Paint {
    /// Steel.
    Steel,
    /// Windows: what is behind them is not followed.
    Glass,
    /// Aluminium.
    Aluminium,
    /// 3 mm of unfilled polypropylene over the cross member of a bumper.
    Bumper,
    /// 10 mm of rubber over the steel belts of a tyre.
    Tyre,
    /// Skin; clothes are left out: eight common fabrics let 300 GHz and less pass with under 3 dB
    /// (Bjarnason et al., Appl. Phys. Lett. 85 (2004) 519).
    Skin,
}
