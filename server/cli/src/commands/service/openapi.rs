//! `sheaf openapi`: prints the API document, the event catalogue or the Modbus register map.

use crate::arguments::{OpenapiArgs, RegisterFormat};
use crate::commands::Answer;
use http::{document_json, events_document};
use pipeline::Failure;
use serde_json::json;

/// Runs the command.
pub fn run(args: &OpenapiArgs) -> Result<Answer, Failure> {
    match args.registers {
        Some(RegisterFormat::Markdown) => return Ok(text("markdown", modbus_door::markdown())),
        Some(RegisterFormat::Csv) => return Ok(text("csv", modbus_door::csv())),
        None if args.events => return Ok(text("markdown", events_document())),
        None => {}
    }
    let text = document_json();
    let json = serde_json::from_str(&text).unwrap_or_default();
    Ok(Answer::done(text, json))
}

fn text(format: &str, text: String) -> Answer {
    Answer::done(text.clone(), json!({ format: text }))
}
