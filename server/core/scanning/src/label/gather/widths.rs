//! Line widths as evidence for depth and so for the order: lines out of focus are wider.

use optics::DepthRangeMm;

use super::evidence::Evidence;
use super::hypotheses::Samples;
use crate::input::line_widths::{Label, LineWidths, Sample};
use crate::label::pieces::Piece;
use crate::label::sample_weight;
use crate::params::{WIDTH_COST, WIDTH_FITS_SIGMAS};

/// The model of a scan's line widths, fitted to all samples under the labels of their pieces.
pub fn learned(samples: &Samples, labels: &[usize], orders: &[i8], depths: DepthRangeMm) -> LineWidths {
    let known = samples.all.iter().enumerate().filter_map(|(idx, sample)| {
        let label = labels[sample.piece];
        let depth_mm = samples.by_order(idx).get(label)?.as_ref()?.depth_mm;
        Some(Sample { label: Label { order: orders[label], depth_mm }, log_width: sample.log_width })
    });
    LineWidths::of(&known.collect::<Vec<_>>(), orders, depths)
}

/// Adds a cost to every label whose depth does not fit the line's width, if another label's does.
pub fn add_widths(
    evidence: &mut Evidence,
    samples: &Samples,
    pieces: &[Piece],
    (widths, orders): (&LineWidths, &[i8]),
) {
    for (idx, sample) in samples.all.iter().enumerate() {
        let off_by = |(label, order): (usize, &i8)| {
            let depth_mm = samples.by_order(idx)[label].as_ref()?.depth_mm;
            widths.sigmas_off(sample.log_width, Label { order: *order, depth_mm })
        };
        let off: Vec<Option<f64>> = orders.iter().enumerate().map(off_by).collect();
        let least = off.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        for (label, off) in off.iter().enumerate() {
            let Some(off) = off else { continue };
            let share = (off / least.max(WIDTH_FITS_SIGMAS) - 1.0).clamp(0.0, 1.0);
            let weight = sample_weight(&pieces[sample.piece]);
            evidence.add_unary(sample.piece, label, -WIDTH_COST * share * weight);
        }
    }
}
