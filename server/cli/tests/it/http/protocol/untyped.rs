//! The API document describes the type of all requests and responses.

use serde_json::{Value, json};

/// Intentionally untyped schemas, with the reason.
const OPEN: &[(&str, &str)] =
    &[("GET /openapi.json 200", "this document: its own form is OpenAPI's to say, not this API's")];

/// Adds the paths below `place` for which `schema` only states JSON or an arbitrary object.
fn find_untyped(schema: &Value, place: &str, untyped: &mut Vec<String>) {
    let parts = |key: &str| schema[key].as_array().into_iter().flatten();
    let types: Vec<&str> = match &schema["type"] {
        Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
        one => one.as_str().into_iter().collect(),
    };
    for part in ["oneOf", "anyOf", "allOf"].into_iter().flat_map(parts) {
        find_untyped(part, place, untyped);
    }
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        find_untyped(property, &format!("{place}.{name}"), untyped);
    }
    for inside in ["items", "additionalProperties"] {
        if schema[inside].is_object() {
            find_untyped(&schema[inside], &format!("{place}[]"), untyped);
        }
    }
    let says = |key: &str| !schema[key].is_null();
    let referred = ["$ref", "oneOf", "anyOf", "allOf", "enum", "const"].into_iter().any(says);
    let open_object = types.contains(&"object") && !says("properties") && !says("additionalProperties");
    let open_list = types.contains(&"array") && !says("items") && !says("prefixItems");
    if (types.is_empty() && !referred) || open_object || open_list {
        untyped.push(place.to_owned());
    }
}

/// The schemas of bodies and parameters of an operation.
fn schemas_of<'a>(place: &str, operation: &'a Value) -> Vec<(String, &'a Value)> {
    let mut schemas = Vec::new();
    let mut add = |name: String, contents: &'a Value| {
        let contents = contents["content"].as_object().into_iter().flatten();
        schemas.extend(contents.map(|(_, content)| (name.clone(), &content["schema"])));
    };
    add(format!("{place} body"), &operation["requestBody"]);
    for (status, response) in operation["responses"].as_object().into_iter().flatten() {
        add(format!("{place} {status}"), response);
    }
    for parameter in operation["parameters"].as_array().into_iter().flatten() {
        let name = parameter["name"].as_str().unwrap_or_default();
        schemas.push((format!("{place} {name}"), &parameter["schema"]));
    }
    schemas
}

fn untyped_of(document: &Value) -> Vec<String> {
    let mut untyped = Vec::new();
    for (name, schema) in document["components"]["schemas"].as_object().into_iter().flatten() {
        find_untyped(schema, name, &mut untyped);
    }
    for (path, item) in document["paths"].as_object().into_iter().flatten() {
        for (method, operation) in item.as_object().into_iter().flatten() {
            for (place, schema) in schemas_of(&format!("{} {path}", method.to_uppercase()), operation) {
                find_untyped(schema, &place, &mut untyped);
            }
        }
    }
    untyped
}

#[test]
fn requests_and_responses_are_typed() {
    let document = concat!(env!("CARGO_MANIFEST_DIR"), "/../../openapi/openapi.json");
    let document: Value = serde_json::from_str(&std::fs::read_to_string(document).unwrap()).unwrap();
    assert!(document["components"]["schemas"].as_object().unwrap().len() > 100);
    let open: Vec<&str> = OPEN.iter().map(|(place, _)| *place).collect();
    assert_eq!(untyped_of(&document), open, "give it a wire type, or say in OPEN why it has none");
}

#[test]
fn untyped_schemas_are_detected() {
    let either =
        json!({ "oneOf": [{ "type": "null" }, { "properties": { "d": { "type": "array" } }, "type": "object" }] });
    let document = json!({
        "components": { "schemas": {
            "Any": { "type": "object", "properties": { "a": {}, "b": { "type": "string" }, "c": { "description": "x" } } },
            "Either": either,
            "List": { "type": "array", "items": { "type": ["object", "null"] } },
            "Map": { "type": "object", "additionalProperties": { "description": "y" } },
            "Whole": { "type": "object", "properties": { "e": { "$ref": "#/components/schemas/Map" } } },
        } },
        "paths": { "/x": { "post": {
            "requestBody": { "content": { "application/json": { "schema": {} } } },
            "responses": { "200": { "content": { "application/json": { "schema": { "type": "object" } } } } },
        } } },
    });
    let found = untyped_of(&document);
    assert_eq!(found, ["Any.a", "Any.c", "Either.d", "List[]", "Map[]", "POST /x body", "POST /x 200"]);
}
