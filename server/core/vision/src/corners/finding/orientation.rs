//! Which of the lattice's corners belong to the board, and which of them is row 0, column 0.

use std::collections::BTreeMap;

use super::lattice::{Lattice, Node};
use crate::corners::fitting::fit::CornerFit;
use crate::corners::params::FULL_LINE_FRACTION;

/// The content of the lattice compared with the configured board.
pub enum Board {
    /// Every corner, row by row, with fits rotated to the board's axes.
    Whole(Vec<CornerFit>),
    /// The right size, but corners are hidden.
    Incomplete { found: usize },
    /// Another size: columns, rows.
    OtherSize { columns: usize, rows: usize },
}

/// A rotation (or mirror) of the lattice: board (column, row) = origin + column·`by_column` + row·`by_row`.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    pub origin: Node,
    pub by_column: Node,
    pub by_row: Node,
}

impl Axes {
    /// The node at (column, row).
    pub fn node(&self, [column, row]: [i32; 2]) -> Node {
        let (c, r) = (self.by_column, self.by_row);
        (self.origin.0 + column * c.0 + row * r.0, self.origin.1 + column * c.1 + row * r.1)
    }

    /// (Column, row) of a node.
    pub fn place(&self, node: Node) -> [i32; 2] {
        let from = (node.0 - self.origin.0, node.1 - self.origin.1);
        [self.by_column, self.by_row].map(|by| from.0 * by.0 + from.1 * by.1)
    }
}

/// Reads the lattice as a board of `columns` × `rows` inner corners.
pub fn read_board(lattice: &Lattice, columns: usize, rows: usize) -> Board {
    let corners = &lattice.corners;
    let ((i0, i1), (j0, j1)) = (full_lines(corners, |n| n.0), full_lines(corners, |n| n.1));
    let (ni, nj) = ((i1 - i0 + 1) as usize, (j1 - j0 + 1) as usize);
    let turns = orientations((i0, i1), (j0, j1), columns, rows);
    let right_handed: Vec<Axes> = turns.into_iter().filter(|axes| is_right_handed(corners, axes)).collect();
    if right_handed.is_empty() {
        let found = if (ni > nj) == (columns > rows) { (ni, nj) } else { (nj, ni) };
        return Board::OtherSize { columns: found.0, rows: found.1 };
    }
    let dark: Vec<Axes> = right_handed.iter().copied().filter(|axes| starts_dark(corners, axes)).collect();
    let candidates = if dark.is_empty() { right_handed } else { dark };
    let rightward = |axes: &Axes| column_direction(corners, axes);
    let Some(axes) = candidates.into_iter().max_by(|a, b| rightward(a).total_cmp(&rightward(b))) else {
        return Board::OtherSize { columns: ni, rows: nj };
    };
    gather(corners, &axes, columns, rows)
}

/// First and last line of the lattice, by the coordinate `of`, that has enough corners to belong to the board.
pub fn full_lines(corners: &BTreeMap<Node, CornerFit>, of: impl Fn(&Node) -> i32) -> (i32, i32) {
    let mut count = BTreeMap::<i32, usize>::new();
    for node in corners.keys() {
        *count.entry(of(node)).or_default() += 1;
    }
    let fullest = count.values().copied().max().unwrap_or(0) as f64;
    let full = count.iter().filter(|(_, n)| **n as f64 >= FULL_LINE_FRACTION * fullest).map(|(line, _)| *line);
    let lines: Vec<i32> = full.collect();
    (lines.first().copied().unwrap_or(0), lines.last().copied().unwrap_or(-1))
}

/// All rotations and mirrors under which the lattice rectangle has the configured size.
fn orientations((i0, i1): (i32, i32), (j0, j1): (i32, i32), columns: usize, rows: usize) -> Vec<Axes> {
    let (ni, nj) = ((i1 - i0 + 1) as usize, (j1 - j0 + 1) as usize);
    let mut all = Vec::new();
    for (i, di) in [(i0, 1), (i1, -1)] {
        for (j, dj) in [(j0, 1), (j1, -1)] {
            if (ni, nj) == (columns, rows) {
                all.push(Axes { origin: (i, j), by_column: (di, 0), by_row: (0, dj) });
            }
            if (nj, ni) == (columns, rows) {
                all.push(Axes { origin: (i, j), by_column: (0, dj), by_row: (di, 0) });
            }
        }
    }
    all
}

/// Mean step of the lattice along `axis` (px).
fn mean_step(corners: &BTreeMap<Node, CornerFit>, axis: Node) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for ((i, j), from) in corners {
        if let Some(to) = corners.get(&(i + axis.0, j + axis.1)) {
            sum[0] += to.position_px[0] - from.position_px[0];
            sum[1] += to.position_px[1] - from.position_px[1];
        }
    }
    sum
}

/// Whether columns × rows have the same handedness as u × v: the board is seen from its front.
pub fn is_right_handed(corners: &BTreeMap<Node, CornerFit>, axes: &Axes) -> bool {
    let (c, r) = (mean_step(corners, axes.by_column), mean_step(corners, axes.by_row));
    c[0] * r[1] - c[1] * r[0] > 0.0
}

/// Whether the square diagonally outside corner (0, 0) is dark, by majority of all corners.
pub fn starts_dark(corners: &BTreeMap<Node, CornerFit>, axes: &Axes) -> bool {
    let vote: f64 = corners.iter().map(|(node, fit)| step_parity(*node, axes) * rotated(fit, axes).contrast).sum();
    vote < 0.0
}

fn step_parity(node: Node, axes: &Axes) -> f64 {
    let steps = (node.0 - axes.origin.0) + (node.1 - axes.origin.1);
    if steps.rem_euclid(2) == 0 { 1.0 } else { -1.0 }
}

/// Cosine between the column direction and +u.
fn column_direction(corners: &BTreeMap<Node, CornerFit>, axes: &Axes) -> f64 {
    let step = mean_step(corners, axes.by_column);
    step[0] / step[0].hypot(step[1])
}

/// The fit with its edges and contrast expressed along the board's axes.
pub fn rotated(fit: &CornerFit, axes: &Axes) -> CornerFit {
    let signs = [axes.by_column.0 + axes.by_column.1, axes.by_row.0 + axes.by_row.1];
    let source = if axes.by_column.0 == 0 { [1, 0] } else { [0, 1] };
    let mut rotated = *fit;
    for k in 0..2 {
        let flip = if signs[k] < 0 { std::f64::consts::PI } else { 0.0 };
        rotated.shape.normal_rad[k] = fit.shape.normal_rad[source[k]] + flip;
        rotated.shape.curvature_per_px[k] = f64::from(signs[k]) * fit.shape.curvature_per_px[source[k]];
    }
    rotated.contrast = fit.contrast * f64::from(signs[0] * signs[1]);
    rotated
}

fn gather(corners: &BTreeMap<Node, CornerFit>, axes: &Axes, columns: usize, rows: usize) -> Board {
    let cells = (0..rows as i32).flat_map(|row| (0..columns as i32).map(move |column| (column, row)));
    let found: Vec<CornerFit> = cells
        .filter_map(|(column, row)| corners.get(&axes.node([column, row])))
        .map(|fit| rotated(fit, axes))
        .collect();
    if found.len() == columns * rows { Board::Whole(found) } else { Board::Incomplete { found: found.len() } }
}
