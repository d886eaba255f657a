//! `sheaf demo`.

use crate::cli::DemoArgs;
use crate::commands::Answer;
use crate::failure::{Exit, Failure};
use crate::progress::Reporter;

/// Not built yet.
pub fn run(args: &DemoArgs, reporter: &Reporter) -> Result<Answer, Failure> {
    let _ = (args, reporter);
    Err(Failure::new(Exit::Internal, "this command is not built yet"))
}
