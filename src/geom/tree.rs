//! A tree of boxes over anything that has one, in f64.

use super::faces::tree_over;
use glam::DVec3;

/// Branches that a walk may have open.
const DEEPEST: usize = 128;

/// A box of the tree: `count` items from `first` on, or, when 0, the two boxes `first` and `first + 1`.
#[derive(Debug, Clone, Copy)]
struct Node {
    centre: DVec3,
    half: DVec3,
    first: u32,
    count: u32,
}

/// The tree. It numbers its items in the order of its leaves.
#[derive(Debug, Default)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
}

impl BoxTree {
    /// A tree over boxes (least and largest corner), at most `most` in a leaf, and the box that each number stands for.
    pub(crate) fn new(boxes: &[(DVec3, DVec3)], most: u32) -> (BoxTree, Vec<u32>) {
        let (shape, order) = tree_over(boxes, most);
        let mut bounds = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); shape.len()];
        // Children come after their parents.
        let mut parents_first = if shape.is_empty() { vec![] } else { vec![0usize] };
        let mut at = 0;
        while at < parents_first.len() {
            let n = &shape[parents_first[at]];
            if n.count == 0 {
                parents_first.extend([n.first as usize, n.first as usize + 1]);
            }
            at += 1;
        }
        for i in parents_first.into_iter().rev() {
            let n = &shape[i];
            let first = n.first as usize;
            let join = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
            bounds[i] = match n.count {
                0 => join(bounds[first], bounds[first + 1]),
                count => order[first..first + count as usize]
                    .iter()
                    .map(|k| boxes[*k as usize])
                    .fold(bounds[i], join),
            };
        }
        let node = |(n, (lo, hi)): (&super::faces::Node, &(DVec3, DVec3))| {
            let slack = DVec3::splat(1e-14 * (1.0 + hi.abs().max(lo.abs()).max_element()));
            Node {
                centre: 0.5 * (*lo + *hi),
                half: 0.5 * (*hi - *lo) + slack,
                first: n.first,
                count: n.count,
            }
        };
        (BoxTree { nodes: shape.iter().zip(&bounds).map(node).collect() }, order)
    }

    /// Calls `visit` with the items of all leaves that are not missed (`misses` gets centre and half size of a box), until it returns true.
    #[inline]
    pub(crate) fn visit(&self, misses: impl Fn(DVec3, DVec3) -> bool, mut visit: impl FnMut(u32) -> bool) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0u32; DEEPEST];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let node = &self.nodes[stack[top] as usize];
            if misses(node.centre, node.half) {
                continue;
            }
            if node.count > 0 {
                if (node.first..node.first + node.count).any(&mut visit) {
                    return;
                }
            } else {
                stack[top] = node.first + 1;
                stack[top + 1] = node.first;
                top += 2;
            }
        }
    }
}
