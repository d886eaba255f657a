//! `sheaf openapi`: the API's document.

use crate::commands::Answer;
use http::document_json;
use pipeline::Failure;

/// Prints it.
pub fn run() -> Result<Answer, Failure> {
    let text = document_json();
    let json = serde_json::from_str(&text).unwrap_or_default();
    Ok(Answer::done(text, json))
}
