//! A drive is mapped with an inertial system's poses, other drives are located in its map, and words of marker rows are read on the
//! way (Feng 2019, sections 4.3.2 and 4.3.4).

mod figures;

mod looks;

mod mapped;

mod pictures;

mod ready;

mod settings;

use crate::trial::context::TrialContext;
use crate::trial::drive::{Drive, Level, suitable};
use crate::trial::report::{Step, Trial, common_rows};
use crate::trial::sensors::SpeedSensor;
use crate::trial::signature::figures::{map_rows, notes, place_rows, sheets, word_rows};
use crate::trial::signature::looks::{Located, RowPicture, WordRead, Worse, compared};
use crate::trial::signature::mapped::{
    BEHIND_M, Kept, Mapped, at_rest, estimator_on, kept, map_drive, moved_on, needs, on_road,
};
use crate::trial::stats::timed;
use catseye::error::Result;
use catseye::rng::Draws;
use catseye::road::scene_toml;
use catseye::road::site::Site;
use catseye::scene::waveform::Waveform;
use catseye_lane::score::TrueLanes;
use catseye_lane::signature::codewords::RowPoint;
use catseye_lane::signature::estimator::StaticTest;
use catseye_lane::signature::map::Pose;
use catseye_lane::{LaneEstimator, LanePoint, Measured, SensorInput};
use glam::DVec2;
pub(super) use ready::ready_method;
pub use settings::{CodeName, GapsTable, RowTable, Settings, SidesTable};

/// True lines ahead of the vehicle: the radar looks that way.
fn ahead(mut truth: TrueLanes) -> TrueLanes {
    for line in &mut truth.lines {
        line.retain(|p| p[0] >= -BEHIND_M);
    }
    truth
}

fn pose(level: &Level) -> Pose {
    Pose { x_m: level.at_m.x, y_m: level.at_m.y, heading_rad: level.heading_rad }
}

/// Takes a share of the points away and adds as many others at random places of the row.
fn worsened(points: &[RowPoint], share: f64, spread_m: f64, draws: &mut Draws) -> Vec<RowPoint> {
    let mut out: Vec<RowPoint> = points.iter().filter(|_| draws.uniform() >= share).copied().collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return out };
    for _ in 0..(share * points.len() as f64).round() as usize {
        let s_m = first.s_m + (last.s_m - first.s_m) * draws.uniform();
        out.push(RowPoint { s_m, t_m: spread_m * (2.0 * draws.uniform() - 1.0), ..*first });
    }
    out.sort_by(|a, b| a.s_m.total_cmp(&b.s_m));
    out
}

/// Takes a share of a look's points away and adds as many others that stand, up to five metres along the vehicle from one that was
/// seen: in the rows, where they do harm.
fn worsened_look(
    points: &[LanePoint],
    share: f64,
    rest: &StaticTest,
    [speed, yaw]: [Measured; 2],
    draws: &mut Draws,
) -> Vec<LanePoint> {
    let mut out: Vec<LanePoint> = points.iter().filter(|_| draws.uniform() >= share).copied().collect();
    let radar = DVec2::from_array(rest.radar_m);
    let velocity = DVec2::new(speed.value - yaw.value * radar.y, yaw.value * radar.x);
    for p in points {
        let (other, by_m) = (draws.uniform() < share, 10.0 * draws.uniform() - 5.0);
        if !other {
            continue;
        }
        let at = DVec2::from_array(p.at_m) + DVec2::X * by_m;
        let seen = at - radar;
        let range_m = seen.length();
        let turn = if p.range_m > 0.0 { range_m / p.range_m } else { 1.0 };
        out.push(LanePoint {
            at_m: at.to_array(),
            std_m: [p.std_m[0], p.std_m[1] * turn],
            range_m,
            azimuth_rad: seen.to_angle(),
            range_rate_mps: -velocity.dot(seen.normalize_or_zero()),
            ..*p
        });
    }
    out
}

/// Maps a drive, locates the runs in it, reads the rows. Errors: a scenario without a road file, an ego that is not on a road, no
/// radar with angles; those of the simulation.
pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    settings.check()?;
    let s = settings;
    let scenario = given.scenario;
    let (path, _) = on_road(scenario)?;
    let Some(which) = suitable(&scenario.radars, |w| !matches!(w, Waveform::Pulse { .. })) else {
        return Err(needs("needs a radar that gives angles", "radar", "take radar = \"front77\""));
    };
    let plan = scene_toml::load(path)?;
    let all = u64::from(s.map_frames) + u64::from(given.runs) * u64::from(scenario.frames.count);
    let mut done = 0;

    let mut told = |n: u64| (given.watch)(n, all);
    let mut mapped = map_drive(given, s, which, &plan, &mut told)?;
    done += u64::from(s.map_frames);

    // The drives that are located.
    let (mut steps, mut places, mut words) = (Vec::new(), Vec::new(), Vec::new());
    let mut row_pictures: Vec<Option<RowPicture>> = s.row.iter().map(|_| None).collect();
    let mut shown: Option<(Vec<LanePoint>, Step)> = None;
    for run in 0..given.runs {
        let mut scenario = given.scenario_of(run);
        let mut draws = Draws::new(scenario.seed as u32, 0x57a7);
        let further_m = s.vary_start_m * draws.uniform();
        if let Some(on) = &mut scenario.ego.on_road {
            on.s_m += further_m;
            on.offset_m += s.vary_offset_m * (2.0 * draws.uniform() - 1.0);
        }
        // Other vehicles keep their distance.
        let site = Site::on(&scenario, moved_on(&plan, further_m))?;
        let drive = Drive::new(&site, given.engine)?;
        let mut estimator = estimator_on(s, &drive, which, &mapped)
            .map_err(|e| needs(&e.to_string(), "lane.signature", "change the setting that it names"))?;
        // Beside it one whose looks are worse, for its rows.
        let mut in_worse = match s.row.is_empty() {
            true => None,
            false => estimator_on(s, &drive, which, &mapped).ok(),
        };
        let mut worse_draws = Draws::new(scenario.seed as u32, 0x57a8);
        let mut speed = SpeedSensor::new(scenario.seed, s.speed_std_mps, 0.0);
        let mut yaw = SpeedSensor::new(scenario.seed ^ 0x9e37, s.yaw_rate_std_deg_per_s.to_radians(), 0.0);
        let mut way_m = 0.0;
        let mut before: Option<DVec2> = None;
        for f in 0..drive.frames() {
            let k =
                given.kept(&format!("run{run}_frame{f}"), || Ok(kept(&drive, &drive.frame(which, f)?)))?;
            let time_s = drive.time_s(f);
            let level = drive.level(time_s);
            let measured: [Measured; 2] = [speed.read(level.speed_mps), yaw.read(level.yaw_rate_rad_per_s)];
            mapped.moving.count(&k, &estimator_rest(&drive, which, &k, measured));
            let look = SensorInput {
                time_s,
                speed_mps: Some(measured[0]),
                yaw_rate_rad_per_s: Some(measured[1]),
                points: &k.points,
                ..SensorInput::default()
            };
            let (estimate, seconds) = timed(|| estimator.estimate(&look));
            if let Some(in_worse) = &mut in_worse {
                let points =
                    worsened_look(&k.points, s.worse, &at_rest(&drive, which), measured, &mut worse_draws);
                let _ = in_worse.estimate(&SensorInput { points: &points, ..look });
            }
            way_m += before.map_or(0.0, |b| b.distance(level.at_m));
            before = Some(level.at_m);
            let truth = pose(&level);
            let place = estimator.place().cloned();
            let found = place.as_ref().map(|p| compared(&truth, p));
            places.push(Located {
                run,
                time_s,
                way_m,
                truth,
                error: found.map(|f| f.0),
                nees: found.and_then(|f| f.1),
                place,
            });
            for (i, reader) in estimator.rows().iter().enumerate() {
                let picked = reader.picked().unwrap_or_default();
                let side = s.row[i].sides.map_or(0.0, |x| x.side_m);
                let worse = worsened(&picked.points, s.worse, side, &mut draws);
                let written = s.row[i].written();
                let of_looks = in_worse.as_ref().and_then(|e| e.rows()[i].picked());
                let of_looks = of_looks.unwrap_or_default().points;
                let all = [(Worse::No, picked.points.clone()), (Worse::Row, worse), (Worse::Looks, of_looks)];
                for (worse, points) in all {
                    let reading = reader.reader().read(std::slice::from_ref(&points)).ok();
                    let right = reading.as_ref().zip(written.as_ref()).map(|(r, w)| r.word == *w);
                    if let (Worse::No, Some(reading)) = (worse, reading.clone()) {
                        let (table, picked) = (s.row[i].clone(), picked.clone());
                        row_pictures[i] = Some(RowPicture { table, picked, reading });
                    }
                    let points = points.len();
                    words.push(WordRead { run, frame: f, row: i, worse, points, reading, right });
                }
            }
            let truth = ahead(drive.truth(time_s, [5.0, s.reach_m]));
            let step = Step::new(run, f, (estimate, seconds), truth);
            if run == 0 && f == drive.frames() / 2 {
                shown = Some((k.points.clone(), step.clone()));
            }
            steps.push(step);
            done += 1;
            (given.watch)(done, all);
        }
    }

    let Mapped { map, way: map_way, errors: map_errors, road, moving, .. } = mapped;
    let mut trial = Trial::new("signature", format!("{}: place in a map of static points", scenario.name));
    trial.rows = common_rows(&steps);
    trial.rows.extend(place_rows(&places));
    trial.rows.extend(map_rows(&map, &map_errors, &moving));
    trial.rows.extend(word_rows(s, &words));
    trial.sheets = sheets(s, &map, &places, &words);
    trial.pictures = pictures::all(&map, road.as_ref(), &map_way, &places, &row_pictures, shown.as_ref())?;
    trial.notes = notes(&steps, &row_pictures);
    trial.steps = steps;
    Ok(trial)
}

fn estimator_rest(drive: &Drive<'_>, which: usize, k: &Kept, [speed, yaw]: [Measured; 2]) -> Vec<bool> {
    at_rest(drive, which).standing(&k.points, speed, Some(yaw))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worse_look_lacks_points_and_has_others_that_stand() {
        let rest = StaticTest { radar_m: [3.6, 0.0], ..StaticTest::default() };
        let own = [Measured { value: 12.0, std: 0.05 }, Measured { value: 0.1, std: 0.003 }];
        let mut draws = Draws::new(4, 1);
        let points: Vec<LanePoint> = (0..4000)
            .map(|_| {
                let seen = DVec2::new(5.0 + 30.0 * draws.uniform(), 3.5 * draws.uniform() - 1.75);
                let velocity = DVec2::new(12.0, 0.1 * 3.6);
                LanePoint {
                    at_m: (seen + DVec2::new(3.6, 0.0)).to_array(),
                    std_m: [0.1, 0.2],
                    range_rate_mps: -velocity.dot(seen.normalize()),
                    range_rate_std_mps: 0.03,
                    range_m: seen.length(),
                    azimuth_rad: seen.to_angle(),
                    rcs_dbsm: -20.0,
                    snr_db: 20.0,
                }
            })
            .collect();
        let worse = worsened_look(&points, 0.1, &rest, own, &mut draws);
        let kept = worse.iter().filter(|p| points.contains(p)).count();
        // Four standard deviations of a share of 4000.
        assert!((3524..3676).contains(&kept), "{kept}");
        assert!((324..476).contains(&(worse.len() - kept)), "{}", worse.len());
        assert!(rest.standing(&worse, own[0], Some(own[1])).iter().all(|s| *s));
        assert_eq!(worsened_look(&points, 0.0, &rest, own, &mut draws), points);
    }
}
