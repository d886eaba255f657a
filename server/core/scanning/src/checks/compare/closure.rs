//! How well the surfaces of a turn close: what was seen first against what was seen a turn later
//! (`docs/maths/turntable.md`, eq. 11).

use statistics::median;

use super::Surfaces;
use crate::params::{CLOSURE_MAD_LIMIT, COMPARE_STRIDE_PX};
use crate::points::profile::ProfilePoint;

/// How far apart a part's surface is after a whole turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureGap {
    /// Points of the later frames that lie on smooth surface seen a turn earlier.
    pub n_pairs: usize,
    /// Mean of later minus earlier, along the surface's normal towards the axis, mm.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included, mm.
    pub rms_mm: f64,
    /// Pairs left out as they are farther apart than all others.
    pub n_outliers: usize,
}

/// The closure of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closure {
    /// The same line before and after: slip of the table, drift, a part that has moved. Blind to the axis.
    pub same_line: Option<ClosureGap>,
    /// Another line, which looks at the place under another angle of the table: shows an error of the axis, too.
    pub other_lines: Option<ClosureGap>,
}

/// Differences of some frames.
#[derive(Debug, Clone, Default)]
pub struct ClosurePairs {
    same_line_mm: Vec<f64>,
    other_lines_mm: Vec<f64>,
}

impl ClosurePairs {
    /// Adds those of another frame.
    pub fn append(&mut self, mut other: Self) {
        self.same_line_mm.append(&mut other.same_line_mm);
        self.other_lines_mm.append(&mut other.other_lines_mm);
    }

    /// What they come to; `None` if no place was seen again after a turn.
    pub fn closure(mut self) -> Option<Closure> {
        let same_line = gap(&mut self.same_line_mm);
        let other_lines = gap(&mut self.other_lines_mm);
        (same_line.is_some() || other_lines.is_some()).then_some(Closure { same_line, other_lines })
    }
}

impl Surfaces<'_> {
    /// The points of one frame against the surfaces that were seen a turn earlier.
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

/// Without what a wrong label or an edge has put somewhere else altogether.
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
