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
        let mut document = Plan::schema();
        if let Some(fields) = document.as_object_mut() {
            fields.retain(|key, _| !matches!(key.as_str(), "$defs" | "$schema" | "title"));
        }
        openapi_schema(document)
    }
}

impl ToSchema for PlanDto {
    fn name() -> Cow<'static, str> {
        NAME.into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        let mut document = Plan::schema();
        let parts = document["$defs"].as_object_mut().map(std::mem::take).unwrap_or_default();
        schemas.extend(parts.into_iter().map(|(name, part)| (format!("{NAME}{name}"), openapi_schema(part))));
    }
}

/// A JSON schema converted for OpenAPI: other `$ref` paths, constants as one-element enums, and attributes as plain
/// values.
fn openapi_schema(mut schema: Value) -> RefOr<Schema> {
    adapt(&mut schema);
    serde_json::from_value(schema).expect("schemas of the plan are objects, lists, references and choices")
}

fn adapt(schema: &mut Value) {
    match schema {
        Value::Object(fields) => {
            if let Some(Value::String(place)) = fields.get_mut("$ref") {
                *place = place.replace("#/$defs/", &format!("#/components/schemas/{NAME}"));
            }
            if let Some(one) = fields.remove("const") {
                fields.insert("enum".to_owned(), json!([one]));
            }
            if fields.get("additionalProperties") == Some(&json!(true)) {
                let plain = json!({ "type": ["string", "number", "boolean"] });
                fields.insert("additionalProperties".to_owned(), plain);
            }
            fields.values_mut().for_each(adapt);
        }
        Value::Array(items) => items.iter_mut().for_each(adapt),
        _ => {}
    }
}
