//! Where a part of triangles surely stands between the light and its plate.
//!
//! Seen from above, take all edges that an odd number of triangles share: the part's open edges. Where a way over the
//! plate crosses none, the number of triangles above it stays odd or stays even. And a ray that comes down from above
//! all triangles to the plate over such places alone meets an odd number of them where that number is odd: the
//! upright surface between the ray and the vertical through its end is not pierced by an open edge, so what enters it
//! leaves it. An odd number is not none.
//!
//! Take more edges: all that not just two triangles share, one to either side. Where a way crosses none of those, the
//! number itself stays the same. Where it is one, the part is a height over the plate; where that is nowhere steeper than
//! some slope, light that comes down steeper meets it where it ends and nowhere before.

use nalgebra::Vector3;

use crate::model::random::derived_seed;

/// Cells along the longer side of a part: a millimetre on one of 120 mm.
const CELLS: f64 = 128.0;

/// Triangles that come nearer to the plate than this do not count, mm: bottoms lie on it.
const FOOT_MM: f64 = 0.01;

/// A part with more open edges than this is taken to hide nothing: it is no surface.
const MAX_OPEN_EDGES: usize = 100_000;

/// Most connected regions without open edges whose triangles are counted.
const MAX_REGIONS: usize = 8;

/// Steepest slope (a tangent) of what is gentle, and least of the light that surely reaches that.
const GENTLE_SLOPE: f64 = 1.0;
pub(crate) const STEEP_LIGHT: f64 = 1.05;

/// What touches an open edge.
const OPEN: u32 = u32::MAX;

/// What belongs to no region yet.
const UNSEEN: u32 = u32::MAX - 1;

/// Two ends.
type Edge = [Vector3<f64>; 2];

/// What is known of the places of the plate, in the part's frame.
#[derive(Debug, PartialEq)]
pub(crate) struct Cover {
    low_mm: [f64; 2],
    cell_mm: f64,
    n_cells: [usize; 2],
    /// How many cells before each column and row have an odd number of triangles over them.
    odd_before: Vec<u32>,
    /// How many of them have one gentle triangle over each place.
    gentle_before: Vec<u32>,
    /// No triangle reaches higher.
    pub top_mm: f64,
}

impl Cover {
    /// The cover of triangles over the plane z = 0 inside the box from `low` to `high`.
    pub(crate) fn new(triangles: &[[Vector3<f64>; 3]], low: &Vector3<f64>, high: &Vector3<f64>) -> Self {
        let cell_mm = ((high.x - low.x).max(high.y - low.y) / CELLS).max(f64::MIN_POSITIVE);
        let n_cells = [0, 1].map(|axis| ((high[axis] - low[axis]) / cell_mm) as usize + 1);
        let low_mm = [low.x, low.y];
        let (odd_before, gentle_before) = (Vec::new(), Vec::new());
        let mut cover = Self { low_mm, cell_mm, n_cells, odd_before, gentle_before, top_mm: high.z };
        let stands = |corners: &&[Vector3<f64>; 3]| corners.iter().all(|c| c.z > FOOT_MM);
        let counted: Vec<[Vector3<f64>; 3]> = triangles.iter().filter(stands).copied().collect();
        let (open, folded) = open_and_folded_edges(&counted);
        let mut region_of = vec![UNSEEN; cover.n_cells[0] * cover.n_cells[1]];
        cover.touch_edges(&open, &mut region_of);
        let mut gentle_region_of = region_of.clone();
        let odd = cover.covered(&counted, region_of, |n_over| n_over % 2 == 1);
        cover.odd_before = cover.counted_before(&odd);
        cover.touch_edges(&folded, &mut gentle_region_of);
        let rising = triangles.iter().filter(|corners| !stands(corners) && corners.iter().any(|c| c.z > FOOT_MM));
        for [a, b, c] in counted.iter().filter(|corners| is_steep(corners)).chain(rising) {
            cover.touch(&a.inf(b).inf(c), &a.sup(b).sup(c), &mut gentle_region_of);
        }
        let gentle = cover.covered(&counted, gentle_region_of, |n_over| n_over == 1);
        cover.gentle_before = cover.counted_before(&gentle);
        cover
    }

    /// Whether light steeper than [`STEEP_LIGHT`] surely reaches all of the part over a rectangle (part's frame) that its
    /// ways do not leave as they come down from the top; points up to [`Self::lowest_mm`] do not count as the part.
    pub(crate) fn is_gentle_over(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        self.all_within(&self.gentle_before, low, high)
    }

    /// Whether no triangle lies over a rectangle (part's frame).
    pub(crate) fn is_beside(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        (0..2).any(|axis| {
            let end = self.low_mm[axis] + self.n_cells[axis] as f64 * self.cell_mm;
            high[axis] < self.low_mm[axis] - self.cell_mm || low[axis] > end
        })
    }

    /// What lies lower may be the part's bottom.
    pub(crate) fn lowest_mm(&self) -> f64 {
        FOOT_MM
    }

    /// Whether no ray whose end on the plate lies within `margin_mm` of that of this one, and which comes from beside it
    /// as far, reaches the plate (all in the part's frame).
    pub(crate) fn hides_plate_from(&self, origin: &Vector3<f64>, way: &Vector3<f64>, margin_mm: f64) -> bool {
        if origin.z <= self.top_mm || way.z >= 0.0 {
            return false;
        }
        let [foot, top] = [0.0, self.top_mm].map(|height| origin + way * ((height - origin.z) / way.z));
        let low = [0, 1].map(|axis| foot[axis].min(top[axis]) - margin_mm);
        let high = [0, 1].map(|axis| foot[axis].max(top[axis]) + margin_mm);
        self.all_within(&self.odd_before, low, high)
    }

    /// Whether all cells that a rectangle touches are among those counted in `before`.
    fn all_within(&self, before: &[u32], low: [f64; 2], high: [f64; 2]) -> bool {
        let span = |axis: usize| {
            let cell = |x: f64| (x - self.low_mm[axis]) / self.cell_mm;
            let (from, to) = (cell(low[axis]), cell(high[axis]));
            (from >= 0.0 && to < self.n_cells[axis] as f64).then_some((from as usize, to as usize + 1))
        };
        let (Some((left, right)), Some((front, back))) = (span(0), span(1)) else { return false };
        let before = |column: usize, row: usize| before[row * (self.n_cells[0] + 1) + column] as usize;
        let n_covered = before(right, back) + before(left, front) - before(left, back) - before(right, front);
        n_covered == (right - left) * (back - front)
    }

    /// The cells of regions over whose places the same number of triangles lies, one that is `wanted`.
    fn covered(
        &self,
        triangles: &[[Vector3<f64>; 3]],
        mut region_of: Vec<u32>,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<bool> {
        let mut regions = self.regions(&mut region_of);
        regions.sort_by_key(|(n_cells, _)| std::cmp::Reverse(*n_cells));
        let found = regions.iter().take(MAX_REGIONS).map(|&(_, first)| first);
        let found = found.filter(|&first| self.n_over(first, triangles).is_some_and(&wanted));
        let numbers: Vec<u32> = found.map(|first| region_of[first]).collect();
        region_of.iter().map(|region| numbers.contains(region)).collect()
    }

    /// Marks the cells that edges touch; if they are too many, all.
    fn touch_edges(&self, edges: &[Edge], region_of: &mut [u32]) {
        if edges.len() > MAX_OPEN_EDGES {
            region_of.fill(OPEN);
            return;
        }
        for [a, b] in edges {
            let n_pieces = ((b - a).xy().amax() / self.cell_mm).ceil().max(1.0);
            let at = |piece: f64| a + (b - a) * (piece / n_pieces);
            for piece in 0..n_pieces as usize {
                self.touch(&at(piece as f64), &at(piece as f64 + 1.0), region_of);
            }
        }
    }

    /// Marks the cells of the rectangle between two corners, and those that rounding might make it touch.
    fn touch(&self, a: &Vector3<f64>, b: &Vector3<f64>, region_of: &mut [u32]) {
        const ROUNDING: f64 = 1e-6;
        let span = |axis: usize| {
            let cell = |x: f64| (x - self.low_mm[axis]) / self.cell_mm;
            let from = (cell(a[axis].min(b[axis])) - ROUNDING).max(0.0) as usize;
            from..=((cell(a[axis].max(b[axis])) + ROUNDING) as usize).min(self.n_cells[axis] - 1)
        };
        for row in span(1) {
            span(0).for_each(|column| region_of[row * self.n_cells[0] + column] = OPEN);
        }
    }

    /// Numbers the regions of cells that no open edge parts: how many cells each has, and the first.
    fn regions(&self, region_of: &mut [u32]) -> Vec<(usize, usize)> {
        let mut regions = Vec::new();
        let [n_columns, n_rows] = self.n_cells;
        for first in 0..region_of.len() {
            if region_of[first] != UNSEEN {
                continue;
            }
            let (number, mut n_cells, mut waiting) = (regions.len() as u32, 0, vec![first]);
            region_of[first] = number;
            while let Some(idx) = waiting.pop() {
                n_cells += 1;
                let (column, row) = (idx % n_columns, idx / n_columns);
                let beside = [
                    (column > 0).then(|| idx - 1),
                    (column + 1 < n_columns).then_some(idx + 1),
                    (row > 0).then(|| idx - n_columns),
                    (row + 1 < n_rows).then_some(idx + n_columns),
                ];
                for next in beside.into_iter().flatten() {
                    if region_of[next] == UNSEEN {
                        region_of[next] = number;
                        waiting.push(next);
                    }
                }
            }
            regions.push((n_cells, first));
        }
        regions
    }

    /// How many triangles lie over the middle of a cell; `None` where an edge of one does.
    fn n_over(&self, cell: usize, triangles: &[[Vector3<f64>; 3]]) -> Option<usize> {
        // Off the middle, because the corners of regular parts lie there.
        let at =
            |axis: usize, idx: usize| self.low_mm[axis] + (idx as f64 + [0.5123, 0.4789][axis]) * self.cell_mm;
        let (x, y) = (at(0, cell % self.n_cells[0]), at(1, cell / self.n_cells[0]));
        let mut n_over = 0;
        for [a, b, c] in triangles {
            let low = a.inf(b).inf(c);
            let high = a.sup(b).sup(c);
            if x < low.x || x > high.x || y < low.y || y > high.y {
                continue;
            }
            let side = |p: &Vector3<f64>, q: &Vector3<f64>| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
            let sides = [side(a, b), side(b, c), side(c, a)];
            let rounding = 1e-9 * (high - low).xy().norm_squared();
            if sides.iter().any(|side| side.abs() <= rounding) {
                return None;
            }
            n_over += usize::from(sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0));
        }
        Some(n_over)
    }

    fn counted_before(&self, covered: &[bool]) -> Vec<u32> {
        let [n_columns, n_rows] = self.n_cells;
        let mut before = vec![0; (n_columns + 1) * (n_rows + 1)];
        for row in 0..n_rows {
            let mut n_in_row = 0;
            for column in 0..n_columns {
                n_in_row += u32::from(covered[row * n_columns + column]);
                let place = (row + 1) * (n_columns + 1) + column + 1;
                before[place] = before[place - n_columns - 1] + n_in_row;
            }
        }
        before
    }
}

/// Whether a triangle is steeper than what is gentle.
fn is_steep([a, b, c]: &[Vector3<f64>; 3]) -> bool {
    let normal = (b - a).cross(&(c - a));
    normal.xy().norm() > GENTLE_SLOPE * normal.z.abs()
}

/// The edges that an odd number of triangles share (ends that are the same number by number), and all others but those that
/// part two triangles, one to either side.
fn open_and_folded_edges(triangles: &[[Vector3<f64>; 3]]) -> (Vec<Edge>, Vec<Edge>) {
    // Adding 0 makes the two zeros one.
    let name = |corner: &Vector3<f64>| corner.iter().map(|x| (x + 0.0).to_bits()).fold(7, derived_seed);
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (idx, corners) in triangles.iter().enumerate() {
        let names = corners.each_ref().map(name);
        for side in 0..3 {
            let (a, b) = (names[side], names[(side + 1) % 3]);
            edges.push((derived_seed(a.min(b), a.max(b)), idx, side));
        }
    }
    edges.sort_unstable();
    let (mut open, mut folded) = (Vec::new(), Vec::new());
    for shared in edges.chunk_by(|a, b| a.0 == b.0) {
        let [a, b] = [0, 1].map(|end| triangles[shared[0].1][(shared[0].2 + end) % 3]);
        // On which side of the edge, seen from above, a triangle's third corner lies.
        let side = |&(_, idx, side): &(u64, usize, usize)| {
            let third = triangles[idx][(side + 2) % 3];
            (b - a).xy().perp(&(third - a).xy())
        };
        match shared {
            [one, other] if side(one) * side(other) < 0.0 => {}
            _ if shared.len() % 2 == 1 => open.push([a, b]),
            _ => folded.push([a, b]),
        }
    }
    (open, folded)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles over a rectangle.
    fn sheet(from: [f64; 2], to: [f64; 2], height: f64) -> Vec<[Vector3<f64>; 3]> {
        let at = |x: f64, y: f64| Vector3::new(x, y, height);
        let (a, b) = (at(from[0], from[1]), at(to[0], from[1]));
        let (c, d) = (at(to[0], to[1]), at(from[0], to[1]));
        vec![[a, b, c], [a, c, d]]
    }

    fn hides(triangles: &[[Vector3<f64>; 3]], x: f64, lean: f64) -> bool {
        let (low, high) = (Vector3::new(-20.0, -20.0, 0.0), Vector3::new(20.0, 20.0, 12.0));
        let way = Vector3::new(lean, 0.0, -1.0);
        let origin = Vector3::new(x, 3.0, 0.0) - way * 300.0;
        Cover::new(triangles, &low, &high).hides_plate_from(&origin, &way, 1.0)
    }

    #[test]
    fn a_sheet_hides_what_lies_well_under_it() {
        let roof = sheet([-15.0, -15.0], [15.0, 15.0], 10.0);
        assert!(hides(&roof, 0.0, 0.0) && hides(&roof, 13.0, 0.0) && hides(&roof, 7.0, 0.5));
        assert!(!hides(&roof, 14.5, 0.0) && !hides(&roof, 19.0, 0.0));
        // 12 mm up it comes in 6 mm from the end.
        assert!(!hides(&roof, -9.0, 0.5) && hides(&roof, -7.0, 0.5));
    }

    /// Whether light surely reaches the part over a square of 4 mm.
    fn gentle(triangles: &[[Vector3<f64>; 3]], x: f64) -> bool {
        let (low, high) = (Vector3::new(-20.0, -20.0, 0.0), Vector3::new(20.0, 20.0, 12.0));
        Cover::new(triangles, &low, &high).is_gentle_over([x - 2.0, 1.0], [x + 2.0, 5.0])
    }

    #[test]
    fn one_gentle_sheet_is_lit_everywhere() {
        let bent = |rise: f64| {
            let mut right = sheet([0.0, -15.0], [15.0, 15.0], 1.0);
            for corner in right.as_flattened_mut() {
                corner.z += rise * corner.x;
            }
            [sheet([-15.0, -15.0], [0.0, 15.0], 1.0), right].concat()
        };
        assert!(gentle(&bent(0.0), 0.0) && gentle(&bent(0.7), 0.0) && gentle(&bent(0.7), 9.0));
        assert!(!gentle(&bent(1.1), 0.0) && !gentle(&bent(1.1), 9.0) && gentle(&bent(1.1), -9.0));
        assert!(!gentle(&bent(0.7), 14.0), "the edge of the part");
        let mut under_roof = bent(0.0);
        under_roof.extend(sheet([-10.0, -10.0], [18.0, 18.0], 9.0));
        assert!(!gentle(&under_roof, 0.0));
        let mut folded_back = bent(0.0);
        folded_back.extend(sheet([15.0, -15.0], [5.0, 15.0], 1.0));
        assert!(!gentle(&folded_back, 9.0) && gentle(&folded_back, -9.0));
        let slope = [[-15.0, -15.0, 0.0], [15.0, -15.0, 11.0], [15.0, 15.0, 11.0]].map(Vector3::from);
        assert!(!gentle(&[bent(0.0), vec![slope]].concat(), 4.0), "from the plate up over it");
    }

    #[test]
    fn gaps_steps_and_pairs_of_sheets_hide_nothing() {
        let left = sheet([-15.0, -15.0], [0.0, 15.0], 10.0);
        let whole = [left.clone(), sheet([0.0, -15.0], [15.0, 15.0], 10.0)].concat();
        assert!(hides(&whole, 0.0, 0.2), "the same corners on both sides");
        let gap = [left.clone(), sheet([1e-9, -15.0], [15.0, 15.0], 10.0)].concat();
        let step = [left, sheet([0.0, -15.0], [15.0, 15.0], 9.0)].concat();
        assert!(!hides(&gap, 0.0, 0.2) && !hides(&step, 0.0, 0.2));
        assert!(hides(&gap, 8.0, 0.0) && hides(&step, 8.0, 0.0));
        let roof = sheet([-15.0, -15.0], [15.0, 15.0], 10.0);
        let twice = [roof.clone(), sheet([-10.0, -15.0], [15.0, 15.0], 5.0)].concat();
        assert!(!hides(&twice, 5.0, 0.0), "an even number proves nothing");
        let on_plate = [roof, sheet([-15.0, -15.0], [15.0, 15.0], 0.0)].concat();
        assert!(hides(&on_plate, 5.0, 0.0), "a bottom on the plate does not count");
    }
}
