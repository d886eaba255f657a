//! Recipes: immutable versions, validation, difference, roll-back, archive, files.

use serde_json::{Value, json};

use super::{block_recipe, block_stl};
use crate::common::server::{Answer, Server};
use crate::http::fresh;

fn post_if_match(server: &Server, path: &str, version: &str, body: &Value) -> Answer {
    let tag = format!("\"{version}\"");
    let headers = [("content-type", "application/json"), ("if-match", tag.as_str())];
    server.send("POST", path, &headers, body.to_string().as_bytes())
}

fn create(server: &Server, id: &str, recipe: &Value) -> Answer {
    server.post("/api/v1/recipes", &json!({ "id": id, "reason": "first", "recipe": recipe }))
}

#[test]
fn recipe_versions_are_immutable_and_can_be_compared_and_rolled_back() {
    let (folder, server) = fresh();
    let made = create(&server, "block", &block_recipe(0.05));
    let first = made.expect(201);
    assert_eq!(
        (made.header("etag"), made.header("location")),
        (Some("\"1\""), Some("/api/v1/recipes/block/versions/1"))
    );
    assert_eq!((&first["version"], first["digest"].as_str().unwrap().len()), (&json!(1), 64));
    create(&server, "block", &block_recipe(0.05)).expect(409);

    let publish = "/api/v1/recipes/block/versions";
    let wider = json!({ "reason": "new drawing", "recipe": block_recipe(0.1) });
    server.post(publish, &wider).expect(428);
    post_if_match(&server, publish, "7", &wider).expect(412);
    let second = post_if_match(&server, publish, "1", &wider).expect(201);
    assert_eq!((&second["version"], &second["reason"]), (&json!(2), &json!("new drawing")));
    assert_eq!(server.get(&format!("{publish}/1")).expect(200), first, "the first is what it was");

    let difference = server.get("/api/v1/recipes/block/diff").expect(200);
    let change = |place: &str, old: &str, new: &str| json!({ "place": format!("/plan/characteristics/height/{place}"), "old": old, "new": new });
    let expected = json!([change("lower", "-0.05", "-0.1"), change("upper", "0.05", "0.1")]);
    assert_eq!(
        (&difference["from"], &difference["to"], &difference["changes"]),
        (&json!(1), &json!(2), &expected)
    );

    let back = json!({ "to_version": 1, "reason": "the drawing was wrong" });
    let third = post_if_match(&server, "/api/v1/recipes/block/roll-back", "2", &back).expect(201);
    assert_eq!(
        (&third["version"], &third["restored_from"], &third["digest"]),
        (&json!(3), &json!(1), &first["digest"])
    );
    let nowhere = json!({ "to_version": 9, "reason": "back" });
    let problem = post_if_match(&server, "/api/v1/recipes/block/roll-back", "3", &nowhere).expect(422);
    assert_eq!(problem["pointer"], "/to_version");

    // Unchanged after a restart, page by page.
    drop(server);
    let server = Server::start(&folder.path().join("data"), &[]);
    let page = server.get(&format!("{publish}?limit=2")).expect(200);
    assert_eq!(page["items"], json!([third, second]));
    assert_eq!(server.get(page["next"].as_str().unwrap()).expect(200)["items"], json!([first]));
    assert_eq!(server.get("/api/v1/recipes/block").header("etag"), Some("\"3\""));
    let events = server.get("/api/v1/events").expect(200);
    let published = events["items"].as_array().unwrap().iter().filter(|event| event["kind"] == "recipe.published");
    let versions: Vec<_> = published.map(|event| event["body"]["version"].clone()).collect();
    assert_eq!(versions, [1, 2, 3]);
}

#[test]
fn a_request_with_a_key_publishes_once() {
    let (_folder, server) = fresh();
    create(&server, "block", &block_recipe(0.05)).expect(201);
    let body = json!({ "reason": "wider", "recipe": block_recipe(0.1) }).to_string();
    let headers = [("content-type", "application/json"), ("if-match", "\"1\""), ("idempotency-key", "k1")];
    let send = || server.send("POST", "/api/v1/recipes/block/versions", &headers, body.as_bytes());
    let first = send().expect(201);
    assert_eq!(send().expect(201), first, "the same answer, though version 1 is no longer the newest");
    assert_eq!(server.get("/api/v1/recipes/block").expect(200)["version"], 2);
}

#[test]
fn errors_in_a_recipe_are_reported_with_their_pointer() {
    let (_folder, server) = fresh();
    let mut cases = Vec::new();
    let mut case = |pointer: &'static str, change: &dyn Fn(&mut Value)| {
        let mut recipe = block_recipe(0.05);
        change(&mut recipe);
        cases.push((pointer, recipe));
    };
    case("/recipe/scan/step_mm", &|recipe| recipe["scan"]["step_mm"] = json!(0));
    case("/recipe/scan", &|recipe| recipe["scan"] = json!({ "from_mm": 1 }));
    case("/recipe/number", &|recipe| recipe["number"] = json!(0));
    case("/recipe/serial_pattern", &|recipe| recipe["serial_pattern"] = json!("(("));
    case("/recipe/plan/characteristics/0/measure", &|recipe| {
        recipe["plan"]["characteristics"][0]["measure"]["top"] = json!("lid");
    });
    case("/recipe/plan/characteristics/0/tolerance_mm", &|recipe| {
        recipe["plan"]["characteristics"][0]["tolerance_mm"] = json!(1);
    });
    case("/recipe/plan/characteristics", &|recipe| recipe["plan"]["characteristics"] = json!([]));
    for (pointer, recipe) in cases {
        let problem = create(&server, "block", &recipe).expect(422);
        assert_eq!(problem["pointer"], pointer, "{problem}");
        assert!(problem["remedy"].is_string(), "{problem}");
    }
    assert_eq!(create(&server, "Block 1", &block_recipe(0.05)).expect(422)["pointer"], "/id");
    server.get("/api/v1/recipes/block").expect(404);
}

#[test]
fn an_archived_recipe_frees_its_number_and_a_file_moves_a_recipe_to_another_station() {
    let (_folder, server) = fresh();
    let mut numbered = block_recipe(0.05);
    numbered["number"] = json!(12);
    create(&server, "block", &numbered).expect(201);
    let taken = create(&server, "plate", &numbered).expect(409);
    assert!(taken["detail"].as_str().unwrap().contains("recipe block has it"), "{taken}");
    assert_eq!(server.post("/api/v1/recipes/block/archive", &json!(null)).expect(200)["archived"], true);
    create(&server, "plate", &numbered).expect(201);
    server.post("/api/v1/recipes/block/restore", &json!(null)).expect(409);
    let ids = |query: &str| -> Vec<String> {
        let list = server.get(&format!("/api/v1/recipes{query}")).expect(200);
        list["items"].as_array().unwrap().iter().map(|item| item["id"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(ids(""), ["plate", "block"]);
    assert_eq!(
        (ids("?archived=false"), ids("?archived=true"), ids("?number=12&archived=false").len()),
        (vec!["plate".to_owned()], vec!["block".to_owned()], 1)
    );

    let file = server.get("/api/v1/recipes/plate/versions/1/file");
    assert!(file.header("content-disposition").unwrap().contains("plate-1.recipe.json"), "{file:?}");
    let file = file.expect(200);
    let (_other_folder, other) = fresh();
    let imported = other.post("/api/v1/recipes/import", &file).expect(201);
    assert_eq!((&imported["digest"], &imported["recipe"]), (&file["digest"], &file["recipe"]));
    // The same content is not a new version; changed content needs `If-Match`.
    other.post("/api/v1/recipes/import", &file).expect(428);
    assert_eq!(post_if_match(&other, "/api/v1/recipes/import", "1", &file).expect(201)["version"], 1);
    let mut changed = file.clone();
    changed["recipe"]["plan"]["characteristics"][0]["upper"] = json!(0.2);
    assert_eq!(post_if_match(&other, "/api/v1/recipes/import", "1", &changed).expect(422)["pointer"], "/digest");
    changed.as_object_mut().unwrap().remove("digest");
    assert_eq!(post_if_match(&other, "/api/v1/recipes/import", "1", &changed).expect(201)["version"], 2);
}

#[test]
fn a_file_contains_the_models_of_its_recipe() {
    let (_folder, server) = fresh();
    let stl = block_stl([[-8.0, 8.0], [0.0, 20.0], [0.0, 8.9]]);
    let binary = [("content-type", "application/octet-stream")];
    let model = server.send("POST", "/api/v1/models?name=block.stl", &binary, &stl).expect(201);
    let mut recipe = block_recipe(0.05);
    recipe["plan"]["characteristics"][0] = json!({ "id": "shell", "upper": 0.1, "measure": {
        "type": "surface_profile", "model": { "name": "block.stl", "sha256": model["sha256"] }, "best_fit": true } });
    create(&server, "shell", &recipe).expect(201);
    let mut renamed = recipe.clone();
    renamed["plan"]["characteristics"][0]["measure"]["model"]["name"] = json!("block.glb");
    let refused = create(&server, "glb", &renamed).expect(422);
    assert_eq!(refused["pointer"], "/recipe/plan/characteristics/0/measure/model", "{refused:#}");
    let file = server.get("/api/v1/recipes/shell/versions/1/file").expect(200);
    assert_eq!(file["models"].as_array().unwrap().len(), 1, "{file:#}");

    let (_other_folder, other) = fresh();
    let mut without = file.clone();
    without["models"] = json!([]);
    let refused = other.post("/api/v1/recipes/import", &without).expect(422);
    assert_eq!(refused["pointer"], "/recipe/plan/characteristics/0/measure/model", "{refused:#}");
    let mut no_mesh = file.clone();
    no_mesh["models"][0]["name"] = json!("block.step");
    assert_eq!(other.post("/api/v1/recipes/import", &no_mesh).expect(422)["pointer"], "/models/0");
    assert_eq!(other.get("/api/v1/models").expect(200)["items"], json!([]));

    other.post("/api/v1/recipes/import", &file).expect(201);
    let models = other.get("/api/v1/models").expect(200)["items"].clone();
    assert_eq!((&models[0]["name"], &models[0]["sha256"]), (&json!("block.stl"), &model["sha256"]));
    assert_eq!(other.get(models[0]["file"].as_str().unwrap()).body, stl);
    let exported_again = other.get("/api/v1/recipes/shell/versions/1/file").expect(200);
    assert_eq!((&exported_again["recipe"], &exported_again["models"]), (&file["recipe"], &file["models"]));
    // A model that is stored is not listed twice.
    let mut renamed = file;
    renamed["id"] = json!("shell-2");
    other.post("/api/v1/recipes/import", &renamed).expect(201);
    assert_eq!(other.get("/api/v1/models").expect(200)["items"].as_array().unwrap().len(), 1);
}
