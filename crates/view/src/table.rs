//! Tables of results as columns: numbers where all cells of a column are numbers or empty, else text.

use super::pack;
use catseye::base::error::Result;
use catseye::formats::csv::Table;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Number of rows from which on numbers are packed.
const LONG: usize = 4000;

/// The columns of a table by name, and its number of rows.
pub fn columns(path: &Path) -> Result<(Value, usize)> {
    let table = Table::read(path)?;
    let mut out = Map::new();
    for name in &table.header {
        out.insert(name.clone(), column(&table, name)?);
    }
    Ok((Value::Object(out), table.len()))
}

fn column(table: &Table, name: &str) -> Result<Value> {
    let cells = table.text(name)?;
    let numbers: Option<Vec<f64>> = cells
        .iter()
        .map(|c| match c.trim() {
            "" => Some(f64::NAN),
            word => word.parse().ok(),
        })
        .collect();
    Ok(match numbers.filter(|n| n.iter().any(|x| !x.is_nan()) || n.is_empty()) {
        Some(numbers) if numbers.len() >= LONG => pack::f64s(numbers),
        // What is not finite has no place in JSON.
        Some(numbers) => numbers.iter().map(|x| if x.is_finite() { json!(x) } else { Value::Null }).collect(),
        None => cells.iter().map(|c| json!(c)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_file() {
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("t.csv");
        std::fs::write(&path, "a,b,c\n0.1,car,\n-6.653642619947623,,\n").unwrap();
        let (columns, rows) = columns(&path).unwrap();
        assert_eq!(rows, 2);
        assert_eq!(columns["a"].to_string(), "[0.1,-6.653642619947623]");
        assert_eq!(columns["b"], json!(["car", ""]));
        assert_eq!(columns["c"], json!(["", ""]));
    }
}
