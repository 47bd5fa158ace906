//! Where nodes are: their transforms in the file's axes, and the change to ISO axes.

use super::importer::Importer;
use super::importer::Keys;
use super::options::RIGID;
use crate::base::error::Result;
use crate::base::frames::{Pose, Target, World};
use crate::scene::toml_file::clip;
use glam::{DAffine3, DMat3, DQuat, DVec3};

impl Importer<'_> {
    /// The node's own transform in the file's axes and unit.
    pub(super) fn local(&self, i: usize) -> Result<DAffine3> {
        let key = format!("nodes[{i}]");
        let n = self.nodes.get(i).ok_or_else(|| self.bad(&key, "is not readable"))?;
        if let Some(m) = n.matrix {
            if self.moves.contains_key(&i) {
                return Err(self
                    .bad(
                        format!("{key}.matrix"),
                        format!("{} is animated and has a matrix", self.node_called(i)),
                    )
                    .remedy("give it translation, rotation and scale instead")
                    .into());
            }
            if n.translation.is_some() || n.rotation.is_some() || n.scale.is_some() {
                return Err(self
                    .bad(key, "has a matrix and translation, rotation or scale")
                    .remedy("keep one of the two")
                    .into());
            }
            let affine =
                m[3].abs() < 1e-6 && m[7].abs() < 1e-6 && m[11].abs() < 1e-6 && (m[15] - 1.0).abs() < 1e-6;
            if !affine {
                return Err(self
                    .bad(format!("{key}.matrix"), "is not affine")
                    .allowed("a last row of 0, 0, 0, 1 (column-major)")
                    .remedy("export the file again")
                    .into());
            }
            let c = |k: usize| DVec3::new(m[k], m[k + 1], m[k + 2]);
            return Ok(DAffine3 { matrix3: DMat3::from_cols(c(0), c(4), c(8)), translation: c(12) });
        }
        let (t, q, s) = self.trs(i)?;
        Ok(DAffine3::from_scale_rotation_translation(s, q, t))
    }

    /// Translation, rotation and scale of a node that has no matrix, with what an animation says once and for all.
    pub(super) fn trs(&self, i: usize) -> Result<(DVec3, DQuat, DVec3)> {
        let key = format!("nodes[{i}]");
        let n = self.nodes.get(i).ok_or_else(|| self.bad(&key, "is not readable"))?;
        let (mut t, mut r, mut s) = (n.translation, n.rotation, n.scale);
        if let Some(moves) = self.moves.get(&i) {
            t = moves.translation.as_ref().and_then(Keys::constant).or(t);
            r = moves.rotation.as_ref().and_then(Keys::constant).or(r);
            s = moves.scale.or(s);
        }
        let q = self.quaternion(r.unwrap_or([0.0, 0.0, 0.0, 1.0]), &key)?;
        Ok((DVec3::from(t.unwrap_or([0.0; 3])), q, DVec3::from(s.unwrap_or([1.0; 3]))))
    }

    pub(super) fn quaternion(&self, r: [f64; 4], key: &str) -> Result<DQuat> {
        let q = DQuat::from_array(r);
        if (q.length() - 1.0).abs() < 0.01 {
            return Ok(q.normalize());
        }
        Err(self
            .bad(format!("{key}.rotation"), "is not a unit quaternion")
            .value(clip(&format!("{r:?}")))
            .remedy("export the file again")
            .into())
    }

    /// The rigid part of a transform as a pose in ISO axes and metres, and what is left of it to bake
    /// into the vertices (ISO axes; identity when there is nothing).
    pub(super) fn place(&self, t: &DAffine3) -> (Pose<Target, World>, DMat3) {
        let (rotation, bake) = split(self.in_iso(t.matrix3));
        (Pose::new(rotation, self.axes * t.translation * self.options.unit_m), bake)
    }

    /// A linear map of the file's axes in ISO axes.
    pub(super) fn in_iso(&self, m: DMat3) -> DMat3 {
        self.axes * m * self.axes.transpose()
    }
}

/// A rotation, and what is left of a linear map before it; identity when there is nothing.
pub(super) fn split(a: DMat3) -> (DQuat, DMat3) {
    // Gram-Schmidt: a proper rotation that keeps the direction of the first column.
    let x = a.x_axis.normalize_or_zero();
    let y = (a.y_axis - x * x.dot(a.y_axis)).normalize_or_zero();
    let rotation = DMat3::from_cols(x, y, x.cross(y));
    let proper = (rotation.determinant() - 1.0).abs() < 1e-9;
    let rotation = if proper { rotation } else { DMat3::IDENTITY };
    let mut bake = rotation.transpose() * a;
    if bake.abs_diff_eq(DMat3::IDENTITY, RIGID) {
        bake = DMat3::IDENTITY;
    }
    (DQuat::from_mat3(&rotation).normalize(), bake)
}
