//! Counts over frames for a dataset's statistics. They are sums of integers, so the order of frames does not
//! matter.

use super::drawn_scene::DrawnScene;
use super::store::Table;
use catseye::engine::Stage;
use catseye::simulate::Frame;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Width of the bins of SNR, dB.
pub const SNR_BIN_DB: f64 = 5.0;
/// Width of the bins of range, m.
pub const RANGE_BIN_M: f64 = 10.0;

/// Counts of some frames.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tally {
    /// Number of frames.
    pub frames: u64,
    /// Number of frames of each part.
    pub splits: BTreeMap<String, u64>,
    /// Number of echoes.
    pub echoes: u64,
    /// Number of points.
    pub points: u64,
    /// Least and greatest number of points in a frame, of all radars.
    pub points_a_frame: Option<[u64; 2]>,
    /// Number of points by the lower end of their SNR bin, dB.
    pub snr_db: BTreeMap<i32, u64>,
    /// Number of points by the lower end of their range bin, m.
    pub range_m: BTreeMap<i32, u64>,
    /// Counts by class.
    pub classes: BTreeMap<String, ClassTally>,
    /// Number of scenes that begin in these frames.
    pub scenes: u64,
    /// Number of vehicles that were drawn again because they overlapped others.
    pub redrawn: u64,
    /// Number of objects that were left out because others stand in their place.
    pub dropped: u64,
    /// Greatest number of rows in a frame, by table.
    #[serde(default)]
    pub rows_a_frame_most: BTreeMap<String, u64>,
    /// Number of frames, of each radar by itself, whose beams the host followed because the device refused, by the reason.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub trace_fallbacks: BTreeMap<String, u64>,
}

/// Counts of one class, "" for none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassTally {
    /// Number of objects in the scenes, each counted once per scene.
    pub objects: u64,
    /// Number of points that are labelled with the class.
    pub points: u64,
    /// Number of those that are ghosts. Datasets made before November 2026 count none here, nor sidelobes.
    #[serde(default)]
    pub ghosts: u64,
    /// Number of those that lie in sidelobes.
    #[serde(default)]
    pub side_lobes: u64,
    /// Number of those that are out of place by a whole ambiguity. Datasets made before December 2026 count none here, nor
    /// aliased ones.
    #[serde(default)]
    pub folded: u64,
    /// Number of those whose echo is beyond the sampled band.
    #[serde(default)]
    pub aliased: u64,
}

fn bin(x: f64, width: f64) -> i32 {
    // Casts saturate; a value that is no number counts as 0.
    (x / width).floor() as i32 * width as i32
}

impl Tally {
    /// Counts one frame of all radars of a site.
    pub fn of(site: &DrawnScene, split: &str, radars: &[Frame]) -> Tally {
        let mut t = Tally { frames: 1, ..Default::default() };
        t.splits.insert(split.to_string(), 1);
        for f in radars {
            t.echoes += f.echoes.list.len() as u64;
            t.points += f.points.len() as u64;
            if let Some(why) = &f.echoes.fallback {
                *t.trace_fallbacks.entry(why.to_string()).or_default() += 1;
            }
            for p in &f.points {
                // In a cube without noise the ratio is infinite.
                if p.snr_db.is_finite() {
                    *t.snr_db.entry(bin(p.snr_db, SNR_BIN_DB)).or_default() += 1;
                }
                *t.range_m.entry(bin(p.range_m, RANGE_BIN_M)).or_default() += 1;
                // Points that only fill grids have no labels.
                if f.ran.of(Stage::Labels) == 0 {
                    continue;
                }
                let class = t.classes.entry(p.class.clone()).or_default();
                class.points += 1;
                class.ghosts += u64::from(p.ghost);
                class.side_lobes += u64::from(p.side_lobe);
                class.folded += u64::from(p.folded);
                class.aliased += u64::from(p.aliased);
            }
        }
        // Nobody counts the points of frames that were made without them.
        t.points_a_frame = radars.iter().any(|f| f.ran.of(Stage::Angles) > 0).then_some([t.points; 2]);
        if radars.first().is_some_and(|f| f.index == 0) {
            t.scenes = 1;
            (t.redrawn, t.dropped) = (site.redrawn.into(), site.dropped.into());
            for o in &site.scene.objects {
                t.classes.entry(o.class.clone()).or_default().objects += 1;
            }
        }
        t
    }

    /// Notes the numbers of rows of a frame's tables.
    pub fn note_rows(&mut self, tables: &[Table]) {
        for t in tables {
            let most = self.rows_a_frame_most.entry(t.name.clone()).or_default();
            *most = (*most).max(t.rows() as u64);
        }
    }

    /// Adds the counts of another tally.
    pub fn add(&mut self, o: &Tally) {
        fn maps<K: Ord + Clone>(a: &mut BTreeMap<K, u64>, b: &BTreeMap<K, u64>) {
            b.iter().for_each(|(k, n)| *a.entry(k.clone()).or_default() += n);
        }
        self.frames += o.frames;
        self.echoes += o.echoes;
        self.points += o.points;
        self.scenes += o.scenes;
        self.redrawn += o.redrawn;
        self.dropped += o.dropped;
        self.points_a_frame = match (self.points_a_frame, o.points_a_frame) {
            (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
            (a, b) => a.or(b),
        };
        for (table, rows) in &o.rows_a_frame_most {
            let most = self.rows_a_frame_most.entry(table.clone()).or_default();
            *most = (*most).max(*rows);
        }
        maps(&mut self.splits, &o.splits);
        maps(&mut self.trace_fallbacks, &o.trace_fallbacks);
        maps(&mut self.snr_db, &o.snr_db);
        maps(&mut self.range_m, &o.range_m);
        for (class, n) in &o.classes {
            let here = self.classes.entry(class.clone()).or_default();
            here.objects += n.objects;
            here.points += n.points;
            here.ghosts += n.ghosts;
            here.side_lobes += n.side_lobes;
            here.folded += n.folded;
            here.aliased += n.aliased;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_begin_below_their_values() {
        assert_eq!([-0.1, 0.0, 4.9, 5.0, 12.0].map(|x| bin(x, 5.0)), [-5, 0, 0, 5, 10]);
    }

    #[test]
    fn sums_do_not_depend_on_the_order() {
        let one = |points: u64, class: &str| {
            let mut t = Tally { frames: 1, points, points_a_frame: Some([points; 2]), ..Default::default() };
            t.classes.insert(
                class.into(),
                ClassTally { objects: 1, points, ghosts: 1, side_lobes: 2, folded: 1, aliased: 3 },
            );
            t.snr_db.insert(10, points);
            t.rows_a_frame_most.insert("points".into(), points);
            t.trace_fallbacks.insert("a reason".into(), 1);
            t
        };
        let parts = [one(3, "car"), one(7, "marker"), one(5, "car")];
        let sum = |order: [usize; 3]| {
            let mut t = Tally::default();
            order.iter().for_each(|i| t.add(&parts[*i]));
            t
        };
        let t = sum([0, 1, 2]);
        assert_eq!(t, sum([2, 0, 1]));
        assert_eq!((t.points, t.points_a_frame, t.snr_db[&10]), (15, Some([3, 7]), 15));
        assert_eq!((t.rows_a_frame_most["points"], t.trace_fallbacks["a reason"]), (7, 3));
        assert_eq!(
            t.classes["car"],
            ClassTally { objects: 2, points: 8, ghosts: 2, side_lobes: 4, folded: 2, aliased: 6 }
        );
        let text = serde_json::to_string(&t).unwrap();
        assert_eq!(serde_json::from_str::<Tally>(&text).unwrap(), t);
        // Shards that were made before these were counted.
        let before = text.replace(",\"ghosts\":2,\"side_lobes\":4,\"folded\":2,\"aliased\":6", "");
        assert!(before.len() < text.len());
        let read = serde_json::from_str::<Tally>(&before).unwrap();
        assert_eq!(read.classes["car"], ClassTally { objects: 2, points: 8, ..ClassTally::default() });
    }
}
