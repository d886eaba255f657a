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
    /// What was left out, and why.
    pub dropped: Dropped,
    /// Per frame and segment: the order of most of its points.
    pub labels: Vec<Vec<Option<i8>>>,
    /// Agreement of the orders where they have observed the same surface.
    pub self_consistency: Vec<OrderPair>,
    /// Closure after a full turn; `None` where no place was observed again.
    pub closure: Option<Closure>,
    /// Depth range in which geometry alone determines the labels.
    pub envelope: DepthEnvelope,
}
