//! Trees of boxes in f64: over faces ([`super::faces::Faces`]), and over anything that has a box ([`BoxTree`]).

use super::bvh::binary_tree;
use glam::DVec3;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb};

/// Branches that a walk may leave open on the stack: more than the levels of a tree whose boxes differ. What is too much alike for the
/// builder, which works in f32, can hang below one another.
const OPEN: usize = 96;

/// A box of the tree: `count` items from `first` on, or, when 0, the two nodes `first` and `first + 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Middle of the box, m.
    pub centre: DVec3,
    /// Half its lengths along the axes, m.
    pub half: DVec3,
    /// First item, or first of the two nodes below.
    pub first: u32,
    /// Number of items, 0 where nodes are below.
    pub count: u32,
}

/// Least and largest corner of a box.
pub(super) type Bounds = (DVec3, DVec3);

/// The box around two.
pub(super) fn around(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A tree over boxes, its own boxes still to be taken, and the order in which its leaves hold them, at most `most` each.
pub(super) fn tree_over(boxes: &[Bounds], most: u32) -> (Vec<Node>, Vec<u32>) {
    struct Padded(Aabb);
    impl Boundable for Padded {
        fn aabb(&self) -> Aabb {
            self.0
        }
    }
    if boxes.is_empty() {
        return (Vec::new(), Vec::new());
    }
    // obvhs builds in f32: the order of its leaves is what counts.
    let boxes: Vec<Padded> =
        boxes.iter().map(|(lo, hi)| Padded(Aabb::new(lo.as_vec3a(), hi.as_vec3a()))).collect();
    let params = BvhBuildParams { max_prims_per_leaf: most, ..BvhBuildParams::medium_build() };
    let tree = tree_of(&boxes, &params);
    let node = |n: &Bvh2Node| Node {
        centre: DVec3::ZERO,
        half: DVec3::ZERO,
        first: n.first_index,
        count: n.prim_count,
    };
    (tree.nodes.iter().map(node).collect(), tree.primitive_indices)
}

/// The tree that `obvhs::bvh2::builder::build_bvh2` makes, by the same steps.
fn tree_of<T: Boundable>(boxes: &[T], params: &BvhBuildParams) -> Bvh2 {
    let mut tree = binary_tree(boxes, params);
    collapse(&mut tree, params.max_prims_per_leaf.clamp(1, 255), params.collapse_traversal_cost);
    let again = params.reinsertion_batch_ratio * params.post_collapse_reinsertion_batch_ratio_multiplier;
    ReinsertionOptimizer::default().run(&mut tree, again, None);
    tree
}

/// All nodes, each before those below it.
pub(super) fn parents_first(nodes: &[Node]) -> Vec<usize> {
    let mut order = if nodes.is_empty() { vec![] } else { vec![0] };
    let mut i = 0;
    while i < order.len() {
        let n = nodes[order[i]];
        if n.count == 0 {
            order.extend([n.first as usize, n.first as usize + 1]);
        }
        i += 1;
    }
    order
}

/// Finds the boxes of nodes, of which each comes before those below it, from those of their leaves' items.
pub(super) fn fit(nodes: &mut [Node], parents_first: Vec<usize>, of_leaf: impl Fn(&Node) -> Option<Bounds>) {
    for i in parents_first.into_iter().rev() {
        let n = nodes[i];
        let of = |n: &Node| (n.centre - n.half, n.centre + n.half);
        let (lo, hi) = match n.count {
            0 => around(of(&nodes[n.first as usize]), of(&nodes[n.first as usize + 1])),
            _ => of_leaf(&n).unwrap_or_default(),
        };
        // Half a rounding step of slack, so that nothing leaves its box.
        let slack = DVec3::splat(1e-14 * (1.0 + hi.abs().max(lo.abs()).max_element()));
        nodes[i].centre = 0.5 * (lo + hi);
        nodes[i].half = 0.5 * (hi - lo) + slack;
    }
}

/// Calls `visit` with the items of the leaves that are not missed, until it says that it has enough. With a place to look `from` the
/// nearer of two branches comes first.
#[inline]
pub(super) fn walk(
    nodes: &[Node],
    misses: impl Fn(&Node) -> bool,
    from: Option<DVec3>,
    mut visit: impl FnMut(u32) -> bool,
) {
    if nodes.is_empty() {
        return;
    }
    let (mut stack, mut rest) = ([0u32; OPEN], Vec::new());
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let at = if top < OPEN { stack[top] } else { rest.pop().unwrap_or_default() };
        let node = &nodes[at as usize];
        if misses(node) {
            continue;
        }
        if node.count > 0 {
            if (node.first..node.first + node.count).any(&mut visit) {
                return;
            }
        } else {
            let (mut near, mut far) = (node.first, node.first + 1);
            if let Some(place) = from {
                let away = |i: u32| nodes[i as usize].centre.distance_squared(place);
                if away(far) < away(near) {
                    std::mem::swap(&mut near, &mut far);
                }
            }
            for i in [far, near] {
                match stack.get_mut(top) {
                    Some(slot) => *slot = i,
                    None => rest.push(i),
                }
                top += 1;
            }
        }
    }
}

/// A tree over boxes. It numbers its items in the order of its leaves.
#[derive(Debug, Default)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
}

impl BoxTree {
    /// A tree over boxes, at most `most` in a leaf, and the box that each number stands for.
    pub(crate) fn new(boxes: &[Bounds], most: u32) -> (BoxTree, Vec<u32>) {
        let (mut nodes, order) = tree_over(boxes, most);
        let parents_first = parents_first(&nodes);
        fit(&mut nodes, parents_first, |n| {
            let some = &order[n.first as usize..(n.first + n.count) as usize];
            some.iter().map(|i| boxes[*i as usize]).reduce(around)
        });
        (BoxTree { nodes }, order)
    }

    /// The nodes, the root first; leaves hold ranges of items.
    pub(crate) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Calls `visit` with the items of all leaves that are not missed (`misses` gets centre and half size of a box), until it returns true.
    #[inline]
    pub(crate) fn visit(&self, misses: impl Fn(DVec3, DVec3) -> bool, visit: impl FnMut(u32) -> bool) {
        walk(&self.nodes, |node| misses(node.centre, node.half), None, visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_that_of_the_library() {
        let mut state = 5u64;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for n in [1, 2, 7, 500] {
            let place = |draw: &mut dyn FnMut() -> f32| glam::Vec3A::new(draw(), 3.0 * draw(), draw());
            let boxes: Vec<Aabb> = (0..n)
                .map(|_| {
                    let at = place(&mut draw);
                    Aabb::new(at, at + 0.2 * place(&mut draw))
                })
                .collect();
            let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
            let (own, other) = (
                tree_of(&boxes, &params),
                obvhs::bvh2::builder::build_bvh2(&boxes, params, &mut Default::default()),
            );
            assert_eq!(own.primitive_indices, other.primitive_indices);
            let node = |n: &Bvh2Node| (n.first_index, n.prim_count, n.aabb);
            assert!(own.nodes.iter().map(node).eq(other.nodes.iter().map(node)), "{n}");
        }
    }

    /// Boxes that are one in f32 end up below one another, deeper than the stack.
    #[test]
    fn a_walk_comes_to_the_end_of_any_tree() {
        let count = 3 * OPEN as u32;
        let node = |first: u32, count: u32| Node { centre: DVec3::ZERO, half: DVec3::ONE, first, count };
        // Each node has a leaf and the rest below it.
        let levels = (0..count).flat_map(|i| [node(i, 1), node(2 * i + 3, 0)]);
        let mut nodes: Vec<Node> = [node(1, 0)].into_iter().chain(levels).collect();
        let last = nodes.len() - 1;
        nodes[last] = node(count, 1);
        for from in [None, Some(DVec3::ONE)] {
            let mut found = Vec::new();
            walk(
                &nodes,
                |_| false,
                from,
                |i| {
                    found.push(i);
                    false
                },
            );
            found.sort_unstable();
            assert_eq!(found, (0..=count).collect::<Vec<_>>());
        }
    }
}
