//! Every format gives back what was stored; the same records make the same bytes; damage is found.

use super::*;
use catseye::formats::stage::{checksums, sha256_of_file};
use num_complex::Complex32;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Those of this build.
fn formats() -> impl Iterator<Item = Format> {
    [Format::Zarr, Format::Hdf5, Format::Frames].into_iter().filter(|f| f.is_built())
}

fn compressions(format: Format) -> &'static [Compression] {
    match format {
        Format::Zarr => &[Compression::None, Compression::Zstd(1), Compression::Zstd(9)],
        Format::Hdf5 => &[Compression::None, Compression::Deflate(4)],
        Format::Frames => &[Compression::None],
    }
}

fn array(name: &str, dims: &[&str], shape: &[usize], data: Data, unit: &str) -> Array {
    let dims = dims.iter().map(|d| d.to_string()).collect();
    Array { name: name.into(), dims, shape: shape.to_vec(), data, unit: unit.into() }
}

fn table(name: &str, columns: Vec<(&str, Column)>) -> Table {
    Table { name: name.into(), columns: columns.into_iter().map(|(n, c)| (n.to_string(), c)).collect() }
}

/// A frame with every type, whose numbers say where they stand: `python/tests/readers/test_store.py` has the same formulas.
fn sample(frame: u64) -> Record {
    let f = frame as f32;
    let (chirps, channels, samples) = (4, 3, 8);
    let adc =
        (0..chirps * channels * samples).map(|i| Complex32::new(f + i as f32 / 16.0, -(i as f32) - f / 4.0));
    let map = (0..5 * 6).map(|i| (i as f32 * 0.1 - f).exp());
    let mask = (0..7).map(|i| ((i * 37 + frame) % 251) as u8);
    let cells = (0..4).map(|i| i * 1_000_003 - 70_000 * frame as i32);
    let rows = (frame * 3 % 5) as usize;
    let points = table(
        "points",
        vec![
            ("time_ns", Column::I64((0..rows).map(|i| frame as i64 * 1_000_000_007 - i as i64).collect())),
            ("object_id", Column::U32((0..rows).map(|i| 4_294_967_295 - i as u32).collect())),
            (
                "range_m",
                Column::F64((0..rows).map(|i| (frame as f64 + 0.1) * (i + 1) as f64 / 3.0).collect()),
            ),
            (
                "snr_db",
                Column::F32((0..rows).map(|i| if i == 1 { f32::NAN } else { i as f32 / 7.0 }).collect()),
            ),
            ("is_ghost", Column::Bool((0..rows).map(|i| i % 2 == 0).collect())),
            ("class", Column::Text((0..rows).map(|i| ["car", "Straße, \"β\"", ""][i % 3].into()).collect())),
        ],
    );
    Record {
        frame,
        arrays: vec![
            array(
                "adc",
                &["chirp", "virtual_channel", "sample"],
                &[chirps, channels, samples],
                Data::C32(adc.collect()),
                "sqrt(W)",
            ),
            array("range_doppler", &["doppler", "range"], &[5, 6], Data::F32(map.collect()), "W"),
            array("mask", &["azimuth"], &[7], Data::U8(mask.collect()), "1"),
            array("cells", &["cell"], &[4], Data::I32(cells.collect()), "1"),
        ],
        tables: vec![points, table("ego", vec![("x_m", Column::F64(vec![frame as f64 / 8.0]))])],
    }
}

fn layout_of(
    record: &Record,
    frames: u64,
    per_shard: u64,
    format: Format,
    compression: Compression,
) -> DatasetLayout {
    let mut attributes = serde_json::Map::new();
    attributes.insert("recipe".into(), "seed = 1\n".into());
    DatasetLayout {
        format,
        compression,
        frames,
        frames_per_shard: per_shard,
        arrays: record.arrays.iter().map(Array::spec).collect(),
        tables: record.tables.iter().map(Table::spec).collect(),
        attributes,
    }
}

fn write_all(layout: &DatasetLayout, dir: &Path, make: &mut dyn FnMut(u64) -> Record) -> Vec<ShardFile> {
    layout.create(dir).unwrap();
    (0..layout.shards()).flat_map(|s| layout.write_shard(dir, s, &mut |f| Ok(make(f))).unwrap()).collect()
}

/// Equal to the bit, so that a NaN equals itself.
fn assert_same(a: &Record, b: &Record) {
    assert_eq!(a.frame, b.frame);
    assert_eq!(a.arrays.len(), b.arrays.len());
    for (x, y) in a.arrays.iter().zip(&b.arrays) {
        assert_eq!((&x.name, &x.dims, &x.shape, &x.unit), (&y.name, &y.dims, &y.shape, &y.unit));
        assert_eq!((x.data.kind(), x.data.bytes()), (y.data.kind(), y.data.bytes()), "{}", x.name);
    }
    assert_eq!(a.tables.len(), b.tables.len());
    for (x, y) in a.tables.iter().zip(&b.tables) {
        assert_eq!(x.name, y.name);
        let bits = |t: &Table| -> Vec<(String, Column)> {
            let quiet = |c: &Column| match c {
                Column::F64(v) => Column::I64(v.iter().map(|x| x.to_bits() as i64).collect()),
                Column::F32(v) => Column::U32(v.iter().map(|x| x.to_bits()).collect()),
                other => other.clone(),
            };
            t.columns.iter().map(|(n, c)| (n.clone(), quiet(c))).collect()
        };
        assert_eq!(bits(x), bits(y), "table {}", x.name);
    }
}

fn files_below(dir: &Path) -> BTreeMap<String, String> {
    checksums(dir).unwrap()
}

#[test]
fn every_format_gives_back_what_was_stored() {
    for format in formats() {
        for compression in compressions(format) {
            let t = tempfile::tempdir().unwrap();
            let layout = layout_of(&sample(0), 7, 3, format, *compression);
            let files = write_all(&layout, t.path(), &mut sample);
            let opened = DatasetLayout::open(t.path()).unwrap();
            assert_eq!(opened, layout);
            for frame in [6, 0, 3, 5, 1, 2, 4] {
                assert_same(&opened.read(t.path(), frame).unwrap(), &sample(frame));
            }
            // What is reported is what lies there, and nothing else does but what says how to read it.
            let there = files_below(t.path());
            for file in &files {
                assert_eq!(there.get(&file.path), Some(&file.sha256), "{}", file.path);
                assert_eq!(fs::metadata(t.path().join(&file.path)).unwrap().len(), file.bytes);
            }
            let others: Vec<&String> =
                there.keys().filter(|p| !files.iter().any(|f| &f.path == *p)).collect();
            assert!(others.iter().all(|p| *p == LAYOUT || p.ends_with("zarr.json")), "{others:?}");
            assert_eq!(layout.read(t.path(), 7).unwrap_err().exit_code(), 2);
            let e = layout.read_array(t.path(), "adcs", 0).unwrap_err().to_string();
            assert!(e.contains("nearest: adc"), "{e}");
        }
    }
}

#[test]
fn shards_are_the_same_bytes_in_any_order() {
    for format in formats() {
        for compression in compressions(format) {
            let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
            let layout = layout_of(&sample(0), 8, 3, format, *compression);
            write_all(&layout, a.path(), &mut sample);
            // Backwards, one of them twice, after an attempt that failed in its second frame.
            layout.create(b.path()).unwrap();
            let mut failing = |f: u64| if f == 1 { Err(Error::Failed("no".into())) } else { Ok(sample(f)) };
            assert!(layout.write_shard(b.path(), 0, &mut failing).is_err());
            for shard in [2, 1, 0, 1] {
                layout.create(b.path()).unwrap();
                layout.write_shard(b.path(), shard, &mut |f| Ok(sample(f))).unwrap();
            }
            assert_eq!(files_below(a.path()), files_below(b.path()), "{format:?} {compression}");
        }
    }
}

#[test]
fn an_attempt_that_fails_leaves_nothing_under_a_final_name() {
    for format in formats().filter(|f| *f != Format::Frames) {
        let t = tempfile::tempdir().unwrap();
        let layout = layout_of(&sample(0), 4, 2, format, Compression::None);
        layout.create(t.path()).unwrap();
        let before = files_below(t.path());
        let mut failing = |f: u64| if f == 3 { Err(Error::Failed("no".into())) } else { Ok(sample(f)) };
        layout.write_shard(t.path(), 1, &mut failing).unwrap_err();
        assert_eq!(files_below(t.path()), before);
        // What a killed process leaves goes with the next attempt.
        let file = layout.write_shard(t.path(), 1, &mut |f| Ok(sample(f))).unwrap().remove(0).path;
        let path = t.path().join(file);
        let name = path.file_name().unwrap().to_str().unwrap();
        let left = path.with_file_name(format!(".{name}.partial-1-0"));
        fs::write(&left, "half").unwrap();
        layout.write_shard(t.path(), 1, &mut |f| Ok(sample(f))).unwrap();
        assert!(!left.exists() && path.exists());
        let e = layout.read(t.path(), 0).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("missing"), "{e}");
        assert_eq!(layout.write_shard(t.path(), 2, &mut |f| Ok(sample(f))).unwrap_err().exit_code(), 2);
    }
}

/// A dataset that another version of catseye began, which words its descriptions differently, is continued; other columns are refused.
#[test]
fn descriptions_may_differ() {
    let t = tempfile::tempdir().unwrap();
    let layout = layout_of(&sample(0), 4, 2, Format::Frames, Compression::None);
    layout.create(t.path()).unwrap();
    let mut reworded = layout.clone();
    reworded.tables[0].about = "Points.".into();
    reworded.tables[0].columns[0].about = "Time.".into();
    reworded.arrays[0].about = "Samples.".into();
    reworded.create(t.path()).unwrap();
    assert_eq!(DatasetLayout::open(t.path()).unwrap(), layout);
    reworded.tables[0].columns[0].name = "time_us".into();
    let e = reworded.create(t.path()).unwrap_err();
    assert!(e.to_string().contains("table points has other columns"), "{e}");
}

#[test]
fn records_of_another_layout_are_refused() {
    type Change = fn(&mut Record);
    let cases: [(Change, &str); 9] = [
        (|r| r.arrays[0].shape = vec![4, 8, 3], "array adc of frame 0"),
        (|r| r.arrays[0].unit = "V".into(), "in V"),
        (|r| r.arrays[1].data = Data::I32(vec![0; 30]), "int32"),
        (|r| r.arrays[1].data = Data::F32(vec![0.0; 29]), "29"),
        (|r| drop(r.arrays.pop()), "array cells of frame 0: is missing"),
        (|r| r.arrays[3].name = "cell".into(), "nearest: cells"),
        (|r| drop(r.tables[0].columns.pop()), "does not have the columns"),
        (|r| r.tables[1].columns[0].1 = Column::F32(vec![0.0]), "x_m F32"),
        (|r| r.tables.push(r.tables[0].clone()), "twice"),
    ];
    for format in formats() {
        let t = tempfile::tempdir().unwrap();
        let layout = layout_of(&sample(0), 2, 2, format, Compression::None);
        layout.create(t.path()).unwrap();
        for (change, expected) in &cases {
            let mut record = sample(0);
            change(&mut record);
            let e = layout.write_shard(t.path(), 0, &mut |_| Ok(record.clone())).unwrap_err();
            assert!(e.exit_code() == 2 && e.to_string().contains(expected), "{e}");
        }
        let mut rows = sample(1);
        rows.tables[0].columns[2].1 = Column::F64(vec![1.0]);
        let mut make = |f| Ok(if f == 1 { rows.clone() } else { sample(f) });
        let e = layout.write_shard(t.path(), 0, &mut make).unwrap_err();
        assert!(e.to_string().contains("differ in length"), "{e}");
        let e = layout.write_shard(t.path(), 0, &mut |_| Ok(sample(1))).unwrap_err();
        assert_eq!(e.exit_code(), 1, "{e}");
    }
}

#[cfg(feature = "zarr")]
#[test]
fn layouts_that_cannot_be_stored_are_refused() {
    type Change = fn(&mut DatasetLayout);
    let cases: [(Change, &str); 19] = [
        (|l| l.frames = 0, "frames = 0"),
        (|l| l.frames = 1 << 32, "frames = 4294967296"),
        (|l| l.frames_per_shard = 0, "frames_per_shard = 0"),
        (|l| l.frames_per_shard = 1 << 30, "1 to 1048576"),
        (|l| l.arrays[0].name = "../adc".into(), "is not a valid name"),
        (|l| l.arrays[0].name = String::new(), "is not a valid name"),
        (|l| l.arrays[0].name = "tables".into(), "another name"),
        (|l| l.arrays[1].name = "adc".into(), "twice"),
        (|l| l.arrays[0].dims[1] = "frame".into(), "twice"),
        (|l| l.arrays[0].shape[1] = 0, "cannot be stored"),
        (|l| l.arrays[0].shape[1] = usize::MAX, "cannot be stored"),
        (|l| l.arrays[0].shape = vec![4, 3], "axis names"),
        (|l| l.tables[0].columns.clear(), "has no columns"),
        (|l| l.tables[0].columns[0].name = "frame".into(), "twice"),
        (|l| l.tables[0].columns[0].name = "range m".into(), "is not a valid name"),
        (|l| l.tables[1].name = "points".into(), "twice"),
        (|l| l.compression = Compression::Deflate(3), "zstd:1"),
        (|l| (l.format, l.compression) = (Format::Frames, Compression::Zstd(3)), "frames"),
        (|l| (l.arrays.clear(), l.tables.clear()).0, "nothing to store"),
    ];
    for (change, expected) in cases {
        let t = tempfile::tempdir().unwrap();
        let mut layout = layout_of(&sample(0), 4, 2, Format::Zarr, Compression::Zstd(3));
        layout.check().unwrap();
        change(&mut layout);
        let e = layout.create(t.path()).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains(expected), "{e}");
        assert_eq!(fs::read_dir(t.path()).unwrap().count(), 0);
    }
    for (text, value) in [
        ("none", Some(Compression::None)),
        ("zstd", Some(Compression::Zstd(3))),
        ("zstd:22", Some(Compression::Zstd(22))),
        ("deflate:9", Some(Compression::Deflate(9))),
        ("zstd:23", None),
        ("zstd:0", None),
        ("none:1", None),
        ("deflate:", None),
        ("lzma", None),
    ] {
        assert_eq!(Compression::try_from(text.to_string()).ok(), value, "{text}");
    }
}

#[test]
fn a_folder_of_another_layout_is_not_touched() {
    let t = tempfile::tempdir().unwrap();
    let layout = layout_of(&sample(0), 4, 2, Format::Frames, Compression::None);
    write_all(&layout, t.path(), &mut sample);
    let before = files_below(t.path());
    for (other, expected) in [
        (DatasetLayout { frames: 5, ..layout.clone() }, "4 frames, not 5"),
        (DatasetLayout { frames_per_shard: 3, ..layout.clone() }, "2 frames a shard, not 3"),
        (DatasetLayout { format: Format::Zarr, ..layout.clone() }, "format frames, not zarr"),
        (DatasetLayout { arrays: layout.arrays[1..].to_vec(), ..layout.clone() }, "holds adc"),
        (DatasetLayout { attributes: Default::default(), ..layout.clone() }, "attributes"),
    ] {
        if !other.format.is_built() {
            continue;
        }
        let e = other.create(t.path()).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains(expected), "{e}");
    }
    layout.create(t.path()).unwrap();
    assert_eq!(files_below(t.path()), before);

    let path = t.path().join(LAYOUT);
    let text = fs::read_to_string(&path).unwrap();
    for (from, to, expected) in [
        ("\"store\": 2", "\"store\": 3", "later version"),
        ("\"frames\": 4", "\"frames\": -4", "damaged"),
        ("\"frames\": 4", "\"frames\": 0", "frames = 0"),
        ("\"format\"", "\"fromat\"", "damaged"),
        ("{", "", "damaged"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        fs::write(&path, changed).unwrap();
        let e = DatasetLayout::open(t.path()).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains(expected), "{e}");
    }
    fs::remove_file(&path).unwrap();
    assert!(DatasetLayout::open(t.path()).unwrap_err().to_string().contains("is not a dataset"));
    assert!(DatasetLayout::open(&path).unwrap_err().to_string().contains("is not a dataset"));
}

/// A complaint of one line that names a file below `dir` and says what to do.
fn assert_broken(e: &Error, dir: &Path, what: &str) {
    let text = e.to_string();
    assert_eq!(e.exit_code(), 2, "{what}: {text}");
    assert!(text.starts_with(dir.to_str().unwrap()), "{what}: {text}");
    assert!(text.contains("run `catseye dataset`") && !text.contains('\n'), "{what}: {text}");
}

#[test]
fn damage_of_any_byte_is_found_or_harmless() {
    for format in formats() {
        for compression in compressions(format) {
            let t = tempfile::tempdir().unwrap();
            let dir = t.path();
            let layout = layout_of(&sample(0), 4, 4, format, *compression);
            let files = write_all(&layout, dir, &mut sample);
            let mut found = 0;
            let mut tried = 0;
            for file in &files {
                let path = dir.join(&file.path);
                let good = fs::read(&path).unwrap();
                // Every place of a small file, some of a larger one.
                for at in (0..good.len()).step_by(good.len().div_ceil(60)) {
                    let mut bad = good.clone();
                    bad[at] ^= 1 << (at % 8);
                    fs::write(&path, bad).unwrap();
                    for frame in 0..4 {
                        match layout.read(dir, frame) {
                            Err(e) => {
                                found += 1;
                                assert_broken(&e, dir, &format!("{} byte {at}", file.path));
                            }
                            // A byte that this frame does not need.
                            Ok(record) => assert_same(&record, &sample(frame)),
                        }
                        tried += 1;
                    }
                }
                fs::write(&path, &good).unwrap();
            }
            assert!(found > 0);
            println!("{format:?} {compression}: {found} of {tried} reads with a wrong bit were refused");
            if *compression != Compression::None {
                continue;
            }
            // Where the numbers of one frame lie, every wrong bit is found, and found in that frame alone.
            let numbers = sample(2).array("adc").unwrap().data.bytes().to_vec();
            let place = files.iter().find_map(|f| {
                let bytes = fs::read(dir.join(&f.path)).unwrap();
                let at = bytes.windows(numbers.len()).position(|w| w == numbers)?;
                Some((dir.join(&f.path), bytes, at))
            });
            let (path, good, start) = place.expect("uncompressed numbers");
            for at in (start..start + numbers.len()).step_by(5) {
                let mut bad = good.clone();
                bad[at] ^= 1 << (at % 8);
                fs::write(&path, bad).unwrap();
                assert_broken(&layout.read(dir, 2).unwrap_err(), dir, "a wrong bit");
                assert_same(&layout.read(dir, 1).unwrap(), &sample(1));
            }
            fs::write(&path, &good).unwrap();
        }
    }
}

#[test]
fn cut_swapped_and_missing_files_are_found() {
    for format in formats() {
        for compression in compressions(format) {
            let t = tempfile::tempdir().unwrap();
            let dir = t.path();
            let layout = layout_of(&sample(0), 4, 2, format, *compression);
            let files: Vec<ShardFile> = {
                layout.create(dir).unwrap();
                let _ = layout.write_shard(dir, 0, &mut |f| Ok(sample(f))).unwrap();
                layout.write_shard(dir, 1, &mut |f| Ok(sample(f))).unwrap()
            };
            for file in &files {
                let path = dir.join(&file.path);
                let good = fs::read(&path).unwrap();
                for length in [0, 1, good.len() / 2, good.len() - 1] {
                    fs::write(&path, &good[..length]).unwrap();
                    let e = (2..4).find_map(|f| layout.read(dir, f).err());
                    assert_broken(&e.expect("an error"), dir, &format!("{} cut to {length}", file.path));
                }
                fs::write(&path, [&good[..], b"more"].concat()).unwrap();
                if let Some(e) = (2..4).find_map(|f| layout.read(dir, f).err()) {
                    assert_broken(&e, dir, "longer");
                }
                // Noise of the same length.
                let noise: Vec<u8> = (0..good.len()).map(|i| (i * i / 7) as u8).collect();
                fs::write(&path, noise).unwrap();
                let e = (2..4).find_map(|f| layout.read(dir, f).err());
                assert_broken(&e.expect("an error"), dir, "noise");
                fs::remove_file(&path).unwrap();
                let e = (2..4).find_map(|f| layout.read(dir, f).err());
                assert_broken(&e.expect("an error"), dir, "missing");
                fs::create_dir(&path).unwrap();
                assert!((2..4).any(|f| layout.read(dir, f).is_err()));
                fs::remove_dir(&path).unwrap();
                fs::write(&path, &good).unwrap();
            }
            // The file of one array or table in the place of another.
            for pair in files.windows(2) {
                let (a, b) = (dir.join(&pair[0].path), dir.join(&pair[1].path));
                let (x, y) = (fs::read(&a).unwrap(), fs::read(&b).unwrap());
                fs::write(&a, &y).unwrap();
                fs::write(&b, &x).unwrap();
                let e = (2..4).find_map(|f| layout.read(dir, f).err());
                assert_broken(&e.expect("an error"), dir, "swapped");
                fs::write(&a, &x).unwrap();
                fs::write(&b, &y).unwrap();
            }
            assert_same(&layout.read(dir, 3).unwrap(), &sample(3));
        }
    }
}

#[test]
fn a_whole_shard_in_the_place_of_another_is_found_where_the_format_tells() {
    for format in formats() {
        let t = tempfile::tempdir().unwrap();
        let layout = layout_of(&sample(0), 4, 2, format, Compression::None);
        write_all(&layout, t.path(), &mut sample);
        let paths: [PathBuf; 2] = match format {
            Format::Zarr => [0, 1].map(|i| t.path().join(format!("tables/points/part-{i:06}.parquet"))),
            Format::Hdf5 => [0, 1].map(|i| t.path().join(format!("data/part-{i:06}.h5"))),
            Format::Frames => [0, 2].map(|i| t.path().join(format!("frame_{i:06}"))),
        };
        let aside = t.path().join("aside");
        fs::rename(&paths[0], &aside).unwrap();
        fs::rename(&paths[1], &paths[0]).unwrap();
        fs::rename(&aside, &paths[1]).unwrap();
        assert_broken(&layout.read(t.path(), 0).unwrap_err(), t.path(), "another shard");
    }
}

#[test]
fn rows_of_many_frames_fill_several_groups() {
    // 1500 frames of up to 99 rows: more than two groups of 32,768 rows, frames without rows among them.
    let make = |frame: u64| {
        let rows = (frame * 31 % 100) as usize * usize::from(!frame.is_multiple_of(7));
        let x = (0..rows).map(|i| frame as f64 + i as f64 / 128.0).collect();
        let name = (0..rows).map(|i| format!("{frame} {i}")).collect();
        Record {
            frame,
            arrays: vec![],
            tables: vec![table("points", vec![("x_m", Column::F64(x)), ("name", Column::Text(name))])],
        }
    };
    for format in formats().filter(|f| *f != Format::Frames) {
        let t = tempfile::tempdir().unwrap();
        let layout = layout_of(&make(1), 1500, 1500, format, Compression::None);
        write_all(&layout, t.path(), &mut |f| make(f));
        for frame in (0..1500).step_by(13).chain([1499]) {
            assert_same(&layout.read(t.path(), frame).unwrap(), &make(frame));
        }
    }
}

fn any_column(kind: ColumnKind, rows: usize) -> BoxedStrategy<Column> {
    use proptest::collection::vec;
    // NaNs of other payloads have no text of their own.
    let f64s = any::<f64>().prop_map(|x| if x.is_nan() { f64::NAN } else { x });
    let f32s = any::<f32>().prop_map(|x| if x.is_nan() { f32::NAN } else { x });
    match kind {
        ColumnKind::I64 => vec(any::<i64>(), rows).prop_map(Column::I64).boxed(),
        ColumnKind::U32 => vec(any::<u32>(), rows).prop_map(Column::U32).boxed(),
        ColumnKind::F64 => vec(f64s, rows).prop_map(Column::F64).boxed(),
        ColumnKind::F32 => vec(f32s, rows).prop_map(Column::F32).boxed(),
        ColumnKind::Bool => vec(any::<bool>(), rows).prop_map(Column::Bool).boxed(),
        ColumnKind::Text => vec("[^\0]{0,12}", rows).prop_map(Column::Text).boxed(),
    }
}

fn any_data(kind: ArrayKind, count: usize) -> BoxedStrategy<Data> {
    use proptest::collection::vec;
    let f32s = any::<u32>().prop_map(f32::from_bits);
    match kind {
        ArrayKind::C32 => vec((f32s.clone(), f32s).prop_map(|(a, b)| Complex32::new(a, b)), count)
            .prop_map(Data::C32)
            .boxed(),
        ArrayKind::F32 => vec(f32s, count).prop_map(Data::F32).boxed(),
        ArrayKind::U8 => vec(any::<u8>(), count).prop_map(Data::U8).boxed(),
        ArrayKind::I32 => vec(any::<i32>(), count).prop_map(Data::I32).boxed(),
    }
}

/// Arrays, columns and frames of any type and shape.
fn any_dataset() -> impl Strategy<Value = (DatasetLayout, Vec<Record>)> {
    let kinds = [ArrayKind::C32, ArrayKind::F32, ArrayKind::U8, ArrayKind::I32];
    let columns = [
        ColumnKind::I64,
        ColumnKind::U32,
        ColumnKind::F64,
        ColumnKind::F32,
        ColumnKind::Bool,
        ColumnKind::Text,
    ];
    let arrays = proptest::collection::vec(
        (proptest::sample::select(kinds.to_vec()), proptest::collection::vec(1usize..5, 0..4)),
        0..3,
    );
    let tables = proptest::collection::vec(
        proptest::collection::vec(proptest::sample::select(columns.to_vec()), 1..5),
        1..3,
    );
    let how = proptest::sample::select(
        formats().flat_map(|f| compressions(f).iter().map(move |c| (f, *c))).collect::<Vec<_>>(),
    );
    (arrays, tables, how, 1u64..6, 1u64..4).prop_flat_map(|(arrays, tables, how, frames, per_shard)| {
        let arrays: Vec<ArraySpec> = arrays
            .into_iter()
            .enumerate()
            .map(|(i, (kind, shape))| ArraySpec {
                compression: None,
                name: format!("array_{i}"),
                dims: (0..shape.len()).map(|d| format!("d{d}")).collect(),
                shape,
                kind,
                unit: "Ω".into(),
                about: "anything".into(),
            })
            .collect();
        let tables: Vec<TableSpec> = tables
            .into_iter()
            .enumerate()
            .map(|(i, kinds)| TableSpec {
                name: format!("table_{i}"),
                columns: kinds
                    .iter()
                    .enumerate()
                    .map(|(c, k)| ColumnSpec::new(&format!("c{c}"), *k))
                    .collect(),
                about: String::new(),
            })
            .collect();
        let layout = DatasetLayout {
            format: how.0,
            compression: how.1,
            frames,
            frames_per_shard: per_shard,
            arrays: arrays.clone(),
            tables: tables.clone(),
            attributes: Default::default(),
        };
        let record = move |frame: u64| {
            let data: Vec<_> = arrays.iter().map(|a| any_data(a.kind, a.count())).collect();
            let (arrays, tables) = (arrays.clone(), tables.clone());
            let rows = tables
                .iter()
                .map(|t| {
                    let columns = t.columns.clone();
                    (0usize..5).prop_flat_map(move |n| {
                        columns.iter().map(|c| any_column(c.kind, n)).collect::<Vec<_>>()
                    })
                })
                .collect::<Vec<_>>();
            (data, rows).prop_map(move |(data, rows)| Record {
                frame,
                arrays: arrays.iter().zip(data).map(|(spec, d)| Array::of(spec, d)).collect(),
                tables: tables
                    .iter()
                    .zip(rows)
                    .map(|(spec, columns)| Table {
                        name: spec.name.clone(),
                        columns: spec.columns.iter().map(|c| c.name.clone()).zip(columns).collect(),
                    })
                    .collect(),
            })
        };
        (Just(layout), (0..frames).map(record).collect::<Vec<_>>())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn round_trip((layout, records) in any_dataset()) {
        let t = tempfile::tempdir().unwrap();
        write_all(&layout, t.path(), &mut |f| records[f as usize].clone());
        let opened = DatasetLayout::open(t.path()).unwrap();
        for record in &records {
            assert_same(&opened.read(t.path(), record.frame).unwrap(), record);
        }
    }
}

/// Writes samples for `python/tests/readers/test_store.py` into the folder that `CATSEYE_SAMPLES` names.
#[test]
fn samples_for_other_readers() {
    let folder = std::env::var_os("CATSEYE_SAMPLES").map(PathBuf::from);
    let t = tempfile::tempdir().unwrap();
    let folder = folder.as_deref().unwrap_or(t.path());
    for format in formats() {
        for compression in compressions(format) {
            let name = format!("{}_{}", format.name(), compression.to_string().replace(':', "_"));
            let dir = folder.join(name);
            let layout = layout_of(&sample(0), 7, 3, format, *compression);
            for file in write_all(&layout, &dir, &mut sample) {
                assert_eq!(sha256_of_file(dir.join(&file.path)).unwrap(), file.sha256);
            }
        }
    }
}
