//! Materials, in and out.

use super::importer::Importer;
use super::options::ImportOptions;
use crate::base::error::{BadInput, Error, Result, nearest};
use crate::scene::backscatter::Backscatter;
use crate::scene::material::{self, Given, Layer, Material, MaterialKind};
use crate::scene::toml_file::clip;
use gltf::json;
use json::mesh::Mode;
use json::validation::Checked;
use serde_json::{Map, Value};
use std::path::Path;

impl Importer<'_> {
    /// Fills `self.materials` for the materials that the scene uses, in file order.
    pub(super) fn resolve_materials(&mut self, order: &[(usize, Option<usize>)]) -> Result<()> {
        let count = self.root.materials.len();
        let mut used = vec![false; count + 1];
        for (node, _) in order {
            let key = format!("nodes[{node}].extras.catseye");
            if self.extras(&self.root.nodes[*node].extras, &key)?.is_some_and(|m| m.contains_key("rcs_table"))
            {
                continue;
            }
            let Some(mesh) = self.root.nodes[*node].mesh.and_then(|m| self.root.meshes.get(m.value())) else {
                continue;
            };
            for p in &mesh.primitives {
                let solid = matches!(
                    p.mode,
                    Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
                );
                let slot = p.material.map_or(count, |m| m.value());
                if let Some(u) = used.get_mut(slot).filter(|_| solid) {
                    *u |= slot < count || p.material.is_none();
                }
            }
        }
        let names: Vec<String> =
            self.root.materials.iter().map(|m| m.name.clone().unwrap_or_default()).collect();
        check_material_map(self.file, &names, self.options)?;
        for slot in (0..=count).filter(|s| used[*s]) {
            let m = match names.get(slot) {
                Some(name) => self.material(slot, name)?,
                None => choose_material(self.file, "", None, self.options)?.0,
            };
            self.materials[slot] = Some(self.scene.material_index(&m));
        }
        Ok(())
    }

    fn material(&mut self, slot: usize, name: &str) -> Result<Material> {
        let key = format!("materials[{slot}].extras.catseye");
        let mapped = self.options.material_map.iter().any(|(from, _)| from == name);
        let extras = if mapped { None } else { self.extras(&self.root.materials[slot].extras, &key)? };
        let Some(extras) = extras else {
            let key = format!("materials[{slot}].name");
            let (m, note) = choose_material(self.file, &key, Some(name), self.options)?;
            note.into_iter().for_each(|n| self.note(n));
            return Ok(m);
        };
        self.custom_material(&key, name, &extras, row(name).ok())
    }

    /// `[{"material": "water", "thickness_m": 1e-4}, ...]`, the outermost first. Instead of a material's
    /// name, or with it, a layer may have the other keys of a material.
    pub(super) fn layers(&self, key: &str, value: &Value) -> Result<Vec<Layer>> {
        let list = value.as_array().ok_or_else(|| {
            self.bad(key, "is not a list of layers")
                .value(clip(&value.to_string()))
                .allowed(r#"[{"material": NAME, "thickness_m": x}, ...], the outermost first"#)
        })?;
        list.iter()
            .enumerate()
            .map(|(i, layer)| {
                let key = format!("{key}[{i}]");
                let mut own = layer
                    .as_object()
                    .ok_or_else(|| self.bad(&key, "is not an object").value(clip(&layer.to_string())))?
                    .clone();
                let thickness_key = format!("{key}.thickness_m");
                let (lo, hi) = material::THICKNESS_M;
                let thickness = own.remove("thickness_m").ok_or_else(|| {
                    self.bad(&thickness_key, "is missing")
                        .allowed(format!("{lo:e}..{hi} m"))
                        .remedy("give the layer's thickness in metres")
                })?;
                let thickness_m = self.number(&thickness, &thickness_key, lo..=hi)?;
                let mut text = |name: &str| -> Result<Option<String>> {
                    own.remove(name)
                        .map(|v| {
                            v.as_str().map(str::to_string).ok_or_else(|| {
                                self.bad(format!("{key}.{name}"), "is not a name")
                                    .value(clip(&v.to_string()))
                                    .into()
                            })
                        })
                        .transpose()
                };
                let (row, given) = (text("material")?, text("name")?);
                let name = given.or(row.clone()).unwrap_or_else(|| "layer".into());
                let row = row
                    .map(|n| material::by_name(&n).map_err(|e| self.at(&format!("{key}.material"), e)))
                    .transpose()?;
                let material = match row {
                    Some(m) if own.is_empty() => Material { name, ..m },
                    row => self.custom_material(&key, &name, &own, row)?,
                };
                Layer::new(material, thickness_m).map_err(|e| self.at(&key, e))
            })
            .collect()
    }

    pub(super) fn custom_material(
        &self,
        prefix: &str,
        name: &str,
        extras: &Map<String, Value>,
        row: Option<Material>,
    ) -> Result<Material> {
        const KEYS: [&str; 9] = [
            "like",
            "eps_r",
            "conductivity_s_per_m",
            "roughness_rms_m",
            "correlation_length_m",
            "backscatter",
            "valid_hz",
            "source",
            "layers",
        ];
        let mut base = row;
        if let Some(like) = extras.get("like") {
            let key = format!("{prefix}.like");
            let like = like
                .as_str()
                .ok_or_else(|| self.bad(&key, "is not a name").value(clip(&like.to_string())))?;
            base = Some(material::parse_spec(like).map_err(|e| match e {
                Error::Input(b) => b.file(self.file).key(key).into(),
                e => e,
            })?);
        }
        let mut given = Given::default();
        let mut layers = None;
        for (k, v) in extras {
            let key = format!("{prefix}.{k}");
            match k.as_str() {
                "like" => {}
                "eps_r" => {
                    let [re, loss] = self.numbers::<2>(v, &key, 1e9)?;
                    if re <= 0.0 || loss < 0.0 {
                        return Err(self
                            .bad(
                                key,
                                if loss < 0.0 {
                                    "eps'' is negative, which is gain"
                                } else {
                                    "eps' is not positive"
                                },
                            )
                            .value(clip(&v.to_string()))
                            .allowed("eps' above 0, eps'' (loss) 0 or more")
                            .remedy("give [eps', eps''] with eps = eps' - j eps''")
                            .into());
                    }
                    given.eps_r = Some([re, loss]);
                }
                "conductivity_s_per_m" => {
                    given.conductivity_s_per_m = Some(self.number(v, &key, 0.0..=1e12)?)
                }
                "roughness_rms_m" => given.roughness_rms_m = Some(self.number(v, &key, 0.0..=1.0)?),
                "correlation_length_m" => {
                    given.correlation_length_m = Some(self.number(v, &key, 0.0..=1000.0)?)
                }
                "backscatter" => {
                    let text = v
                        .as_str()
                        .ok_or_else(|| self.bad(&key, "is not a string").value(clip(&v.to_string())))?;
                    given.backscatter = Some(Backscatter::parse(text).map_err(|e| self.at(&key, e))?);
                }
                "valid_hz" => {
                    let list = self.numbers::<2>(v, &key, 1e18)?;
                    if list[0] < 0.0 || list[0] >= list[1] {
                        return Err(self
                            .bad(key, "is not a range")
                            .value(clip(&v.to_string()))
                            .remedy("give [lowest, highest] in hertz")
                            .into());
                    }
                    given.valid_hz = Some((list[0], list[1]));
                }
                "source" => {
                    given.source = Some(
                        v.as_str()
                            .ok_or_else(|| self.bad(&key, "is not a string").value(clip(&v.to_string())))?
                            .to_string(),
                    )
                }
                "layers" => layers = Some(self.layers(&key, v)?),
                _ => return Err(self.unknown_key(prefix, k, &KEYS).into()),
            }
        }
        let mut m = given.over(name, base, GIVEN).ok_or_else(|| {
            self.bad(prefix, format!("does not state what '{}' is made of", clip(name)))
                .allowed(KEYS.join(", "))
                .remedy("give eps_r, conductivity_s_per_m, or like = the name of a table row")
        })?;
        if let Some(layers) = layers {
            m = m.with_layers(layers).map_err(|e| self.at(prefix, e))?;
        }
        Ok(m)
    }
}

/// The row of the table with a file's name of a material. Blender numbers copies: "steel.001" is steel.
fn row(name: &str) -> Result<Material> {
    let plain = name.rsplit_once('.').filter(|(_, n)| n.len() == 3 && n.bytes().all(|b| b.is_ascii_digit()));
    material::parse_spec(name).or_else(|e| plain.map_or(Err(e), |(base, _)| material::by_name(base)))
}

/// The radar material for a file's material of that name, or for surfaces without one: as the options map it, the row of the table, the
/// options' default (with a note that it was taken). `key` is where the name stands in the file.
///
/// # Errors
/// Returns an error if neither the options nor the table give a material.
pub fn choose_material(
    file: &Path,
    key: &str,
    name: Option<&str>,
    options: &ImportOptions,
) -> Result<(Material, Option<String>)> {
    let default = options.default_material.as_deref().map(material::parse_spec).transpose()?;
    let Some(name) = name else {
        let missing = || {
            BadInput::new("a surface has no material")
                .file(file)
                .allowed_whole(material::names().collect::<Vec<_>>().join(", "))
                .remedy("give --default-material MATERIAL, or materials in the file")
        };
        return Ok((default.ok_or_else(missing)?, None));
    };
    if let Some((_, to)) = options.material_map.iter().find(|(from, _)| from == name) {
        return Ok((material::parse_spec(to)?, None));
    }
    match (row(name), default) {
        (Ok(m), _) => Ok((m, None)),
        (Err(_), Some(d)) => {
            let note = format!("material '{}' is replaced by {}, the default", clip(name), d.name);
            Ok((d, Some(note)))
        }
        (Err(Error::Input(e)), None) => {
            let e = e.file(file).key(key).value(clip(name));
            Err(match e.remedy {
                Some(_) => e,
                None => e.remedy("map it with --material NAME=MATERIAL or give --default-material"),
            }
            .into())
        }
        (Err(e), None) => Err(e),
    }
}

/// Checks the options' map of materials.
///
/// # Errors
/// Returns an error if the options name a material that is none, or one that is not among the file's `names`.
pub fn check_material_map(file: &Path, names: &[String], options: &ImportOptions) -> Result<()> {
    for (from, to) in &options.material_map {
        material::parse_spec(to)?;
        if names.contains(from) {
            continue;
        }
        let listed: Vec<&str> = names.iter().filter(|n| !n.is_empty()).map(String::as_str).collect();
        let b = BadInput::new("no material of the file has this name").file(file).key("material");
        let b = b.value(clip(from)).allowed(clip_list(&listed));
        return Err(match nearest(from, listed) {
            Some(n) => b.remedy(format!("did you mean '{n}'?")),
            None => b.remedy("correct the name"),
        }
        .into());
    }
    Ok(())
}

/// Whether a file that keeps only the name of a material says all of it.
pub fn is_known_by_name(m: &Material) -> bool {
    material_extras(m).is_ok_and(|extras| extras.is_empty())
}

/// Source of a material whose values stand in the file.
pub(super) const GIVEN: &str = "given in the glTF file";

pub(super) fn clip_list(list: &[&str]) -> String {
    let shown: Vec<String> = list.iter().take(40).map(|n| clip(n)).collect();
    if shown.is_empty() {
        return "none, the file has no named materials".into();
    }
    shown.join(", ") + if list.len() > 40 { ", ..." } else { "" }
}

pub(super) fn material_json(m: &Material) -> Result<Value, String> {
    use serde_json::json;
    let shine = match m.kind {
        MaterialKind::Pec | MaterialKind::Conductor { .. } if m.layers.is_empty() => {
            json!({"baseColorFactor": [0.7, 0.72, 0.75, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.4})
        }
        _ => json!({"baseColorFactor": [0.3, 0.3, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}),
    };
    let mut out = json!({"name": m.name, "doubleSided": true, "pbrMetallicRoughness": shine});
    let extras = material_extras(m)?;
    if !extras.is_empty() {
        out["extras"] = json!({"catseye": extras});
    }
    Ok(out)
}

/// What has to be said of a material beside its name for import to find it again.
pub(super) fn material_extras(m: &Material) -> Result<Map<String, Value>, String> {
    use serde_json::json;
    let row = material::parse_spec(&m.name).ok();
    let mut extras = Map::new();
    if row.as_ref() == Some(m) {
        return Ok(extras);
    }
    // What import takes for the rest when it reads this back.
    let mut assumed = Material {
        valid_hz: (0.0, f64::INFINITY),
        source: GIVEN.into(),
        roughness_rms_m: row.as_ref().map_or(0.0, |r| r.roughness_rms_m),
        correlation_length_m: row.as_ref().map_or(0.0, |r| r.correlation_length_m),
        backscatter: row.as_ref().and_then(|r| r.backscatter),
        layers: row.as_ref().map_or(Vec::new(), |r| r.layers.clone()),
        ..m.clone()
    };
    match (&m.kind, row.filter(|r| r.kind == m.kind)) {
        (_, Some(r)) => assumed = r,
        (MaterialKind::Conductor { conductivity_s_per_m }, None) => {
            extras.insert("conductivity_s_per_m".into(), json!(conductivity_s_per_m));
        }
        (MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m }, None) => {
            extras.insert("eps_r".into(), json!([eps_real, eps_loss]));
            extras.insert("conductivity_s_per_m".into(), json!(conductivity_s_per_m));
        }
        (kind, None) => match material::table().iter().find(|r| r.kind == *kind) {
            Some(r) => {
                extras.insert("like".into(), json!(r.name));
                assumed = r.clone();
            }
            None => return Err(format!("material '{}' follows a law that no row of the table has", m.name)),
        },
    }
    if m.roughness_rms_m != assumed.roughness_rms_m {
        extras.insert("roughness_rms_m".into(), json!(m.roughness_rms_m));
    }
    if m.correlation_length_m != assumed.correlation_length_m {
        extras.insert("correlation_length_m".into(), json!(m.correlation_length_m));
    }
    match m.backscatter {
        Some(b) if m.backscatter != assumed.backscatter => {
            extras.insert("backscatter".into(), json!(b.to_string()));
        }
        _ => {}
    }
    if m.valid_hz != assumed.valid_hz {
        extras.insert("valid_hz".into(), json!([m.valid_hz.0, m.valid_hz.1.min(1e18)]));
    }
    if m.source != assumed.source {
        extras.insert("source".into(), json!(m.source));
    }
    if m.layers != assumed.layers {
        let layers = m.layers.iter().map(layer_json).collect::<Result<Vec<_>, _>>()?;
        extras.insert("layers".into(), layers.into());
    }
    Ok(extras)
}

pub(super) fn layer_json(layer: &Layer) -> Result<Value, String> {
    let m = &layer.material;
    let mut out = material_extras(m)?;
    let is_row = material::by_name(&m.name).is_ok();
    out.insert(if is_row { "material" } else { "name" }.into(), m.name.clone().into());
    out.insert("thickness_m".into(), layer.thickness_m.into());
    Ok(out.into())
}
