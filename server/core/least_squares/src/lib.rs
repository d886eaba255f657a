//! Common parts of the least-squares solvers: Levenberg–Marquardt damping, and termination reasons.
//!
//! Equations, units of damping and tolerances belong to each problem; formulas of optics, calibration or metrology do
//! not belong here.

/// Factor by which damping is reduced after a good step and increased after a bad one.
const FACTOR: f64 = 10.0;

/// Damping up to which the length of a step indicates the distance to the minimum: equivalent to a prior with σ of
/// thirty units on every parameter. Steps with stronger damping are short at any distance.
const WEAK: f64 = 1e-3;

/// Multiple of its squared unit added to the diagonal of the normal equations for every parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    value: f64,
    min: f64,
    max: f64,
}

impl Damping {
    /// Damping that starts at `first` and is limited to `min` (below it has no effect) and `max` (above no step is
    /// worth trying).
    pub fn new(first: f64, min: f64, max: f64) -> Self {
        Self { value: first, min, max }
    }

    /// Current value.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Whether damping is so weak that the length of a step indicates the distance to the minimum.
    pub fn is_weak(&self) -> bool {
        self.value <= WEAK
    }

    /// Call after a step that reduced the cost.
    pub fn decrease(&mut self) {
        self.value = (self.value / FACTOR).max(self.min);
    }

    /// Call after a step that did not reduce the cost; `false` if the maximum is exceeded.
    #[must_use]
    pub fn increase(&mut self) -> bool {
        self.value *= FACTOR;
        self.value <= self.max
    }
}

/// Why a solver terminated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// The gradient vanished: the predicted gain of the full step was negligible.
    Gradient,
    /// The step vanished: no parameter moved, or would have moved, significantly.
    Step,
    /// The cost stopped falling: the predicted and actual gain of a lightly damped step, or of several consecutive
    /// steps, was negligible.
    Cost,
    /// No convergence: no step reduced the cost, or the steps ran out, while a lower cost was still predicted. Not a
    /// solution.
    NotConverged,
}

impl Termination {
    /// Its name in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Step => "step",
            Self::Cost => "cost",
            Self::NotConverged => "not_converged",
        }
    }

    /// Its meaning, as a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Gradient => "The fit converged: the gradient vanished.",
            Self::Step => "The fit converged: the next step would not have moved any parameter.",
            Self::Cost => "The fit converged: the last step no longer lowered the residuals.",
            Self::NotConverged => {
                "The fit did not converge: lower residuals were predicted, but no step reached them."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_stays_in_its_range_and_reports_its_limit() {
        let mut damping = Damping::new(1e-2, 1e-4, 1.0);
        assert!(!damping.is_weak());
        for expected in [1e-3, 1e-4, 1e-4] {
            damping.decrease();
            assert!((damping.value() / expected - 1.0).abs() < 1e-12 && damping.is_weak());
        }
        let increased: Vec<bool> = (0..5).map(|_| damping.increase()).collect();
        assert_eq!(increased, [true, true, true, true, false]);
    }
}
