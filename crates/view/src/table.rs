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
    Ok((columns_of(&table, None)?, table.len()))
}

/// The columns of a table by name: of all rows, or of these alone.
pub fn columns_of(table: &Table, rows: Option<&[u32]>) -> Result<Value> {
    let mut out = Map::new();
    for name in &table.header {
        out.insert(name.clone(), column(table, name, rows)?);
    }
    Ok(Value::Object(out))
}

/// The rows with the `most` largest values of a column, in the table's order; None where the table has no more rows than that.
pub fn largest(table: &Table, name: &str, most: usize) -> Result<Option<Vec<u32>>> {
    if table.len() <= most {
        return Ok(None);
    }
    let values = table.numbers(name)?;
    // Rows without a value come last.
    let rank = |i: &u32| if values[*i as usize].is_nan() { f64::NEG_INFINITY } else { values[*i as usize] };
    let mut rows: Vec<u32> = (0..table.len() as u32).collect();
    rows.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    rows.truncate(most);
    rows.sort_unstable();
    Ok(Some(rows))
}

fn column(table: &Table, name: &str, rows: Option<&[u32]>) -> Result<Value> {
    let mut cells = table.text(name)?;
    if let Some(rows) = rows {
        cells = rows.iter().map(|i| cells[*i as usize].clone()).collect();
    }
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
    fn the_largest_rows_stay_in_order() {
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("t.csv");
        std::fs::write(&path, "p,class\n-3,a\n,b\n5,c\n-4,d\n5,e\n").unwrap();
        let table = Table::read(&path).unwrap();
        assert_eq!(largest(&table, "p", 5).unwrap(), None);
        let rows = largest(&table, "p", 3).unwrap().unwrap();
        assert_eq!(rows, [0, 2, 4]);
        let part = columns_of(&table, Some(&rows)).unwrap();
        assert_eq!((&part["p"], &part["class"]), (&json!([-3.0, 5.0, 5.0]), &json!(["a", "c", "e"])));
    }

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
