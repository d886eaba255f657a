//! Closure of a full turn: surfaces compared with those observed one turn earlier (`docs/maths/turntable.md`, eq. 11).

use statistics::median;

use super::Surfaces;
use crate::params::{CLOSURE_MAD_LIMIT, COMPARE_STRIDE_PX};
use crate::points::profile::ProfilePoint;

/// Distance of a part's surface after a full turn from that before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureGap {
    /// Points of the later frames on smooth surface observed one turn earlier.
    pub n_pairs: usize,
    /// Mean of later minus earlier, along the surface's normal towards the axis, mm.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included, mm.
    pub rms_mm: f64,
    /// Pairs excluded as outliers.
    pub n_outliers: usize,
}

/// The closure of a full turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closure {
    /// The same line before and after: slip of the table, drift, movement of the part. Insensitive to the axis.
    pub same_line: Option<ClosureGap>,
    /// Another line, which observes the surface at another angle of the table: also sensitive to errors of the
    /// axis.
    pub other_lines: Option<ClosureGap>,
}

/// Differences in depth from one turn to the next.
#[derive(Debug, Clone, Default)]
pub struct ClosurePairs {
    same_line_mm: Vec<f64>,
    other_lines_mm: Vec<f64>,
}

impl ClosurePairs {
    /// Adds the differences of another frame.
    pub fn append(&mut self, mut other: Self) {
        self.same_line_mm.append(&mut other.same_line_mm);
        self.other_lines_mm.append(&mut other.other_lines_mm);
    }

    /// Their statistics; `None` if no point was observed again after a full turn.
    pub fn closure(mut self) -> Option<Closure> {
        let same_line = gap(&mut self.same_line_mm);
        let other_lines = gap(&mut self.other_lines_mm);
        (same_line.is_some() || other_lines.is_some()).then_some(Closure { same_line, other_lines })
    }
}

impl Surfaces<'_> {
    /// The points of one frame against the surfaces observed one turn earlier.
    pub fn closure_of(&self, points: &[ProfilePoint], frame: usize) -> ClosurePairs {
        let mut pairs = ClosurePairs::default();
        if self.reference_view.chart.period_mm().is_none() {
            return pairs;
        }
        for point in points.iter().step_by(COMPARE_STRIDE_PX) {
            let in_chart = self.motions[frame].chart_from_camera(&point.hit_in_camera);
            // Nearest patch of its own line, and of another.
            let mut nearest: [Option<(f64, f64)>; 2] = [None; 2];
            for view in self.reference_view.views_a_turn_before(&in_chart) {
                self.grid.for_each_near(&view.xy_mm, |idx, distance| {
                    let patch = &self.patches[idx];
                    let slot = &mut nearest[usize::from(patch.order != point.order)];
                    if patch.smooth && slot.is_none_or(|(best, _)| distance < best) {
                        let (apart_mm, _) =
                            self.difference(point, &view, patch, &patch.view(&self.reference_view));
                        *slot = Some((distance, apart_mm / (1.0 + patch.gradient.norm_squared()).sqrt()));
                    }
                });
            }
            let [same, other] = nearest.map(|found| found.map(|(_, apart_mm)| apart_mm));
            pairs.same_line_mm.extend(same);
            pairs.other_lines_mm.extend(other);
        }
        pairs
    }
}

/// Statistics without outliers from wrong labels or edges.
fn gap(differences_mm: &mut [f64]) -> Option<ClosureGap> {
    let middle_mm = median(differences_mm)?;
    let mut apart_mm: Vec<f64> = differences_mm.iter().map(|difference| (difference - middle_mm).abs()).collect();
    let limit_mm = CLOSURE_MAD_LIMIT * median(&mut apart_mm)?;
    let kept = || differences_mm.iter().filter(|difference| (*difference - middle_mm).abs() <= limit_mm);
    let (n_pairs, n) = (kept().count(), kept().count().max(1) as f64);
    Some(ClosureGap {
        n_pairs,
        bias_mm: kept().sum::<f64>() / n,
        rms_mm: (kept().map(|difference| difference * difference).sum::<f64>() / n).sqrt(),
        n_outliers: differences_mm.len() - n_pairs,
    })
}
