//! The lines of one frame as lists of numbers.

use vision::{CentrelinePoint, Centrelines, LineDirection};

use super::super::pieces::Piece;

/// The points of a frame, all segments one after another.
#[derive(Debug, Default)]
pub struct Lines {
    /// Columns.
    pub u_px: Vec<f64>,
    /// Rows.
    pub v_px: Vec<f64>,
    /// Standard deviations across the line.
    pub sigma_px: Vec<f64>,
    /// Per segment: its first point in these lists; one more entry than segments.
    pub starts: Vec<usize>,
    /// Which way the lines run.
    pub direction: LineDirection,
}

impl Lines {
    /// Takes over the lines of a frame.
    pub fn take(&mut self, lines: &Centrelines) {
        let n = lines.segments.iter().map(|segment| segment.points.len()).sum();
        for list in [&mut self.u_px, &mut self.v_px, &mut self.sigma_px] {
            list.resize(n, 0.0);
        }
        self.starts.clear();
        self.starts.push(0);
        self.direction = lines.direction;
        let mut start = 0;
        for segment in &lines.segments {
            self.take_points(start, &segment.points);
            start += segment.points.len();
            self.starts.push(start);
        }
    }

    /// Takes over the points of a segment.
    fn take_points(&mut self, start: usize, points: &[CentrelinePoint]) {
        let n = points.len();
        let (u_px, v_px) = (&mut self.u_px[start..][..n], &mut self.v_px[start..][..n]);
        let sigma_px = &mut self.sigma_px[start..][..n];
        for (i, point) in points.iter().enumerate() {
            (u_px[i], v_px[i], sigma_px[i]) = (point.u_px, point.v_px, point.sigma_px);
        }
    }

    /// Positions along the lines.
    #[inline(always)]
    pub fn along(&self) -> &[f64] {
        match self.direction {
            LineDirection::Rows => &self.u_px,
            LineDirection::Columns => &self.v_px,
        }
    }

    /// Positions across the lines.
    #[inline(always)]
    pub fn across(&self) -> &[f64] {
        match self.direction {
            LineDirection::Rows => &self.v_px,
            LineDirection::Columns => &self.u_px,
        }
    }

    /// Indices of the points of a piece.
    #[inline(always)]
    pub fn range(&self, piece: &Piece) -> std::ops::Range<usize> {
        let start = self.starts[piece.segment];
        start + piece.first..start + piece.end
    }
}
