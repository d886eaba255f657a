//! A setting, derived from the JSON schema of its field: key, description and allowed values.

use config::{Value, ValueKind};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value as Json;

use crate::config::settings::Settings;

/// A setting.
#[derive(Debug, Clone)]
pub struct Setting {
    /// Its key, as in the file; tables are separated by dots.
    pub key: String,
    /// Description.
    pub about: String,
    /// JSON schema of its type and limits.
    schema: Json,
}

/// All settings, by key.
pub fn all() -> Vec<Setting> {
    of::<Settings>()
}

/// The settings of the fields of `T` and of its tables.
pub fn of<T: JsonSchema>() -> Vec<Setting> {
    let inline = SchemaSettings::default().with(|settings| settings.inline_subschemas = true);
    let mut all = Vec::new();
    collect("", inline.into_generator().into_root_schema_for::<T>().as_value(), &mut all);
    all.sort_by(|a: &Setting, b| a.key.cmp(&b.key));
    all
}

fn collect(key: &str, schema: &Json, all: &mut Vec<Setting>) {
    match schema["properties"].as_object() {
        Some(fields) => {
            let dot = if key.is_empty() { "" } else { "." };
            fields.iter().for_each(|(name, field)| collect(&format!("{key}{dot}{name}"), field, all));
        }
        None => {
            let about = schema["description"].as_str().unwrap_or_default().to_owned();
            all.push(Setting { key: key.to_owned(), about, schema: schema.clone() });
        }
    }
}

impl Setting {
    /// The allowed values, as text.
    pub fn expected(&self) -> String {
        let words: Vec<_> =
            self.schema["enum"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
        if !words.is_empty() {
            return format!("one of {}", words.join(", "));
        }
        let expected = alternatives(&self.schema).iter().map(|schema| match schema["type"].as_str() {
            Some("string") => format!("a text: {}", self.about),
            Some("array") if schema["items"]["type"] == "object" => {
                format!("a list of tables: begin each with [[{}]]", self.key)
            }
            Some("array") => format!("a list, each {}", described(&schema["items"])),
            _ => described(schema),
        });
        expected.collect::<Vec<_>>().join(", or ")
    }

    /// Parses a value from the environment or a flag; lists are separated by commas.
    pub fn read(&self, text: &str) -> Option<ValueKind> {
        let read = |schema: &Json| {
            if schema["type"] != "array" {
                return scalar(schema, text);
            }
            let items = text.split(',').map(str::trim).filter(|item| !item.is_empty());
            let values = items.map(|item| Some(Value::new(None, scalar(&schema["items"], item)?)));
            values.collect::<Option<_>>().map(ValueKind::Array)
        };
        alternatives(&self.schema).iter().find_map(read).filter(|kind| self.admits(kind))
    }

    /// Whether `value` is allowed.
    pub fn admits(&self, value: &ValueKind) -> bool {
        alternatives(&self.schema).iter().any(|schema| admits(schema, value))
    }
}

/// The types that a value may have, usually one.
fn alternatives(schema: &Json) -> &[Json] {
    schema["anyOf"].as_array().map_or(std::slice::from_ref(schema), Vec::as_slice)
}

fn described(schema: &Json) -> String {
    let what = match schema["type"].as_str() {
        Some("boolean") => return "true or false".to_owned(),
        Some("integer") => "a whole number",
        Some("number") => "a number",
        _ => return "a text".to_owned(),
    };
    match (schema["minimum"].as_f64(), schema["maximum"].as_f64()) {
        (Some(least), Some(most)) => format!("{what} from {least} to {most}"),
        (Some(least), None) => format!("{what} from {least}"),
        _ => what.to_owned(),
    }
}

fn scalar(schema: &Json, text: &str) -> Option<ValueKind> {
    Some(match schema["type"].as_str()? {
        "integer" => ValueKind::I64(text.trim().parse().ok()?),
        "number" => ValueKind::Float(text.trim().parse().ok()?),
        "boolean" => ValueKind::Boolean(text.trim().parse().ok()?),
        _ => ValueKind::String(text.to_owned()),
    })
}

fn admits(schema: &Json, value: &ValueKind) -> bool {
    let within = |number: f64| {
        let least = schema["minimum"].as_f64().unwrap_or(f64::NEG_INFINITY);
        (least..=schema["maximum"].as_f64().unwrap_or(f64::INFINITY)).contains(&number)
    };
    match (schema["type"].as_str(), value) {
        (Some("string"), ValueKind::String(text)) => {
            schema["enum"].as_array().is_none_or(|words| words.iter().any(|word| word == text))
        }
        (Some("boolean"), ValueKind::Boolean(_)) => true,
        (Some("integer" | "number"), ValueKind::I64(number)) => within(*number as f64),
        (Some("number"), ValueKind::Float(number)) => within(*number),
        (Some("array"), ValueKind::Array(items)) => {
            let n = items.len() as u64;
            (schema["minItems"].as_u64().unwrap_or(0)..=schema["maxItems"].as_u64().unwrap_or(u64::MAX))
                .contains(&n)
                && items.iter().all(|item| admits(&schema["items"], &item.kind))
        }
        // A table in a list: its fields are checked where they are read.
        (Some("object"), ValueKind::Table(_)) => true,
        _ => false,
    }
}
