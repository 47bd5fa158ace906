//! Animations of a file: which of them move its nodes, and their keys.

use super::importer::Importer;
use super::importer::{Keys, Moves};
use super::options::{Animations, MAX_KEYS};
use crate::base::error::{BadInput, Result, nearest};
use crate::scene::motion::{Channel, Interpolation};
use crate::scene::toml_file::clip;
use gltf::json;
use json::animation::Property;
use json::validation::Checked;
use std::collections::HashSet;

/// A scale may change by this much of itself and count as constant: a metre by a tenth of a millimetre, a fortieth of
/// a wavelength at 77 GHz.
const SAME_SCALE: f64 = 1e-4;

impl<const N: usize> Keys<N> {
    /// The value of what does not change.
    pub(super) fn constant(&self) -> Option<[f64; N]> {
        let first = *self.values.first()?;
        let flat = |(a, b): &([f64; N], [f64; N])| *a == [0.0; N] && *b == [0.0; N];
        (self.values.iter().all(|v| *v == first) && self.tangents.iter().all(flat)).then_some(first)
    }

    /// Makes a channel of the values. Returns the errors of [`Channel::new`].
    pub(super) fn channel<T: Copy>(&self, made: impl Fn([f64; N]) -> T) -> Result<Channel<T>> {
        let values = self.values.iter().map(|v| made(*v)).collect();
        let tangents = self.tangents.iter().map(|(a, b)| (made(*a), made(*b))).collect();
        let channel = Channel::new(self.times_s.clone(), values, tangents, self.interpolation)?;
        match self.repeat_s {
            Some(period) => channel.repeated(period),
            None => Ok(channel),
        }
    }

    /// The first value of a scale that stays the same to [`SAME_SCALE`].
    fn same(&self) -> Option<[f64; N]> {
        let first = *self.values.first()?;
        let small = |change: f64, of: f64| change.abs() <= SAME_SCALE * of.abs();
        let longest = self.times_s.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        let near = |v: &[f64; N]| v.iter().zip(&first).all(|(a, b)| small(a - b, *b));
        let flat = |t: &[f64; N]| t.iter().zip(&first).all(|(a, b)| small(a * longest, *b));
        let same = self.values.iter().all(near) && self.tangents.iter().all(|(a, b)| flat(a) && flat(b));
        same.then_some(first)
    }
}

impl Moves {
    /// Whether anything changes.
    pub(super) fn any(&self) -> bool {
        self.translation.as_ref().is_some_and(|k| k.constant().is_none())
            || self.rotation.as_ref().is_some_and(|k| k.constant().is_none())
    }
}

impl Importer<'_> {
    /// A node with its name, for messages.
    pub(super) fn node_called(&self, i: usize) -> String {
        match self.root.nodes.get(i).and_then(|n| n.name.as_deref()).filter(|n| !n.is_empty()) {
            Some(name) => format!("node {i} ('{}')", clip(name)),
            None => format!("node {i}"),
        }
    }

    fn animation_called(&self, a: usize) -> String {
        match self.root.animations[a].name.as_deref().filter(|n| !n.is_empty()) {
            Some(name) => format!("'{}'", clip(name)),
            None => format!("{a}"),
        }
    }

    /// Whether the program that wrote the file says that an animation only shows what extras say; whether it repeats.
    fn animation_extras(&self, a: usize) -> Result<(bool, bool)> {
        let key = format!("animations[{a}].extras.catseye");
        let (mut shows, mut repeats) = (false, false);
        for (k, v) in self.extras(&self.root.animations[a].extras, &key)?.iter().flat_map(|m| m.iter()) {
            let flag = match k.as_str() {
                "repeat" => &mut repeats,
                "shows_extras" => &mut shows,
                _ => return Err(self.unknown_key(&key, k, &["repeat", "shows_extras"]).into()),
            };
            *flag = v.as_bool().ok_or_else(|| {
                self.bad(format!("{key}.{k}"), "is not true or false")
                    .value(clip(&v.to_string()))
                    .remedy("correct it")
            })?;
        }
        Ok((shows, repeats))
    }

    /// The animations to take, with whether they repeat, in the order of the file.
    fn chosen_animations(&mut self) -> Result<Vec<(usize, bool)>> {
        let mut list = Vec::new();
        for a in 0..self.root.animations.len() {
            let (shows, repeats) = self.animation_extras(a)?;
            if !shows {
                list.push((a, repeats));
            }
        }
        match &self.options.animations {
            Animations::All => Ok(list),
            Animations::None => {
                if !list.is_empty() {
                    self.note(format!("{} animations are left out, as requested", list.len()));
                }
                Ok(Vec::new())
            }
            Animations::Named(wanted) => {
                let name = |a: usize| self.root.animations[a].name.clone().unwrap_or(a.to_string());
                let found: Vec<_> = list.iter().copied().filter(|(a, _)| name(*a) == *wanted).collect();
                if !found.is_empty() {
                    return Ok(found);
                }
                let names: Vec<String> = list.iter().map(|(a, _)| name(*a)).collect();
                let bad = BadInput::new("no animation of the file has this name")
                    .file(self.file)
                    .key("animation")
                    .value(clip(wanted))
                    .allowed(match names.is_empty() {
                        true => "none, the file has no animations".into(),
                        false => clip(&names.join(", ")),
                    });
                Err(match nearest(wanted, names.iter().map(String::as_str)) {
                    Some(n) => bad.remedy(format!("did you mean '{n}'?")),
                    None => {
                        bad.remedy("leave it out to use all animations that do not contradict each other")
                    }
                }
                .into())
            }
        }
    }

    /// Fills `self.moves`. `own[i]`: node i moves as its extras say.
    pub(super) fn read_animations(&mut self, own: &[bool]) -> Result<()> {
        // Who moves what: an animation that moves what another one does is another way to move, not an addition.
        let mut taken: HashSet<(usize, u8)> = HashSet::new();
        let mut keys = 0;
        for (a, repeats) in self.chosen_animations()? {
            let targets = self.targets(a, own)?;
            if let Some((_, i, _)) = targets.iter().find(|(_, i, p)| taken.contains(&(*i, *p as u8))) {
                let (this, node) = (self.animation_called(a), self.node_called(*i));
                self.note(format!(
                    "animation {this} is left out: another one moves {node} already; choose one with --animation"
                ));
                continue;
            }
            taken.extend(targets.iter().map(|(_, i, p)| (*i, *p as u8)));
            let mut last_s: f64 = 0.0;
            for (c, i, property) in &targets {
                let what = format!("animations[{a}].channels[{c}] of {}", self.node_called(*i));
                let moves = match property {
                    Property::Translation => {
                        let k = self.keys::<3>(a, *c, &what)?;
                        last_s = k.times_s.last().copied().unwrap_or(0.0).max(last_s);
                        keys += k.values.len();
                        Moves { translation: Some(k), ..Moves::default() }
                    }
                    Property::Rotation => {
                        let mut k = self.keys::<4>(a, *c, &what)?;
                        for v in &mut k.values {
                            *v = self.quaternion(*v, &what)?.to_array();
                        }
                        last_s = k.times_s.last().copied().unwrap_or(0.0).max(last_s);
                        keys += k.values.len();
                        Moves { rotation: Some(k), ..Moves::default() }
                    }
                    Property::Scale => {
                        let k = self.keys::<3>(a, *c, &what)?;
                        last_s = k.times_s.last().copied().unwrap_or(0.0).max(last_s);
                        let scale = k.same().ok_or_else(|| {
                            self.bad(&what, "changes a scale, but bodies are rigid")
                                .remedy("remove that channel, or choose another animation with --animation")
                        })?;
                        Moves { scale: Some(scale), ..Moves::default() }
                    }
                    Property::MorphTargetWeights => continue,
                };
                if keys > MAX_KEYS {
                    return Err(self
                        .bad("animations", "too many keys")
                        .allowed(format!("up to {MAX_KEYS} in all"))
                        .remedy("reduce the number of keys, or choose one animation with --animation")
                        .into());
                }
                let known = self.moves.entry(*i).or_default();
                known.translation = moves.translation.or(known.translation.take());
                known.rotation = moves.rotation.or(known.rotation.take());
                known.scale = moves.scale.or(known.scale.take());
            }
            if repeats && last_s > 0.0 {
                for (_, i, property) in &targets {
                    let Some(moves) = self.moves.get_mut(i) else { continue };
                    match (property, &mut moves.translation, &mut moves.rotation) {
                        (Property::Translation, Some(k), _) => k.repeat_s = Some(last_s),
                        (Property::Rotation, _, Some(k)) => k.repeat_s = Some(last_s),
                        _ => {}
                    }
                }
            }
        }
        Ok(())
    }

    /// (channel, node, property) of what an animation moves. Errors: indices out of range, a property moved twice.
    fn targets(&mut self, a: usize, own: &[bool]) -> Result<Vec<(usize, usize, Property)>> {
        let mut targets: Vec<(usize, usize, Property)> = Vec::new();
        let mut seen = HashSet::new();
        for c in 0..self.root.animations[a].channels.len() {
            let channel = &self.root.animations[a].channels[c];
            let (i, path) = (channel.target.node.value(), channel.target.path);
            let n = self.root.nodes.len();
            if i >= n {
                return Err(self
                    .out_of_range(format!("animations[{a}].channels[{c}].target.node"), i, n)
                    .into());
            }
            let Checked::Valid(property) = path else {
                self.note(format!(
                    "animation {} changes properties other than those of nodes, which is left out",
                    self.animation_called(a)
                ));
                continue;
            };
            if property == Property::MorphTargetWeights {
                let node = self.node_called(i);
                self.note(format!("{node} has animated morph targets, which are left out"));
                continue;
            }
            if own[i] {
                let node = self.node_called(i);
                self.note(format!("{node} follows its extras.catseye.motion, not an animation"));
                continue;
            }
            if !seen.insert((i, property as u8)) {
                let node = self.node_called(i);
                return Err(self
                    .bad(format!("animations[{a}].channels[{c}]"), format!("moves {node} a second time"))
                    .remedy("keep one channel for each property of a node")
                    .into());
            }
            targets.push((c, i, property));
        }
        Ok(targets)
    }

    fn keys<const N: usize>(&self, a: usize, c: usize, what: &str) -> Result<Keys<N>> {
        let animation = &self.root.animations[a];
        let s = animation.channels[c].sampler.value();
        let Some(sampler) = animation.samplers.get(s) else {
            return Err(self.out_of_range(format!("{what}: sampler"), s, animation.samplers.len()).into());
        };
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err(self
                .bad(what, "has an unknown interpolation")
                .allowed("STEP, LINEAR, CUBICSPLINE")
                .remedy("export the file again")
                .into());
        };
        let interpolation = match interpolation {
            json::animation::Interpolation::Step => Interpolation::Step,
            json::animation::Interpolation::Linear => Interpolation::Linear,
            json::animation::Interpolation::CubicSpline => Interpolation::Cubic,
        };
        let times = self.elements::<1>(sampler.input.value(), &format!("{what}: input"))?;
        let times_s: Vec<f64> = times.into_iter().map(|[t]| t).collect();
        if times_s.is_empty() {
            return Err(self.bad(what, "has no keys").remedy("remove the channel").into());
        }
        if let Some(k) = times_s.iter().position(|t| !(t.is_finite() && *t >= 0.0)) {
            return Err(self
                .bad(what, format!("key {k} has no time"))
                .value(times_s[k])
                .allowed("0 s or more, finite")
                .remedy("export the file again")
                .into());
        }
        if let Some(k) = times_s.windows(2).position(|w| w[0] >= w[1]) {
            return Err(self
                .bad(what, format!("key {} is not later than the one before", k + 1))
                .value(format!("{} s after {} s", times_s[k + 1], times_s[k]))
                .remedy("sort the keys; export the file again")
                .into());
        }
        let rows = self.elements::<N>(sampler.output.value(), &format!("{what}: output"))?;
        let each = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        if rows.len() != each * times_s.len() {
            return Err(self
                .bad(what, format!("{} values for {} times", rows.len(), times_s.len()))
                .allowed(format!("{each} for each time"))
                .remedy("the animation is damaged; export it again")
                .into());
        }
        if let Some(k) = rows.iter().position(|r| r.iter().any(|x| !(x.is_finite() && x.abs() < 1e12))) {
            return Err(self
                .bad(what, format!("value {k} is not finite"))
                .value(clip(&format!("{:?}", rows[k])))
                .remedy("the animation is damaged; export it again")
                .into());
        }
        let (values, tangents) = match each {
            1 => (rows, Vec::new()),
            _ => rows.chunks_exact(3).map(|k| (k[1], (k[0], k[2]))).unzip(),
        };
        Ok(Keys { times_s, values, tangents, interpolation, repeat_s: None })
    }
}
