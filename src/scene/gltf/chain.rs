//! What moves along a line of nodes, as a chain of rigid joints.

use super::importer::Chain;
use super::importer::Importer;
use super::options::{MAX_JOINTS, RIGID};
use super::place::split;
use crate::base::error::{Error, Result};
use crate::base::frames::{Pose, Target, World};
use crate::scene::motion::{Joint, Motion};
use glam::{DMat3, DQuat, DVec3};
use std::sync::Arc;

impl Chain {
    pub(super) fn new(pose: &Pose<Target, World>, rest: DMat3) -> Chain {
        let mut chain = Chain { joints: Vec::new(), rest };
        chain.fixed(pose.rotation, pose.translation_m);
        chain
    }

    fn fixed(&mut self, rotation: DQuat, translation_m: DVec3) {
        if rotation == DQuat::IDENTITY && translation_m == DVec3::ZERO {
            return;
        }
        match self.joints.last_mut() {
            Some(Joint::Fixed(q, t)) => {
                *t += *q * translation_m;
                *q = (*q * rotation).normalize();
            }
            _ => self.joints.push(Joint::Fixed(rotation, translation_m)),
        }
    }

    /// Goes on to a node that stands still in this one, at this linear map and place (ISO axes, metres).
    pub(super) fn still(&mut self, linear: DMat3, place_m: DVec3) {
        let (rotation, rest) = split(self.rest * linear);
        self.fixed(rotation, self.rest * place_m);
        self.rest = rest;
    }

    /// The motion of what is fixed to the node and drifts with `velocity_mps` in the world besides.
    pub(super) fn motion(&self, velocity_mps: DVec3) -> Motion {
        let mut joints: Vec<Joint> = self.joints.iter().rev().cloned().collect();
        if velocity_mps != DVec3::ZERO {
            joints.push(Joint::Line(velocity_mps));
        }
        Motion { joints }
    }

    pub(super) fn len(&self) -> usize {
        self.joints.len()
    }
}

impl Importer<'_> {
    /// The chain of node `i` from that of the node above it.
    pub(super) fn follow(&mut self, above: &Chain, i: usize, own: Option<&[Joint]>) -> Result<Chain> {
        let mut chain = above.clone();
        self.count_joints(chain.len())?;
        if let Some(own) = own {
            if chain.rest != DMat3::IDENTITY {
                return Err(self
                    .bad(
                        format!("nodes[{i}].extras.catseye.motion"),
                        format!("{} has a parent node that is scaled or mirrored", self.node_called(i)),
                    )
                    .remedy("apply the scale of the parent nodes, since a motion is in metres")
                    .into());
            }
            chain.joints.extend(own.iter().rev().cloned());
            return Ok(chain);
        }
        let (axes, unit) = (self.axes, self.options.unit_m);
        let moving = self.moves.get(&i).filter(|m| m.any());
        let Some(moves) = moving else {
            let local = self.local(i)?;
            chain.still(self.in_iso(local.matrix3), axes * local.translation * unit);
            return Ok(chain);
        };
        let (t, q, s) = self.trs(i)?;
        let named = |e: Error| match e {
            Error::Input(b) => {
                b.file(self.file).key(format!("the animation of {}", self.node_called(i))).into()
            }
            e => e,
        };
        let rest = chain.rest;
        let position = match moves.translation.as_ref().filter(|k| k.constant().is_none()) {
            Some(k) => {
                let made = |v: [f64; 3]| rest * (axes * DVec3::from(v)) * unit;
                Some(Arc::new(k.channel(made).map_err(named)?))
            }
            None => None,
        };
        let rotation = match moves.rotation.as_ref().filter(|k| k.constant().is_none()) {
            Some(k) => {
                // What is left over has to be a similarity B = s O: then B R = (O R O') B, a rotation about the axis O n.
                let size = rest.determinant().abs().cbrt();
                let o = rest * (1.0 / size);
                if !(size > 0.0 && (o.transpose() * o).abs_diff_eq(DMat3::IDENTITY, 2.0 * RIGID)) {
                    return Err(self
                        .bad(
                            format!("nodes[{i}]"),
                            format!("{} rotates under a node whose scale differs between directions", self.node_called(i)),
                        )
                        .remedy("apply the scale of the parent nodes (bodies are rigid), or choose another animation with --animation")
                        .into());
                }
                let turned = o * axes * o.determinant().signum();
                let made = |v: [f64; 4]| {
                    let n = turned * DVec3::new(v[0], v[1], v[2]);
                    DQuat::from_xyzw(n.x, n.y, n.z, v[3])
                };
                Some(Arc::new(k.channel(made).map_err(named)?))
            }
            None => None,
        };
        let stretch = self.in_iso(DMat3::from_diagonal(s));
        if position.is_none() {
            chain.fixed(DQuat::IDENTITY, rest * (axes * t) * unit);
        }
        let turns = rotation.is_some();
        chain.joints.push(Joint::Track { position_m: position, rotation });
        if turns {
            chain.rest = rest * stretch;
            if chain.rest.abs_diff_eq(DMat3::IDENTITY, RIGID) {
                chain.rest = DMat3::IDENTITY;
            }
        } else {
            chain.still(self.in_iso(DMat3::from_quat(q)) * stretch, DVec3::ZERO);
        }
        Ok(chain)
    }

    /// Errors when all chains together have too many joints.
    pub(super) fn count_joints(&mut self, more: usize) -> Result<()> {
        self.joints += more;
        if self.joints > MAX_JOINTS {
            return Err(self
                .bad("nodes", "the hierarchy has too many animated nodes")
                .allowed(format!("up to {MAX_JOINTS} joints of all objects"))
                .remedy("flatten the hierarchy")
                .into());
        }
        Ok(())
    }
}
