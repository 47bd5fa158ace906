use super::*;
use catseye::base::rng::Draws;

/// The gaps of the committed road scene, and a set whose short sums differ.
const SCENE: Alphabet = Alphabet::Gaps { zero_m: 1.5, one_m: 2.0, sync_m: Some(3.0) };
const APART: Alphabet = Alphabet::Gaps { zero_m: 1.5, one_m: 2.0, sync_m: Some(2.75) };
const SIDES: Alphabet = Alphabet::Sides { pitch_m: 1.5, side_m: 0.3, sync_m: Some(2.2) };

fn look(
    alphabet: &Alphabet,
    word: &[bool],
    d: &mut Draws,
    length_m: f64,
    missing: f64,
    extra: f64,
    noise: f64,
) -> Vec<RowPoint> {
    let period = alphabet.pattern(word).period_m;
    let from = period * d.uniform();
    let mut out: Vec<(f64, f64)> = alphabet
        .markers(word, 0.0, 3.0 * period + length_m)
        .unwrap()
        .into_iter()
        .filter(|p| p.0 >= from && p.0 <= from + length_m)
        .collect();
    let n = out.len() as f64;
    for p in &mut out {
        // A scale that the reader does not know.
        *p = ((p.0 - from) * 1.002 + noise * d.normal(), p.1 + noise * d.normal());
    }
    out.retain(|_| d.uniform() >= missing);
    let scale = if let Alphabet::Sides { side_m, .. } = alphabet { 2.0 * side_m } else { 0.0 };
    // A random number with this mean, as a share of the markers.
    for _ in 0..(4.0 * n) as usize {
        if d.uniform() < 0.25 * extra {
            out.push((length_m * d.uniform(), scale * (2.0 * d.uniform() - 1.0)));
        }
    }
    let std = noise.max(0.01);
    out.iter().map(|p| RowPoint { s_m: p.0, t_m: p.1, s_std_m: std, t_std_m: std }).collect()
}

/// (words read wrong, of them sure, not sure, seconds of a call) of n.
fn errors(
    code: Code,
    alphabet: Alphabet,
    n: u32,
    length_m: f64,
    share: f64,
    noise: f64,
    looks: usize,
) -> (u32, u32, u32, f64) {
    let reader = Reader::new(code, alphabet, ReadSettings::default()).unwrap();
    let (mut wrong, mut sure_wrong, mut unsure, mut time) = (0, 0, 0, 0.0);
    for seed in 0..n {
        let mut d = Draws::new(seed, 11);
        let message = (d.uniform() * f64::from(1u32 << code.message_bits())) as u32;
        let word = code.encode(message).unwrap();
        let seen: Vec<_> =
            (0..looks).map(|_| look(&alphabet, &word, &mut d, length_m, share, share, noise)).collect();
        let clock = std::time::Instant::now();
        let r = reader.read(&seen);
        time += clock.elapsed().as_secs_f64() / f64::from(n);
        match r {
            Ok(r) => {
                wrong += u32::from(r.message != message);
                sure_wrong += u32::from(r.message != message && r.sure);
                unsure += u32::from(!r.sure);
            }
            Err(_) => {
                wrong += 1;
                unsure += 1;
            }
        }
    }
    (wrong, sure_wrong, unsure, time)
}

#[test]
#[ignore = "prints the figures of the notes"]
fn figures() {
    let n = 100;
    for (name, code, alphabet, length) in [
        ("sides 1.5 m +-0.3 m, BCH(15,7), 40 m", BCH, SIDES, 40.0),
        ("gaps 1.5/2.0/3.0, BCH(15,5), 40 m", Code::Bch15x5, SCENE, 40.0),
        ("gaps 1.5/2.0/2.75, BCH(15,7), 40 m", BCH, APART, 40.0),
        ("gaps 1.5/2.0/3.0, no code, 7 bits, 40 m", Code::Plain { bits: 7 }, SCENE, 40.0),
        ("gaps 1.5/2.0/3.0, Hamming(7,4), 40 m", Code::Hamming7x4, SCENE, 40.0),
        ("gaps 1.5/2.0/3.0, BCH(15,7), 60 m", BCH, SCENE, 60.0),
        ("gaps 1.5/2.0/3.0, BCH(15,7), 40 m", BCH, SCENE, 40.0),
    ] {
        for noise in [0.1, 0.05, 0.15] {
            print!("{name} | noise {noise} m |");
            let mut worst: f64 = 0.0;
            for share in [0.0, 0.05, 0.1, 0.15] {
                let (wrong, sure, unsure, time) = errors(code, alphabet, n, length, share, noise, 1);
                print!(" {:.0} %: {wrong} wrong ({sure} sure), {unsure} unsure;", 100.0 * share);
                worst = worst.max(time);
            }
            println!(" of {n} | {:.1} ms", 1e3 * worst);
        }
    }
    let (wrong, sure, unsure, _) = errors(Code::Bch15x7, SCENE, n, 40.0, 0.15, 0.1, 3);
    println!("BCH(15,7) three looks, noise 0.1, 15 %: {wrong} wrong ({sure} sure), {unsure} unsure of {n}");
}

const BCH: Code = Code::Bch15x7;

#[test]
fn codes_have_their_distances() {
    for (code, distance) in [(Code::Hamming7x4, 3), (Code::Bch15x7, 5), (Code::Bch15x5, 7)] {
        let words: Vec<Vec<bool>> = (0..1 << code.message_bits()).map(|m| code.encode(m).unwrap()).collect();
        let differ = |a: &[bool], b: &[bool]| a.iter().zip(b).filter(|(x, y)| x != y).count();
        let pairs = (0..words.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        assert_eq!(pairs.map(|(i, j)| differ(&words[i], &words[j])).min(), Some(distance));
        // No rotation of a word is a word.
        for w in &words {
            for k in 1..w.len() {
                let mut r = w.clone();
                r.rotate_left(k);
                assert!(!words.contains(&r), "{code:?}");
            }
        }
        assert_eq!(code.encode(1 << code.message_bits()), Err(bad_message()));
    }
}

#[test]
fn the_markers_stand_as_the_road_builder_sets_them() {
    // code = { word = "1011", zero_m = 1.5, one_m = 2, sync_m = 3 } from 3 m on.
    let m = SCENE.markers(&[true, false, true, true], 3.0, 20.0).unwrap();
    let s: Vec<f64> = m.iter().map(|p| p.0).collect();
    assert_eq!(s, [3.0, 5.0, 6.5, 8.5, 10.5, 13.5, 15.5, 17.0, 19.0]);
    let reader = Reader::new(Code::Plain { bits: 4 }, SCENE, ReadSettings::default()).unwrap();
    let points: Vec<RowPoint> =
        m.iter().map(|p| RowPoint { s_m: p.0 + 123.4, t_m: 0.0, s_std_m: 0.05, t_std_m: 0.05 }).collect();
    let r = reader.read(&[points]).unwrap();
    assert_eq!((r.word.as_slice(), r.sure), ([true, false, true, true].as_slice(), true));
    assert_eq!((r.matched, r.missing, r.extra), (9, 0, 0));
}

#[test]
fn words_are_read_with_markers_missing_and_points_too_many() {
    let n = 100;
    for (code, share, looks, most) in [
        (Code::Hamming7x4, 0.0, 1, 0),
        // Rates near the measured ones plus four standard deviations of their count.
        (Code::Hamming7x4, 0.1, 1, 4),
        (BCH, 0.1, 1, 4),
        (Code::Bch15x5, 0.1, 1, 9),
        (BCH, 0.1, 3, 6),
    ] {
        let (wrong, sure_wrong, _, _) = errors(code, SCENE, n, 40.0, share, 0.1, looks);
        assert!(wrong <= most && sure_wrong <= 2, "{code:?} {share}: {wrong} wrong, {sure_wrong} sure");
    }
    let (wrong, ..) = errors(BCH, SIDES, n, 40.0, 0.1, 0.1, 1);
    assert!(wrong <= 9, "{wrong}");
}

#[test]
fn a_row_is_read_against_its_direction() {
    let s = ReadSettings { either_direction: true, ..Default::default() };
    let reader = Reader::new(BCH, SCENE, s).unwrap();
    let word = BCH.encode(0b010_0101).unwrap();
    let mut d = Draws::new(3, 11);
    let mut points = look(&SCENE, &word, &mut d, 60.0, 0.0, 0.0, 0.05);
    assert!(!reader.read(&[points.clone()]).unwrap().reversed);
    for p in &mut points {
        (p.s_m, p.t_m) = (-p.s_m, -p.t_m);
    }
    let r = reader.read(&[points]).unwrap();
    assert_eq!((r.message, r.reversed), (0b010_0101, true));
}

#[test]
fn without_a_gap_between_words_rotations_are_one() {
    let alphabet = Alphabet::Gaps { zero_m: 1.5, one_m: 2.0, sync_m: None };
    let reader = Reader::new(Code::Plain { bits: 4 }, alphabet, ReadSettings::default()).unwrap();
    assert_eq!(reader.words(), 6);
    let mut d = Draws::new(4, 11);
    let points = look(&alphabet, &[true, false, true, true], &mut d, 30.0, 0.0, 0.0, 0.05);
    let r = reader.read(&[points]).unwrap();
    assert!(r.up_to_rotation && r.word == [false, true, true, true], "{r:?}");
}

#[test]
fn zones_have_messages() {
    let mut known = 0;
    for m in 0..128 {
        if let Some(z) = Zone::from_message(m) {
            assert_eq!(z.message(), Ok(m));
            known += 1;
        }
    }
    assert_eq!(known, 15 + 16 + 15 + 15 + 16 + 16 + 4);
    assert_eq!(Zone::SpeedLimit { tens_kmh: 0 }.message(), Err(bad_message()));
    assert_eq!(Zone::TunnelAhead { tens_m: 15 }.message(), Err(bad_message()));
    assert_eq!(Zone::from_message(1000), None);
}

#[test]
fn hostile_input() {
    let reader = Reader::new(BCH, SCENE, ReadSettings::default()).unwrap();
    let few = |r| matches!(r, Err(LaneError::TooFew { .. }));
    assert!(few(reader.read(&[])));
    let p = RowPoint { s_m: 1.0, t_m: 0.0, s_std_m: 0.1, t_std_m: 0.1 };
    assert!(few(reader.read(&[vec![p]])));
    let nan = RowPoint { s_m: f64::NAN, ..p };
    let exact = RowPoint { s_std_m: 0.0, ..p };
    assert!(few(reader.read(&[vec![nan, exact, p, p, p]])));
    // All at one place is no row.
    let r = reader.read(&[vec![p; 20]]);
    assert!(matches!(r, Err(LaneError::Unexplained { .. })), "{r:?}");
    assert!(matches!(reader.read(&[vec![p; 501]]), Err(LaneError::Refused { .. })));
    let same = Alphabet::Gaps { zero_m: 2.0, one_m: 2.0, sync_m: None };
    assert_eq!(
        Reader::new(BCH, same, ReadSettings::default()).err(),
        Some(LaneError::Setting { name: "one_m" })
    );
    let bits = Code::Plain { bits: 40 };
    assert_eq!(
        Reader::new(bits, SCENE, ReadSettings::default()).err(),
        Some(LaneError::Setting { name: "bits" })
    );
    assert_eq!(bits.encode(0), Err(bad_message()));
    assert!(matches!(SCENE.markers(&[true], 0.0, 1e9), Err(LaneError::Refused { .. })));
    assert!(SCENE.markers(&[], 0.0, 1.0).is_err());
}
