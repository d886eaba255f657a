//! What the least-squares solvers share: Levenberg–Marquardt's damping, and the reasons for which a solver ends.
//!
//! Equations, the unit of damping, and how little counts as nothing belong to each problem; no formula of optics,
//! calibration or metrology lives here.

/// Damping is taken back by this factor after a good step and raised by it after a bad one.
const FACTOR: f64 = 10.0;

/// Damping up to which a step says how far the minimum is: as if every parameter were known to thirty times its unit
/// beforehand. Harder damped steps are short whatever the distance.
const LIGHT: f64 = 1e-3;

/// How much of its unit squared is added to the diagonal of the normal equations for every parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    value: f64,
    least: f64,
    most: f64,
}

impl Damping {
    /// Damping that begins with `first` and stays from `least`, below which it plays no part, to `most`, beyond which no
    /// step is worth a try.
    pub fn new(first: f64, least: f64, most: f64) -> Self {
        Self { value: first, least, most }
    }

    /// As it is now.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Whether a step under it says how far the minimum is.
    pub fn is_light(&self) -> bool {
        self.value <= LIGHT
    }

    /// After a step that led downhill.
    pub fn ease(&mut self) {
        self.value = (self.value / FACTOR).max(self.least);
    }

    /// After a step that did not; `false` where no harder damped step is worth a try.
    #[must_use]
    pub fn raise(&mut self) -> bool {
        self.value *= FACTOR;
        self.value <= self.most
    }
}

/// Why a solver ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// The gradient vanished: the whole step promised less than counts.
    Gradient,
    /// The step vanished: it moved, or would have moved, no parameter by more than counts.
    Step,
    /// The cost stopped falling: a lightly damped step promised and gave less than counts, or several in a row gave it.
    Cost,
    /// It got stuck: no step led downhill, or the steps ran out, while a lower cost was still promised. No solution.
    Stuck,
}

impl Termination {
    /// Its name in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Step => "step",
            Self::Cost => "cost",
            Self::Stuck => "stuck",
        }
    }

    /// What it means, a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Gradient => "The fit converged: the gradient vanished.",
            Self::Step => "The fit converged: the next step would not have moved any parameter.",
            Self::Cost => "The fit converged: the last step no longer lowered the residuals.",
            Self::Stuck => "The fit got stuck: lower residuals were in sight, but no step led there.",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_stays_in_its_range_and_says_when_it_has_left_it() {
        let mut damping = Damping::new(1e-2, 1e-4, 1.0);
        assert!(!damping.is_light());
        for expected in [1e-3, 1e-4, 1e-4] {
            damping.ease();
            assert!((damping.value() / expected - 1.0).abs() < 1e-12 && damping.is_light());
        }
        let raised: Vec<bool> = (0..5).map(|_| damping.raise()).collect();
        assert_eq!(raised, [true, true, true, true, false]);
    }
}
