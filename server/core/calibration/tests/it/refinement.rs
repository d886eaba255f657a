//! The work of the joint refinement grows with its points and no faster: how often it looks at each of them does not
//! depend on how many there are. What a look costs is for `benches/joint.rs`.

use std::cell::Cell;

use crate::common::refinement::{POSES, refinement};
use calibration::bundle::Bundle;
use calibration::normal::{ArrowNormal, Ranges};
use calibration::solver::{Problem, Termination, minimise};
use calibration::station::Station;
use nalgebra::Vector6;

/// Most looks at every point, the one at the start included: five steps lead to the minimum that the fewest points
/// determine weakly, and no more points need more.
const MOST_LOOKS: usize = 6;

/// The cost is half of χ², one a line point and two a corner; its own σ is below a fiftieth at the fewest points here.
const COST_TOLERANCE: f64 = 0.05;

/// A bundle that counts how often it is asked about all of its points.
struct Counted {
    bundle: Bundle,
    n_looks: Cell<usize>,
}

impl Problem for Counted {
    type State = Station;

    fn linearise(&self, station: &Station) -> ArrowNormal {
        self.n_looks.update(|n| n + 1);
        self.bundle.linearise(station)
    }

    fn cost(&self, station: &Station) -> f64 {
        self.n_looks.update(|n| n + 1);
        self.bundle.cost(station)
    }

    fn ranges(&self, station: &Station) -> Ranges {
        self.bundle.ranges(station)
    }

    fn stepped(&self, station: &Station, globals: &[f64], blocks: &[Vector6<f64>]) -> Station {
        self.bundle.stepped(station, globals, blocks)
    }
}

#[test]
fn ten_times_the_points_are_looked_at_no_more_often() {
    for n_columns in [60, 100, 250, 600] {
        let (bundle, start) = refinement(n_columns);
        let n_points = bundle.laser.len();
        let counted = Counted { bundle, n_looks: Cell::new(0) };
        let minimum = minimise(&counted, start).unwrap();
        assert_ne!(minimum.termination, Termination::Stuck);
        let n_looks = counted.n_looks.get();
        assert!(n_looks <= MOST_LOOKS, "{n_points} points: {n_looks} looks, {} steps", minimum.n_steps);
        let expected = 0.5 * (n_points + 2 * POSES * crate::common::COLUMNS * crate::common::ROWS) as f64;
        assert!((minimum.cost / expected - 1.0).abs() < COST_TOLERANCE, "cost {} of {expected}", minimum.cost);
    }
}

#[test]
fn a_start_at_the_minimum_is_looked_at_once() {
    // Rounding makes some steps from the minimum seem to lead uphill, and each was tried again with all dampings.
    let (bundle, start) = refinement(100);
    let once = minimise(&bundle, start).unwrap();
    let minimum = minimise(&bundle, once.state).unwrap();
    let counted = Counted { bundle, n_looks: Cell::new(0) };
    let again = minimise(&counted, minimum.state.clone()).unwrap();
    assert_eq!((again.n_steps, counted.n_looks.get()), (0, 1));
    assert_eq!(again.state, minimum.state);
}
