//! A map of lanes: the two edges of each one-way carriageway and the lanes between them.

use super::geodesy::Wgs84;
use crate::error::LaneError;
use serde::{Deserialize, Serialize};

/// Largest width of a lane or strip, m.
const MAX_WIDTH_M: f64 = 100.0;

/// What a lane or strip is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LaneKind {
    /// A lane for driving.
    #[default]
    Driving,
    /// The emergency lane.
    Emergency,
    /// An emergency bay beside the emergency lane.
    Bay,
    /// A lane that opens or leaves at a junction.
    Ramp,
    /// A strip inside the inner edge, not a lane.
    Median,
    /// A strip outside the outer edge, not a lane.
    Shoulder,
}

impl LaneKind {
    fn is_strip(self) -> bool {
        matches!(self, LaneKind::Median | LaneKind::Shoulder)
    }
}

/// The width of a lane in metres: one value, or a list of (distance along the inner edge from its first
/// point, width), linear between entries and constant beyond them. Two entries at one distance make a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Width {
    /// One width everywhere, m.
    Constant(f64),
    /// Pairs of distance along the inner edge and width, m.
    Along(Vec<[f64; 2]>),
}

impl Width {
    /// Width at a distance along the inner edge, m; NaN for an empty list.
    pub fn at_m(&self, station_m: f64) -> f64 {
        let list = match self {
            Width::Constant(width_m) => return *width_m,
            Width::Along(list) => list,
        };
        // After a step the later entry counts.
        let after = list.partition_point(|[s, _]| *s <= station_m);
        match (after.checked_sub(1).map(|i| &list[i]), list.get(after)) {
            (Some([s0, w0]), Some([s1, w1])) => w0 + (w1 - w0) * ((station_m - s0) / (s1 - s0)),
            (Some([_, w]), None) | (None, Some([_, w])) => *w,
            (None, None) => f64::NAN,
        }
    }

    fn is_valid(&self) -> bool {
        match self {
            Width::Constant(width_m) => *width_m > 0.0 && *width_m <= MAX_WIDTH_M,
            Width::Along(list) => {
                list.iter().all(|[s, w]| s.is_finite() && (0.0..=MAX_WIDTH_M).contains(w))
                    && list.is_sorted_by(|a, b| a[0] <= b[0])
                    && list.iter().any(|[_, w]| *w > 0.0)
            }
        }
    }
}

/// One lane or strip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lane {
    /// Number that results state; no two lanes of a map share one.
    pub number: i32,
    /// What the lane or strip is for.
    #[serde(default)]
    pub kind: LaneKind,
    /// Width of the lane or strip, m.
    pub width_m: Width,
}

/// One direction of a road, or a ramp.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carriageway {
    /// Name of the carriageway, which errors state.
    pub name: String,
    /// Line between the median and the first lane: the left edge in driving direction where traffic keeps
    /// right. It has two points or more, in order along the road.
    pub inner_edge: Vec<Wgs84>,
    /// Outermost line of the last lane, in the same order. Where lanes change their widths it has a point at
    /// each entry of their lists, and one more between two corners that turn the same way, as on the long
    /// side of a bay; otherwise these can look like points on a curve.
    pub outer_edge: Vec<Wgs84>,
    /// Lanes and strips from the inside out. Strips of the kind `Median` come first and lie inside the inner
    /// edge; strips of the kind `Shoulder` come last and lie outside the outer edge; all others fill the
    /// space between.
    pub lanes: Vec<Lane>,
}

/// A map of the roads in a radar's view.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HdMap {
    /// The carriageways of the map.
    #[serde(default)]
    pub carriageways: Vec<Carriageway>,
}

impl HdMap {
    /// Checks whether the map can be used.
    ///
    /// # Errors
    /// Returns an error for the first fault: no carriageway, a lane number given twice, a carriageway without
    /// a lane, strips in the wrong order, an edge point that is no place on the earth, or an invalid width.
    pub fn check(&self) -> Result<(), LaneError> {
        if self.carriageways.is_empty() {
            return Err(LaneError::refused("the map contains no carriageway"));
        }
        let mut numbers = Vec::new();
        for way in &self.carriageways {
            way.check()?;
            for lane in &way.lanes {
                if numbers.contains(&lane.number) {
                    return Err(LaneError::refused(format!("two lanes have the number {}", lane.number)));
                }
                numbers.push(lane.number);
            }
        }
        Ok(())
    }
}

impl Carriageway {
    fn check(&self) -> Result<(), LaneError> {
        for edge in [&self.inner_edge, &self.outer_edge] {
            if let Some(point) = edge.iter().position(|p| !p.is_valid()) {
                return Err(LaneError::refused(format!(
                    "point {point} of an edge of carriageway `{}` is not a position on the earth",
                    self.name.clone()
                )));
            }
        }
        if let Some(bad) = self.lanes.iter().find(|l| !l.width_m.is_valid()) {
            return Err(LaneError::refused(format!(
                "the width of lane {} is not a length of up to 100 m or an ordered list of them",
                bad.number
            )));
        }
        if self.lanes.iter().all(|l| l.kind.is_strip()) {
            return Err(LaneError::refused(format!("carriageway `{}` has no lane", self.name.clone())));
        }
        // Order of median strips, lanes and shoulder strips: the rank never falls.
        let rank = |l: &Lane| match l.kind {
            LaneKind::Median => 0,
            LaneKind::Shoulder => 2,
            _ => 1,
        };
        match self.lanes.windows(2).find(|w| rank(&w[0]) > rank(&w[1])) {
            Some(w) => {
                let bad = if w[1].kind == LaneKind::Median { &w[1] } else { &w[0] };
                Err(LaneError::refused(format!(
                    "strip {} lies between lanes; list a median first and a shoulder last",
                    bad.number
                )))
            }
            None => Ok(()),
        }
    }

    /// The lanes between the edges, from the inside out.
    pub(super) fn between_edges(&self) -> impl Iterator<Item = &Lane> {
        self.lanes.iter().filter(|l| !l.kind.is_strip())
    }

    /// Total width of the strips of one kind at a distance along the inner edge, m.
    pub(super) fn strip_m(&self, kind: LaneKind, station_m: f64) -> f64 {
        self.lanes.iter().filter(|l| l.kind == kind).map(|l| l.width_m.at_m(station_m)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
[[carriageways]]
name = "up"
inner_edge = [[39.9, 116.3, 40.0], [39.901, 116.3, 40.0], [39.902, 116.3001, 40.5]]
outer_edge = [[39.9, 116.30017, 40.0], [39.902, 116.30027, 40.5]]
lanes = [
    { number = 0, kind = "median", width_m = 1.0 },
    { number = 1, width_m = 3.75 },
    { number = 2, width_m = 3.75 },
    { number = 3, width_m = 3.75 },
    { number = 4, kind = "emergency", width_m = 3.0 },
    { number = 5, kind = "bay", width_m = [[100.0, 0.0], [115.0, 3.5], [155.0, 3.5], [170.0, 0.0]] },
    { number = 6, kind = "shoulder", width_m = 0.75 },
]
"#;

    fn parsed() -> HdMap {
        toml::from_str(TEXT).unwrap()
    }

    #[test]
    fn text_is_read_and_written_back() {
        let map = parsed();
        assert_eq!(map.check(), Ok(()));
        assert_eq!(map.carriageways[0].inner_edge[2], Wgs84::new(39.902, 116.3001, 40.5));
        assert_eq!(map.carriageways[0].lanes[4].kind, LaneKind::Emergency);
        let written = toml::to_string(&map).unwrap();
        assert_eq!(toml::from_str::<HdMap>(&written).unwrap(), map);
        // A misspelt key is an error, not a default.
        assert!(toml::from_str::<HdMap>(&TEXT.replace("kind = \"bay\"", "kindd = \"bay\"")).is_err());
        assert!(toml::from_str::<HdMap>(&TEXT.replace("\"bay\"", "\"hay\"")).is_err());
    }

    #[test]
    fn widths_along_the_road() {
        let bay = &parsed().carriageways[0].lanes[5].width_m;
        for (s, w) in [(0.0, 0.0), (100.0, 0.0), (107.5, 1.75), (115.0, 3.5), (140.0, 3.5), (900.0, 0.0)] {
            assert!((bay.at_m(s) - w).abs() < 1e-12, "{s}");
        }
        let step = Width::Along(vec![[0.0, 3.0], [50.0, 3.0], [50.0, 0.0]]);
        assert_eq!((step.at_m(49.999), step.at_m(50.0), step.at_m(60.0)), (3.0, 0.0, 0.0));
        assert!(Width::Along(vec![]).at_m(1.0).is_nan());
    }

    #[test]
    fn faulty_maps_are_named() {
        let fault = |change: &dyn Fn(&mut Carriageway)| {
            let mut map = parsed();
            change(&mut map.carriageways[0]);
            map.check().unwrap_err().to_string()
        };
        let none = HdMap::default().check().unwrap_err().to_string();
        assert_eq!(none, "the map contains no carriageway");
        assert_eq!(
            fault(&|w| w.outer_edge[1].height_m = f64::NAN),
            "point 1 of an edge of carriageway `up` is not a position on the earth"
        );
        assert_eq!(fault(&|w| w.lanes.clear()), "carriageway `up` has no lane");
        assert_eq!(fault(&|w| w.lanes.truncate(1)), "carriageway `up` has no lane");
        for bad in [0.0, -1.0, 1e9, f64::NAN, f64::INFINITY] {
            let why = fault(&|w| w.lanes[1].width_m = Width::Constant(bad));
            assert!(why.starts_with("the width of lane 1 is not a length"), "{why}");
        }
        for bad in [vec![], vec![[0.0, 0.0]], vec![[5.0, 1.0], [0.0, 1.0]], vec![[0.0, -1.0], [1.0, 2.0]]] {
            let why = fault(&|w| w.lanes[2].width_m = Width::Along(bad.clone()));
            assert!(why.starts_with("the width of lane 2 is not a length"), "{why}");
        }
        assert!(fault(&|w| w.lanes[2].kind = LaneKind::Shoulder).starts_with("strip 2 lies between lanes"));
        assert!(fault(&|w| w.lanes[3].kind = LaneKind::Median).starts_with("strip 3 lies between lanes"));
        assert_eq!(fault(&|w| w.lanes[4].number = 2), "two lanes have the number 2");
    }
}
