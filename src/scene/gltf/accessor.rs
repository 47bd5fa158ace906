//! Numbers in buffers.

use super::importer::Importer;
use super::options::MAX_UNBACKED;
use crate::base::error::Result;
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::validation::Checked;

impl Importer<'_> {
    /// Number of elements of an accessor that has been read, so it fits.
    pub(super) fn count(&self, accessor: usize) -> u64 {
        self.root.accessors[accessor].count.0
    }

    pub(super) fn indices(&self, accessor: usize, vertices: u32, what: &str) -> Result<Vec<u32>> {
        let list = self.scalars(accessor, what)?;
        if let Some(k) = list.iter().position(|i| *i >= vertices) {
            return Err(self
                .bad(what, format!("index {k} points past the {vertices} vertices"))
                .value(list[k])
                .remedy("the mesh is damaged; export it again")
                .into());
        }
        Ok(list)
    }

    /// Bytes and stride of a buffer view. Errors: indices and lengths that do not fit.
    pub(super) fn view(&self, index: usize, what: &str) -> Result<(&[u8], Option<usize>)> {
        let Some(v) = self.root.buffer_views.get(index) else {
            return Err(self
                .out_of_range(format!("{what} bufferView"), index, self.root.buffer_views.len())
                .into());
        };
        let key = format!("bufferViews[{index}]");
        let Some(buffer) = self.buffers.get(v.buffer.value()) else {
            return Err(self
                .out_of_range(format!("{key}.buffer"), v.buffer.value(), self.buffers.len())
                .into());
        };
        let start = v.byte_offset.map_or(0, |o| o.0);
        let bytes = start
            .checked_add(v.byte_length.0)
            .and_then(|end| buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?));
        let Some(bytes) = bytes else {
            return Err(self
                .bad(
                    key,
                    format!(
                        "bytes {start} to {} lie outside the buffer",
                        start.saturating_add(v.byte_length.0)
                    ),
                )
                .allowed(format!("up to {}", buffer.len()))
                .remedy("the data is cut off; export the file again")
                .into());
        };
        Ok((bytes, v.byte_stride.map(|s| s.0).filter(|s| *s > 0)))
    }

    /// `count` elements of `size` bytes in a view: their starts lie `stride` apart from `offset`.
    pub(super) fn span(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        what: &str,
    ) -> Result<(&[u8], usize)> {
        let (bytes, stride) = self.view(view, what)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(self
                .bad(
                    format!("bufferViews[{view}].byteStride"),
                    format!("is less than an element of {size} bytes"),
                )
                .value(stride)
                .into());
        }
        // In 128 bits nothing here can overflow.
        let end = offset as u128
            + (count as u128).saturating_sub(1) * stride as u128
            + if count == 0 { 0 } else { size as u128 };
        if end > bytes.len() as u128 {
            return Err(self
                .bad(
                    what,
                    format!("{count} elements need {end} bytes, but the buffer view holds {}", bytes.len()),
                )
                .remedy("the file is damaged; export it again")
                .into());
        }
        Ok((&bytes[offset as usize..], stride))
    }

    /// Calls `put(element, bytes)` for each element of an accessor, sparse replacements last. Elements
    /// that no bytes back are not called.
    pub(super) fn visit(
        &self,
        index: usize,
        what: &str,
        dimensions: (Type, usize),
        mut put: impl FnMut(usize, usize, ComponentType, &[u8]) -> Result<()>,
    ) -> Result<()> {
        let Some(a) = self.root.accessors.get(index) else {
            return Err(self.out_of_range(what.into(), index, self.root.accessors.len()).into());
        };
        let key = format!("{what} accessors[{index}]");
        let (Checked::Valid(component), Checked::Valid(type_)) = (a.component_type, a.type_) else {
            return Err(self
                .bad(key, "has an unknown component type or type")
                .remedy("export the file again")
                .into());
        };
        if type_ != dimensions.0 {
            return Err(self
                .bad(key, format!("has elements of type {type_:?}"))
                .allowed(format!("{:?}", dimensions.0))
                .remedy("export the file again")
                .into());
        }
        let (component, count) = (component.0, a.count.0);
        let size = component.size() * dimensions.1;
        match a.buffer_view {
            Some(v) => {
                let (bytes, stride) =
                    self.span(v.value(), a.byte_offset.map_or(0, |o| o.0), count, size, &key)?;
                put(count as usize, usize::MAX, component, &[])?;
                for k in 0..count as usize {
                    put(count as usize, k, component, &bytes[k * stride..k * stride + size])?;
                }
            }
            None if count > MAX_UNBACKED => {
                return Err(self
                    .bad(key, "claims elements that no bytes back")
                    .value(count)
                    .allowed(format!("up to {MAX_UNBACKED}"))
                    .remedy("the file is damaged; export it again")
                    .into());
            }
            None => put(count as usize, usize::MAX, component, &[])?,
        }
        if let Some(s) = &a.sparse {
            let Checked::Valid(index_type) = s.indices.component_type else {
                return Err(self
                    .bad(key, "has sparse indices of an unknown type")
                    .remedy("export the file again")
                    .into());
            };
            let n = s.count.0;
            let at = self.span(
                s.indices.buffer_view.value(),
                s.indices.byte_offset.0,
                n,
                index_type.0.size(),
                &key,
            )?;
            let from = self.span(s.values.buffer_view.value(), s.values.byte_offset.0, n, size, &key)?;
            for k in 0..n as usize {
                let element = unsigned(index_type.0, &at.0[k * at.1..]) as usize;
                if element as u64 >= count {
                    return Err(self
                        .bad(key, format!("sparse index {k} points past the {count} elements"))
                        .value(element)
                        .remedy("export the file again")
                        .into());
                }
                put(count as usize, element, component, &from.0[k * from.1..k * from.1 + size])?;
            }
        }
        Ok(())
    }

    /// Rows of `N` numbers, 1, 3, 4 or (a matrix by columns) 16: floats, or integers as KHR_mesh_quantization and instancing have them.
    pub(super) fn elements<const N: usize>(&self, index: usize, what: &str) -> Result<Vec<[f64; N]>> {
        let type_ = match N {
            1 => Type::Scalar,
            3 => Type::Vec3,
            4 => Type::Vec4,
            _ => Type::Mat4,
        };
        let normalized = self.root.accessors.get(index).is_some_and(|a| a.normalized);
        let mut out: Vec<[f64; N]> = Vec::new();
        self.visit(index, what, (type_, N), |count, k, component, bytes| {
            if k == usize::MAX {
                out.resize(count, [0.0; N]);
                return Ok(());
            }
            let size = component.size();
            for (j, x) in out[k].iter_mut().enumerate() {
                *x = float(component, normalized, &bytes[j * size..]);
            }
            Ok(())
        })?;
        Ok(out)
    }

    pub(super) fn scalars(&self, index: usize, what: &str) -> Result<Vec<u32>> {
        let mut out: Vec<u32> = Vec::new();
        self.visit(index, what, (Type::Scalar, 1), |count, k, component, bytes| {
            if !matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
                return Err(self
                    .bad(what, format!("has components of type {component:?}"))
                    .allowed("U8, U16, U32")
                    .remedy("export the file again")
                    .into());
            }
            if k == usize::MAX {
                out.resize(count, 0);
            } else {
                out[k] = unsigned(component, bytes);
            }
            Ok(())
        })?;
        Ok(out)
    }
}

pub(super) fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 => bytes[0] as u32,
        ComponentType::U16 => u16::from_le_bytes([bytes[0], bytes[1]]) as u32,
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// Integers scaled as section 3.6.2.2 of the glTF 2.0 specification when `normalized`.
pub(super) fn float(component: ComponentType, normalized: bool, b: &[u8]) -> f64 {
    let (x, max) = match component {
        ComponentType::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f64,
        ComponentType::I8 => (b[0] as i8 as f64, 127.0),
        ComponentType::U8 => (b[0] as f64, 255.0),
        ComponentType::I16 => (i16::from_le_bytes([b[0], b[1]]) as f64, 32767.0),
        ComponentType::U16 => (u16::from_le_bytes([b[0], b[1]]) as f64, 65535.0),
        ComponentType::U32 => (unsigned(component, b) as f64, u32::MAX as f64),
    };
    if normalized { (x / max).max(-1.0) } else { x }
}
