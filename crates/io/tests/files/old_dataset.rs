//! A dataset of version 1 of the format, which an earlier program made, is read as before.

use catseye_io::dataset::DatasetFile;
use catseye_io::store::{Column, Data, DatasetLayout};
use catseye_io::verify::verify;
use std::io::Cursor;

#[test]
fn datasets_of_version_1_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = include_bytes!("../dataset_v1.zip");
    zip::ZipArchive::new(Cursor::new(bytes)).unwrap().extract(dir.path()).unwrap();
    let file = DatasetFile::read(dir.path()).unwrap();
    assert_eq!((file.version, file.radars.is_none()), (1, true));
    // It has two of its six shards.
    let found = verify(dir.path(), &|_| ()).unwrap();
    let problems: Vec<&str> = found.problems.iter().map(|p| p.problem).collect();
    assert_eq!((problems, found.shards_complete), (vec!["missing manifest", "missing shards"], 2));
    let layout = DatasetLayout::open(dir.path()).unwrap();
    // Its splits are by rank, and those that the reader tells are those that its frames say.
    let recipe = file.recipe(dir.path()).unwrap();
    assert_eq!(recipe.split_counts(), [3, 2, 1]);
    for frame in 0..2 {
        let record = layout.read(dir.path(), frame).unwrap();
        let frames = record.tables.iter().find(|t| t.name == "frames").unwrap();
        let Some(Column::Text(split)) = frames.column("split") else { panic!("no split") };
        assert_eq!(split[0], recipe.split(frame as u32));
        let mask = record.arrays.iter().find(|a| a.name == "mask_road").unwrap();
        let Data::U8(classes) = &mask.data else { panic!("no classes") };
        assert!(mask.shape == [450, 300] && classes.contains(&1));
    }
}
