//! Fewer facets for curved surfaces whose bend is part of their echoes (CONVENTIONS eq. 59).
//!
//! A point is taken out by drawing it along one of its edges into the next point, which closes its fan of facets. What is left are
//! points of the surface with their normals, so that nothing has to be fitted; a step is taken where the surface over the new facets
//! still runs through what it replaces.

use super::smooth::{Arc, Facet, Limit, Surface, Vertex, Wish};
use glam::DVec3;

/// A surface is passed over so often: each time every other point goes at most.
const PASSES: usize = 8;
/// Cosine between a facet and the normals at its corners, at least.
const UPRIGHT: f64 = 0.85;
/// Area over the square of the longest side, at least.
const STOUT: f64 = 0.004;
/// Facets whose share of a place is this far below zero still hold it.
const BESIDE: f64 = -0.15;

/// Facets, with those around each point.
struct Fans {
    surface: Surface,
    /// Whether a facet is still there.
    alive: Vec<bool>,
    around: Vec<Vec<u32>>,
    /// Points that have not been tried since something about them changed.
    untried: Vec<bool>,
    limit: Limit,
}

/// A surface with fewer facets: none of its edges bends by more than `limit` allows where it did not before, and no place of it
/// moves by more than about its `off_m`.
pub(super) fn coarser(surface: Surface, limit: Limit) -> Surface {
    let mut around = vec![Vec::new(); surface.points.len()];
    for (i, f) in surface.facets.iter().enumerate() {
        f.points.iter().for_each(|p| around[*p as usize].push(i as u32));
    }
    let alive = vec![true; surface.facets.len()];
    let untried = vec![true; around.len()];
    let mut fans = Fans { surface, alive, around, untried, limit };
    for _ in 0..PASSES {
        if !fans.pass() {
            break;
        }
    }
    let Fans { mut surface, alive, .. } = fans;
    let mut alive = alive.into_iter();
    surface.facets.retain(|_| alive.next() == Some(true));
    surface
}

impl Fans {
    /// Takes out points no two of which are neighbours. False when there were none.
    fn pass(&mut self) -> bool {
        let mut kept = vec![false; self.around.len()];
        let mut any = false;
        for p in 0..self.around.len() as u32 {
            if kept[p as usize] || !self.untried[p as usize] || self.around[p as usize].is_empty() {
                continue;
            }
            self.untried[p as usize] = false;
            let ring = self.ring(p);
            let Some(crease) = self.crease(p, &ring) else { continue };
            let crease = (!crease.is_empty()).then_some(&crease[..]);
            let ends = crease.unwrap_or(&ring);
            let steps = ends.iter().filter_map(|q| self.drawn(p, *q, &ring).map(|f| (*q, f)));
            // The stoutest of what can be; whether a step can be taken costs more than all else.
            let worth = |new: &[(u32, Facet)]| {
                new.iter().map(|(_, f)| self.stoutness(f)).fold(f64::INFINITY, f64::min)
            };
            let mut steps: Vec<_> = steps.map(|(q, new)| (worth(&new), q, new)).collect();
            steps.sort_by(|a, b| a.0.total_cmp(&b.0));
            let can_be = |(_, q, new): &(f64, u32, Vec<(u32, Facet)>)| self.runs_through(p, *q, crease, new);
            let Some((_, q, new)) = steps.into_iter().rev().find(can_be) else { continue };
            for f in std::mem::take(&mut self.around[p as usize]) {
                match new.iter().find(|(i, _)| *i == f) {
                    Some((_, facet)) => {
                        self.surface.facets[f as usize] = *facet;
                        self.around[q as usize].push(f);
                    }
                    None => {
                        self.alive[f as usize] = false;
                        for c in self.surface.facets[f as usize].points {
                            self.around[c as usize].retain(|i| *i != f);
                        }
                    }
                }
            }
            for c in &ring {
                (kept[*c as usize], self.untried[*c as usize]) = (true, true);
            }
            any = true;
        }
        any
    }

    fn facet(&self, i: u32) -> &Facet {
        &self.surface.facets[i as usize]
    }

    fn point(&self, i: u32) -> DVec3 {
        self.surface.points[i as usize]
    }

    /// The points next to a point.
    fn ring(&self, p: u32) -> Vec<u32> {
        let mut ring: Vec<u32> = self.around[p as usize].iter().flat_map(|f| self.facet(*f).points).collect();
        ring.retain(|c| *c != p);
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// The two facets at an edge; None where there are fewer or more.
    fn pair(&self, p: u32, q: u32) -> Option<[u32; 2]> {
        let mut at = self.around[p as usize].iter().filter(|f| self.facet(**f).points.contains(&q));
        let (a, b) = (*at.next()?, *at.next()?);
        at.next().is_none().then_some([a, b])
    }

    fn is_smooth(&self, p: u32, q: u32, [a, b]: [u32; 2]) -> bool {
        let (f, g) = (self.facet(a), self.facet(b));
        if f.material != g.material {
            return false;
        }
        match (f.is_flat(), g.is_flat()) {
            (true, true) => self.surface.are_one_plane(f, g),
            (false, false) => [p, q].iter().all(|c| normal_at(f, *c) == normal_at(g, *c)),
            _ => false,
        }
    }

    /// The two ends of the creases that meet in a point and may be one, none where the surface is smooth around it; None at corners
    /// and borders.
    fn crease(&self, p: u32, ring: &[u32]) -> Option<Vec<u32>> {
        // Something has to be curved, or there is nothing to win.
        if self.around[p as usize].iter().all(|f| self.facet(*f).is_flat()) {
            return None;
        }
        let mut creases = Vec::new();
        for q in ring {
            let pair = self.pair(p, *q)?;
            if !self.is_smooth(p, *q, pair) {
                creases.push(*q);
            }
        }
        matches!(creases.len(), 0 | 2).then_some(creases)
    }

    /// The facets around `p` that stay, with `q` in its place; None where one of them would be turned, bent or thin.
    fn drawn(&self, p: u32, q: u32, ring: &[u32]) -> Option<Vec<(u32, Facet)>> {
        let gone = self.pair(p, q)?;
        let shared = self.ring(q).into_iter().filter(|c| ring.contains(c)).count();
        if shared != 2 {
            return None;
        }
        // The normal at q of the same smooth surface.
        let turned = |n: u32| {
            let of = |g: &u32| (normal_at(self.facet(*g), p) == n).then(|| normal_at(self.facet(*g), q));
            gone.iter().find_map(of)
        };
        let mut new = Vec::with_capacity(self.around[p as usize].len());
        for &i in self.around[p as usize].iter().filter(|i| !gone.contains(i)) {
            let mut f = *self.facet(i);
            let k = f.points.iter().position(|c| *c == p)?;
            f.points[k] = q;
            if f.is_flat() {
                if !self.surface.are_one_plane(self.facet(i), &f) {
                    return None;
                }
            } else {
                f.normals[k] = turned(f.normals[k])?;
                let front = self.surface.facet_normal(&f);
                let cosines = f.normals.map(|n| self.surface.normals[n as usize].dot(front));
                let upright = |sign: f64| cosines.iter().all(|c| sign * c >= UPRIGHT);
                let stays = |k: usize| self.bends_little(f.corner(k), f.corner((k + 1) % 3));
                if !(upright(1.0) || upright(-1.0)) || !(0..3).all(stays) {
                    return None;
                }
                let before = self.surface.facet_normal(self.facet(i));
                if before.dot(front) <= 0.0 {
                    return None;
                }
            }
            if self.stoutness(&f) < STOUT {
                return None;
            }
            new.push((i, f));
        }
        Some(new)
    }

    fn bends_little(&self, p: Vertex, q: Vertex) -> bool {
        let arc = self.surface.arc(p, q);
        self.limit.allows(arc.sagitta, self.point(p.0).distance(self.point(q.0)))
    }

    fn stoutness(&self, f: &Facet) -> f64 {
        let [a, b, c] = f.points.map(|p| self.point(p));
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        0.5 * (b - a).cross(c - a).length() / longest
    }

    /// Whether the surface over new facets runs through the point that goes and the middles of its edges, and the crease from `q` on
    /// through where it ran before.
    fn runs_through(&self, p: u32, q: u32, crease: Option<&[u32]>, new: &[(u32, Facet)]) -> bool {
        let old: Vec<&Facet> = self.around[p as usize].iter().map(|i| self.facet(*i)).collect();
        let all: Vec<&Facet> = new.iter().map(|(_, f)| f).collect();
        let mut places: Vec<(DVec3, u32)> = Vec::with_capacity(2 * old.len());
        for f in old.iter().filter(|f| !f.is_flat()) {
            let n = normal_at(f, p);
            if crease.is_none() {
                places.push((self.point(p), n));
            }
            for k in (0..3).filter(|k| f.points[*k] != p) {
                let (a, b) = ((p, n), f.corner(k));
                if crease.is_none_or(|c| !c.contains(&b.0)) {
                    let arc = self.surface.arc(a, b);
                    places.push((0.5 * (self.point(p) + self.point(b.0)) + arc.up * arc.height, n));
                }
            }
        }
        let on_surface = places.iter().all(|(place, n)| {
            let along = self.surface.normals[*n as usize];
            let curved = all.iter().filter(|f| !f.is_flat());
            // What stands out over a crease is looked at there.
            curved
                .filter_map(|f| self.height_over(f, *place, along))
                .reduce(f64::min)
                .is_none_or(|off| off <= self.limit.off_m)
        });
        on_surface && crease.is_none_or(|c| self.crease_runs_through(p, q, c, &old, &all))
    }

    /// The same for the crease alone, which came from one of `ends` by `p` to the other.
    fn crease_runs_through(&self, p: u32, q: u32, ends: &[u32], old: &[&Facet], new: &[&Facet]) -> bool {
        let Some(r) = ends.iter().copied().find(|c| *c != q) else { return false };
        let [from, way] = [self.point(q), self.point(r) - self.point(q)];
        let rise = self.rise(q, r, new);
        // The outline of what is flat is straight.
        if rise.length() > self.limit.off_m && old.iter().any(|f| f.is_flat()) {
            return false;
        }
        let off = |place: DVec3| {
            let t = ((place - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
            place.distance(from + way * t + rise * (4.0 * t * (1.0 - t)))
        };
        let middle = |c: u32| 0.5 * (self.point(p) + self.point(c)) + self.rise(p, c, old);
        [self.point(p), middle(q), middle(r)].iter().all(|place| off(*place) <= self.limit.off_m)
    }

    /// Vector from the middle of an edge to the surfaces of those of `facets` that meet in it, m.
    fn rise(&self, p: u32, q: u32, facets: &[&Facet]) -> DVec3 {
        let meets = |f: &&&Facet| f.points.contains(&p) && f.points.contains(&q);
        let mut wish = Wish::default();
        let mut heights = Vec::new();
        for f in facets.iter().filter(meets) {
            if f.is_flat() {
                wish.keep(self.surface.facet_normal(f));
            } else {
                let arc = self.surface.arc((p, normal_at(f, p)), (q, normal_at(f, q)));
                heights.push((arc.up, arc.height));
            }
        }
        wish.solve(heights.into_iter())
    }

    /// How far a place lies off the surface over a facet; None where it lies beside it.
    fn height_over(&self, f: &Facet, place: DVec3, along: DVec3) -> Option<f64> {
        let [a, b, c] = f.points.map(|p| self.point(p));
        let cross = (b - a).cross(c - a);
        let front = cross / cross.length_squared();
        let depth = cross.dot(along);
        if depth == 0.0 {
            return None;
        }
        let foot = place - along * (cross.dot(place - a) / depth);
        let share = [(b, c), (c, a), (a, b)].map(|(p, q)| (q - p).cross(foot - p).dot(front));
        if share.iter().any(|s| *s < BESIDE) {
            return None;
        }
        let mut at = foot;
        for k in 0..3 {
            let (p, q) = (f.corner(k), f.corner((k + 1) % 3));
            let Arc { height, up, .. } = self.surface.arc(p, q);
            at += up * (4.0 * share[k] * share[(k + 1) % 3] * height);
        }
        Some((at - place).dot(along).abs())
    }
}

/// Index of the normal of a facet at one of its points.
fn normal_at(f: &Facet, p: u32) -> u32 {
    let k = f.points.iter().position(|c| *c == p).unwrap_or(0);
    f.normals[k]
}
