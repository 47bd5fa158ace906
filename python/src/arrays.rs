//! NumPy arrays and plain Python values.

use crate::errors::refuse;
use catseye::base::error::BadInput;
use catseye::formats::column::{Column, Get};
use catseye::trace::MAX_BOUNCES;
use glam::DVec3;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use std::borrow::Cow;

/// An array that owns `data`, without a copy.
pub fn array<T: Element>(py: Python<'_>, data: Vec<T>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    Ok(PyArray1::from_vec(py, data).reshape(shape)?.into_any().unbind())
}

/// A structured array; the columns are name, NumPy's format, shape of a value (empty for a number) and values.
pub struct Records<'py> {
    rows: usize,
    fields: Vec<(String, String, Vec<usize>)>,
    values: Vec<Bound<'py, PyAny>>,
}

impl<'py> Records<'py> {
    pub fn new(rows: usize) -> Self {
        Records { rows, fields: Vec::new(), values: Vec::new() }
    }

    pub fn numbers<T: Element>(self, py: Python<'py>, name: &str, data: Vec<T>, format: &str) -> Self {
        self.vectors(py, name, data, format, &[])
    }

    /// Of several numbers a row.
    pub fn vectors<T: Element>(
        mut self,
        py: Python<'py>,
        name: &str,
        data: Vec<T>,
        format: &str,
        shape: &[usize],
    ) -> Self {
        self.fields.push((name.into(), format.into(), shape.to_vec()));
        self.values.push(PyArray1::from_vec(py, data).into_any());
        self
    }

    /// Of text, cut to the width of the format.
    pub fn text(mut self, py: Python<'py>, name: &str, data: Vec<&str>, format: &str) -> PyResult<Self> {
        self.fields.push((name.into(), format.into(), Vec::new()));
        self.values.push(data.into_pyobject(py)?.into_any());
        Ok(self)
    }

    /// Columns of all rows, as every output has them.
    pub fn columns<T>(self, py: Python<'py>, columns: &[Column<T>], rows: &[T]) -> PyResult<Self> {
        columns.iter().try_fold(self, |table, c| {
            let name = c.name;
            Ok(match &c.get {
                Get::Number(get) | Get::Bound(get) => {
                    table.numbers(py, name, rows.iter().map(get).collect::<Vec<f64>>(), "f8")
                }
                Get::Count(get) => table.numbers(py, name, rows.iter().map(get).collect::<Vec<u32>>(), "u4"),
                Get::Small(get) => table.numbers(py, name, rows.iter().map(get).collect::<Vec<u8>>(), "u1"),
                Get::Flag(get) => table.numbers(py, name, rows.iter().map(get).collect::<Vec<bool>>(), "?"),
                Get::Text(most, get) => {
                    let cells: Vec<Cow<'_, str>> = rows.iter().map(get).collect();
                    table.text(py, name, cells.iter().map(|c| &**c).collect(), &format!("U{most}"))?
                }
                Get::Ids(get) => {
                    let ids = rows.iter().flat_map(get).collect::<Vec<u32>>();
                    table.vectors(py, name, ids, "u4", &[MAX_BOUNCES])
                }
            })
        })
    }

    pub fn build(self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let numpy = py.import("numpy")?;
        let fields: Vec<_> = self.fields.iter().map(|(n, f, s)| (n, f, numpy_shape(py, s))).collect();
        let fields = fields.into_iter().map(|(n, f, s)| Ok((n, f, s?))).collect::<PyResult<Vec<_>>>()?;
        let dtype = numpy.call_method1("dtype", (fields,))?;
        let table = numpy.call_method1("empty", (self.rows, dtype))?;
        for ((name, _, shape), values) in self.fields.iter().zip(self.values) {
            let values = match shape.is_empty() {
                true => values,
                false => {
                    let all: Vec<usize> = [self.rows].iter().chain(shape).copied().collect();
                    values.call_method1("reshape", (numpy_shape(py, &all)?,))?
                }
            };
            table.set_item(name, values)?;
        }
        Ok(table)
    }
}

fn numpy_shape<'py>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    Ok(pyo3::types::PyTuple::new(py, shape)?.into_any())
}

/// One number or a sequence of numbers.
pub fn floats(ob: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let numpy = ob.py().import("numpy")?;
    let keywords = [("dtype", "float64")].into_py_dict(ob.py())?;
    let array = numpy.getattr("asarray")?.call((ob,), Some(&keywords))?;
    let list: PyReadonlyArray1<'_, f64> = numpy.call_method1("atleast_1d", (array,))?.extract()?;
    Ok(list.as_array().to_vec())
}

/// Numbers of the argument `key`: finite, at least one.
pub fn values(key: &str, ob: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let bad = |problem: &str| {
        let b = BadInput::new(problem).key(key).allowed("a number, or numbers in one dimension");
        refuse(ob.py(), b)
    };
    let list = floats(ob)?;
    match list.iter().find(|x| !x.is_finite()) {
        Some(x) => bad(&format!("{x} is not a finite number")),
        None if list.is_empty() => bad("is empty"),
        None => Ok(list),
    }
}

/// Three finite numbers of the argument `key`.
pub fn vector(key: &str, ob: Option<&Bound<'_, PyAny>>) -> PyResult<DVec3> {
    let Some(ob) = ob else { return Ok(DVec3::ZERO) };
    match floats(ob)?[..] {
        [x, y, z] if [x, y, z].iter().all(|v| v.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => {
            let b = BadInput::new("is not a position or a direction").key(key);
            refuse(ob.py(), b.allowed("three finite numbers: x, y, z"))
        }
    }
}

/// Rows of three numbers of the argument `key`, as NumPy's `dtype`: "int64", which takes whole numbers alone, or "float64".
pub fn rows_of_three<T: Element + Copy>(
    key: &str,
    ob: &Bound<'_, PyAny>,
    dtype: &str,
) -> PyResult<Vec<[T; 3]>> {
    let py = ob.py();
    let bad = |problem: String| {
        refuse(py, BadInput::new(problem).key(key).allowed(format!("an array of {dtype} with shape (n, 3)")))
    };
    let array = match py.import("numpy")?.call_method1("asarray", (ob,)) {
        Ok(array) => array,
        // Rows of several lengths.
        Err(e) if e.is_instance_of::<PyValueError>(py) => return bad("is not an array of numbers".into()),
        Err(e) => return Err(e),
    };
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 2 || shape[1] != 3 {
        let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
        return bad(format!("has the shape ({})", lengths.join(", ")));
    }
    let given = array.getattr("dtype")?;
    let kind: String = given.getattr("kind")?.extract()?;
    let numbers = if dtype == "int64" { "iu" } else { "iuf" };
    if !numbers.contains(&kind) {
        return bad(format!("has elements of {given}"));
    }
    let array: PyReadonlyArray2<'_, T> = array.call_method1("astype", (dtype,))?.extract()?;
    Ok(array.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// Yaw, pitch and roll in radians of the arguments of these names in degrees.
pub fn angles(py: Python<'_>, yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> PyResult<[f64; 3]> {
    for (key, angle) in [("yaw_deg", yaw_deg), ("pitch_deg", pitch_deg), ("roll_deg", roll_deg)] {
        if !(-360.0..=360.0).contains(&angle) {
            let e = BadInput::new("out of range").key(key).value(angle).allowed("-360..360");
            return refuse(py, e);
        }
    }
    Ok([yaw_deg, pitch_deg, roll_deg].map(f64::to_radians))
}

/// A value as Python's own dictionaries, lists and numbers.
pub fn plain(py: Python<'_>, value: &impl serde::Serialize) -> PyResult<Py<PyAny>> {
    let text =
        serde_json::to_string(value).map_err(|e| crate::errors::Failed::new_err(format!("JSON: {e}")))?;
    plain_of_json(py, &text)
}

pub fn plain_of_json(py: Python<'_>, text: &str) -> PyResult<Py<PyAny>> {
    Ok(py.import("json")?.call_method1("loads", (text,))?.unbind())
}

/// A dictionary of what is given.
pub fn dictionary<'py>(py: Python<'py>, pairs: &[(&str, Py<PyAny>)]) -> PyResult<Bound<'py, PyDict>> {
    let d = PyDict::new(py);
    for (k, v) in pairs {
        d.set_item(k, v)?;
    }
    Ok(d)
}
