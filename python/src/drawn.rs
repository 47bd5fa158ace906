//! Calls from a class to the functions of `catseye._show`, which draw its objects.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The result of a function of `catseye._show` for an object. A method calls it so that matplotlib is imported only when a plot is drawn, and not
/// with catseye.
pub fn call(
    object: &Bound<'_, PyAny>,
    function: &str,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let module = object.py().import("catseye._show")?;
    Ok(module.getattr(function)?.call((object,), keywords)?.unbind())
}
