//! The lines of one frame as lists of numbers.

use vision::{CentrelinePoint, Centrelines, LineDirection};

use super::super::pieces::{self, Piece};

/// Balance a point beyond which no rounding decides which way the lines run.
const LEAST_BALANCE: f64 = 1e-6;

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
        let (mut start, mut balance) = (0, 0.0);
        for segment in &lines.segments {
            balance += self.take_points(start, &segment.points);
            start += segment.points.len();
            self.starts.push(start);
        }
        // Sums in another sequence differ in their last bits, which decide nothing unless lines run askew.
        let is_clear = balance.abs() > LEAST_BALANCE * n as f64;
        self.direction = pieces::line_direction(if is_clear { balance } else { pieces::line_balance(lines) });
    }

    /// Takes over the points of a segment; returns their balance as [`pieces::line_balance`] defines it.
    fn take_points(&mut self, start: usize, points: &[CentrelinePoint]) -> f64 {
        let n = points.len();
        let (u_px, v_px) = (&mut self.u_px[start..][..n], &mut self.v_px[start..][..n]);
        let sigma_px = &mut self.sigma_px[start..][..n];
        // Numbers are waited for while those before them are added up.
        let mut balances = [0.0; 4];
        for four in 0..n / 4 {
            for (lane, i) in (4 * four..4 * four + 4).enumerate() {
                let point = &points[i];
                (u_px[i], v_px[i], sigma_px[i]) = (point.u_px, point.v_px, point.sigma_px);
                balances[lane] += point.normal[1].abs() - point.normal[0].abs();
            }
        }
        for i in n / 4 * 4..n {
            let point = &points[i];
            (u_px[i], v_px[i], sigma_px[i]) = (point.u_px, point.v_px, point.sigma_px);
            balances[0] += point.normal[1].abs() - point.normal[0].abs();
        }
        (balances[0] + balances[1]) + (balances[2] + balances[3])
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

#[cfg(test)]
mod tests {
    use vision::Segment;

    use super::*;

    #[test]
    fn lines_askew_run_the_way_the_reference_says() {
        let point = |normal: [f64; 2]| CentrelinePoint {
            u_px: 0.0,
            v_px: 0.0,
            normal,
            sigma_px: 0.1,
            intensity: 0.0,
            width_px: 0.0,
            saturated: false,
        };
        let mut n_columns = 0;
        for n_points in 2..300 {
            // As many normals to one side as to the other: what is left is rounding.
            let normals = (0..n_points).map(|idx| (0.3 + 0.01 * f64::from(idx)).sin_cos());
            let there = normals.clone().map(|(x, y)| point([x, y]));
            let points = there.chain(normals.map(|(x, y)| point([y, x]))).collect();
            let centrelines = Centrelines { segments: vec![Segment { points }], ..Centrelines::default() };
            let mut lines = Lines::default();
            lines.take(&centrelines);
            let expected = pieces::line_direction(pieces::line_balance(&centrelines));
            assert_eq!(lines.direction, expected, "{n_points} points");
            n_columns += usize::from(expected == LineDirection::Columns);
        }
        assert!((50..250).contains(&n_columns), "{n_columns} of 298 run along columns");
    }
}
