//! Identifies the corners of a partially visible board.
//!
//! The detected part is located on the board by the predicted positions of the undetected corners: these must lie
//! outside the image, or be few. Of all placements of the part on the board (the square beyond corner (0, 0) dark), one
//! must leave clearly fewer corners unexplained than every other; a part that fits at several positions, such as one
//! cut off on both sides, cannot be numbered. Boards that look the same after a rotation by 180° are numbered only when
//! complete: a part of them is ambiguous.

use std::collections::BTreeMap;

use super::lattice::{Lattice, Node};
use super::orientation::{Axes, full_lines, is_right_handed, rotated, starts_dark};
use crate::corners::fitting::fit::CornerFit;
use crate::corners::fitting::warp::BoardWarp;
use crate::corners::params::{
    PART_MARGIN_SQUARES, PART_MAX_UNEXPLAINED_FRACTION, PART_MIN_CORNERS, PART_MIN_FRACTION, PART_MIN_LINES,
    PART_RUNNER_UP_LINES,
};

/// Result of locating a part of a board.
pub enum PartialBoard {
    /// Corners with their (column, row), row by row.
    Numbered(Vec<([usize; 2], CornerFit)>),
    /// A part of the board at an unknown position.
    Ambiguous {
        /// Corners detected.
        found: usize,
    },
    /// Not a part of this board.
    Other,
}

/// One placement of the part on the board.
struct Placement {
    axes: Axes,
    /// Corners of the board that should be visible in the image but were not detected.
    unexplained: usize,
}

/// Locates the lattice on a board of `columns` × `rows` inner corners in an image of `size` (width, height).
pub fn read_partial_board(lattice: &Lattice, columns: usize, rows: usize, size: [usize; 2]) -> PartialBoard {
    let ((i0, i1), (j0, j1)) = (full_lines(&lattice.corners, |n| n.0), full_lines(&lattice.corners, |n| n.1));
    let full: BTreeMap<Node, CornerFit> = lattice
        .corners
        .iter()
        .filter(|(node, _)| (i0..=i1).contains(&node.0) && (j0..=j1).contains(&node.1))
        .map(|(node, fit)| (*node, *fit))
        .collect();
    // Corners beyond the well-filled lines are assumed to belong to the board, unless they do not fit on it.
    [&lattice.corners, &full]
        .into_iter()
        .map(|corners| read(corners, columns, rows, size))
        .find(|part| !matches!(part, PartialBoard::Other))
        .unwrap_or(PartialBoard::Other)
}

fn read(corners: &BTreeMap<Node, CornerFit>, columns: usize, rows: usize, size: [usize; 2]) -> PartialBoard {
    let found = corners.len();
    let n_lines = |of: fn(&Node) -> i32| corners.keys().map(of).collect::<std::collections::BTreeSet<_>>().len();
    let enough = found >= PART_MIN_CORNERS && found as f64 >= PART_MIN_FRACTION * (columns * rows) as f64;
    if !enough || n_lines(|n| n.0).min(n_lines(|n| n.1)) < PART_MIN_LINES {
        return PartialBoard::Other;
    }
    let mut placements = placements(corners, columns, rows, size);
    placements.sort_by_key(|placement| placement.unexplained);
    let Some(best) = placements.first() else { return PartialBoard::Other };
    if best.unexplained as f64 > PART_MAX_UNEXPLAINED_FRACTION * found as f64 {
        return PartialBoard::Other;
    }
    let clear = best.unexplained as f64 + PART_RUNNER_UP_LINES * columns.min(rows) as f64;
    let is_symmetric = (columns + rows).is_multiple_of(2);
    if is_symmetric || placements.get(1).is_some_and(|other| (other.unexplained as f64) < clear) {
        return PartialBoard::Ambiguous { found };
    }
    let number = |(node, fit): (&Node, &CornerFit)| {
        let [column, row] = best.axes.place(*node);
        ([column as usize, row as usize], rotated(fit, &best.axes))
    };
    let mut numbered: Vec<_> = corners.iter().map(number).collect();
    numbered.sort_by_key(|([column, row], _)| (*row, *column));
    PartialBoard::Numbered(numbered)
}

/// All placements of the corners on the board.
fn placements(
    corners: &BTreeMap<Node, CornerFit>,
    columns: usize,
    rows: usize,
    size: [usize; 2],
) -> Vec<Placement> {
    let pairs: Vec<_> =
        corners.iter().map(|((i, j), fit)| ([f64::from(*i), f64::from(*j)], fit.position_px)).collect();
    let Some(warp) = BoardWarp::plain(&pairs) else { return Vec::new() };
    let mut all = Vec::new();
    for by_column in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        for sign in [1, -1] {
            let axes = Axes { origin: (0, 0), by_column, by_row: (sign * by_column.1, sign * by_column.0) };
            if !is_right_handed(corners, &axes) {
                continue;
            }
            let range = |k: usize| {
                let places = corners.keys().map(|node| axes.place(*node)[k]);
                (places.clone().min().unwrap_or(0), places.max().unwrap_or(0))
            };
            let ((c0, c1), (r0, r1)) = (range(0), range(1));
            for column in (c1 + 1 - columns as i32)..=c0 {
                for row in (r1 + 1 - rows as i32)..=r0 {
                    let axes = Axes { origin: axes.node([column, row]), ..axes };
                    if starts_dark(corners, &axes) {
                        let unexplained = unexplained(corners, &axes, columns, rows, &warp, size);
                        all.push(Placement { axes, unexplained });
                    }
                }
            }
        }
    }
    all
}

/// Corners of the board that are not among `corners` although their position is in the image.
fn unexplained(
    corners: &BTreeMap<Node, CornerFit>,
    axes: &Axes,
    columns: usize,
    rows: usize,
    warp: &BoardWarp,
    size: [usize; 2],
) -> usize {
    let places = (0..rows as i32).flat_map(|row| (0..columns as i32).map(move |column| [column, row]));
    let is_inside = |(i, j): &Node| {
        let at = |i: i32, j: i32| warp.at([f64::from(i), f64::from(j)]);
        let here = at(*i, *j);
        let steps = [at(i + 1, *j), at(*i, j + 1)].map(|to| (to[0] - here[0]).hypot(to[1] - here[1]));
        let margin_px = PART_MARGIN_SQUARES * steps[0].max(steps[1]);
        (0..2).all(|k| here[k] > margin_px && here[k] < size[k] as f64 - 1.0 - margin_px)
    };
    places.map(|place| axes.node(place)).filter(|node| !corners.contains_key(node) && is_inside(node)).count()
}
