//! Gap, flush and groove across a seam of two plates with rolled edges; forms of a wavy plate and a roof.

use optics::{PartFrame, Rigid};
use serde_json::{Value, json};

use super::plan::{FEW, MANY, boxed, boxed_in_part, check, errors_of};
use super::shaped_scan::{ShapedScan, Surface};
use crate::evaluation::alignment::DatumFrame;
use crate::*;

/// Radius of the rolled edges, mm.
const ROLLED_MM: f64 = 4.0;

/// A plate at z = 8 up to y = −2, another 0.3 mm lower from y = 2, both with rolled edges; a groove 12 mm further on.
pub(super) struct Seam;

const LOW_MM: f64 = 7.7;
const DEEP_MM: f64 = 5.0;

fn rolled(from_rim: f64, top: f64) -> f64 {
    // Distance inside the outermost point of the edge.
    if from_rim >= ROLLED_MM {
        top
    } else {
        top - ROLLED_MM + (ROLLED_MM.powi(2) - (ROLLED_MM - from_rim).powi(2)).sqrt()
    }
}

impl Surface for Seam {
    fn top(&self, x: f64, y: f64, _grown_mm: f64) -> (f64, f64) {
        let height = if (-24.0..=-2.0).contains(&y) {
            rolled(-2.0 - y, 8.0)
        } else if (2.0..=26.0).contains(&y) {
            if (12.0..=18.0).contains(&y) { DEEP_MM } else { rolled(y - 2.0, LOW_MM) }
        } else {
            0.0
        };
        (if x.abs() < 26.0 { height } else { 0.0 }, f64::INFINITY)
    }
}

fn plan(pose: &Rigid<PartFrame, DatumFrame>, characteristics: &[(Value, f64)]) -> Plan {
    let characteristics: Vec<Value> = characteristics
        .iter()
        .enumerate()
        .map(|(idx, (measure, _))| json!({ "id": idx.to_string(), "measure": measure }))
        .collect();
    let plane = |select: Value| json!({ "type": "plane", "select": select });
    let rolled = |select: Value| json!({ "type": "cylinder", "radius_mm": 4.0, "select": select });
    // The datum frame: z = 0 on the first plate, y = 0 on the axis of its edge, which is at y = −6 of the part.
    let plan = json!({
        "format": "sheaf-plan/1",
        "features": [
            { "id": "plate", "shape": plane(boxed_in_part(pose, [0.0, -15.0, 8.0], [20.0, 8.0, 1.0])) },
            { "id": "edge", "shape": rolled(boxed_in_part(pose, [0.0, -3.9, 6.6], [20.0, 1.9, 1.6])) },
            { "id": "corner", "shape": { "type": "line", "of": { "axis": "edge" } } },
            { "id": "mid", "shape": { "type": "point", "of": { "centre": "plate" } } },
            { "id": "low plate", "shape": plane(boxed([-40.0, 14.0, -0.8], [40.0, 17.0, 0.2])) },
            { "id": "far plate", "shape": plane(boxed([-40.0, 25.0, -0.8], [40.0, 30.5, 0.2])) },
            { "id": "low edge", "shape": rolled(boxed([-20.0, 8.1, -3.4], [20.0, 11.6, -0.4])) },
            { "id": "floor", "shape": plane(boxed([-40.0, 18.5, -3.5], [40.0, 23.5, -2.5])) },
            { "id": "cut", "shape": { "type": "section", "select": boxed([-15.0, -8.0, -1.0], [15.0, -1.0, 1.0]),
                "origin_mm": [0.0, 0.0, 0.0], "x": [0.0, 1.0, 0.0], "y": [0.0, 0.0, 1.0],
                "contour_mm": [[-20.0, 0.0], [10.0, 0.0]] } },
        ],
        "alignment": { "primary": "plate", "secondary": "corner", "tertiary": "mid" },
        "characteristics": characteristics,
    });
    Plan::from_json(&plan.to_string()).unwrap()
}

#[test]
fn gap_flush_groove_and_section_lie_inside_their_uncertainty() {
    check_seam(FEW);
}

#[test]
#[ignore = "half a minute: cargo xtask campaign"]
fn campaign_of_gap_flush_groove_and_section() {
    check_seam(MANY);
}

fn check_seam(seeds: u64) {
    let characteristics = [
        (json!({ "type": "gap", "from": "edge", "to": "low edge", "surface": "plate" }), 4.0),
        (json!({ "type": "flush", "reference": "plate", "surface": "low plate", "at": "low edge" }), LOW_MM - 8.0),
        (json!({ "type": "radius", "of": "edge" }), ROLLED_MM),
        (
            json!({ "type": "groove_depth", "floor": "floor", "shoulders": ["low plate", "far plate"] }),
            LOW_MM - DEEP_MM,
        ),
        (json!({ "type": "parallelism", "of": "floor", "to": "plate" }), 0.0),
        (json!({ "type": "profile", "of": "cut" }), 0.0),
    ];
    let plan = |pose: &Rigid<PartFrame, DatumFrame>| plan(pose, &characteristics);
    let errors = errors_of(&Seam, &characteristics, plan, &ShapedScan::FINE, seeds);
    check(&characteristics, &errors);
}

/// Half of the waves' height, mm, and their length.
const WAVE_MM: f64 = 0.1;
const WAVELENGTH_MM: f64 = 8.0;

/// A wavy plate, a roof of two faces at right angles, one of them wavy; a table around them.
struct Wavy;

impl Surface for Wavy {
    fn top(&self, x: f64, y: f64, _grown_mm: f64) -> (f64, f64) {
        let wave = WAVE_MM * (std::f64::consts::TAU * x / WAVELENGTH_MM).cos();
        let height = if x.abs() > 20.0 {
            0.0
        } else if (-24.0..=-4.0).contains(&y) {
            8.0 + wave
        } else if (2.0..=13.0).contains(&y) {
            y - 2.0
        } else if (13.0..=24.0).contains(&y) {
            // As high along the normal as the plate's waves.
            24.0 - y + wave * 2f64.sqrt()
        } else {
            0.0
        };
        (height, f64::INFINITY)
    }
}

#[test]
fn forms_of_wavy_faces_lie_inside_their_uncertainty() {
    check_wavy(FEW);
}

#[test]
#[ignore = "half a minute: cargo xtask campaign"]
fn campaign_of_forms_of_wavy_faces() {
    check_wavy(MANY);
}

fn check_wavy(seeds: u64) {
    let characteristics = [
        (json!({ "type": "flatness", "of": "plate" }), 2.0 * WAVE_MM),
        (json!({ "type": "parallelism", "of": "plate", "to": "table" }), 2.0 * WAVE_MM),
        (json!({ "type": "perpendicularity", "of": "second face", "to": "first face" }), 2.0 * WAVE_MM),
        (json!({ "type": "profile", "of": "cut" }), 2.0 * WAVE_MM),
        (json!({ "type": "angle", "from": "first face", "to": "second face" }), 90.0),
    ];
    let plan = |pose: &Rigid<PartFrame, DatumFrame>| {
        let measures: Vec<Value> = characteristics
            .iter()
            .enumerate()
            .map(|(idx, (measure, _))| json!({ "id": idx.to_string(), "measure": measure }))
            .collect();
        let plane = |select: Value| json!({ "type": "plane", "select": select });
        let plan = json!({
            "format": "sheaf-plan/1",
            "features": [
                { "id": "table", "shape": plane(boxed_in_part(pose, [0.0, -1.0, 0.0], [16.0, 1.5, 0.6])) },
                { "id": "first face", "shape": plane(boxed_in_part(pose, [0.0, 7.0, 5.0], [16.0, 4.0, 4.5])) },
                { "id": "plate", "shape": plane(boxed([-16.0, 7.0, 7.0], [16.0, 25.0, 9.0])) },
                { "id": "mid", "shape": { "type": "point", "of": { "centre": "first face" } } },
                // The datum frame is rotated by half a turn: y is the direction of the first face, 0 where it meets the
                // table.
                { "id": "second face", "shape": plane(boxed([-16.0, -20.5, 1.0], [16.0, -12.0, 9.5])) },
                { "id": "cut", "shape": { "type": "section", "select": boxed([-16.0, 7.0, 7.0], [16.0, 25.0, 9.0]),
                    "origin_mm": [0.0, 0.0, 8.0], "x": [1.0, 0.0, 0.0], "y": [0.0, 0.0, 1.0],
                    "contour_mm": [[-30.0, 0.0], [30.0, 0.0]] } },
            ],
            "alignment": { "primary": "table", "secondary": "first face", "tertiary": "mid" },
            "characteristics": measures,
        });
        Plan::from_json(&plan.to_string()).unwrap()
    };
    let errors = errors_of(&Wavy, &characteristics, plan, &ShapedScan::FINE, seeds);
    check(&characteristics, &errors);
}
