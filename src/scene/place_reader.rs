//! Where things of a scenario are and how they go: a position with a velocity, or a trajectory.

use super::toml_file::{At, Document};
use super::trajectory::{self, Outside, Trajectory, TrajectoryTable};
use crate::base::error::{BadInput, Result};
use glam::DVec3;
use std::ops::Range;

/// How long a trajectory of a scenario lasts.
#[derive(Debug, Clone, PartialEq)]
pub struct Lasting {
    /// What follows it.
    pub name: String,
    /// First and last waypoint, s.
    pub span_s: (f64, f64),
    /// What happens outside of them.
    pub outside: Outside,
    /// Columns of its file that may have been meant and are passed over.
    pub passed_over: Vec<String>,
}

impl Lasting {
    /// What the user has to know where frames last from 0 to `last_s` and the trajectory does not, and where columns are passed over.
    pub(super) fn notes(&self, last_s: f64) -> Vec<String> {
        let (from, to) = self.span_s;
        let then = match self.outside {
            Outside::GoOn => "goes straight on",
            Outside::Stay => "stands still",
        };
        let name = &self.name;
        let mut notes = Vec::new();
        if from > 0.0 || to < last_s {
            notes.push(format!(
                "the trajectory of {name} lasts from {from} to {to} s, the frames from 0 to {last_s} s: outside its times it {then}"
            ));
        }
        if !self.passed_over.is_empty() {
            notes.push(format!(
                "the trajectory of {name}: the columns {} of the file are not used; yaw_deg, pitch_deg, roll_deg and z_m are read",
                self.passed_over.join(", ")
            ));
        }
        notes
    }
}

/// Reads where things are and how they go, and remembers how long trajectories last.
pub(super) struct PlaceReader<'a, 'b> {
    pub(super) doc: &'a Document<'b>,
    /// Time of the last frame, s.
    last_s: f64,
    pub(super) lasting: Vec<Lasting>,
}

/// Keys of a place: position, velocity, and the trajectory that takes the place of both.
pub(super) type PlaceKeys<'t> = (&'t Option<At<[f64; 3]>>, &'t At<[f64; 3]>, &'t Option<TrajectoryTable>);

impl<'a, 'b> PlaceReader<'a, 'b> {
    /// `last_s` is the time of the last frame.
    pub(super) fn new(doc: &'a Document<'b>, last_s: f64) -> PlaceReader<'a, 'b> {
        PlaceReader { doc, last_s, lasting: Vec::new() }
    }

    /// The trajectory of what has that name.
    pub(super) fn along(&mut self, key: &str, name: &str, t: &TrajectoryTable) -> Result<Trajectory> {
        let made = trajectory::build(self.doc, key, t)?;
        self.check_times(key, t, &made)?;
        for time_s in [0.0, self.last_s] {
            let place_m = made.motion.at(time_s).translation_m;
            self.check_place(BadInput::new("").file(self.doc.file()).key(key), place_m, time_s)?;
        }
        self.lasting.push(Lasting {
            name: name.into(),
            span_s: made.span_s,
            outside: t.outside,
            passed_over: made.passed_over.clone(),
        });
        Ok(made)
    }

    /// Whether the waypoints reach the run: of times that are another clock's nothing but straight extrapolation would be seen.
    fn check_times(&self, key: &str, t: &TrajectoryTable, made: &Trajectory) -> Result<()> {
        let (from, to) = made.span_s;
        let slack_s = match t.outside {
            Outside::GoOn => trajectory::LEAD_S,
            // It was said what happens outside of the waypoints, so that only times of another clock are refused.
            Outside::Stay => trajectory::LONGEST_S,
        };
        let missed_s = (from - self.last_s).max(-to);
        if missed_s <= slack_s {
            return Ok(());
        }
        let start_s = t.start_s.value;
        let problem = if from > self.last_s {
            "the waypoints begin after the last frame"
        } else {
            "the waypoints end before frame 0"
        };
        let clock = |s: f64| s + start_s;
        Err(BadInput::new(problem)
            .file(self.doc.file())
            .key(key)
            .value(format!("{} to {} s", clock(from), clock(to)))
            .allowed(format!("times that overlap the frames, {} to {} s", clock(0.0), clock(self.last_s)))
            .remedy(format!("set start_s to the waypoints' time of frame 0, as in start_s = {}", clock(from)))
            .into())
    }

    /// Whether a place that something has at a time of the run is near enough; `at` is where the file says how it moves.
    pub(super) fn check_place(&self, at: BadInput, place_m: DVec3, time_s: f64) -> Result<()> {
        if place_m.abs().max_element() <= trajectory::FAR_M {
            return Ok(());
        }
        let problem = "the position is too far from the origin during the frames".to_string();
        Err(BadInput { problem, ..at }
            .value(format!("[{:.3e}, {:.3e}, {:.3e}] m at {time_s} s", place_m.x, place_m.y, place_m.z))
            .allowed("-1e6..=1e6 m each")
            .remedy("give fewer frames, a shorter interval_s, a lower speed, or waypoints for the whole run")
            .into())
    }

    /// Position, velocity and trajectory; `span` is a value of the table to which they belong.
    pub(super) fn of(
        &mut self,
        key: &str,
        name: &str,
        (position, velocity, trajectory): PlaceKeys<'_>,
        span: &Range<usize>,
    ) -> Result<(DVec3, DVec3, Option<Trajectory>)> {
        let doc = self.doc;
        match (position, trajectory) {
            (Some(p), None) => {
                let (place_m, velocity_mps) = (doc.vector(p)?, speed(doc, velocity)?);
                let end_m = place_m + velocity_mps * self.last_s;
                self.check_place(doc.bad(&velocity.span, ""), end_m, self.last_s)?;
                Ok((place_m, velocity_mps, None))
            }
            (None, Some(t)) if velocity.value == [0.0; 3] => {
                let made = self.along(&format!("{key}.trajectory"), name, t)?;
                Ok((DVec3::ZERO, DVec3::ZERO, Some(made)))
            }
            (None, Some(_)) => {
                let e = doc.bad(&velocity.span, "velocity_mps and the trajectory exclude each other");
                Err(e.remedy("keep velocity_mps with position_m, or the trajectory").into())
            }
            (Some(p), Some(_)) => {
                let e = doc.bad(&p.span, "position_m and the trajectory exclude each other");
                Err(e.remedy("keep position_m, or the trajectory").into())
            }
            (None, None) => Err(doc
                .bad(span, format!("{name} has no position"))
                .key(format!("{key}.position_m"))
                .remedy("give position_m = [x, y, z], or a trajectory")
                .into()),
        }
    }
}

fn speed(doc: &Document<'_>, at: &At<[f64; 3]>) -> Result<DVec3> {
    let v = doc.vector(at)?;
    if v.length() < 1e5 {
        return Ok(v);
    }
    Err(doc.bad(&at.span, "is too fast").allowed("below 1e5 m/s").remedy("give metres per second").into())
}

#[cfg(test)]
mod tests {
    use crate::scene::scenario::parse;
    use crate::scene::unusual::of_scenario;
    use std::path::Path;

    fn scenario(more: &str) -> String {
        format!(
            "name = \"t\"\nradar = \"demo77\"\n{more}\n[[point]]\nposition_m = [30, 0, 0.5]\nrcs_dbsm = 10\n"
        )
    }

    fn along(times_s: [f64; 3], more: &str) -> String {
        let [a, b, c] = times_s;
        scenario(&format!(
            "frames = {{ count = 41, interval_s = 0.05 }}\n[ego.trajectory]\n{more}\nwaypoint = [\n\
             {{ time_s = {a}, position_m = [0, 0, 0] }},\n{{ time_s = {b}, position_m = [10, 0, 0] }},\n\
             {{ time_s = {c}, position_m = [20, 0, 0] }}]"
        ))
    }

    #[test]
    fn waypoints_of_another_clock_are_refused() {
        let file = Path::new("a.toml");
        let x = |text: &str| {
            let scenario = parse(file, text).unwrap();
            let crate::scene::scenario::EgoPlan::Free(ego) = scenario.ego else { panic!("no road here") };
            ego.at(0.0).translation_m.x
        };
        assert_eq!(x(&along([0.0, 1.0, 2.0], "")), 0.0);
        // Frames that last longer than the waypoints are noted, and go straight on.
        assert!((x(&along([1.0, 2.0, 3.0], "")) + 10.0).abs() < 1e-9);
        // Seconds since 1970, an hour late, an hour early.
        for (times, start) in [
            ([1_716_000_000.0, 1_716_000_001.0, 1_716_000_002.0], "start_s = 1716000000"),
            ([3600.0, 3601.0, 3602.0], "start_s = 3600"),
            ([-3602.0, -3601.0, -3600.0], "start_s = -3602"),
            ([2.5, 3.5, 4.5], "start_s = 2.5"),
        ] {
            let e = parse(file, &along(times, "")).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains("ego.trajectory") && text.contains(start), "{text}");
            // The remedy works.
            assert_eq!(x(&along(times, start)), 0.0);
        }
        // Standing still outside of them is what was asked for, unless the clock is another one.
        assert_eq!(x(&along([3600.0, 3601.0, 3602.0], "outside = \"stay\"")), 0.0);
        let e = parse(file, &along([1.7e9, 1.7e9 + 1.0, 1.7e9 + 2.0], "outside = \"stay\"")).unwrap_err();
        assert!(e.to_string().contains("start_s"), "{e}");
    }

    #[test]
    fn columns_that_may_be_meant_are_said() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.toml");
        let notes = |header: &str| {
            let columns = header.split(',').count();
            let row = |t: usize| {
                (0..columns)
                    .map(|i| if i == 0 { t } else { t * 10 }.to_string())
                    .collect::<Vec<_>>()
                    .join(",")
            };
            std::fs::write(dir.path().join("d.csv"), format!("{header}\n{}\n{}\n", row(0), row(1))).unwrap();
            let scenario = parse(&file, &scenario("[ego.trajectory]\nfile = \"d.csv\"")).unwrap();
            scenario.trajectories[0].notes(0.0).join("; ")
        };
        for plain in [
            "time_s,x_m,y_m",
            "time_s,x_m,y_m,z_m,yaw_deg,pitch_deg,roll_deg,yaw_rad",
            "time_s,x_m,y_m,zone,speed",
        ] {
            assert_eq!(notes(plain), "", "{plain}");
        }
        for (header, names) in [
            ("time_s,x_m,y_m,Yaw_deg", "columns Yaw_deg of the file are"),
            ("time_s,x_m,y_m,qx,qy,qz,qw", "columns qx, qy, qz, qw of the file are"),
            ("time_s,x_m,y_m,alt_m,heading_rad", "columns alt_m, heading_rad of the file are"),
            ("time_s,x_m,y_m,z,yaw_deg", "columns z of the file are"),
        ] {
            assert!(notes(header).contains(names), "{}", notes(header));
        }
    }

    #[test]
    fn nothing_leaves_the_world_while_the_frames_last() {
        let file = Path::new("a.toml");
        let long = "frames = { count = 100000, interval_s = 1 }\n";
        for (more, key) in [
            (format!("{long}ego = {{ speed_mps = 30 }}"), "ego.speed_mps"),
            (
                format!("{long}[[point]]\nposition_m = [5, 0, 0]\nvelocity_mps = [0, 50, 0]\nrcs_dbsm = 1"),
                "point[0].velocity_mps",
            ),
            (
                format!(
                    "{long}[ego.trajectory]\nwaypoint = [{{ time_s = 0, position_m = [0, 0, 0] }}, \
                     {{ time_s = 1, position_m = [20, 0, 0] }}]"
                ),
                "ego.trajectory",
            ),
        ] {
            let e = parse(file, &scenario(&more)).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(key) && text.contains("-1e6..=1e6"), "{text}");
        }
        parse(file, &scenario("frames = { count = 1000, interval_s = 1 }\nego = { speed_mps = 30 }"))
            .unwrap();
    }

    #[test]
    fn frames_that_overlap_are_said() {
        let lines = |frames: &str| {
            of_scenario(&parse(Path::new("a.toml"), &scenario(&format!("frames = {frames}"))).unwrap())
        };
        let none: [String; 0] = [];
        assert_eq!(lines("{ count = 2, interval_s = 0.05 }"), none);
        assert_eq!(lines("{ count = 1, interval_s = 0 }"), none);
        let said = lines("{ count = 2, interval_s = 0.001 }");
        assert!(said.len() == 1 && said[0].contains("frames.interval_s is 0.001 s"), "{said:?}");
    }
}
