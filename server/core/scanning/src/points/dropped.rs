//! Points dropped from a scan, and the reasons.

/// Reason for which points are dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DropReason {
    /// The piece of line is too short to be labelled.
    TooShort,
    /// The camera ray misses the order's light sheet.
    NoHit,
    /// The point lies outside the depth range.
    OutsideDepth,
    /// Another order has about the same score.
    Doubtful,
    /// Every order is contradicted by other lines: a reflection or a ghost.
    Contradicted,
}

impl DropReason {
    /// All reasons.
    pub const ALL: [Self; 5] =
        [Self::TooShort, Self::NoHit, Self::OutsideDepth, Self::Doubtful, Self::Contradicted];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::TooShort => "too short",
            Self::NoHit => "no hit",
            Self::OutsideDepth => "outside depth range",
            Self::Doubtful => "doubtful order",
            Self::Contradicted => "contradicted",
        }
    }
}

/// Numbers of dropped points and pieces, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dropped {
    points: [usize; DropReason::ALL.len()],
    pieces: [usize; DropReason::ALL.len()],
}

impl Dropped {
    /// Points dropped for `reason`.
    pub fn n_points(&self, reason: DropReason) -> usize {
        self.points[reason as usize]
    }

    /// Whole pieces of lines dropped for `reason`; their points are counted as well.
    pub fn n_pieces(&self, reason: DropReason) -> usize {
        self.pieces[reason as usize]
    }

    /// Points dropped for any reason.
    pub fn total_points(&self) -> usize {
        self.points.iter().sum()
    }

    /// Counts single points.
    pub fn add_points(&mut self, reason: DropReason, n_points: usize) {
        self.points[reason as usize] += n_points;
    }

    /// Subtracts single points again.
    pub fn subtract_points(&mut self, reason: DropReason, n_points: usize) {
        self.points[reason as usize] -= n_points;
    }

    /// Counts a piece with all its points.
    pub fn add_piece(&mut self, reason: DropReason, n_points: usize) {
        self.pieces[reason as usize] += 1;
        self.points[reason as usize] += n_points;
    }

    /// Adds the counts of another frame.
    pub fn add(&mut self, other: &Self) {
        for idx in 0..DropReason::ALL.len() {
            self.points[idx] += other.points[idx];
            self.pieces[idx] += other.pieces[idx];
        }
    }
}
