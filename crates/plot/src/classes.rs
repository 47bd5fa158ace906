//! The one table from which all pictures take the colours of classes and of what stands beside them.

use super::canvas::Rgb;

/// Colours of the classes that the builders and exporters know, and of the further things that plans show. All are
/// at least 10 apart in CIELAB, and those of [`COMMON`] also for readers without red or green cones (a test sees to both).
const KNOWN: [(&str, Rgb); 40] = [
    ("road", [205, 206, 208]),
    ("asphalt", [186, 180, 206]),
    ("ground", [220, 196, 170]),
    ("terrain", [196, 205, 160]),
    ("verge", [159, 208, 173]),
    ("grass", [164, 181, 116]),
    ("lane_line", [238, 236, 214]),
    ("lane", [209, 222, 249]),
    ("car", [0, 114, 178]),
    ("van", [41, 145, 200]),
    ("truck", [70, 60, 160]),
    ("bus", [30, 60, 110]),
    ("motorcycle", [0, 180, 190]),
    ("cyclist", [120, 90, 220]),
    ("bicycle", [170, 150, 240]),
    ("pedestrian", [195, 87, 143]),
    ("vehicle", [111, 156, 216]),
    ("trailer", [120, 120, 170]),
    ("marker", [225, 120, 0]),
    ("post", [45, 45, 55]),
    ("guard_rail", [98, 86, 96]),
    ("manhole", [122, 40, 16]),
    ("wall", [180, 142, 85]),
    ("kerb", [153, 132, 150]),
    ("fence", [110, 110, 60]),
    ("gantry", [0, 90, 80]),
    ("sign", [220, 200, 0]),
    ("pole", [15, 163, 116]),
    ("plate", [240, 160, 140]),
    ("reflector", [250, 200, 90]),
    ("building", [190, 155, 150]),
    ("tree", [40, 90, 30]),
    // Not classes of objects.
    ("radar", [250, 235, 90]),
    ("free space", [106, 208, 96]),
    ("ghost", [220, 20, 30]),
    ("leakage", [250, 235, 150]),
    ("noise", [120, 130, 150]),
    ("weather", [130, 190, 235]),
    ("undefined", [255, 255, 255]),
    // No object.
    ("", [155, 180, 190]),
];

/// What lies under everything: filled pale.
const GROUND: [&str; 7] = ["road", "asphalt", "ground", "terrain", "verge", "grass", "lane_line"];

/// For classes that a user made up.
const OTHER: [Rgb; 8] = [
    [240, 120, 200],
    [90, 200, 230],
    [180, 60, 200],
    [190, 230, 60],
    [60, 120, 40],
    [255, 90, 90],
    [120, 0, 80],
    [0, 60, 255],
];

/// A class without the suffix of a part: `car` of `car.wheel`.
pub(super) fn whole(class: &str) -> &str {
    class.split_once('.').map_or(class, |(whole, _)| whole)
}

/// The colour of a class, the same in every picture whatever else is in it. Parts (`car.wheel`) have that of their
/// whole. A class that is not in the table has one of eight further colours, by its name.
pub fn class_colour(class: &str) -> Rgb {
    let class = whole(class);
    match KNOWN.iter().find(|(name, _)| *name == class) {
        Some((_, colour)) => *colour,
        None => {
            // FNV-1a.
            let hash = class
                .bytes()
                .fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
            OTHER[(hash >> 32) as usize % OTHER.len()]
        }
    }
}

/// Whether things of a class lie under everything else.
pub fn is_ground(class: &str) -> bool {
    GROUND.contains(&whole(class))
}

/// A class as legends name it.
pub fn class_name(class: &str) -> String {
    if class.is_empty() { "no object".into() } else { class.replace('_', " ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the built-in scenes show side by side.
    const COMMON: [&str; 15] = [
        "car",
        "truck",
        "marker",
        "post",
        "guard_rail",
        "manhole",
        "pedestrian",
        "sign",
        "pole",
        "road",
        "verge",
        "wall",
        "free space",
        "ghost",
        "",
    ];

    type V = [f64; 3];

    fn times(m: [V; 3], v: V) -> V {
        m.map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum())
    }

    fn linear(c: Rgb) -> V {
        c.map(|v| {
            let v = f64::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        })
    }

    /// CIELAB of linear sRGB under D65.
    fn lab(linear: V) -> V {
        let xyz =
            times([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]], linear);
        let f = |x: f64| if x > 216.0 / 24389.0 { x.cbrt() } else { (24389.0 / 27.0 * x + 16.0) / 116.0 };
        let [x, y, z] = [f(xyz[0] / 0.9505), f(xyz[1]), f(xyz[2] / 1.089)];
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn apart(a: V, b: V) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    /// Without red and without green cones (Viénot, Brettel and Mollon 1999).
    const DICHROMATS: [[V; 3]; 2] = [
        [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
        [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
    ];

    #[test]
    fn classes_have_colours_of_their_own() {
        let other = OTHER.map(|c| ("made up", c));
        let all: Vec<(&str, Rgb)> = KNOWN.into_iter().chain(other).collect();
        for (i, (a, x)) in all.iter().enumerate() {
            for (b, y) in &all[..i] {
                let seen = apart(lab(linear(*x)), lab(linear(*y)));
                assert!(a != b || *a == "made up", "{a} is there twice");
                assert!(seen >= 10.0, "{a} {x:?} and {b} {y:?} are {seen:.1} apart");
            }
        }
        for (i, a) in COMMON.iter().enumerate() {
            for b in &COMMON[..i] {
                for eye in DICHROMATS {
                    let of = |c: &str| lab(times(eye, linear(class_colour(c))).map(|v| v.clamp(0.0, 1.0)));
                    let seen = apart(of(a), of(b));
                    assert!(seen >= 10.0, "{a} and {b} are {seen:.1} apart");
                }
            }
        }
    }

    #[test]
    fn a_colour_depends_on_the_class_alone() {
        assert_eq!(class_colour("car.wheel"), class_colour("car"));
        assert_ne!(class_colour("carport"), class_colour("car"));
        assert_eq!(class_colour("carport"), class_colour("carport.roof"));
        assert!(OTHER.contains(&class_colour("corner")));
        assert!(GROUND.iter().all(|g| KNOWN.iter().any(|k| k.0 == *g)));
        assert_eq!((is_ground("verge"), is_ground("car")), (true, false));
    }

    /// Pictures of things have no list of colours beside the table.
    #[test]
    fn plans_take_their_colours_from_the_table() {
        for (file, text) in [
            ("birds_eye.rs", include_str!("birds_eye.rs")),
            ("labels.rs", include_str!("labels.rs")),
            ("trial/markers/pictures.rs", include_str!("../../papers/src/trial/markers/pictures.rs")),
        ] {
            assert!(
                !text.contains("[Rgb;") && !text.contains("CURVE_COLOURS"),
                "{file} has colours of its own"
            );
            assert!(text.contains("class_colour"), "{file}");
        }
    }
}
