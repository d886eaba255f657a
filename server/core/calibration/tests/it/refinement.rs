//! The work of the joint refinement grows linearly with the number of points: the number of evaluations per point does
//! not depend on it. The cost of an evaluation is measured by `benches/joint.rs`.

use std::cell::Cell;

use crate::common::refinement::{POSES, refinement};
use calibration::bundle::Bundle;
use calibration::bundle_state::BundleState;
use calibration::normal::{ArrowNormal, Ranges};
use calibration::solver::{Problem, Termination, minimise};
use nalgebra::Vector6;

/// Most evaluations of every point, including the one at the start: five steps reach the minimum, which the fewest
/// points determine only weakly; more points do not need more steps.
const MAX_EVALUATIONS: usize = 6;

/// The cost is half of χ², one per line point and two per corner; its own σ is below a fiftieth at the fewest points
/// here.
const COST_TOLERANCE: f64 = 0.05;

/// A bundle that counts the evaluations of all of its points.
struct Counted {
    bundle: Bundle,
    n_evaluations: Cell<usize>,
}

impl Problem for Counted {
    type State = BundleState;

    fn linearise(&self, station: &BundleState) -> ArrowNormal {
        self.n_evaluations.update(|n| n + 1);
        self.bundle.linearise(station)
    }

    fn cost(&self, station: &BundleState) -> f64 {
        self.n_evaluations.update(|n| n + 1);
        self.bundle.cost(station)
    }

    fn ranges(&self, station: &BundleState) -> Ranges {
        self.bundle.ranges(station)
    }

    fn stepped(&self, station: &BundleState, globals: &[f64], blocks: &[Vector6<f64>]) -> BundleState {
        self.bundle.stepped(station, globals, blocks)
    }
}

#[test]
fn ten_times_the_points_need_no_more_evaluations() {
    for n_columns in [60, 100, 250, 600] {
        let (bundle, start) = refinement(n_columns);
        let n_points = bundle.laser.len();
        let counted = Counted { bundle, n_evaluations: Cell::new(0) };
        let minimum = minimise(&counted, start).unwrap();
        assert_ne!(minimum.termination, Termination::NotConverged);
        let n_evaluations = counted.n_evaluations.get();
        assert!(
            n_evaluations <= MAX_EVALUATIONS,
            "{n_points} points: {n_evaluations} evaluations, {} steps",
            minimum.n_steps
        );
        let expected = 0.5 * (n_points + 2 * POSES * crate::common::COLUMNS * crate::common::ROWS) as f64;
        assert!((minimum.cost / expected - 1.0).abs() < COST_TOLERANCE, "cost {} of {expected}", minimum.cost);
    }
}

#[test]
fn a_start_at_the_minimum_is_evaluated_once() {
    // Rounding made some steps from the minimum appear to increase the cost, and each was retried with all dampings.
    let (bundle, start) = refinement(100);
    let once = minimise(&bundle, start).unwrap();
    let minimum = minimise(&bundle, once.state).unwrap();
    let counted = Counted { bundle, n_evaluations: Cell::new(0) };
    let again = minimise(&counted, minimum.state.clone()).unwrap();
    assert_eq!((again.n_steps, counted.n_evaluations.get()), (0, 1));
    assert_eq!(again.state, minimum.state);
}
