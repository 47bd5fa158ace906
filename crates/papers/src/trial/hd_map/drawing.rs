//! A scene from above with the lanes that tracks were given.

use crate::trial::drive::Drive;
use crate::trial::hd_map::passes::Passes;
use catseye_lane::hd_map::of_road::Stripes;
use catseye_plot::{Axis, Chart, Layer, Mark, Paint, Pen, Rgb, Symbol};

/// Colours of lanes by the last digit of their numbers.
pub const LANES: [Rgb; 10] = [
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

pub const LINE: Rgb = [175, 175, 175];
pub const WRONG: Rgb = [214, 39, 40];
/// A picture shows nothing farther off, m.
pub const FARTHEST_M: f64 = 220.0;

/// What is drawn of some groups of a scene, in the level frame of the vehicle that carries the radar.
#[derive(Default)]
pub struct Drawing {
    pub lines: Vec<Vec<[f64; 2]>>,
    pub outlines: Vec<[[f64; 2]; 4]>,
    /// Place and lane given; None: no lane.
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
        let places: Vec<[f64; 2]> =
            self.marks.iter().map(|m| m.0).chain(self.outlines.iter().flatten().copied()).collect();
        let near: Vec<[f64; 2]> = places.into_iter().filter(|p| p[0].hypot(p[1]) < FARTHEST_M).collect();
        if near.is_empty() {
            return None;
        }
        let bound = |k: usize, low: bool| {
            let v = near.iter().map(|p| p[k]);
            if low { v.fold(f64::INFINITY, f64::min) } else { v.fold(f64::NEG_INFINITY, f64::max) }
        };
        let x = Axis::new(
            "x forward of the radar's post (m)",
            bound(0, true).min(0.0) - 5.0,
            bound(0, false) + 10.0,
        );
        let y = Axis::new("y left (m)", bound(1, true).min(-20.0) - 4.0, bound(1, false).max(20.0) + 4.0);
        let title = format!("{name}: lanes that tracks were given");
        let mut chart = Chart::new(title, x, y).equal_scale(1000.0, 640.0);
        for line in &self.lines {
            chart.layers.push(Layer::Line { points: line.clone(), pen: Pen::solid(LINE, 1.0) });
        }
        for o in &self.outlines {
            let stroke = Some(Pen::solid([90, 90, 90], 1.0));
            chart.layers.push(Layer::Area { polygon: o.to_vec(), fill: Some((LINE, 0.35)), stroke });
        }
        let mut numbers: Vec<i32> = self.marks.iter().filter_map(|m| m.1).collect();
        numbers.sort_unstable();
        numbers.dedup();
        for n in &numbers {
            let points: Vec<[f64; 2]> = self.marks.iter().filter(|m| m.1 == Some(*n)).map(|m| m.0).collect();
            let colour = colour(*n);
            // The other carriageway's numbers have diamonds.
            let mark = if *n >= 10 { Mark::Diamond { radius: 3.5 } } else { Mark::Dot { radius: 2.8 } };
            chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(colour) });
            chart.key(format!("lane {n}"), Symbol::Mark(mark, colour));
        }
        let wrong: Vec<[f64; 2]> = self.marks.iter().filter(|m| !m.2).map(|m| m.0).collect();
        let ring = Mark::Ring { radius: 6.0 };
        if !wrong.is_empty() {
            chart.layers.push(Layer::Marks { points: wrong, mark: ring, paint: Paint::Fixed(WRONG) });
            chart.key("wrong, or none", Symbol::Mark(ring, WRONG));
        }
        Some(chart)
    }
}

pub fn colour(number: i32) -> Rgb {
    LANES[number.rem_euclid(10) as usize]
}
