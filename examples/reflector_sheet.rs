//! Draws every reflector of the library on one sheet: `cargo run --release --example reflector_sheet --
//! docs/images/reflectors.png`.

use catseye::road::reflector::{Reflector, kinds};
use catseye::scene::Mesh;
use catseye_plot::{SolidView, solid_sheet};

/// What is drawn instead of the defaults where those are too thin, too many or too far apart to be seen.
const SHOWN: [(&str, &str); 12] = [
    ("type1", "type1:height_m=0.015,length_m=0.04"),
    ("type2", "type2:height_m=0.015,slant_deg=20"),
    ("type3", "type3:width_m=0.026,sagitta_m=3e-5"),
    ("type4", "type4:height_m=0.015,radius_m=0.12,length_m=0.04"),
    ("crossing", "crossing:height_m=0.02,thickness_m=0.003"),
    ("string", "string:element=crossing,spacing_m=0.25,height_m=0.015,number=4"),
    ("stripes", "stripes:width_m=0.06,depth_m=0.04"),
    ("crossed-stripes", "crossed-stripes:width_m=0.06,depth_m=0.04"),
    ("stepped", "stepped:height_m=0.015,step_m=0.006"),
    ("chaff", "chaff:wires=600,strip_m=0.0004,width_m=0.05,depth_m=0.03"),
    ("manhole-round", "manhole-round:ribs=5,relief_m=0.02,pattern_m=0.01,sagitta_m=2e-4"),
    ("manhole-square", "manhole-square:studs=6,relief_m=0.02,pattern_m=0.01"),
];

fn main() -> Result<(), catseye::base::error::Error> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "reflectors.png".into());
    let mut drawn: Vec<(String, Mesh)> = Vec::new();
    for kind in kinds() {
        let spec = SHOWN.iter().find(|s| s.0 == kind.name).map_or(kind.name, |s| s.1);
        if let Some(mesh) = Reflector::parse(spec)?.mesh() {
            drawn.push((kind.name.to_string(), mesh));
        }
    }
    let filled = Reflector::parse("type1:height_m=0.015,length_m=0.04,fill=ice")?;
    drawn.extend(filled.mesh().map(|m| ("type1, filled".to_string(), m)));
    let views: Vec<SolidView> = drawn.iter().map(|(name, mesh)| SolidView::new(name, &[], mesh)).collect();
    let picture = solid_sheet("Reflectors and roadside objects", &views, 5)?;
    println!("{}", picture.write(&out, true)?.display());
    Ok(())
}
