//! Verdict on the powers: of the orders of a grating, whose pairs +m and −m tell dirt from rotation, or of independent
//! lines, each of which has its own laser.

use crate::params::watches::{POWER_SIGMA_FLOOR, REFERENCE_SCANS, WARN_SIGMAS};
use crate::watches::WatchReport;
use crate::watches::drift::Estimate;
use crate::watches::order_powers::OrderPowers;
use crate::watches::verdicts::{PowerReference, Watch, WatchReason, WatchState, WatchVerdict, verdict};

/// The verdict; `reference`: powers since the calibration, at the same exposure and laser power.
pub(super) fn of_powers(report: &WatchReport, reference: Option<&PowerReference>) -> WatchVerdict {
    let lines = if report.independent_lines { "lines" } else { "orders" };
    let Some(powers) = &report.powers else {
        return verdict(
            Watch::OrderPowers,
            WatchState::Blind,
            WatchReason::LittleUnsaturatedOverlap,
            format!("too little of the surface was observed by two {lines} without saturation"),
        );
    };
    let Some(reference) = reference else {
        return verdict(
            Watch::OrderPowers,
            WatchState::Blind,
            WatchReason::ReferenceIncomplete,
            format!("the first {REFERENCE_SCANS} scans after a calibration define the normal powers"),
        );
    };
    let change = Change::new(powers, reference);
    let (largest, warning) =
        if report.independent_lines { change.of_lines() } else { change.of_orders(powers.reference_order) };
    if let Some(warning) = warning {
        return warning;
    }
    if change.total.value < 0.0 && is_clear(&change.total) {
        let reason = format!(
            "all {lines} have lost light since the first scans ({}): the laser ages, or the parts are darker",
            percent(change.total)
        );
        return warning_of(WatchReason::PowerLoss, change.total, reason);
    }
    let largest = largest.unwrap_or(change.total);
    let reason = format!("largest change {} since the first scans", percent(largest));
    let quiet = verdict(Watch::OrderPowers, WatchState::Quiet, WatchReason::PowersStable, reason);
    WatchVerdict { estimate: Some(largest), ..quiet }
}

/// Change of the powers since the reference, as logarithms.
struct Change {
    /// Of every line relative to the reference line; the reference line itself is 0.
    of_each: Vec<(i8, Estimate)>,
    total: Estimate,
}

impl Change {
    fn new(powers: &OrderPowers, reference: &PowerReference) -> Self {
        let change = |(order, ratio): &(i8, Estimate)| {
            let (_, was) = reference.log_ratios.iter().find(|(other, _)| other == order)?;
            let sigma = ratio.sigma.hypot(was.sigma).hypot(POWER_SIGMA_FLOOR);
            Some((*order, Estimate { value: ratio.value - was.value, sigma }))
        };
        let unchanged = (powers.reference_order, Estimate { value: 0.0, sigma: 0.0 });
        let of_each = powers.log_ratios.iter().filter_map(change).chain([unchanged]).collect();
        let was = reference.log_total;
        let sigma = was.sigma.hypot(POWER_SIGMA_FLOOR);
        Self { of_each, total: Estimate { value: powers.log_total - was.value, sigma } }
    }

    /// The largest change, and the warning about it, of orders of a grating: of +m and −m together by dirt, and against
    /// each other by a rotation.
    fn of_orders(&self, reference_order: i8) -> (Option<Estimate>, Option<WatchVerdict>) {
        let of = |order: i8| self.of_each.iter().find(|(other, _)| *other == order).map(|(_, change)| *change);
        let (mut even, mut odd) = (Vec::new(), Vec::new());
        for (order, up) in self.of_each.iter().filter(|(order, _)| *order > 0) {
            let Some(down) = order.checked_neg().and_then(of) else { continue };
            let sigma = 0.5 * up.sigma.hypot(down.sigma);
            even.push(Estimate { value: 0.5 * (up.value + down.value), sigma });
            odd.push(Estimate { value: 0.5 * (up.value - down.value), sigma });
        }
        let (even, odd) = (clearest(even), clearest(odd));
        let warning = match (odd.filter(is_clear), even.filter(is_clear)) {
            (Some(odd), even) if even.is_none_or(|even| odd.sigmas() >= even.sigmas()) => {
                let reason = format!(
                    "the orders on one side have gained over those on the other ({}): the grating has rotated",
                    percent(odd)
                );
                Some(warning_of(WatchReason::GratingRotated, odd, reason))
            }
            (_, Some(even)) => {
                let reason = format!(
                    "the orders on both sides have changed equally relative to order {reference_order} ({}): the grating is dirty, clean it",
                    percent(even)
                );
                Some(warning_of(WatchReason::GratingDirty, even, reason))
            }
            _ => None,
        };
        (clearest(even.into_iter().chain(odd)), warning)
    }

    /// The largest change, and the warning about it, of independent lines against the others.
    ///
    /// The line with the median change counts as unchanged, the brighter one of two: one laser fades alone, and none
    /// gains power.
    fn of_lines(&self) -> (Option<Estimate>, Option<WatchVerdict>) {
        let mut by_change = self.of_each.clone();
        by_change.sort_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
        let Some(&(unchanged, middle)) = by_change.get(by_change.len() / 2) else { return (None, None) };
        let against = |(line, of): &(i8, Estimate)| {
            let sigma = of.sigma.hypot(middle.sigma);
            (*line, Estimate { value: of.value - middle.value, sigma })
        };
        let others = by_change.iter().filter(|(line, _)| *line != unchanged).map(against);
        let clearest = others.max_by(|(_, a), (_, b)| a.sigmas().total_cmp(&b.sigmas()));
        let Some((line, change)) = clearest else { return (None, None) };
        let warning = is_clear(&change).then(|| {
            let than = match by_change.len() {
                2 => format!("line {unchanged}"),
                _ => "the other lines".to_owned(),
            };
            let figure = percent(change);
            let (code, reason) = if change.value < 0.0 {
                let reason =
                    format!("line {line} has lost light against {than} ({figure}): its laser fades or is dirty");
                (WatchReason::LineFaded, reason)
            } else {
                let reason =
                    format!("line {line} has gained over the others ({figure}): their lasers fade or are dirty");
                (WatchReason::OthersFaded, reason)
            };
            WatchVerdict { line: Some(line), ..warning_of(code, change, reason) }
        });
        (Some(change), warning)
    }
}

fn warning_of(code: WatchReason, change: Estimate, reason: String) -> WatchVerdict {
    WatchVerdict { estimate: Some(change), ..verdict(Watch::OrderPowers, WatchState::Warning, code, reason) }
}

fn clearest(of: impl IntoIterator<Item = Estimate>) -> Option<Estimate> {
    of.into_iter().max_by(|a, b| a.sigmas().total_cmp(&b.sigmas()))
}

fn is_clear(change: &Estimate) -> bool {
    change.is_beyond(WARN_SIGMAS)
}

fn percent(change: Estimate) -> String {
    format!("{:+.0} %", change.value.exp_m1() * 100.0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Powers of independent lines from their factors of light, line 0 first.
    fn powers(factors: &[f64]) -> OrderPowers {
        let logs: Vec<f64> = factors.iter().map(|factor| factor.ln()).collect();
        let ratio = |line: usize| (line as i8, Estimate { value: logs[line] - logs[0], sigma: 0.002 });
        OrderPowers {
            reference_order: 0,
            log_ratios: (1..factors.len()).map(ratio).collect(),
            log_total: logs.iter().sum::<f64>() / logs.len() as f64,
            n_places: 900,
        }
    }

    /// State, named line and reason.
    fn judged(factors: &[f64]) -> (WatchState, Option<i8>, String) {
        let clean = powers(&vec![1.0; factors.len()]);
        let reference = PowerReference::of(&vec![clean; REFERENCE_SCANS]).unwrap();
        let report = WatchReport { powers: Some(powers(factors)), independent_lines: true, ..Default::default() };
        let verdict = of_powers(&report, Some(&reference));
        (verdict.state, verdict.line, verdict.reason)
    }

    #[test]
    fn the_laser_that_fades_is_named() {
        for (factors, line, words) in [
            (&[1.0, 0.7][..], Some(1), "line 1 has lost light against line 0 (-30 %)"),
            (&[0.7, 1.0], Some(0), "line 0 has lost light against line 1 (-30 %)"),
            // Both fade, one of them more.
            (&[0.4, 0.8], Some(0), "line 0 has lost light against line 1 (-50 %)"),
            (&[1.0, 1.0, 0.7], Some(2), "line 2 has lost light against the other lines (-30 %)"),
            (&[0.7, 1.0, 1.0, 1.0], Some(0), "line 0 has lost light against the other lines (-30 %)"),
            (&[0.5, 1.0, 0.5], Some(1), "line 1 has gained over the others (+100 %)"),
            // The same loss of all is no fault of one.
            (&[0.6, 0.6], None, "all lines have lost light since the first scans (-40 %)"),
        ] {
            let (state, found, reason) = judged(factors);
            assert_eq!((state, found), (WatchState::Warning, line), "{factors:?}: {reason}");
            assert!(reason.contains(words), "{factors:?}: {reason}");
        }
        // Parts differ by 3 %.
        let (state, line, reason) = judged(&[1.0, 0.95]);
        assert_eq!((state, line), (WatchState::Quiet, None), "{reason}");
    }
}
