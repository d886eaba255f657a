//! The program `sheaf`: all of it is the library `cli` beside this file, so that its documentation is checked like any other's.

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
