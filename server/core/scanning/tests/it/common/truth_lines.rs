//! Comparison of a cloud's points with the true lines of their images.

use std::collections::HashMap;

use scanning::CloudPoint;
use vision::LineDirection;

/// Distance from a true line within which a point is on it, px: at an edge the centre of a wide line is pulled aside,
/// and the next line is an order of magnitude farther away.
const ON_LINE_PX: f64 = 2.5;
/// Columns on either side in which a true line counts as well, since its end is not known to the pixel.
const MARGIN_COLUMNS: i64 = 4;

/// Between rays of one order farther apart than this, along the line or in depth, no true line is assumed.
const LINE_GAP_PX: f64 = 12.0;
/// See [`LINE_GAP_PX`].
const LINE_STEP_MM: f64 = 2.0;

/// A true centre of a line in one scan column (row).
#[derive(Debug, Clone, Copy)]
pub struct TruthLine {
    pub order: i8,
    /// Scan column (row).
    pub along: i64,
    /// Position across the lines, px.
    pub across_px: f64,
}

/// A true ray of light and the pixel of its hit.
#[derive(Debug, Clone, Copy)]
pub struct TrueRay {
    pub order: i8,
    pub along_px: f64,
    pub across_px: f64,
    /// Depth of the lit point in the camera frame.
    pub depth_mm: f64,
}

/// The true lines of a frame whose lines run along rows, column by column between close rays of one order.
pub fn lines_between(rays: &[TrueRay], width_px: usize) -> Vec<TruthLine> {
    let mut lines = Vec::new();
    for pair in rays.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let apart_px = b.along_px - a.along_px;
        let is_one_line = a.order == b.order
            && apart_px > 0.0
            && apart_px < LINE_GAP_PX
            && (a.depth_mm - b.depth_mm).abs() < LINE_STEP_MM;
        let mut u = a.along_px.ceil().max(0.0);
        while is_one_line && u < b.along_px.min(width_px as f64) {
            let share = (u - a.along_px) / apart_px;
            lines.push(TruthLine {
                order: a.order,
                along: u as i64,
                across_px: a.across_px + (b.across_px - a.across_px) * share,
            });
            u += 1.0;
        }
    }
    lines
}

/// Numbers of correct and wrong points of a cloud.
#[derive(Debug, Clone, Copy, Default)]
pub struct Score {
    /// True (line, column) of all frames.
    pub n_true: usize,
    /// Those where a point of the right order was found.
    pub n_found: usize,
    pub n_points: usize,
    /// Points on a line of another order, and not on one of their own.
    pub n_wrong: usize,
    /// Points on no line.
    pub n_astray: usize,
}

impl Score {
    pub fn recovered(&self) -> f64 {
        self.n_found as f64 / self.n_true as f64
    }

    pub fn wrong(&self) -> f64 {
        self.n_wrong as f64 / self.n_points as f64
    }

    pub fn add(&mut self, other: &Self) {
        self.n_true += other.n_true;
        self.n_found += other.n_found;
        self.n_points += other.n_points;
        self.n_wrong += other.n_wrong;
        self.n_astray += other.n_astray;
    }
}

impl std::fmt::Display for Score {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "recovered {:.2} %, wrong {} of {} ({:.4} %), astray {}",
            100.0 * self.recovered(),
            self.n_wrong,
            self.n_points,
            100.0 * self.wrong(),
            self.n_astray
        )
    }
}

/// Compares a cloud with the truth; with `EXPLAIN` set it prints the wrong points.
pub fn score(points: &[CloudPoint], truth: &[Vec<TruthLine>], direction: LineDirection) -> Score {
    let mut score = Score { n_points: points.len(), ..Score::default() };
    let place = |p: &CloudPoint| match direction {
        LineDirection::Rows => (p.u_px.round() as i64, f64::from(p.v_px)),
        LineDirection::Columns => (p.v_px.round() as i64, f64::from(p.u_px)),
    };
    let mut explained: Vec<(u32, i8, i8, i64, i64, f64)> = Vec::new();
    for (frame, lines) in truth.iter().enumerate() {
        let mut columns: HashMap<i64, Vec<&TruthLine>> = HashMap::new();
        lines.iter().for_each(|line| columns.entry(line.along).or_default().push(line));
        let of_frame: Vec<&CloudPoint> = points.iter().filter(|p| p.frame as usize == frame).collect();
        let mut found: HashMap<(i8, i64), Vec<f64>> = HashMap::new();
        for point in &of_frame {
            let (along, across) = place(point);
            found.entry((point.order, along)).or_default().push(across);
            let near = |line: &&&TruthLine| (line.across_px - across).abs() < ON_LINE_PX;
            let orders: Vec<i8> = (along - MARGIN_COLUMNS..=along + MARGIN_COLUMNS)
                .filter_map(|column| columns.get(&column))
                .flat_map(|lines| lines.iter().filter(near).map(|line| line.order))
                .collect();
            if orders.is_empty() {
                score.n_astray += 1;
            } else if !orders.contains(&point.order) {
                score.n_wrong += 1;
                match explained.last_mut() {
                    Some(run)
                        if (run.0, run.1, run.2) == (point.frame, point.order, orders[0])
                            && along - run.4 <= MARGIN_COLUMNS =>
                    {
                        run.4 = along;
                    }
                    _ => explained.push((point.frame, point.order, orders[0], along, along, across)),
                }
            }
        }
        score.n_true += lines.len();
        let is_found = |line: &&TruthLine| {
            let found = found.get(&(line.order, line.along));
            found.is_some_and(|found| found.iter().any(|across| (across - line.across_px).abs() < ON_LINE_PX))
        };
        score.n_found += lines.iter().filter(is_found).count();
    }
    if std::env::var_os("EXPLAIN").is_some() {
        for (frame, given, is, first, last, across) in explained {
            eprintln!("  frame {frame}: {given} given, {is} is true, {first}–{last}, at {across:.0}");
        }
    }
    score
}
