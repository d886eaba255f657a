//! `sheaf triangulate`.

use crate::cli::TriangulateArgs;
use crate::commands::Answer;
use crate::failure::{Exit, Failure};
use crate::progress::Reporter;

/// Not built yet.
pub fn run(args: &TriangulateArgs, json: bool, reporter: &Reporter) -> Result<Answer, Failure> {
    let _ = (args, json, reporter);
    Err(Failure::new(Exit::Internal, "this command is not built yet"))
}
