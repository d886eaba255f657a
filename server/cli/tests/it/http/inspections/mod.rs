//! Recipes, and parts inspected by them on the simulated station.

mod parts;
mod recipes;

use serde_json::{Value, json};

/// A recipe for a block on the table: its height, within ±`tolerance_mm`.
pub fn block_recipe(tolerance_mm: f64) -> Value {
    json!({
        "name": "block",
        "scan": { "from_mm": -12.0, "to_mm": 12.0, "step_mm": 0.4 },
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
