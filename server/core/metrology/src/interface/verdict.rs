//! Conformity by ISO 14253-1: the uncertainty is taken into account.

/// Conformity of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// |error| ≤ T − U: conformity is proved.
    Pass,
    /// |error| > T + U: non-conformity is proved.
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

/// The verdict on an `error` against a symmetric `tolerance` with expanded uncertainty `uncertainty`, all in one unit.
pub fn verdict(error: f64, tolerance: f64, uncertainty: f64) -> Verdict {
    if error.abs() <= tolerance - uncertainty {
        Verdict::Pass
    } else if error.abs() > tolerance + uncertainty {
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
            assert_eq!(verdict(error, tolerance, uncertainty), expected, "{error} {tolerance} {uncertainty}");
        }
    }
}
