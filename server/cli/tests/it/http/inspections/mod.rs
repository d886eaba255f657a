//! Recipes, and parts inspected by them on the simulated station.

mod evaluation;
mod models;
mod overhead;
mod parts;
mod recipes;
mod studies;

use serde_json::{Value, json};

use crate::common::server::{Answer, Server};

/// Distance between the rows of a scan, mm: few rows, with which U of the block's height is still below a third of its
/// tolerance.
const STEP_MM: f64 = 0.8;

/// A recipe for a block on the table: its height, within ±`tolerance_mm`.
pub fn block_recipe(tolerance_mm: f64) -> Value {
    json!({
        "name": "block",
        "scan": { "from_mm": -12.0, "to_mm": 12.0, "step_mm": STEP_MM },
        "plan": {
            "format": "sheaf-plan/1",
            "features": [
                { "id": "table", "shape": { "type": "plane" } },
                { "id": "top", "shape": { "type": "plane", "select": { "region": {
                    "type": "box", "min_mm": [-8.0, -6.0, 380.0], "max_mm": [8.0, 6.0, 396.0] } } } },
            ],
            "characteristics": [{ "id": "height", "measure": { "type": "step", "base": "table", "top": "top" },
                "nominal_mm": 8.9, "lower": -tolerance_mm, "upper": tolerance_mm,
                "attributes": { "K2001": "1", "line": 4 } }],
        },
    })
}

/// A recipe for a ball on the table whose upper third is measured: its diameter, within ±`tolerance_mm` of `nominal_mm`.
pub fn ball_recipe(nominal_mm: f64, tolerance_mm: f64) -> Value {
    json!({
        "name": "ball",
        "scan": { "from_mm": -12.0, "to_mm": 12.0, "step_mm": STEP_MM },
        "plan": {
            "format": "sheaf-plan/1",
            "features": [{ "id": "ball", "shape": { "type": "sphere", "select": { "region": {
                "type": "box", "min_mm": [-14.0, -14.0, 355.0], "max_mm": [14.0, 14.0, 390.0] } } } }],
            "characteristics": [{ "id": "diameter", "measure": { "type": "diameter", "of": "ball" },
                "nominal_mm": nominal_mm, "lower": -tolerance_mm, "upper": tolerance_mm }],
        },
    })
}

/// Puts a ball of this diameter on the stage. Its facets lie up to 1 µm inside the sphere.
pub fn place_ball(server: &Server, diameter_mm: f64) {
    const COLUMNS: usize = 240;
    const ROWS: usize = COLUMNS / 2;
    let radius_mm = diameter_mm / 2.0;
    let corner = |column: usize, row: usize| {
        let [along, down] = [column, row].map(|idx| idx as f64 * std::f64::consts::TAU / COLUMNS as f64);
        [
            radius_mm * down.sin() * along.cos(),
            radius_mm * down.sin() * along.sin(),
            radius_mm * (1.0 + down.cos()),
        ]
    };
    let mut bytes = vec![0; 80];
    bytes.extend((2 * COLUMNS as u32 * (ROWS as u32 - 1)).to_le_bytes());
    for (column, row) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (column, row))) {
        let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(x, y)| corner(column + x, row + y));
        let facets = [(row + 1 < ROWS).then_some([a, b, c]), (row > 0).then_some([a, c, d])];
        for corners in facets.into_iter().flatten() {
            bytes.extend([0; 12]);
            bytes.extend(corners.as_flattened().iter().flat_map(|mm| (*mm as f32).to_le_bytes()));
            bytes.extend([0; 2]);
        }
    }
    let headers = [("content-type", "model/stl")];
    server.send("PUT", "/api/v1/simulation/scene/part", &headers, &bytes).expect(200);
}

/// Puts a block of this height on the stage.
pub fn place_block(server: &Server, height_mm: f64) {
    let headers = [("content-type", "model/stl")];
    server
        .send(
            "PUT",
            "/api/v1/simulation/scene/part",
            &headers,
            &block_stl([[-10.0, 10.0], [-8.0, 8.0], [0.0, height_mm]]),
        )
        .expect(200);
}

/// A block as an STL file: its extent along x, y and z, mm.
pub fn block_stl(extent_mm: [[f64; 2]; 3]) -> Vec<u8> {
    let corner = |idx: usize| [0, 1, 2].map(|axis| extent_mm[axis][idx >> axis & 1]);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = "solid block\n".to_owned();
    for [a, b, c, d] in faces {
        for triangle in [[a, b, c], [a, c, d]] {
            let vertices: String =
                triangle.map(corner).iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
            text += &format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n");
        }
    }
    text += "endsolid block\n";
    text.into_bytes()
}

pub fn inspect(server: &Server, query: &str, key: Option<&str>, body: &Value) -> Answer {
    let mut headers = vec![("content-type", "application/json")];
    headers.extend(key.map(|key| ("idempotency-key", key)));
    server.send("POST", &format!("/api/v1/inspections{query}"), &headers, body.to_string().as_bytes())
}

/// Inspects a part and waits for the end; returns the inspection.
pub fn inspected(server: &Server, body: &Value) -> Value {
    let accepted = inspect(server, "", None, body);
    accepted.expect(202);
    let job = server.wait_for_job(accepted.header("location").unwrap());
    assert_eq!((&job["state"], &job["result"]["kind"]), (&json!("succeeded"), &json!("inspection")), "{job:#}");
    server.get(job["result"]["href"].as_str().unwrap()).expect(200)
}
