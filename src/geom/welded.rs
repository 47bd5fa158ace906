//! A mesh whose triangles share their corners.

use super::hash::FastMap;
use super::triangle::Triangle;
use glam::DVec3;
use std::collections::hash_map::Entry;

/// As the plane of a triangle that shares its plane with no other.
pub(super) const NO_PLANE: u32 = u32::MAX;

/// The places of all corners, each once, and each triangle as three of them. Zeros of either sign are one.
pub(super) fn weld(triangles: &[[DVec3; 3]]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut number: FastMap<[u64; 3], u32> = FastMap::default();
    let mut points = Vec::new();
    let corners = triangles
        .iter()
        .map(|t| {
            t.map(|p| {
                *number.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                    points.push(p);
                    points.len() as u32 - 1
                })
            })
        })
        .collect();
    (points, corners)
}

/// Triangles of one body with those that they meet at their edges.
pub(super) struct Welded<'a> {
    pub(super) of: &'a [Triangle],
    pub(super) points: &'a [DVec3],
    /// Each triangle as three of the points.
    pub(super) triangles: &'a [[u32; 3]],
    /// Triangles at each undirected edge (lower, higher corner), with whether they run it upwards.
    pub(super) edges: FastMap<(u32, u32), Vec<(u32, bool)>>,
}

impl<'a> Welded<'a> {
    /// Holds the `of` triangles with the `points` and corners that [`weld`] gives for them.
    pub(super) fn new(of: &'a [Triangle], points: &'a [DVec3], triangles: &'a [[u32; 3]]) -> Self {
        let mut edges: FastMap<(u32, u32), Vec<(u32, bool)>> =
            FastMap::with_capacity_and_hasher(2 * triangles.len(), Default::default());
        for (i, t) in triangles.iter().enumerate() {
            for (a, b) in sides(t) {
                edges.entry((a.min(b), a.max(b))).or_default().push((i as u32, a < b));
            }
        }
        Welded { of, points, triangles, edges }
    }

    pub(super) fn neighbours(&self, i: u32) -> impl Iterator<Item = u32> + '_ {
        sides(&self.triangles[i as usize])
            .into_iter()
            .flat_map(move |(a, b)| self.edges[&(a.min(b), a.max(b))].iter().map(|e| e.0))
            .filter(move |&j| j != i)
    }

    /// Tells for each triangle whether the surface that hangs together with it is closed and oriented outwards.
    pub(super) fn closed_components(&self) -> Vec<bool> {
        let n = self.triangles.len();
        let mut closed = vec![false; n];
        let mut seen = vec![false; n];
        for start in 0..n as u32 {
            if seen[start as usize] {
                continue;
            }
            seen[start as usize] = true;
            let mut component = vec![start];
            let mut at = 0;
            while at < component.len() {
                for j in self.neighbours(component[at]) {
                    if !std::mem::replace(&mut seen[j as usize], true) {
                        component.push(j);
                    }
                }
                at += 1;
            }
            let tight = component.iter().all(|&i| {
                sides(&self.triangles[i as usize]).into_iter().all(|(a, b)| {
                    let users = &self.edges[&(a.min(b), a.max(b))];
                    users.len() == 2 && users[0].1 != users[1].1
                })
            });
            let origin = self.points[self.triangles[start as usize][0] as usize];
            let volume: f64 = component
                .iter()
                .map(|&i| {
                    let [a, b, c] = self.triangles[i as usize].map(|v| self.points[v as usize] - origin);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            if tight && volume > 0.0 {
                component.iter().for_each(|&i| closed[i as usize] = true);
            }
        }
        closed
    }

    /// Neighbours in one plane, of one material and with the same volume behind them (`cell`), each list
    /// led by its largest triangle; those of one known `plane` whether they are neighbours or not. Those that are `alone` have no
    /// neighbours.
    pub(super) fn patches(
        &self,
        flat_m: f64,
        cell: impl Fn(u32) -> u32,
        plane: impl Fn(u32) -> u32,
        alone: impl Fn(u32) -> bool,
    ) -> Vec<Vec<u32>> {
        let n = self.triangles.len();
        let tri = |i: u32| &self.of[i as usize];
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_by(|&a, &b| tri(b).area_m2().total_cmp(&tri(a).area_m2()).then(a.cmp(&b)));
        let mut taken = vec![false; n];
        let mut patches = Vec::new();
        let mut known: FastMap<(u32, u32), usize> = FastMap::default();
        for &t in order.iter().filter(|t| plane(**t) != NO_PLANE) {
            taken[t as usize] = true;
            match known.entry((plane(t), cell(t))) {
                Entry::Occupied(at) => {
                    let list: &mut Vec<u32> = &mut patches[*at.get()];
                    list.push(t);
                }
                Entry::Vacant(new) => {
                    new.insert(patches.len());
                    patches.push(vec![t]);
                }
            }
        }
        for &lead in &order {
            if taken[lead as usize] {
                continue;
            }
            taken[lead as usize] = true;
            let l = tri(lead);
            let offset = l.normal.dot(l.v0);
            let mut patch = vec![lead];
            let mut at = 0;
            while at < patch.len() && !alone(lead) {
                for j in self.neighbours(patch[at]) {
                    let t = tri(j);
                    let fits = !taken[j as usize]
                        && !alone(j)
                        && t.surface == l.surface
                        && cell(j) == cell(lead)
                        && t.normal.dot(l.normal) > 0.5
                        && t.corners().iter().all(|p| (l.normal.dot(*p) - offset).abs() <= flat_m);
                    if fits {
                        taken[j as usize] = true;
                        patch.push(j);
                    }
                }
                at += 1;
            }
            patches.push(patch);
        }
        patches
    }
}

pub(super) fn sides(t: &[u32; 3]) -> [(u32, u32); 3] {
    [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]
}
