//! Vehicles drawn at random on the lanes of a road file.

use crate::trial::hd_map::settings::{SceneTable, Settings};
use crate::trial::hd_map::stage::Stage;
use crate::trial::kit::*;
use catseye::road::axis::RoadPoint;
use catseye::road::layout::{Base, Driven, InLane, Lane, LaneKind, Lateral, Side};
use catseye::road::plan::{Source, ThingPlan};
use catseye::road::profile::Profile;
use catseye::road::site;
use catseye::scene::drive::Drive;

/// Prefix of the names of vehicles that count.
pub const COUNTED: &str = "vehicle";
/// Least distance between the middles of two vehicles in one lane, m.
const GAP_M: f64 = 20.0;
/// Least width of a lane that holds a vehicle, m.
const WIDE_ENOUGH_M: f64 = 2.8;
/// Number of places that are tried for a vehicle.
const TRIES: u32 = 4000;

/// Vehicles that are in view together.
pub struct Group {
    /// Plan with those vehicles; None where the scenario is driven as it is.
    pub plan: Option<ScenePlan>,
}

/// A lane of a plan: road, side, index.
type LaneAt = (usize, Side, usize);

/// Motion of a vehicle: lane, distance along the road at time zero, speed along the road.
struct Placed {
    lane: LaneAt,
    s_m: f64,
    along_mps: f64,
}

/// The groups of a scene, each drawn separately, until all vehicles have passed.
///
/// # Errors
/// Returns an error if no lane holds a vehicle within the radar's view.
pub fn groups(stage: &Stage, settings: &Settings, scenario: &Scenario) -> Result<Vec<Group>> {
    let (Some(table), Some(plan)) = (&stage.table, &stage.plan) else {
        return Ok(vec![Group { plan: None }]);
    };
    let mut out = Vec::new();
    let mut left = table.vehicles;
    while left > 0 {
        let count = left.min(settings.together);
        let seed = scenario.seed.wrapping_add(1000 * out.len() as u64);
        let mut draws = draws(seed, 0x7aff);
        // A view may be full before it holds all of them.
        let (plan, placed) = group(plan, table, settings, scenario, count, &mut draws)?;
        out.push(Group { plan: Some(plan) });
        left -= placed.clamp(1, count);
    }
    Ok(out)
}

fn group(
    plan: &ScenePlan,
    table: &SceneTable,
    settings: &Settings,
    scenario: &Scenario,
    count: u32,
    draws: &mut Draws,
) -> Result<(ScenePlan, u32)> {
    let mut plan = plan.clone();
    let driving: Vec<LaneAt> = lanes(&plan, |l| l.kind == LaneKind::Driving);
    let counted: Vec<LaneAt> = match table.lanes.is_empty() {
        true => driving.clone(),
        false => lanes(&plan, |l| table.lanes.contains(&l.number)),
    };
    let ego = site::ego_on(scenario, &plan)?;
    let end_s = scenario.frames.time_s(scenario.frames.count.saturating_sub(1));
    let now = ego.at(0.5 * end_s);
    let boresight = scenario.radars[0].mounting.rotation;
    let ahead = (now.rotation * (boresight * glam::DVec3::X)).truncate().normalize_or(DVec2::X);
    let from = now.translation_m.truncate();
    let mut placed: Vec<Placed> = Vec::new();
    let mut counting = 0;
    for k in 0..count + table.others {
        let counts = k < count;
        let allowed = if counts { &counted } else { &driving };
        let found = (0..TRIES).find_map(|_| {
            let at @ (road, side, index) = *allowed.get((draws.uniform() * allowed.len() as f64) as usize)?;
            let r = &plan.roads[road].road;
            let lane = &r.side(side)[index];
            let back = lane.driven == Driven::Backward;
            let speed = speed_mps(lane, index, draws);
            let along = if back { -speed } else { speed };
            let middle = draws.uniform() * r.axis.length_m();
            let s_m = middle - along * 0.5 * end_s;
            let offset = settings.wander_m * draws.normal();
            let (first, last) = (s_m.min(s_m + along * end_s), s_m.max(s_m + along * end_s));
            // All of the vehicle is on the road, all the time, where the lane is wide.
            if first < 10.0 || last > r.axis.length_m() - 10.0 {
                return None;
            }
            let narrow = (0..=10)
                .any(|i| lane.width.value(first + (last - first) * f64::from(i) / 10.0) < WIDE_ENOUGH_M);
            let lateral =
                Lateral { base: Base::Lane(side, index, InLane::Centre), offset: Profile::constant(offset) };
            let p =
                r.axis.world(RoadPoint { s_m: middle, t_m: r.t_m(&lateral, middle), h_m: 0.0 }).truncate()
                    - from;
            let seen = (settings.near_m..=settings.far_m).contains(&p.length())
                && ahead.angle_to(p).abs() <= settings.view_deg.to_radians();
            let near = placed.iter().any(|o| {
                let apart = |t: f64| (s_m + along * t - o.s_m - o.along_mps * t).abs();
                o.lane == at && apart(0.0).min(apart(end_s)) < GAP_M
            });
            (!narrow && seen && !near).then_some((at, lateral, s_m, along, speed))
        });
        let Some((at, lateral, s_m, along, speed)) = found else {
            // A full view is no fault once some are in it.
            if !counts || counting > 0 {
                continue;
            }
            let reach = format!("{}..={} m from the radar", settings.near_m, settings.far_m);
            let bad = BadInput::new("no vehicle fits into the radar's field of view");
            let bad = bad.key("lane.hd_map.scene.lanes").allowed(reach);
            return Err(bad
                .remedy("point the radar along these lanes (radar_s_m), or change near_m, far_m, view_deg")
                .into());
        };
        let (road, side, index) = at;
        let back = plan.roads[road].road.side(side)[index].driven == Driven::Backward;
        let kind =
            &settings.kinds[(draws.uniform() * settings.kinds.len() as f64) as usize % settings.kinds.len()];
        counting += u32::from(counts);
        let prefix = if counts { COUNTED } else { "other" };
        placed.push(Placed { lane: at, s_m, along_mps: along });
        plan.roads[road].things.push(ThingPlan {
            name: format!("{prefix} {}", k + 1),
            class: String::new(),
            source: Source::Vehicle { kind: kind.clone(), rcs_dbsm: None },
            s_m,
            lateral,
            yaw_rad: if back { std::f64::consts::PI } else { 0.0 },
            pitch_rad: 0.0,
            roll_rad: 0.0,
            lift_m: 0.0,
            speed_mps: 0.0,
            drive: Some(Drive::steady(speed)),
            against: back,
            lying: true,
        });
    }
    Ok((plan, counting))
}

fn lanes(plan: &ScenePlan, wanted: impl Fn(&Lane) -> bool) -> Vec<LaneAt> {
    let of = |(k, r): (usize, &catseye::road::plan::RoadPlan)| {
        r.road.lanes().filter(|(_, _, l)| wanted(l)).map(|(side, i, _)| (k, side, i)).collect::<Vec<_>>()
    };
    plan.roads.iter().enumerate().flat_map(of).collect()
}

/// Faster towards the median; slow on ramps and in bays.
fn speed_mps(lane: &Lane, index: usize, draws: &mut Draws) -> f64 {
    let (low, high) = match lane.kind {
        LaneKind::Ramp => (11.0, 17.0),
        LaneKind::Bay | LaneKind::Emergency => (3.0, 8.0),
        _ if index <= 1 => (28.0, 34.0),
        _ if index == 2 => (24.0, 31.0),
        _ => (21.0, 27.0),
    };
    low + (high - low) * draws.uniform()
}
