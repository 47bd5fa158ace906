//! The program's own commands, run as children: what a tool answers is what the command prints, a panic or a full memory ends a call
//! and not the server, a cancelled call ends its child, and nothing can print on the server's stdout.

use super::root::Root;
use crate::global::Global;
use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::{Precision, Tracing};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Stdio;
use tokio::process::Command;
use tokio::sync::Semaphore;

/// Runs commands, one at a time, because each takes all processors.
#[derive(Debug)]
pub struct Program {
    executable: PathBuf,
    folder: PathBuf,
    /// Options of the server that its commands have too.
    options: Vec<String>,
    turn: Semaphore,
}

/// What a command said.
#[derive(Debug)]
pub struct Answer {
    /// The object that it printed.
    pub object: Value,
    /// Its notes and warnings.
    pub notes: Vec<String>,
}

impl Program {
    /// The program that runs, at work below `root`.
    ///
    /// # Errors
    /// Returns an error if the system does not say where the program lies.
    pub fn new(global: &Global, root: &Root) -> Result<Program> {
        let executable = std::env::current_exe().map_err(|e| Error::io("catseye", e))?;
        let mut options = vec![format!("--device={}", global.device)];
        options.push(match global.precision {
            Precision::F32 => "--precision=f32".into(),
            Precision::F64 => "--precision=f64".into(),
        });
        options.extend(global.trace.map(|t| match t {
            Tracing::Host => "--trace=host".into(),
            Tracing::Device => "--trace=device".into(),
            Tracing::Lines => "--trace=lines".into(),
        }));
        Ok(Program { executable, folder: root.folder().into(), options, turn: Semaphore::new(1) })
    }

    /// Runs a command with `--json`. `computes` gives it the options of the engine.
    ///
    /// # Errors
    /// Returns the error that the command printed, in the words of the tool's inputs.
    pub async fn run(&self, arguments: &[String], computes: bool) -> Result<Answer> {
        let failed = |why: String| Error::Failed(why);
        let _turn = self.turn.acquire().await.map_err(|e| failed(e.to_string()))?;
        let mut command = Command::new(&self.executable);
        command
            .args(arguments)
            .arg("--json")
            .current_dir(&self.folder)
            .stdin(Stdio::null())
            .kill_on_drop(true);
        if computes {
            command.args(&self.options);
        }
        let out = command.output().await.map_err(|e| Error::io(&self.executable, e))?;
        let said = String::from_utf8_lossy(&out.stderr);
        let object: Option<Value> = serde_json::from_slice(&out.stdout).ok();
        match object {
            Some(object) if out.status.success() => {
                let notes = said.lines().filter(|l| l.starts_with("note: ") || l.starts_with("warning: "));
                Ok(Answer { object, notes: notes.map(str::to_string).collect() })
            }
            Some(object) if object.get("error").is_some() => Err(error_of(&object["error"])),
            _ => Err(failed(format!(
                "the command '{}' ended without output ({}): {}",
                arguments.first().map_or("", String::as_str),
                out.status,
                said.lines().last().unwrap_or("there is no message")
            ))),
        }
    }
}

/// The error that a command printed. Its options become inputs of a tool: `--azimuth-deg` is `azimuth_deg`.
fn error_of(printed: &Value) -> Error {
    let text = |key: &str| printed.get(key).and_then(Value::as_str).map(in_inputs);
    let Some(problem) = text("problem") else {
        return Error::Failed(text("message").unwrap_or_else(|| "the command failed".into()));
    };
    let line = printed.get("line").and_then(Value::as_u64).and_then(|n| usize::try_from(n).ok());
    BadInput {
        file: text("file").map(PathBuf::from),
        line,
        key: text("key"),
        value: text("value"),
        problem,
        allowed: text("allowed"),
        remedy: text("remedy"),
        allowed_whole: false,
    }
    .into()
}

/// An error of the library that speaks of options of commands, in the words of inputs.
pub fn in_words_of_inputs(e: Error) -> Error {
    match &e {
        Error::Input(_) => error_of(&e.json()["error"]),
        _ => e,
    }
}

fn in_inputs(text: &str) -> String {
    let mut out = String::new();
    let mut words = text.split("--");
    out += words.next().unwrap_or("");
    for word in words {
        let end = word.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(word.len());
        let (name, rest) = word.split_at(end);
        match name.is_empty() || name.starts_with('-') {
            true => out += &format!("--{word}"),
            false => out += &format!("{}{rest}", name.replace('-', "_")),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_speak_of_inputs() {
        assert_eq!(in_inputs("--azimuth-deg x --elevation-deg"), "azimuth_deg x elevation_deg");
        assert_eq!(in_inputs("add --force to replace it"), "add force to replace it");
        assert_eq!(in_inputs("a -- b, 3--4"), "a -- b, 3--4");
        let e = error_of(
            &serde_json::json!({ "message": "m", "key": "--range-m", "value": "-1", "problem": "is out of range",
            "allowed": "0.1..1e6", "exit_code": 2 }),
        );
        assert_eq!(e.to_string(), "range_m = -1: is out of range; allowed: 0.1..1e6");
        assert_eq!(error_of(&serde_json::json!({ "message": "broke", "exit_code": 1 })).to_string(), "broke");
    }
}
