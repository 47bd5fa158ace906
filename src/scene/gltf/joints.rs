//! Motions as text, in and out: `extras.catseye.motion` of a node and `extras.catseye.channels` of the file, all in ISO
//! axes, metres, seconds and radians.

use super::importer::{Channels, Importer};
use crate::base::error::{Error, Result, json_in_words};
use crate::scene::motion::{Channel, Interpolation, Joint};
use crate::scene::toml_file::clip;
use crate::scene::turn::Turn;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::sync::Arc;

/// How far the length of an axis or quaternion of a file may be from one: what six digits leave.
const UNIT: f64 = 1e-6;

#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum JointText {
    Fixed {
        rotation: [f64; 4],
        translation_m: [f64; 3],
    },
    Line {
        velocity_mps: [f64; 3],
    },
    Spin {
        axis: [f64; 3],
        rate_rad_per_s: f64,
        angle_rad: f64,
    },
    Swing {
        axis: [f64; 3],
        amplitude_rad: f64,
        rate_rad_per_s: f64,
        phase_rad: f64,
    },
    Hinge {
        at_m: [f64; 3],
        axis: [f64; 3],
        turn: TurnText,
        speed_mps: f64,
        clock_s: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        distance: Option<usize>,
    },
    Roll {
        axis: [f64; 3],
        radius_m: f64,
        distance: usize,
    },
    Track {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        position: Option<usize>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rotation: Option<usize>,
    },
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum TurnText {
    Roll {
        radius_m: f64,
    },
    Crank {
        development_m: f64,
    },
    Level {
        development_m: f64,
    },
    Hip {
        leg_m: f64,
        phase: f64,
    },
    Knee {
        leg_m: f64,
        phase: f64,
    },
    Shoulder {
        leg_m: f64,
        phase: f64,
    },
    Pedal {
        crank_m: [f64; 3],
        arm_m: f64,
        thigh_m: f64,
        shank_m: f64,
        development_m: f64,
        half: bool,
        knee: bool,
    },
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Between {
    Step,
    Linear,
    Cubic,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelText<V> {
    interpolation: Between,
    times_s: Vec<f64>,
    values: Vec<V>,
    /// Into and out of each value, per second.
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    tangents: Vec<[V; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    repeat_s: Option<f64>,
    /// Beyond its ends at the rate that it has there.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    goes_on: bool,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct ChannelsText {
    distances_m: Vec<ChannelText<f64>>,
    positions_m: Vec<ChannelText<[f64; 3]>>,
    rotations: Vec<ChannelText<[f64; 4]>>,
}

fn text_of<T: Copy, V>(channel: &Channel<T>, plain: impl Fn(T) -> V) -> ChannelText<V> {
    ChannelText {
        interpolation: match channel.interpolation() {
            Interpolation::Step => Between::Step,
            Interpolation::Linear => Between::Linear,
            Interpolation::Cubic => Between::Cubic,
        },
        times_s: channel.times_s().to_vec(),
        values: channel.values().iter().map(|v| plain(*v)).collect(),
        tangents: channel.tangents().iter().map(|(a, b)| [plain(*a), plain(*b)]).collect(),
        repeat_s: channel.repeat_s(),
        goes_on: channel.goes_on(),
    }
}

fn channel_of<V: Copy, T: Copy>(text: &ChannelText<V>, made: impl Fn(V) -> T) -> Result<Arc<Channel<T>>> {
    let between = match text.interpolation {
        Between::Step => Interpolation::Step,
        Between::Linear => Interpolation::Linear,
        Between::Cubic => Interpolation::Cubic,
    };
    let values = text.values.iter().map(|v| made(*v)).collect();
    let tangents = text.tangents.iter().map(|[a, b]| (made(*a), made(*b))).collect();
    let channel = Channel::new(text.times_s.clone(), values, tangents, between)?;
    let channel = if text.goes_on { channel.going_on() } else { channel };
    Ok(Arc::new(match text.repeat_s {
        Some(period) => channel.repeated(period)?,
        None => channel,
    }))
}

fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() <= UNIT
}

impl TurnText {
    fn new(turn: Turn) -> TurnText {
        match turn {
            Turn::Roll { radius_m } => TurnText::Roll { radius_m },
            Turn::Crank { development_m } => TurnText::Crank { development_m },
            Turn::Level { development_m } => TurnText::Level { development_m },
            Turn::Hip { leg_m, phase } => TurnText::Hip { leg_m, phase },
            Turn::Knee { leg_m, phase } => TurnText::Knee { leg_m, phase },
            Turn::Shoulder { leg_m, phase } => TurnText::Shoulder { leg_m, phase },
            Turn::Pedal { crank_m, arm_m, thigh_m, shank_m, development_m, half, knee } => {
                let crank_m = crank_m.to_array();
                TurnText::Pedal { crank_m, arm_m, thigh_m, shank_m, development_m, half, knee }
            }
        }
    }

    /// Computes how the joint turns. Returns an error for lengths that are not above zero, or a leg that does not reach
    /// its pedal.
    fn turn(self) -> Result<Turn, &'static str> {
        let long = |lengths: &[f64]| match lengths.iter().all(|l| *l > 0.0) {
            true => Ok(()),
            false => Err("a length of its rotation is not above 0"),
        };
        Ok(match self {
            TurnText::Roll { radius_m } => {
                long(&[radius_m])?;
                Turn::Roll { radius_m }
            }
            TurnText::Crank { development_m } => {
                long(&[development_m])?;
                Turn::Crank { development_m }
            }
            TurnText::Level { development_m } => {
                long(&[development_m])?;
                Turn::Level { development_m }
            }
            TurnText::Hip { leg_m, phase } => {
                long(&[leg_m])?;
                Turn::Hip { leg_m, phase }
            }
            TurnText::Knee { leg_m, phase } => {
                long(&[leg_m])?;
                Turn::Knee { leg_m, phase }
            }
            TurnText::Shoulder { leg_m, phase } => {
                long(&[leg_m])?;
                Turn::Shoulder { leg_m, phase }
            }
            TurnText::Pedal { crank_m, arm_m, thigh_m, shank_m, development_m, half, knee } => {
                long(&[arm_m, thigh_m, shank_m, development_m])?;
                let crank_m = DVec3::from(crank_m);
                let d = crank_m.x.hypot(crank_m.z);
                if d - arm_m <= (thigh_m - shank_m).abs() || d + arm_m >= thigh_m + shank_m {
                    return Err("its leg does not reach the pedal over the whole turn");
                }
                Turn::Pedal { crank_m, arm_m, thigh_m, shank_m, development_m, half, knee }
            }
        })
    }
}

impl JointText {
    fn joint(self, channels: &Channels) -> Result<Joint, &'static str> {
        let direction = |axis: [f64; 3]| {
            let axis = DVec3::from(axis);
            if is_unit(axis.length()) { Ok(axis) } else { Err("its axis is not a unit vector") }
        };
        const MISSING: &str = "names a channel that is not in extras.catseye.channels of the file";
        Ok(match self {
            JointText::Fixed { rotation, translation_m } => {
                let q = DQuat::from_array(rotation);
                if !is_unit(q.length()) {
                    return Err("its rotation is not a unit quaternion");
                }
                Joint::Fixed(q, translation_m.into())
            }
            JointText::Line { velocity_mps } => Joint::Line(velocity_mps.into()),
            JointText::Spin { axis, rate_rad_per_s, angle_rad } => {
                Joint::Spin { axis: direction(axis)?, rate_rad_per_s, angle_rad }
            }
            JointText::Swing { axis, amplitude_rad, rate_rad_per_s, phase_rad } => {
                Joint::Swing { axis: direction(axis)?, amplitude_rad, rate_rad_per_s, phase_rad }
            }
            JointText::Hinge { at_m, axis, turn, speed_mps, clock_s, distance } => Joint::Hinge {
                at_m: at_m.into(),
                axis: direction(axis)?,
                turn: turn.turn()?,
                speed_mps,
                clock_s,
                way_m: match distance {
                    Some(c) => Some(channels.distances_m.get(c).ok_or(MISSING)?.clone()),
                    None => None,
                },
            },
            JointText::Roll { axis, radius_m, distance } => {
                if radius_m <= 0.0 {
                    return Err("its radius is not above 0");
                }
                let distance_m = channels.distances_m.get(distance).ok_or(MISSING)?.clone();
                Joint::Roll { axis: direction(axis)?, radius_m, distance_m }
            }
            JointText::Track { position, rotation } => Joint::Track {
                position_m: match position {
                    Some(c) => Some(channels.positions_m.get(c).ok_or(MISSING)?.clone()),
                    None => None,
                },
                rotation: match rotation {
                    Some(c) => Some(channels.rotations.get(c).ok_or(MISSING)?.clone()),
                    None => None,
                },
            },
        })
    }
}

impl Importer<'_> {
    /// Reads `extras.catseye.channels` of the file.
    pub(super) fn read_channels(&mut self) -> Result<()> {
        let key = "extras.catseye.channels";
        let Some(mut extras) = self.extras(&self.root.extras, "extras.catseye")? else { return Ok(()) };
        let Some(value) = extras.remove("channels") else { return Ok(()) };
        let text: ChannelsText = serde_json::from_value(value).map_err(|e| {
            self.bad(key, format!("are not the channels of motions: {}", clip(&json_in_words(&e))))
                .allowed(
                    "distances_m, positions_m, rotations, each a list of {interpolation, times_s, values}",
                )
                .remedy("correct it, or write the scene again")
        })?;
        fn all<V: Copy, T: Copy>(
            me: &Importer<'_>,
            name: &str,
            list: &[ChannelText<V>],
            made: impl Fn(V) -> T,
        ) -> Result<Vec<Arc<Channel<T>>>> {
            let mut out = Vec::with_capacity(list.len());
            for (i, text) in list.iter().enumerate() {
                let place = format!("extras.catseye.channels.{name}[{i}]");
                out.push(channel_of(text, &made).map_err(|e| match e {
                    Error::Input(b) => b.file(me.file).key(place).remedy("correct it").into(),
                    e => e,
                })?);
            }
            Ok(out)
        }
        let turns = text.rotations.iter().flat_map(|c| &c.values);
        if let Some(q) = turns.map(|q| DQuat::from_array(*q)).find(|q| !is_unit(q.length())) {
            return Err(self
                .bad(format!("{key}.rotations"), "contains a rotation that is not a unit quaternion")
                .value(q)
                .remedy("correct it")
                .into());
        }
        self.channels = Channels {
            distances_m: all(self, "distances_m", &text.distances_m, |v| v)?,
            positions_m: all(self, "positions_m", &text.positions_m, DVec3::from)?,
            rotations: all(self, "rotations", &text.rotations, DQuat::from_array)?,
        };
        Ok(())
    }

    /// The joints of `extras.catseye.motion`, from the body outwards.
    pub(super) fn joints(&self, key: &str, value: &Value) -> Result<Vec<Joint>> {
        let list = value.as_array().filter(|l| !l.is_empty()).ok_or_else(|| {
            self.bad(key, "is not a list of joints")
                .value(clip(&value.to_string()))
                .remedy(r#"give [{"kind": "line", "velocity_mps": [x, y, z]}, ...], from the body outwards"#)
        })?;
        let mut joints = Vec::with_capacity(list.len());
        for (k, joint) in list.iter().enumerate() {
            let bad = |what: &str| {
                self.bad(format!("{key}[{k}]"), what.to_string())
                    .value(clip(&joint.to_string()))
                    .allowed("fixed, line, spin, swing, hinge, roll, track with their keys")
                    .remedy("correct it, or write the scene again")
            };
            let text: JointText = serde_json::from_value(joint.clone())
                .map_err(|e| bad(&format!("is not a joint: {}", clip(&e.to_string()))))?;
            joints.push(text.joint(&self.channels).map_err(bad)?);
        }
        Ok(joints)
    }
}

/// Collects the channels of a scene's motions while they are written.
#[derive(Default)]
pub(super) struct Writer {
    text: ChannelsText,
    known: HashMap<usize, usize>,
}

impl Writer {
    /// `extras.catseye.motion` of an object.
    pub(super) fn motion(&mut self, joints: &[Joint]) -> Result<Value, String> {
        let texts: Vec<JointText> = joints.iter().map(|j| self.joint(j)).collect();
        let value = serde_json::to_value(texts).map_err(|e| e.to_string())?;
        // JSON has no numbers that are not finite, and serde_json writes null for them.
        if holds_null(&value) { Err("a motion is not finite".into()) } else { Ok(value) }
    }

    /// `extras.catseye.channels` of the file, if any joint has one.
    pub(super) fn channels(self) -> Result<Option<Value>, String> {
        if self.known.is_empty() {
            return Ok(None);
        }
        let value = serde_json::to_value(self.text).map_err(|e| e.to_string())?;
        if holds_null(&value) { Err("a channel of a motion is not finite".into()) } else { Ok(Some(value)) }
    }

    fn joint(&mut self, joint: &Joint) -> JointText {
        match joint {
            Joint::Fixed(rotation, translation) => {
                JointText::Fixed { rotation: rotation.to_array(), translation_m: translation.to_array() }
            }
            Joint::Line(velocity) => JointText::Line { velocity_mps: velocity.to_array() },
            Joint::Spin { axis, rate_rad_per_s, angle_rad } => JointText::Spin {
                axis: axis.to_array(),
                rate_rad_per_s: *rate_rad_per_s,
                angle_rad: *angle_rad,
            },
            Joint::Swing { axis, amplitude_rad, rate_rad_per_s, phase_rad } => JointText::Swing {
                axis: axis.to_array(),
                amplitude_rad: *amplitude_rad,
                rate_rad_per_s: *rate_rad_per_s,
                phase_rad: *phase_rad,
            },
            Joint::Hinge { at_m, axis, turn, speed_mps, clock_s, way_m } => JointText::Hinge {
                at_m: at_m.to_array(),
                axis: axis.to_array(),
                turn: TurnText::new(*turn),
                speed_mps: *speed_mps,
                clock_s: *clock_s,
                distance: way_m
                    .as_ref()
                    .map(|c| shared(&mut self.known, &mut self.text.distances_m, c, |v| v)),
            },
            Joint::Roll { axis, radius_m, distance_m } => {
                let list = &mut self.text.distances_m;
                let distance = shared(&mut self.known, list, distance_m, |v| v);
                JointText::Roll { axis: axis.to_array(), radius_m: *radius_m, distance }
            }
            Joint::Track { position_m, rotation } => JointText::Track {
                position: position_m
                    .as_ref()
                    .map(|c| shared(&mut self.known, &mut self.text.positions_m, c, |v| v.to_array())),
                rotation: rotation
                    .as_ref()
                    .map(|c| shared(&mut self.known, &mut self.text.rotations, c, |v| v.to_array())),
            },
        }
    }
}

/// Place of a channel in a list, where it is put the first time. Channels of all kinds have different addresses.
fn shared<T: Copy, V>(
    known: &mut HashMap<usize, usize>,
    list: &mut Vec<ChannelText<V>>,
    channel: &Arc<Channel<T>>,
    plain: impl Fn(T) -> V,
) -> usize {
    *known.entry(Arc::as_ptr(channel) as usize).or_insert_with(|| {
        list.push(text_of(channel, plain));
        list.len() - 1
    })
}

fn holds_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(list) => list.iter().any(holds_null),
        Value::Object(map) => map.values().any(holds_null),
        _ => false,
    }
}
