//! Levenberg–Marquardt on the arrow-shaped normal equations.

use nalgebra::Vector6;

use crate::normal::{ArrowNormal, ArrowStep, Ranges};

/// First damping: as if every parameter were known to its range.
const FIRST_DAMPING: f64 = 1.0;

/// Damping is taken back by this factor after a good step and raised by it after a bad one.
const DAMPING_FACTOR: f64 = 10.0;

/// Damping beyond which no further step is tried.
const MAX_DAMPING: f64 = 1e12;

/// Damping below which it plays no part.
const MIN_DAMPING: f64 = 1e-6;

/// Converged when a step lowers the cost by less than this part of it, or is expected to …
const RELATIVE_COST_TOLERANCE: f64 = 1e-10;

/// … or by less than this: the cost is half a χ², so no parameter moves by more than a hundredth of its own σ.
const COST_TOLERANCE: f64 = 1e-4;

/// Upper limit of accepted steps; bundle adjustments here take 5–20.
const MAX_STEPS: usize = 60;

/// A least-squares problem whose parameters are globals and blocks of six.
pub trait Problem {
    /// The parameters' current values.
    type State: Clone;

    /// Normal equations and robust cost at `state`.
    fn linearise(&self, state: &Self::State) -> ArrowNormal;

    /// Robust cost at `state`; infinite where the model has no prediction.
    fn cost(&self, state: &Self::State) -> f64;

    /// The unit of damping for every parameter at `state`.
    fn ranges(&self, state: &Self::State) -> Ranges;

    /// `state` moved by a step.
    fn stepped(&self, state: &Self::State, globals: &[f64], blocks: &[Vector6<f64>]) -> Self::State;
}

/// A minimum, or as close as the solver came.
#[derive(Debug, Clone)]
pub struct Minimum<S> {
    /// Parameters there.
    pub state: S,
    /// Half the robust sum of squares.
    pub cost: f64,
    /// Accepted steps.
    pub n_steps: usize,
    /// Whether the cost stopped falling, rather than the steps running out.
    pub converged: bool,
}

/// Minimises from `state`; `None` if the very first system is singular.
pub fn minimise<P: Problem>(problem: &P, mut state: P::State) -> Option<Minimum<P::State>> {
    let ranges = problem.ranges(&state);
    let mut damping = FIRST_DAMPING;
    let mut normal = problem.linearise(&state);
    for n_steps in 0..MAX_STEPS {
        let cost = normal.cost();
        let Some((next, next_normal)) = downhill(problem, &state, &normal, &ranges, &mut damping) else {
            return (n_steps > 0 || normal.solve(0.0, &ranges).is_some()).then_some(Minimum {
                state,
                cost,
                n_steps,
                converged: true,
            });
        };
        (state, normal) = (next, next_normal);
        let gain = cost - normal.cost();
        if gain <= COST_TOLERANCE.max(RELATIVE_COST_TOLERANCE * cost) {
            return Some(Minimum { state, cost: normal.cost(), n_steps: n_steps + 1, converged: true });
        }
    }
    Some(Minimum { cost: normal.cost(), state, n_steps: MAX_STEPS, converged: false })
}

/// The next state with a lower cost, and the normal equations there; damps harder until there is one, `None` if there
/// is none worth a look: where less can be gained than rounding takes away, every step would be tried in vain.
///
/// A candidate is linearised at once and not looked at for its cost alone: nearly all are taken.
fn downhill<P: Problem>(
    problem: &P,
    state: &P::State,
    normal: &ArrowNormal,
    ranges: &Ranges,
    damping: &mut f64,
) -> Option<(P::State, ArrowNormal)> {
    while *damping <= MAX_DAMPING {
        if let Some(step) = normal.solve(*damping, ranges) {
            if is_negligible(normal, &step) {
                return None;
            }
            let next = problem.stepped(state, step.globals.as_slice(), &step.blocks);
            let next_normal = problem.linearise(&next);
            if next_normal.cost() <= normal.cost() {
                *damping = (*damping / DAMPING_FACTOR).max(MIN_DAMPING);
                return Some((next, next_normal));
            }
        }
        *damping *= DAMPING_FACTOR;
    }
    None
}

/// Whether a step is not worth an evaluation. An infinite cost is worth any.
fn is_negligible(normal: &ArrowNormal, step: &ArrowStep) -> bool {
    let cost = normal.cost();
    cost.is_finite() && normal.expected_gain(step) <= COST_TOLERANCE.min(RELATIVE_COST_TOLERANCE * cost)
}
