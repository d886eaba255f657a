//! Every termination of the solver, on problems with one parameter.

use calibration::normal::{ArrowNormal, BlockNormal, Ranges};
use calibration::solver::{Minimum, Problem, Termination, minimise};
use nalgebra::Vector6;

/// Half a χ² below which the solver stops.
const COST_TOLERANCE: f64 = 1e-4;

/// One number x; residual and slope in σ, infinite cost where there is no residual.
struct Scalar<F: Fn(f64) -> Option<(f64, f64)>> {
    residual: F,
}

impl<F: Fn(f64) -> Option<(f64, f64)>> Problem for Scalar<F> {
    type State = f64;

    fn linearise(&self, x: &f64) -> ArrowNormal {
        let mut sums = BlockNormal::zeros(1);
        match (self.residual)(*x) {
            Some((residual, slope)) => {
                sums.cost = 0.5 * residual * residual;
                sums.add(&[(0, &[slope])], &[0.0; 6], residual, 1.0);
            }
            None => sums.cost = f64::INFINITY,
        }
        ArrowNormal::new(sums, Vec::new(), &[true])
    }

    fn cost(&self, x: &f64) -> f64 {
        self.linearise(x).cost()
    }

    fn ranges(&self, _x: &f64) -> Ranges {
        Ranges { globals: vec![1.0], block: [1.0; 6] }
    }

    fn stepped(&self, x: &f64, globals: &[f64], _blocks: &[Vector6<f64>]) -> f64 {
        x + globals[0]
    }
}

fn minimum(residual: impl Fn(f64) -> Option<(f64, f64)>, start: f64) -> Minimum<f64> {
    minimise(&Scalar { residual }, start).unwrap()
}

#[test]
fn a_start_at_the_minimum_terminates_by_the_gradient() {
    let found = minimum(|x| Some((x - 2.0, 1.0)), 2.0);
    assert_eq!((found.termination, found.n_steps), (Termination::Gradient, 0));
}

#[test]
fn a_negligible_distance_terminates_by_the_step() {
    // So steep that 1e-11 of the range still costs 0.5.
    let found = minimum(|x| Some((1e11 * (x - 2.0), 1e11)), 2.0 + 1e-11);
    assert_eq!((found.termination, found.n_steps), (Termination::Step, 0));
}

#[test]
fn slow_convergence_terminates_by_the_cost() {
    // r = x²: every step halves x, and the predicted gain stays a constant fraction of the cost.
    let found = minimum(|x| Some((x * x, 2.0 * x)), 1.0);
    assert_eq!(found.termination, Termination::Cost);
    assert!(found.cost < COST_TOLERANCE, "{}", found.cost);
}

#[test]
fn approaching_the_limit_of_the_models_domain_is_not_convergence() {
    // The minimum is outside the model's domain: steps with ever stronger damping gain ever less.
    let found = minimum(|x| (x > 0.5).then_some((100.0 * x, 100.0)), 1.0);
    assert_eq!(found.termination, Termination::NotConverged);
    assert!(found.state > 0.5 && found.cost.is_finite());
}

#[test]
fn a_gradient_without_a_gain_is_not_convergence() {
    let uphill = minimum(|x| Some((10.0 + x, -1.0)), 0.0);
    assert_eq!(uphill.termination, Termination::NotConverged);
}

#[test]
fn a_problem_that_does_not_depend_on_its_parameter_has_no_minimum() {
    assert!(minimise(&Scalar { residual: |_| Some((1.0, 0.0)) }, 0.0).is_none());
}

#[test]
fn every_termination_has_a_sentence() {
    for termination in [Termination::Gradient, Termination::Step, Termination::Cost, Termination::NotConverged] {
        assert_eq!(termination.sentence().contains("converged"), termination != Termination::NotConverged);
        assert!(termination.sentence().ends_with('.') && !termination.name().is_empty());
    }
}
