//! Maxima of a profile across lines.

/// Rows of the maxima that are higher than both neighbouring minima by more than `least_drop` of their own height above
/// `floor`. Of two maxima with a shallower minimum between them the higher is kept.
pub fn peaks(profile: &[f32], floor: f32, least_height: f32, least_drop: f32) -> Vec<usize> {
    let is_peak = |&at: &usize| {
        let here = profile[at];
        (at == 0 || profile[at - 1] < here) && profile.get(at + 1).is_none_or(|&next| next <= here)
    };
    let mut tops: Vec<usize> = (0..profile.len()).filter(is_peak).collect();
    tops.retain(|&top| profile[top] - floor > least_height);
    while let Some(idx) =
        (1..tops.len()).min_by(|&a, &b| depth(profile, &tops, a).total_cmp(&depth(profile, &tops, b)))
    {
        let lower = if profile[tops[idx - 1]] < profile[tops[idx]] { idx - 1 } else { idx };
        if depth(profile, &tops, idx) > least_drop * (profile[tops[lower]] - floor) {
            break;
        }
        tops.remove(lower);
    }
    tops
}

/// Depth of the minimum between two neighbouring maxima below the lower of them; `idx` is the second.
fn depth(profile: &[f32], tops: &[usize], idx: usize) -> f32 {
    let (first, second) = (tops[idx - 1], tops[idx]);
    let least = profile[first..=second].iter().copied().fold(f32::INFINITY, f32::min);
    profile[first].min(profile[second]) - least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shallow_minima_do_not_separate_maxima() {
        let profile = [0.0, 1.0, 8.0, 7.5, 9.0, 2.0, 6.0, 0.0];
        assert_eq!(peaks(&profile, 0.0, 0.5, 0.2), [4, 6]);
        assert_eq!(peaks(&profile, 0.0, 0.5, 0.01), [2, 4, 6]);
        assert_eq!(peaks(&profile, 0.0, 7.0, 0.01), [2, 4]);
    }
}
