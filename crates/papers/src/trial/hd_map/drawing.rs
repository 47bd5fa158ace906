//! A scene from above with the lanes that tracks were assigned.

use crate::trial::hd_map::passes::Passes;
use crate::trial::kit::*;
use catseye_lane::hd_map::of_road::Stripes;

/// Colours of lanes by the last digit of their numbers.
const LANES: [Rgb; 10] = [
    [120, 120, 120],
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [148, 103, 189],
    [140, 86, 75],
    [60, 60, 60],
];

const LINE: Rgb = [175, 175, 175];
const WRONG: Rgb = [214, 39, 40];
/// Largest distance that is drawn, m.
const FARTHEST_M: f64 = 220.0;

/// What is drawn of some groups of a scene, in the level frame of the vehicle that carries the radar.
#[derive(Default)]
pub struct Drawing {
    pub lines: Vec<Vec<[f64; 2]>>,
    pub outlines: Vec<[[f64; 2]; 4]>,
    /// Position and assigned lane of each mark; None for no lane.
    pub marks: Vec<([f64; 2], Option<i32>, bool)>,
}

impl Drawing {
    pub fn add(&mut self, passes: &Passes, lanes: &[Stripes], drive: &Drive<'_>) {
        let last = drive.frames().saturating_sub(1);
        if self.lines.is_empty() {
            let level = drive.level(drive.time_s(last));
            for stripe in lanes.iter().flat_map(|r| &r.stripes) {
                // Where the lane has a width; a gap elsewhere.
                let there = |i: usize| stripe.left_m[i].distance(stripe.right_m[i]) > 0.01;
                for line in [&stripe.left_m, &stripe.right_m] {
                    let place = |(i, p): (usize, &glam::DVec3)| match there(i) {
                        true => level.from_world(p.truncate()).to_array(),
                        false => [f64::NAN; 2],
                    };
                    self.lines.push(line.iter().enumerate().map(place).collect());
                }
            }
        }
        for pass in &passes.vehicles {
            self.outlines.push(pass.outline_m);
            for s in &pass.scans {
                let number = s.given[0].number();
                self.marks.push((s.at_m, number, number == Some(s.true_lane)));
            }
        }
    }

    pub fn chart(&self, name: &str) -> Option<Chart> {
        let places = self.marks.iter().map(|m| m.0).chain(self.outlines.iter().flatten().copied());
        let near: Vec<[f64; 2]> = places.filter(|p| p[0].hypot(p[1]) < FARTHEST_M).collect();
        let (x_low, x_high) = finite_range(near.iter().map(|p| p[0]))?;
        let (y_low, y_high) = finite_range(near.iter().map(|p| p[1]))?;
        let x = Axis::new("x forward of the radar's post (m)", x_low.min(0.0) - 5.0, x_high + 10.0);
        let y = Axis::new("y left (m)", y_low.min(-20.0) - 4.0, y_high.max(20.0) + 4.0);
        let title = format!("{name}: lanes assigned to tracks");
        let mut chart = Chart::new(title, x, y).equal_scale(1000.0, 640.0);
        self.lines.iter().for_each(|line| chart.line(line.clone(), Pen::solid(LINE, 1.0)));
        let dark = Pen::solid([90, 90, 90], 1.0);
        self.outlines.iter().for_each(|o| chart.area(o.to_vec(), (LINE, 0.35), Some(dark)));
        let mut numbers: Vec<i32> = self.marks.iter().filter_map(|m| m.1).collect();
        numbers.sort_unstable();
        numbers.dedup();
        for n in &numbers {
            let points: Vec<[f64; 2]> = self.marks.iter().filter(|m| m.1 == Some(*n)).map(|m| m.0).collect();
            // The other carriageway's numbers have diamonds.
            let mark = if *n >= 10 { Mark::Diamond { radius: 3.5 } } else { Mark::Dot { radius: 2.8 } };
            chart.marks(format!("lane {n}"), points, mark, colour(*n));
        }
        let wrong: Vec<[f64; 2]> = self.marks.iter().filter(|m| !m.2).map(|m| m.0).collect();
        if !wrong.is_empty() {
            chart.marks("wrong, or none", wrong, Mark::Ring { radius: 6.0 }, WRONG);
        }
        Some(chart)
    }
}

fn colour(number: i32) -> Rgb {
    LANES[number.rem_euclid(10) as usize]
}
