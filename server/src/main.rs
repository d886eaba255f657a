//! `sheaf`: the command line of the scanner. Parses, dispatches, prints, and ends with a documented exit code.
#![allow(clippy::result_large_err, reason = "a problem ends a request: its size does not matter")]

mod allocations;
mod app;
mod auto_exposure;
mod background;
mod calibration_file;
mod calibrations;
mod camera_memory;
mod captures;
mod cli;
mod closing;
mod cloud_provenance;
mod commands;
mod config;
mod control;
mod edge;
mod failure;
mod features;
mod housekeeping;
mod http;
mod jobs;
mod labels;
mod ledger;
mod measurement_plan;
mod measurements;
mod memory;
mod output;
mod palette;
mod parts;
mod photographer;
mod photographs;
mod picture;
mod pipeline;
mod pixel_row;
mod problem;
mod problem_causes;
mod progress;
mod refusal;
mod report;
mod residuals;
mod service;
mod sessions;
mod stored_calibration;
mod stored_scan;
mod study;
mod surface_region;
mod tables;
mod truth;
mod virtual_operator;
mod ws;

use std::process::ExitCode;

use clap::Parser as _;

use cli::{Cli, JsonTo};
use failure::{Exit, Failure};
use progress::Reporter;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let reporter = Reporter::new(cli.voice.quiet);
    let json_on_stdout = cli.voice.json == Some(JsonTo::Stdout);
    let answer = commands::run(cli.command, json_on_stdout, &reporter).and_then(|answer| match &cli.voice.json {
        Some(JsonTo::File(path)) => answer.write_json(path).map(|()| answer),
        _ => Ok(answer),
    });
    match answer {
        Ok(answer) => {
            let printed = if json_on_stdout { answer.print_json() } else { answer.print_text() };
            let exit = if printed { answer.exit } else { Exit::Done };
            ExitCode::from(exit as u8)
        }
        Err(failure) => {
            if json_on_stdout {
                println!("{}", failure.to_json());
            }
            eprintln!("{}", failure.to_text());
            ExitCode::from(failure.exit() as u8)
        }
    }
}

/// Help and version go to stdout with exit code 0; a wrong command line to stderr with 2.
fn usage(error: &clap::Error) -> ExitCode {
    if error.use_stderr() && std::env::args().any(|argument| argument == "--json") {
        let what = error.to_string();
        let first = what.lines().next().unwrap_or_default().trim_start_matches("error: ");
        println!("{}", Failure::new(Exit::Usage, first).remedy("see sheaf --help").to_json());
    }
    let exit = if error.use_stderr() { Exit::Usage } else { Exit::Done };
    // A closed pipe is no reason to fail while printing help.
    let _ = error.print();
    ExitCode::from(exit as u8)
}
