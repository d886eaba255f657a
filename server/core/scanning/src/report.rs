//! The report of a scan: what it gave besides its points.

use crate::checks::compare::{Closure, OrderPair};
use crate::points::dropped::Dropped;
use crate::points::envelope::DepthEnvelope;

/// What a scan gave, besides its points.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanReport {
    /// Points in the cloud.
    pub n_points: usize,
    /// Segments of lines in the input.
    pub n_segments: usize,
    /// What was left out, and why.
    pub dropped: Dropped,
    /// Per frame and segment: the order most of its points were given.
    pub labels: Vec<Vec<Option<i8>>>,
    /// How well the orders agree where they have seen the same surface.
    pub self_consistency: Vec<OrderPair>,
    /// How well the surfaces of a turn close; `None` where no place was seen again after a turn.
    pub closure: Option<Closure>,
    /// Where geometry alone would have labelled.
    pub envelope: DepthEnvelope,
}
