//! Levenberg–Marquardt on the arrow-shaped normal equations.

pub use least_squares::Termination;

use least_squares::Damping;
use nalgebra::Vector6;

use crate::solving::normal::{ArrowNormal, Ranges};

/// First damping: as if every parameter were known to its range.
const FIRST_DAMPING: f64 = 1.0;

/// Damping beyond which no further step is tried.
const MAX_DAMPING: f64 = 1e12;

/// Damping below which it plays no part.
const MIN_DAMPING: f64 = 1e-6;

/// Steps in a row that gain nothing although none was damped harder than the first: the model bends too much for light
/// damping, so each promises a little more than it gives, and nothing is left to gain.
const STALLED_STEPS: usize = 5;

/// A gain of the cost counts as none below this part of it …
const RELATIVE_COST_TOLERANCE: f64 = 1e-10;

/// … or below this: the cost is half a χ², so no parameter moves by more than a hundredth of its own σ.
const COST_TOLERANCE: f64 = 1e-4;

/// A step counts as none if every parameter moves by less than this part of its range: a tenth of a nanometre at a range of
/// 10 mm, which is less than rounding leaves where residuals have next to no noise.
const STEP_TOLERANCE: f64 = 1e-8;

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
    /// Why it is not followed further; a minimum unless [`Termination::Stuck`].
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
        // Less than rounding takes away is not worth a look, though more than that may be as good as nothing.
        if let Some(at_rest) = at_rest(&normal, &ranges, COST_TOLERANCE.min(RELATIVE_COST_TOLERANCE * cost)) {
            break at_rest;
        }
        if n_steps == MAX_STEPS {
            break Termination::Stuck;
        }
        let Some(taken) = downhill(problem, &state, &normal, &ranges, &mut damping) else {
            break at_rest(&normal, &ranges, least).unwrap_or(Termination::Stuck);
        };
        (state, normal) = (taken.state, taken.normal);
        n_steps += 1;
        let gain = cost - normal.cost();
        if gain <= least && taken.promised <= least && taken.damping.is_light() {
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

/// Whether the whole, undamped step from here counts for nothing: it promises no more than `least`, or no parameter would
/// move. An infinite cost is worth any step.
fn at_rest(normal: &ArrowNormal, ranges: &Ranges, least: f64) -> Option<Termination> {
    let cost = normal.cost();
    let step = normal.solve(0.0, ranges).or_else(|| normal.solve(MIN_DAMPING, ranges));
    let step = step.filter(|_| cost.is_finite())?;
    if normal.expected_gain(&step) <= least {
        return Some(Termination::Gradient);
    }
    (step.in_ranges(ranges) <= STEP_TOLERANCE).then_some(Termination::Step)
}

/// A step that was taken.
struct Taken<S> {
    state: S,
    normal: ArrowNormal,
    /// How much it was to lower the cost, had the residuals been linear.
    promised: f64,
    damping: Damping,
}

/// The next state with a lower cost; damps harder until there is one, `None` if there is none.
///
/// A candidate is linearised at once and not looked at for its cost alone: nearly all are taken.
fn downhill<P: Problem>(
    problem: &P,
    state: &P::State,
    normal: &ArrowNormal,
    ranges: &Ranges,
    damping: &mut Damping,
) -> Option<Taken<P::State>> {
    loop {
        if let Some(step) = normal.solve(damping.value(), ranges) {
            let next = problem.stepped(state, step.globals.as_slice(), &step.blocks);
            let next_normal = problem.linearise(&next);
            if next_normal.cost() <= normal.cost() {
                let taken = *damping;
                damping.ease();
                let promised = normal.expected_gain(&step);
                return Some(Taken { state: next, normal: next_normal, promised, damping: taken });
            }
        }
        if !damping.raise() {
            return None;
        }
    }
}
