//! What TI's mmWave Studio saves beside a capture: `.mmwave.json`, whose structures are those of mmWaveLink
//! (`rlProfileCfg_t` and its kin, mmWave radar interface control document), and `.setup.json`, which names the device and the former.
//! Structures are turned to the commands of a `.cfg` that say the same, so that one reader checks both.

use super::ti_cfg::TiRadar;
use super::ti_commands::Commands;
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use serde_json::Value;
use std::path::Path;

/// Largest size of a configuration, which has some fifty short lines, or of a file of mmWave Studio, bytes.
const MAX_BYTES: u64 = 1 << 20;

impl TiRadar {
    /// Reads a `.cfg`, or what mmWave Studio saves as `.mmwave.json` or `.setup.json`.
    ///
    /// # Errors
    /// Returns `BadInput` with the line for a value that is no number or out of range, a chirp without its
    /// profile, samples beyond the ramp, a frame shorter than its chirps, or a mask of antennas that are off.
    pub fn read(path: impl AsRef<Path>) -> Result<TiRadar> {
        let path = path.as_ref();
        let text = catseye::formats::text::read(path, "a .cfg file or a .mmwave.json", MAX_BYTES)?;
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            return read(path, &text);
        }
        TiRadar::parse(path, &text)
    }
}

/// The radar of a `.mmwave.json` or a `.setup.json`, whose text is `text`.
///
/// # Errors
/// Returns `BadInput` for text that is not JSON of mmWave Studio, for frames other than legacy frames of chirps, for a cascade, for values that
/// are missing, and the errors of the commands.
fn read(file: &Path, text: &str) -> Result<TiRadar> {
    let root = parsed(file, text)?;
    let Some(setup) = root.get("configUsed") else { return of_studio(file, text, &root) };
    // The path is one of the machine that recorded.
    let named = setup.as_str().unwrap_or("");
    let name = named.rsplit(['/', '\\']).next().filter(|n| !n.is_empty());
    let name = name
        .ok_or_else(|| BadInput::new("names no configuration").file(file).key("configUsed").value(named))?;
    let beside = file.with_file_name(name);
    let text = catseye::formats::text::read(&beside, "a .mmwave.json", MAX_BYTES).map_err(|e| match e {
        Error::Input(b) if b.remedy.is_none() || !beside.exists() => {
            b.remedy(format!("put the file that configUsed of {} names beside it", file.display())).into()
        }
        e => e,
    })?;
    let mut radar = of_studio(&beside, &text, &parsed(&beside, &text)?)?;
    radar.device = root.get("mmWaveDevice").and_then(Value::as_str).map(str::to_string);
    Ok(radar)
}

fn parsed(file: &Path, text: &str) -> Result<Value> {
    serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| {
        BadInput::new(format!("is not JSON: {}", json_in_words(&e))).file(file).line(e.line()).into()
    })
}

/// A structure of the file and the line in which it begins.
struct Structure<'a> {
    file: &'a Path,
    name: &'static str,
    line: usize,
    value: &'a Value,
}

impl Structure<'_> {
    fn bad(&self, key: &str, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(self.file).line(self.line).key(format!("{} {key}", self.name))
    }

    /// A number as a word of a command. Masks are strings as "0xF".
    fn word(&self, key: &str) -> Result<String> {
        let missing = || self.bad(key, "is missing").remedy("give the file as mmWave Studio saved it");
        match self.value.get(key).ok_or_else(missing)? {
            Value::Number(n) => Ok(n.to_string()),
            Value::String(s) => {
                let hex = s.strip_prefix("0x").or_else(|| s.strip_prefix("0X"));
                let number = hex.map_or_else(|| s.parse().ok(), |h| u32::from_str_radix(h, 16).ok());
                let shown: String = s.chars().filter(|c| !c.is_control()).take(40).collect();
                number
                    .map(|n| n.to_string())
                    .ok_or_else(|| self.bad(key, "is not a number").value(shown).into())
            }
            other => Err(self
                .bad(key, "is not a number")
                .value(other.to_string().chars().take(40).collect::<String>())
                .into()),
        }
    }
}

fn of_studio(file: &Path, text: &str, root: &Value) -> Result<TiRadar> {
    let bad = |problem: &str| BadInput::new(problem).file(file);
    let devices = root.get("mmWaveDevices").and_then(Value::as_array);
    let devices = devices.ok_or_else(|| {
        bad("is not a configuration of mmWave Studio: it has no mmWaveDevices")
            .remedy("give the .mmwave.json or the .cfg of the recording")
    })?;
    let [device] = devices.as_slice() else {
        return Err(bad("only captures of one device are supported")
            .key("mmWaveDevices")
            .value(devices.len())
            .allowed("1")
            .remedy("describe the radar in a TOML file and give its samples as .npy with --radar")
            .into());
    };
    let rf = device.get("rfConfig").ok_or_else(|| bad("has no rfConfig").key("mmWaveDevices"))?;
    let waveform = rf.get("waveformType").and_then(Value::as_str).unwrap_or("legacyFrameChirp");
    if waveform != "legacyFrameChirp" {
        return Err(bad("only frames of chirps are supported")
            .key("rfConfig waveformType")
            .value(waveform.chars().take(40).collect::<String>())
            .allowed("legacyFrameChirp")
            .into());
    }
    // Lines of the structures: of each name in the order of the text, which serde keeps within a list.
    let line_of = |name: &str, nth: usize| {
        let quoted = format!("\"{name}\"");
        let at = text.match_indices(&quoted).nth(nth).map_or(0, |(at, _)| at);
        1 + text[..at].bytes().filter(|b| *b == b'\n').count()
    };
    let one = |of: &'_ Value, name: &'static str| -> Result<Value> {
        of.get(name).cloned().ok_or_else(|| {
            bad("is missing").key(name).remedy("give the file as mmWave Studio saved it").into()
        })
    };
    let list = |key: &str, name: &'static str| -> Vec<Value> {
        let all = rf.get(key).and_then(Value::as_array);
        all.into_iter().flatten().filter_map(|v| v.get(name).cloned()).collect()
    };
    let command = |name: &'static str,
                   nth: usize,
                   value: &Value,
                   command: &str,
                   keys: &[&str]|
     -> Result<(usize, String)> {
        let s = Structure { file, name, line: line_of(name, nth), value };
        let words: Vec<String> = keys.iter().map(|k| s.word(k)).collect::<Result<_>>()?;
        Ok((s.line, format!("{command} {}", words.join(" "))))
    };
    let mut commands = vec![command(
        "rlChanCfg_t",
        0,
        &one(rf, "rlChanCfg_t")?,
        "channelCfg",
        &["rxChannelEn", "txChannelEn"],
    )?];
    let format = one(&one(rf, "rlAdcOutCfg_t")?, "fmt")?;
    commands.push(command("rlAdcOutCfg_t", 0, &format, "adcCfg", &["b2AdcBits", "b2AdcOutFmt"])?);
    if let Some(order) = device.get("rawDataCaptureConfig").and_then(|r| r.get("rlDevDataFmtCfg_t")) {
        let is_real = format.get("b2AdcOutFmt").and_then(Value::as_u64) == Some(0);
        let name = format!("adcbufCfg -1 {}", u8::from(is_real));
        let (line, words) = command("rlDevDataFmtCfg_t", 0, order, &name, &["iqSwapSel", "chInterleave"])?;
        commands.push((line, words + " 1"));
    }
    let profile = [
        "profileId",
        "startFreqConst_GHz",
        "idleTimeConst_usec",
        "adcStartTimeConst_usec",
        "rampEndTime_usec",
        "txOutPowerBackoffCode",
        "txPhaseShifter",
        "freqSlopeConst_MHz_usec",
        "txStartTime_usec",
        "numAdcSamples",
        "digOutSampleRate",
        "hpfCornerFreq1",
        "hpfCornerFreq2",
        "rxGain_dB",
    ];
    for (i, p) in list("rlProfiles", "rlProfileCfg_t").iter().enumerate() {
        commands.push(command("rlProfileCfg_t", i, p, "profileCfg", &profile)?);
    }
    let chirp = [
        "chirpStartIdx",
        "chirpEndIdx",
        "profileId",
        "startFreqVar_MHz",
        "freqSlopeVar_KHz_usec",
        "idleTimeVar_usec",
        "adcStartTimeVar_usec",
        "txEnable",
    ];
    for (i, c) in list("rlChirps", "rlChirpCfg_t").iter().enumerate() {
        let (line, words) = command("rlChirpCfg_t", i, c, "chirpCfg", &chirp)?;
        // The start varies in MHz here, and in Hz there.
        let words = words.split(' ').enumerate();
        let words: Vec<String> =
            words.map(|(i, w)| if i == 4 { format!("{w}e6") } else { w.into() }).collect();
        commands.push((line, words.join(" ")));
    }
    let frame = ["chirpStartIdx", "chirpEndIdx", "numLoops", "numFrames", "framePeriodicity_msec"];
    commands.push(command("rlFrameCfg_t", 0, &one(rf, "rlFrameCfg_t")?, "frameCfg", &frame)?);
    for (key, name, value) in
        [("rlBpmChirps", "rlBpmChirpCfg_t", "constBpmVal"), ("rlRfPhaseShiftCfgs", "rlRfPhaseShiftCfg_t", "")]
    {
        let used = list(key, name).iter().position(|b| match value {
            "" => true,
            v => !matches!(
                b.get(v).map(Value::to_string).as_deref(),
                None | Some("0" | "\"0x0\"" | "\"0x00\"")
            ),
        });
        if let Some(nth) = used {
            return Err(bad("phases that change from chirp to chirp are not supported")
                .line(line_of(name, nth))
                .key(key)
                .allowed("an empty list")
                .remedy("describe the radar in a TOML file and give its samples as .npy with --radar")
                .into());
        }
    }
    Commands::parse(file, commands.iter().map(|(line, c)| (*line, c.as_str())))?.radar()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ti_cfg::Board;

    /// As mmWave Studio 2 saves an xWR6843 with TX1 and TX3 in turn.
    pub const STUDIO: &str = r#"{
  "configGenerator": {"createdBy": "mmWaveStudio", "isConfigIntermediate": 1},
  "mmWaveDevices": [{
    "mmWaveDeviceId": 0,
    "rfConfig": {
      "waveformType": "legacyFrameChirp",
      "MIMOScheme": "TDM",
      "rlChanCfg_t": {"rxChannelEn": "0xF", "txChannelEn": "0x5", "cascading": 0, "cascadingPinoutCfg": "0x0"},
      "rlAdcOutCfg_t": {"fmt": {"b2AdcBits": 2, "b8FullScaleReducFctr": 0, "b2AdcOutFmt": 1}},
      "rlProfiles": [
        {"rlProfileCfg_t": {"profileId": 0, "pfVcoSelect": "0x0", "startFreqConst_GHz": 60.25, "idleTimeConst_usec": 100.0,
          "adcStartTimeConst_usec": 6.0, "rampEndTime_usec": 60.0, "txOutPowerBackoffCode": "0x0", "txPhaseShifter": "0x0",
          "freqSlopeConst_MHz_usec": 29.982, "txStartTime_usec": 0.0, "numAdcSamples": 256, "digOutSampleRate": 10000.0,
          "hpfCornerFreq1": 0, "hpfCornerFreq2": 0, "rxGain_dB": "0x1E"}}
      ],
      "rlChirps": [
        {"rlChirpCfg_t": {"chirpStartIdx": 0, "chirpEndIdx": 0, "profileId": 0, "startFreqVar_MHz": 0.5, "freqSlopeVar_KHz_usec": 0.0,
          "idleTimeVar_usec": 0.0, "adcStartTimeVar_usec": 0.0, "txEnable": "0x4"}},
        {"rlChirpCfg_t": {"chirpStartIdx": 1, "chirpEndIdx": 1, "profileId": 0, "startFreqVar_MHz": 0.5, "freqSlopeVar_KHz_usec": 0.0,
          "idleTimeVar_usec": 0.0, "adcStartTimeVar_usec": 0.0, "txEnable": "0x1"}}
      ],
      "rlFrameCfg_t": {"chirpEndIdx": 1, "chirpStartIdx": 0, "numLoops": 128, "numFrames": 8, "framePeriodicity_msec": 50.0,
        "triggerSelect": 1, "frameTriggerDelay": 0.0},
      "rlBpmChirps": [], "rlRfPhaseShiftCfgs": []
    },
    "rawDataCaptureConfig": {"rlDevDataFmtCfg_t": {"iqSwapSel": 0, "chInterleave": 1}, "rlDevLaneEnable_t": {"laneEn": "0x3"}}
  }]
}"#;

    fn message(text: &str) -> String {
        let e = read(Path::new("a.mmwave.json"), text).unwrap_err();
        let s = e.to_string();
        assert!(e.exit_code() == 2 && s.starts_with("a.mmwave.json") && s.lines().count() == 1, "{s}");
        s
    }

    #[test]
    fn structures_are_the_commands_of_a_cfg() {
        let studio = read(Path::new("a.mmwave.json"), STUDIO).unwrap();
        let cfg = "channelCfg 15 5 0\nadcCfg 2 1\nadcbufCfg -1 0 0 1 1\n\
            profileCfg 0 60.25 100 6 60 0 0 29.982 0 256 10000 0 0 30\n\
            chirpCfg 0 0 0 500000 0 0 0 4\nchirpCfg 1 1 0 500000 0 0 0 1\nframeCfg 0 1 128 8 50 1 0\n";
        assert_eq!(studio, TiRadar::parse("a.cfg", cfg).unwrap());
        assert_eq!((studio.start_hz, studio.tx_masks.as_slice()), (60.2505e9, &[4, 1][..]));
        // A byte-order mark, and CR before LF.
        let windows = format!("\u{feff}{}", STUDIO.replace('\n', "\r\n"));
        assert_eq!(read(Path::new("a.mmwave.json"), &windows).unwrap(), studio);
    }

    #[test]
    fn a_setup_names_the_device_and_the_configuration() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("x.mmwave.json"), STUDIO).unwrap();
        let setup = dir.path().join("x.setup.json");
        let text = r#"{"mmWaveDevice": "iwr6843", "configUsed": "C:\\ti\\JSON\\x.mmwave.json"}"#;
        std::fs::write(&setup, text).unwrap();
        let radar = TiRadar::read(&setup).unwrap();
        assert_eq!((radar.device.as_deref(), Board::assumed(&radar)), (Some("iwr6843"), Board::Iwr6843));
        std::fs::write(&setup, text.replace("x.mmwave", "y.mmwave")).unwrap();
        let e = TiRadar::read(&setup).unwrap_err().to_string();
        assert!(e.contains("y.mmwave.json") && e.contains("configUsed"), "{e}");
    }

    #[test]
    fn what_is_not_read_is_said() {
        for (from, to, part) in [
            ("legacyFrameChirp", "advancedFrameChirp", "waveformType = advancedFrameChirp"),
            ("\"numLoops\": 128, ", "", "rlFrameCfg_t numLoops: is missing"),
            (
                "\"numAdcSamples\": 256",
                "\"numAdcSamples\": \"many\"",
                ":11: rlProfileCfg_t numAdcSamples = many: is not a number",
            ),
            (
                "\"rlBpmChirps\": []",
                "\"rlBpmChirps\": [{\"rlBpmChirpCfg_t\": {\"constBpmVal\": \"0x3\"}}]",
                "change from chirp to chirp",
            ),
            ("\"txEnable\": \"0x1\"", "\"txEnable\": \"0x2\"", ":19: chirpCfg tx_mask = 2"),
            ("\"mmWaveDevices\": [{", "\"mmWaveDevices\": [{}, {", "only captures of one device"),
            ("mmWaveDevices", "devices", "not a configuration of mmWave Studio"),
            ("legacyFrameChirp\",", "legacyFrameChirp\"", ":7: is not JSON"),
        ] {
            let e = message(&STUDIO.replace(from, to));
            assert!(e.contains(part), "{e}");
        }
    }
}
