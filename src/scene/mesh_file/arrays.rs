//! Meshes from arrays.

use crate::base::error::{BadInput, Result};
use crate::base::frames::Pose;
use crate::scene::gltf::{MAX_TRIANGLES, MAX_VERTICES};
use crate::scene::tidy::{check_smooth_deg, drop_degenerate, drop_unused_vertices, tidy};
use crate::scene::{Mesh, Scene, material};
use glam::DVec3;

/// A mesh as a program has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshArrays {
    /// Corners, `[vertex]`, m in ISO 8855 axes (x forward, y left, z up).
    pub vertices_m: Vec<DVec3>,
    /// Vertices of each triangle, from 0, counter-clockwise seen from outside.
    pub triangles: Vec<[i64; 3]>,
    /// Normals of the smooth surface that the facets stand for, of any length, one for each vertex; zero where the facets are
    /// flat. None when all facets are flat.
    pub normals: Option<Vec<DVec3>>,
    /// Radar materials as [`material::parse_spec`] reads them: one for all triangles, or one for each.
    pub materials: Vec<String>,
    /// Edges that turn by more are creases, degrees. None: 30, and a mesh without normals is flat ([`crate::scene::creases`]).
    pub smooth_deg: Option<f64>,
}

/// A scene of one object with this mesh. Triangles without area and vertices without a triangle are dropped; a note tells of the former.
///
/// # Errors
/// Returns `BadInput` with the argument's name and the row for corners that are not finite or are 1e9 m away, indices of
/// vertices that do not exist, normals or materials in another number, and a mesh without any triangle.
///
/// # Example
/// A square metal plate of two triangles that faces the x axis, and its cross section 4πA²/λ² along the normal.
///
/// ```
/// use catseye::base::units::dbsm_from_amplitude;
/// use catseye::engine::{Engine, Precision};
/// use catseye::rcs::{Aspect, BistaticAspect, RcsOptions};
/// use catseye::scene::mesh_file::{MeshArrays, from_arrays};
/// use glam::DVec3;
///
/// let corner = |y_m: f64, z_m: f64| DVec3::new(0.0, y_m, z_m);
/// let plate = MeshArrays {
///     vertices_m: vec![corner(-0.05, -0.05), corner(0.05, -0.05), corner(0.05, 0.05), corner(-0.05, 0.05)],
///     triangles: vec![[0, 1, 2], [0, 2, 3]],
///     materials: vec!["pec".into()],
///     ..Default::default()
/// };
/// let scene = from_arrays("plate", "target", plate)?;
/// let ahead = BistaticAspect::monostatic(Aspect { azimuth: 0.0, elevation: 0.0 });
/// let engine = Engine::open("cpu", Precision::F32)?;
/// let s = engine.rcs(&scene, &[77e9], &[ahead], &RcsOptions::default())?[0];
/// assert!((dbsm_from_amplitude(s.every[0][0].norm()) - 19.19).abs() < 0.01);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn from_arrays(name: &str, class: &str, arrays: MeshArrays) -> Result<Scene> {
    let MeshArrays { vertices_m, triangles, normals, materials, smooth_deg } = arrays;
    let smooth_deg = smooth_deg.map(check_smooth_deg).transpose()?;
    let (vertices, count) = (vertices_m.len(), triangles.len());
    for (key, count, most) in [("vertices_m", vertices, MAX_VERTICES), ("triangles", count, MAX_TRIANGLES)] {
        if count > most {
            let bad = BadInput::new("has too many rows").key(key).value(count);
            return Err(bad.allowed(format!("up to {most}")).remedy("split the mesh").into());
        }
    }
    if let Some(i) = vertices_m.iter().position(|p| !(p.is_finite() && p.length() < 1e9)) {
        return Err(BadInput::new("is not a finite position below 1e9 m")
            .key(format!("vertices_m[{i}]"))
            .value(vertices_m[i])
            .remedy("give coordinates in m")
            .into());
    }
    let inside = |v: &i64| usize::try_from(*v).is_ok_and(|v| v < vertices);
    if let Some(i) = triangles.iter().position(|t| !t.iter().all(inside)) {
        return Err(BadInput::new("names a vertex that does not exist")
            .key(format!("triangles[{i}]"))
            .value(format!("{:?}", triangles[i]))
            .allowed(match vertices {
                0 => "none: there are no vertices".into(),
                n => format!("0..={}", n - 1),
            })
            .into());
    }
    let normals = match normals {
        Some(n) if n.len() != vertices => {
            let bad = BadInput::new("must have as many rows as vertices_m").key("normals");
            return Err(bad.value(n.len()).allowed(vertices.to_string()).into());
        }
        Some(n) => n,
        None => Vec::new(),
    };
    if let Some(i) = normals.iter().position(|n| !n.is_finite()) {
        let bad = BadInput::new("is not finite").key(format!("normals[{i}]")).value(normals[i]);
        return Err(bad.remedy("give zero where the facets are flat").into());
    }
    if materials.len() != 1 && materials.len() != count {
        return Err(BadInput::new("must have one name, or one for each triangle")
            .key("material")
            .value(format!("{} names", materials.len()))
            .allowed(format!("1 or {count}"))
            .into());
    }
    let mut scene = Scene::default();
    let mut indices: Vec<u32> = Vec::with_capacity(count);
    for (i, spec) in materials.iter().enumerate() {
        let index = match i.checked_sub(1) {
            // Neighbours are mostly of one material.
            Some(before) if materials[before] == *spec => indices[before],
            _ => scene.material_index(&material::parse_spec(spec)?),
        };
        indices.push(index);
    }
    if let [only] = indices[..] {
        indices = vec![only; count];
    }
    let mut mesh = Mesh {
        positions_m: vertices_m,
        triangles: triangles.iter().map(|t| t.map(|v| v as u32)).collect(),
        material: indices,
        normals: normals.into_iter().map(DVec3::normalize_or_zero).collect(),
    };
    let dropped = drop_degenerate(&mut mesh);
    if mesh.triangles.is_empty() {
        let why = if dropped > 0 { format!(" ({dropped} have no area)") } else { String::new() };
        return Err(BadInput::new(format!("there are no triangles{why}")).key("triangles").into());
    }
    if dropped > 0 {
        scene.import.degenerate_triangles_dropped = dropped;
        scene.import.notes.push(format!("{dropped} triangles without area are left out"));
    }
    drop_unused_vertices(&mut mesh);
    scene.add_mesh(name, class, mesh, Pose::IDENTITY);
    tidy(&mut scene, smooth_deg, false);
    scene.import.triangles = scene.triangle_count();
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Shape;

    /// A square in two triangles, a triangle without area, and a vertex that nothing uses.
    fn square() -> MeshArrays {
        MeshArrays {
            vertices_m: [[9.0, 9.0, 9.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]
                .map(DVec3::from)
                .to_vec(),
            triangles: vec![[1, 2, 3], [1, 1, 3], [1, 3, 4]],
            normals: None,
            materials: vec!["pec".into()],
            smooth_deg: None,
        }
    }

    #[test]
    fn what_has_no_area_or_no_use_is_dropped() {
        let scene = from_arrays("wall", "sign", square()).unwrap();
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.positions_m.len(), &mesh.triangles), (4, &vec![[0, 1, 2], [0, 2, 3]]));
        assert_eq!((mesh.material.len(), scene.import.notes.len()), (2, 1));
        assert!(matches!(scene.objects[0].shape, Shape::Mesh(0)));
        let several =
            MeshArrays { materials: ["pec", "steel", "steel"].map(String::from).to_vec(), ..square() };
        let scene = from_arrays("", "", several).unwrap();
        assert_eq!((&scene.meshes[0].material, scene.materials.len()), (&vec![0, 1], 2));
    }

    #[test]
    fn normals_count_where_they_leave_the_facets() {
        let along = |n: [f64; 3]| MeshArrays { normals: Some(vec![DVec3::from(n); 5]), ..square() };
        assert!(from_arrays("", "", along([2.0, 0.0, 0.0])).unwrap().meshes[0].normals.is_empty());
        // A plane stays one, whatever its normals say.
        assert!(from_arrays("", "", along([3.0, 0.0, 4.0])).unwrap().meshes[0].normals.is_empty());
        // A quarter of a tube in six strips is curved with its own normals, and with those that an angle asks for.
        let strips = |normals: bool, smooth_deg: Option<f64>| {
            let turn =
                |i: u32| DVec3::new(f64::from(i).to_radians().cos(), f64::from(i).to_radians().sin(), 0.0);
            let vertices_m: Vec<DVec3> =
                (0..=6).flat_map(|i| [turn(15 * i), turn(15 * i) + DVec3::Z]).collect();
            MeshArrays {
                normals: normals.then(|| vertices_m.iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect()),
                triangles: (0..6)
                    .flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]])
                    .collect(),
                vertices_m,
                materials: vec!["pec".into()],
                smooth_deg,
            }
        };
        let is_smooth = |arrays| from_arrays("", "", arrays).unwrap().meshes[0].is_smooth();
        assert!(is_smooth(strips(true, None)) && is_smooth(strips(false, Some(20.0))));
        assert!(!is_smooth(strips(false, None)) && !is_smooth(strips(true, Some(10.0))));
    }

    #[test]
    fn wrong_arrays_are_named() {
        let not_finite = DVec3::new(0.0, f64::NAN, 0.0);
        let mut holes = square();
        holes.vertices_m[2] = not_finite;
        let cases = [
            (holes, ["vertices_m[2]", "finite position"]),
            (MeshArrays { triangles: vec![[0, 1, 2], [1, 2, 5]], ..square() }, ["triangles[1]", "0..=4"]),
            (MeshArrays { triangles: vec![[-1, 1, 2]], ..square() }, ["triangles[0]", "[-1, 1, 2]"]),
            (MeshArrays { vertices_m: vec![], ..square() }, ["triangles[0]", "no vertices"]),
            (MeshArrays { triangles: vec![], ..square() }, ["triangles", "no triangle"]),
            (MeshArrays { triangles: vec![[1, 1, 2]], ..square() }, ["triangles", "1 have no area"]),
            (MeshArrays { normals: Some(vec![DVec3::Z]), ..square() }, ["normals = 1", "5"]),
            (MeshArrays { normals: Some(vec![not_finite; 5]), ..square() }, ["normals[0]", "not finite"]),
            (MeshArrays { materials: vec!["pec".into(); 2], ..square() }, ["material = 2 names", "1 or 3"]),
            (MeshArrays { materials: vec!["chees".into()], ..square() }, ["chees", "material"]),
        ];
        for (arrays, parts) in cases {
            let text = from_arrays("", "", arrays).unwrap_err().to_string();
            assert!(parts.iter().all(|p| text.contains(p)), "{text}");
        }
    }
}
