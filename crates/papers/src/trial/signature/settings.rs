//! The table `[lane.signature]`.

use crate::trial::kit::*;
use catseye_lane::signature::codewords::{Alphabet, Code, ReadSettings};
use catseye_lane::signature::options::least_hits;
use catseye_lane::signature::row::{RowOptions, RowReader};

/// Code of a row of markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CodeName {
    /// The Hamming code of 7 bits, 4 of them data.
    Hamming7x4,
    /// The BCH code of 15 bits, 7 of them data.
    Bch15x7,
    /// The BCH code of 15 bits, 5 of them data.
    Bch15x5,
}

/// Bits encoded in the gaps between markers, one gap for each bit.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GapsTable {
    /// Gap that encodes 0, m.
    pub zero_m: f64,
    /// Gap that encodes 1, m.
    pub one_m: f64,
    /// Gap between two words, m; default no such gap.
    pub sync_m: Option<f64>,
}

/// Bits encoded in markers on either side of the row's line; 1 is on the left.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SidesTable {
    /// Distance from one marker to the next, m.
    pub pitch_m: f64,
    /// Distance of the markers from their line, m.
    pub side_m: f64,
    /// Distance from the last marker of a word to the first of the next, m; default the spacing within a word.
    pub sync_m: Option<f64>,
}

/// A row of markers whose code word is decoded.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RowTable {
    /// Name of the row in the scene.
    pub name: String,
    /// Minimum and maximum lateral position at which the row passes the vehicle, m, positive to the left.
    pub beside_m: [f64; 2],
    /// Error-correcting code of the words.
    pub code: CodeName,
    /// Bits encoded in gaps; alternative to `sides`.
    pub gaps: Option<GapsTable>,
    /// Bits encoded in the side of the row on which a marker is; alternative to `gaps`.
    pub sides: Option<SidesTable>,
    /// True code word in zeros and ones, for scoring only.
    pub word: Option<String>,
}

/// The table `[lane.signature]`: the mapping drive, and the vehicle's knowledge of its own motion.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Number of frames of the mapping drive.
    #[schemars(range(min = 1, max = 10000))]
    pub map_frames: u32,
    /// Time between frames of the mapping drive, s.
    #[schemars(range(min = 1e-3, max = 100.0))]
    pub map_interval_s: f64,
    /// Start of the mapping drive along the ego vehicle's road, m; default the start of the ego vehicle.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub map_s_m: Option<f64>,
    /// Lateral position of the mapping drive in the ego vehicle's lane, m, positive to the left.
    #[schemars(range(min = -20.0, max = 20.0))]
    pub map_offset_m: f64,
    /// Distance by which other vehicles are farther along their roads on the mapping drive, m: different traffic.
    #[schemars(range(min = -1e5, max = 1e5))]
    pub map_traffic_m: f64,
    /// Standard deviation of the mapping drive's position along each axis, m.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub ins_std_m: f64,
    /// Standard deviation of the mapping drive's heading, degrees.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub ins_heading_std_deg: f64,
    /// Correlation time of the mapping drive's errors, s.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub ins_lasting_s: f64,
    /// Standard deviation of the speed on the vehicle bus, m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_std_mps: f64,
    /// Standard deviation of the yaw rate on the vehicle bus, degrees/s.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub yaw_rate_std_deg_per_s: f64,
    /// Maximum random displacement of the start of a run along the road, m.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub vary_start_m: f64,
    /// Maximum random displacement of the start of a run to either side of the ego vehicle's offset, m.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub vary_offset_m: f64,
    /// Standard deviation of the surveyed lane lines, perpendicular to them, m.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub lines_std_m: f64,
    /// Minimum and maximum range of points, m.
    pub range_m: [f64; 2],
    /// Minimum number of scans in which a landmark of the map was detected.
    #[schemars(range(min = 1, max = 1000))]
    pub least_hits: u32,
    /// Maximum distance from the vehicle at which lines are scored, m.
    #[schemars(range(min = 5.0, max = 200.0))]
    pub reach_m: f64,
    /// Share of a row's points that is removed, and share of other points that is added, in readings with
    /// degraded data.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub worse: f64,
    /// Rows of markers whose code words are decoded.
    pub row: Vec<RowTable>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            map_frames: 40,
            map_interval_s: 0.3,
            map_s_m: None,
            map_offset_m: 0.0,
            map_traffic_m: 30.0,
            ins_std_m: 0.03,
            ins_heading_std_deg: 0.05,
            ins_lasting_s: 3.0,
            speed_std_mps: 0.05,
            yaw_rate_std_deg_per_s: 0.2,
            vary_start_m: 0.0,
            vary_offset_m: 0.0,
            lines_std_m: 0.03,
            range_m: [3.0, 40.0],
            least_hits: least_hits(),
            reach_m: 30.0,
            worse: 0.1,
            row: Vec::new(),
        }
    }
}

const NAMES: [&str; 3] = ["hamming7x4", "bch15x7", "bch15x5"];

impl RowTable {
    pub(super) fn code(&self) -> Code {
        match self.code {
            CodeName::Hamming7x4 => Code::Hamming7x4,
            CodeName::Bch15x7 => Code::Bch15x7,
            CodeName::Bch15x5 => Code::Bch15x5,
        }
    }

    pub(super) fn alphabet(&self) -> Option<Alphabet> {
        match (self.gaps, self.sides) {
            (Some(g), None) => Some(Alphabet::Gaps { zero_m: g.zero_m, one_m: g.one_m, sync_m: g.sync_m }),
            (None, Some(s)) => {
                Some(Alphabet::Sides { pitch_m: s.pitch_m, side_m: s.side_m, sync_m: s.sync_m })
            }
            _ => None,
        }
    }

    pub(super) fn options(&self, range_m: [f64; 2]) -> Option<RowOptions> {
        let read = ReadSettings { scale_std: 0.01, ..ReadSettings::default() };
        let far = range_m[1].min(30.0);
        Some(RowOptions {
            read,
            range_m: [range_m[0].min(far - 1.0), far],
            ..RowOptions::new(&self.name, self.beside_m, self.code(), self.alphabet()?)
        })
    }

    /// Bits of the written word, if it is a word of the code.
    pub(super) fn written(&self) -> Option<Vec<bool>> {
        Some(self.word.as_ref()?.chars().map(|c| c == '1').collect())
    }
}

impl Settings {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns an error for a value outside its range, or a row that cannot be read.
    pub fn check(&self) -> Result<()> {
        let s = self;
        limits::check_bounds("signature", s)?;
        limits::check(
            "signature",
            &[
                ("range_m[0]", s.range_m[0], 0.0, 100.0, "as in [3, 40]"),
                ("range_m[1]", s.range_m[1], s.range_m[0] + 1.0, 300.0, "as in [3, 40]"),
            ],
        )?;
        s.row.iter().try_for_each(|row| row.check(s.range_m))
    }
}

impl RowTable {
    fn check(&self, range_m: [f64; 2]) -> Result<()> {
        let bad = |key: &str, value: String, allowed: &str, remedy: &str| -> Result<()> {
            let bad = limits::wrong("signature", &format!("row.{key} of the row \"{}\"", self.name), value);
            Err(bad.allowed(allowed).remedy(remedy).into())
        };
        let Some(options) = self.options(range_m) else {
            let value = format!("{} of the two", usize::from(self.gaps.is_some()) * 2);
            return bad("gaps", value, "one of gaps and sides", "keep one of them");
        };
        if let Err(e) = RowReader::new(options) {
            return bad("code", e.to_string(), "a code that can be read", "change the code of the row");
        }
        let (Some(word), code) = (&self.word, self.code()) else { return Ok(()) };
        let n = code.length();
        let known = word.len() == n && word.chars().all(|c| c == '0' || c == '1');
        let is_word = (0..1u32 << code.message_bits()).any(|m| code.encode(m).ok() == self.written());
        if known && is_word {
            return Ok(());
        }
        let allowed = format!("{n} zeros and ones that are a word of {}", NAMES[self.code as usize]);
        let remedy = format!("its first word is {}", bits(&code.encode(0).unwrap_or_default()));
        bad("word", word.clone(), &allowed, &remedy)
    }
}

pub(super) fn bits(word: &[bool]) -> String {
    word.iter().map(|b| if *b { '1' } else { '0' }).collect()
}
