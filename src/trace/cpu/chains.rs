//! Chains of mirrors followed by lines ([`super::lines`]): what a radar lights by way of them, and what it sees of that.
//!
//! A chain is a list of patches: the radar lights the first, each mirrors what lights it to the next. Its view is that of the radar's image
//! behind all but the last of them. Level by level every lit patch that mirrors makes a new view, and what that lights of each patch
//! ahead is a chain of one bounce more.

use super::beams::{Node, Side};
use super::lines::{Fragment, Scene, View};
use crate::base::tasks::Tasks;
use crate::geom::edge_table::EdgeTable;
use crate::geom::faces::{Faces, NOT_CURVED};
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::{BeamOptions, Frame};
use rayon::prelude::*;
use std::iter::successors;
use std::ops::Range;

/// Lit areas below this are rounding, m².
const LEAST_M2: f64 = 1e-13;

/// What is lit of a patch by way of the patches before it.
#[derive(Debug, Clone)]
pub struct Chain {
    /// The chain as a node of beams: its parent is the chain without its last patch, its face the one in whose plane the outlines lie, the
    /// origin of its frame the radar's image from which the patch is lit.
    pub node: Node,
    /// The patch that is lit.
    pub patch: u32,
    /// Outline of what is lit.
    pub lit: Vec<Fragment>,
    /// Outline of what the radar sees of that; empty for the first bounce, where it is all, and for curved surfaces.
    pub seen: Vec<Fragment>,
}

impl Chain {
    /// Outline of what is lit and seen.
    pub fn returning(&self) -> &[Fragment] {
        if self.node.bounce == 1 { &self.lit } else { &self.seen }
    }

    /// The same chain where face i has the number `numbers[i]`.
    pub(crate) fn renumbered(mut self, numbers: &[u32]) -> Chain {
        self.node.face = numbers[self.node.face as usize];
        for fragment in self.lit.iter_mut().chain(&mut self.seen) {
            fragment.face = numbers[fragment.face as usize];
        }
        self
    }
}

/// All chains of a radar that looks through windows from one point, each after its parent, in a fixed order.
pub fn follow(faces: &Faces, table: &EdgeTable, windows: &[Frame], options: &BeamOptions) -> Vec<Chain> {
    let Some(scene) = Scene::new(faces, table, windows) else { return Vec::new() };
    let mut follower = Follower::new(&scene, options);
    loop {
        let new = {
            let views = follower.views();
            if views.is_empty() {
                break;
            }
            let lit = views.par_iter().map_tasks(|(_, view)| view.fragments()).collect();
            follower.children(&views, lit)
        };
        follower.extend(new);
    }
    follower.chains
}

/// Chains as far as they are followed: the views of one bounce give fragments, and these the chains of the next.
pub(in crate::trace) struct Follower<'a> {
    scene: &'a Scene<'a>,
    options: &'a BeamOptions,
    pub(in crate::trace) chains: Vec<Chain>,
    /// The chain of the first bounce of each patch, or `u32::MAX`.
    direct: Vec<u32>,
    /// The chains of the last bounce; None before the first.
    level: Option<Range<usize>>,
}

impl<'a> Follower<'a> {
    pub fn new(scene: &'a Scene<'a>, options: &'a BeamOptions) -> Follower<'a> {
        let direct = vec![u32::MAX; scene.faces.patch_area_m2.len()];
        Follower { scene, options, chains: Vec::new(), direct, level: None }
    }

    /// The views that are to be asked next, with the chain that each is behind (`usize::MAX` for the radar's own); none at the end.
    pub fn views(&self) -> Vec<(usize, View<'_>)> {
        let Some(level) = self.level.clone() else { return vec![(usize::MAX, self.scene.view())] };
        let behind = |number: usize| {
            let view = view_of(self.scene, &self.chains, number)?;
            Some((number, view.through(&self.chains[number].lit)))
        };
        let mirrors: Vec<usize> = level.filter(|i| self.is_mirror(&self.chains[*i])).collect();
        mirrors.par_iter().filter_map_tasks(|i| behind(*i)).collect()
    }

    /// The chains that the fragments of each view make.
    pub fn children(&self, views: &[(usize, View<'_>)], lit: Vec<Vec<Fragment>>) -> Vec<Vec<Chain>> {
        views.par_iter().zip(lit).map_tasks(|((number, view), lit)| self.behind(*number, view, lit)).collect()
    }

    /// Takes the chains of the next bounce.
    pub fn extend(&mut self, new: Vec<Vec<Chain>>) {
        let start = self.chains.len();
        self.chains.extend(new.into_iter().flatten());
        if start == 0 {
            for (i, chain) in self.chains.iter().enumerate() {
                self.direct[chain.patch as usize] = i as u32;
            }
        }
        self.level = Some(start..self.chains.len());
    }

    fn most(&self, endless: bool) -> usize {
        (self.options.bounces + usize::from(endless)).min(MAX_BOUNCES)
    }

    fn begins(&self, chain: &Chain) -> bool {
        self.options.images && chain.node.bounce == 1 && self.scene.faces.mirrors_points(chain.patch)
    }

    fn is_mirror(&self, chain: &Chain) -> bool {
        let face = &self.scene.faces.faces[chain.lit[0].face as usize];
        let most = self.most(chain.node.endless || self.begins(chain));
        face.curved == NOT_CURVED && (chain.node.bounce as usize) < most
    }

    /// The node of a patch that a frame of rays lights.
    fn node(&self, parent: u32, patch: u32, bounce: u8, frame: Frame) -> Node {
        let face = self.scene.lead(patch);
        let of = &self.scene.faces.faces[face as usize];
        let normal = Side::of(of, frame.facing(of.normal, of.offset_m)).normal;
        Node { parent, face, bounce, imaged: false, endless: false, frame, normal }
    }

    fn behind(&self, number: usize, view: &View<'_>, lit: Vec<Fragment>) -> Vec<Chain> {
        let faces = self.scene.faces;
        let patch_of = |f: &Fragment| faces.faces[f.face as usize].patch;
        let by_patch = by_patch(lit, patch_of).into_iter();
        let Some(parent) = self.chains.get(number) else {
            let first = |lit: Vec<Fragment>| {
                let patch = patch_of(&lit[0]);
                let node = self.node(u32::MAX, patch, 1, self.scene.windows[0]);
                Chain { node, patch, lit, seen: Vec::new() }
            };
            return by_patch.map(first).collect();
        };
        let begins = self.begins(parent);
        let mirror = Side::facing(&faces.faces[parent.node.face as usize], parent.node.normal);
        let frame = parent.node.frame.mirrored(mirror.normal, mirror.offset);
        let child = |lit: Vec<Fragment>| {
            let patch = patch_of(&lit[0]);
            let imaged = parent.node.imaged || begins && faces.mirrors(parent.patch, patch);
            let endless = parent.node.endless || begins && faces.is_endless(parent.patch, patch);
            if parent.node.bounce as usize >= self.most(endless) || area_m2(faces, &lit) < LEAST_M2 {
                return None;
            }
            let is_curved = faces.faces[lit[0].face as usize].curved != NOT_CURVED;
            // What a curved surface returns is asked for pairs of ways.
            let direct = self.chains.get(self.direct[patch as usize] as usize);
            let direct = direct.map_or(&[][..], |c| &c.lit[..]);
            let seen = if is_curved { Vec::new() } else { view.also_lit(&lit, direct) };
            let next = self.node(number as u32, patch, parent.node.bounce + 1, frame);
            Some(Chain { node: Node { imaged, endless, ..next }, patch, lit, seen })
        };
        by_patch.filter_map(child).collect()
    }
}

/// The patches of a chain, from the first bounce on.
pub fn patches_of(chains: &[Chain], number: usize) -> Vec<u32> {
    let parent = |chain: &&Chain| chains.get(chain.node.parent as usize);
    let mut patches: Vec<u32> = successors(chains.get(number), parent).map(|chain| chain.patch).collect();
    patches.reverse();
    patches
}

/// Area within an outline, m².
pub fn area_m2(faces: &Faces, outline: &[Fragment]) -> f64 {
    let Some(first) = outline.first() else { return 0.0 };
    let (origin, normal) = (first.ends_m[0], faces.faces[first.face as usize].normal);
    outline.iter().map(|f| f.area_m2(origin, normal)).sum()
}

/// Fragments by patch, in the order in which they come.
fn by_patch(mut fragments: Vec<Fragment>, patch_of: impl Fn(&Fragment) -> u32) -> Vec<Vec<Fragment>> {
    fragments.sort_by_key(&patch_of);
    fragments.chunk_by(|a, b| patch_of(a) == patch_of(b)).map(<[Fragment]>::to_vec).collect()
}

/// The view behind the last patch of a chain.
fn view_of<'a>(scene: &'a Scene<'a>, chains: &[Chain], number: usize) -> Option<View<'a>> {
    let chain = &chains[number];
    let before = match chain.node.parent {
        u32::MAX => scene.view(),
        parent => view_of(scene, chains, parent as usize)?,
    };
    before.behind(chain.patch)
}
