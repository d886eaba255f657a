//! The labelled lines of one frame, column by column (row by row): which orders they leave open for each other.

/// The labelled points of a frame by scan column (row).
pub struct FrameColumns {
    /// Orders below and above those of the calibration.
    beyond: [i8; 2],
    /// Per column: (place across the lines in px, order), ascending.
    labelled: Vec<Vec<(f64, i8)>>,
}

impl FrameColumns {
    /// The columns of a frame's labelled points: scan column (row), place across the lines in px, order. `orders`: ascending.
    pub fn new(points: impl Iterator<Item = (f64, f64, i8)>, orders: &[i8]) -> Self {
        let mut labelled = Vec::new();
        points.for_each(|(along, across, order)| column(&mut labelled, along).push((across, order)));
        labelled.iter_mut().for_each(|column| column.sort_by(|a, b| a.0.total_cmp(&b.0)));
        Self { beyond: [orders[0] - 1, orders[orders.len() - 1] + 1], labelled }
    }

    /// Whether the labels above and below a labelled point leave it more than its own.
    pub fn leave_open(&self, along: f64, across: f64) -> bool {
        let column = self.labelled.get(along.round() as usize).map_or(&[][..], Vec::as_slice);
        let place = column.partition_point(|other| other.0 < across);
        let above = place.checked_sub(1).map_or(self.beyond[0], |above| column[above].1);
        let below = column.get(place + 1).map_or(self.beyond[1], |below| below.1);
        below - above > 2
    }
}

fn column(columns: &mut Vec<Vec<(f64, i8)>>, along: f64) -> &mut Vec<(f64, i8)> {
    let place = along.round().max(0.0) as usize;
    if columns.len() <= place {
        columns.resize_with(place + 1, Vec::new);
    }
    &mut columns[place]
}
