//! `sheaf`: the command line of the scanner. Parses, dispatches, prints, and ends with a documented exit code.
//!
//! Contains the commands, the layers of the configuration, benchmarks and studies, and the composition of the service.
//! Only `main.rs` and nothing else imports this crate.

mod answer;
mod arguments;
mod commands;
mod config;
mod doors;
mod drivers;
mod heap;
mod inputs;
mod service;
mod study;

use std::process::ExitCode;

use clap::Parser as _;

use answer::exit::{Exit, failure_json};
use answer::progress::Stderr;
use arguments::{Cli, JsonTo};
use pipeline::{Failure, FailureKind};

/// Runs the program `sheaf`.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let reporter = Stderr::new(cli.output.quiet);
    let json_on_stdout = cli.output.json == Some(JsonTo::Stdout);
    let answer = commands::run(cli.command, json_on_stdout, &reporter).and_then(|answer| {
        let answer = answer.with_warnings(&reporter.warnings());
        match &cli.output.json {
            Some(JsonTo::File(path)) => answer.write_json(path).map(|()| answer),
            _ => Ok(answer),
        }
    });
    match answer {
        Ok(answer) => {
            let printed = if json_on_stdout { answer.print_json() } else { answer.print_text() };
            let exit = if printed { answer.exit } else { Exit::Done };
            ExitCode::from(exit as u8)
        }
        Err(failure) => {
            if json_on_stdout {
                println!("{}", failure_json(&failure));
            }
            eprintln!("{failure}");
            ExitCode::from(Exit::from(failure.kind()) as u8)
        }
    }
}

/// Help and version go to stdout with exit code 0; usage errors to stderr with exit code 2.
fn usage(error: &clap::Error) -> ExitCode {
    if error.use_stderr() && std::env::args().any(|argument| argument == "--json") {
        let text = error.to_string();
        // The first paragraph says what is wrong; usage and hints follow.
        let paragraph = text.lines().take_while(|line| !line.trim().is_empty()).map(str::trim);
        let what = paragraph.collect::<Vec<_>>().join(" ");
        let what = what.trim_start_matches("error: ");
        println!("{}", failure_json(&Failure::new(FailureKind::BadParameter, what).remedy("see sheaf --help")));
    }
    let exit = if error.use_stderr() { Exit::Usage } else { Exit::Done };
    // A closed pipe is no reason to fail while printing help.
    let _ = error.print();
    ExitCode::from(exit as u8)
}
