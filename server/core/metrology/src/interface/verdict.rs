//! Conformity by ISO 14253-1: the uncertainty is taken into account.

/// Conformity of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Within the limits by U or more: conformity is proved.
    Pass,
    /// Beyond a limit by more than U: non-conformity is proved.
    Fail,
    /// Neither is proved.
    Undecided,
}

impl Verdict {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "ok",
            Self::Fail => "not_ok",
            Self::Undecided => "undecided",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// How far a value may be from its nominal, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest deviation; no limit below if absent.
    pub lower: Option<f64>,
    /// Largest deviation; no limit above if absent.
    pub upper: Option<f64>,
}

impl Limits {
    /// The same on both sides.
    pub fn symmetric(tolerance: f64) -> Self {
        Self { lower: Some(-tolerance), upper: Some(tolerance) }
    }

    /// Half the distance between the limits, or the magnitude of the only one; `None` without limits.
    pub(crate) fn width(&self) -> Option<f64> {
        match (self.lower, self.upper) {
            (Some(lower), Some(upper)) => Some((upper - lower) / 2.0),
            (lower, upper) => lower.or(upper).map(f64::abs),
        }
    }
}

/// The verdict on an `error` within `limits` with expanded uncertainty `uncertainty`, all in one unit.
pub fn verdict(error: f64, limits: &Limits, uncertainty: f64) -> Verdict {
    let below = |limit: f64| limit - error;
    let above = |limit: f64| error - limit;
    let beyond = [limits.lower.map(below), limits.upper.map(above)];
    if beyond.iter().flatten().all(|beyond| *beyond <= -uncertainty) {
        Verdict::Pass
    } else if beyond.iter().flatten().any(|beyond| *beyond > uncertainty) {
        Verdict::Fail
    } else {
        Verdict::Undecided
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_follows_the_table_of_iso_14253_1() {
        let cases = [
            (0.0, 0.10, 0.02, Verdict::Pass),
            (0.08, 0.10, 0.02, Verdict::Pass),
            (-0.0799, 0.10, 0.02, Verdict::Pass),
            (0.0801, 0.10, 0.02, Verdict::Undecided),
            (-0.10, 0.10, 0.02, Verdict::Undecided),
            (0.1199, 0.10, 0.02, Verdict::Undecided),
            (0.1201, 0.10, 0.02, Verdict::Fail),
            (-0.5, 0.10, 0.02, Verdict::Fail),
            // With an uncertainty above the tolerance, conformity cannot be proved.
            (0.0, 0.10, 0.11, Verdict::Undecided),
            (f64::NAN, 0.10, 0.02, Verdict::Undecided),
        ];
        for (error, tolerance, uncertainty, expected) in cases {
            let limits = Limits::symmetric(tolerance);
            assert_eq!(verdict(error, &limits, uncertainty), expected, "{error} {tolerance} {uncertainty}");
        }
    }

    #[test]
    fn limits_may_differ_and_one_of_them_may_be_absent() {
        let cases = [
            (Some(-0.05), Some(0.20), 0.17, Verdict::Pass),
            (Some(-0.05), Some(0.20), -0.04, Verdict::Undecided),
            (Some(-0.05), Some(0.20), -0.08, Verdict::Fail),
            // All above zero: a press fit.
            (Some(0.10), Some(0.20), 0.0, Verdict::Fail),
            (None, Some(0.20), -5.0, Verdict::Pass),
            (None, Some(0.20), 0.19, Verdict::Undecided),
            (Some(-0.05), None, 5.0, Verdict::Pass),
            (Some(-0.05), None, -0.06, Verdict::Undecided),
            (Some(-0.05), None, f64::NAN, Verdict::Undecided),
        ];
        for (lower, upper, error, expected) in cases {
            assert_eq!(verdict(error, &Limits { lower, upper }, 0.02), expected, "{lower:?} {upper:?} {error}");
        }
    }
}
