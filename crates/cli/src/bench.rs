//! `catseye bench`: the standard workloads on a device.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::Result;
use catseye::base::tasks::WorkAndSpan;
use catseye::engine::devices::{Start, Starts};
use catseye::gpu::{KernelUse, Profile};
use catseye_papers::bench::{self, Outcome, Settings};
use clap::Args;
use serde_json::Value;

/// Time the standard workloads on this device and check their results
#[derive(Debug, Args)]
#[command(after_help = format!("Workloads:\n{}", list()))]
pub struct Bench {
    /// Use fewer directions, rays and frames: takes minutes instead of a quarter of an hour
    #[arg(long)]
    pub quick: bool,
    /// Run only these workloads
    #[arg(long, value_delimiter = ',', value_name = "W1,W4,...")]
    pub only: Vec<String>,
    /// List the kernels of each workload: number of runs, workgroups, threads, bytes bound and, if the
    /// adapter has timestamp queries, the time on the device
    #[arg(long)]
    pub profile: bool,
}

fn list() -> String {
    bench::WORKLOADS.map(|(name, title)| format!("  {name:<10} {title}")).join("\n")
}

impl Bench {
    pub fn run(&self, global: &Global) -> Result<()> {
        let settings = Settings { quick: self.quick, seed: global.seed.unwrap_or(1) };
        let mut engine = global.engine()?;
        if self.profile {
            engine = engine.with_profiling();
        }
        let bar = global.bar("bench", 0, Kept::Nothing);
        let say = |m: &str| bar.suspend(|| global.say(m));
        let starts = bench::starts(&engine, &say)?;
        let outcomes = bench::run(&engine, &self.only, &settings, &say)?;
        drop(bar);
        if global.json {
            return print_json(&serde_json::json!({
                "version": env!("CARGO_PKG_VERSION"),
                "device": engine.report(),
                "threads": rayon::current_num_threads(),
                "starts": starts,
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
        if let Some(starts) = &starts {
            print(&start_lines(starts))?;
        }
        outcomes.iter().try_for_each(|o| {
            print(&table(o))?;
            if self.profile { print(&kernels(o.kernels.as_ref(), o.total_seconds)) } else { Ok(()) }
        })
    }
}

/// The starts of the device, as lines.
fn start_lines(starts: &Starts) -> String {
    let line = |name: &str, s: &Start| {
        let all_s = s.first_result_s + s.pipelines_s;
        format!(
            "  {name:<28} {all_s:>12.4} s   first result {:.4} s, other kernels {:.4} s",
            s.first_result_s, s.pipelines_s
        )
    };
    let cache = match starts.cache_bytes {
        Some(bytes) => format!("cache of {:.1} kB", bytes as f64 / 1e3),
        None => "the adapter has no pipeline cache".into(),
    };
    [
        format!("\nstart: the device is opened and its {} kernels are compiled; {cache}", starts.kernels),
        line("cold", &starts.cold),
        line("warm", &starts.warm),
    ]
    .join("\n")
}

fn table(o: &Outcome) -> String {
    let mut lines = vec![format!("\n{}: {}", o.workload, o.title)];
    for s in &o.stages {
        let runs = if s.runs > 1 { format!("median of {}", s.runs) } else { "one run".into() };
        let (core_s, tasks) = (cores(s.core_seconds), work_and_span(s.tasks.as_ref()));
        lines.push(format!("  {:<28} {:>12.4} s{core_s}   {runs}{tasks}", s.name, s.seconds));
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
    let (core_s, tasks) = (cores(o.core_seconds), work_and_span(o.tasks.as_ref()));
    lines.push(format!("  {:<28} {:>12.4} s{core_s}{tasks}", "total", o.total_seconds));
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

/// The table of a workload's kernels, those that took the longest first.
fn kernels(profile: Option<&Profile>, total_s: f64) -> String {
    let Some(profile) = profile.filter(|p| !p.kernels.is_empty()) else {
        return "  kernels: none ran on a device in these stages".into();
    };
    let head = match profile.seconds() {
        Some(s) => format!("  kernels: {s:.4} s on the device in stages of {total_s:.4} s"),
        None => {
            "  kernels: this adapter has no timestamp queries, so their times on the device are not known"
                .into()
        }
    };
    let mut rows = profile.kernels.clone();
    rows.sort_by(|a, b| {
        b.seconds.unwrap_or(0.0).total_cmp(&a.seconds.unwrap_or(0.0)).then(b.threads.cmp(&a.threads))
    });
    let rows: Vec<Value> = rows.iter().map(|k| kernel_row(k, profile.seconds())).collect();
    std::iter::once(head)
        .chain(columns(&rows).into_iter().map(|l| format!("  {l}")))
        .collect::<Vec<_>>()
        .join("\n")
}

/// A kernel as a row, with its share of the time of all.
fn kernel_row(k: &KernelUse, all_s: Option<f64>) -> Value {
    let mut row = serde_json::Map::new();
    row.insert("kernel".into(), k.kernel.into());
    row.insert("dispatches".into(), k.dispatches.into());
    row.insert("workgroups".into(), k.workgroups.into());
    row.insert("threads".into(), k.threads.into());
    row.insert("bound_MB".into(), format!("{:.3}", k.bound_bytes as f64 / 1e6).into());
    if let Some((s, all_s)) = k.seconds.zip(all_s) {
        row.insert("ms".into(), format!("{:.3}", 1e3 * s).into());
        row.insert("share_%".into(), format!("{:.1}", 100.0 * s / all_s.max(f64::MIN_POSITIVE)).into());
    }
    row.into()
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

/// Work and span with the number of processors that they can keep busy.
fn work_and_span(tasks: Option<&WorkAndSpan>) -> String {
    tasks.map_or(String::new(), |t| {
        format!("   work {:.4} s, span {:.4} s: {:.1} processors", t.work_s, t.span_s, t.parallelism())
    })
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
    fn kernels_are_a_table_with_times_where_there_are_any() {
        let used = |kernel, seconds| KernelUse {
            kernel,
            dispatches: 2,
            workgroups: 8,
            threads: 512,
            bound_bytes: 1_500_000,
            seconds,
        };
        let timed = Profile {
            has_timestamps: true,
            kernels: vec![used("adc/convert", Some(0.001)), used("dsp/fft", Some(0.003))],
        };
        let text = kernels(Some(&timed), 0.01);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "  kernels: 0.0040 s on the device in stages of 0.0100 s");
        let words = |line: &str| line.split_whitespace().map(String::from).collect::<Vec<_>>();
        let head = ["kernel", "dispatches", "workgroups", "threads", "bound_MB", "ms", "share_%"];
        assert_eq!(words(lines[1]), head);
        assert_eq!(words(lines[2]), ["dsp/fft", "2", "8", "512", "1.500", "3.000", "75.0"]);
        assert_eq!(words(lines[3]), ["adc/convert", "2", "8", "512", "1.500", "1.000", "25.0"]);

        let untimed = Profile { has_timestamps: false, kernels: vec![used("dsp/fft", None)] };
        let text = kernels(Some(&untimed), 0.01);
        assert!(
            text.contains("no timestamp queries") && text.contains("dsp/fft") && !text.contains("ms"),
            "{text}"
        );
        assert!(kernels(None, 0.01).contains("none ran"));
    }

    #[test]
    fn starts_are_two_lines() {
        let start = |pipelines_s| Start { first_result_s: 0.25, pipelines_s };
        let starts =
            Starts { kernels: 33, cold: start(1.25), warm: start(0.05), cache_bytes: Some(2_340_000) };
        let text = start_lines(&starts);
        let lines: Vec<&str> = text.trim_start().lines().collect();
        assert!(lines[0].contains("33 kernels") && lines[0].ends_with("cache of 2340.0 kB"), "{text}");
        assert!(
            lines[1].contains("cold") && lines[1].contains(" 1.5000 s   first result 0.2500 s"),
            "{text}"
        );
        assert!(
            lines[2].contains("warm")
                && lines[2].ends_with("0.3000 s   first result 0.2500 s, other kernels 0.0500 s"),
            "{text}"
        );
        let without = start_lines(&Starts { cache_bytes: None, ..starts });
        assert!(without.contains("no pipeline cache"), "{without}");
    }

    #[test]
    fn lists_of_objects_are_tables() {
        let time = |s: f64| json!({ "core_s": 2.0 * s, "s": s });
        let rows = [json!({ "n": 5, "time": time(0.5) }), json!({ "n": 1000, "time": time(12.0) })];
        let want = ["     n  time (core_s / s)", "     5    1.0000 / 0.5000", "  1000  24.0000 / 12.0000"];
        assert_eq!(columns(&rows), want);
        assert_eq!(columns(&[]), [""]);
    }
}
