//! Rust structs that a shader reads, and the check that both sides lay them out alike.

use super::kernel::{Access, Kernel, StructLayout};
pub use super::wgsl::module_from_wgsl;
use naga::{AddressSpace, StorageAccess, TypeInner};

/// Declares a plain-data struct for the GPU, with `LAYOUT` to be listed in a kernel's row. Give vec3
/// members a pad word; arrays longer than 32 need a hand-written struct (no `Default`).
#[macro_export]
macro_rules! gpu_struct {
    ($(#[$attribute:meta])* $visibility:vis struct $name:ident {
        $($(#[$field_attribute:meta])* $field_visibility:vis $field:ident : $type:ty),* $(,)?
    }) => {
        $(#[$attribute])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, ::bytemuck::Pod, ::bytemuck::Zeroable)]
        #[allow(missing_docs, reason = "the shader's struct of this name tells its members")]
        $visibility struct $name {
            $($(#[$field_attribute])* $field_visibility $field: $type),*
        }
        impl $name {
            /// Compared by test with the WGSL struct of this name.
            pub const LAYOUT: $crate::gpu::StructLayout = $crate::gpu::StructLayout {
                name: stringify!($name),
                size: ::core::mem::size_of::<$name>(),
                fields: &[$((stringify!($field), ::core::mem::offset_of!($name, $field))),*],
            };
        }
    };
}

/// Checks everything that a kernel's row says against its assembled WGSL: it is valid, its entry
/// point is `main` with that workgroup size, its bindings are those of the row and nothing else, and
/// its structs agree member for member. The error lists all that is wrong.
///
/// # Errors
/// Returns a text with everything that does not agree.
pub fn check_kernel(kernel: &Kernel) -> Result<(), String> {
    module_from_wgsl(kernel.stem, &kernel.source_for(true))?;
    let (module, _) = module_from_wgsl(kernel.stem, &kernel.source())?;
    let mut wrong = Vec::new();
    match module.entry_points.as_slice() {
        [entry] if entry.name == "main" && entry.stage == naga::ShaderStage::Compute => {
            if entry.workgroup_size != kernel.workgroup {
                wrong.push(format!(
                    "@workgroup_size is {:?} in WGSL, {:?} in the kernel's row",
                    entry.workgroup_size, kernel.workgroup
                ));
            }
        }
        others => wrong.push(format!(
            "one compute entry point `main` expected, found {:?}",
            others.iter().map(|e| &e.name).collect::<Vec<_>>()
        )),
    }
    check_bindings(kernel, &module, &mut wrong);
    for layout in kernel.params.iter().chain(kernel.structs) {
        check_struct(layout, &module, &mut wrong);
    }
    if wrong.is_empty() { Ok(()) } else { Err(format!("{}: {}", kernel.stem, wrong.join("; "))) }
}

fn check_bindings(kernel: &Kernel, module: &naga::Module, wrong: &mut Vec<String>) {
    let mut found = Vec::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(binding) = &variable.binding else { continue };
        let name = variable.name.as_deref().unwrap_or("?");
        if binding.group != 0 {
            wrong.push(format!("{name} is in group {}, only group 0 is used", binding.group));
            continue;
        }
        found.push(binding.binding);
        let expected = match binding.binding {
            0 => "the uniform".to_string(),
            n => match kernel.storage.get(n as usize - 1) {
                Some(access) => format!("storage of access {access:?}"),
                None => "nothing".to_string(),
            },
        };
        let agrees = match (binding.binding, variable.space) {
            (0, AddressSpace::Uniform) => {
                let type_name = module.types[variable.ty].name.as_deref();
                kernel.params.is_some_and(|p| Some(p.name) == type_name)
            }
            (n @ 1.., AddressSpace::Storage { access }) => {
                let access =
                    if access.contains(StorageAccess::STORE) { Access::ReadWrite } else { Access::Read };
                kernel.storage.get(n as usize - 1) == Some(&access)
            }
            _ => false,
        };
        if !agrees {
            wrong.push(format!(
                "binding {} is {name} in {:?} in WGSL, {expected} in the kernel's row",
                binding.binding, variable.space
            ));
        }
    }
    for n in 0..=kernel.storage.len() as u32 {
        if (n > 0 || kernel.params.is_some()) && !found.contains(&n) {
            wrong.push(format!("binding {n} of the kernel's row is not in the WGSL"));
        }
    }
}

fn check_struct(layout: &StructLayout, module: &naga::Module, wrong: &mut Vec<String>) {
    let name = layout.name;
    let Some((_, ty)) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)) else {
        wrong.push(format!("struct {name} is not in the WGSL"));
        return;
    };
    let TypeInner::Struct { members, span } = &ty.inner else {
        wrong.push(format!("{name} is not a struct in the WGSL"));
        return;
    };
    if *span as usize != layout.size {
        wrong.push(format!("struct {name} spans {span} bytes in WGSL, {} in Rust", layout.size));
    }
    let is_pad = |name: &str| name.starts_with("pad");
    for member in members {
        let member_name = member.name.as_deref().unwrap_or("?");
        match layout.fields.iter().find(|f| f.0 == member_name) {
            Some((_, offset)) if *offset == member.offset as usize => {}
            Some((_, offset)) => wrong
                .push(format!("{name}.{member_name} is at byte {} in WGSL, {offset} in Rust", member.offset)),
            None if is_pad(member_name) => {}
            None => wrong.push(format!("{name}.{member_name} is not in Rust")),
        }
    }
    for (field, _) in layout.fields {
        if !is_pad(field) && !members.iter().any(|m| m.name.as_deref() == Some(field)) {
            wrong.push(format!("{name}.{field} is not in the WGSL"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Tolerance;

    gpu_struct! {
        /// Agrees with the WGSL below.
        struct ScaleParams { count: u32, scale: f32, offset: [f32; 2] }
    }

    const WGSL: &str = "struct ScaleParams { count: u32, scale: f32, offset: vec2<f32> }
        @group(0) @binding(0) var<uniform> params: ScaleParams;
        @group(0) @binding(1) var<storage, read> a: array<f32>;
        @group(0) @binding(2) var<storage, read_write> b: array<f32>;
        @compute @workgroup_size(8, 4) fn main() { b[params.count] = a[0] * params.scale; }";

    const GOOD: Kernel = Kernel {
        stem: "test/layout",
        sources: &[WGSL],
        workgroup: [8, 4, 1],
        params: Some(ScaleParams::LAYOUT),
        storage: &[Access::Read, Access::ReadWrite],
        structs: &[],
        tolerance: Tolerance { relative_l2: 0.0, reason: "a test" },
    };

    #[test]
    fn agreement_is_accepted() {
        check_kernel(&GOOD).unwrap();
    }

    #[test]
    fn every_disagreement_is_named() {
        const MOVED: StructLayout = StructLayout {
            name: "ScaleParams",
            size: 20,
            fields: &[("count", 0), ("scale", 4), ("offset", 12)],
        };
        const RENAMED: StructLayout = StructLayout {
            name: "ScaleParams",
            size: 16,
            fields: &[("count", 0), ("gain", 4), ("offset", 8)],
        };
        let cases: &[(Kernel, &[&str])] = &[
            (Kernel { workgroup: [64, 1, 1], ..GOOD }, &["@workgroup_size is [8, 4, 1]"]),
            (Kernel { storage: &[Access::Read, Access::Read], ..GOOD }, &["binding 2 is b"]),
            (Kernel { storage: &[Access::Read], ..GOOD }, &["binding 2 is b", "nothing"]),
            (
                Kernel { storage: &[Access::Read, Access::ReadWrite, Access::Read], ..GOOD },
                &["binding 3 of the kernel's row is not"],
            ),
            (Kernel { params: None, ..GOOD }, &["binding 0 is params"]),
            (
                Kernel { params: Some(MOVED), ..GOOD },
                &[
                    "spans 16 bytes in WGSL, 20 in Rust",
                    "ScaleParams.offset is at byte 8 in WGSL, 12 in Rust",
                ],
            ),
            (
                Kernel { params: Some(RENAMED), ..GOOD },
                &["ScaleParams.scale is not in Rust", "ScaleParams.gain is not in the WGSL"],
            ),
            (Kernel { sources: &["fn main() -> { }"], ..GOOD }, &["test/layout"]),
            (Kernel { sources: &[WGSL, "fn f() -> u32 { return 1.5; }"], ..GOOD }, &["test/layout"]),
        ];
        for (kernel, messages) in cases {
            let e = check_kernel(kernel).expect_err(messages[0]);
            for message in *messages {
                assert!(e.contains(message), "{e:?} lacks {message:?}");
            }
        }
    }
}
