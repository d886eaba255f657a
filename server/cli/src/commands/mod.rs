//! One file per command: parse the arguments, call the core, print the result.

mod axis;
mod bench;
mod calibrate;
mod compare;
pub mod demo;
mod doctor;
pub mod images;
mod inspect;
mod measure;
mod recording;
mod scan;
pub mod service;
mod study;
mod twin;

use crate::answer::exit::{Exit, failure_json};
use std::io::Write as _;
use std::path::Path;

use serde_json::Value;

use crate::answer::output::write_file;
use crate::arguments::Command;
use pipeline::Failure;
use pipeline::Reporter;

/// The output of a command.
#[derive(Debug)]
pub struct Answer {
    /// As text; empty if everything was streamed already.
    pub text: String,
    /// As JSON.
    pub json: Value,
    /// Exit code; not `Done` for some verdicts, and if some of several images failed.
    pub exit: Exit,
}

impl Answer {
    /// A result without a verdict.
    pub fn done(text: String, json: Value) -> Self {
        Self { text, json, exit: Exit::Done }
    }

    /// With the warnings that were printed, in the JSON after those of the procedure itself.
    pub fn with_warnings(mut self, warnings: &[String]) -> Self {
        if let (Some(json), false) = (self.json.as_object_mut(), warnings.is_empty()) {
            let all = json.entry("warnings").or_insert_with(|| Value::Array(Vec::new()));
            if let Some(all) = all.as_array_mut() {
                let new = warnings.iter().map(|text| Value::from(text.as_str()));
                let new: Vec<Value> = new.filter(|text| !all.contains(text)).collect();
                all.extend(new);
            }
        }
        self
    }

    /// Prints the text; `false` if stdout is closed.
    pub fn print_text(&self) -> bool {
        write!(std::io::stdout().lock(), "{}", self.text).is_ok()
    }

    /// Writes the JSON value to a file.
    pub fn write_json(&self, path: &Path) -> Result<(), Failure> {
        write_file(path, format!("{:#}\n", self.json).as_bytes())
    }

    /// Prints the JSON value; `false` if stdout is closed.
    pub fn print_json(&self) -> bool {
        writeln!(std::io::stdout().lock(), "{:#}", self.json).is_ok()
    }
}

/// The output for several images of which some may have failed; the others are reported all the same.
///
/// `entries`: one per image, in order; for failed images from [`failed_entry`]. The exit code is that of the first failure.
pub fn with_failures(text: String, mut json: Value, entries: Vec<Value>, failures: &[Failure]) -> Answer {
    for failure in failures {
        eprintln!("{failure}");
    }
    if !failures.is_empty() && entries.len() > 1 {
        eprintln!("warning: {} of {} images gave no result", failures.len(), entries.len());
    }
    json["images"] = entries.into();
    let first = failures.first();
    if let Some(first) = first {
        json["problem"] = failure_json(first)["problem"].take();
    }
    Answer { text, json, exit: first.map_or(Exit::Done, |first| first.kind().into()) }
}

/// The JSON entry of an image that failed.
pub fn failed_entry(image: &Path, failure: &Failure) -> Value {
    let mut entry = failure_json(failure);
    entry["image"] = serde_json::json!(image);
    entry
}

/// Runs one command.
pub fn run(command: Command, json: bool, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    match command {
        Command::Calibrate(args) => calibrate::run(&args, reporter),
        Command::Axis(args) => axis::run(&args, reporter),
        Command::Scan(args) => scan::run(&args, reporter),
        Command::Triangulate(args) => images::triangulate::run(&args, json, reporter),
        Command::Centrelines(args) => images::centrelines::run(&args, reporter),
        Command::Corners(args) => images::corners::run(&args, reporter),
        Command::Measure(args) => measure::run(&args, reporter),
        Command::Inspect(args) => inspect::run(&args, reporter),
        Command::Compare(args) => compare::run(&args, reporter),
        Command::Recording(args) => recording::run(&args, reporter),
        Command::Bench(args) => bench::run(&args, reporter),
        Command::Study(args) => study::run(&args, reporter),
        Command::Target(args) => images::target::run(&args, reporter),
        Command::Twin(args) => twin::run(&args, reporter),
        Command::Demo(args) => demo::run(&args, reporter),
        Command::Serve(args) => service::serve::run(&args, json),
        Command::Config(args) => service::config::run(&args),
        Command::Devices => Ok(service::devices::run()),
        Command::Doctor(args) => doctor::run(&args, reporter),
        Command::Openapi(args) => service::openapi::run(&args),
    }
}
