//! Recipes: what is refused and where, what a digest is of, what a diff names, what a file brings over.

use metrology::ModelRef;
use serde_json::{Value, json};

use crate::hash_hex;
use crate::resources::recipes::*;

/// A recipe for the ball on the simulated stage: its radius, within ±`tolerance_mm`.
pub(crate) fn ball(nominal_mm: f64, tolerance_mm: f64) -> Recipe {
    recipe(&json!({
        "name": "ball",
        "scan": { "from_mm": -8.0, "to_mm": 8.0, "step_mm": 0.5 },
        "plan": {
            "format": "sheaf-plan/1",
            "features": [{ "id": "ball", "shape": { "type": "sphere" } }],
            "characteristics": [{ "id": "radius", "measure": { "type": "radius", "of": "ball" },
                "nominal_mm": nominal_mm, "lower": -tolerance_mm, "upper": tolerance_mm }],
        },
    }))
}

fn recipe(value: &Value) -> Recipe {
    serde_json::from_value(value.clone()).unwrap()
}

/// With the value at a pointer replaced, or a new last entry of the object there.
fn with(pointer: &str, value: &Value) -> Recipe {
    let mut changed = ball(18.9, 0.05).to_value();
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    changed.pointer_mut(parent).unwrap()[key] = value.clone();
    recipe(&changed)
}

#[test]
fn an_invalid_recipe_is_refused_with_its_pointer() {
    ball(18.9, 0.05).check().unwrap();
    let characteristic = "/plan/characteristics/0";
    let mut attributed = ball(18.9, 0.05);
    attributed.plan.characteristics[0].attributes.insert("K2001".into(), json!([4]));
    let mut turned = ball(18.9, 0.05);
    turned.scan.from_deg = Some(0.0);
    let mut unmeasured = ball(18.9, 0.05);
    unmeasured.plan.characteristics.clear();
    let mut misnamed = ball(18.9, 0.05);
    misnamed.plan.characteristics[0].nominal_deg = Some(3.0);
    let mut doubled = ball(18.9, 0.05);
    (doubled.scan.exposure_us, doubled.scan.exposures_us) = (Some(100.0), vec![100.0, 400.0]);
    let cases = [
        (with("/name", &json!(" ")), "/recipe/name"),
        (with("/number", &json!(0)), "/recipe/number"),
        (with("/serial_pattern", &json!("[")), "/recipe/serial_pattern"),
        (with("/scan/step_mm", &json!(0.0)), "/recipe/scan/step_mm"),
        (with("/scan/to_mm", &Value::Null), "/recipe/scan"),
        (with("/scan/laser_power", &json!(1.5)), "/recipe/scan/laser_power"),
        (with("/scan/exposures_us", &json!([5.0])), "/recipe/scan/exposures_us"),
        (doubled, "/recipe/scan/exposures_us"),
        (turned, "/recipe/scan"),
        (with(&format!("{characteristic}/upper"), &json!(-1.0)), "/recipe/plan/characteristics/0/lower"),
        (with("/plan/features/0/id", &json!("bowl")), "/recipe/plan/characteristics/0/measure"),
        (misnamed, "/recipe/plan/characteristics/0/nominal_deg"),
        (attributed, "/recipe/plan/characteristics/0/attributes/K2001"),
        (unmeasured, "/recipe/plan/characteristics"),
        (with("/attributes", &json!({ "line\n": "2" })), "/recipe/attributes"),
    ];
    for (recipe, place) in cases {
        let problem = recipe.check().unwrap_err();
        assert_eq!(problem.pointer.as_deref(), Some(place), "{problem:?}");
        assert!(problem.remedy.is_some(), "{problem:?}");
    }
}

#[test]
fn a_digest_is_of_the_content_and_not_of_how_it_is_written() {
    let known = ball(18.9, 0.05);
    let text = known.to_value().to_string();
    assert_eq!(serde_json::from_str::<Recipe>(&text).unwrap().digest(), known.digest());
    // As `printf '%s' … | sha256sum` says of the canonical text.
    let canonical = "{\"name\":\"ball\",\"plan\":{\"characteristics\":[{\"id\":\"radius\",\"lower\":-0.05,\
        \"measure\":{\"of\":\"ball\",\"type\":\"radius\"},\"nominal_mm\":18.9,\"upper\":0.05}],\"features\":[{\"id\":\"ball\",\
        \"shape\":{\"select\":{},\"type\":\"sphere\"}}],\"format\":\"sheaf-plan/1\",\"seed\":1},\
        \"scan\":{\"from_mm\":-8.0,\"step_mm\":0.5,\"to_mm\":8.0}}";
    assert_eq!(known.digest(), crate::hash_hex(canonical.as_bytes()));
    assert_ne!(ball(18.9, 0.051).digest(), known.digest());
}

#[test]
fn a_version_that_does_not_match_its_digest_is_damaged() {
    let recipe = ball(18.9, 0.05);
    let version = RecipeVersion {
        id: "ball".into(),
        version: 3,
        digest: recipe.digest(),
        author: "Anna".into(),
        reason: "first".into(),
        restored_from: None,
        created_at_ms: 1,
        recipe,
    };
    let mut record = version.to_record();
    assert_eq!(RecipeVersion::of(record.clone()).unwrap(), version);
    record.content["plan"]["characteristics"][0]["upper"] = json!(0.5);
    let problem = RecipeVersion::of(record).unwrap_err();
    assert_eq!(problem.cause.as_deref(), Some("its digest differs"));
}

#[test]
fn a_diff_names_features_and_characteristics_by_id() {
    let old = ball(18.9, 0.05);
    let mut value = old.to_value();
    value["plan"]["characteristics"][0]["upper"] = json!(0.1);
    let flat = json!({ "id": "flat", "measure": { "type": "flatness", "of": "table" }, "upper": 0.2 });
    value["plan"]["characteristics"].as_array_mut().unwrap().insert(0, flat.clone());
    value["plan"]["features"].as_array_mut().unwrap().push(json!({ "id": "table", "shape": { "type": "plane" } }));
    value["number"] = json!(12);
    let new = recipe(&value);
    let change = |place: &str, old: Option<&str>, new: Option<&str>| PlaceChange {
        place: place.to_owned(),
        old: old.map(str::to_owned),
        new: new.map(str::to_owned),
    };
    let flat = flat.to_string();
    let table = r#"{"id":"table","shape":{"select":{},"type":"plane"}}"#;
    assert_eq!(
        changes_between(&old, &new),
        [
            change("/number", None, Some("12")),
            change("/plan/characteristics/flat", None, Some(&flat)),
            change("/plan/characteristics/radius/upper", Some("0.05"), Some("0.1")),
            change("/plan/features/table", None, Some(table)),
        ]
    );
    assert_eq!(changes_between(&old, &old), []);
    // The same things in another order are another recipe, and another digest.
    let mut turned = new.clone();
    turned.plan.characteristics.reverse();
    let order = changes_between(&new, &turned);
    assert_eq!(
        order,
        [change("/plan/characteristics", Some(r#"["flat","radius"]"#), Some(r#"["radius","flat"]"#))]
    );
}

#[test]
fn an_exported_recipe_is_imported_unchanged_and_a_modified_file_is_refused() {
    let recipe = ball(18.9, 0.05);
    let (id, author, reason) = ("ball".to_owned(), "Anna".to_owned(), "first".to_owned());
    let digest = Some(recipe.digest());
    let file = RecipeFile {
        format: RecipeFormat::V1,
        id,
        version: 3,
        digest,
        author,
        reason,
        recipe,
        models: Vec::new(),
    };
    let text = serde_json::to_string_pretty(&file).unwrap();
    assert_eq!(RecipeFile::from_json(&text).unwrap(), file);
    let changed = text.replace("0.05", "0.06");
    let error = RecipeFile::from_json(&changed).unwrap_err();
    assert!(error.to_string().starts_with("/digest: the recipe does not match its digest"), "{error}");
    let by_hand = changed.lines().filter(|line| !line.contains("\"digest\"")).collect::<String>();
    assert_eq!(RecipeFile::from_json(&by_hand).unwrap().recipe.plan.characteristics[0].upper, Some(0.06));
    let error = RecipeFile::from_json(&text.replace("\"step_mm\"", "\"stp_mm\"")).unwrap_err();
    assert!(matches!(error, RecipeFileError::Json { .. }), "{error}");
    let error =
        RecipeFile::from_json(&by_hand.replace("\"id\": \"ball\",  \"version\"", "\"id\": \"Ball\", \"version\""));
    assert!(error.unwrap_err().to_string().starts_with("/id"));
}

#[test]
fn a_file_with_a_damaged_or_unnamed_model_is_refused_at_its_place() {
    let recipe = ball(18.9, 0.05);
    let profile = |sha256: &str| {
        let mut recipe = recipe.clone();
        let model = json!({ "name": "block.stl", "sha256": sha256 });
        let measure = json!({ "type": "surface_profile", "model": model, "best_fit": true });
        recipe.plan.characteristics[0].measure = serde_json::from_value(measure).unwrap();
        recipe
    };
    let sha256 = hash_hex(b"a block");
    let model = ModelRef { name: "block.stl".to_owned(), sha256: sha256.clone() };
    let file = |recipe: &Recipe, bytes: &[u8]| RecipeFile {
        format: RecipeFormat::V1,
        id: "ball".to_owned(),
        version: 1,
        digest: None,
        author: String::new(),
        reason: String::new(),
        recipe: recipe.clone(),
        models: vec![RecipeFileModel::of(&model, bytes)],
    };
    let whole = file(&profile(&sha256.to_uppercase()), b"a block").model_files().unwrap();
    assert_eq!((whole[0].bytes.as_slice(), &whole[0].sha256), (&b"a block"[..], &sha256));
    let refusal = |file: &RecipeFile| file.model_files().unwrap_err().pointer;
    let changed = file(&profile(&sha256), b"another");
    assert_eq!(refusal(&changed).as_deref(), Some("/models/0/content_base64"));
    let mut garbled = file(&profile(&sha256), b"a block");
    garbled.models[0].content_base64.insert(1, '%');
    assert_eq!(refusal(&garbled).as_deref(), Some("/models/0/content_base64"));
    assert_eq!(refusal(&file(&recipe, b"a block")).as_deref(), Some("/models/0"));
}

#[test]
fn a_recipe_is_named_by_id_version_or_number() {
    let id = |id: &str, version| Some(RecipeRef::Id { id: id.to_owned(), version });
    let cases = [
        ("bracket", id("bracket", None)),
        ("bracket@7", id("bracket", Some(7))),
        ("12", Some(RecipeRef::Number(12))),
        ("bracket@", None),
        ("bracket@x", None),
    ];
    for (text, expected) in cases {
        assert_eq!(RecipeRef::parse(text), expected, "{text}");
    }
}
