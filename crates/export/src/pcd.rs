//! nuScenes radar point clouds: PCD v0.7, binary, 18 fields in 43 bytes a point, as `RadarPointCloud.from_file` of nuscenes-devkit
//! reads them. One file a sweep, `RADAR/frame_000000.pcd`, and `manifest.json` with time and poses of each in the terms of
//! nuScenes' `ego_pose` and `calibrated_sensor` tables.
//!
//! Points are in the sensor's axes (x forward, y left, z up). A radar measures radial velocity, so `vx`, `vy` are the components of
//! the range rate along the point's azimuth (positive receding), `vx_comp`, `vy_comp` those of the range rate over the ground.
//!
//! | field | value |
//! |---|---|
//! | `dyn_prop` | 0 moving away, 2 moving towards the radar, 1 stationary, 4 unknown |
//! | `id` | number of the point in the sweep |
//! | `is_quality_valid`, `ambig_state`, `invalid_state` | 1, 3 (unambiguous), 0 (valid): what the reader keeps |
//! | `x_rms` `y_rms` `vx_rms` `vy_rms` | [`rms_code`] of the standard deviation |
//! | `pdh0` | probability of an artefact by multipath: 7 (up to 100 %) for ghosts, else 1 (below 25 %) |

use super::{Exporter, Finished, Order, Sweep, SweepPoint};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::Pose;
use catseye::formats::stage::{MANIFEST, StagedDir};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

const FIELDS: &str = "x y z dyn_prop id rcs vx vy vx_comp vy_comp is_quality_valid ambig_state x_rms y_rms invalid_state pdh0 vx_rms vy_rms";
const SIZES: &str = "4 4 4 1 2 4 4 4 4 4 1 1 1 1 1 1 1 1";
const TYPES: &str = "F F F I I F F F F F I I I I I I I I";
/// Bytes of a point.
pub const POINT_BYTES: usize = 43;

const MOVING: i8 = 0;
const STATIONARY: i8 = 1;
const ONCOMING: i8 = 2;
const UNKNOWN: i8 = 4;
const QUALITY_VALID: i8 = 1;
const UNAMBIGUOUS: i8 = 3;
const VALID: i8 = 0;
const UNLIKELY_ARTEFACT: i8 = 1;
const ARTEFACT: i8 = 7;

/// Upper bounds of the codes 0 to 30 of a standard deviation, m or m/s (Continental ARS 408, technical documentation, signals
/// `Cluster_DistLong_rms` and `Cluster_VrelLong_rms`). The radars of nuScenes are of this kind.
const RMS_BOUNDS: [f64; 31] = [
    0.005, 0.006, 0.008, 0.011, 0.014, 0.018, 0.023, 0.029, 0.038, 0.049, 0.063, 0.081, 0.105, 0.135, 0.174,
    0.224, 0.288, 0.371, 0.478, 0.616, 0.794, 1.023, 1.317, 1.697, 2.187, 2.817, 3.630, 4.676, 6.025, 7.762,
    10.0,
];
/// The code of a deviation that is larger, or not known.
const RMS_INVALID: i8 = 31;

/// Code of a standard deviation in m or m/s: the first of the radar's bounds that it stays below; 31 for none.
pub fn rms_code(std: Option<f64>) -> i8 {
    let code = std.and_then(|s| RMS_BOUNDS.iter().position(|bound| s < *bound));
    code.map_or(RMS_INVALID, |i| i as i8)
}

/// The bytes of a file. A sweep without points has one of NaN, which is how the reader knows it.
///
/// # Errors
/// Returns the errors of [`Sweep::check`], and `BadInput` for more points than the field `id` can number.
pub fn bytes(sweep: &Sweep) -> Result<Vec<u8>> {
    sweep.check()?;
    if sweep.points.len() > i16::MAX as usize + 1 {
        return Err(BadInput::new(format!(
            "frame {} has more points than a PCD file can number",
            sweep.frame
        ))
        .key("points")
        .value(sweep.points.len())
        .allowed("up to 32768")
        .into());
    }
    let count = sweep.points.len().max(1);
    let mut header = String::from("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n");
    let ones = ["1"; 18].join(" ");
    let _ = write!(
        header,
        "FIELDS {FIELDS}\nSIZE {SIZES}\nTYPE {TYPES}\nCOUNT {ones}\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n\
         POINTS {count}\nDATA binary\n"
    );
    let mut out = header.into_bytes();
    for (i, p) in sweep.points.iter().enumerate() {
        push_point(&mut out, sweep, i, p);
    }
    if sweep.points.is_empty() {
        for size in SIZES.split(' ') {
            match size {
                "4" => out.extend_from_slice(&f32::NAN.to_le_bytes()),
                "2" => out.extend_from_slice(&[0; 2]),
                _ => out.push(0),
            }
        }
    }
    // The reader wants to see that the last point is not cut off.
    out.push(b'\n');
    Ok(out)
}

fn push_point(out: &mut Vec<u8>, sweep: &Sweep, index: usize, p: &SweepPoint) {
    let over_ground = sweep.range_rate_over_ground_mps(p);
    let (sin, cos) = p.azimuth_rad.sin_cos();
    let [x_std, y_std] = p.horizontal_std_m();
    let dyn_prop = match p.moving {
        Some(true) if over_ground < 0.0 => ONCOMING,
        Some(true) => MOVING,
        Some(false) => STATIONARY,
        None => UNKNOWN,
    };
    let float = |x: f64| (x as f32).to_le_bytes();
    for x in p.position_m.to_array() {
        out.extend_from_slice(&float(x));
    }
    out.push(dyn_prop as u8);
    out.extend_from_slice(&(index as i16).to_le_bytes());
    out.extend_from_slice(&float(p.rcs_dbsm));
    for rate in [p.range_rate_mps, over_ground] {
        out.extend_from_slice(&float(rate * cos));
        out.extend_from_slice(&float(rate * sin));
    }
    let rate_code = rms_code(Some(p.range_rate_std_mps));
    let artefact = if p.ghost { ARTEFACT } else { UNLIKELY_ARTEFACT };
    for code in
        [QUALITY_VALID, UNAMBIGUOUS, rms_code(x_std), rms_code(y_std), VALID, artefact, rate_code, rate_code]
    {
        out.push(code as u8);
    }
}

/// A folder of point clouds.
pub struct Clouds {
    staged: StagedDir,
    order: Order,
    /// Entries of the manifest.
    files: Vec<Value>,
    points: usize,
    empty: usize,
}

impl Clouds {
    /// Begins a folder of clouds.
    ///
    /// # Errors
    /// Returns `BadInput` if the folder already exists and `force` is not given ([`StagedDir::new`]).
    pub fn create(folder: &Path, force: bool) -> Result<Clouds> {
        let staged = StagedDir::new(folder, force, "pcd")?;
        Ok(Clouds { staged, order: Order::default(), files: Vec::new(), points: 0, empty: 0 })
    }
}

/// Translation and rotation (w, x, y, z) as nuScenes writes them.
fn pose_record<A, B>(pose: &Pose<A, B>) -> Value {
    let q = pose.rotation;
    json!({ "translation": pose.translation_m.to_array(), "rotation": [q.w, q.x, q.y, q.z] })
}

impl Exporter for Clouds {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        self.order.next(sweep)?;
        let bytes = bytes(sweep)?;
        let name = format!("{}/frame_{:06}.pcd", sweep.radar, sweep.frame);
        let path = self.staged.path().join(&name);
        let folder = self.staged.path().join(&sweep.radar);
        std::fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e))?;
        if path.exists() {
            return Err(Error::Failed(format!(
                "frame {} of radar {} occurs twice",
                sweep.frame, sweep.radar
            )));
        }
        std::fs::write(&path, bytes).map_err(|e| Error::io(&path, e))?;
        self.files.push(json!({
            "filename": name,
            "channel": sweep.radar,
            "timestamp": sweep.time_ns.div_euclid(1000),
            "points": sweep.points.len(),
            "calibrated_sensor": pose_record(&sweep.sensor_in_vehicle),
            "ego_pose": pose_record(&sweep.vehicle_in_world),
        }));
        self.points += sweep.points.len();
        self.empty += usize::from(sweep.points.is_empty());
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Finished> {
        let manifest = json!({
            "catseye": env!("CARGO_PKG_VERSION"),
            "format": "nuScenes radar PCD v0.7",
            "about": "timestamp in us; poses: translation in m, rotation w x y z, sensor to vehicle and vehicle to world",
            "sweeps": self.files,
        });
        let text =
            serde_json::to_string_pretty(&manifest).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
        let path = self.staged.path().join(MANIFEST);
        std::fs::write(&path, text + "\n").map_err(|e| Error::io(&path, e))?;
        let notes = match self.empty {
            0 => Vec::new(),
            n => vec![format!(
                "{n} sweeps without points are clouds of one point of NaN, which the reader takes as empty"
            )],
        };
        let sweeps = self.files.len();
        Ok(Finished { output: self.staged.commit()?, sweeps, points: self.points, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn layout() {
        let bits: usize = SIZES.split(' ').map(|s| s.parse::<usize>().unwrap()).sum();
        assert_eq!(bits, POINT_BYTES);
        for list in [FIELDS, SIZES, TYPES] {
            assert_eq!(list.split(' ').count(), 18);
        }
        let sweep = &samples::sweeps()[0];
        let file = bytes(sweep).unwrap();
        let at = file.windows(12).position(|w| w == b"DATA binary\n").unwrap() + 12;
        assert_eq!(file.len() - at, POINT_BYTES * sweep.points.len() + 1);
        assert!(file.starts_with(b"# .PCD v0.7"));
        // The second point: x, dyn_prop, id.
        let point = &file[at + POINT_BYTES..];
        let x = f32::from_le_bytes(point[..4].try_into().unwrap());
        assert_eq!(x, sweep.points[1].position_m.x as f32);
        assert_eq!((point[12], i16::from_le_bytes([point[13], point[14]])), (2, 1));
    }

    #[test]
    fn codes_of_deviations() {
        assert_eq!(rms_code(Some(0.0)), 0);
        assert_eq!(rms_code(Some(0.005)), 1);
        assert_eq!(rms_code(Some(0.3)), 17);
        assert_eq!((rms_code(Some(9.99)), rms_code(Some(10.0)), rms_code(None)), (30, 31, 31));
        assert!(RMS_BOUNDS.is_sorted());
    }

    #[test]
    fn too_many_and_twice() {
        let mut sweep = samples::sweeps()[0].clone();
        sweep.points = vec![sweep.points[0].clone(); 32769];
        assert_eq!(bytes(&sweep).unwrap_err().exit_code(), 2);
        let t = tempfile::tempdir().unwrap();
        let mut clouds = Clouds::create(&t.path().join("out"), false).unwrap();
        let sweep = samples::empty("front", 3, 0);
        clouds.push(&sweep).unwrap();
        assert!(clouds.push(&sweep).unwrap_err().to_string().contains("twice"));
        let done = Box::new(clouds).finish().unwrap();
        assert_eq!((done.sweeps, done.points, done.notes.len()), (1, 0, 1));
        // A second run replaces it only when told.
        assert!(Clouds::create(&t.path().join("out"), false).is_err());
        Clouds::create(&t.path().join("out"), true).unwrap();
    }
}
