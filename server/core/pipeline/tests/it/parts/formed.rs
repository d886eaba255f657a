//! A seam of two plates with rolled edges, a groove, a roof, a wavy plate, and a ball to align them by.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde_json::{Value, json};

use super::part::{Part, Pose, boxed, boxed_in_part};
use super::solid::{Along, Triangles, add_ball, add_extruded, arc};

/// Radius of the rolled edges, mm.
const ROLLED_MM: f64 = 4.0;
const PLATE_MM: f64 = 8.0;
const LOW_MM: f64 = 7.7;
const FLOOR_MM: f64 = 5.0;
const GAP_MM: f64 = 4.0;
/// Side of the first plate, y = 0 of the datum frame, and the outermost line of its rolled edge.
const SIDE_Y_MM: f64 = 0.0;
const EDGE_Y_MM: f64 = 22.0;
/// Half of the waves' height, and their length, mm.
const WAVE_MM: f64 = 0.1;
const WAVELENGTH_MM: f64 = 8.0;
const BALL: ([f64; 3], f64) = ([0.0, -14.0, 6.0], 6.0);

pub fn part() -> Part {
    Part { triangles: triangles(), plan, characteristics: characteristics() }
}

fn triangles() -> Triangles {
    let mut triangles = Triangles::new();
    let mut plate = vec![[SIDE_Y_MM, PLATE_MM]];
    plate.extend(arc([EDGE_Y_MM - ROLLED_MM, PLATE_MM - ROLLED_MM], ROLLED_MM, [FRAC_PI_2, 0.0]));
    add_extruded(&mut triangles, Along::X, &plate, [-30.0, -2.0]);
    let low_y = EDGE_Y_MM + GAP_MM;
    let mut low_plate = arc([low_y + ROLLED_MM, LOW_MM - ROLLED_MM], ROLLED_MM, [PI, FRAC_PI_2]);
    low_plate.extend([[36.0, LOW_MM], [36.0, FLOOR_MM], [42.0, FLOOR_MM], [42.0, LOW_MM], [50.0, LOW_MM]]);
    add_extruded(&mut triangles, Along::X, &low_plate, [-30.0, -2.0]);
    add_extruded(&mut triangles, Along::X, &[[4.0, 0.0], [15.0, 11.0], [26.0, 0.0]], [4.0, 30.0]);
    let wave = |k: i32| {
        let x = 4.0 + f64::from(k) * 0.2;
        [x, PLATE_MM + WAVE_MM * (TAU * x / WAVELENGTH_MM).cos()]
    };
    let waves: Vec<[f64; 2]> = (0..=130).map(wave).collect();
    add_extruded(&mut triangles, Along::Y, &waves, [30.0, 50.0]);
    add_ball(&mut triangles, BALL.0, BALL.1);
    triangles
}

/// Aligned by the table (z = 0), the side of the first plate (y = 0) and the ball (x = 0).
fn plan(pose: &Pose) -> Value {
    let plane = |select: Value| json!({ "type": "plane", "select": select });
    let rolled = |select: Value| json!({ "type": "cylinder", "radius_mm": ROLLED_MM, "select": select });
    let wavy = boxed([7.0, 32.0, 7.0], [27.0, 48.0, 9.0]);
    json!({
        "format": "sheaf-plan/1",
        "features": [
            { "id": "table", "shape": plane(boxed_in_part(pose, [0.0; 3], [60.0, 60.0, 1.5])) },
            { "id": "plate", "shape": plane(boxed_in_part(pose, [-16.0, 9.0, PLATE_MM], [12.0, 8.0, 1.0])) },
            { "id": "side", "shape": { "type": "edge", "plane": "plate",
                "select": boxed_in_part(pose, [-16.0, 0.0, PLATE_MM], [12.0, 3.0, 2.0]) } },
            { "id": "ball", "shape": { "type": "sphere",
                "select": boxed_in_part(pose, [0.0, -14.0, 9.5], [6.5, 6.5, 6.0]) } },
            { "id": "edge", "shape": rolled(boxed([-28.0, 18.2, 5.0], [-4.0, 21.9, 8.2])) },
            { "id": "low edge", "shape": rolled(boxed([-28.0, 26.1, 4.7], [-4.0, 29.8, 7.9])) },
            { "id": "low plate", "shape": plane(boxed([-29.0, 30.5, 7.2], [-3.0, 35.0, 8.2])) },
            { "id": "far plate", "shape": plane(boxed([-29.0, 43.0, 7.2], [-3.0, 49.5, 8.2])) },
            { "id": "floor", "shape": plane(boxed([-29.0, 36.5, 4.5], [-3.0, 41.5, 5.5])) },
            { "id": "first face", "shape": plane(boxed([6.0, 6.0, 2.0], [28.0, 14.0, 10.0])) },
            { "id": "second face", "shape": plane(boxed([6.0, 16.0, 2.0], [28.0, 24.0, 10.0])) },
            { "id": "waves", "shape": plane(wavy.clone()) },
            { "id": "cut", "shape": { "type": "section", "select": wavy,
                "origin_mm": [0.0, 0.0, PLATE_MM], "x": [1.0, 0.0, 0.0], "y": [0.0, 0.0, 1.0],
                "contour_mm": [[0.0, 0.0], [40.0, 0.0]] } },
        ],
        "alignment": { "primary": "table", "secondary": "side", "tertiary": "ball" },
    })
}

/// Characteristics with their true values.
fn characteristics() -> Vec<(Value, f64)> {
    vec![
        (json!({ "type": "gap", "from": "edge", "to": "low edge", "surface": "plate" }), GAP_MM),
        (
            json!({ "type": "flush", "reference": "plate", "surface": "low plate", "at": "low edge" }),
            LOW_MM - PLATE_MM,
        ),
        (json!({ "type": "radius", "of": "edge" }), ROLLED_MM),
        (
            json!({ "type": "groove_depth", "floor": "floor", "shoulders": ["low plate", "far plate"] }),
            LOW_MM - FLOOR_MM,
        ),
        (json!({ "type": "parallelism", "of": "floor", "to": "plate" }), 0.0),
        (json!({ "type": "angle", "from": "first face", "to": "second face" }), 90.0),
        (json!({ "type": "perpendicularity", "of": "second face", "to": "first face" }), 0.0),
        (json!({ "type": "flatness", "of": "waves" }), 2.0 * WAVE_MM),
        (json!({ "type": "parallelism", "of": "waves", "to": "table" }), 2.0 * WAVE_MM),
        (json!({ "type": "profile", "of": "cut" }), 2.0 * WAVE_MM),
    ]
}
