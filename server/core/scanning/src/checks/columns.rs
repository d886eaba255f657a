//! The labelled lines of one frame, column by column (row by row), and the orders that they admit between them.

/// A labelled point of a column: position across the lines in px, order, whether another order has observed its
/// surface.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Crossing {
    across_px: f64,
    order: i8,
    is_confirmed: bool,
}

/// The labelled points of a frame by scan column (row).
pub struct FrameColumns {
    /// The order below the lowest and the one above the highest order of the calibration.
    beyond: [i8; 2],
    /// Per column, ascending.
    labelled: Vec<Vec<Crossing>>,
}

impl FrameColumns {
    /// The columns of a frame's labelled points: (scan column (row), position across the lines in px, order), whether
    /// another order has observed its surface. `orders`: ascending.
    pub fn new(points: impl Iterator<Item = ((f64, f64, i8), bool)>, orders: &[i8]) -> Self {
        let mut labelled = Vec::new();
        points.for_each(|((along, across_px, order), is_confirmed)| {
            column(&mut labelled, along).push(Crossing { across_px, order, is_confirmed });
        });
        labelled.iter_mut().for_each(|column| column.sort_by(|a, b| a.across_px.total_cmp(&b.across_px)));
        Self { beyond: [orders[0] - 1, orders[orders.len() - 1] + 1], labelled }
    }

    /// Whether the labels above and below a labelled point admit another order than its own.
    pub fn admit_another(&self, along: f64, across: f64) -> bool {
        let [above, below] = self.around(along, across);
        below.order - above.order > 2
    }

    /// Whether the labels above and below a position admit this order.
    pub fn admit(&self, along: f64, across: f64, order: i8) -> bool {
        let [above, below] = self.around(along, across);
        above.order < order && order < below.order
    }

    /// Whether they admit this order alone, and other orders have observed the surfaces of both neighbours.
    pub fn admit_only(&self, along: f64, across: f64, order: i8) -> bool {
        let [above, below] = self.around(along, across);
        above.order + 1 == order && order + 1 == below.order && above.is_confirmed && below.is_confirmed
    }

    /// Whether there is a point of this order at this position.
    pub fn contain(&self, along: f64, across: f64, order: i8) -> bool {
        self.column(along).iter().any(|other| (other.across_px, other.order) == (across, order))
    }

    /// The neighbours of a position in its column; beyond the outermost orders there are none.
    fn around(&self, along: f64, across: f64) -> [Crossing; 2] {
        let column = self.column(along);
        let beyond = self.beyond.map(|order| Crossing { across_px: across, order, is_confirmed: true });
        let above = column.partition_point(|other| other.across_px < across);
        let below = column.partition_point(|other| other.across_px <= across);
        [
            above.checked_sub(1).map_or(beyond[0], |above| column[above]),
            column.get(below).copied().unwrap_or(beyond[1]),
        ]
    }

    fn column(&self, along: f64) -> &[Crossing] {
        self.labelled.get(along.round() as usize).map_or(&[][..], Vec::as_slice)
    }
}

/// Positions of a frame's lines, column by column (row by row).
pub struct LineColumns(Vec<Vec<f64>>);

impl LineColumns {
    /// The columns of points: scan column (row), position across the lines in px.
    pub fn new(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut columns = Vec::new();
        points.for_each(|(along, across_px)| column(&mut columns, along).push(across_px));
        Self(columns)
    }

    /// Whether a line has a point at this position.
    pub fn contain(&self, along: f64, across: f64) -> bool {
        self.column(along).contains(&across)
    }

    /// The next point of a line after a position (scan column (row), position across the lines): at most
    /// `reach_columns` columns ahead (behind if negative) and `reach_px` away across the lines.
    pub fn next(&self, (along, across): (f64, f64), reach_columns: i64, reach_px: f64) -> Option<(f64, f64)> {
        (1..=reach_columns.abs()).find_map(|step| {
            let there = along.round() + (step * reach_columns.signum()) as f64;
            let near = self.column(there).iter().find(|other| (**other - across).abs() <= reach_px)?;
            Some((there, *near))
        })
    }

    fn column(&self, along: f64) -> &[f64] {
        let place = if along < 0.0 { usize::MAX } else { along.round() as usize };
        self.0.get(place).map_or(&[], Vec::as_slice)
    }
}

fn column<T>(columns: &mut Vec<Vec<T>>, along: f64) -> &mut Vec<T> {
    let place = along.round().max(0.0) as usize;
    if columns.len() <= place {
        columns.resize_with(place + 1, Vec::new);
    }
    &mut columns[place]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orders −1 … 2, of which 0 and 2 have a line in column 7; only the surface of order 0 was observed by another
    /// order.
    fn columns() -> FrameColumns {
        FrameColumns::new([((7.2, 100.0, 0), true), ((6.9, 300.0, 2), false)].into_iter(), &[-1, 0, 1, 2])
    }

    #[test]
    fn lines_above_and_below_admit_the_orders_between_them() {
        let columns = columns();
        assert!(columns.admit(7.0, 200.0, 1) && !columns.admit(7.0, 200.0, 2));
        assert!(columns.admit(7.0, 50.0, -1) && !columns.admit(7.0, 350.0, 2));
        assert!(columns.admit_another(7.2, 100.0), "−1 could be above, 1 below");
        assert!(columns.contain(7.0, 100.0, 0) && !columns.contain(7.0, 100.0, 1));
    }

    #[test]
    fn only_confirmed_lines_admit_a_single_order() {
        let columns = columns();
        assert!(columns.admit_only(7.0, 50.0, -1), "beyond the outermost order there is none");
        assert!(!columns.admit_only(7.0, 200.0, 1), "the surface of order 2 was not observed again");
        assert!(!columns.admit_only(8.0, 200.0, 1), "an empty column");
    }

    #[test]
    fn a_line_continues_across_a_short_gap() {
        let lines = LineColumns::new([(7.0, 100.0), (12.0, 101.0), (13.0, 400.0)].into_iter());
        assert_eq!(lines.next((7.0, 100.0), 8, 2.5), Some((12.0, 101.0)));
        assert_eq!(lines.next((12.0, 101.0), -8, 2.5), Some((7.0, 100.0)));
        assert_eq!(lines.next((7.0, 100.0), 4, 2.5), None);
        assert_eq!(lines.next((12.0, 101.0), 8, 2.5), None);
        assert!(lines.contain(13.0, 400.0) && !lines.contain(13.0, 101.0));
    }
}
