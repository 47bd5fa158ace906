//! What archives ask for beside a dataset: `croissant.json` (MLCommons Croissant 1.0 with its responsible-AI vocabulary,
//! <https://docs.mlcommons.org/croissant/docs/croissant-spec.html>), and the front matter that Hugging Face reads at the head of a README
//! (<https://huggingface.co/docs/hub/datasets-cards>).

use super::dataset::DatasetFile;
use super::store::{ColumnKind, DatasetLayout, FRAME, Format, TableSpec};
use serde_json::{Value, json};

/// Name of the file of Croissant's metadata.
pub const CROISSANT: &str = "croissant.json";

/// One sentence that says what the dataset is.
fn sentence(file: &DatasetFile, layout: &DatasetLayout) -> String {
    format!(
        "{} frames of automotive radar from {} scenes, simulated by catseye {}; nothing in them was measured.",
        layout.frames, file.scenes, file.catseye
    )
}

/// Files of a table below the dataset's folder, as a pattern, where a reader of Croissant or of Hugging Face opens them.
fn files_of_table(format: Format, table: &TableSpec) -> Option<(String, &'static str)> {
    match format {
        Format::Zarr => Some((format!("tables/{}/part-*.parquet", table.name), "application/x-parquet")),
        Format::Frames => Some((format!("frame_*/{}.csv", table.name), "text/csv")),
        // Tables in HDF5 are for readers of HDF5.
        Format::Hdf5 => None,
    }
}

fn data_type(kind: ColumnKind) -> &'static str {
    match kind {
        ColumnKind::I64 | ColumnKind::U32 => "sc:Integer",
        ColumnKind::F64 | ColumnKind::F32 => "sc:Float",
        ColumnKind::Bool => "sc:Boolean",
        ColumnKind::Text => "sc:Text",
    }
}

/// Content of [`CROISSANT`]: the files, the columns of each table, and what a careful user should know.
pub fn croissant(file: &DatasetFile, layout: &DatasetLayout) -> Value {
    let (mut files, mut records) = (Vec::new(), Vec::new());
    let mut set = |id: &str, includes: String, format: &str, about: &str| {
        files.push(json!({
            "@type": "cr:FileSet",
            "@id": id,
            "name": id,
            "description": about,
            "encodingFormat": format,
            "includes": includes,
        }));
    };
    if layout.format == Format::Hdf5 {
        let about = "a file a shard: arrays /NAME with frames along their first axis, and groups /tables/NAME with a dataset a column";
        set("shards", "data/part-*.h5".into(), "application/x-hdf5", about);
    } else {
        for a in &layout.arrays {
            let (includes, format) = match layout.format {
                Format::Zarr => (format!("{}/*", a.name), "application/vnd+zarr"),
                _ if a.compression.is_some() => (format!("frame_*/{}.npz", a.name), "application/zip"),
                _ => (format!("frame_*/{}.npy", a.name), "application/x-npy"),
            };
            let about = format!("{} {:?} of each frame, {}: {}", a.kind.name(), a.shape, a.unit, a.about);
            set(&format!("{}-array", a.name), includes, format, &about);
        }
    }
    for table in &layout.tables {
        let Some((includes, format)) = files_of_table(layout.format, table) else { continue };
        let id = format!("{}-files", table.name);
        set(&id, includes, format, &table.about);
        let field = |name: &str, kind: ColumnKind, about: &str| {
            json!({
                "@type": "cr:Field",
                "@id": format!("{}/{name}", table.name),
                "name": name,
                "description": about,
                "dataType": data_type(kind),
                "source": { "fileSet": { "@id": id }, "extract": { "column": name } },
            })
        };
        let mut fields = vec![field(FRAME, ColumnKind::I64, "number of the frame")];
        fields.extend(table.columns.iter().map(|c| field(&c.name, c.kind, &c.about)));
        records.push(json!({
            "@type": "cr:RecordSet",
            "@id": table.name,
            "name": table.name,
            "description": table.about,
            "field": fields,
        }));
    }
    let mut card = json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "conformsTo": ["http://mlcommons.org/croissant/1.0", "http://mlcommons.org/croissant/RAI/1.0"],
        "name": file.name,
        "description": sentence(file, layout),
        "version": file.catseye,
        "citeAs": format!(
            "{}: {} Seed {}, recipe {}.", file.name, sentence(file, layout), file.seed, file.recipe
        ),
        "keywords": ["automotive radar", "FMCW", "synthetic data", "range-Doppler", "point cloud"],
        "isLiveDataset": false,
        "rai:dataCollection": format!(
            "Computed: scenes are drawn from the recipe in dataset.json with seed {} and simulated by physical optics. Nothing was recorded.", file.seed
        ),
        "rai:dataCollectionType": "Software Collection",
        "rai:dataPreprocessingProtocol": "Range and Doppler transforms, CFAR and angle estimation as the radar of the recipe says.",
        "rai:dataAnnotationProtocol": "Labels follow from the scene: each point names the object whose echoes made it, by the response of the radar.",
        "rai:machineAnnotationTools": [format!("catseye {}", file.catseye)],
        "rai:personalSensitiveInformation": "None: no person, place or vehicle of the real world is recorded.",
        "rai:dataUseCases": "Training and testing of radar detection, segmentation, tracking and lane estimation; comparison of waveforms and arrays.",
        "rai:dataLimitations": "What the simulator leaves out, the data leave out. Scores on them say nothing about measured radar until they were compared with it.",
        "rai:dataBiases": "Roads, vehicles and weather have the distributions of the recipe, which need not be those of any place or time.",
        "rai:dataReleaseMaintenancePlan": "The same recipe, seed, version and device make the same bytes again.",
    });
    if let Some(licence) = &file.licence {
        card["license"] = licence.clone().into();
    }
    card["distribution"] = files.into();
    card["recordSet"] = records.into();
    card
}

/// The context that Croissant 1.0 prescribes.
fn context() -> Value {
    let of_cr = [
        "citeAs",
        "column",
        "extract",
        "field",
        "fileProperty",
        "fileObject",
        "fileSet",
        "format",
        "includes",
        "isLiveDataset",
        "jsonPath",
        "key",
        "md5",
        "parentField",
        "path",
        "recordSet",
        "references",
        "regex",
        "repeated",
        "replace",
        "samplingRate",
        "separator",
        "source",
        "subField",
        "transform",
    ];
    let mut all = json!({
        "@language": "en",
        "@vocab": "https://schema.org/",
        "conformsTo": "dct:conformsTo",
        "cr": "http://mlcommons.org/croissant/",
        "rai": "http://mlcommons.org/croissant/RAI/",
        "data": { "@id": "cr:data", "@type": "@json" },
        "dataType": { "@id": "cr:dataType", "@type": "@vocab" },
        "dct": "http://purl.org/dc/terms/",
        "equivalentProperty": "cr:equivalentProperty",
        "examples": { "@id": "cr:examples", "@type": "@json" },
        "sc": "https://schema.org/",
    });
    for name in of_cr {
        all[name] = format!("cr:{name}").into();
    }
    all
}

/// Licences that Hugging Face knows by these names.
const KNOWN_LICENCES: [&str; 9] = [
    "apache-2.0",
    "mit",
    "cc0-1.0",
    "cc-by-4.0",
    "cc-by-sa-4.0",
    "cc-by-nc-4.0",
    "cc-by-nc-sa-4.0",
    "bsd-3-clause",
    "odc-by",
];

/// YAML at the head of a dataset's README, with its lines of dashes. Values are quoted as JSON is, which YAML reads alike.
pub fn front_matter(file: &DatasetFile, layout: &DatasetLayout) -> String {
    let quoted = |text: &str| Value::from(text).to_string();
    let mut yaml = format!("---\npretty_name: {}\n", quoted(&file.name));
    if let Some(licence) = &file.licence {
        let known = licence.to_ascii_lowercase();
        yaml += &match KNOWN_LICENCES.contains(&&*known) {
            true => format!("license: {known}\n"),
            false => format!("license: other\nlicense_name: {}\n", quoted(licence)),
        };
    }
    let size = match layout.frames {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        1_000_000..10_000_000 => "1M<n<10M",
        _ => "10M<n<100M",
    };
    yaml += &format!(
        "tags:\n- radar\n- automotive\n- fmcw\n- synthetic\n- catseye\ntask_categories:\n- object-detection\nannotations_creators:\n- machine-generated\nsource_datasets:\n- original\nsize_categories:\n- {}\n",
        quoted(size)
    );
    let configs = layout.tables.iter().filter_map(|t| Some((&t.name, files_of_table(layout.format, t)?.0)));
    let configs: String = configs
        .map(|(name, files)| format!("- config_name: {}\n  data_files: {}\n", quoted(name), quoted(&files)))
        .collect();
    if !configs.is_empty() {
        yaml += &format!("configs:\n{configs}");
    }
    yaml + "---\n\n"
}
