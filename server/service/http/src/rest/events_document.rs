//! The event catalogue as a page, generated from the types.

use std::fmt::Write as _;

use serde_json::Value;

/// Every kind of event with its body, as Markdown; `document` is the API's document.
pub fn events_markdown(document: &Value) -> String {
    let schemas = &document["components"]["schemas"];
    let mut text = "# Events\n\n\
        Events in the order in which they were stored: `GET /api/v1/events` lists them, or streams them with \
        `Accept: text/event-stream`; the live stream announces the number of the newest one.\n\
        Every event has `seq`, `kind`, `subject` (id of the resource concerned), `at_ms` and `body`.\n\
        This page is generated from the types by `cargo xtask openapi`.\n\n\
        | Kind | What happened | Body |\n|---|---|---|\n"
        .to_owned();
    for variant in schemas["Event"]["oneOf"].as_array().into_iter().flatten() {
        let kind = variant["properties"]["kind"]["enum"][0].as_str().unwrap_or_default();
        let about = variant["description"].as_str().unwrap_or_default();
        let mut fields = Vec::new();
        collect_fields(schemas, &variant["properties"]["body"], &mut fields);
        let _ = writeln!(text, "| `{kind}` | {about} | {} |", fields.join(", "));
    }
    text
}

/// The fields of a schema, through references and `allOf`.
fn collect_fields(schemas: &Value, schema: &Value, fields: &mut Vec<String>) {
    if let Some(name) = schema["$ref"].as_str().and_then(|path| path.rsplit('/').next()) {
        collect_fields(schemas, &schemas[name], fields);
    }
    for part in schema["allOf"].as_array().into_iter().flatten() {
        collect_fields(schemas, part, fields);
    }
    let required: Vec<&str> =
        schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    for name in schema["properties"].as_object().into_iter().flat_map(|properties| properties.keys()) {
        let optional = if required.contains(&name.as_str()) { "" } else { "?" };
        fields.push(format!("`{name}`{optional}"));
    }
}
