//! The edges of the region of lanes that leads ahead from a radar, found in the probabilities of cells. The class `lane`
//! of masks is every drivable lane, so the region's edges are those of all lanes beside each other, and are edges of the
//! vehicle's own lane only where it is the only one.

use super::METHOD;
use super::options::RadarMount;
use crate::robust::{WEIGHINGS, robust};
use crate::{LaneError, LaneEstimate, Line, Measured};
use glam::DVec2;
use std::collections::VecDeque;

/// Distance ahead within which the region has to begin, m.
const BEGIN_M: f64 = 15.0;
/// Distance from the radar's axis within which it has to begin, m.
const ASIDE_M: f64 = 2.0;
/// Least width of a region that a vehicle can drive in, m.
const NARROWEST_M: f64 = 2.0;
/// Least number of rows in which an edge has to be seen.
const LEAST_ROWS: usize = 6;
/// Cells over which a probability falls from one to zero beyond which edges are not taken for less certain.
const WIDEST_FALL: f64 = 5.0;
/// Number of neighbouring rows that err alike, as a network looks at many at once: they count as one.
const ROWS_ALIKE: f64 = 16.0;
/// What a further parameter of an edge's curve has to gain.
const GAIN: f64 = 9.0;

/// What is known of the cells before a radar, `[row, column]`: row 0 lies at the radar, column 0 farthest to the left.
#[derive(Debug, Clone, Copy)]
pub struct LaneCells<'a> {
    /// Number of rows, ahead.
    pub rows: usize,
    /// Number of columns, across.
    pub columns: usize,
    /// Length of a cell ahead and across, m.
    pub cell_m: [f64; 2],
    /// Distance of the left edge of the first column to the left of the radar's axis, m.
    pub left_m: f64,
    /// Probability that the cell is of a lane.
    pub lane: &'a [f32],
    /// Whether something that stands on a lane hides it, such as a vehicle. The region goes on below it.
    pub hidden: &'a [bool],
}

impl LaneCells<'_> {
    /// Middle of a place in the radar's level axes, m; a column may have a fraction.
    fn at(&self, row: usize, column: f64) -> DVec2 {
        DVec2::new((row as f64 + 0.5) * self.cell_m[0], self.left_m - (column + 0.5) * self.cell_m[1])
    }

    fn is_sound(&self) -> bool {
        let cells = self.rows * self.columns;
        let positive = self.cell_m.iter().all(|m| m.is_finite() && *m > 0.0) && self.left_m.is_finite();
        cells > 0 && self.lane.len() == cells && self.hidden.len() == cells && positive
    }

    fn is_lane(&self, cell: usize, probability: f64) -> bool {
        f64::from(self.lane[cell]) >= probability
    }
}

/// What is asked of the region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegionLimits {
    /// Probability from which on a cell counts as a lane.
    pub probability: f64,
    /// Minimum visible length of an edge, m.
    pub least_length_m: f64,
}

/// A place of an edge in the radar's level axes with its standard deviation across, m.
#[derive(Debug, Clone, Copy, PartialEq)]
struct EdgePlace {
    at_m: DVec2,
    std_m: f64,
}

/// The region that leads ahead from the radar.
#[derive(Debug, Clone, Default)]
struct Region {
    /// Places of the right and the left edge, the nearest first.
    edges: [Vec<EdgePlace>; 2],
    /// Number of rows that the region has.
    rows: usize,
    /// Mean probability of its cells.
    probability: f64,
}

/// The cell in which the region begins: of a lane, near and before the radar.
fn begin(cells: &LaneCells<'_>, probability: f64) -> Result<usize, LaneError> {
    let mut best = None;
    for row in 0..cells.rows {
        let mut of_row: Option<(f64, usize)> = None;
        for column in 0..cells.columns {
            let (cell, at) = (row * cells.columns + column, cells.at(row, column as f64));
            let aside = at.y.abs();
            let near = at.x <= BEGIN_M && aside <= ASIDE_M && of_row.is_none_or(|b| aside < b.0);
            if near && cells.is_lane(cell, probability) {
                of_row = Some((aside, cell));
            }
        }
        if let Some((_, cell)) = of_row {
            best = Some(cell);
            break;
        }
    }
    best.ok_or_else(|| {
        let most = cells.lane.iter().copied().fold(0.0, f32::max);
        if f64::from(most) < probability {
            return LaneError::refused(format!(
                "no cell in front of the radar belongs to a lane: the largest probability is {most:.2}, below {probability}"
            ));
        }
        LaneError::refused(format!(
            "no lane leads ahead from the radar: none begins within {BEGIN_M} m ahead and {ASIDE_M} m aside"
        ))
    })
}

/// The cells that are joined to one, by their sides: of lanes, and those that are hidden.
fn joined(cells: &LaneCells<'_>, from: usize, probability: f64) -> Vec<bool> {
    let mut in_region = vec![false; cells.rows * cells.columns];
    let mut open = VecDeque::from([from]);
    in_region[from] = true;
    while let Some(cell) = open.pop_front() {
        let (row, column) = (cell / cells.columns, cell % cells.columns);
        let beside = [
            (row > 0).then(|| cell - cells.columns),
            (row + 1 < cells.rows).then(|| cell + cells.columns),
            (column > 0).then(|| cell - 1),
            (column + 1 < cells.columns).then(|| cell + 1),
        ];
        for next in beside.into_iter().flatten() {
            if !in_region[next] && (cells.hidden[next] || cells.is_lane(next, probability)) {
                in_region[next] = true;
                open.push_back(next);
            }
        }
    }
    in_region
}

/// First and last column of the parts of a row that touch columns of the row before; None where no part does.
fn span(in_row: &[bool], [first, last]: [usize; 2]) -> Option<[usize; 2]> {
    let touched = (first..=last).filter(|c| in_row[*c]);
    let (mut low, mut high) = touched.fold(None, |found: Option<(usize, usize)>, c| {
        Some(found.map_or((c, c), |(low, high)| (low.min(c), high.max(c))))
    })?;
    while low > 0 && in_row[low - 1] {
        low -= 1;
    }
    while high + 1 < in_row.len() && in_row[high + 1] {
        high += 1;
    }
    Some([low, high])
}

/// Where the probability passes the limit between the outermost cell of a row and the one beyond it. None at the border of
/// the grid, and where something hides the edge.
fn crossing(
    cells: &LaneCells<'_>,
    row: usize,
    column: usize,
    to_left: bool,
    probability: f64,
) -> Option<EdgePlace> {
    let beyond = if to_left { column.checked_sub(1)? } else { column + 1 };
    if beyond >= cells.columns {
        return None;
    }
    let [inner, outer] = [column, beyond].map(|c| row * cells.columns + c);
    if cells.hidden[inner] || cells.hidden[outer] {
        return None;
    }
    let [p, q] = [inner, outer].map(|c| f64::from(cells.lane[c]));
    let fall = (p - q).max(1.0 / WIDEST_FALL);
    let share = ((p - probability) / fall).clamp(0.0, 1.0);
    let at_m = cells.at(row, column as f64 + if to_left { -share } else { share });
    // A probability that falls evenly over some width leaves the edge anywhere in it.
    Some(EdgePlace { at_m, std_m: cells.cell_m[1] / fall / 12f64.sqrt() })
}

fn region(cells: &LaneCells<'_>, limits: &RegionLimits) -> Result<Region, LaneError> {
    let p = limits.probability;
    let from = begin(cells, p)?;
    let in_region = joined(cells, from, p);
    let mut out = Region::default();
    let mut before = [from % cells.columns; 2];
    let (mut sum, mut count) = (0.0, 0usize);
    for row in from / cells.columns..cells.rows {
        let cell = row * cells.columns;
        let Some([first, last]) = span(&in_region[cell..cell + cells.columns], before) else { break };
        if (last + 1 - first) as f64 * cells.cell_m[1] < NARROWEST_M {
            // It may be narrow where it begins, and ends where it becomes so.
            if out.rows > 0 {
                break;
            }
            before = [first, last];
            continue;
        }
        before = [first, last];
        out.rows += 1;
        let of_lane = (first..=last).filter(|c| in_region[cell + c] && !cells.hidden[cell + c]);
        for c in of_lane {
            sum += f64::from(cells.lane[cell + c]);
            count += 1;
        }
        out.edges[0].extend(crossing(cells, row, last, false, p));
        out.edges[1].extend(crossing(cells, row, first, true, p));
    }
    out.probability = sum / count.max(1) as f64;
    if out.rows == 0 {
        return Err(LaneError::refused(format!(
            "the region ahead of the radar is nowhere wider than {NARROWEST_M} m"
        )));
    }
    Ok(out)
}

/// The curve of an edge in the vehicle's axes.
fn line(
    places: &[EdgePlace],
    region: &Region,
    mount: &RadarMount,
    cell_m: f64,
    least_m: f64,
) -> Option<Line> {
    let (first, last) = (places.first()?, places.last()?);
    if places.len() < LEAST_ROWS || first.at_m.distance(last.at_m) < least_m {
        return None;
    }
    let at: Vec<DVec2> = places.iter().map(|p| mount.to_vehicle(p.at_m)).collect();
    let std_m: Vec<f64> = places.iter().map(|p| p.std_m * ROWS_ALIKE.sqrt()).collect();
    let mut fitted = robust(&at, &std_m, GAIN, WEIGHINGS)?;
    // What the curve does not explain makes it less certain, and an edge along the cells is off by the same part of a cell
    // in all rows.
    let worse = fitted.residual.max(1.0).powi(2);
    fitted.covariance.iter_mut().flatten().for_each(|c| *c *= worse);
    let variance = cell_m * cell_m / 12.0;
    fitted.covariance[0][0] += variance;
    // A curve of another curvature that leaves the places by as much in its middle is no worse; a straight line is not
    // certain to be straight.
    fitted.covariance[2][2] += variance * (8.0 / fitted.curve.length_m.powi(2)).powi(2);
    let seen = places.len() as f64 / region.rows as f64;
    Some(Line { fitted, confidence: region.probability * seen.min(1.0), members: Vec::new() })
}

/// The edges of the region of lanes that leads ahead from the radar, as an estimate in the vehicle's level frame: up to two
/// lines, and where there are both, the width of the region and the vehicle's offset from its middle. `given` is the number
/// of points of the look, `used` how many of them lie in the cells.
///
/// Cells whose probability reaches the limit and those that are hidden are followed from the nearest one before the radar.
/// In each row the edges are the places where the probability passes the limit, between the outermost cells and those
/// beyond them; a row gives no edge at the border of the grid or beside something that hides it. A robust curve is laid
/// through each edge, as far as it was seen.
///
/// The estimate is without a lane, with the reason, where no lane leads ahead, and where neither edge is seen over the least
/// length.
pub fn estimate(
    time_s: f64,
    [given, used]: [usize; 2],
    cells: &LaneCells<'_>,
    mount: &RadarMount,
    limits: &RegionLimits,
) -> LaneEstimate {
    let none = |why| LaneEstimate::none(METHOD, time_s, given, why);
    if !cells.is_sound() {
        return none(LaneError::refused("the cells in front of the radar do not belong to one grid"));
    }
    let region = match region(cells, limits) {
        Ok(region) => region,
        Err(why) => return none(why),
    };
    let least_m = limits.least_length_m;
    let of = |places: &Vec<EdgePlace>| line(places, &region, mount, cells.cell_m[1], least_m);
    let lines: Vec<Line> = region.edges.iter().filter_map(of).collect();
    if lines.is_empty() {
        let [right, left] = region.edges.each_ref().map(Vec::len);
        return none(LaneError::refused(format!(
            "no edge of the lanes is found over {least_m} m: {right} rows on the right and {left} on the left of {}",
            region.rows
        )));
    }
    let mut out = LaneEstimate::of_lines(METHOD, time_s, given, lines);
    out.provenance.used = used;
    out.width_m = out.width_m.filter(|w: &Measured| w.value > 0.0);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cells of the road grid, 60 x 40 m, at a scale.
    struct Picture {
        rows: usize,
        columns: usize,
        cell_m: f64,
        lane: Vec<f32>,
        hidden: Vec<bool>,
    }

    impl Picture {
        fn new(scale: usize, lane: impl Fn(DVec2) -> f64) -> Picture {
            let (rows, columns) = (450usize.div_ceil(scale), 300usize.div_ceil(scale));
            let cell_m = scale as f64 * 40.0 / 300.0;
            let mut out =
                Picture { rows, columns, cell_m, lane: Vec::new(), hidden: vec![false; rows * columns] };
            let all: Vec<f32> = (0..rows * columns).map(|c| lane(out.middle(c)) as f32).collect();
            out.lane = all;
            out
        }

        fn middle(&self, cell: usize) -> DVec2 {
            self.cells().at(cell / self.columns, (cell % self.columns) as f64)
        }

        fn hide(&mut self, is: impl Fn(DVec2) -> bool) {
            for cell in 0..self.lane.len() {
                if is(self.middle(cell)) {
                    (self.lane[cell], self.hidden[cell]) = (0.0, true);
                }
            }
        }

        fn cells(&self) -> LaneCells<'_> {
            LaneCells {
                rows: self.rows,
                columns: self.columns,
                cell_m: [self.cell_m; 2],
                left_m: 20.0,
                lane: &self.lane,
                hidden: &self.hidden,
            }
        }

        fn estimate(&self, mount: &RadarMount) -> LaneEstimate {
            let limits = RegionLimits { probability: 0.5, least_length_m: 8.0 };
            estimate(1.5, [7, 5], &self.cells(), mount, &limits)
        }
    }

    fn hard(inside: bool) -> f64 {
        f64::from(u8::from(inside))
    }

    /// Largest distance of a line from a true curve, given by the signed distance of a place from it, m.
    fn worst(line: &Line, off: impl Fn(DVec2) -> f64) -> f64 {
        line.fitted.curve.sample(0.5).into_iter().map(|p| off(p).abs()).fold(0.0, f64::max)
    }

    /// A lane from -1.93 to 1.57 m that runs straight: both edges are right within half a cell over the whole grid.
    #[test]
    fn a_straight_lane_has_its_edges_within_half_a_cell() {
        for scale in [1, 4] {
            let picture = Picture::new(scale, |p| hard(p.y > -1.93 && p.y < 1.57));
            let e = picture.estimate(&RadarMount::default());
            assert_eq!((e.lines.len(), e.no_lane.clone(), e.time_s), (2, None, 1.5), "{e:?}");
            let half = 0.5 * picture.cell_m + 1e-6;
            assert!(worst(&e.lines[0], |p| p.y + 1.93) < half && worst(&e.lines[1], |p| p.y - 1.57) < half);
            assert!(e.lines.iter().all(|l| l.fitted.curve.length_m > 58.0), "{e:?}");
            let (width, offset) = (e.width_m.unwrap(), e.offset_m.unwrap());
            assert!((width.value - 3.5).abs() < 2.0 * half && (offset.value - 0.18).abs() < half, "{e:?}");
            // The error of both is within what the estimate says of it.
            assert!((width.value - 3.5).abs() < 3.0 * width.std && width.std < picture.cell_m, "{e:?}");
            assert_eq!((e.provenance.given, e.provenance.used), (7, 5));
            assert!((e.confidence - 1.0).abs() < 1e-6);
        }
    }

    /// A lane on an arc of 150 m to the left, and one to the right: within half a cell, with curvature and heading.
    #[test]
    fn an_arc_has_its_edges_within_half_a_cell() {
        for (scale, sign) in [(1, 1.0), (1, -1.0), (4, 1.0), (4, -1.0)] {
            let radius = 150.0;
            let centre = DVec2::new(0.0, sign * radius);
            // Positive to the left of the arc through the origin.
            let left_of = |p: DVec2| sign * (radius - p.distance(centre));
            let picture = Picture::new(scale, |p| hard(left_of(p) > -2.0 && left_of(p) < 1.6));
            let e = picture.estimate(&RadarMount::default());
            assert_eq!(e.lines.len(), 2, "{e:?}");
            let half = 0.5 * picture.cell_m;
            let [right, left] = [&e.lines[0], &e.lines[1]];
            let far = [worst(right, |p| left_of(p) + 2.0), worst(left, |p| left_of(p) - 1.6)];
            assert!(far.iter().all(|w| *w < half), "{scale} {sign}: {far:?}");
            let k = e.curvature_per_m.unwrap().value;
            assert!((k - sign / radius).abs() < 1e-3 * scale as f64, "{k}");
        }
    }

    /// A probability that falls softly gives its edge to a tenth of a cell, and with a larger standard deviation.
    #[test]
    fn soft_probabilities_are_read_between_cells() {
        let soft = |p: DVec2| 1.0 / (1.0 + ((p.y.abs() - 1.83) / 0.5).exp());
        let picture = Picture::new(4, soft);
        let e = picture.estimate(&RadarMount::default());
        let far = [worst(&e.lines[0], |p| p.y + 1.83), worst(&e.lines[1], |p| p.y - 1.83)];
        assert!(far.iter().all(|w| *w < 0.1 * picture.cell_m), "{far:?}");
        assert!(e.confidence < 0.95, "{}", e.confidence);
        let hard = Picture::new(4, |p| hard(p.y.abs() < 1.83)).estimate(&RadarMount::default());
        let std = |e: &LaneEstimate| e.lines[0].fitted.lateral_std_m(30.0);
        assert!(std(&e) > std(&hard), "{} {}", std(&e), std(&hard));
    }

    /// The picture is the radar's; the estimate is the vehicle's.
    #[test]
    fn the_mount_turns_and_shifts_the_edges() {
        let picture = Picture::new(1, |p| hard(p.y.abs() < 1.8));
        let mount = RadarMount { at_m: DVec2::new(3.6, 0.4), yaw_rad: 0.1 };
        let e = picture.estimate(&mount);
        let off = |p: DVec2| mount.from_vehicle(p).y;
        assert!(worst(&e.lines[0], |p| off(p) + 1.8) < 0.07 && worst(&e.lines[1], |p| off(p) - 1.8) < 0.07);
        // The vehicle looks 0.1 rad to the right of the lane.
        assert!((e.heading_rad.unwrap().value + 0.1).abs() < 2e-3, "{e:?}");
    }

    /// A car in the lane breaks nothing, one over the left edge takes its rows away, and a patch elsewhere is not joined.
    #[test]
    fn vehicles_and_patches_do_not_move_the_edges() {
        let mut picture = Picture::new(1, |p| {
            hard(p.y.abs() < 1.8 || ((p.y - 8.0).abs() < 3.0 && (20.0..30.0).contains(&p.x)))
        });
        picture.hide(|p| p.y.abs() < 0.9 && (15.0..19.0).contains(&p.x));
        picture.hide(|p| (1.0..3.0).contains(&p.y) && (30.0..35.0).contains(&p.x));
        // A truck over the whole lane.
        picture.hide(|p| p.y.abs() < 1.9 && (40.0..48.0).contains(&p.x));
        let e = picture.estimate(&RadarMount::default());
        assert_eq!(e.lines.len(), 2);
        assert!(
            worst(&e.lines[0], |p| p.y + 1.8) < 0.07 && worst(&e.lines[1], |p| p.y - 1.8) < 0.07,
            "{e:?}"
        );
        assert!(e.lines.iter().all(|l| l.fitted.curve.length_m > 55.0));
        // Rows that are hidden are not rows of the edge: 13 and 8 of 60 m.
        assert!((e.lines[1].confidence - 47.0 / 60.0).abs() < 0.02, "{}", e.lines[1].confidence);
        assert!((e.lines[0].confidence - 52.0 / 60.0).abs() < 0.02, "{}", e.lines[0].confidence);
    }

    /// Two lanes beside each other are one region: its edges are the outer ones.
    #[test]
    fn lanes_beside_each_other_have_common_edges() {
        let lane = |p: DVec2, from: f64| hard(p.y > from && p.y <= from + 3.5);
        let e = Picture::new(1, |p| lane(p, -1.75).max(lane(p, 1.75))).estimate(&RadarMount::default());
        assert!(
            (e.width_m.unwrap().value - 7.0).abs() < 0.14 && (e.offset_m.unwrap().value + 1.75).abs() < 0.07
        );
    }

    /// What is less than a lane is refused, each with its reason.
    #[test]
    fn what_is_no_lane_is_refused_with_a_reason() {
        let of = |lane: &dyn Fn(DVec2) -> f64| {
            let e = Picture::new(4, lane).estimate(&RadarMount::default());
            assert!(e.lines.is_empty() && e.confidence == 0.0 && e.width_m.is_none(), "{e:?}");
            e.no_lane.unwrap().to_string()
        };
        assert!(of(&|_| 0.31).contains("the largest probability is 0.31, below 0.5"));
        assert!(of(&|p| hard(p.y > 5.0)).contains("no lane leads ahead"));
        assert!(of(&|p| hard(p.x > 20.0)).contains("no lane leads ahead"));
        assert!(of(&|p| hard(p.y.abs() < 0.7)).contains("nowhere wider than 2 m"));
        assert!(of(&|p| hard(p.y.abs() < 1.8 && p.x < 6.0)).contains("over 8 m"));
        // A lane over the whole grid has no edge in it.
        assert!(of(&|_| 1.0).contains("0 rows on the right and 0 on the left"));
        // One edge is enough.
        let e = Picture::new(4, |p| hard(p.y > -2.0)).estimate(&RadarMount::default());
        assert!(e.lines.len() == 1 && e.width_m.is_none() && e.no_lane.is_none(), "{e:?}");
        // Numbers that do not belong together are told, and do not panic.
        let picture = Picture::new(4, |_| 1.0);
        let short = LaneCells { lane: &picture.lane[1..], ..picture.cells() };
        let limits = RegionLimits { probability: 0.5, least_length_m: 8.0 };
        let e = estimate(0.0, [0, 0], &short, &RadarMount::default(), &limits);
        assert!(e.no_lane.unwrap().to_string().contains("one grid"));
    }
}
