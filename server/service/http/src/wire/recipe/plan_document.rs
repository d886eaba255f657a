//! The document `sheaf-plan/1` on the wire: the document itself, and the schema it is published with.

use std::borrow::Cow;

use metrology::Plan;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

/// A plan: features, alignment, characteristics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PlanDto(pub Plan);

/// Schema name of the document in the API, and prefix of the names of its parts.
const NAME: &str = "Plan";

impl PartialSchema for PlanDto {
    fn schema() -> RefOr<Schema> {
        root_of(NAME, Plan::schema())
    }
}

impl ToSchema for PlanDto {
    fn name() -> Cow<'static, str> {
        NAME.into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.extend(parts_of(NAME, Plan::schema()));
    }
}

/// The schema of a document called `name` in the API, without its parts.
pub fn root_of(name: &str, mut document: Value) -> RefOr<Schema> {
    if let Some(fields) = document.as_object_mut() {
        fields.retain(|key, _| !matches!(key.as_str(), "$defs" | "$schema" | "title"));
    }
    openapi_schema(name, document)
}

/// The schemas of the parts of a document; their names start with its own.
pub fn parts_of(name: &str, mut document: Value) -> impl Iterator<Item = (String, RefOr<Schema>)> {
    let parts = document["$defs"].as_object_mut().map(std::mem::take).unwrap_or_default();
    parts.into_iter().map(move |(part, schema)| (format!("{name}{part}"), openapi_schema(name, schema)))
}

/// A JSON schema converted for OpenAPI: other `$ref` paths, constants as one-element enums, and attributes as plain
/// values.
fn openapi_schema(name: &str, mut schema: Value) -> RefOr<Schema> {
    adapt(name, &mut schema);
    serde_json::from_value(schema).expect("schemas of documents are objects, lists, references and choices")
}

fn adapt(name: &str, schema: &mut Value) {
    match schema {
        Value::Object(fields) => {
            if let Some(Value::String(place)) = fields.get_mut("$ref") {
                *place = place.replace("#/$defs/", &format!("#/components/schemas/{name}"));
            }
            if let Some(one) = fields.remove("const") {
                fields.insert("enum".to_owned(), json!([one]));
            }
            if fields.get("additionalProperties") == Some(&json!(true)) {
                let plain = json!({ "type": ["string", "number", "boolean"] });
                fields.insert("additionalProperties".to_owned(), plain);
            }
            fields.values_mut().for_each(|value| adapt(name, value));
        }
        Value::Array(items) => items.iter_mut().for_each(|item| adapt(name, item)),
        _ => {}
    }
}
