//! COCO's annotations (<https://cocodataset.org/#format-data>, object detection) of the grids that `[output] masks = true` writes:
//! a folder for each grid, `road` and `markers`, with `images/RADAR_frame_000000.png`, `masks/RADAR_frame_000000.png` and
//! `annotations.json`. `pycocotools.coco.COCO` opens the last one.
//!
//! Pixel (column, row) is the cell `[row, column]` of the grid: row 0 lies at the radar, column 0 farthest left. Of an image's three
//! channels the red one is the number of points in the cell (255: 255 or more), the green one their amplitude (255: the strongest
//! in the grid), the blue one their mean range (255: the farthest corner of the grid). A mask's grey level is the number of the class.
//!
//! An annotation is one connected object of one class: cells of the class that touch at a side or a corner. Its segmentation is
//! a run-length code, exact to the cell, its area the number of cells, and its box (`bbox`) x, y, width, height in cells. The number
//! of a category is that of the class in the mask; cells of the class `undefined` have no annotation. Besides COCO's own keys an
//! image has its mask, radar, frame, time, the size of a cell (`cell_m`: along a column and along a row), the extent of the grid
//! (`extent_m`: ahead and across), the pose of the grid's axes in the world (`grid_in_world`: its origin at the radar, x level along the
//! boresight, y to the left), and the poses of radar and vehicle. The middle of cell `[row, column]` has x = (row + ½) `cell_m[0]` and
//! y = ½ `extent_m[1]` − (column + ½) `cell_m[1]` in these axes.

use super::{Exporter, Finished, MaskedGrid, Order, Sweep, heading};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Sensor, World};
use catseye::formats::stage::{MANIFEST, StagedDir};
use catseye::road::mask::CellClass;
use image::{GrayImage, RgbImage};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A connected object in a mask.
#[derive(Debug, Clone, PartialEq)]
struct Component {
    class: u8,
    /// Its cells as column · rows + row, in rising order: COCO counts down the columns.
    cells: Vec<usize>,
}

/// The connected objects of a mask, `[row, column]`, in the order in which their first cells come row by row.
fn components(mask: &[u8], rows: usize, columns: usize) -> Vec<Component> {
    let mut met = vec![false; mask.len()];
    let mut found = Vec::new();
    for start in 0..mask.len() {
        if met[start] || mask[start] == CellClass::Undefined as u8 {
            continue;
        }
        let class = mask[start];
        let mut open = vec![start];
        met[start] = true;
        let mut cells = Vec::new();
        while let Some(at) = open.pop() {
            let (row, column) = (at / columns, at % columns);
            cells.push(column * rows + row);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                for c in column.saturating_sub(1)..(column + 2).min(columns) {
                    let next = r * columns + c;
                    if !met[next] && mask[next] == class {
                        met[next] = true;
                        open.push(next);
                    }
                }
            }
        }
        cells.sort_unstable();
        found.push(Component { class, cells });
    }
    found
}

impl Component {
    /// Lengths of the runs outside and inside by turns, the first outside.
    fn counts(&self, pixels: usize) -> Vec<usize> {
        let mut counts = Vec::new();
        let mut end = 0;
        for run in self.cells.chunk_by(|a, b| a + 1 == *b) {
            counts.extend([run[0] - end, run.len()]);
            end = run[0] + run.len();
        }
        if end < pixels {
            counts.push(pixels - end);
        }
        counts
    }

    /// x, y, width, height in cells.
    fn bounds(&self, rows: usize) -> [usize; 4] {
        let mut low = [usize::MAX; 2];
        let mut high = [0; 2];
        for cell in &self.cells {
            for (i, place) in [cell / rows, cell % rows].into_iter().enumerate() {
                low[i] = low[i].min(place);
                high[i] = high[i].max(place);
            }
        }
        [low[0], low[1], high[0] + 1 - low[0], high[1] + 1 - low[1]]
    }
}

fn image_of(grid: &MaskedGrid) -> RgbImage {
    let size = grid.rows * grid.columns;
    let farthest = (grid.rows as f64 * grid.cell_m[0]).hypot(0.5 * grid.columns as f64 * grid.cell_m[1]);
    let mut image = RgbImage::new(grid.columns as u32, grid.rows as u32);
    for (i, pixel) in image.pixels_mut().enumerate() {
        let plane = |number: usize| f64::from(grid.planes[number * size + i]);
        let level = |x: f64| x.round().clamp(0.0, 255.0) as u8;
        pixel.0 = [level(plane(0)), level(255.0 * plane(1)), level(255.0 * plane(2) / farthest)];
    }
    image
}

fn pose_record<A, B>(pose: &Pose<A, B>) -> Value {
    json!({ "position_m": pose.translation_m.to_array(), "rotation_xyzw": pose.rotation.to_array() })
}

/// The annotations of one grid.
#[derive(Default)]
struct Annotations {
    categories: Vec<Value>,
    images: Vec<Value>,
    annotations: Vec<Value>,
}

/// A folder of images and annotations under construction.
pub struct Folder {
    staged: StagedDir,
    order: Order,
    grids: BTreeMap<String, Annotations>,
    sweeps: usize,
    points: usize,
}

impl Folder {
    /// Begins a folder.
    ///
    /// # Errors
    /// Returns `BadInput` if the folder already exists and `force` is not given ([`StagedDir::new`]).
    pub fn create(folder: &Path, force: bool) -> Result<Folder> {
        let staged = StagedDir::new(folder, force, "coco")?;
        Ok(Folder { staged, order: Order::default(), grids: BTreeMap::new(), sweeps: 0, points: 0 })
    }

    fn add(&mut self, sweep: &Sweep, grid: &MaskedGrid) -> Result<()> {
        let name = format!("{}_frame_{:06}.png", sweep.radar, sweep.frame);
        let folder = self.staged.path().join(&grid.name);
        for kind in ["images", "masks"] {
            let folder = folder.join(kind);
            fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e))?;
        }
        let path = folder.join("images").join(&name);
        if path.exists() {
            return Err(Error::Failed(format!(
                "frame {} of radar {} occurs twice",
                sweep.frame, sweep.radar
            )));
        }
        let failed = |path: &Path, e: image::ImageError| Error::Failed(format!("{}: {e}", path.display()));
        image_of(grid).save(&path).map_err(|e| failed(&path, e))?;
        let path = folder.join("masks").join(&name);
        let mask = GrayImage::from_raw(grid.columns as u32, grid.rows as u32, grid.mask.clone())
            .ok_or_else(|| Error::Failed(format!("{}: a mask of another size", path.display())))?;
        mask.save(&path).map_err(|e| failed(&path, e))?;

        let of = self.grids.entry(grid.name.clone()).or_insert_with(|| Annotations {
            categories: [CellClass::Lane]
                .iter()
                .chain(&grid.classes)
                .map(|class| json!({ "id": *class as u8, "name": class.name(), "supercategory": "road" }))
                .collect(),
            ..Annotations::default()
        });
        let radar = sweep.sensor_in_world();
        let level = glam::DQuat::from_rotation_z(heading(radar.rotation));
        let grid_in_world = Pose::<Sensor, World>::new(level, radar.translation_m);
        let image = of.images.len() + 1;
        of.images.push(json!({
            "id": image, "file_name": name, "mask_file_name": format!("masks/{name}"), "width": grid.columns,
            "height": grid.rows, "radar": sweep.radar, "frame": sweep.frame, "time_s": sweep.time_ns as f64 * 1e-9,
            "cell_m": grid.cell_m, "extent_m": [grid.rows as f64 * grid.cell_m[0], grid.columns as f64 * grid.cell_m[1]],
            "grid_in_world": pose_record(&grid_in_world), "radar_in_vehicle": pose_record(&sweep.sensor_in_vehicle),
            "vehicle_in_world": pose_record(&sweep.vehicle_in_world),
        }));
        for component in components(&grid.mask, grid.rows, grid.columns) {
            of.annotations.push(json!({
                "id": of.annotations.len() + 1, "image_id": image, "category_id": component.class, "iscrowd": 0,
                "area": component.cells.len(), "bbox": component.bounds(grid.rows),
                "segmentation": {
                    "size": [grid.rows, grid.columns], "counts": component.counts(grid.mask.len()),
                },
            }));
        }
        Ok(())
    }
}

impl Exporter for Folder {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        sweep.check()?;
        self.order.next(sweep)?;
        if sweep.grids.is_empty() {
            return Err(BadInput::new(format!(
                "frame {} of radar {} has no grids",
                sweep.frame, sweep.radar
            ))
            .key("grids")
            .remedy("simulate with [output] masks = true")
            .into());
        }
        for grid in &sweep.grids {
            self.add(sweep, grid)?;
        }
        self.sweeps += 1;
        self.points += sweep.points.len();
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Finished> {
        let root = self.staged.path();
        let mut notes = Vec::new();
        for (name, of) in self.grids {
            notes.push(format!("{name}: {} images, {} annotations", of.images.len(), of.annotations.len()));
            let about = json!({
                "description": format!("Points of a radar on the grid '{name}', simulated by catseye"),
                "version": env!("CARGO_PKG_VERSION"),
            });
            let text = json!({
                "info": about, "licenses": [], "images": of.images, "categories": of.categories,
                "annotations": of.annotations,
            });
            let path = root.join(&name).join("annotations.json");
            fs::write(&path, format!("{text}\n")).map_err(|e| Error::io(&path, e))?;
        }
        let manifest = json!({
            "catseye": env!("CARGO_PKG_VERSION"), "format": "COCO, object detection", "sweeps": self.sweeps,
        });
        let path = root.join(MANIFEST);
        fs::write(&path, format!("{manifest}\n")).map_err(|e| Error::io(&path, e))?;
        Ok(Finished { output: self.staged.commit()?, sweeps: self.sweeps, points: self.points, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn objects_touch_at_corners_and_are_of_one_class() {
        #[rustfmt::skip]
        let mask = [
            0, 2, 0, 0, 3,
            2, 0, 0, 3, 3,
            0, 0, 2, 2, 1,
        ];
        let found = components(&mask, 3, 5);
        let expected: Vec<(u8, Vec<usize>, [usize; 4])> = vec![
            (2, vec![1, 3], [0, 0, 2, 2]),
            (3, vec![10, 12, 13], [3, 0, 2, 2]),
            (2, vec![8, 11], [2, 2, 2, 1]),
            (1, vec![14], [4, 2, 1, 1]),
        ];
        let got: Vec<_> = found.iter().map(|c| (c.class, c.cells.clone(), c.bounds(3))).collect();
        assert_eq!(got, expected);
        assert_eq!(found[0].counts(15), [1, 1, 1, 1, 11]);
        assert_eq!(found[1].counts(15), [10, 1, 1, 2, 1]);
        // To the last cell: no run of nothing behind it.
        assert_eq!(found[3].counts(15), [14, 1]);
        let whole = components(&[4; 6], 2, 3);
        assert_eq!((whole.len(), whole[0].counts(6)), (1, vec![0, 6]));
    }

    #[test]
    fn without_grids_nothing_is_written() {
        let t = tempfile::tempdir().unwrap();
        let mut out = Folder::create(&t.path().join("out"), false).unwrap();
        let e = out.push(&samples::empty("front", 0, 0)).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("masks = true"), "{e}");
        drop(out);
        let mut sweep = samples::sweeps()[0].clone();
        sweep.grids[0].mask.pop();
        let mut out = Folder::create(&t.path().join("out"), false).unwrap();
        assert!(out.push(&sweep).unwrap_err().to_string().contains("the grid 'road'"));
        drop(out);
        assert_eq!(fs::read_dir(t.path()).unwrap().count(), 0);
    }
}
