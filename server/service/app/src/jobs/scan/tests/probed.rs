//! A scanned ball as the artefact of an acceptance test. How well figures agree with the truth is the matter of `metrology`.

use metrology::acceptance::{AcceptancePlan, Figures, ProbeRequest, Procedure, SphereTest};

use super::bench::{Bench, from_station};
use crate::resources::studies::position_figures;

/// Diameter of the simulated ball, mm.
const DIAMETER_MM: f64 = 37.8;

#[test]
fn a_scanned_ball_has_its_diameter_and_the_noise_of_the_station() {
    let bench = Bench::new();
    let scan = bench.scan(from_station(-14.0, 14.0, 0.5));
    let sphere = SphereTest {
        artefact: "ball".to_owned(),
        diameter_mm: DIAMETER_MM,
        uncertainty_mm: 0.001,
        form_mm: 0.0,
        expansion_per_k: 11.5e-6,
        mpe_form_mm: Some(0.5),
        mpe_form_d95_mm: None,
        mpe_size_mm: None,
    };
    let plan = AcceptancePlan { sphere: Some(sphere), ..AcceptancePlan::default() };
    let request = ProbeRequest { procedure: Procedure::Sphere, region: None, seed: 1 };
    let probing = position_figures(&bench.catalogue, &*bench.store.artifacts, &scan, &plan, request);
    let Figures::Ball(ball) = bench.runtime.block_on(probing).unwrap() else { panic!("no ball") };
    println!("{ball:?}");
    // A quarter of the pixels of the usual station: points are known to some hundredths of a millimetre.
    assert!((ball.diameter_mm - DIAMETER_MM).abs() < 0.1, "{ball:?}");
    assert_eq!(ball.dispersion.n_rejected, ball.dispersion.n_points * 3 / 1000);
    assert!(ball.dispersion.d95_mm > 0.005 && ball.dispersion.d95_mm < 0.3, "{ball:?}");
    assert!(ball.dispersion.range_mm >= ball.dispersion.d95_mm, "{ball:?}");
}
