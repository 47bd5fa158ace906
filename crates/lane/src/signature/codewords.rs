//! Codewords in a row of markers: written in its gaps, or in the side of the line on which each marker
//! stands.
//!
//! Feng, section 4.3.4, asks for words that survive missing and extra points and gives no code. Here a word
//! of a coset of a cyclic code (Hamming(7,4), BCH(15,7), BCH(15,5)) is repeated along the row, with a longer
//! gap between words. A missing marker joins two gaps and an extra point splits one, so bits are not read one
//! by one: each word of the code is aligned with the points (dynamic programming over points and markers,
//! sums of gaps between them), and the most likely word is taken. Its likelihood relative to the next one
//! tells how certain that is.
//!
//! The gaps are those of a road's marker row (`code = { word, zero_m, one_m, sync_m }`): a gap for each bit,
//! then the gap `sync_m`, repeated. Without `sync_m`, words that are rotations of each other look alike.

use crate::error::{self, LaneError};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How the bits of a word are written in the row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Alphabet {
    /// A gap for each bit.
    Gaps {
        /// Gap of a zero, m.
        zero_m: f64,
        /// Gap of a one, m.
        one_m: f64,
        /// Gap between words, m.
        sync_m: Option<f64>,
    },
    /// Markers at equal distances along the row, each `side_m` to the left of its line (one) or to the right
    /// (zero).
    Sides {
        /// Spacing of markers along the row, m.
        pitch_m: f64,
        /// Distance of markers from the row's line, m.
        side_m: f64,
        /// Distance from a word's last marker to the next word's first, m.
        sync_m: Option<f64>,
    },
}

/// The code of the words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Code {
    /// Every word of this many bits, 1 to 12; only gaps and repetition correct errors.
    Plain {
        /// Number of bits of a word.
        bits: usize,
    },
    /// The Hamming(7,4) code, minimum distance 3.
    Hamming7x4,
    /// The BCH(15,7) code, minimum distance 5.
    Bch15x7,
    /// The BCH(15,5) code, minimum distance 7.
    Bch15x5,
}

/// The meaning of a message of seven bits: three for the kind, four for its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Zone {
    /// A speed limit, in tens of km/h, 1 to 15.
    SpeedLimit {
        /// The limit in tens of km/h.
        tens_kmh: u8,
    },
    /// A tunnel begins in this many tens of metres, 0 to 14.
    TunnelAhead {
        /// The distance in tens of metres.
        tens_m: u8,
    },
    /// The tunnel ends here.
    TunnelEnd,
    /// A sharp bend to the left with a radius of at most this many tens of metres, 1 to 15.
    SharpBendLeft {
        /// The radius in tens of metres.
        tens_m: u8,
    },
    /// A sharp bend to the right with a radius of at most this many tens of metres, 1 to 15.
    SharpBendRight {
        /// The radius in tens of metres.
        tens_m: u8,
    },
    /// A crossing follows in this many tens of metres, 0 to 15.
    CrossingAhead {
        /// The distance in tens of metres.
        tens_m: u8,
    },
    /// A number that identifies the row in a map, 0 to 15.
    Place {
        /// The number of the row.
        number: u8,
    },
    /// The row is a line of this kind.
    Line {
        /// Whether the line is solid.
        solid: bool,
        /// Whether the line is yellow.
        yellow: bool,
    },
}

/// A detected point of the row: its position along it in the direction of travel, and beside its line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RowPoint {
    /// Position along the row in the direction of travel, m.
    pub s_m: f64,
    /// Position beside the row's line, m, positive to the left.
    pub t_m: f64,
    /// Standard deviation of the position along the row, m.
    pub s_std_m: f64,
    /// Standard deviation of the position beside the line, m.
    pub t_std_m: f64,
}

/// Settings of [`Reader`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReadSettings {
    /// Probability that a marker is detected.
    pub detection_probability: f64,
    /// Density of extra points along the row, 1/m.
    pub extra_per_m: f64,
    /// Standard deviation of the scale of s: a row that is not quite straight, or markers slightly out of
    /// place.
    pub scale_std: f64,
    /// Whether the row may be met against the direction in which it was written.
    pub either_direction: bool,
    /// Largest number of successive markers that may be missing.
    pub most_missing: usize,
    /// Log odds over all other words together from which on the word counts as read.
    pub sure_log_odds: f64,
}

impl Default for ReadSettings {
    fn default() -> Self {
        Self {
            detection_probability: 0.9,
            extra_per_m: 0.06,
            scale_std: 0.003,
            either_direction: false,
            most_missing: 4,
            sure_log_odds: 4.6,
        }
    }
}

/// A word as it was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The message of the word.
    pub message: u32,
    /// The bits of the word.
    pub word: Vec<bool>,
    /// Log odds over all other words together; zero or less where another is as likely.
    pub log_odds: f64,
    /// Whether `log_odds` passes the setting.
    pub sure: bool,
    /// Message of the next likely word.
    pub runner_up: Option<u32>,
    /// Whether the row was met against its direction.
    pub reversed: bool,
    /// Whether rotations of the word look alike, since there is no gap between words: the least of them is
    /// then given.
    pub up_to_rotation: bool,
    /// Number of points of all looks that are markers.
    pub matched: usize,
    /// Number of missing markers between those that were matched.
    pub missing: usize,
    /// Number of points that are not markers.
    pub extra: usize,
    /// Position along the row of a word's first marker, m, for each look, modulo the word's length; None
    /// without points. If the row was met against the direction of writing, it is that of the mirrored row.
    pub begin_m: Vec<Option<f64>>,
}

fn bad_message() -> LaneError {
    LaneError::refused("the message does not fit the code")
}

impl Code {
    /// Number of bits of a word.
    pub fn length(&self) -> usize {
        match self {
            Self::Plain { bits } => *bits,
            Self::Hamming7x4 => 7,
            Self::Bch15x7 | Self::Bch15x5 => 15,
        }
    }

    /// Number of bits of a message.
    pub fn message_bits(&self) -> usize {
        match self {
            Self::Plain { bits } => *bits,
            Self::Hamming7x4 => 4,
            Self::Bch15x7 => 7,
            Self::Bch15x5 => 5,
        }
    }

    /// Generator polynomial (Lin and Costello, "Error Control Coding", 2nd ed., table 6.4), highest power
    /// first.
    fn generator(&self) -> u32 {
        match self {
            Self::Plain { .. } => 1,
            Self::Hamming7x4 => 0b1011,
            Self::Bch15x7 => 0b1_1101_0001,
            Self::Bch15x5 => 0b101_0011_0111,
        }
    }

    /// Coset leader that is added to every word. The words of a cyclic code are rotations of each other, and
    /// a marker lost beside the gap between words would turn one into another. Rotations of these words
    /// differ from every word in at least this many bits: 1, 2 and 4 (the most that any such coset reaches,
    /// by trial of all).
    fn coset(&self) -> u32 {
        match self {
            Self::Plain { .. } => 0,
            Self::Hamming7x4 => 0b1,
            Self::Bch15x7 => 0b11,
            Self::Bch15x5 => 0b101_1101,
        }
    }

    /// Encodes a message systematically: the message bits come first.
    ///
    /// # Errors
    /// Returns an error if the message is too large for the code.
    pub fn encode(&self, message: u32) -> Result<Vec<bool>, LaneError> {
        let (n, k) = (self.length(), self.message_bits());
        if !(1..=15).contains(&n) || message >> k != 0 {
            return Err(bad_message());
        }
        let mut rest = message << (n - k);
        for bit in (n - k..n).rev() {
            if rest >> bit & 1 == 1 {
                rest ^= self.generator() << (bit - (n - k));
            }
        }
        let word = (message << (n - k) | if k == n { 0 } else { rest }) ^ self.coset();
        Ok((0..n).rev().map(|i| word >> i & 1 == 1).collect())
    }
}

impl Zone {
    /// The message for [`Code::Bch15x7`].
    ///
    /// # Errors
    /// Returns an error if the value is outside its range.
    pub fn message(&self) -> Result<u32, LaneError> {
        let (kind, value, low) = match self {
            Self::SpeedLimit { tens_kmh } => (0, *tens_kmh, 1),
            // The value 15 of the tunnel is its end.
            Self::TunnelAhead { tens_m: 15 } => {
                return Err(bad_message());
            }
            Self::TunnelAhead { tens_m } => (1, *tens_m, 0),
            Self::TunnelEnd => (1, 15, 0),
            Self::SharpBendLeft { tens_m } => (2, *tens_m, 1),
            Self::SharpBendRight { tens_m } => (3, *tens_m, 1),
            Self::CrossingAhead { tens_m } => (4, *tens_m, 0),
            Self::Place { number } => (5, *number, 0),
            Self::Line { solid, yellow } => (6, u8::from(*solid) << 1 | u8::from(*yellow), 0),
        };
        if value > 15 || value < low {
            return Err(bad_message());
        }
        Ok(kind << 4 | u32::from(value))
    }

    /// Decodes a message; None for one that has no meaning.
    pub fn from_message(message: u32) -> Option<Self> {
        let v = (message & 15) as u8;
        let out = match message >> 4 {
            0 => Self::SpeedLimit { tens_kmh: v },
            1 if v == 15 => Self::TunnelEnd,
            1 => Self::TunnelAhead { tens_m: v },
            2 => Self::SharpBendLeft { tens_m: v },
            3 => Self::SharpBendRight { tens_m: v },
            4 => Self::CrossingAhead { tens_m: v },
            5 => Self::Place { number: v },
            6 if v < 4 => Self::Line { solid: v & 2 != 0, yellow: v & 1 != 0 },
            _ => return None,
        };
        (out.message() == Ok(message)).then_some(out)
    }
}

/// One period of a row: (s, t) of its markers, and its length.
#[derive(Debug, Clone, PartialEq)]
struct Pattern {
    places: Vec<(f64, f64)>,
    period_m: f64,
}

impl Alphabet {
    fn check(&self) -> Result<(), LaneError> {
        let is_gap = |x: f64| x.is_finite() && x > 0.0 && x < 1e6;
        match *self {
            Self::Gaps { zero_m, one_m, sync_m } => error::settings(&[
                ("zero_m", is_gap(zero_m)),
                ("one_m", is_gap(one_m) && one_m != zero_m),
                ("sync_m", sync_m.is_none_or(|s| is_gap(s) && s != zero_m && s != one_m)),
            ]),
            Self::Sides { pitch_m, side_m, sync_m } => error::settings(&[
                ("pitch_m", is_gap(pitch_m)),
                ("side_m", is_gap(side_m)),
                ("sync_m", sync_m.is_none_or(|s| is_gap(s) && s != pitch_m)),
            ]),
        }
    }

    fn has_sync(&self) -> bool {
        matches!(self, Self::Gaps { sync_m: Some(_), .. } | Self::Sides { sync_m: Some(_), .. })
    }

    fn pattern(&self, word: &[bool]) -> Pattern {
        let mut s = 0.0;
        let mut places = Vec::new();
        match *self {
            Self::Gaps { zero_m, one_m, sync_m } => {
                for bit in word {
                    places.push((s, 0.0));
                    s += if *bit { one_m } else { zero_m };
                }
                if let Some(sync) = sync_m {
                    places.push((s, 0.0));
                    s += sync;
                }
            }
            Self::Sides { pitch_m, side_m, sync_m } => {
                for (i, bit) in word.iter().enumerate() {
                    places.push((s, if *bit { side_m } else { -side_m }));
                    s += if i + 1 == word.len() { sync_m.unwrap_or(pitch_m) } else { pitch_m };
                }
            }
        }
        Pattern { places, period_m: s }
    }

    /// Length of a word including the gap behind it, m.
    pub fn period_m(&self, word: &[bool]) -> f64 {
        self.pattern(word).period_m
    }

    /// Positions (s, t) of the markers that repeat a word between two places of a row, the first at `from_m`,
    /// m; at most 100 000.
    ///
    /// # Errors
    /// Returns an error if `word` is invalid, if places or spacings are non-finite or out of order, or if
    /// there are too many markers.
    pub fn markers(&self, word: &[bool], from_m: f64, to_m: f64) -> Result<Vec<(f64, f64)>, LaneError> {
        self.check()?;
        if word.is_empty() || !from_m.is_finite() || !to_m.is_finite() {
            return Err(bad_message());
        }
        let pattern = self.pattern(word);
        let count = ((to_m - from_m) / pattern.period_m + 1.0).max(0.0) * pattern.places.len() as f64;
        if count > 1e5 {
            return Err(LaneError::too_large(count as usize, 100_000));
        }
        let mut out = Vec::new();
        let mut turn = 0.0;
        while from_m + turn * pattern.period_m <= to_m + 1e-9 {
            let base = from_m + turn * pattern.period_m;
            out.extend(pattern.places.iter().map(|(s, t)| (base + s, *t)).filter(|p| p.0 <= to_m + 1e-9));
            turn += 1.0;
        }
        Ok(out)
    }
}

/// Reads the words of one code and alphabet.
#[derive(Debug, Clone, PartialEq)]
pub struct Reader {
    settings: ReadSettings,
    has_sides: bool,
    is_up_to_rotation: bool,
    words: Vec<(u32, Vec<bool>, Pattern)>,
    side_m: f64,
}

/// (point, marker counted through the turns of the pattern).
type Alignment = Vec<(usize, i64)>;

#[derive(Clone, Copy)]
struct Node {
    score: f64,
    /// Point and steps of markers back; none at the first match.
    from: Option<(usize, usize)>,
}

struct Aligned {
    begin_m: f64,
    log_likelihood: f64,
    matched: usize,
    missing: usize,
}

impl Reader {
    /// Makes a reader of one code in one alphabet.
    ///
    /// # Errors
    /// Returns an error for a code, alphabet or setting outside its range.
    pub fn new(code: Code, alphabet: Alphabet, settings: ReadSettings) -> Result<Self, LaneError> {
        alphabet.check()?;
        let s = &settings;
        let rules: [(&'static str, bool); 6] = [
            ("detection_probability", s.detection_probability > 0.0 && s.detection_probability < 1.0),
            ("extra_per_m", s.extra_per_m.is_finite() && s.extra_per_m > 0.0),
            ("scale_std", s.scale_std.is_finite() && s.scale_std >= 0.0 && s.scale_std < 0.5),
            ("most_missing", s.most_missing <= 20),
            ("sure_log_odds", s.sure_log_odds.is_finite()),
            ("bits", !matches!(code, Code::Plain { bits } if !(1..=12).contains(&bits))),
        ];
        error::settings(&rules)?;
        let is_up_to_rotation = !alphabet.has_sync();
        let mut words = Vec::new();
        for message in 0..1u32 << code.message_bits() {
            let word = code.encode(message)?;
            // Of words that look alike, the first in order.
            let n = word.len();
            let is_least = (1..n).all(|k| {
                let rotated = (0..n).map(|i| word[(i + k) % n]);
                word.iter().copied().le(rotated)
            });
            if !is_up_to_rotation || is_least {
                let pattern = alphabet.pattern(&word);
                words.push((message, word, pattern));
            }
        }
        let side_m = if let Alphabet::Sides { side_m, .. } = alphabet { side_m } else { 0.0 };
        Ok(Self { settings, has_sides: side_m > 0.0, is_up_to_rotation, words, side_m })
    }

    /// Number of words that can be distinguished.
    pub fn words(&self) -> usize {
        self.words.len()
    }

    /// Reads the word of a row from one or more looks at it, each with its own origin of s. Points that are
    /// non-finite or have no standard deviation are left out.
    ///
    /// # Errors
    /// Returns an error for too few or too many usable points, or if no word explains half of them.
    pub fn read(&self, looks: &[Vec<RowPoint>]) -> Result<Reading, LaneError> {
        const NEEDED: usize = 4;
        const MOST: usize = 500;
        let is_good = |p: &&RowPoint| {
            p.s_m.is_finite()
                && p.s_m.abs() < 1e7
                && p.s_std_m.is_finite()
                && p.s_std_m > 1e-6
                && (!self.has_sides || (p.t_m.is_finite() && p.t_std_m.is_finite() && p.t_std_m > 1e-6))
        };
        let mut sorted: Vec<Vec<RowPoint>> = Vec::new();
        for look in looks {
            let mut points: Vec<RowPoint> = look.iter().filter(is_good).copied().collect();
            if points.len() > MOST {
                return Err(LaneError::too_large(points.len(), MOST));
            }
            points.sort_by(|a, b| a.s_m.total_cmp(&b.s_m));
            sorted.push(points);
        }
        let all: usize = sorted.iter().map(Vec::len).sum();
        if all < NEEDED {
            return Err(LaneError::too_few("usable points", all, NEEDED));
        }
        let mut results: Vec<(f64, usize, bool, usize, usize)> = Vec::new();
        let directions: &[bool] = if self.settings.either_direction { &[false, true] } else { &[false] };
        for reversed in directions {
            if *reversed {
                for look in &mut sorted {
                    look.reverse();
                    for p in look {
                        (p.s_m, p.t_m) = (-p.s_m, -p.t_m);
                    }
                }
            }
            for (i, (_, _, pattern)) in self.words.iter().enumerate() {
                let mut sum = (0.0, 0, 0);
                for points in sorted.iter().filter(|p| !p.is_empty()) {
                    let a = self.aligned(points, pattern);
                    sum = (sum.0 + a.log_likelihood, sum.1 + a.matched, sum.2 + a.missing);
                }
                results.push((sum.0, i, *reversed, sum.1, sum.2));
            }
        }
        results.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let best = results[0];
        if 2 * best.3 < all {
            return Err(LaneError::Unexplained {
                best: "codeword",
                explained: best.3 as f64,
                of: all,
                what: "points",
            });
        }
        let pattern = &self.words[best.1].2;
        let begin_m = sorted
            .iter()
            .map(|look| {
                // The last direction tried is that in which the points stand.
                let turned: Vec<RowPoint> = match best.2 == (directions.len() == 2) {
                    true => look.clone(),
                    false => look.iter().rev().map(|p| RowPoint { s_m: -p.s_m, t_m: -p.t_m, ..*p }).collect(),
                };
                (!turned.is_empty()).then(|| self.aligned(&turned, pattern).begin_m)
            })
            .collect();
        // The same word read the other way (a palindrome) is no other word.
        let others = results.iter().filter(|r| r.1 != best.1);
        let weight: f64 = others.clone().map(|r| (r.0 - best.0).exp()).sum();
        let log_odds = -weight.max(1e-300).ln();
        Ok(Reading {
            message: self.words[best.1].0,
            word: self.words[best.1].1.clone(),
            log_odds,
            sure: log_odds >= self.settings.sure_log_odds,
            runner_up: others.clone().next().map(|r| self.words[r.1].0),
            reversed: best.2,
            up_to_rotation: self.is_up_to_rotation,
            matched: best.3,
            missing: best.4,
            extra: all - best.3,
            begin_m,
        })
    }

    /// Log-likelihood of the position beside the line, for a marker or an extra point.
    fn side(&self, p: &RowPoint, t: f64) -> f64 {
        let e = (p.t_m - t) / p.t_std_m;
        -0.5 * e * e - 0.5 * TAU.ln() - p.t_std_m.ln()
    }

    /// An extra point lies anywhere within twice the sides.
    fn extra(&self) -> f64 {
        let density = if self.has_sides {
            self.settings.extra_per_m / (4.0 * self.side_m)
        } else {
            self.settings.extra_per_m
        };
        density.ln()
    }

    /// The best path through (point, marker): from a match to a later one, over extra points and missing
    /// markers.
    fn aligned(&self, points: &[RowPoint], pattern: &Pattern) -> Aligned {
        const MOST_EXTRA: usize = 4;
        let s = &self.settings;
        let (m, n) = (pattern.places.len(), points.len());
        let (hit, miss) = (s.detection_probability.ln(), (1.0 - s.detection_probability).ln());
        let extra = self.extra();
        let first = hit + (m as f64 / pattern.period_m).ln();
        let mut nodes = vec![Node { score: f64::NEG_INFINITY, from: None }; n * m];
        let mut end = (f64::NEG_INFINITY, 0, 0);
        for i in 0..n {
            for j in 0..m {
                let (place, t) = pattern.places[j];
                let side = if self.has_sides { self.side(&points[i], t) } else { 0.0 };
                let mut best = Node { score: i as f64 * extra + first, from: None };
                for back in 1..=(MOST_EXTRA + 1).min(i) {
                    let q = &points[i - back];
                    let distance = points[i].s_m - q.s_m;
                    let var =
                        points[i].s_std_m.powi(2) + q.s_std_m.powi(2) + (s.scale_std * distance).powi(2);
                    let reach = 5.0 * var.sqrt();
                    for steps in 1..=s.most_missing + 1 {
                        let (turns, k) = before(j, steps, m);
                        let gap = place - pattern.places[k].0 + turns as f64 * pattern.period_m;
                        let e = distance - gap;
                        if e < -reach {
                            break;
                        }
                        if e > reach {
                            continue;
                        }
                        let score = nodes[(i - back) * m + k].score
                            + (back - 1) as f64 * extra
                            + (steps - 1) as f64 * miss
                            + hit
                            - 0.5 * (e * e / var + (TAU * var).ln());
                        if score > best.score {
                            best = Node { score, from: Some((back, steps)) };
                        }
                    }
                }
                best.score += side;
                nodes[i * m + j] = best;
                let whole = best.score + (n - 1 - i) as f64 * extra;
                if whole > end.0 {
                    end = (whole, i, j);
                }
            }
        }
        let mut path: Alignment = Vec::new();
        let (mut i, mut j, mut turn, mut missing) = (end.1, end.2, 0i64, 0);
        loop {
            path.push((i, turn * m as i64 + j as i64));
            let Some((back, steps)) = nodes[i * m + j].from else { break };
            let (turns, k) = before(j, steps, m);
            (i, j, turn) = (i - back, k, turn - turns as i64);
            missing += steps - 1;
        }
        let matched = path.len();
        let log_likelihood = (n - matched) as f64 * extra
            + missing as f64 * miss
            + (matched - 1) as f64 * hit
            + first
            + self.joint(points, pattern, &path);
        let begin = |(i, k): &(usize, i64)| {
            let (place, _) = pattern.places[k.rem_euclid(m as i64) as usize];
            points[*i].s_m - place - k.div_euclid(m as i64) as f64 * pattern.period_m
        };
        let begin_m = path.iter().map(begin).sum::<f64>() / matched as f64;
        Aligned { begin_m, log_likelihood, matched, missing }
    }

    /// Log-likelihood of the matched points jointly. The path takes each distance by itself; here the error
    /// of a point, which enters the distances on both sides, counts once. Origin and scale are fitted, the
    /// scale with its prior.
    fn joint(&self, points: &[RowPoint], pattern: &Pattern, path: &Alignment) -> f64 {
        let m = pattern.places.len() as i64;
        let mut sum = 0.0;
        let rows: Vec<(f64, f64, f64)> = path
            .iter()
            .map(|(i, k)| {
                let (place, t) = pattern.places[k.rem_euclid(m) as usize];
                let at = place + k.div_euclid(m) as f64 * pattern.period_m;
                let p = &points[*i];
                if self.has_sides {
                    sum += self.side(p, t);
                }
                (at, p.s_m - at, p.s_std_m.powi(-2))
            })
            .collect();
        let weight: f64 = rows.iter().map(|r| r.2).sum();
        let centre = rows.iter().map(|r| r.2 * r.0).sum::<f64>() / weight;
        let mean = rows.iter().map(|r| r.2 * r.1).sum::<f64>() / weight;
        let (mut chi2, mut cross, mut spread) = (0.0, 0.0, 0.0);
        for (at, e, w) in &rows {
            let (a, b) = (at - centre, e - mean);
            chi2 += w * b * b;
            cross += w * a * b;
            spread += w * a * a;
        }
        if self.settings.scale_std > 0.0 {
            let prior = self.settings.scale_std.powi(-2);
            chi2 -= cross * cross / (spread + prior);
            sum -= 0.5 * (1.0 + spread / prior).ln();
        }
        let n = rows.len() as f64;
        // The origin has no prior: one point less tells of the word.
        sum - 0.5 * chi2 + 0.5 * rows.iter().map(|r| r.2.ln()).sum::<f64>()
            - 0.5 * weight.ln()
            - 0.5 * (n - 1.0) * TAU.ln()
    }
}

/// The marker `steps` before `j` of `m`: how many turns of the pattern back, and which.
fn before(j: usize, steps: usize, m: usize) -> (usize, usize) {
    let k = j as i64 - steps as i64;
    ((-k.div_euclid(m as i64)).max(0) as usize, k.rem_euclid(m as i64) as usize)
}

#[cfg(test)]
#[path = "tests/codewords.rs"]
mod tests;
