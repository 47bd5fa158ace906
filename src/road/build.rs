//! From the plan of roads to a scene with its labels. Everything is its own object with a class; what repeats
//! shares its mesh.
//!
//! Vertices are rounded to single precision in the frame of their object, so that a glTF file holds the very
//! same scene.

use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, Target, World};
use crate::road::axis::RoadPoint;
use crate::road::drive::OnRoad;
use crate::road::labels::{
    LaneLabel, LineLabel, MarkerLabel, MarkerRowLabel, Polyline, RoadLabel, RoadTruth,
};
use crate::road::layout::{Base, Deck, InLane, Lane, Lateral, LineKind, Road, Side, add_marks};
use crate::road::materials::MaterialLookup;
use crate::road::objects::{W_BEAM_HALF_HEIGHT_M, standing_box, u_post, w_beam};
use crate::road::plan::{
    FencePlan, GantryPlan, LinePlan, RailPlan, RoadPlan, RowPlan, ScenePlan, Source, Spacing, VergePlan,
};
use crate::road::profile::Profile;
use crate::road::shape::{Profile as Outline, append, area_vector_m2, cuboid, polygon, weld};
use crate::road::traffic::{as_a_point, driven, vehicle};
use crate::scene::motion::{Channel, Joint, Motion};
use crate::scene::scenario::of_object;
use crate::scene::{Mesh, Scene, Shape};
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

/// Bodies that stand on the ground reach this far into it, so that no face lies in the road's plane.
const SUNK_M: f64 = 0.05;
/// Largest number of objects of one row.
pub const MAX_ROW: usize = 100_000;
/// By how much the clock of each moving thing is ahead of the clock of the one before, s, so that walkers are not in
/// step.
const STAGGER_S: f64 = 0.618;

/// Builds the scene and its labels.
///
/// # Errors
/// Returns an error for unknown materials, a road with a surface that reaches into another's, or a row of more than
/// [`MAX_ROW`].
pub fn build(plan: &ScenePlan) -> Result<(Scene, RoadTruth)> {
    let materials = |spec: &str| plan.material(spec);
    let mut b = Builder {
        plan,
        materials: &materials,
        scene: Scene::default(),
        truth: RoadTruth { name: plan.name.clone(), ..Default::default() },
        known: Vec::new(),
        moving: 0,
        duration_s: plan.duration_s,
    };
    for (i, r) in plan.roads.iter().enumerate() {
        for other in &plan.roads[..i] {
            apart(&r.road, &other.road)?;
        }
        b.road(r)?;
    }
    b.scene.import.triangles = b.scene.triangle_count();
    b.scene.warnings.clone_from(&plan.warnings);
    Ok((b.scene, b.truth))
}

/// Errors when the drivable edges of `a` run over the surface of `b` at its height: two sheets in one place would
/// both reflect.
fn apart(a: &Road, b: &Road) -> Result<()> {
    const SLACK_M: f64 = 0.02;
    let n = (a.axis.length_m() / 2.0).ceil().clamp(1.0, 1e5);
    for i in 0..=n as usize {
        let s_m = a.axis.length_m() * i as f64 / n;
        for base in [Base::Axis, Base::Edge(Side::Left), Base::Edge(Side::Right)] {
            let t_m = a.t_m(&Lateral { base, offset: Profile::constant(0.0) }, s_m);
            let p = b.axis.project(a.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 }));
            let edge =
                |side| b.t_m(&Lateral { base: Base::Edge(side), offset: Profile::constant(0.0) }, p.s_m);
            let inside = (SLACK_M..b.axis.length_m() - SLACK_M).contains(&p.s_m)
                && p.t_m < edge(Side::Left) - SLACK_M
                && p.t_m > edge(Side::Right) + SLACK_M;
            if inside && p.h_m.abs() < 0.1 {
                return Err(BadInput::new(format!(
                    "the surface of road '{}' overlaps that of road '{}' at s = {s_m:.1} m",
                    a.name, b.name
                ))
                .remedy("let the road begin at the edge of the other, or raise it")
                .into());
            }
        }
    }
    Ok(())
}

/// A side and an index into its lanes.
type LaneAt = (Side, usize);

struct Builder<'a> {
    plan: &'a ScenePlan,
    materials: MaterialLookup<'a>,
    scene: Scene,
    truth: RoadTruth,
    /// Parts that were built before, and the index of their first mesh.
    known: Vec<(String, Scene, usize)>,
    /// Things so far that are under way.
    moving: usize,
    /// How long they are.
    duration_s: f64,
}

/// How a thing goes.
#[derive(Clone, Default)]
struct Going {
    /// Along its own x, at time zero.
    speed_mps: f64,
    /// Its way over time, where the speed changes.
    way_m: Option<Arc<Channel<f64>>>,
    /// Velocity in the world of a thing that goes straight on, m/s.
    velocity_mps: DVec3,
    /// Motion from the thing's own frame to the world, in place of a pose and that velocity.
    joints: Option<Vec<Joint>>,
}

impl Builder<'_> {
    fn material(&mut self, name: &str) -> Result<u32> {
        let material = (self.materials)(name)?;
        Ok(self.scene.material_index(&material))
    }

    fn road(&mut self, p: &RoadPlan) -> Result<()> {
        let road = &p.road;
        road.check()?;
        let stations = road.stations_m(0.0, road.axis.length_m(), self.plan.sagitta_m);
        let deck = self.surfaces(road, &stations)?;
        let lines = self.lines(p, &deck, &stations)?;
        for (i, v) in p.verges.iter().enumerate() {
            self.verge(road, &stations, v, i)?;
        }
        for (i, r) in p.rails.iter().enumerate() {
            self.rail(road, &deck, r, i)?;
        }
        for (i, w) in p.walls.iter().enumerate() {
            let (h, half) = (w.height_m, 0.5 * w.thickness_m);
            let outline = [(-half, -SUNK_M), (half, -SUNK_M), (half, h), (-half, h)].map(DVec2::from);
            let name = format!("{}/{} {}", road.name, w.class, i + 1);
            self.swept(
                road,
                &name,
                w.class,
                &w.lateral,
                &w.span_m,
                &[(&outline, Outline::Closed)],
                &w.material,
            )?;
        }
        for (i, f) in p.fences.iter().enumerate() {
            self.fence(road, &deck, f, i)?;
        }
        for (i, g) in p.gantries.iter().enumerate() {
            self.gantry(road, g, i)?;
        }
        for r in &p.rows {
            self.row(road, &deck, r)?;
        }
        for t in &p.things {
            let t_m = road.t_m(&t.lateral, t.s_m);
            let pose = deck.pose(t.s_m, t_m, t.lift_m, t.yaw_rad, t.lying);
            let turn = DQuat::from_rotation_y(t.pitch_rad) * DQuat::from_rotation_x(t.roll_rad);
            let velocity_mps = t.speed_mps * pose.direction(DVec3::X);
            let pose = Pose::new(pose.rotation * turn, pose.translation_m);
            let going = match t.drive.as_ref().filter(|d| !d.is_at_rest()) {
                None => Going { speed_mps: t.speed_mps, velocity_mps, ..Going::default() },
                Some(drive) => {
                    let (s_m, lateral, against) = (t.s_m, &t.lateral, t.against);
                    let on = OnRoad { road, s_m, lateral, against, drive };
                    let way_m = on.way_m(-1.0..self.duration_s)?.map(Arc::new);
                    Going {
                        // The stride of limbs, where they keep to the way.
                        speed_mps: match way_m {
                            Some(_) => on.mean_speed_mps(-1.0..self.duration_s),
                            None => t.first_speed_mps(),
                        },
                        way_m,
                        joints: Some(on.motion(-1.0..self.duration_s)?.joints),
                        ..Going::default()
                    }
                }
            };
            self.thing(&t.source, &format!("{}/{}", road.name, t.name), &t.class, &pose, going)?;
        }
        self.truth.roads.push(label(road, &stations, lines));
        Ok(())
    }

    /// Adds a mesh that is given in world coordinates, with its origin at `pose`.
    fn add(&mut self, name: &str, class: &str, mesh: Mesh, pose: Pose<Target, World>) -> Option<u32> {
        let back = pose.inverse();
        let mut mesh = weld(mesh);
        for p in &mut mesh.positions_m {
            *p = back.point(*p);
        }
        in_single_precision(&mut mesh);
        // Slivers that rounding has closed.
        let keep: Vec<bool> =
            (0..mesh.triangles.len()).map(|t| area_vector_m2(&mesh, t).length() > 1e-10).collect();
        let mut kept = keep.iter();
        mesh.material.retain(|_| *kept.next().unwrap_or(&true));
        let mut kept = keep.iter();
        mesh.triangles.retain(|_| *kept.next().unwrap_or(&true));
        (!mesh.triangles.is_empty()).then(|| self.scene.add_mesh(name, class, weld(mesh), pose))
    }

    /// A mesh for several objects.
    fn shared(&mut self, mut mesh: Mesh) -> Shape {
        in_single_precision(&mut mesh);
        self.scene.meshes.push(mesh);
        Shape::Mesh(self.scene.meshes.len() - 1)
    }

    /// The sheets of the lanes, one object for each run of lanes of one material.
    fn surfaces<'r>(&mut self, road: &'r Road, stations: &'r [f64]) -> Result<Deck<'r>> {
        let lanes: Vec<(Side, usize, &Lane)> = road.lanes().collect();
        let mut cells = vec![Vec::new(); stations.len() - 1];
        // Where the cross slope changes no facet spans several lanes: what lies at their edges stays on them.
        let roof = road.axis.right_slope().is_some();
        let whole = road.axis.cross_slope().is_constant() && !roof;
        let mut first = 0;
        let mut number = 0;
        while first < lanes.len() {
            let lane = lanes[first].2;
            let group =
                |l: &Lane| l.surface == lane.surface && l.kind.is_drivable() == lane.kind.is_drivable();
            let end = first + lanes[first..].iter().take_while(|(_, _, l)| group(l)).count();
            if let Some(surface) = &lane.surface {
                let material = self.material(surface)?;
                let columns: Vec<Range<usize>> = if whole {
                    std::iter::once(first..end).collect()
                } else {
                    (first..end).map(|i| i..i + 1).collect()
                };
                // Where the two sides slope in different ways, no facet spans the axis.
                let halves: &[(f64, f64)] = match roof {
                    true => &[(0.0, f64::INFINITY), (f64::NEG_INFINITY, 0.0)],
                    false => &[(f64::NEG_INFINITY, f64::INFINITY)],
                };
                let columns = columns.into_iter().flat_map(|c| halves.iter().map(move |h| (c.clone(), *h)));
                let mut mesh = Mesh::default();
                for (column, (low, high)) in columns {
                    let corner = |i: usize, left: bool, ends: bool| {
                        let s_m = stations[i];
                        let (side, k, _) = if left { lanes[column.start] } else { lanes[column.end - 1] };
                        let t = |s: f64| {
                            let (l, r) = road.lane_edges_t_m(side, k, s);
                            if left { l } else { r }
                        };
                        let t_m = if ends { before(&t, s_m) } else { t(s_m) }.clamp(low, high);
                        road.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 })
                    };
                    for (i, cell) in cells.iter_mut().enumerate() {
                        let [a, b] = [corner(i, false, false), corner(i + 1, false, true)];
                        let [c, d] = [corner(i + 1, true, true), corner(i, true, false)];
                        for t in [[a, b, c], [a, c, d]] {
                            if (t[1] - t[0]).cross(t[2] - t[0]).length() > 1e-9 {
                                polygon(&mut mesh, &t, material);
                                cell.push(t);
                            }
                        }
                    }
                }
                number += 1;
                let class = if lane.kind.is_drivable() { "road" } else { "verge" };
                self.add(&format!("{}/surface {number}", road.name), class, mesh, origin(road, 0.0));
            }
            first = end;
        }
        Ok(Deck::new(road, stations, cells))
    }

    fn lines(&mut self, p: &RoadPlan, deck: &Deck, stations: &[f64]) -> Result<Vec<LineLabel>> {
        let road = &p.road;
        let all = 0.0..road.axis.length_m();
        let offset = Profile::constant(0.0);
        // (line, name, the lane without whose width there is no line).
        let mut lines: Vec<(LinePlan, String, Option<LaneAt>)> = Vec::new();
        let under = |l: &Lane| l.surface.clone();
        let inner = [Side::Left, Side::Right].into_iter().find_map(|s| road.side(s).first().and_then(under));
        if let (true, Some(under)) = (road.centre_line != LineKind::None, inner) {
            let lateral = Lateral { base: Base::Axis, offset: road.lane_offset.clone() };
            let paint = road.paint.clone();
            let line = LinePlan {
                lateral,
                kind: road.centre_line,
                paint,
                under,
                span_m: all.clone(),
                of_lane: None,
            };
            lines.push((line, "centre line".into(), None));
        }
        for (side, i, lane) in road.lanes() {
            let Some(under) = under(lane).filter(|_| lane.line != LineKind::None) else { continue };
            let place = if side == Side::Left { InLane::Left } else { InLane::Right };
            let lateral = Lateral { base: Base::Lane(side, i, place), offset: offset.clone() };
            let paint = road.paint.clone();
            let line =
                LinePlan { lateral, kind: lane.line, paint, under, span_m: all.clone(), of_lane: None };
            lines.push((line, format!("line of lane {}", lane.number), Some((side, i))));
        }
        for (i, l) in p.lines.iter().enumerate() {
            lines.push((l.clone(), format!("line {}", i + 1), l.of_lane));
        }
        let mut labels = Vec::new();
        for (line, name, lane) in lines {
            let name = format!("{}/{name}", road.name);
            self.line(road, deck, stations, &line, &name, lane, &mut labels)?;
        }
        Ok(labels)
    }

    #[expect(clippy::too_many_arguments, reason = "one caller; a struct would only rename them")]
    fn line(
        &mut self,
        road: &Road,
        deck: &Deck,
        stations: &[f64],
        line: &LinePlan,
        name: &str,
        lane: Option<LaneAt>,
        labels: &mut Vec<LineLabel>,
    ) -> Result<()> {
        let paint = &line.paint;
        let material = self.material(&format!("{}+{}:{}", line.under, paint.material, paint.thickness_m))?;
        let mut marks = vec![line.span_m.start, line.span_m.end];
        add_marks(&mut marks, stations.iter().copied());
        add_marks(&mut marks, line.lateral.offset.breaks_m());
        let width = |(side, i): LaneAt, s: f64| road.side(side)[i].width.value(s);
        let there = |s: f64| lane.is_none_or(|l| width(l, s) >= 2.0 * paint.width_m);
        // Where a lane has just become wide enough for its line.
        let turns: Vec<f64> = (marks.windows(2).filter(|w| there(w[0] + 1e-9) != there(w[1] - 1e-9)))
            .map(|w| {
                let (mut a, mut b) = (w[0] + 1e-9, w[1] - 1e-9);
                for _ in 0..50 {
                    let mid = 0.5 * (a + b);
                    if there(mid) == there(w[0] + 1e-9) { a = mid } else { b = mid }
                }
                b
            })
            .collect();
        add_marks(&mut marks, turns);
        let mut runs: Vec<Vec<f64>> = Vec::new();
        for w in marks.windows(2).filter(|w| there(0.5 * (w[0] + w[1]))) {
            match runs.last_mut().filter(|r| r.last() == Some(&w[0])) {
                Some(run) => run.push(w[1]),
                None => runs.push(vec![w[0], w[1]]),
            }
        }
        let offsets: &[f64] = if line.kind == LineKind::Double { &[-1.0, 1.0] } else { &[0.0] };
        // The line of an edge lies on the pavement.
        let half = if line.kind == LineKind::Double { 1.5 } else { 0.5 } * paint.width_m;
        let inwards = |s: f64| match lane {
            Some((side, i)) => side.sign() * (half - road.paved_beyond_m(side, i, s)).max(0.0),
            None => 0.0,
        };
        let t = |s: f64| road.t_m(&line.lateral, s) - inwards(s);
        let lifted = |s: f64, t: f64| deck.ground(s, t).0 + paint.thickness_m * DVec3::Z;
        let at = |s: f64, shift: f64| lifted(s, t(s) + shift);
        let end = |s: f64, shift: f64| lifted(s, before(&t, s) + shift);
        let mut mesh = Mesh::default();
        for run in &runs {
            let (from, to) = (run[0], run[run.len() - 1]);
            let mut dashes = vec![(from, to)];
            if line.kind == LineKind::Dashed {
                let period = paint.dash_m + paint.gap_m;
                let n = ((to - from) / period).ceil() as usize;
                dashes = (0..n)
                    .map(|i| (from + period * i as f64, to.min(from + period * i as f64 + paint.dash_m)))
                    .collect();
            }
            for (a, b) in dashes.into_iter().filter(|(a, b)| b - a > 1e-3) {
                let mut marks = vec![a, b];
                let (after, until) = (run.partition_point(|s| *s <= a), run.partition_point(|s| *s < b));
                add_marks(&mut marks, run[after..until.max(after)].iter().copied());
                for middle in offsets {
                    let (r, l) = ((middle - 0.5) * paint.width_m, (middle + 0.5) * paint.width_m);
                    for w in marks.windows(2) {
                        let quad = |a: f64, b: f64| {
                            let last = b == w[1];
                            let ahead = |shift| if last { end(b, shift) } else { at(b, shift) };
                            [at(a, r), ahead(r), ahead(l), at(a, l)]
                        };
                        for (a, b) in on_facets(deck, (w[0], w[1]), 0.1 * paint.thickness_m, &quad) {
                            polygon(&mut mesh, &quad(a, b), material);
                        }
                    }
                }
            }
        }
        let Some(first) = runs.first().and_then(|r| r.first()) else { return Ok(()) };
        let Some(id) = self.add(name, "lane_line", mesh, origin(road, *first)) else { return Ok(()) };
        for run in &runs {
            labels.push(LineLabel {
                id,
                name: name.into(),
                kind: line.kind,
                width_m: paint.width_m,
                points_m: run.iter().map(|s| rounded(at(*s, 0.0))).collect(),
            });
        }
        Ok(())
    }

    fn verge(&mut self, road: &Road, stations: &[f64], v: &VergePlan, number: usize) -> Result<()> {
        let material = self.material(&v.material)?;
        let foot = 1.0f64.min(0.5 * v.width_m);
        let sign = v.side.sign();
        let mut outline: Vec<DVec2> = [(0.0, 0.0), (foot, -v.drop_m), (v.width_m, -v.drop_m)]
            .map(|(y, z)| DVec2::new(sign * y, z))
            .to_vec();
        // A sheet that runs to the right looks up.
        if v.side == Side::Left {
            outline.reverse();
        }
        let n = road.side(v.side).len();
        let edge =
            |s: f64| if n == 0 { road.lane_offset.value(s) } else { road.edge_t_m(v.side, n - 1, true, s) };
        let mut marks = vec![v.span_m.start, v.span_m.end];
        add_marks(&mut marks, stations.iter().copied());
        road.check_turns("verge", &|s| edge(s) + sign * v.width_m, &marks)?;
        let mut mesh = Mesh::default();
        sweep(&mut mesh, road, &marks, &edge, &outline, Outline::Open, material);
        self.add(&format!("{}/verge {}", road.name, number + 1), "verge", mesh, origin(road, v.span_m.start));
        Ok(())
    }

    #[expect(clippy::too_many_arguments, reason = "a section along a line, named and placed")]
    fn swept(
        &mut self,
        road: &Road,
        name: &str,
        class: &str,
        lateral: &Lateral,
        span_m: &Range<f64>,
        sections: &[(&[DVec2], Outline)],
        material: &str,
    ) -> Result<()> {
        let material = self.material(material)?;
        let marks = self.marks(road, lateral, span_m);
        for x in sections.iter().flat_map(|(o, _)| o.iter()).map(|p| p.x) {
            road.check_turns(class, &|s| road.t_m(lateral, s) + x, &marks)?;
        }
        let mut mesh = Mesh::default();
        for (outline, kind) in sections {
            sweep(&mut mesh, road, &marks, &|s| road.t_m(lateral, s), outline, *kind, material);
        }
        self.add(name, class, mesh, origin(road, span_m.start));
        Ok(())
    }

    /// Stations of what stands at a lateral place.
    fn marks(&self, road: &Road, lateral: &Lateral, span_m: &Range<f64>) -> Vec<f64> {
        let coarse = [0.0, 0.25, 0.5, 0.75, 1.0].map(|x| span_m.start + x * (span_m.end - span_m.start));
        let reach = coarse.into_iter().map(|s| road.t_m(lateral, s).abs()).fold(0.0, f64::max) + 1.0;
        let mut marks = road.axis.stations_m(span_m.start, span_m.end, self.plan.sagitta_m, reach, 0.0);
        add_marks(&mut marks, lateral.offset.breaks_m());
        if !matches!(lateral.base, Base::Axis) {
            add_marks(&mut marks, road.breaks_m());
        }
        marks
    }

    fn rail(&mut self, road: &Road, deck: &Deck, r: &RailPlan, number: usize) -> Result<()> {
        let middle = r.height_m - W_BEAM_HALF_HEIGHT_M;
        // An outline that rises looks to the left.
        let mut outline: Vec<DVec2> =
            beam_outline().iter().map(|p| DVec2::new(r.faces.sign() * p.x, p.y + middle)).collect();
        if r.faces == Side::Right {
            outline.reverse();
        }
        let name = format!("{}/rail {}", road.name, number + 1);
        let sections = [(outline.as_slice(), Outline::Open)];
        self.swept(road, &name, "guard_rail", &r.lateral, &r.span_m, &sections, &r.material)?;
        if r.post_spacing_m <= 0.0 {
            return Ok(());
        }
        let material = self.material(&r.material)?;
        let shape = self.shared(u_post(0.10, 0.06, r.height_m, material));
        for (i, s) in steps(&r.span_m, r.post_spacing_m)?.into_iter().enumerate() {
            // Behind the beam, open to the traffic that comes on along the road.
            let t = road.t_m(&r.lateral, s) - 0.06 * r.faces.sign();
            let pose = deck.pose(s, t, 0.0, PI, false);
            self.scene.add_object(&format!("{name} post {}", i + 1), "post", shape, pose, DVec3::ZERO);
        }
        Ok(())
    }

    fn fence(&mut self, road: &Road, deck: &Deck, f: &FencePlan, number: usize) -> Result<()> {
        let name = format!("{}/fence {}", road.name, number + 1);
        let half = 0.5 * f.bar_m;
        let bars: Vec<[DVec2; 4]> = (0..f.bars)
            .map(|i| {
                let z = f.height_m * f64::from(i + 1) / f64::from(f.bars) - f.bar_m;
                [(-half, z - half), (half, z - half), (half, z + half), (-half, z + half)].map(DVec2::from)
            })
            .collect();
        let sections: Vec<(&[DVec2], Outline)> =
            bars.iter().map(|b| (b.as_slice(), Outline::Closed)).collect();
        self.swept(road, &name, "fence", &f.lateral, &f.span_m, &sections, &f.material)?;
        let material = self.material(&f.material)?;
        let size = DVec3::new(f.post_m, f.post_m, f.height_m + SUNK_M);
        let shape = self.shared(standing_box(size, material));
        for (i, s) in steps(&f.span_m, f.post_spacing_m)?.into_iter().enumerate() {
            let pose = deck.pose(s, road.t_m(&f.lateral, s), -SUNK_M, 0.0, false);
            self.scene.add_object(&format!("{name} post {}", i + 1), "fence", shape, pose, DVec3::ZERO);
        }
        Ok(())
    }

    fn gantry(&mut self, road: &Road, g: &GantryPlan, number: usize) -> Result<()> {
        let material = self.material(&g.material)?;
        let (a, b) = (road.t_m(&g.from, g.s_m), road.t_m(&g.to, g.s_m));
        let (t, width) = (0.5 * (a + b), (a - b).abs());
        let pose = road.axis.pose(RoadPoint { s_m: g.s_m, t_m: t, h_m: 0.0 }, 0.0, false);
        let beam = g.beam_m;
        let beam_at = DVec3::Z * (g.clearance_m + 0.5 * beam);
        let mut mesh = cuboid(DVec3::new(beam, width + beam, beam), beam_at, material);
        for side in [-1.0, 1.0] {
            // The legs end inside the beam and a little below the ground.
            let (top, foot) = (g.clearance_m + 0.25 * beam, -1.0);
            let size = DVec3::new(0.8 * beam, 0.8 * beam, top - foot);
            let leg = cuboid(size, DVec3::new(0.0, side * 0.5 * width, 0.5 * (top + foot)), material);
            append(&mut mesh, &leg, &Pose::<Target, Target>::IDENTITY);
        }
        for p in &mut mesh.positions_m {
            *p = pose.point(*p);
        }
        self.add(&format!("{}/gantry {}", road.name, number + 1), "gantry", mesh, pose);
        Ok(())
    }

    fn row(&mut self, road: &Road, deck: &Deck, r: &RowPlan) -> Result<()> {
        let places = places(road, r)?;
        let source = Source::Reflector(r.reflector.clone());
        let mut markers = Vec::with_capacity(places.len());
        for (i, (s_m, bit)) in places.into_iter().enumerate() {
            let yaw = r.yaw_rad + r.turn_rad * i as f64;
            let pose = deck.pose(s_m, road.t_m(&r.lateral, s_m), r.lift_m, yaw, r.lying);
            let turn = DQuat::from_rotation_y(r.pitch_rad) * DQuat::from_rotation_x(r.roll_rad);
            let pose = Pose::new(pose.rotation * turn, pose.translation_m);
            let name = format!("{}/{} {}", road.name, r.name, i + 1);
            let id = self.thing(&source, &name, &r.class, &pose, Going::default())?;
            markers.push(MarkerLabel { id, s_m: micro(s_m), position_m: rounded(pose.translation_m), bit });
        }
        if r.class == "marker" {
            let word = match &r.spacing {
                Spacing::Code { word, .. } => Some(word.iter().map(|b| if *b { '1' } else { '0' }).collect()),
                _ => None,
            };
            self.truth.marker_rows.push(MarkerRowLabel {
                name: r.name.clone(),
                road: road.name.clone(),
                reflector: r.reflector.spec(),
                word,
                markers,
            });
        }
        Ok(())
    }

    /// Places the parts of a source; the id of the first.
    fn thing(
        &mut self,
        source: &Source,
        name: &str,
        class: &str,
        pose: &Pose<Target, World>,
        going: Going,
    ) -> Result<u32> {
        let key = match source {
            Source::Reflector(r) => format!("reflector {}", r.spec()),
            Source::Vehicle { kind, rcs_dbsm } => format!("vehicle {kind} {rcs_dbsm:?}"),
            // Files are few, and compared by what is in them.
            Source::File(_) => String::new(),
        };
        let found = self.known.iter().position(|(k, s, _)| match source {
            Source::File(scene) => k.is_empty() && s == scene,
            _ => *k == key,
        });
        let k = match found {
            Some(k) => k,
            None => {
                let mut built = match source {
                    Source::Reflector(r) => r.to_scene(self.materials)?,
                    Source::Vehicle { kind, rcs_dbsm: None } => vehicle(kind, self.materials)?,
                    Source::Vehicle { kind, rcs_dbsm: Some(rcs_dbsm) } => {
                        as_a_point(vehicle(kind, self.materials)?, *rcs_dbsm)
                    }
                    Source::File(scene) => scene.clone(),
                };
                built.meshes.iter_mut().for_each(in_single_precision);
                if let Source::File(_) = source {
                    self.scene.import.notes.extend(of_object(name, &built.import.notes));
                }
                let first = self.scene.add_meshes(&built);
                self.known.push((key, built, first));
                self.known.len() - 1
            }
        };
        let (_, built, first) = &self.known[k];
        let clock_s = STAGGER_S * self.moving as f64;
        self.moving += usize::from(going.speed_mps != 0.0);
        let mut id = None;
        for part in &built.objects {
            let shape = match part.shape {
                Shape::Mesh(m) => Shape::Mesh(first + m),
                Shape::Table(t) => Shape::Table(self.scene.table_index(&built.tables[t])),
                point @ Shape::Point { .. } => point,
            };
            let name =
                if built.objects.len() == 1 { name.to_string() } else { format!("{name}/{}", part.name) };
            let class = if class.is_empty() { &part.class } else { class };
            let place = Pose::new(pose.rotation * part.pose.rotation, pose.point(part.pose.translation_m));
            let velocity = going.velocity_mps + pose.direction(part.velocity_mps);
            let new = self.scene.add_object(&name, class, shape, place, velocity);
            let parked = matches!(source, Source::Vehicle { .. }) && going.speed_mps == 0.0;
            if going.joints.is_some() || part.motion.is_some() && !parked {
                let mut joints = match source {
                    Source::Vehicle { .. } => driven(part.joints(), going.speed_mps, &going.way_m, clock_s),
                    _ => part.joints(),
                };
                match &going.joints {
                    Some(outer) => joints.extend(outer.iter().cloned()),
                    None => {
                        joints.push(Joint::Fixed(pose.rotation, pose.translation_m));
                        if going.velocity_mps != DVec3::ZERO {
                            joints.push(Joint::Line(going.velocity_mps));
                        }
                    }
                }
                self.scene.move_by(new, Motion { joints });
            }
            self.scene.set_radar(new, part.radar);
            id.get_or_insert(new);
        }
        id.ok_or_else(|| BadInput::new("has no parts").key(name).into())
    }
}

fn in_single_precision(mesh: &mut Mesh) {
    for p in &mut mesh.positions_m {
        *p = p.as_vec3().as_dvec3();
    }
}

/// The frame of what begins at `s_m`: on the axis, x along it, z up.
fn origin(road: &Road, s_m: f64) -> Pose<Target, World> {
    road.axis.pose(RoadPoint { s_m, t_m: 0.0, h_m: 0.0 }, 0.0, false)
}

/// The section of the rail's beam: (towards the traffic, up from its middle), rising.
fn beam_outline() -> Vec<DVec2> {
    let beam = w_beam(1.0, 0);
    let mut outline: Vec<DVec2> =
        beam.positions_m.iter().filter(|p| p.x < 0.0).map(|p| DVec2::new(p.y, p.z)).collect();
    outline.sort_by(|a, b| a.y.total_cmp(&b.y));
    outline
}

/// Sweeps an outline of (left, up) along the road at the lateral place `t_m`, with the windings of `extrude_x`.
fn sweep(
    mesh: &mut Mesh,
    road: &Road,
    stations: &[f64],
    t_m: &dyn Fn(f64) -> f64,
    outline: &[DVec2],
    kind: Outline,
    material: u32,
) {
    let ring = |s_m: f64, t: f64| -> Vec<DVec3> {
        let at = |p: &DVec2| road.axis.world(RoadPoint { s_m, t_m: t + p.x, h_m: p.y });
        outline.iter().map(at).collect()
    };
    let n = outline.len();
    let sides = if kind == Outline::Closed { n } else { n - 1 };
    let mut last: Option<Vec<DVec3>> = None;
    for w in stations.windows(2) {
        let (near, far) = (ring(w[0], t_m(w[0])), ring(w[1], before(t_m, w[1])));
        for i in 0..sides {
            let j = (i + 1) % n;
            polygon(mesh, &[near[i], near[j], far[j], far[i]], material);
        }
        // A body ends where the place steps, and begins again.
        if kind == Outline::Closed && last.as_ref() != Some(&near) {
            if let Some(last) = &last {
                polygon(mesh, last, material);
            }
            polygon(mesh, &near.iter().rev().copied().collect::<Vec<_>>(), material);
        }
        last = Some(far);
    }
    if let (Outline::Closed, Some(last)) = (kind, last) {
        polygon(mesh, &last, material);
    }
}

/// Halves a stretch until its quadrangle is as far over the facets everywhere as at its corners, within
/// `within_m`: paint crosses the diagonals of warped facets.
fn on_facets(
    deck: &Deck,
    stretch: (f64, f64),
    within_m: f64,
    quad: &dyn Fn(f64, f64) -> [DVec3; 4],
) -> Vec<(f64, f64)> {
    let (mut todo, mut done) = (vec![(stretch, 0)], Vec::new());
    while let Some(((a, b), depth)) = todo.pop() {
        let [p, q, u, v] = quad(a, b);
        let over = |x: f64, near: DVec3, far: DVec3| {
            let c = near.lerp(far, x);
            deck.facet(a + x * (b - a), c.truncate()).map(|f| c.z - f.0)
        };
        let off = [0.25, 0.5, 0.75].into_iter().flat_map(|x| [(x, p, q), (x, v, u)]).any(|(x, near, far)| {
            match (over(x, near, far), over(0.0, near, far), over(1.0, near, far)) {
                (Some(here), Some(first), Some(last)) => {
                    (here - (1.0 - x) * first - x * last).abs() > within_m
                }
                _ => false,
            }
        });
        if off && depth < 8 {
            let mid = 0.5 * (a + b);
            todo.push(((mid, b), depth + 1));
            todo.push(((a, mid), depth + 1));
        } else {
            done.push((a, b));
        }
    }
    done
}

/// Rounds a place to a micrometre, as labels are kept, because so many digits survive text exactly.
fn rounded(p: DVec3) -> [f64; 3] {
    p.to_array().map(micro)
}

fn micro(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}

/// The value before a step at `s_m`, where there is one.
fn before(value: &dyn Fn(f64) -> f64, s_m: f64) -> f64 {
    let (left, right) = (value(s_m - 1e-9), value(s_m));
    if (left - right).abs() > 1e-6 { left } else { right }
}

/// Stations from the beginning of a span to its end in equal steps, m.
fn steps(span_m: &Range<f64>, step_m: f64) -> Result<Vec<f64>> {
    let n = (span_m.end - span_m.start) / step_m * (1.0 + 1e-12);
    if n >= MAX_ROW as f64 {
        return Err(too_many(n));
    }
    Ok((0..=n as usize).map(|i| span_m.start + step_m * i as f64).collect())
}

fn too_many(n: f64) -> crate::base::error::Error {
    BadInput::new("needs too many objects")
        .value(format!("{n:.0}"))
        .allowed(format!("up to {MAX_ROW}"))
        .remedy("give a larger spacing or a shorter span")
        .into()
}

/// (s, position of the bit that the gap behind it spells) of each reflector of a row.
pub(super) fn places(road: &Road, r: &RowPlan) -> Result<Vec<(f64, Option<usize>)>> {
    if r.along_row {
        return places_along(road, r);
    }
    // Rounding keeps the last one of a row that just fits.
    let end = r.span_m.end + 1e-9;
    let mut s = r.span_m.start;
    let mut out = Vec::new();
    let mut next = |step: f64, bit: Option<usize>| -> Result<bool> {
        if s > end {
            return Ok(false);
        }
        if out.len() == MAX_ROW {
            return Err(too_many((end - r.span_m.start) / step));
        }
        out.push((s, bit));
        s += step;
        Ok(true)
    };
    match &r.spacing {
        Spacing::Even { spacing_m, count } => {
            // By multiplication, so that no error adds up.
            let last = count.map_or(end, |n| end.min(r.span_m.start + n as f64 * spacing_m));
            let mut all = steps(&(r.span_m.start..last), *spacing_m)?;
            all.truncate(count.unwrap_or(usize::MAX));
            return Ok(all.into_iter().map(|s| (s, None)).collect());
        }
        Spacing::Gaps(gaps) => {
            for gap in gaps.iter().chain([&0.0]) {
                next(*gap, None)?;
            }
        }
        Spacing::Code { word, zero_m, one_m, sync_m } => 'all: loop {
            for (i, bit) in word.iter().enumerate() {
                if !next(if *bit { *one_m } else { *zero_m }, Some(i))? {
                    break 'all;
                }
            }
            if let Some(sync) = sync_m
                && !next(*sync, None)?
            {
                break;
            }
        },
    }
    Ok(out)
}

/// Pieces of a row whose lengths are added up, m.
const PIECE_M: f64 = 0.05;

/// The same with distances along the row itself: its stations by its length.
fn places_along(road: &Road, r: &RowPlan) -> Result<Vec<(f64, Option<usize>)>> {
    let (from, to) = (r.span_m.start, r.span_m.end);
    let count = ((to - from) / PIECE_M).ceil().max(1.0) as usize;
    let station = |i: usize| from + (to - from) * i as f64 / count as f64;
    let at = |s_m: f64| {
        let p = road.axis.world(RoadPoint { s_m, t_m: road.t_m(&r.lateral, s_m), h_m: 0.0 });
        p.truncate()
    };
    let mut lengths = vec![0.0];
    let mut last = at(from);
    for i in 1..=count {
        let next = at(station(i));
        lengths.push(lengths[i - 1] + last.distance(next));
        last = next;
    }
    let row = RowPlan { span_m: 0.0..lengths[count], along_row: false, ..r.clone() };
    let of = |length: f64| {
        let i = lengths.partition_point(|l| *l <= length).clamp(1, count) - 1;
        let piece = (lengths[i + 1] - lengths[i]).max(f64::MIN_POSITIVE);
        (station(i) + (station(i + 1) - station(i)) * ((length - lengths[i]) / piece).min(1.0)).min(to)
    };
    Ok(places(road, &row)?.into_iter().map(|(length, bit)| (of(length), bit)).collect())
}

/// Labels are stated to a micrometre.
const MICRO_M: f64 = 1e-6;
/// Widths that change by more within a micrometre step, m.
const LEAST_STEP_M: f64 = 1e-3;

fn label(road: &Road, stations: &[f64], lines: Vec<LineLabel>) -> RoadLabel {
    // A width that steps has two values at one station: the one before it stands a micrometre before.
    let steps = |s: f64| {
        let by = |l: &Lane| (l.width.value(s - MICRO_M) - l.width.value(s)).abs();
        s >= MICRO_M && road.lanes().any(|(_, _, l)| by(l) > LEAST_STEP_M)
    };
    let stations: Vec<f64> =
        stations.iter().flat_map(|s| steps(*s).then_some(s - MICRO_M).into_iter().chain([*s])).collect();
    let stations = &stations[..];
    let at = |s_m: f64, t_m: f64| rounded(road.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 }));
    let along = |t: &dyn Fn(f64) -> f64| -> Polyline { stations.iter().map(|s| at(*s, t(*s))).collect() };
    let edge = |side| {
        let lateral = Lateral { base: Base::Edge(side), offset: Profile::constant(0.0) };
        along(&|s| road.t_m(&lateral, s))
    };
    let all: Vec<(Side, usize, &Lane)> = road.lanes().collect();
    let mut free_space_m = Vec::new();
    let mut first = 0;
    while first < all.len() {
        let end = first + all[first..].iter().take_while(|(_, _, l)| l.kind.is_drivable()).count();
        if end > first {
            let (left, right) = (all[first], all[end - 1]);
            let mut outline = along(&|s| road.lane_edges_t_m(right.0, right.1, s).1);
            outline.extend(along(&|s| road.lane_edges_t_m(left.0, left.1, s).0).into_iter().rev());
            free_space_m.push(outline);
        }
        first = end.max(first + 1);
    }
    let lane = |(side, i, l): &(Side, usize, &Lane)| LaneLabel {
        number: l.number,
        kind: l.kind,
        driven: l.driven,
        width_m: stations.iter().map(|s| micro(l.width.value(*s).max(0.0))).collect(),
        left_m: along(&|s| road.lane_edges_t_m(*side, *i, s).0),
        centre_m: along(&|s| {
            let (a, b) = road.lane_edges_t_m(*side, *i, s);
            0.5 * (a + b)
        }),
        right_m: along(&|s| road.lane_edges_t_m(*side, *i, s).1),
    };
    RoadLabel {
        name: road.name.clone(),
        length_m: micro(road.axis.length_m()),
        s_m: stations.iter().map(|s| micro(*s)).collect(),
        axis_m: along(&|_| 0.0),
        curvature_per_m: stations
            .iter()
            .map(|s| (1e12 * road.axis.at(*s).curvature_per_m).round() / 1e12)
            .collect(),
        left_edge_m: edge(Side::Left),
        right_edge_m: edge(Side::Right),
        lanes: all.iter().map(lane).collect(),
        lines,
        free_space_m,
    }
}
