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
use std::convert::Infallible;
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
}

/// All chains of a radar that looks through windows from one point, each after its parent, in a fixed order.
pub fn follow(faces: &Faces, table: &EdgeTable, windows: &[Frame], options: &BeamOptions) -> Vec<Chain> {
    let Some(scene) = Scene::new(faces, table, windows) else { return Vec::new() };
    let of_views = |views: &[View<'_>]| Ok(views.par_iter().map_tasks(View::fragments).collect());
    let all: std::result::Result<_, Infallible> = follow_with(&scene, options, of_views);
    all.unwrap_or_else(|never| match never {})
}

/// [`follow`] with the fragments of the views of one bounce from `fragments`, which gets them together.
///
/// # Errors
/// Returns the error of `fragments`.
pub(in crate::trace) fn follow_with<E>(
    scene: &Scene<'_>,
    options: &BeamOptions,
    mut fragments: impl FnMut(&[View<'_>]) -> std::result::Result<Vec<Vec<Fragment>>, E>,
) -> std::result::Result<Vec<Chain>, E> {
    let (faces, windows) = (scene.faces, scene.windows);
    let patch_of = |f: &Fragment| faces.faces[f.face as usize].patch;
    let of_radar = fragments(&[scene.view()])?.pop().unwrap_or_default();
    let first = by_patch(of_radar, patch_of);
    let mut direct = vec![u32::MAX; faces.patch_area_m2.len()];
    // The node of a patch that a frame of rays lights.
    let node = |parent: u32, patch: u32, bounce: u8, frame: Frame| {
        let face = scene.lead(patch);
        let of = &faces.faces[face as usize];
        let normal = Side::of(of, frame.facing(of.normal, of.offset_m)).normal;
        Node { parent, face, bounce, imaged: false, endless: false, frame, normal }
    };
    let mut chains: Vec<Chain> = Vec::new();
    for lit in first {
        let patch = patch_of(&lit[0]);
        direct[patch as usize] = chains.len() as u32;
        chains.push(Chain { node: node(u32::MAX, patch, 1, windows[0]), patch, lit, seen: Vec::new() });
    }
    let most = |endless: bool| (options.bounces + usize::from(endless)).min(MAX_BOUNCES);
    let begins =
        |chain: &Chain| options.images && chain.node.bounce == 1 && faces.mirrors_points(chain.patch);
    let is_mirror = |chain: &Chain| {
        let face = &faces.faces[chain.lit[0].face as usize];
        face.curved == NOT_CURVED && (chain.node.bounce as usize) < most(chain.node.endless || begins(chain))
    };
    let mut level: Range<usize> = 0..chains.len();
    while !level.is_empty() {
        let this = &chains[..];
        let mirrors: Vec<usize> = level.clone().filter(|i| is_mirror(&chains[*i])).collect();
        let behind = |number: usize| Some((number, view_of(scene, this, number)?.through(&this[number].lit)));
        let (mirrors, views): (Vec<usize>, Vec<View<'_>>) = mirrors.into_iter().filter_map(behind).unzip();
        let lit = if views.is_empty() { Vec::new() } else { fragments(&views)? };
        let next = |(number, (view, lit)): (usize, (&View<'_>, Vec<Fragment>))| -> Vec<Chain> {
            let parent = &this[number];
            let mirror = Side::facing(&faces.faces[parent.node.face as usize], parent.node.normal);
            let frame = parent.node.frame.mirrored(mirror.normal, mirror.offset);
            let child = |lit: Vec<Fragment>| {
                let patch = patch_of(&lit[0]);
                let imaged = parent.node.imaged || begins(parent) && faces.mirrors(parent.patch, patch);
                let endless = parent.node.endless || begins(parent) && faces.is_endless(parent.patch, patch);
                if parent.node.bounce as usize >= most(endless) || area_m2(faces, &lit) < LEAST_M2 {
                    return None;
                }
                let is_curved = faces.faces[lit[0].face as usize].curved != NOT_CURVED;
                // What a curved surface returns is asked for pairs of ways.
                let direct = this.get(direct[patch as usize] as usize).map_or(&[][..], |c| &c.lit[..]);
                let seen = if is_curved { Vec::new() } else { view.also_lit(&lit, direct) };
                let next = node(number as u32, patch, parent.node.bounce + 1, frame);
                Some(Chain { node: Node { imaged, endless, ..next }, patch, lit, seen })
            };
            by_patch(lit, patch_of).into_iter().filter_map(child).collect()
        };
        let of_views = mirrors.into_par_iter().zip(views.par_iter().zip(lit));
        let found: Vec<Vec<Chain>> = of_views.map_tasks(next).collect();
        let start = chains.len();
        chains.extend(found.into_iter().flatten());
        level = start..chains.len();
    }
    Ok(chains)
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
