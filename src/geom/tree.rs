//! Trees of boxes in f64: over faces ([`super::faces::Faces`]), and over anything that has a box ([`BoxTree`]).

use super::faces::{Node, tree_over};
use glam::DVec3;

/// Branches that a walk may leave open on the stack: more than the levels of a tree whose boxes differ. What is too much alike for the
/// builder, which works in f32, can hang below one another.
const OPEN: usize = 96;

/// Least and largest corner of a box.
pub(super) type Bounds = (DVec3, DVec3);

/// The box around two.
pub(super) fn around(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
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

    /// Calls `visit` with the items of all leaves that are not missed (`misses` gets centre and half size of a box), until it returns true.
    #[inline]
    pub(crate) fn visit(&self, misses: impl Fn(DVec3, DVec3) -> bool, visit: impl FnMut(u32) -> bool) {
        walk(&self.nodes, |node| misses(node.centre, node.half), None, visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
