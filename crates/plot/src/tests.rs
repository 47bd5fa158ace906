//! Pictures are looked at by people; these tests see to sizes, places of marks, and odd input. With
//! `CATSEYE_PICTURE_DIR` set they leave their pictures there.

use super::*;
use catseye::base::units::w_from_dbm;
use catseye::formats::npy;
use std::path::Path;

fn keep(name: &str, picture: &Picture) {
    if let Ok(dir) = std::env::var("CATSEYE_PICTURE_DIR") {
        let path = Path::new(&dir).join(name);
        for extension in PICTURE_EXTENSIONS {
            picture.write(path.with_extension(extension), true).unwrap();
        }
    }
}

/// Uniform numbers in 0..1 that repeat.
struct Dice(u64);
impl Dice {
    fn roll(&mut self) -> f64 {
        // xorshift64* (Vigna 2016).
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A road as a radar at 10 m/s might see it: noise, two rails, a car ahead and one coming.
struct Road {
    range_m: Vec<f64>,
    range_rate_mps: Vec<f64>,
    power_w: Vec<f32>,
    detections: Vec<[f64; 2]>,
    objects: Vec<Outline>,
    points: Vec<BirdsEyePoint>,
}

fn road() -> Road {
    let mut dice = Dice(7);
    let (rows, columns) = (128usize, 256usize);
    let range_m: Vec<f64> = (0..columns).map(|i| i as f64 * 0.25).collect();
    let range_rate_mps: Vec<f64> = (0..rows).map(|i| (i as f64 - 64.0) * 0.33).collect();
    // The mean over 12 channels of exponential noise.
    let mut power: Vec<f64> = (0..rows * columns)
        .map(|_| w_from_dbm(-122.0) * (0..12).map(|_| -(1.0 - dice.roll()).ln()).sum::<f64>() / 12.0)
        .collect();
    let mut objects =
        vec![Outline::whole("road", vec![[-5.0, -8.0], [100.0, -8.0], [100.0, 8.0], [-5.0, 8.0]])];
    let mut points = Vec::new();
    let mut detections = Vec::new();
    let mut echo = |x: f64, y: f64, speed: f64, dbm_at_10m: f64, listed: bool| {
        let r = x.hypot(y);
        let v = (speed - 10.0) * x / r;
        let dbm = dbm_at_10m - 40.0 * (r / 10.0).log10();
        let (row, column) = (v / 0.33 + 64.0, r / 0.25);
        for i in 0..rows {
            for j in 0..columns {
                let (a, b) = (i as f64 - row, j as f64 - column);
                let shape = (-0.7 * (a * a + b * b)).exp() + 1e-4 / (1.0 + (a * b * 10.0).powi(2));
                power[i * columns + j] += w_from_dbm(dbm) * shape;
            }
        }
        if listed && dbm > -113.0 {
            detections.push([r, v]);
            points.push(BirdsEyePoint { x_m: x, y_m: y, value: v });
        }
    };
    for side in [-1.0, 1.0] {
        objects.push(Outline::whole(
            "guard_rail",
            vec![[0.0, side * 7.46], [100.0, side * 7.46], [100.0, side * 7.54], [0.0, side * 7.54]],
        ));
        for post in 0..26 {
            let x = f64::from(post) * 4.0;
            objects.push(Outline::whole("post", rectangle([x, side * 7.65], [0.1, 0.06])));
            if x > 6.0 && x < 60.0 {
                echo(x, side * 7.6, 0.0, -72.0, true);
            }
        }
        for marker in 0..20 {
            let x = 4.0 + 3.3 * f64::from(marker);
            objects.push(Outline::whole("marker", rectangle([x, side * 1.75], [0.16, 0.1])));
            if x > 6.0 && x < 45.0 {
                echo(x, side * 1.75, 0.0, -80.0, true);
            }
        }
    }
    for (x, y, speed, level) in
        [(20.0, 0.0, 12.0, -58.0), (35.0, 3.5, -8.0, -55.0), (58.0, -3.5, 15.0, -52.0)]
    {
        objects.push(Outline::whole("car", rectangle([x + 2.25, y], [4.5, 1.8])));
        for dy in [-0.6, 0.0, 0.7] {
            echo(x, y + dy, speed, level, true);
        }
    }
    objects.push(Outline::whole(
        "manhole",
        (0..24)
            .map(|i| f64::from(i) * std::f64::consts::TAU / 24.0)
            .map(|a| [28.0 + 0.4 * a.cos(), -1.0 + 0.4 * a.sin()])
            .collect(),
    ));
    let power_w = power.iter().map(|p| *p as f32).collect();
    Road { range_m, range_rate_mps, power_w, detections, objects, points }
}

fn rectangle([x, y]: [f64; 2], [l, w]: [f64; 2]) -> Vec<[f64; 2]> {
    [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].iter().map(|(a, b)| [x + a * l, y + b * w]).collect()
}

/// The plate of 0.1 m, VV and HH a little apart, against angle in degrees.
fn plate(angle_deg: f64, extra: f64) -> f64 {
    let u = 161.4 * angle_deg.to_radians().sin();
    let sinc = if u.abs() < 1e-9 { 1.0 } else { u.sin() / u };
    19.2 + 20.0 * (sinc.abs() * angle_deg.to_radians().cos().abs()).log10() + extra
}

fn sweep(label: &str, from: f64, to: f64, step: f64, f: impl Fn(f64) -> f64) -> Curve {
    let n = ((to - from) / step).round() as usize;
    Curve {
        label: label.into(),
        points: (0..=n).map(|i| from + step * i as f64).map(|a| [a, f(a)]).collect(),
    }
}

/// Distinct colours, which is one for a blank picture.
fn colours(picture: &Picture) -> usize {
    let mut all: Vec<[u8; 3]> = picture.pixels().pixels().map(|p| p.0).collect();
    all.sort_unstable();
    all.dedup();
    all.len()
}

/// Frame of a chart in pixels (left, top, right, bottom): the longest dark run of a row or column,
/// found in the picture and not taken from the code that drew it.
fn frame(img: &image::RgbImage) -> (f64, f64, f64, f64) {
    let dark = |x: u32, y: u32| img.get_pixel(x, y).0 == [25, 25, 25];
    let (w, h) = img.dimensions();
    let rows: Vec<u32> = (0..h).filter(|y| (0..w).filter(|x| dark(*x, *y)).count() as u32 > w / 2).collect();
    let columns: Vec<u32> =
        (0..w).filter(|x| (0..h).filter(|y| dark(*x, *y)).count() as u32 > h / 2).collect();
    let line = |v: &[u32], first: bool| {
        let edge = if first { v[0] } else { v[v.len() - 1] };
        let near: Vec<f64> = v.iter().filter(|p| p.abs_diff(edge) < 4).map(|p| f64::from(*p) + 0.5).collect();
        near.iter().sum::<f64>() / near.len() as f64
    };
    // The colour bar's sides are columns too: the frame's right side is the second line.
    let mut right = columns[0];
    for c in &columns {
        if c.abs_diff(columns[0]) > 8 {
            right = *c;
            break;
        }
    }
    (line(&columns, true), line(&rows, true), f64::from(right) + 1.0, line(&rows, false))
}

#[test]
fn range_doppler_map_of_a_road() {
    let r = road();
    let p = range_doppler(&RangeDoppler {
        title: "Range–Doppler map, frame 0",
        power_w: &r.power_w,
        range_m: &r.range_m,
        range_rate_mps: &r.range_rate_mps,
        detections: &r.detections,
        ..Default::default()
    })
    .unwrap();
    keep("range_doppler.png", &p);
    let img = p.pixels();
    let (left, top, right, bottom) = frame(img);
    assert!((right - left - 1280.0).abs() < 2.0 && (bottom - top - 880.0).abs() < 2.0);
    assert!(colours(&p) > 100);
}

#[test]
fn a_detection_stands_where_its_numbers_say() {
    let range_m: Vec<f64> = (0..64).map(|i| f64::from(i) * 0.5).collect();
    let rate: Vec<f64> = (-16..16).map(|i| f64::from(i) * 0.25).collect();
    for d in [[5.0, -2.0], [26.25, 3.0], [15.5, 0.0]] {
        let mut power_w = vec![1e-15f32; 64 * 32];
        // The brightest cell is the one nearest to the detection.
        let (row, column) = ((d[1] / 0.25 + 16.0) as usize, (d[0] / 0.5 + 0.5) as usize);
        power_w[row * 64 + column] = 1e-9;
        let p = range_doppler(&RangeDoppler {
            title: "",
            power_w: &power_w,
            range_m: &range_m,
            range_rate_mps: &rate,
            detections: &[d],
            ..Default::default()
        })
        .unwrap();
        let img = p.pixels();
        let (left, top, right, bottom) = frame(img);
        // Cells are centred on their axis values, so the edges lie half a cell out.
        let x = left + (d[0] + 0.25) / 32.0 * (right - left);
        let y = bottom - (d[1] + 4.125) / 8.0 * (bottom - top);
        let centre = |wanted: &dyn Fn([u8; 3]) -> bool| {
            let inside = img.enumerate_pixels().filter(|(px, py, c)| {
                let (px, py) = (f64::from(*px), f64::from(*py));
                px > left + 2.0 && px < right - 2.0 && py > top + 2.0 && py < bottom - 2.0 && wanted(c.0)
            });
            let (mut n, mut sx, mut sy) = (0.0, 0.0, 0.0);
            for (px, py, _) in inside {
                (n, sx, sy) = (n + 1.0, sx + f64::from(px) + 0.5, sy + f64::from(py) + 0.5);
            }
            assert!(n > 20.0);
            (sx / n, sy / n)
        };
        let ring = centre(&|c| c == [255, 255, 255]);
        assert!((ring.0 - x).abs() < 1.0 && (ring.1 - y).abs() < 1.0, "{ring:?} {x} {y}");
        // Viridis ends in yellow.
        let cell = centre(&|c| c[0] > 240 && c[1] > 220 && c[2] < 60);
        assert!((cell.0 - x).abs() < 12.0 && (cell.1 - y).abs() < 16.0, "{cell:?} {x} {y}");
    }
}

#[test]
fn one_bright_cell_survives_a_map_finer_than_the_picture() {
    let (rows, columns) = (2048usize, 4096usize);
    let range_m: Vec<f64> = (0..columns).map(|i| i as f64).collect();
    let rate: Vec<f64> = (0..rows).map(|i| i as f64).collect();
    let mut power_w = vec![1e-15f32; rows * columns];
    power_w[1234 * columns + 3001] = 1e-8;
    let p = range_doppler(&RangeDoppler {
        title: "",
        power_w: &power_w,
        range_m: &range_m,
        range_rate_mps: &rate,
        detections: &[],
        ..Default::default()
    })
    .unwrap();
    let img = p.pixels();
    let (left, top, right, bottom) = frame(img);
    let bright: Vec<_> = img
        .enumerate_pixels()
        .filter(|(x, _, c)| f64::from(*x) < right - 2.0 && c.0[0] > 240 && c.0[1] > 220 && c.0[2] < 60)
        .map(|(x, y, _)| (f64::from(x) + 0.5, f64::from(y) + 0.5))
        .collect();
    assert!(!bright.is_empty());
    for (x, y) in bright {
        assert!(((x - left) / (right - left) * 4096.0 - 3001.5).abs() < 8.0);
        assert!(((bottom - y) / (bottom - top) * 2048.0 - 1234.5).abs() < 8.0);
    }
}

#[test]
fn labels_of_a_road() {
    let r = road();
    let named = |p: &BirdsEyePoint, class: &str| LabelledPoint {
        at_m: [p.x_m, p.y_m],
        class: class.into(),
        flag: if class.is_empty() { "ghost" } else { "" },
    };
    let points: Vec<LabelledPoint> =
        r.points.iter().enumerate().map(|(i, p)| named(p, ["car", "", "marker"][i % 3])).collect();
    let picture = |points: &[LabelledPoint], lines: &[RoadLine], free: &[[f64; 2]]| {
        let scene = BirdsEye { title: "Labels", objects: &r.objects, ..Default::default() };
        labels(&Labels { scene, lines, free_space_m: free, points }).unwrap()
    };
    let lines = [true, false].map(|edge| RoadLine { points_m: vec![[0.0, 1.75], [60.0, 1.75]], edge });
    let all = picture(&points, &lines, &[[0.0, 0.0], [40.0, -3.0], [40.0, 3.0]]);
    keep("labels.png", &all);
    // Ghosts are ringed in red, and only they.
    let red = |p: &Picture| p.pixels().pixels().filter(|c| c.0 == class_colour("ghost")).count();
    assert!(red(&all) > 50);
    let real: Vec<LabelledPoint> = points.iter().filter(|p| p.flag.is_empty()).cloned().collect();
    assert_eq!(red(&picture(&real, &[], &[])), 0);
}

#[test]
fn mask_with_left_on_the_left() {
    let (rows, columns) = (30, 20);
    // A vehicle in the far left corner.
    let cells: Vec<u8> =
        (0..rows * columns).map(|i| if i / columns >= 20 && i % columns < 5 { 2 } else { 1 }).collect();
    let input = MaskPicture {
        title: "Mask",
        cells: &cells,
        rows,
        columns,
        ahead_m: 60.0,
        across_m: 40.0,
        names: &["undefined", "lane", "vehicle"],
        points: &[],
    };
    let p = mask_picture(&input).unwrap();
    keep("mask.png", &p);
    let (w, h) = (f64::from(p.pixels().width()), f64::from(p.pixels().height()));
    let vehicle = p
        .pixels()
        .enumerate_pixels()
        .filter(|(_, y, c)| c.0 == class_colour("vehicle") && f64::from(*y) > 0.1 * h);
    let (n, x, y) = vehicle
        .fold((0.0, 0.0, 0.0), |(n, sx, sy), (x, y, _)| (n + 1.0, sx + f64::from(x), sy + f64::from(y)));
    assert!(n > 1000.0 && x / n < 0.4 * w && y / n < 0.5 * h, "{n} {} {}", x / n / w, y / n / h);
    assert!(mask_picture(&MaskPicture { names: &["undefined", "lane"], ..input.clone() }).is_err());
    assert!(mask_picture(&MaskPicture { rows: 29, ..input }).is_err());
}

#[test]
fn birds_eye_of_a_road() {
    let r = road();
    let radars = [FieldOfView { half_angle_rad: 1.0, range_m: 62.0, ..Default::default() }];
    let p = birds_eye(&BirdsEye {
        title: "Points and true objects from above, frame 0",
        objects: &r.objects,
        points: &r.points,
        radars: &radars,
        ..Default::default()
    })
    .unwrap();
    keep("birds_eye.png", &p);
    assert!(p.pixels().width() > p.pixels().height());
    assert!(colours(&p) > 50);
    let near: Vec<_> = r.points.iter().copied().filter(|p| p.x_m < 24.0).collect();
    let p = birds_eye(&BirdsEye {
        title: "The first 25 m",
        objects: &r.objects,
        points: &near,
        radars: &radars,
        limits_m: Some([[-2.0, -10.0], [25.0, 10.0]]),
        ..Default::default()
    })
    .unwrap();
    keep("birds_eye_near.png", &p);
}

#[test]
fn left_is_left_and_scales_are_equal() {
    // One point straight ahead and one to the left, as red and blue as the scale gets.
    for (limits, lying) in [([[0.0, -10.0], [60.0, 10.0]], true), ([[0.0, -10.0], [20.0, 10.0]], false)] {
        let points = [
            BirdsEyePoint { x_m: 15.0, y_m: 5.0, value: 10.0 },
            BirdsEyePoint { x_m: 5.0, y_m: 0.0, value: -10.0 },
        ];
        let p =
            birds_eye(&BirdsEye { points: &points, limits_m: Some(limits), ..Default::default() }).unwrap();
        let img = p.pixels();
        let (left, top, right, bottom) = frame(img);
        let centre = |wanted: &dyn Fn([u8; 3]) -> bool| {
            let v: Vec<_> = img
                .enumerate_pixels()
                .filter(|(x, y, c)| {
                    f64::from(*x) < right - 2.0
                        && f64::from(*y) > top + 2.0
                        && f64::from(*y) < bottom
                        && wanted(c.0)
                })
                .map(|(x, y, _)| (f64::from(x) + 0.5, f64::from(y) + 0.5))
                .collect();
            assert!(v.len() > 20);
            let n = v.len() as f64;
            (v.iter().map(|p| p.0).sum::<f64>() / n, v.iter().map(|p| p.1).sum::<f64>() / n)
        };
        let red = centre(&|c| c[0] > 90 && c[1] < 30 && c[2] < 60);
        let blue = centre(&|c| c[0] < 30 && c[2] > 85 && c[1] < 70);
        let metre = if lying { (right - left) / 60.0 } else { (bottom - top) / 20.0 };
        let across = if lying { (bottom - top) / 20.0 } else { (right - left) / 20.0 };
        assert!((metre / across - 1.0).abs() < 0.01, "{metre} {across}");
        let (forward, leftward) =
            if lying { (red.0 - blue.0, blue.1 - red.1) } else { (blue.1 - red.1, blue.0 - red.0) };
        assert!((forward / metre - 10.0).abs() < 0.1 && (leftward / metre - 5.0).abs() < 0.1);
    }
}

#[test]
fn range_profile_of_a_road() {
    let r = road();
    let row = 34 * r.range_m.len();
    let power_dbm: Vec<f64> = r.power_w[row..row + r.range_m.len()]
        .iter()
        .map(|p| catseye::base::units::dbm_from_w(f64::from(*p)))
        .collect();
    let threshold: Vec<f64> = (0..power_dbm.len())
        .map(|i| {
            let w = &power_dbm[i.saturating_sub(12)..(i + 13).min(power_dbm.len())];
            let mut sorted = w.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() * 3 / 4] + 4.0
        })
        .collect();
    let detections: Vec<[f64; 2]> = (1..power_dbm.len() - 1)
        .filter(|i| {
            power_dbm[*i] > threshold[*i]
                && power_dbm[*i] > power_dbm[i - 1]
                && power_dbm[*i] > power_dbm[i + 1]
        })
        .map(|i| [r.range_m[i], power_dbm[i]])
        .collect();
    let p = range_profile(&RangeProfile {
        title: "Range profile at −9.9 m/s",
        range_m: &r.range_m,
        power_dbm: &power_dbm,
        threshold_dbm: &threshold,
        noise_dbm: Some(-122.0),
        detections: &detections,
        ..Default::default()
    })
    .unwrap();
    keep("range_profile.png", &p);
    assert!(colours(&p) > 30);
}

#[test]
fn rcs_pictures() {
    let curves = [
        sweep("VV", -90.0, 90.0, 0.1, |a| plate(a, 0.0)),
        sweep("HH", -90.0, 90.0, 0.1, |a| plate(a, -0.02 * a.abs())),
    ];
    keep("rcs_polar_half.png", &rcs_polar("Plate 0.1 m × 0.1 m, 77 GHz", &curves).unwrap());
    let round = [
        sweep("VV", -180.0, 179.5, 0.5, |a| plate(a, 0.0)),
        sweep("dihedral", -180.0, 179.5, 0.5, |a| 10.0 * (a.to_radians() * 2.0).cos() - 10.0),
    ];
    keep("rcs_polar.png", &rcs_polar("All round", &round).unwrap());
    let four = [
        sweep("VV", -45.0, 45.0, 0.1, |a| plate(a, 0.0)),
        sweep("HH", -45.0, 45.0, 0.1, |a| plate(a, -0.05 * a.abs())),
        sweep("VH", -45.0, 45.0, 0.1, |a| -35.0 + 0.1 * a),
        sweep("HV", -45.0, 45.0, 0.1, |_| f64::NEG_INFINITY),
    ];
    let p = rcs_lines("Plate 0.1 m × 0.1 m, 77 GHz", "azimuth (deg), positive left", &four).unwrap();
    keep("rcs_lines.png", &p);
    let rows: Vec<RcsRow> = (0..51)
        .flat_map(|e| (0..161).map(move |a| (f64::from(e) * 0.1, f64::from(a) * 0.5 - 40.0)))
        .map(|(el, az)| RcsRow {
            frequency_hz: 77e9,
            azimuth_deg: az,
            elevation_deg: el,
            vv_dbsm: plate(az * 0.2, plate(el * 2.0, -40.0)),
            ..Default::default()
        })
        .collect();
    keep("rcs_map.png", &rcs_picture("Type 1, W 160 mm", &rows, RcsStyle::Auto).unwrap());
    assert_eq!(rcs_picture("", &rows[..1], RcsStyle::Auto).unwrap_err().exit_code(), 2);
    let by_frequency: Vec<RcsRow> =
        (0..5).map(|i| RcsRow { frequency_hz: 76e9 + 1e8 * f64::from(i), ..Default::default() }).collect();
    rcs_picture("", &by_frequency, RcsStyle::Auto).unwrap();
}

/// Rows of a sweep at these frequencies; cross-polarisation 30 dB lower, circular levels of their own, and `linear45` far below.
fn swept(azimuths: &[f64], elevations: &[f64], frequencies: &[f64]) -> Vec<RcsRow> {
    let mut rows = Vec::new();
    for f in frequencies {
        for el in elevations {
            for az in azimuths {
                let level = plate(az * 0.2 + (f * 1e-9 - 77.0), plate(el * 2.0, -40.0));
                rows.push(RcsRow {
                    frequency_hz: *f,
                    azimuth_deg: *az,
                    elevation_deg: *el,
                    vv_dbsm: level,
                    hh_dbsm: level,
                    vh_dbsm: level - 30.0,
                    hv_dbsm: level - 200.0,
                    derived_dbsm: [
                        Some([level - 210.0; 4]),
                        Some([level - 15.0, level, level, level - 20.0]),
                    ],
                    ..Default::default()
                });
            }
        }
    }
    rows
}

/// Labels of the texts of a picture.
fn words(picture: &Picture) -> Vec<String> {
    let svg = picture.svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    document.descendants().filter_map(|n| n.attribute("aria-label")).map(String::from).collect()
}

#[test]
fn every_polarisation_and_frequency_is_drawn_and_named() {
    let azimuths: Vec<f64> = (-45..=45).map(f64::from).collect();
    let one = rcs_picture("plate", &swept(&azimuths, &[0.0], &[77e9]), RcsStyle::Auto).unwrap();
    keep("rcs_polarisations.png", &one);
    let found = words(&one);
    for name in ["VV", "HH", "VH", "RR", "RL", "LR", "LL"] {
        assert!(found.iter().any(|w| w == name), "{name} {found:?}");
    }
    let left_out = found.iter().find(|w| w.starts_with("left out, below −")).unwrap();
    assert!(left_out.ends_with("HV, +45°/+45°, +45°/−45°, −45°/+45°, −45°/−45°"), "{left_out}");
    for style in [RcsStyle::Auto, RcsStyle::Polar] {
        let two = rcs_picture("plate", &swept(&azimuths, &[0.0], &[76e9, 77e9]), style).unwrap();
        keep(&format!("rcs_two_frequencies_{style:?}.png"), &two);
        let found = words(&two);
        for name in ["VV, 76 GHz", "VV, 77 GHz", "LL, 77 GHz"] {
            assert!(found.iter().any(|w| w == name), "{name} {found:?}");
        }
    }
    let band: Vec<f64> = (0..20).map(|i| 76e9 + 5e7 * f64::from(i)).collect();
    let many = rcs_picture("plate", &swept(&azimuths, &[0.0], &band), RcsStyle::Auto).unwrap();
    keep("rcs_many_frequencies.png", &many);
    let found = words(&many);
    for name in ["76 GHz", "76.95 GHz", "VV", "RR"] {
        assert!(found.iter().any(|w| w == name), "{name} {found:?}");
    }
    // Over the frequency alone.
    let found = words(&rcs_picture("plate", &swept(&[1.0], &[0.0], &band), RcsStyle::Auto).unwrap());
    assert!(found.iter().any(|w| w == "RL") && found.iter().any(|w| w == "frequency (GHz)"), "{found:?}");
}

#[test]
fn two_angles_make_a_map_of_each_polarisation_and_frequency() {
    let (azimuths, elevations): (Vec<f64>, Vec<f64>) =
        ((-20..=20).map(f64::from).collect(), (0..=5).map(f64::from).collect());
    let sheet = rcs_picture("plate", &swept(&azimuths, &elevations, &[76e9, 77e9]), RcsStyle::Auto).unwrap();
    keep("rcs_maps.png", &sheet);
    let found = words(&sheet);
    for name in ["plate, VV, 76 GHz", "plate, RL, 77 GHz"] {
        assert!(found.iter().any(|w| w == name), "{name} {found:?}");
    }
    assert!(found.iter().any(|w| w.starts_with("left out, below −") && w.contains("HV")), "{found:?}");
    let band: Vec<f64> = (0..5).map(|i| 76e9 + 1e8 * f64::from(i)).collect();
    let found = words(&rcs_picture("", &swept(&azimuths, &elevations, &band), RcsStyle::Auto).unwrap());
    assert!(found.iter().any(|w| w == "the first 16 of 35 maps"), "{found:?}");
}

#[test]
fn files_are_what_their_names_say() {
    let azimuths: Vec<f64> = (-20..=20).map(f64::from).collect();
    let rows = swept(&azimuths, &[0.0, 1.0], &[77e9]);
    let picture = rcs_picture("a <plate> & \"b\"", &rows, RcsStyle::Auto).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str| picture.write(dir.path().join(name), false).map(|p| std::fs::read(p).unwrap());
    assert!(write("a.png").unwrap().starts_with(b"\x89PNG"));
    assert!(write("plain").unwrap().starts_with(b"\x89PNG"));
    let pdf = write("a.PDF").unwrap();
    assert!(pdf.starts_with(b"%PDF-") && pdf.trim_ascii_end().ends_with(b"%%EOF"));
    assert_eq!(pdf, picture.pdf());
    let svg = String::from_utf8(write("a.svg").unwrap()).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let root = document.root_element();
    let (w, h) = picture.pixels().dimensions();
    assert_eq!(root.attribute("viewBox"), Some(&*format!("0 0 {w} {h}")));
    assert_eq!(root.attribute("width"), Some(&*(w / 2).to_string()));
    // Cells of a map are an image, and a map has some.
    let is_png =
        |n: &roxmltree::Node<'_, '_>| n.attribute("href").is_some_and(|h| h.starts_with("data:image/png"));
    assert!(document.descendants().any(|n| n.tag_name().name() == "image" && is_png(&n)));
    let e = write("a.jpg").unwrap_err().to_string();
    assert!([".jpg", ".png, .svg, .pdf"].iter().all(|part| e.contains(part)), "{e}");
    assert!(write("a.svg").unwrap_err().to_string().contains("exists"));
}

#[test]
fn positive_azimuth_lies_left_on_the_disc() {
    // One lobe at +45 degrees.
    let p = rcs_polar("", &[sweep("", 35.0, 55.0, 0.5, |a| -0.01 * (a - 45.0).powi(2))]).unwrap();
    let img = p.pixels();
    let [r, g, b] = curve_pen(0).colour;
    let curve: Vec<_> =
        img.enumerate_pixels().filter(|(_, _, c)| c.0 == [r, g, b]).map(|(x, y, _)| (x, y)).collect();
    assert!(curve.len() > 100);
    assert!(curve.iter().all(|(x, y)| *x < img.width() / 2 && *y < img.height() / 2));
}

#[test]
fn odd_numbers_draw_something() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e300, 1e-300];
    let mixed: Vec<[f64; 2]> = bad.iter().flat_map(|a| bad.iter().map(move |b| [*a, *b])).collect();
    for points in [vec![], vec![[1.0, 1.0]], vec![[0.0, f64::NEG_INFINITY]; 3], vec![[f64::NAN; 2]; 2], mixed]
    {
        let curves = [Curve { label: "a $b$ & <c>".into(), points: points.clone() }];
        lines("", "x", "y", &curves).draw().unwrap();
        rcs_polar("", &curves).unwrap();
        rcs_lines("", "azimuth (deg)", &curves).unwrap();
        let ranges: Vec<f64> = points.iter().map(|p| p[0]).collect();
        let powers: Vec<f64> = points.iter().map(|p| p[1]).collect();
        range_profile(&RangeProfile {
            title: "",
            range_m: &ranges,
            power_dbm: &powers,
            threshold_dbm: &powers,
            noise_dbm: Some(f64::NEG_INFINITY),
            detections: &points,
            ..Default::default()
        })
        .unwrap();
        let above: Vec<_> =
            points.iter().map(|p| BirdsEyePoint { x_m: p[0], y_m: p[1], value: p[1] }).collect();
        let object = Outline::whole("", points.clone());
        birds_eye(&BirdsEye { objects: &[object], points: &above, ..Default::default() }).unwrap();
    }
    for cell in [0.0, f32::NAN, f32::INFINITY, -1.0, 1e-12] {
        let p = range_doppler(&RangeDoppler {
            title: "all the same",
            power_w: &[cell; 12],
            range_m: &[0.0, 1.0, 2.0, 3.0],
            range_rate_mps: &[-1.0, 0.0, 1.0],
            detections: &[],
            ..Default::default()
        })
        .unwrap();
        assert!(colours(&p) > 10);
    }
    let one = RangeDoppler { power_w: &[1.0], range_m: &[0.0], range_rate_mps: &[0.0], ..Default::default() };
    range_doppler(&one).unwrap();
    assert!(range_doppler(&RangeDoppler { range_m: &[], ..one }).is_err());
}

#[test]
fn files_are_told_apart() {
    let t = tempfile::tempdir().unwrap();
    let frame_dir = t.path().join("frame_000000");
    std::fs::create_dir(&frame_dir).unwrap();
    let file = |name: &str, text: &str| {
        let p = frame_dir.join(name);
        std::fs::write(&p, text).unwrap();
        p
    };
    let points = file(
        "points.csv",
        "range_m,range_rate_mps,azimuth_deg,elevation_deg,x_m,y_m,z_m,power_dbm,snr_db,rcs_dbsm,object_id,class\n10,-9,5,0,9.96,0.87,0,-80,20,3,1,car\n",
    );
    let returns = file(
        "returns.csv",
        "range_m,range_rate_mps,azimuth_deg,elevation_deg,power_dbm,chain,bounces\n10,-9,5,0,-80,1,1\n12,-9,-5,0,-90,1 2,2\n",
    );
    let mut rcs = String::from(
        "# target: plate\nfrequency_hz,azimuth_deg,elevation_deg,vv_dbsm,vh_dbsm,hv_dbsm,hh_dbsm,vv_re_m,vv_im_m,vh_re_m,vh_im_m,hv_re_m,hv_im_m,hh_re_m,hh_im_m\n",
    );
    for i in 0..50 {
        rcs.push_str(&format!(
            "77e9,{},0,{},-inf,-inf,{},0,0,0,0,0,0,0,0\n",
            i - 25,
            plate(f64::from(i - 25), 0.0),
            -1
        ));
    }
    let rcs = file("rcs.csv", &rcs);
    let map = frame_dir.join("range_doppler.npy");
    npy::write(
        &map,
        &[3, 4],
        &[1e-12f32, 2e-12, 3e-12, 4e-12, 5e-12, 1e-9, 0.0, 1e-12, 1e-12, 1e-12, 1e-12, 1e-12],
    )
    .unwrap();
    let adc = frame_dir.join("adc.npy");
    npy::write(&adc, &[2, 2, 3], &[num_complex::Complex32::new(1e-6, 2e-6); 12]).unwrap();
    let options = PlotOptions::default();
    let out = t.path().join("out.png");
    for f in [&points, &returns, &rcs, &map, &adc] {
        let written = plot_file(f, &out, &PlotOptions { force: true, ..Default::default() }).unwrap().path;
        assert_eq!(written, std::fs::canonicalize(&out).unwrap());
        assert!(image::open(&out).unwrap().width() > 800, "{}", f.display());
    }
    let e = plot_file(&rcs, &out, &options).unwrap_err();
    assert!(e.exit_code() == 2 && e.to_string().contains("--force"), "{e}");

    // With a manifest the axes are in metres, and an axis that does not fit is named.
    let bare = file::picture_of_file(&map, &options).unwrap().0;
    let manifest = t.path().join("manifest.json");
    std::fs::write(
        &manifest,
        r#"{"axes": {"range_m": {"first": 0, "step": 5}, "range_rate_mps": [-5, 0, 5]}}"#,
    )
    .unwrap();
    let with_axes = file::picture_of_file(&map, &options).unwrap().0;
    assert!(bare != with_axes);
    std::fs::write(&manifest, r#"{"axes": {"range_m": [0, 1], "range_rate_mps": [-5, 0, 5]}}"#).unwrap();
    let e = file::picture_of_file(&map, &options).unwrap_err();
    assert!(e.to_string().contains("axes.range_m") && e.exit_code() == 2, "{e}");

    let other = file("notes.csv", "a,b\n1,2\n");
    for f in [&other, &file("a.txt", "x"), &t.path().join("missing.csv"), &t.path().join("missing.npy")] {
        let e = plot_file(f, t.path().join("x.png"), &options).unwrap_err();
        assert_eq!(e.exit_code(), 2, "{e}");
        assert_eq!(e.to_string().lines().count(), 1);
    }
    let e = plot_file(&other, t.path().join("x.png"), &options).unwrap_err().to_string();
    assert!(e.contains("points.csv") && e.contains("adc.npy"), "{e}");
}

/// The drawing itself, not pixels: sizes, colours and the legend of a plan.
#[test]
fn plans_show_small_things_and_what_the_legend_says() {
    let r = road();
    let mut objects = r.objects.clone();
    objects.push(Outline::whole("car", vec![[50.0, 3.0]]));
    objects.push(Outline::whole("corner", vec![[60.0, 3.0]]));
    let radars = [FieldOfView { half_angle_rad: 1.0, range_m: 62.0, ..Default::default() }];
    let input = BirdsEye { objects: &objects, points: &r.points, radars: &radars, ..Default::default() };
    let chart = birds_eye::birds_eye_chart(&input);
    assert_eq!(chart.unfounded_keys(), Vec::<&str>::new());
    let labels: Vec<&str> = chart.keys.iter().map(|k| k.label.as_str()).collect();
    for wanted in
        ["marker (enlarged)", "post (enlarged)", "car", "car, point", "corner", "guard rail", "radar"]
    {
        assert!(labels.contains(&wanted), "{labels:?}");
    }
    let pixel = (chart.x.hi - chart.x.lo).abs() / chart.width;
    let mut seen = 0;
    for layer in &chart.layers {
        if let Layer::Area { polygon, fill: Some((colour, _)), .. } = layer {
            let side = |i: usize| {
                let (lo, hi) = finite_range(polygon.iter().map(|p| p[i])).unwrap();
                (hi - lo) / pixel
            };
            assert!(side(0).max(side(1)) > birds_eye::SMALLEST - 1e-6, "{} {}", side(0), side(1));
            let small = [class_colour("marker"), class_colour("post")].contains(colour);
            assert!(!small || side(0).min(side(1)) > 0.5 * birds_eye::SMALLEST - 1e-6);
            seen += usize::from(small);
        }
    }
    assert_eq!(seen, 2 * (26 + 20));
    // Near by they have their own size.
    let near = BirdsEye { limits_m: Some([[19.0, 7.0], [21.0, 8.0]]), ..input };
    let chart = birds_eye::birds_eye_chart(&near);
    assert!(chart.keys.iter().all(|k| !k.label.contains("enlarged")), "{:?}", chart.keys);
}

#[test]
fn long_titles_take_another_line() {
    let title = "type1:width_m=0.16,height_m=0.004,length_m=0.117,thickness_m=0.002, 77 GHz, transmitter at azimuth 10°";
    let height = |title: &str| lines(title, "x", "y", &[]).draw().unwrap().pixels().height();
    assert!(height(title) > height("short"));
    assert_eq!(height("short"), height("short, 77 GHz"));
}

#[test]
fn a_white_line_shows_in_the_legend() {
    let mut chart = Chart::new("", Axis::new("", 0.0, 1.0), Axis::new("", 0.0, 1.0));
    let dark = |chart: &Chart| chart.draw().unwrap().pixels().pixels().filter(|p| p.0 == [68, 1, 84]).count();
    chart.key("true", Symbol::Line(Pen::solid([0, 0, 0], 2.0)));
    assert_eq!(dark(&chart), 0);
    chart.key("true", Symbol::Line(Pen::solid([255, 255, 255], 2.0)));
    // 24 x 10 logical pixels less the line.
    assert!(dark(&chart) > 500);
}

/// What a page in a browser needs to draw the same chart.
#[test]
fn charts_are_json() {
    let mut chart =
        Chart::new("two", Axis::new("range (m)", 0.0, 10.0), Axis::new("power (dBm)", -90.0, 0.0));
    let pen = Pen::solid([1, 2, 3], 2.0);
    chart.layers.push(Layer::Line { points: vec![[0.0, -80.0], [5.0, f64::NAN]], pen });
    chart.key("gain", Symbol::Line(pen));
    chart.marks("points", vec![[2.0, -70.0]], Mark::Ring { radius: 4.0 }, [9, 8, 7]);
    chart.scale = Some(Scale::new(ColourMap::BlueWhiteRed, "dB", -1.0, 1.0));
    let pen = serde_json::json!({"colour": [1, 2, 3], "width": 2.0, "dash": null});
    let ring = serde_json::json!({"shape": "ring", "radius": 4.0});
    let axis = |label: &str, lo: f64, hi: f64| serde_json::json!({"label": label, "lo": lo, "hi": hi, "degrees": false, "names": []});
    assert_eq!(
        serde_json::to_value(&chart).unwrap(),
        serde_json::json!({
            "title": "two",
            "x": axis("range (m)", 0.0, 10.0),
            "y": axis("power (dBm)", -90.0, 0.0),
            "width": 600.0,
            "height": 400.0,
            "grid": true,
            "scale": {"map": "blue-white-red", "axis": axis("dB", -1.0, 1.0)},
            "layers": [
                {"layer": "line", "points": [[0.0, -80.0], [5.0, null]], "pen": pen},
                {"layer": "marks", "points": [[2.0, -70.0]], "mark": ring, "paint": {"fixed": [9, 8, 7]}},
            ],
            "keys": [
                {"label": "gain", "symbol": {"line": pen}},
                {"label": "points", "symbol": {"mark": [ring, [9, 8, 7]]}},
            ],
        })
    );
}
