//! The library's errors as Python's, with the text of the command line.

use catseye::Error;
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    catseye,
    BadInput,
    PyValueError,
    "An input is not valid. str() is the message that the command line prints; file, line, key, value, problem, allowed and remedy \
     are its parts, each a string (line: int) or None."
);
create_exception!(
    catseye,
    Failed,
    PyRuntimeError,
    "Any error other than bad input: of a device, of a file, or a result that fails a check."
);

/// The Python exception of an error.
pub fn raised(py: Python<'_>, e: Error) -> PyErr {
    let text = e.to_string();
    let Error::Input(b) = e else { return Failed::new_err(text) };
    let err = BadInput::new_err(text);
    let value = err.value(py);
    let set = || -> PyResult<()> {
        value.setattr("file", b.file.as_ref().map(|f| f.display().to_string()))?;
        value.setattr("line", b.line)?;
        value.setattr("key", &b.key)?;
        value.setattr("value", &b.value)?;
        value.setattr("problem", &b.problem)?;
        value.setattr("allowed", &b.allowed)?;
        value.setattr("remedy", &b.remedy)
    };
    match set() {
        Ok(()) => err,
        Err(e) => e,
    }
}

/// Raises BadInput for an argument that is not valid.
pub fn refuse<T>(py: Python<'_>, b: catseye::base::error::BadInput) -> PyResult<T> {
    Err(raised(py, b.into()))
}

/// Results of short calls.
pub trait OrRaise<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for catseye::Result<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|e| raised(py, e))
    }
}
