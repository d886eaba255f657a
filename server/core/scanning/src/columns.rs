//! The labelled lines of one frame, column by column (row by row): which orders they leave open for each other.

use vision::LineDirection;

use crate::label::along_across;
use crate::profile::ProfilePoint;

/// The labelled points of a frame by scan column (row).
pub struct FrameColumns {
    direction: LineDirection,
    /// Orders below and above those of the calibration.
    beyond: [i8; 2],
    /// Per column: (place across the lines in px, order), ascending.
    labelled: Vec<Vec<(f64, i8)>>,
}

impl FrameColumns {
    /// The columns of a frame's labelled points. `orders`: ascending.
    pub fn new(points: &[ProfilePoint], direction: LineDirection, orders: &[i8]) -> Self {
        let mut columns =
            Self { direction, beyond: [orders[0] - 1, orders[orders.len() - 1] + 1], labelled: Vec::new() };
        for point in points {
            let (along, across) = along_across(&point.seen, direction);
            column(&mut columns.labelled, along).push((across, point.order));
        }
        columns.labelled.iter_mut().for_each(|column| column.sort_by(|a, b| a.0.total_cmp(&b.0)));
        columns
    }

    /// Whether the labels above and below a labelled point leave it more than its own.
    pub fn leave_open(&self, point: &ProfilePoint) -> bool {
        let (along, across) = along_across(&point.seen, self.direction);
        let column = self.labelled.get(along.round() as usize).map_or(&[][..], Vec::as_slice);
        let place = column.partition_point(|other| other.0 < across);
        let above = place.checked_sub(1).map_or(self.beyond[0], |above| column[above].1);
        let below = column.get(place + 1).map_or(self.beyond[1], |below| below.1);
        below - above > 2
    }
}

fn column<T>(columns: &mut Vec<Vec<T>>, along: f64) -> &mut Vec<T> {
    let place = along.round().max(0.0) as usize;
    if columns.len() <= place {
        columns.resize_with(place + 1, Vec::new);
    }
    &mut columns[place]
}
