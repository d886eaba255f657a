//! A production of fifty parts, triggered by the PLC, whose size drifts; an MES hears of it by all doors.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use serde_json::Value;

use super::plant::{Part, Plant};
use super::{DEFECT_MM, HEIGHT_MM};
use crate::http::inspections::{ball_recipe, block_recipe};

/// Parts of the production.
const N_PARTS: usize = 50;

/// Every so many parts is a ball, the others are blocks: a control chart needs 25 of one kind.
const BALL_EVERY: usize = 5;

/// Every so many parts is defective: all of them are blocks.
const DEFECT_EVERY: usize = 17;

/// Nominal diameter of the ball, mm.
const DIAMETER_MM: f64 = 37.8;

/// Tolerance of the ball, mm: U from a cap is several times that of a step.
const BALL_TOLERANCE_MM: f64 = 0.08;

/// How far the size drifts over the production, mm: well within the limits.
const DRIFT_MM: f64 = 0.02;

/// Number of the recipe of blocks, and of balls.
const NUMBERS: [u32; 2] = [12, 13];

fn part(idx: usize) -> Part {
    let drift_mm = DRIFT_MM * (idx as f64 / (N_PARTS - 1) as f64 - 0.5);
    let error_mm = if is_defective(idx) { -DEFECT_MM } else { drift_mm };
    let serial = format!("P-{idx:02}");
    match idx % BALL_EVERY {
        0 => Part::ball(&serial, DIAMETER_MM + error_mm),
        _ => Part::block(&serial, HEIGHT_MM + error_mm),
    }
}

fn is_defective(idx: usize) -> bool {
    idx % DEFECT_EVERY == DEFECT_EVERY - 1
}

#[test]
#[ignore = "a campaign of some minutes"]
fn campaign_of_fifty_drifting_parts_at_all_doors() {
    let Some(mut plant) = Plant::start() else { return };
    let recipes = [block_recipe(DEFECT_MM / 2.0), ball_recipe(DIAMETER_MM, BALL_TOLERANCE_MM)];
    for ((id, number), recipe) in ["block", "ball"].into_iter().zip(NUMBERS).zip(recipes) {
        plant.teach(id, number, recipe);
    }
    let begun = Instant::now();
    let mut tally: BTreeMap<(&str, String), usize> = BTreeMap::new();
    let mut worst: BTreeMap<&str, (f64, f64, usize)> = BTreeMap::new();
    for idx in 0..N_PARTS {
        let part = part(idx);
        let stored = plant.triggered(NUMBERS[usize::from(part.recipe == "ball")], &part);
        let verdict = stored["verdict"].as_str().unwrap().to_owned();
        match is_defective(idx) {
            true => assert_eq!(verdict, "not_ok", "a defect of {DEFECT_MM} mm: {stored:#}"),
            false => assert!(verdict == "ok" || verdict == "undecided", "{stored:#}"),
        }
        let number = |name: &str| stored["results"][0][name].as_f64().unwrap();
        let (error_mm, u_mm) = ((number("value") - part.size_mm).abs(), number("expanded_uncertainty"));
        let worst = worst.entry(part.recipe).or_default();
        *worst = (worst.0.max(error_mm), worst.1.max(u_mm), worst.2 + usize::from(error_mm <= u_mm));
        *tally.entry((part.recipe, verdict)).or_default() += 1;
    }
    println!("{N_PARTS} parts in {:.0} s: {tally:?}", begun.elapsed().as_secs_f64());
    for (recipe, (error_mm, u_mm, n_within)) in worst {
        println!("{recipe}: error up to {error_mm:.4} mm, U up to {u_mm:.4} mm, {n_within} parts within U");
    }
    plant.receivers.trust_opcua_client();
    plant.outage(&[N_PARTS, N_PARTS + 1, N_PARTS + 2].map(|idx| Part::block(&format!("P-{idx}"), HEIGHT_MM)));
    let all = plant.same_everywhere();
    assert_eq!(all.len(), N_PARTS + 3);

    // Each pattern of the drift is announced to the MES once.
    let events = plant.events();
    let ids = |all: &[Value], kind: &str, of: &str| -> BTreeSet<i64> {
        all.iter().filter(|event| event[of] == kind).map(|event| event["seq"].as_i64().unwrap()).collect()
    };
    let announced = ids(&events, "control_chart.rule_violated", "kind");
    assert!(!announced.is_empty());
    assert_eq!(ids(&plant.receivers.web_messages(), "control_chart.rule_violated", "type"), announced);
    println!("{} results at each of 5 doors, {} violated run rules announced", all.len(), announced.len());
}
