//! How long an inspection of a million points takes beside its scan.

use serde_json::{Value, json};

use super::parts::print_overhead;
use super::{block_recipe, inspected, place_block};
use crate::http::fresh;

/// Characteristics of the plan.
const N_CHARACTERISTICS: usize = 10;

#[test]
#[ignore = "a campaign of some minutes"]
fn campaign_of_an_inspection_of_a_million_points() {
    let (_folder, server) = fresh();
    let calibration = json!({ "source": { "kind": "station" }, "n_poses": 8 });
    let calibration_id = server.result_of("/api/v1/calibrations", &calibration);
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration_id })).expect(200);
    let mut recipe = block_recipe(0.03);
    recipe["scan"]["step_mm"] = json!(0.12);
    let height = recipe["plan"]["characteristics"][0].clone();
    let heights: Vec<Value> = (0..N_CHARACTERISTICS)
        .map(|idx| {
            let mut one = height.clone();
            one["id"] = json!(format!("height {idx}"));
            one
        })
        .collect();
    recipe["plan"]["characteristics"] = json!(heights);
    server.post("/api/v1/recipes", &json!({ "id": "block", "reason": "first", "recipe": recipe })).expect(201);
    place_block(&server, 8.9);
    // The first one teaches the station its pace, and fills caches.
    for serial in ["BL-1", "BL-2", "BL-3"] {
        let inspection = inspected(&server, &json!({ "recipe": "block", "serial": serial }));
        assert_eq!(
            (&inspection["verdict"], inspection["results"].as_array().unwrap().len()),
            (&json!("ok"), N_CHARACTERISTICS)
        );
        print_overhead(&server, &inspection);
    }
}
