//! Distance to the nearest other line, for the steps of traces in columns where lines come close to each other.

use std::ops::Range;

use crate::centreline::lines::traces::Trace;
use crate::params::RIVAL_CONTRAST;

/// Records, for every step in some columns, the distance to the nearest other trace that is bright enough to matter.
/// `here` is scratch memory.
#[inline(always)]
pub fn mark_clearances(traces: &mut [Trace], columns: &[Range<usize>], here: &mut Vec<usize>) {
    for columns in columns {
        here.clear();
        here.extend((0..traces.len()).filter(|&idx| !traces[idx].within(columns).is_empty()));
        for (n, &second) in here.iter().enumerate() {
            for &first in &here[..n] {
                let (before, after) = traces.split_at_mut(second);
                mark_pair(&mut before[first], &mut after[0], columns);
            }
        }
    }
}

/// Records the distance between two traces.
#[inline(always)]
fn mark_pair(a: &mut Trace, b: &mut Trace, columns: &Range<usize>) {
    let (of_a, of_b) = (a.within(columns), b.within(columns));
    let both = of_a.start.max(of_b.start)..of_a.end.min(of_b.end);
    let n = both.len();
    let (in_a, in_b) = (both.start.saturating_sub(a.first_u), both.start.saturating_sub(b.first_u));
    if n == 0 {
        return;
    }
    let (v, contrast, clearance_px) =
        (&a.v[in_a..][..n], &a.contrast[in_a..][..n], &mut a.clearance_px[in_a..][..n]);
    let (other_v, other_contrast, other_clearance_px) =
        (&b.v[in_b..][..n], &b.contrast[in_b..][..n], &mut b.clearance_px[in_b..][..n]);
    for i in 0..n {
        let distance = (other_v[i] - v[i]).abs();
        let matters = other_contrast[i] >= RIVAL_CONTRAST * contrast[i];
        let nearest = if matters { distance } else { f32::INFINITY };
        clearance_px[i] = if nearest < clearance_px[i] { nearest } else { clearance_px[i] };
        let matters = contrast[i] >= RIVAL_CONTRAST * other_contrast[i];
        let nearest = if matters { distance } else { f32::INFINITY };
        other_clearance_px[i] = if nearest < other_clearance_px[i] { nearest } else { other_clearance_px[i] };
    }
}
