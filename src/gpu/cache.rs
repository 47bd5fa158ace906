//! Compiled pipelines on disk, so that a later start need not compile them again.
//!
//! 1. A start reads one file of the cache's folder. Its name and its first line hold a digest of the adapter, its driver and the version
//!    of catseye ([`identity`]), so that no other driver or version reads it.
//! 2. The length and the SHA-256 of the contents are checked before the driver sees them. A file that is damaged, foreign or too large
//!    counts as none.
//! 3. Pipelines are made with wgpu's pipeline cache, which takes from the file what the driver compiled before.
//! 4. When pipelines were compiled that the file does not list, it is written anew under a temporary name and renamed. Of several
//!    processes the last one counts.
//!
//! No error of the cache reaches a result: it costs time alone. Shaders in SPIR-V are not cached: writing those of all kernels takes
//! some 50 ms on one core, and a file of words would outlive a change of the code that writes them.

use super::arena::lock;
use super::kernel::Kernel;
use crate::base::error::{Error, Result};
use crate::formats::{input, stage};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Environment variable with the folder of the cache; `off` or nothing turns the cache off.
pub const CACHE_VARIABLE: &str = "CATSEYE_CACHE";
/// First word of a file, and the version of its layout.
const MAGIC: &str = "catseye-pipelines-1";
/// Maximum size of a file, bytes. 33 kernels take a few MB.
const MAX_BYTES: u64 = 256 << 20;

/// Folder of the cache: `CATSEYE_CACHE`, else `catseye` in the platform's folder of caches (`$XDG_CACHE_HOME` or `~/.cache`,
/// `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on Windows). None where the cache is turned off or no such folder is known.
pub fn cache_folder() -> Option<PathBuf> {
    folder_by(|name| std::env::var_os(name))
}

fn folder_by(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(given) = variable(CACHE_VARIABLE) {
        let is_off = given.is_empty() || given.eq_ignore_ascii_case("off");
        return (!is_off).then(|| PathBuf::from(given));
    }
    // A relative path would be another folder in each working directory.
    let absolute = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let caches = if cfg!(windows) {
        absolute("LOCALAPPDATA")?
    } else if cfg!(target_os = "macos") {
        absolute("HOME")?.join("Library/Caches")
    } else {
        absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?
    };
    Some(caches.join("catseye"))
}

/// SHA-256 of all that a compiled pipeline depends on beside its shader: version of catseye, adapter, driver, features of the device.
fn identity(info: &wgpu::AdapterInfo, features: wgpu::Features) -> String {
    let wgpu::AdapterInfo { name, vendor, device, device_type, driver, driver_info, backend, .. } = info;
    let version = env!("CARGO_PKG_VERSION");
    let words = format!(
        "{version}\n{backend:?}\n{vendor:x}\n{device:x}\n{device_type:?}\n{name}\n{driver}\n{driver_info}\n{features:?}"
    );
    stage::sha256_of_bytes(words.as_bytes())
}

/// Contents of a file.
#[derive(Debug, Clone, Default, PartialEq)]
struct Contents {
    /// SHA-256 of the source of each kernel whose pipeline is in `driver`, by stem.
    kernels: BTreeMap<String, String>,
    /// Data of wgpu's pipeline cache.
    driver: Vec<u8>,
}

/// The line of a file after its first: what follows it.
#[derive(Serialize, Deserialize)]
struct Index {
    kernels: BTreeMap<String, String>,
    driver_bytes: usize,
}

impl Contents {
    /// The bytes of a file: a line with magic, identity, length and SHA-256 of the rest; the index as a line of JSON; the driver's data.
    fn to_bytes(&self, identity: &str) -> Result<Vec<u8>> {
        let index = Index { kernels: self.kernels.clone(), driver_bytes: self.driver.len() };
        let mut rest =
            serde_json::to_vec(&index).map_err(|e| Error::Failed(format!("index of the cache: {e}")))?;
        rest.push(b'\n');
        rest.extend(&self.driver);
        let sum = stage::sha256_of_bytes(&rest);
        let mut bytes = format!("{MAGIC} {identity} {} {sum}\n", rest.len()).into_bytes();
        bytes.extend(rest);
        Ok(bytes)
    }

    /// The contents of a file, if it is whole and of this identity.
    fn from_bytes(bytes: &[u8], identity: &str) -> Option<Contents> {
        let (head, rest) = line(bytes)?;
        let expected = format!("{MAGIC} {identity} {} {}", rest.len(), stage::sha256_of_bytes(rest));
        if head != expected.as_bytes() {
            return None;
        }
        let (index, driver) = line(rest)?;
        let Index { kernels, driver_bytes } = serde_json::from_slice(index).ok()?;
        (driver.len() == driver_bytes).then(|| Contents { kernels, driver: driver.to_vec() })
    }

    /// The contents of the file at `path`; none if there is no such file or anything is wrong with it.
    fn read(path: &Path, identity: &str) -> Contents {
        let bytes = input::read(path, "a cache of pipelines", MAX_BYTES).ok();
        bytes.and_then(|bytes| Contents::from_bytes(&bytes, identity)).unwrap_or_default()
    }
}

/// The bytes up to the first end of a line, and those after it.
fn line(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let end = bytes.iter().position(|b| *b == b'\n')?;
    Some((&bytes[..end], &bytes[end + 1..]))
}

/// The cache of an opened device.
pub(super) struct DiskCache {
    pub(super) driver: wgpu::PipelineCache,
    path: PathBuf,
    identity: String,
    listed: Mutex<Listed>,
}

/// Kernels whose pipelines the driver's cache holds.
struct Listed {
    kernels: BTreeMap<String, String>,
    /// Whether the file lacks some of them.
    is_new: bool,
}

impl DiskCache {
    /// Reads the device's file in `folder`. None for an adapter that has no pipeline cache. To be called inside error scopes.
    #[allow(unsafe_code)] // data that come from a file
    pub(super) fn open(device: &wgpu::Device, info: &wgpu::AdapterInfo, folder: &Path) -> Option<DiskCache> {
        if !device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let key = wgpu::util::pipeline_cache_key(info)?;
        let identity = identity(info, device.features());
        let path = folder.join(format!("{key}_{}.bin", &identity[..16]));
        let Contents { mut kernels, driver: data } = Contents::read(&path, &identity);
        let descriptor = wgpu::PipelineCacheDescriptor {
            label: Some("catseye"),
            data: (!data.is_empty()).then_some(&data[..]),
            fallback: true,
        };
        // SAFETY: the data are what `PipelineCache::get_data` gave to `write` of the same version of catseye for the same adapter and
        // driver, whole by their SHA-256; wgpu compares its own header, and without one of these it takes no data.
        let driver = unsafe { device.create_pipeline_cache(&descriptor) };
        // A driver that was changed under the same version drops what it is given.
        if driver.get_data().map_or(0, |data| data.len()) < data.len() {
            kernels.clear();
        }
        let listed = Mutex::new(Listed { kernels, is_new: false });
        Some(DiskCache { driver, path, identity, listed })
    }

    /// Lists a kernel whose pipeline was made.
    pub(super) fn add(&self, kernel: &Kernel) {
        let sources = kernel.source() + &kernel.source_for(true);
        let sum = stage::sha256_of_bytes(sources.as_bytes());
        let mut listed = lock(&self.listed);
        if listed.kernels.get(kernel.stem) != Some(&sum) {
            listed.kernels.insert(kernel.stem.to_string(), sum);
            listed.is_new = true;
        }
    }

    /// Writes the file if it lacks a pipeline, and returns its name. A second call writes again only after more pipelines were made, also
    /// where the first one failed.
    ///
    /// # Errors
    /// Returns an error if the folder or the file cannot be written.
    pub(super) fn write(&self) -> Result<&Path> {
        let mut listed = lock(&self.listed);
        if std::mem::take(&mut listed.is_new) {
            // The driver has nothing to give where the device is lost.
            if let Some(driver) = self.driver.get_data() {
                let contents = Contents { kernels: listed.kernels.clone(), driver };
                let bytes = contents.to_bytes(&self.identity)?;
                if bytes.len() as u64 <= MAX_BYTES {
                    stage::write_file(&self.path, true, &bytes)?;
                }
            }
        }
        Ok(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compare::test_device_name;
    use crate::gpu::context::{Gpu, Want};
    use crate::gpu::selftest;
    use std::fs;

    fn contents() -> Contents {
        let kernels = BTreeMap::from([("dsp/fft".to_string(), "0a".repeat(32))]);
        Contents { kernels, driver: (0..=255).cycle().take(3000).collect() }
    }

    #[test]
    fn folders() {
        let of = |given: &[(&str, &str)]| {
            folder_by(|name| given.iter().find(|(n, _)| *n == name).map(|(_, value)| OsString::from(value)))
        };
        let at = std::env::temp_dir();
        let text = at.to_str().unwrap();
        assert_eq!(of(&[(CACHE_VARIABLE, text), ("HOME", "/h")]), Some(at.clone()));
        for off in ["", "off", "OFF"] {
            assert_eq!(of(&[(CACHE_VARIABLE, off), ("HOME", text), ("LOCALAPPDATA", text)]), None);
        }
        assert_eq!(of(&[]), None);
        if cfg!(all(unix, not(target_os = "macos"))) {
            assert_eq!(of(&[("HOME", "/h")]), Some("/h/.cache/catseye".into()));
            assert_eq!(of(&[("XDG_CACHE_HOME", "/c"), ("HOME", "/h")]), Some("/c/catseye".into()));
            assert_eq!(of(&[("XDG_CACHE_HOME", "c"), ("HOME", "/h")]), Some("/h/.cache/catseye".into()));
            assert_eq!(of(&[("HOME", "h")]), None);
        }
    }

    #[test]
    fn a_file_is_read_back_and_no_damaged_one() {
        let bytes = contents().to_bytes("me").unwrap();
        assert_eq!(Contents::from_bytes(&bytes, "me"), Some(contents()));
        assert_eq!(Contents::from_bytes(&bytes, "other driver"), None);
        for length in [0, 1, 40, bytes.len() / 2, bytes.len() - 1] {
            assert_eq!(Contents::from_bytes(&bytes[..length], "me"), None, "{length} bytes");
        }
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1 << (at % 8);
            assert_eq!(Contents::from_bytes(&wrong, "me"), None, "byte {at}");
        }
        let longer = [&bytes[..], b"more"].concat();
        assert_eq!(Contents::from_bytes(&longer, "me"), None);
        assert_eq!(Contents::from_bytes(b"PNG\nand more\n", "me"), None);
    }

    fn opened(folder: Option<&Path>) -> Gpu {
        Gpu::open_with_cache(Want::Named(&test_device_name()), folder).unwrap()
    }

    /// The one file of a folder.
    fn file_in(folder: &Path) -> PathBuf {
        let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
        assert_eq!(names.len(), 1, "{names:?}");
        names.remove(0)
    }

    /// Whatever is in the file's place, the device opens, which includes the self-test's exact answers, and a whole file is there after.
    #[test]
    fn damaged_and_foreign_files_are_replaced() {
        let t = tempfile::tempdir().unwrap();
        drop(opened(Some(t.path())));
        let path = file_in(t.path());
        let whole = fs::read(&path).unwrap();
        let listed = |path: &Path| {
            let gpu = opened(None);
            let info = &gpu.info;
            // The features of a device do not depend on its cache.
            Contents::read(path, &identity(info, gpu.device.features())).kernels
        };
        assert_eq!(listed(&path).keys().collect::<Vec<_>>(), [selftest::KERNEL.stem]);
        let mut flipped = whole.clone();
        *flipped.last_mut().unwrap() ^= 1;
        let other = contents().to_bytes(&"0".repeat(64)).unwrap();
        let all_wrong: [&[u8]; 6] =
            [&whole[..whole.len() / 2], &flipped, &other, b"", b"\x7fELF", &[0; 100_000]];
        for wrong in all_wrong {
            fs::write(&path, wrong).unwrap();
            drop(opened(Some(t.path())));
            assert_eq!(file_in(t.path()), path);
            assert_eq!(listed(&path).len(), 1, "after {} wrong bytes", wrong.len());
        }
        // What a warm start finds is left as it is.
        let before = fs::metadata(&path).unwrap().modified().unwrap();
        drop(opened(Some(t.path())));
        assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), before);
    }

    #[test]
    fn a_cache_that_cannot_be_written_changes_nothing() {
        let t = tempfile::tempdir().unwrap();
        let file = t.path().join("file");
        fs::write(&file, "no folder").unwrap();
        let gpu = opened(Some(&file));
        assert!(gpu.write_cache().unwrap_err().to_string().contains("file"));
        selftest::run(&gpu, &selftest::KERNEL).unwrap();
        drop(gpu);
        assert_eq!(fs::read_to_string(&file).unwrap(), "no folder");
        // A folder where the file should be.
        let gpu = opened(Some(t.path()));
        let path = gpu.write_cache().unwrap().unwrap();
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        drop(gpu);
        let gpu = opened(Some(t.path()));
        assert!(gpu.write_cache().is_err());
        drop(gpu);
        assert!(path.is_dir());
        assert_eq!(opened(None).write_cache().unwrap(), None);
    }

    /// Several devices at once share a folder; afterwards the file is whole.
    #[test]
    fn devices_at_once_share_a_folder() {
        let t = tempfile::tempdir().unwrap();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..3).for_each(|_| drop(opened(Some(t.path())))));
            }
        });
        let path = file_in(t.path());
        let gpu = opened(None);
        let held = Contents::read(&path, &identity(&gpu.info, gpu.device.features()));
        assert!(held.kernels.contains_key(selftest::KERNEL.stem) && !held.driver.is_empty());
    }
}
