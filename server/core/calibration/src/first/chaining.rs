//! Joins the pieces of one line across the dark squares and edges between them.
//!
//! On a board the lit curves are nearly straight and never cross, so two pieces belong together if the extrapolation of
//! each meets the other. Whole lines can be ranked even if single columns contain too few of them.

use nalgebra::Vector2;
use vision::LineDirection;

use crate::first::board_lines::BoardPiece;
use crate::params::{JOIN_END_POINTS, JOIN_MAX_GAP_LENGTHS, JOIN_TOLERANCE_PITCHES, MIN_LINE_COLUMNS};

/// Joins the pieces of one image to whole lines and applies the lines' labels to all their pieces; where no piece has
/// a label and there are as many lines as orders, their ranks are the labels. Returns the lines from the top (left),
/// each as indices of its pieces. `pitch_px`: distance between neighbouring lines of the image.
pub fn label_whole_lines(
    pieces: &mut [BoardPiece],
    orders: &[i8],
    line_direction: LineDirection,
    pitch_px: f64,
) -> Vec<Vec<usize>> {
    let ends: Vec<Ends> = pieces.iter().map(|piece| Ends::of(piece, line_direction)).collect();
    let mut lines = joined(&ends, JOIN_TOLERANCE_PITCHES * pitch_px);
    lines.retain(|line| line.iter().map(|&idx| pieces[idx].points.len()).sum::<usize>() >= MIN_LINE_COLUMNS);
    lines.sort_by(|a, b| height(a, &ends).total_cmp(&height(b, &ends)));
    let voted: Vec<Option<i8>> = lines.iter().map(|line| common_label(line, pieces)).collect();
    let whole = lines.len() == orders.len() && run_side_by_side(&lines, &ends);
    let ranked = if voted.iter().all(Option::is_none) && whole {
        orders.iter().map(|order| Some(*order)).collect()
    } else {
        voted
    };
    for (line, order) in lines.iter().zip(ranked) {
        for &idx in line {
            pieces[idx].order = order;
        }
    }
    lines
}

/// Whether all lines cross a common column: otherwise two of them may be unjoined parts of one line.
fn run_side_by_side(lines: &[Vec<usize>], ends: &[Ends]) -> bool {
    let start = |line: &Vec<usize>| line.iter().map(|&idx| ends[idx].start).fold(f64::INFINITY, f64::min);
    let end = |line: &Vec<usize>| line.iter().map(|&idx| ends[idx].end).fold(f64::NEG_INFINITY, f64::max);
    lines.iter().map(start).fold(f64::NEG_INFINITY, f64::max)
        <= lines.iter().map(end).fold(f64::INFINITY, f64::min)
}

/// Start and end of a piece, with the slopes there.
struct Ends {
    /// Range along the line.
    start: f64,
    end: f64,
    first: Vector2<f64>,
    last: Vector2<f64>,
    slope_at_first: f64,
    slope_at_last: f64,
}

impl Ends {
    fn of(piece: &BoardPiece, line_direction: LineDirection) -> Self {
        let points: Vec<Vector2<f64>> = piece
            .points
            .iter()
            .map(|point| {
                let (along, across) = point.along_across(line_direction);
                Vector2::new(along, across)
            })
            .collect();
        let n = points.len().min(JOIN_END_POINTS);
        let (head, tail) = (&points[..n], &points[points.len() - n..]);
        Self {
            start: points.first().map_or(0.0, |p| p.x),
            end: points.last().map_or(0.0, |p| p.x),
            first: centre(head),
            last: centre(tail),
            slope_at_first: slope(head),
            slope_at_last: slope(tail),
        }
    }

    /// Distance between the straight continuations of two pieces in the middle of the gap, px; `None` if
    /// `next` does not follow or the gap is too long for an extrapolation.
    fn mismatch(&self, next: &Self) -> Option<f64> {
        let gap = next.start - self.end;
        let lengths = (self.end - self.start) + (next.end - next.start);
        if gap <= 0.0 || gap > JOIN_MAX_GAP_LENGTHS * lengths {
            return None;
        }
        let middle = (self.end + next.start) / 2.0;
        let forward = self.last.y + self.slope_at_last * (middle - self.last.x);
        let backward = next.first.y + next.slope_at_first * (middle - next.first.x);
        Some((forward - backward).abs())
    }
}

fn centre(points: &[Vector2<f64>]) -> Vector2<f64> {
    points.iter().sum::<Vector2<f64>>() / points.len().max(1) as f64
}

/// Least-squares slope across over along; 0 for a single point.
fn slope(points: &[Vector2<f64>]) -> f64 {
    let middle = centre(points);
    let spread: f64 = points.iter().map(|p| (p.x - middle.x).powi(2)).sum();
    if spread <= 0.0 {
        return 0.0;
    }
    points.iter().map(|p| (p.x - middle.x) * (p.y - middle.y)).sum::<f64>() / spread
}

/// Groups of pieces, each piece joined to the nearest following one that its extrapolation meets within `tolerance_px`.
fn joined(ends: &[Ends], tolerance_px: f64) -> Vec<Vec<usize>> {
    let mut line_of: Vec<usize> = (0..ends.len()).collect();
    for (idx, piece) in ends.iter().enumerate() {
        let follower = ends
            .iter()
            .enumerate()
            .filter_map(|(other, next)| Some((other, next.first.x, piece.mismatch(next)?)))
            .filter(|(_, _, mismatch)| *mismatch <= tolerance_px)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((other, _, _)) = follower {
            let (kept, merged) = (line_of[idx].min(line_of[other]), line_of[idx].max(line_of[other]));
            for line in &mut line_of {
                if *line == merged {
                    *line = kept;
                }
            }
        }
    }
    let mut lines: std::collections::BTreeMap<usize, Vec<usize>> = std::collections::BTreeMap::new();
    for (idx, line) in line_of.into_iter().enumerate() {
        lines.entry(line).or_default().push(idx);
    }
    lines.into_values().collect()
}

/// The common label of all labelled pieces of a line.
fn common_label(line: &[usize], pieces: &[BoardPiece]) -> Option<i8> {
    let mut labels: Vec<i8> = line.iter().filter_map(|&idx| pieces[idx].order).collect();
    labels.dedup();
    (labels.len() == 1).then(|| labels[0])
}

/// Mean position of a line across the lines, for ranking.
fn height(line: &[usize], ends: &[Ends]) -> f64 {
    // Lines are nearly parallel but may start in different columns: each is extrapolated to column 0 along its own
    // slope.
    let (first, last) = line.iter().fold((line[0], line[0]), |(first, last), &idx| {
        let first = if ends[idx].first.x < ends[first].first.x { idx } else { first };
        (first, if ends[idx].last.x > ends[last].last.x { idx } else { last })
    });
    let (from, to) = (ends[first].first, ends[last].last);
    let rise = if to.x > from.x { (to.y - from.y) / (to.x - from.x) } else { ends[first].slope_at_first };
    (from.y + to.y) / 2.0 - rise * (from.x + to.x) / 2.0
}
