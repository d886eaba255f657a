//! `sheaf config`: prints the effective configuration and the origin of each value.

use std::fmt::Write as _;

use config::ValueKind;
use serde_json::{Map, Value, json};

use crate::arguments::SettingsArgs;
use crate::commands::Answer;
use crate::config::{Effective, Flags, effective};
use pipeline::{Failure, FailureKind, failure_of};

/// Runs the command.
pub fn run(args: &SettingsArgs) -> Result<Answer, Failure> {
    let effective = effective_of(args)?;
    Ok(Answer::done(table(&effective), to_json(&effective)))
}

/// The configuration from defaults, file, environment and these flags.
pub fn effective_of(args: &SettingsArgs) -> Result<Effective, Failure> {
    let flags = Flags {
        listen: args.listen.clone(),
        data: args.data.clone(),
        config: args.config.clone(),
        set: args.set.clone(),
    };
    effective(&flags, std::env::vars()).map_err(|error| failure_of(FailureKind::BadInput, &error))
}

fn table(effective: &Effective) -> String {
    let mut text = String::new();
    let width = effective.values.iter().map(|(setting, ..)| setting.key.len()).max().unwrap_or(0);
    for (setting, value, origin) in &effective.values {
        let value = match value {
            ValueKind::Array(items) => items.iter().map(ToString::to_string).collect::<Vec<_>>().join(","),
            one => one.to_string(),
        };
        let _ = writeln!(text, "{:width$}  {value:<24}  {origin}  — {}", setting.key, setting.about);
    }
    text
}

fn to_json(effective: &Effective) -> Value {
    let rows = effective.values.iter().map(|(setting, value, from)| {
        // Settings are plain values, all of which exist in JSON.
        let value = config::Value::new(None, value.clone()).try_deserialize::<Value>().unwrap_or_default();
        (setting.key.clone(), json!({ "value": value, "from": from, "about": setting.about }))
    });
    Value::Object(rows.collect::<Map<_, _>>())
}
