//! One file per command: parse what it was given, call the core, answer.

mod bench;
mod calibrate;
pub mod centrelines;
pub mod config;
mod corners;
pub mod demo;
mod measure;
mod openapi;
mod scan;
mod serve;
mod study;
mod target;
mod triangulate;
mod twin;

use crate::exit::Exit;
use std::io::Write as _;
use std::path::Path;

use serde_json::Value;

use crate::arguments::Command;
use crate::output::write_file;
use pipeline::Failure;
use pipeline::Reporter;

/// What a command has to say.
#[derive(Debug)]
pub struct Answer {
    /// For a person; empty if everything was streamed already.
    pub text: String,
    /// For a machine.
    pub json: Value,
    /// Exit code; other than `Done` only for verdicts.
    pub exit: Exit,
}

impl Answer {
    /// A result without a verdict.
    pub fn done(text: String, json: Value) -> Self {
        Self { text, json, exit: Exit::Done }
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

/// Runs one command.
pub fn run(command: Command, json: bool, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    match command {
        Command::Calibrate(args) => calibrate::run(&args, reporter),
        Command::Scan(args) => scan::run(&args, reporter),
        Command::Triangulate(args) => triangulate::run(&args, json, reporter),
        Command::Centrelines(args) => centrelines::run(&args, reporter),
        Command::Corners(args) => corners::run(&args, reporter),
        Command::Measure(args) => measure::run(&args, reporter),
        Command::Bench(args) => bench::run(&args, reporter),
        Command::Study(args) => study::run(&args, reporter),
        Command::Target(args) => target::run(&args, reporter),
        Command::Twin(args) => twin::run(&args, reporter),
        Command::Demo(args) => demo::run(&args, reporter),
        Command::Serve(args) => serve::run(&args, json),
        Command::Config(args) => config::run(&args),
        Command::Openapi(args) => openapi::run(&args),
    }
}
