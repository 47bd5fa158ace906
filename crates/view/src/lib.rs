//! Pages for the browser: one HTML file without any other source shows a run, a frame, a scene, a table of cross sections or a study.
//!
//! Everything is worked out here; the page's script (`web/`, built into `assets/`) draws what it is given. What comes from files reaches
//! the page as JSON alone and is shown as text: no name in a scene becomes markup or script.

#![forbid(unsafe_code)]

mod causes;
mod dataset;
mod html;
mod lanes;
mod pack;
mod rcs;
mod run;
mod scene;
mod study;
mod table;
mod thing;

pub use rcs::RcsTable;
pub use thing::Thing;

use catseye::base::error::{Error, Result};
use catseye::formats::stage::{StagedDir, StagedFile};
use html::With;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Size of the frames, as text, up to which they stand in the page itself; beyond it they lie in a folder beside it, from which
/// the page takes them one by one.
pub const INLINE_BYTES: usize = 24 << 20;

/// Kind of the folder with the frames of a long run.
const KIND: &str = "view";

/// What a page shows.
pub struct Page {
    /// Title of the page.
    title: String,
    /// What all frames share.
    data: Value,
    /// What it has besides its data.
    with: With,
    /// The frames of a run, one after another; none of a thing without time.
    frames: Frames,
}

/// Function that gives the frame of a number as JSON.
type FrameOf = Box<dyn Fn(usize) -> Result<Value>>;

/// The frames of a page.
struct Frames {
    count: usize,
    of: FrameOf,
}

/// What was written.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Written {
    /// The page.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub page: PathBuf,
    /// Size of the page, bytes.
    pub bytes: usize,
    /// Number of frames.
    pub frames: usize,
    /// Folder with frames beside the page, where they are too many for one file.
    pub beside: Option<PathBuf>,
}

impl Page {
    /// A page without frames.
    fn still(title: String, data: Value) -> Page {
        Page {
            title,
            data,
            with: With::Nothing,
            frames: Frames { count: 0, of: Box::new(|_| Ok(Value::Null)) },
        }
    }

    /// The page in which a scenario of this text is changed. It asks the server that it comes from: `POST simulate` with a text answers
    /// with `data` and `frames` as [`Page::parts`] has them and the `seconds` that it took, or with an `error`. `file` is the name under
    /// which the page saves the text.
    pub fn of_live(file: &str, text: &str) -> Page {
        let data = json!({ "kind": "live", "title": file, "file": file, "text": text });
        Page { with: With::Server, ..Page::still(file.into(), data) }
    }

    /// What all frames share, and the frames, as the page's script takes them.
    ///
    /// # Errors
    /// Returns an error for results that are cut short or do not fit together.
    pub fn parts(&self) -> Result<(Value, Vec<Value>)> {
        let frames = (0..self.frames.count).map(|i| (self.frames.of)(i)).collect::<Result<_>>()?;
        Ok((self.data.clone(), frames))
    }

    /// The text of a page without frames.
    ///
    /// # Errors
    /// Returns an error if its data are not JSON.
    pub fn text(&self) -> Result<String> {
        html::page(&self.title, &self.data, &[], None, self.with)
    }

    /// Number of its frames.
    pub fn frames(&self) -> usize {
        self.frames.count
    }

    /// Writes the page, with a folder of frames beside it where they are longer than `inline_bytes`, for which [`INLINE_BYTES`] is a
    /// good choice. `progress` is called with the number of frames that
    /// are done.
    ///
    /// # Errors
    /// Returns an error for results that are cut short or do not fit together, and where a file exists and `force` is not given.
    pub fn write(
        &self,
        out: &Path,
        force: bool,
        inline_bytes: usize,
        progress: &dyn Fn(usize),
    ) -> Result<Written> {
        let page = StagedFile::new(out, force)?;
        let mut inline = Vec::new();
        let mut bytes = 0;
        for i in 0..self.frames.count {
            inline.push(html::json(&(self.frames.of)(i)?)?);
            bytes += inline[i].len();
            progress(i + 1);
            if bytes > inline_bytes {
                break;
            }
        }
        let beside = match bytes > inline_bytes {
            true => Some(self.write_beside(out, std::mem::take(&mut inline), force, progress)?),
            false => None,
        };
        let name = beside.as_deref().and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned());
        let text = html::page(&self.title, &self.data, &inline, name.as_deref(), self.with)?;
        std::fs::write(page.path(), &text).map_err(|e| Error::io(page.path(), e))?;
        let page = page.commit()?;
        Ok(Written { page, bytes: text.len(), frames: self.frames.count, beside })
    }

    /// Writes the frames as scripts that a page may load from where it lies, which a browser allows for files too.
    fn write_beside(
        &self,
        out: &Path,
        made: Vec<String>,
        force: bool,
        progress: &dyn Fn(usize),
    ) -> Result<PathBuf> {
        let mut name = out.file_stem().unwrap_or_default().to_os_string();
        name.push("_frames");
        let folder = StagedDir::new(out.with_file_name(name), force, KIND)?;
        let ready = made.len();
        for i in 0..self.frames.count {
            let text = match made.get(i) {
                Some(text) => text.clone(),
                None => html::json(&(self.frames.of)(i)?)?,
            };
            let path = folder.path().join(format!("{i:06}.js"));
            std::fs::write(&path, html::chunk(i, &text)).map_err(|e| Error::io(&path, e))?;
            progress(ready.max(i + 1));
        }
        folder.commit()
    }
}
