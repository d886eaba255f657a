//! Run rules: patterns of points that are improbable while a process is stable.

use crate::sample::valid;

/// A run rule. Rules 1–8 are those of Nelson (1984); the last is the variant of Western Electric (1956).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rule {
    /// 1: one point beyond 3 σ.
    BeyondThreeSigma,
    /// 2: nine consecutive points on one side of the centre line.
    NineOnOneSide,
    /// 3: six consecutive points all increasing or all decreasing.
    SixTrending,
    /// 4: fourteen consecutive points alternating up and down.
    FourteenAlternating,
    /// 5: two of three consecutive points beyond 2 σ on the same side, the last one among them.
    TwoOfThreeBeyondTwoSigma,
    /// 6: four of five consecutive points beyond 1 σ on the same side, the last one among them.
    FourOfFiveBeyondOneSigma,
    /// 7: fifteen consecutive points within 1 σ.
    FifteenWithinOneSigma,
    /// 8: eight consecutive points beyond 1 σ, on either side.
    EightBeyondOneSigma,
    /// Western Electric 4: eight consecutive points on one side of the centre line.
    EightOnOneSide,
}

impl Rule {
    /// Nelson's rules 1–8.
    pub const NELSON: [Self; 8] = [
        Self::BeyondThreeSigma,
        Self::NineOnOneSide,
        Self::SixTrending,
        Self::FourteenAlternating,
        Self::TwoOfThreeBeyondTwoSigma,
        Self::FourOfFiveBeyondOneSigma,
        Self::FifteenWithinOneSigma,
        Self::EightBeyondOneSigma,
    ];

    /// The four rules of Western Electric.
    pub const WESTERN_ELECTRIC: [Self; 4] = [
        Self::BeyondThreeSigma,
        Self::TwoOfThreeBeyondTwoSigma,
        Self::FourOfFiveBeyondOneSigma,
        Self::EightOnOneSide,
    ];

    /// Number of consecutive points that the rule examines.
    pub fn n_points(self) -> usize {
        match self {
            Self::BeyondThreeSigma => 1,
            Self::NineOnOneSide => 9,
            Self::SixTrending => 6,
            Self::FourteenAlternating => 14,
            Self::TwoOfThreeBeyondTwoSigma => 3,
            Self::FourOfFiveBeyondOneSigma => 5,
            Self::FifteenWithinOneSigma => 15,
            Self::EightBeyondOneSigma | Self::EightOnOneSide => 8,
        }
    }

    /// Whether [`Self::n_points`] consecutive points, the newest last, show the pattern. Points exactly on a line are
    /// not beyond it, and equal neighbours neither rise nor fall.
    fn is_violated_by(self, points: &[f64], centre: f64, sigma: f64) -> bool {
        let above = |point: f64, n_sigmas: f64| point - centre > n_sigmas * sigma;
        let below = |point: f64, n_sigmas: f64| centre - point > n_sigmas * sigma;
        let all_on_one_side = || points.iter().all(|p| above(*p, 0.0)) || points.iter().all(|p| below(*p, 0.0));
        let counts = |side: &dyn Fn(f64, f64) -> bool, n_needed: usize, n_sigmas: f64| {
            points.last().is_some_and(|last| side(*last, n_sigmas))
                && points.iter().filter(|point| side(**point, n_sigmas)).count() >= n_needed
        };
        let either = |n_needed, n_sigmas| counts(&above, n_needed, n_sigmas) || counts(&below, n_needed, n_sigmas);
        let outside = |point: f64, n_sigmas: f64| above(point, n_sigmas) || below(point, n_sigmas);
        match self {
            Self::BeyondThreeSigma => either(1, 3.0),
            Self::NineOnOneSide | Self::EightOnOneSide => all_on_one_side(),
            Self::SixTrending => {
                points.windows(2).all(|pair| pair[1] > pair[0]) || points.windows(2).all(|pair| pair[1] < pair[0])
            }
            Self::FourteenAlternating => points.windows(3).all(|three| {
                (three[1] > three[0] && three[1] > three[2]) || (three[1] < three[0] && three[1] < three[2])
            }),
            Self::TwoOfThreeBeyondTwoSigma => either(2, 2.0),
            Self::FourOfFiveBeyondOneSigma => either(4, 1.0),
            Self::FifteenWithinOneSigma => points.iter().all(|point| !outside(*point, 1.0)),
            Self::EightBeyondOneSigma => points.iter().all(|point| outside(*point, 1.0)),
        }
    }
}

/// A violation of a run rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// The rule.
    pub rule: Rule,
    /// Index of the first point of the pattern.
    pub first_idx: usize,
    /// Index of the last point that completed the pattern.
    pub last_idx: usize,
}

/// Violations of `rules` by the points of a symmetric chart (individual values or means).
///
/// `centre` and `sigma` (of the points, so σ/√size for means), in the unit of the points, come from a baseline. A gap
/// ends every run. A pattern that continues is one violation with a longer range. Ordered by rule as given, then by index.
pub fn violations(points: &[Option<f64>], centre: f64, sigma: f64, rules: &[Rule]) -> Vec<Violation> {
    let segments = segments(points);
    rules.iter().flat_map(|rule| violations_of(*rule, &segments, centre, sigma)).collect()
}

/// Consecutive points without gap, and the index of the first.
struct Segment {
    first_idx: usize,
    points: Vec<f64>,
}

fn segments(points: &[Option<f64>]) -> Vec<Segment> {
    let mut segments = vec![Segment { first_idx: 0, points: Vec::new() }];
    for (idx, point) in points.iter().enumerate() {
        match (valid(*point), segments.last_mut()) {
            (Some(point), Some(segment)) => segment.points.push(point),
            _ => segments.push(Segment { first_idx: idx + 1, points: Vec::new() }),
        }
    }
    segments
}

fn violations_of(rule: Rule, segments: &[Segment], centre: f64, sigma: f64) -> Vec<Violation> {
    let mut found: Vec<Violation> = Vec::new();
    for segment in segments {
        let windows = segment.points.windows(rule.n_points()).enumerate();
        for (idx, _) in windows.filter(|(_, window)| rule.is_violated_by(window, centre, sigma)) {
            let first_idx = segment.first_idx + idx;
            let last_idx = first_idx + rule.n_points() - 1;
            match found.last_mut().filter(|last| last.last_idx + 1 == last_idx) {
                Some(last) => last.last_idx = last_idx,
                None => found.push(Violation { rule, first_idx, last_idx }),
            }
        }
    }
    found
}
