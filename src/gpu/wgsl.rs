//! WGSL as a module of naga.

/// Parses and validates WGSL. `label` begins the message.
///
/// # Errors
/// Returns a text that says where and why the source is not valid.
pub fn module_from_wgsl(
    label: &str,
    source: &str,
) -> Result<(naga::Module, naga::valid::ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(source)
        .map_err(|e| format!("{label}: {}", e.emit_to_string_with_path(source, label)))?;
    let info = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default() | naga::valid::Capabilities::FLOAT64,
    )
    .validate(&module)
    .map_err(|e| format!("{label}: {}", e.emit_to_string_with_path(source, label)))?;
    Ok((module, info))
}

/// The number that a scalar constant of a WGSL source has, for tests of what both sides use.
#[cfg(test)]
pub(crate) fn shader_constant(source: &str, name: &str) -> Option<f64> {
    let begin = format!("const {name}: ");
    let line = source.lines().find_map(|l| l.strip_prefix(begin.as_str()))?;
    let value = line.split_once('=')?.1.trim().trim_end_matches(';').trim_end_matches('u');
    value.parse().ok()
}
