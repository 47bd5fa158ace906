//! A drive is mapped with an inertial system's poses, other drives are located in its map, and words of
//! marker rows are read on the way (Feng 2019, sections 4.3.2 and 4.3.4).

mod figures;
mod looks;
mod mapped;
mod pictures;
mod settings;

use crate::trial::kit::*;
use crate::trial::signature::figures::{map_rows, notes, place_rows, sheets, word_rows};
use crate::trial::signature::looks::{Located, RowPicture, WordRead, Worse, compared};
use crate::trial::signature::mapped::{
    BEHIND_M, Kept, Mapped, at_rest, bus_of, estimator_on, kept, map_drive, moved_on, on_road,
};
use catseye_lane::signature::codewords::RowPoint;
use catseye_lane::signature::estimator::{Signature, StaticTest};
use catseye_lane::signature::map::Pose;
pub use settings::{CodeName, GapsTable, RowTable, Settings, SidesTable};

/// True lines ahead of the vehicle: the radar looks that way.
fn ahead(mut truth: TrueLanes) -> TrueLanes {
    truth.lines.iter_mut().for_each(|line| line.retain(|p| p[0] >= -BEHIND_M));
    truth
}

/// Removes a share of the points and adds as many others at random places of the row.
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

/// Removes a share of a look's points and adds as many other stationary ones, up to five metres along the
/// vehicle from one that was seen: in the rows, where they do harm.
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

impl LaneMethod for Settings {
    fn trial(&self, given: &TrialContext<'_>) -> Result<Trial> {
        self.check()?;
        let scenario = given.scenario;
        let (path, _) = on_road(scenario)?;
        let found = point_radar(&scenario.radars);
        let allowed = "a radar that measures points: fmcw, stepped or coded";
        let which = needed(found, given, "signature", allowed, "use radar = \"front77\"")?;
        let plan = scene_toml::load(path)?;
        // The frames of the map come before those of the runs.
        let before = u64::from(self.map_frames);
        let watch = |done: u64, all: u64| (given.watch)(before + done, before + all);
        let later = TrialContext { watch: &watch, keep: given.keep.clone(), ..*given };
        let all = before + u64::from(given.runs) * u64::from(scenario.frames.count);
        let mut mapped = map_drive(given, self, which, &plan, &mut |n| (given.watch)(n, all))?;
        let mut found =
            DriveResults { row_pictures: self.row.iter().map(|_| None).collect(), ..DriveResults::default() };
        for run in 0..given.runs {
            let mut scenario = given.scenario_of(run);
            let mut draws = Draws::new(scenario.seed as u32, 0x57a7);
            let further_m = self.vary_start_m * draws.uniform();
            if let Some(on) = scenario.ego.on_road_mut() {
                on.s_m += further_m;
                on.offset_m += self.vary_offset_m * (2.0 * draws.uniform() - 1.0);
            }
            // Other vehicles keep their distance.
            let site = Site::on(&scenario, moved_on(&plan, further_m))?;
            let drive = Drive::new(&site, given.engine)?;
            let mut looks = LocatedDrive {
                settings: self,
                estimator: estimator_on(self, &drive, which, &mapped)?,
                in_worse: match self.row.is_empty() {
                    true => None,
                    false => estimator_on(self, &drive, which, &mapped).ok(),
                },
                rest: at_rest(&drive, which),
                draws,
                worse_draws: Draws::new(scenario.seed as u32, 0x57a8),
                bus: bus_of(self, scenario.seed),
                way_m: 0.0,
                before: None,
                mapped: &mut mapped,
                found: &mut found,
            };
            drive_through(&later, (&drive, which), (run, drive.frames()), &mut looks)?;
        }

        let Mapped { map, way, errors, road, moving, .. } = mapped;
        let DriveResults { steps, places, words, row_pictures, shown } = found;
        let mut trial =
            Trial::new("signature", format!("{}: position in a map of static points", scenario.name));
        trial.rows = common_rows(&steps);
        place_rows(&mut trial.rows, &places);
        map_rows(&mut trial.rows, &map, &errors, &moving);
        word_rows(&mut trial.rows, self, &words);
        trial.sheets = sheets(self, &map, &places, &words);
        trial.pictures = pictures::all(&map, road.as_ref(), &way, &places, &row_pictures, shown.as_ref())?;
        trial.notes = notes(&steps, &row_pictures);
        trial.steps = steps;
        Ok(trial)
    }

    /// The road is mapped first, on a drive of its own with other traffic.
    fn ready(
        &self,
        given: &TrialContext<'_>,
        drive: &Drive<'_>,
        _: u32,
    ) -> Result<Vec<(String, ReadyMethod)>> {
        let which = chirp_radar(given, "signature")?;
        let plan = scene_toml::load(on_road(given.scenario)?.0)?;
        let mapped = map_drive(given, self, which, &plan, &mut |_| {})?;
        Ok(ReadyMethod::of_points(estimator_on(self, drive, which, &mapped)?, which).alone())
    }
}

/// Results of all drives.
#[derive(Default)]
struct DriveResults {
    steps: Vec<Step>,
    places: Vec<Located>,
    words: Vec<WordRead>,
    row_pictures: Vec<Option<RowPicture>>,
    /// The middle look of the first drive, for its picture.
    shown: Option<(Vec<LanePoint>, Step)>,
}

/// A drive that is located in the map.
struct LocatedDrive<'a> {
    settings: &'a Settings,
    estimator: Signature,
    /// Second estimator with worsened looks, for its rows.
    in_worse: Option<Signature>,
    rest: StaticTest,
    draws: Draws,
    worse_draws: Draws,
    bus: Bus,
    way_m: f64,
    /// Position of the vehicle at the last look.
    before: Option<DVec2>,
    mapped: &'a mut Mapped,
    found: &'a mut DriveResults,
}

impl Looks for LocatedDrive<'_> {
    type Kept = Kept;

    fn keep(&self, now: &Now<'_>, frame: &Frame) -> Kept {
        kept(now.drive, frame)
    }

    fn look(&mut self, now: &Now<'_>, k: Kept) -> Result<()> {
        let Now { drive, run, frame, time_s, level } = *now;
        let s = self.settings;
        let measured @ [speed, yaw_rate] = self.bus.read(&level);
        self.mapped.moving.count(&k, &self.rest.standing(&k.points, speed, Some(yaw_rate)));
        let look = SensorInput { points: &k.points, ..look_of(time_s, measured) };
        let (estimate, seconds) = timed(|| self.estimator.estimate(&look));
        if let Some(in_worse) = &mut self.in_worse {
            let points = worsened_look(&k.points, s.worse, &self.rest, measured, &mut self.worse_draws);
            let _ = in_worse.estimate(&SensorInput { points: &points, ..look });
        }
        self.way_m += self.before.map_or(0.0, |b| b.distance(level.at_m));
        self.before = Some(level.at_m);
        let truth = Pose { x_m: level.at_m.x, y_m: level.at_m.y, heading_rad: level.heading_rad };
        let place = self.estimator.place().cloned();
        let (error, nees) = place.as_ref().map(|p| compared(&truth, p)).unzip();
        let nees = nees.flatten();
        self.found.places.push(Located { run, time_s, way_m: self.way_m, truth, error, nees, place });
        for (i, reader) in self.estimator.rows().iter().enumerate() {
            let picked = reader.picked().unwrap_or_default();
            let side = s.row[i].sides.map_or(0.0, |x| x.side_m);
            let worse = worsened(&picked.points, s.worse, side, &mut self.draws);
            let written = s.row[i].written();
            let of_looks = self.in_worse.as_ref().and_then(|e| e.rows()[i].picked());
            let of_looks = of_looks.unwrap_or_default().points;
            let all = [(Worse::No, picked.points.clone()), (Worse::Row, worse), (Worse::Looks, of_looks)];
            for (worse, points) in all {
                let reading = reader.reader().read(std::slice::from_ref(&points)).ok();
                let right = reading.as_ref().zip(written.as_ref()).map(|(r, w)| r.word == *w);
                if let (Worse::No, Some(reading)) = (worse, reading.clone()) {
                    let (table, picked) = (s.row[i].clone(), picked.clone());
                    self.found.row_pictures[i] = Some(RowPicture { table, picked, reading });
                }
                let points = points.len();
                self.found.words.push(WordRead { run, frame, row: i, worse, points, reading, right });
            }
        }
        let truth = ahead(drive.truth(time_s, [5.0, s.reach_m]));
        let step = Step::new(run, frame, (estimate, seconds), truth);
        if run == 0 && frame == drive.frames() / 2 {
            self.found.shown = Some((k.points, step.clone()));
        }
        self.found.steps.push(step);
        Ok(())
    }
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
                    power_dbm: None,
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
