//! Datasets as what is learned from: their scenes, their own split, and what is wrong with them.

use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::base::rng::Draws;
use catseye::road::mask::{CellClass, Grid};
use catseye_io::dataset::DATASET;
use catseye_io::store::{Array, Column, Compression, Data, DatasetLayout, Format, Record, Table};
use catseye_learn::config::Config;
use catseye_learn::data::GridKind;
use catseye_learn::model::Model;
use catseye_learn::source::sources;
use catseye_learn::train::train;
use catseye_learn::{Device, device};
use std::fs;
use std::path::Path;

fn cpu() -> Device {
    device(false).unwrap()
}

/// A frame with a square of lane under its points; scenes have two frames.
fn record(frame: u64, split: &str, spoil: &dyn Fn(&mut Vec<Array>)) -> Record {
    let grid = Grid::ROAD;
    let mut draws = Draws::new(frame as u32, 1);
    let (row, column) = (10 * (draws.uniform() * 36.0) as usize, 10 * (draws.uniform() * 22.0) as usize);
    let (mut mask, mut planes) = (vec![0u8; grid.cells()], vec![0f32; 4 * grid.cells()]);
    for cell in 0..6400 {
        let at = (row + cell / 80) * grid.columns + column + cell % 80;
        mask[at] = CellClass::Lane as u8;
        if cell % 3 == 0 {
            planes[at] = 1.0;
            planes[grid.cells() + at] = 0.7;
        }
    }
    let array = |name: &str, dims: &[&str], shape: Vec<usize>, data: Data| Array {
        name: name.into(),
        dims: dims.iter().map(|d| d.to_string()).collect(),
        shape,
        data,
        unit: String::new(),
    };
    let mut arrays = vec![
        array("grid_road", &["plane", "row", "column"], vec![4, grid.rows, grid.columns], Data::F32(planes)),
        array("mask_road", &["row", "column"], vec![grid.rows, grid.columns], Data::U8(mask)),
    ];
    spoil(&mut arrays);
    let frames = Table {
        name: "frames".into(),
        columns: vec![
            ("scene".into(), Column::U32(vec![(frame / 2) as u32])),
            ("split".into(), Column::Text(vec![split.into()])),
        ],
    };
    Record { frame, arrays, tables: vec![frames] }
}

fn write(dir: &Path, split: &dyn Fn(u64) -> &'static str, spoil: &dyn Fn(&mut Vec<Array>)) {
    let first = record(0, split(0), spoil);
    let layout = DatasetLayout {
        format: Format::Frames,
        compression: Compression::None,
        frames: 12,
        frames_per_shard: 4,
        arrays: first.arrays.iter().map(Array::spec).collect(),
        tables: first.tables.iter().map(Table::spec).collect(),
        attributes: serde_json::Map::new(),
    };
    layout.create(dir).unwrap();
    for shard in 0..3 {
        layout.write_shard(dir, shard, &mut |f| Ok(record(f, split(f), spoil))).unwrap();
    }
    fs::write(dir.join(DATASET), "{}").unwrap();
}

fn config(folder: &Path, more: &str) -> Result<Config> {
    let path = folder.join("training.toml");
    let text = format!(
        "[network]\nkind = \"segnet\"\nlayers = 2\nchannels = 6\nkernel = 3\ninput = \"A\"\n\n[training]\nepochs = 25\n\
         batch = 2\nrate = 0.01\nseed = 5\naugment = {{ mirror = true, drop = 0.1 }}\n\n[data]\ngrid = \"road\"\n\
         runs = [\"d\"]\nscale = 10\nclasses = [\"undefined\", \"lane\"]\n{more}\n"
    );
    fs::write(&path, text).unwrap();
    Config::read(&path)
}

fn thirds(frame: u64) -> &'static str {
    ["train", "train", "train", "train", "validation", "test"][(frame / 2) as usize]
}

#[test]
fn a_dataset_is_learned_with_its_own_split_or_by_scenes() {
    let t = tempfile::tempdir().unwrap();
    let dir = t.path().join("d");
    write(&dir, &thirds, &|_| {});
    let found = sources(&[dir.clone(), dir.clone()], GridKind::Road).unwrap();
    let scenes: Vec<usize> = found.iter().map(|s| s.scene).collect();
    assert_eq!(scenes[..4], [0, 0, 1, 1]);
    assert_eq!((scenes.len(), scenes[23]), (24, 11), "the second folder has scenes of its own");

    let own = config(t.path(), "split = \"dataset\"").unwrap();
    let report = train(&own, &t.path().join("own"), false, &cpu(), Control::default(), &|_| {}).unwrap();
    assert_eq!(report.frames, [8, 2, 2]);
    assert!(report.test[1].unwrap() > 0.9, "{:?}", report.test);
    let card = fs::read_to_string(t.path().join("own/model_card.md")).unwrap();
    assert!(card.contains("* d\n") && card.contains("* training: 0, 1, 2, 3\n"), "{card}");
    assert!(card.contains("* validation: 4\n* test: 5\n"), "{card}");
    for picture in ["confusion.png", "precision_recall.png"] {
        assert!(fs::metadata(t.path().join("own").join(picture)).unwrap().len() > 1000, "{picture}");
    }
    let curves = fs::read_to_string(t.path().join("own/precision_recall.csv")).unwrap();
    assert!(
        curves.starts_with("class,threshold,precision,recall\n") && curves.contains("\nlane,"),
        "{curves}"
    );
    let judged =
        Model::load(&t.path().join("own"), &cpu()).unwrap().evaluate(&[dir]).unwrap().classes().unwrap();
    assert!(judged.curves.average_precision(1).unwrap() > 0.9);

    let scenes = config(t.path(), "").unwrap();
    let report =
        train(&scenes, &t.path().join("scenes"), false, &cpu(), Control::default(), &|_| {}).unwrap();
    assert_eq!(report.frames, [8, 2, 2]);
}

#[test]
fn wrong_datasets_are_refused_in_one_line() {
    let t = tempfile::tempdir().unwrap();
    let dir = t.path().join("d");
    type Spoil<'a> = &'a dyn Fn(&mut Vec<Array>);
    let cases: [(Spoil<'_>, &str); 4] = [
        (
            &|a| a.iter_mut().for_each(|a| a.name = a.name.replace("road", "markers")),
            "keep.masks = false: the dataset has no masks",
        ),
        (
            &|a| {
                a[0].shape = vec![4, 10, 10];
                a[0].data = Data::F32(vec![0.0; 400]);
            },
            "shape = [4, 10, 10]: the grid has another size",
        ),
        (
            &|a| {
                let Data::F32(v) = &mut a[0].data else { unreachable!() };
                v[7] = f32::NAN;
            },
            "grid_road = NaN: a value is not finite",
        ),
        (
            &|a| {
                let Data::U8(v) = &mut a[1].data else { unreachable!() };
                v[7] = 200;
            },
            "class = 200: is not the number of a class",
        ),
    ];
    for (spoil, words) in cases {
        let _ = fs::remove_dir_all(&dir);
        write(&dir, &thirds, spoil);
        let out = t.path().join("net");
        let e = train(&config(t.path(), "").unwrap(), &out, false, &cpu(), Control::default(), &|_| {})
            .unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains(words), "{e}");
        assert!(!out.exists());
    }
    let _ = fs::remove_dir_all(&dir);
    write(&dir, &|_| "train", &|_| {});
    let own = config(t.path(), "split = \"dataset\"").unwrap();
    let e = train(&own, &t.path().join("net"), false, &cpu(), Control::default(), &|_| {}).unwrap_err();
    assert!(e.to_string().contains("data.split = dataset: the set validation has no frames"), "{e}");
    let turned = config(t.path(), "").map(|_| ()).and_then(|_| {
        let path = t.path().join("training.toml");
        let text = fs::read_to_string(&path).unwrap().replace("drop = 0.1", "turn_deg = 5");
        fs::write(&path, text).unwrap();
        Config::read(&path).map(|_| ())
    });
    let said = turned.unwrap_err().to_string();
    assert!(
        said.contains("training.augment")
            && said.contains("turn_deg = 5")
            && said.contains("network.input is B"),
        "{said}"
    );
}
