//! The program `sheaf`. Everything is in the library `cli`, so that its documentation is checked like that of the other
//! crates.

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
