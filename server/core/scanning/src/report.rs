//! The report of a scan.

use crate::checks::compare::{Closure, OrderPair};
use crate::points::dropped::Dropped;
use crate::points::envelope::DepthEnvelope;

/// Results of a scan other than its points.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanReport {
    /// Points in the cloud.
    pub n_points: usize,
    /// Segments of lines in the input.
    pub n_segments: usize,
    /// Dropped points, by reason.
    pub dropped: Dropped,
    /// Per frame and segment: the order of its longest labelled piece.
    pub labels: Vec<Vec<Option<i8>>>,
    /// Agreement of pairs of orders on surfaces that both have observed.
    pub self_consistency: Vec<OrderPair>,
    /// Closure after a full turn; `None` if no point was observed again.
    pub closure: Option<Closure>,
    /// Depth range in which geometry alone determines the labels.
    pub envelope: DepthEnvelope,
}
