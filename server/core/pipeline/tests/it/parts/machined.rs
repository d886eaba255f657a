//! Two blocks, one with a hole, one with a slot; a ball and a rod beside them.

use std::f64::consts::PI;

use nalgebra::Vector3;
use serde_json::{Value, json};

use super::part::{Part, Pose, boxed, boxed_in_part};
use super::solid::{Along, Triangles, add_ball, add_block_with_opening, add_extruded, arc};

const TOP_MM: f64 = 9.0;
const LOW_TOP_MM: f64 = 6.5;
const HOLE: ([f64; 2], f64) = ([-14.0, 13.0], 4.5);
/// Centre, half distance of the ends' centres along x, radius.
const SLOT: ([f64; 2], f64, f64) = ([16.0, 16.0], 5.0, 2.5);
const BALL: ([f64; 3], f64) = ([0.0, -13.0, 7.0], 7.0);
/// Middle of the axis along x, radius, half length.
const ROD: ([f64; 3], f64, f64) = ([18.0, -13.0, 5.0], 5.0, 9.0);

pub fn part() -> Part {
    Part { triangles: triangles(), plan, characteristics: characteristics() }
}

fn triangles() -> Triangles {
    let mut triangles = Triangles::new();
    add_block_with_opening(&mut triangles, [[-27.0, -1.0], [0.0, 26.0]], TOP_MM, HOLE.0, |_| HOLE.1);
    let (_, half, radius) = SLOT;
    let slot = |angle: f64| {
        let (sin, cos) = (angle.sin().abs(), angle.cos().abs());
        // The straight side, or the end's half circle: |t·(cos, sin) − (half, 0)| = radius.
        let side = radius / sin;
        if side * cos <= half {
            side
        } else {
            half * cos + (radius * radius - half * half * sin * sin).max(0.0).sqrt()
        }
    };
    add_block_with_opening(&mut triangles, [[5.0, 28.0], [5.0, 27.0]], LOW_TOP_MM, SLOT.0, slot);
    add_ball(&mut triangles, BALL.0, BALL.1);
    let ([x, y, z], radius, half) = ROD;
    add_extruded(&mut triangles, Along::X, &arc([y, z], radius, [PI, 0.0]), [x - half, x + half]);
    triangles
}

/// Aligned by the table (z = 0), the side of the first block (y = 0) and the ball (x = 0).
fn plan(pose: &Pose) -> Value {
    let plane = |select: Value| json!({ "type": "plane", "select": select });
    json!({
        "format": "sheaf-plan/1",
        "features": [
            { "id": "table", "shape": plane(boxed_in_part(pose, [0.0; 3], [60.0, 60.0, 2.5])) },
            { "id": "top", "shape": plane(boxed_in_part(pose, [-14.0, 13.0, TOP_MM], [15.0, 15.0, 1.5])) },
            { "id": "side", "shape": { "type": "edge", "plane": "top",
                "select": boxed_in_part(pose, [-14.0, 0.0, TOP_MM], [11.0, 3.0, 2.0]) } },
            { "id": "ball", "shape": { "type": "sphere",
                "select": boxed_in_part(pose, [0.0, -13.0, 10.5], [7.5, 7.5, 7.0]) } },
            { "id": "hole", "shape": { "type": "circle", "plane": "top",
                "select": boxed([-21.0, 6.0, 8.0], [-7.0, 20.0, 10.0]) } },
            { "id": "hole axis", "shape": { "type": "line", "of": { "axis": "hole" } } },
            { "id": "low top", "shape": plane(boxed([4.0, 4.0, 6.0], [29.0, 28.0, 7.0])) },
            { "id": "slot", "shape": { "type": "slot", "plane": "low top",
                "select": boxed([6.5, 11.0, 5.5], [25.5, 21.0, 7.5]) } },
            { "id": "left", "shape": { "type": "edge", "plane": "low top",
                "select": boxed([7.0, 3.0, 5.5], [26.0, 8.0, 7.5]) } },
            { "id": "rod", "shape": { "type": "cylinder", "radius_mm": ROD.1,
                "select": boxed([9.5, -19.0, 4.0], [26.5, -7.0, 11.0]) } },
            { "id": "through", "shape": { "type": "point", "of": { "line_and_plane": ["hole axis", "table"] } } },
        ],
        "alignment": { "primary": "table", "secondary": "side", "tertiary": "ball" },
    })
}

/// Characteristics with their true values.
fn characteristics() -> Vec<(Value, f64)> {
    let [hole_x, hole_y] = HOLE.0;
    let [slot_x, slot_y] = SLOT.0;
    let ball_to_hole = (Vector3::new(hole_x, hole_y, TOP_MM) - Vector3::from(BALL.0)).norm();
    vec![
        (json!({ "type": "step", "base": "table", "top": "top" }), TOP_MM),
        (json!({ "type": "distance", "from": "top", "to": "low top" }), TOP_MM - LOW_TOP_MM),
        (json!({ "type": "distance", "from": "ball", "to": "hole" }), ball_to_hole),
        (json!({ "type": "distance", "from": "table", "to": "ball" }), BALL.0[2]),
        (json!({ "type": "distance", "from": "side", "to": "left", "along": "y" }), 5.0),
        (json!({ "type": "angle", "from": "top", "to": "low top" }), 0.0),
        (json!({ "type": "angle", "from": "table", "to": "top", "about": "x" }), 0.0),
        (json!({ "type": "angle", "from": "rod", "to": "table" }), 90.0),
        (json!({ "type": "diameter", "of": "hole" }), 2.0 * HOLE.1),
        (json!({ "type": "radius", "of": "ball" }), BALL.1),
        (json!({ "type": "diameter", "of": "rod" }), 2.0 * ROD.1),
        (json!({ "type": "width", "of": "slot" }), 2.0 * SLOT.2),
        (json!({ "type": "length", "of": "slot" }), 2.0 * (SLOT.1 + SLOT.2)),
        (json!({ "type": "coordinate", "of": "hole", "axis": "x" }), hole_x),
        (json!({ "type": "coordinate", "of": "hole", "axis": "y" }), hole_y),
        (json!({ "type": "coordinate", "of": "through", "axis": "y" }), hole_y),
        (json!({ "type": "position", "of": "hole", "at_mm": [hole_x, hole_y, null] }), 0.0),
        (json!({ "type": "position", "of": "slot", "at_mm": [slot_x - 0.3, slot_y + 0.4, null] }), 1.0),
        (json!({ "type": "flatness", "of": "top" }), 0.0),
        (json!({ "type": "parallelism", "of": "top", "to": "table" }), 0.0),
        (json!({ "type": "flush", "reference": "top", "surface": "low top", "at": "left" }), LOW_TOP_MM - TOP_MM),
    ]
}
