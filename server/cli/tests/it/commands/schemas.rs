//! The published JSON Schemas accept what the program writes and reject what it rejects.
//!
//! Not shown here: relations between entries that a schema cannot state; the readers check those.

use std::path::Path;

use crate::common::{path, sheaf_ok, small_capture};
use jsonschema::Validator;
use serde_json::{Value, json};

fn schema(name: &str) -> Validator {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schemas").join(name);
    jsonschema::validator_for(&read(&file)).unwrap()
}

fn read(file: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

#[track_caller]
fn holds(validator: &Validator, document: &Value) {
    let errors: Vec<String> =
        validator.iter_errors(document).map(|error| format!("{} at {}", error, error.instance_path())).collect();
    assert!(errors.is_empty(), "{errors:#?}");
}

/// Whether the document in `file` follows the schema of that name.
#[track_caller]
pub fn follows(name: &str, file: &Path) {
    holds(&schema(&format!("{name}.schema.json")), &read(file));
}

#[test]
fn calibration_documents_of_every_model_follow_their_schema() {
    let validator = schema("calibration.schema.json");
    let folder = tempfile::tempdir().unwrap();
    let file = path(folder.path(), "cal.json");
    for model in ["planes", "pencil", "grating"] {
        let capture = small_capture();
        sheaf_ok(&["calibrate", capture.to_str().unwrap(), "-o", &file, "--light-model", model, "-q"]);
        holds(&validator, &read(Path::new(&file)));
    }
}

#[test]
fn a_damaged_calibration_document_breaks_its_schema() {
    let validator = schema("calibration.schema.json");
    let sound = read(&crate::common::small_calibration());
    for (pointer, value) in [
        ("/format", json!("sheaf-calibration/2")),
        ("/id", json!("")),
        ("/camera/fx_px", json!(-1.0)),
        ("/camera/fx_px", Value::Null),
        ("/orders", json!([])),
        ("/light/model", json!("planes")),
        ("/light/axis", json!([1.0, 0.0])),
        ("/inputs/0/sha256", json!("abc")),
    ] {
        let mut damaged = sound.clone();
        *damaged.pointer_mut(pointer).unwrap() = value;
        assert!(!validator.is_valid(&damaged), "{pointer}");
    }
}

#[test]
fn captures_of_the_twin_follow_their_schema() {
    holds(&schema("capture.schema.json"), &read(&small_capture().join("capture.json")));
}
