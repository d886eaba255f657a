//! `sheaf openapi`: the API's document.

use crate::arguments::OpenapiArgs;
use crate::commands::Answer;
use http::{document_json, events_document};
use pipeline::Failure;
use serde_json::json;

/// Prints it, or its catalogue of events.
pub fn run(args: &OpenapiArgs) -> Result<Answer, Failure> {
    if args.events {
        let text = events_document();
        return Ok(Answer::done(text.clone(), json!({ "markdown": text })));
    }
    let text = document_json();
    let json = serde_json::from_str(&text).unwrap_or_default();
    Ok(Answer::done(text, json))
}
