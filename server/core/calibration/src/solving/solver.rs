//! Levenberg–Marquardt on the arrow-shaped normal equations.

pub use least_squares::Termination;

use least_squares::Damping;
use nalgebra::Vector6;

use crate::solving::normal::{ArrowNormal, Ranges};

/// Initial damping: as if every parameter were known to its range.
const FIRST_DAMPING: f64 = 1.0;

/// Largest damping tried.
const MAX_DAMPING: f64 = 1e12;

/// Damping below which it has no effect.
const MIN_DAMPING: f64 = 1e-6;

/// Consecutive steps without gain, none damped harder than the first, after which the solver ends: the model is too
/// nonlinear for weak damping, so that each step gains slightly less than predicted, and no gain is left.
const STALLED_STEPS: usize = 5;

/// A reduction of the cost below this fraction counts as none …
const RELATIVE_COST_TOLERANCE: f64 = 1e-10;

/// … as does one below this: the cost is half a χ², so no parameter moves by more than a hundredth of its own σ.
const COST_TOLERANCE: f64 = 1e-4;

/// A step counts as zero if every parameter moves by less than this fraction of its range: a tenth of a nanometre for a
/// range of 10 mm, which is below rounding where residuals have next to no noise.
const STEP_TOLERANCE: f64 = 1e-8;

/// Most accepted steps; bundle adjustments here take 5–20.
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

/// A minimum, or the best state reached.
#[derive(Debug, Clone)]
pub struct Minimum<S> {
    /// Parameters there.
    pub state: S,
    /// Half the robust sum of squares.
    pub cost: f64,
    /// Accepted steps.
    pub n_steps: usize,
    /// Termination reason; a minimum unless [`Termination::NotConverged`].
    pub termination: Termination,
}

/// Minimises from `state`; `None` if the very first system is singular.
pub fn minimise<P: Problem>(problem: &P, mut state: P::State) -> Option<Minimum<P::State>> {
    let ranges = problem.ranges(&state);
    let mut damping = Damping::new(FIRST_DAMPING, MIN_DAMPING, MAX_DAMPING);
    let mut normal = problem.linearise(&state);
    let (mut n_steps, mut n_stalled) = (0, 0);
    let termination = loop {
        let cost = normal.cost();
        let least = COST_TOLERANCE.max(RELATIVE_COST_TOLERANCE * cost);
        // A gain below rounding is not evaluated, although a larger one may still be negligible.
        if let Some(at_rest) = at_rest(&normal, &ranges, COST_TOLERANCE.min(RELATIVE_COST_TOLERANCE * cost)) {
            break at_rest;
        }
        if n_steps == MAX_STEPS {
            break Termination::NotConverged;
        }
        let Some(taken) = downhill(problem, &state, &normal, &ranges, &mut damping) else {
            break at_rest(&normal, &ranges, least).unwrap_or(Termination::NotConverged);
        };
        (state, normal) = (taken.state, taken.normal);
        n_steps += 1;
        let gain = cost - normal.cost();
        if gain <= least && taken.predicted_gain <= least && taken.damping.is_weak() {
            break Termination::Cost;
        }
        n_stalled = if gain <= least && taken.damping.value() <= FIRST_DAMPING { n_stalled + 1 } else { 0 };
        if n_stalled == STALLED_STEPS {
            break Termination::Cost;
        }
    };
    if n_steps == 0 && normal.solve(0.0, &ranges).is_none() {
        return None;
    }
    Some(Minimum { cost: normal.cost(), state, n_steps, termination })
}

/// Whether the full, undamped step from here is negligible: it predicts a gain of at most `least`, or moves no
/// parameter. With an infinite cost no step is negligible.
fn at_rest(normal: &ArrowNormal, ranges: &Ranges, least: f64) -> Option<Termination> {
    let cost = normal.cost();
    let step = normal.solve(0.0, ranges).or_else(|| normal.solve(MIN_DAMPING, ranges));
    let step = step.filter(|_| cost.is_finite())?;
    if normal.expected_gain(&step) <= least {
        return Some(Termination::Gradient);
    }
    (step.in_ranges(ranges) <= STEP_TOLERANCE).then_some(Termination::Step)
}

/// An accepted step.
struct AcceptedStep<S> {
    state: S,
    normal: ArrowNormal,
    /// Predicted reduction of the cost, for linear residuals.
    predicted_gain: f64,
    damping: Damping,
}

/// The next state with a lower cost; damping is increased until there is one, `None` if there is none.
///
/// A candidate is linearised at once instead of evaluating its cost first, because nearly all are accepted.
fn downhill<P: Problem>(
    problem: &P,
    state: &P::State,
    normal: &ArrowNormal,
    ranges: &Ranges,
    damping: &mut Damping,
) -> Option<AcceptedStep<P::State>> {
    loop {
        if let Some(step) = normal.solve(damping.value(), ranges) {
            let next = problem.stepped(state, step.globals.as_slice(), &step.blocks);
            let next_normal = problem.linearise(&next);
            if next_normal.cost() <= normal.cost() {
                let taken = *damping;
                damping.decrease();
                let predicted_gain = normal.expected_gain(&step);
                return Some(AcceptedStep { state: next, normal: next_normal, predicted_gain, damping: taken });
            }
        }
        if !damping.increase() {
            return None;
        }
    }
}
