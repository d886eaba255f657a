//! What a target's pattern reflects: at points, averaged over small areas, and where its edges are.

use multiversion::multiversion;
use nalgebra::Vector2;

use crate::arithmetic::floor;
use crate::params::{BLACK_REFLECTANCE, WHITE_REFLECTANCE};
use crate::part::board::Board;
use crate::part::print::Print;

/// Averages of a pattern over small areas.
pub(crate) struct Averages<const N: usize> {
    /// Reflectance of the board.
    pub reflectance: [f64; N],
    /// Fraction covered by the board, the rest being backdrop.
    pub board: [f64; N],
}

/// Small parallelograms: their centres, and the lengths that each spans along x and y, mm.
struct Areas<const N: usize> {
    x: [f64; N],
    y: [f64; N],
    span: [f64; 2],
}

/// Lengths along x and y, mm, and inner lines, of a pattern of squares.
struct Squares {
    half: [f64; 2],
    side: [f64; 2],
    lines: [f64; 2],
}

impl Board {
    /// Reflectance at a point of the board.
    pub(crate) fn reflectance(&self, at: &Vector2<f64>) -> f64 {
        let Averages { reflectance: [mean], .. } = self.averages(&[*at], &Vector2::repeat(f64::MIN_POSITIVE));
        if mean < (BLACK_REFLECTANCE + WHITE_REFLECTANCE) / 2.0 { BLACK_REFLECTANCE } else { WHITE_REFLECTANCE }
    }

    /// Averages over small parallelograms around points within a pixel, each of which spans `span` along x and y (mm);
    /// each edge is blurred as if it were the only one.
    ///
    /// The averages are odd about every edge and every corner, so that neither moves.
    pub(crate) fn averages<const N: usize>(&self, at: &[Vector2<f64>; N], span: &Vector2<f64>) -> Averages<N> {
        let areas = Areas { x: at.map(|at| at.x), y: at.map(|at| at.y), span: (*span).into() };
        let squares = Squares {
            half: self.half_mm().into(),
            side: self.square_mm.into(),
            lines: [self.inner_columns as f64, self.inner_rows as f64],
        };
        let black = match &self.print {
            Print::Squares => black_by_squares(&squares, &areas),
            Print::Markers(markers) => {
                let (mut black, cells) = (black_by_squares(&squares, &areas), span.component_div(&self.square_mm));
                for (black, at) in black.iter_mut().zip(at) {
                    *black += markers.black_fraction(&self.in_squares(at), &cells);
                }
                black
            }
            // One disc is the nearest to a whole pixel, but for pixels half-way between two.
            Print::Discs { diameter_mm, .. } => {
                black_by_disc(self.nearest_disc_mm(&at[0]).into(), diameter_mm / 2.0, &areas)
            }
        };
        Averages {
            reflectance: black.map(|black| WHITE_REFLECTANCE + (BLACK_REFLECTANCE - WHITE_REFLECTANCE) * black),
            board: on_board(&squares, &areas),
        }
    }

    /// Whether an edge passes within `margin` of a point (both along x and y, mm).
    pub(crate) fn edge_within(&self, at: &Vector2<f64>, margin: &Vector2<f64>) -> bool {
        let outside = at.abs() - self.half_mm();
        if (0..2).any(|axis| (outside[axis] - self.square_mm[axis]).abs() < margin[axis]) {
            return true;
        }
        match &self.print {
            Print::Discs { diameter_mm, .. } => {
                ((at - self.nearest_disc_mm(at)).norm() - diameter_mm / 2.0).abs() < margin.norm()
            }
            Print::Squares => self.square_edge_within(at, margin),
            Print::Markers(markers) => {
                let squares = margin.component_div(&self.square_mm);
                self.square_edge_within(at, margin) || markers.is_near(&self.in_squares(at), &squares)
            }
        }
    }

    fn square_edge_within(&self, at: &Vector2<f64>, margin: &Vector2<f64>) -> bool {
        let cells = self.in_squares(at);
        (0..2).any(|axis| {
            let beyond = at[axis].abs() - self.half_mm()[axis];
            let phase = cells[axis] - cells[axis] as i64 as f64;
            let to_line = if beyond > 0.0 { beyond } else { phase.min(1.0 - phase) * self.square_mm[axis] };
            to_line < margin[axis]
        })
    }

    /// A point in squares from the top left of the pattern.
    fn in_squares(&self, at: &Vector2<f64>) -> Vector2<f64> {
        (at + self.half_mm()).component_div(&self.square_mm)
    }

    /// Centre of the disc that is nearest to a point, mm.
    fn nearest_disc_mm(&self, at: &Vector2<f64>) -> Vector2<f64> {
        let along_row = self.print.steps_along_row() as f64;
        let steps = at.component_div(&self.square_mm) + (self.extent_steps().add_scalar(-1.0)) / 2.0;
        let in_row = |row: f64| {
            let row = row.clamp(0.0, self.inner_rows as f64 - 1.0);
            let first = row - along_row * floor(row / along_row);
            let column = floor((steps.x - first) / along_row + 0.5).clamp(0.0, self.inner_columns as f64 - 1.0);
            self.place_mm(&Vector2::new(first + along_row * column, row))
        };
        let (above, below) = (in_row(floor(steps.y)), in_row(floor(steps.y) + 1.0));
        if (at - above).norm_squared() < (at - below).norm_squared() { above } else { below }
    }
}

/// Fractions of areas that are covered by black squares.
#[multiversion(targets("x86_64+avx2"))]
fn black_by_squares<const N: usize>(squares: &Squares, areas: &Areas<N>) -> [f64; N] {
    let (mut parity, mut inside) = ([1.0; N], [1.0; N]);
    for (axis, at) in [&areas.x, &areas.y].into_iter().enumerate() {
        let (half, side, lines, span) =
            (squares.half[axis], squares.side[axis], squares.lines[axis], areas.span[axis]);
        for idx in 0..N {
            // The nearest inner line; the first or last one for points outside.
            let line = floor((at[idx] + half) / side + 0.5).max(1.0).min(lines);
            let beyond = 2.0 * step(at[idx] + half - line * side, span) - 1.0;
            parity[idx] *= if line - 2.0 * floor(line / 2.0) < 0.5 { beyond } else { -beyond };
            inside[idx] *= step(half - at[idx].abs(), span);
        }
    }
    for idx in 0..N {
        inside[idx] *= (1.0 + parity[idx]) / 2.0;
    }
    inside
}

/// Fractions of areas that are covered by a black disc.
#[multiversion(targets("x86_64+avx2"))]
fn black_by_disc<const N: usize>(centre: [f64; 2], radius_mm: f64, areas: &Areas<N>) -> [f64; N] {
    let mut black = [0.0; N];
    for (idx, black) in black.iter_mut().enumerate() {
        let [x, y] = [areas.x[idx] - centre[0], areas.y[idx] - centre[1]];
        let distance = (x * x + y * y).sqrt().max(f64::MIN_POSITIVE);
        *black = step(radius_mm - distance, (x.abs() * areas.span[0] + y.abs() * areas.span[1]) / distance);
    }
    black
}

/// Fractions of areas that are covered by the pattern or its margin of one square.
#[multiversion(targets("x86_64+avx2"))]
fn on_board<const N: usize>(squares: &Squares, areas: &Areas<N>) -> [f64; N] {
    let edge = [0, 1].map(|axis| squares.half[axis] + squares.side[axis]);
    let mut covered = [0.0; N];
    for (idx, covered) in covered.iter_mut().enumerate() {
        let [right, down] = [edge[0] - areas.x[idx].abs(), edge[1] - areas.y[idx].abs()];
        *covered = step(right, areas.span[0]) * step(down, areas.span[1]);
    }
    covered
}

/// An edge averaged over `span`: 0 before it, 1 behind it.
#[inline(always)]
fn step(distance: f64, span: f64) -> f64 {
    (distance / span + 0.5).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use capture::{CharucoTarget, ChessboardTarget, CirclesTarget, Target};

    use super::*;

    fn board() -> Board {
        Board::of(&ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() }.into())
    }

    #[test]
    fn the_blurred_pattern_agrees_with_the_sharp_one_away_from_edges() {
        let (board, span) = (board(), Vector2::new(0.2, 0.2));
        for (x, y) in
            [(-66.0, -48.0), (-66.0, -36.0), (66.0, 48.0), (5.0, 1.0), (-77.0, 3.0), (1.0, 60.0), (61.0, -47.0)]
        {
            let at = Vector2::new(x, y);
            assert!(!board.edge_within(&at, &span));
            let Averages { reflectance: [reflectance], board: [fraction] } = board.averages(&[at], &span);
            assert!((reflectance - board.reflectance(&at)).abs() < 1e-12 && fraction == 1.0, "{x} {y}");
        }
    }

    #[test]
    fn the_first_square_is_black() {
        assert_eq!(board().reflectance(&Vector2::new(-66.0, -48.0)), BLACK_REFLECTANCE);
        assert_eq!(board().reflectance(&Vector2::new(-54.0, -48.0)), WHITE_REFLECTANCE);
    }

    #[test]
    fn every_edge_of_every_pattern_is_detected() {
        let sides = capture::SquareMm { x_mm: 12.0, y_mm: 13.0 };
        let grid = CirclesTarget { columns: 4, rows: 11, square_mm: sides, diameter_mm: 9.0 };
        let dictionary = "DICT_4X4_50".to_owned();
        let markers = CharucoTarget { columns: 8, rows: 6, square_mm: sides, marker_mm: 8.0, dictionary };
        for target in [
            Target::Circles(grid.clone()),
            Target::AsymmetricCircles(grid),
            Target::Charuco(markers),
            ChessboardTarget { inner_columns: 7, inner_rows: 5, square_mm: sides }.into(),
        ] {
            let (board, span) = (Board::of(&target), Vector2::new(0.2, 0.3));
            let edge = board.half_mm() + board.square_mm + Vector2::repeat(1.0);
            let mut n_edges = 0;
            for (x, y) in (-200..200).flat_map(|x| (-200..200).map(move |y| (x, y))) {
                let at = Vector2::new(f64::from(x) / 200.0 * edge.x, f64::from(y) / 200.0 * edge.y);
                let Averages { reflectance: [blurred], board: [fraction] } = board.averages(&[at], &span);
                let is_plain =
                    [BLACK_REFLECTANCE, WHITE_REFLECTANCE].iter().any(|one| (blurred - one).abs() < 1e-12);
                let is_mixed = !is_plain || (fraction != 0.0 && fraction != 1.0);
                n_edges += usize::from(is_mixed);
                assert!(!is_mixed || board.edge_within(&at, &span), "{target:?} {at}");
            }
            assert!(n_edges > 500, "{target:?} {n_edges}");
        }
    }

    #[test]
    fn discs_are_black_around_their_centres_and_nowhere_else() {
        for staggered in [false, true] {
            let grid = CirclesTarget { columns: 4, rows: 5, square_mm: 15.0.into(), diameter_mm: 10.0 };
            let target = if staggered { Target::AsymmetricCircles(grid) } else { Target::Circles(grid) };
            let board = Board::of(&target);
            for (column, row) in (0..4).flat_map(|column| (0..5).map(move |row| (column, row))) {
                let centre = board.corner_mm(column, row).xy();
                assert_eq!(board.reflectance(&(centre + Vector2::new(3.4, 3.4))), BLACK_REFLECTANCE);
                assert_eq!(board.reflectance(&(centre + Vector2::new(-3.6, 3.6))), WHITE_REFLECTANCE);
                let rim = centre + Vector2::new(0.0, 5.0);
                let Averages { reflectance: [half], .. } = board.averages(&[rim], &Vector2::repeat(0.1));
                assert!((half - (BLACK_REFLECTANCE + WHITE_REFLECTANCE) / 2.0).abs() < 1e-9, "{half}");
            }
        }
    }
}
