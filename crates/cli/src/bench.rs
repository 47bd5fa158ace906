//! `catseye bench`: the standard workloads on a device.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::Result;
use catseye_papers::bench::{self, Outcome, Settings};
use clap::Args;
use serde_json::Value;

/// Time the standard workloads on this device and check their results
#[derive(Debug, Args)]
#[command(after_help = format!("Workloads:\n{}", list()))]
pub struct Bench {
    /// Fewer directions, rays and frames: minutes instead of a quarter of an hour
    #[arg(long)]
    pub quick: bool,
    /// Only these workloads
    #[arg(long, value_delimiter = ',', value_name = "W1,W4,...")]
    pub only: Vec<String>,
}

fn list() -> String {
    bench::WORKLOADS.map(|(name, title)| format!("  {name:<10} {title}")).join("\n")
}

impl Bench {
    pub fn run(&self, global: &Global) -> Result<()> {
        let settings = Settings { quick: self.quick, seed: global.seed.unwrap_or(1) };
        let engine = global.engine()?;
        let bar = global.bar("bench", 0, Kept::Nothing);
        let say = |m: &str| bar.suspend(|| global.say(m));
        let outcomes = bench::run(&engine, &self.only, &settings, &say)?;
        drop(bar);
        if global.json {
            return print_json(&serde_json::json!({
                "version": env!("CARGO_PKG_VERSION"),
                "device": engine.report(),
                "threads": rayon::current_num_threads(),
                "quick": self.quick,
                "seed": settings.seed,
                "workloads": outcomes,
            }));
        }
        print(&format!(
            "device: {}; {} threads on the host",
            engine.describe(),
            rayon::current_num_threads()
        ))?;
        outcomes.iter().try_for_each(|o| print(&table(o)))
    }
}

fn table(o: &Outcome) -> String {
    let mut lines = vec![format!("\n{}: {}", o.workload, o.title)];
    for s in &o.stages {
        let runs = if s.runs > 1 { format!("median of {}", s.runs) } else { "one run".into() };
        lines.push(format!("  {:<28} {:>12.4} s{}   {runs}", s.name, s.seconds, cores(s.core_seconds)));
        if let Some(d) = s.device.filter(|d| d.submits > 0) {
            let mb = |bytes: u64| bytes as f64 / 1e6;
            lines.push(format!(
                "    on the device: {} submissions, {} kernels, {:.3} MB there, {:.3} MB back, {} buffers ({:.1} MB) and {} bind groups made",
                d.submits,
                d.dispatches,
                mb(d.uploaded_bytes),
                mb(d.read_bytes),
                d.buffers,
                mb(d.buffer_bytes),
                d.bind_groups
            ));
        }
    }
    lines.push(format!("  {:<28} {:>12.4} s{}", "total", o.total_seconds, cores(o.core_seconds)));
    for (name, value) in o.counts.iter().chain(&o.accuracy) {
        match value {
            Value::Object(rows) => {
                for (key, row) in rows {
                    lines.push(format!("    {key:<12} {}", flat(row)));
                }
            }
            Value::Array(rows) if rows.first().is_some_and(Value::is_object) => {
                lines.push(format!("  {name}:"));
                lines.extend(columns(rows).into_iter().map(|l| format!("  {l}")));
            }
            value => lines.push(format!("  {name:<28} {:>12}", short(value))),
        }
    }
    lines.extend(o.notes.iter().map(|n| format!("  note: {n}")));
    lines.join("\n")
}

/// Objects with the same keys as the lines of a table below their keys; an object in a cell is its values with slashes
/// between them, and its keys stand in brackets after that of the column.
fn columns(rows: &[Value]) -> Vec<String> {
    let mut lines = vec![String::new(); rows.len() + 1];
    for (key, value) in rows.first().and_then(Value::as_object).into_iter().flatten() {
        let head = match value {
            Value::Object(parts) => format!("{key} ({})", slashed(parts.keys().cloned())),
            _ => key.clone(),
        };
        let cells: Vec<String> =
            std::iter::once(head).chain(rows.iter().map(|row| cell(&row[key]))).collect();
        let width = 2 + cells.iter().map(String::len).max().unwrap_or(0);
        lines.iter_mut().zip(&cells).for_each(|(line, cell)| line.push_str(&format!("{cell:>width$}")));
    }
    lines
}

fn cell(value: &Value) -> String {
    match value {
        Value::Object(parts) => slashed(parts.values().map(short)),
        value => short(value),
    }
}

fn slashed(words: impl Iterator<Item = String>) -> String {
    words.collect::<Vec<_>>().join(" / ")
}

fn cores(seconds: Option<f64>) -> String {
    seconds.map_or(String::new(), |c| format!(" {c:>12.4} core-s"))
}

fn short(value: &Value) -> String {
    match value {
        Value::Number(n) if n.is_f64() => {
            let x = n.as_f64().unwrap_or(f64::NAN);
            if x != 0.0 && x.abs() < 1e-3 { format!("{x:.2e}") } else { format!("{x:.4}") }
        }
        Value::String(s) => s.clone(),
        other => other.to_string(),
    }
}

fn flat(value: &Value) -> String {
    match value {
        Value::Object(map) => {
            map.iter().map(|(k, v)| format!("{k} {}", short(v))).collect::<Vec<_>>().join(", ")
        }
        other => short(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn lists_of_objects_are_tables() {
        let time = |s: f64| json!({ "core_s": 2.0 * s, "s": s });
        let rows = [json!({ "n": 5, "time": time(0.5) }), json!({ "n": 1000, "time": time(12.0) })];
        let want = ["     n  time (core_s / s)", "     5    1.0000 / 0.5000", "  1000  24.0000 / 12.0000"];
        assert_eq!(columns(&rows), want);
        assert_eq!(columns(&[]), [""]);
    }
}
