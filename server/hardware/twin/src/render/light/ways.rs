//! The ways of light from the grating to a stretch of pixels, as the band of an order sees them.

use multiversion::multiversion;
use nalgebra::Vector3;

use crate::params::SAME_HIT_MM;
use crate::part::cover::{Cover, STEEP_LIGHT};
use crate::part::mesh::Mesh;
use crate::part::scene::Ball;
use crate::render::light::band::Band;
use crate::render::view::block::{Block, NOTHING, floor};
use crate::render::view::lit_pixels::WORD_PX;
use crate::render::view::seen::{NO_TRIANGLE, Seen};

/// Ways that are looked at together: as many as a vector register holds.
const STEP: usize = 4;

/// The ways of light to a stretch of pixels; pairs are the lowest and the highest of each way inside the ball around the
/// part.
#[derive(Debug)]
pub(crate) struct Ways {
    /// Tangents along the band.
    pub along: [Block; 2],
    /// Tangents across it.
    pub across: [Block; 2],
    /// Columns of the band, from 0.
    pub columns: [Block; 2],
    /// Greatest depth, mm.
    pub farthest: Block,
    /// The share of each way that counts: what it meets beyond is its end itself.
    hidden_beyond: Block,
    /// Beginning and way in the part's frame.
    from: [Block; 3],
    way: [Block; 3],
    /// Whether it may meet the ball.
    near: [bool; WORD_PX],
    /// Whether it lies before the viewpoint.
    pub before: [bool; WORD_PX],
}

/// A way of light in the part's frame.
pub(crate) struct WayInPart {
    pub from: Vector3<f64>,
    pub way: Vector3<f64>,
    /// The share of it that counts.
    pub limit: f64,
}

impl Default for Ways {
    fn default() -> Self {
        Self {
            along: [NOTHING; 2],
            across: [NOTHING; 2],
            columns: [NOTHING; 2],
            farthest: NOTHING,
            hidden_beyond: NOTHING,
            from: [NOTHING; 3],
            way: [NOTHING; 3],
            near: [false; WORD_PX],
            before: [false; WORD_PX],
        }
    }
}

impl Ways {
    /// Turns the first `n` ways, to points that are seen on the part or on its plate, into the frame of that, carried by the
    /// stage.
    pub(crate) fn turn(&mut self, mesh: &Mesh, moved: &Vector3<f64>, from: &[Block; 3], to: &Seen, n: usize) {
        turn(self, mesh, &(mesh.plate.point_mm + moved), from, to, n.min(WORD_PX));
    }

    /// Whether nothing stands in any of the first `n` ways that end on the part, or in any that end on its plate, once they
    /// are turned. `false` decides nothing.
    pub(crate) fn surely_free(&self, cover: &Cover, to: &Seen, on_part: bool, n: usize) -> bool {
        let n = n.min(WORD_PX);
        if on_part {
            let least =
                Descent { top_mm: cover.top_mm, steepness: STEEP_LIGHT, lowest_mm: cover.lowest_mm(), on_part };
            descent(self, &least, &to.triangle, n).is_some_and(|(low, high)| cover.is_gentle_over(low, high))
        } else {
            let lowest_mm = f64::NEG_INFINITY;
            let least = Descent { top_mm: cover.top_mm, steepness: 0.0, lowest_mm, on_part };
            descent(self, &least, &to.triangle, n).is_some_and(|(low, high)| cover.is_beside(low, high))
        }
    }

    /// Follows the first `n` ways to points that are seen along the band.
    pub(crate) fn follow(&mut self, band: &Band, ball: &Ball, from: &[Block; 3], to: &Seen, n: usize) {
        follow(self, band, ball, from, to, n.min(WORD_PX));
    }

    /// Whether a way comes near the part.
    pub(crate) fn is_near(&self, lane: usize) -> bool {
        self.near[lane]
    }

    #[inline(always)]
    pub(crate) fn in_part(&self, lane: usize) -> WayInPart {
        let vector = |blocks: &[Block; 3]| Vector3::new(blocks[0][lane], blocks[1][lane], blocks[2][lane]);
        WayInPart { from: vector(&self.from), way: vector(&self.way), limit: self.hidden_beyond[lane] }
    }
}

/// The ball's test is that of [`Ball::is_near`].
#[multiversion(targets("x86_64+avx2"))]
fn follow(ways: &mut Ways, band: &Band, ball: &Ball, from: &[Block; 3], to: &Seen, n: usize) {
    let Ways { along: [low_u, high_u], across: [low_v, high_v], columns: [first, last], .. } = ways;
    let Ways { farthest, hidden_beyond, near, before, .. } = ways;
    let ([fx, fy, fz], Seen { rays: [x, y], reach, .. }) = (from, to);
    let (centre, radius_2) = (ball.centre_mm, ball.radius_mm * ball.radius_mm);
    let (axes, viewpoint) = (band.axes, band.viewpoint);
    let first_column = band.first_column as f64;
    for lane in 0..n {
        let origin = [fx[lane], fy[lane], fz[lane]];
        let end = [x[lane] * reach[lane], y[lane] * reach[lane], reach[lane]];
        let way = [end[0] - origin[0], end[1] - origin[1], end[2] - origin[2]];
        let to_centre = [centre.x - origin[0], centre.y - origin[1], centre.z - origin[2]];
        let square = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
        let length = square.sqrt();
        let beside = [
            to_centre[1] * way[2] - to_centre[2] * way[1],
            to_centre[2] * way[0] - to_centre[0] * way[2],
            to_centre[0] * way[1] - to_centre[1] * way[0],
        ];
        let beside = beside[0] * beside[0] + beside[1] * beside[1] + beside[2] * beside[2];
        near[lane] = beside <= radius_2 * square * (1.0 + SAME_HIT_MM);
        let along = to_centre[0] * way[0] + to_centre[1] * way[1] + to_centre[2] * way[2];
        let enter = (along / length - ball.radius_mm) / length;
        let enter = if enter > 0.0 { enter } else { 0.0 };
        let enter = if enter < 1.0 { enter } else { 1.0 };
        let start = [0, 1, 2].map(|axis: usize| origin[axis] + way[axis] * enter);
        let seen = |point: [f64; 3]| {
            let at = [0, 1, 2].map(|axis: usize| point[axis] - viewpoint[axis]);
            let [x, y, z] = [0, 1, 2]
                .map(|row: usize| axes[(row, 0)] * at[0] + axes[(row, 1)] * at[1] + axes[(row, 2)] * at[2]);
            [x / z, y / z, z]
        };
        let (a, b) = (seen(start), seen(end));
        let ordered = |axis: usize| if a[axis] < b[axis] { (a[axis], b[axis]) } else { (b[axis], a[axis]) };
        let (low, high) = ordered(0);
        (low_u[lane], high_u[lane]) = (low, high);
        (first[lane], last[lane]) =
            (floor(low / band.cell) - first_column, floor(high / band.cell) - first_column);
        (low_v[lane], high_v[lane]) = ordered(1);
        let (nearest, deepest) = ordered(2);
        farthest[lane] = deepest;
        before[lane] = nearest > 0.0;
        let at_least = if length > 1.0 { length } else { 1.0 };
        hidden_beyond[lane] = (length - SAME_HIT_MM * at_least) / length;
    }
}

/// Turns the ways into the part's frame, whose origin is given.
#[multiversion(targets("x86_64+avx2"))]
fn turn(ways: &mut Ways, mesh: &Mesh, origin: &Vector3<f64>, from: &[Block; 3], to: &Seen, n: usize) {
    let ([fx, fy, fz], Seen { rays: [tx, ty], reach, .. }) = (from, to);
    for axis in 0..3 {
        let along = mesh.plate.axes.column(axis);
        let (a, b, c) = (along[0], along[1], along[2]);
        let (start, way) = (&mut ways.from[axis], &mut ways.way[axis]);
        for lane in 0..n.min(start.len()) {
            let (x, y, z) = (fx[lane], fy[lane], fz[lane]);
            start[lane] = (x - origin.x) * a + (y - origin.y) * b + (z - origin.z) * c;
            let depth = reach[lane];
            way[lane] = (tx[lane] * depth - x) * a + (ty[lane] * depth - y) * b + (depth - z) * c;
        }
    }
}

#[inline(always)]
fn read(block: &Block, step: usize) -> &[f64; STEP] {
    &block.as_chunks().0[step]
}

/// What is asked of ways that come down to the part or to its plate.
struct Descent {
    /// They begin higher.
    top_mm: f64,
    /// They are steeper (a tangent).
    steepness: f64,
    /// They end higher.
    lowest_mm: f64,
    on_part: bool,
}

/// The rectangle (two corners, lower first) over which ways come down from the top; `None` if there are none or one is not as
/// asked.
#[multiversion(targets("x86_64+avx2"))]
fn descent(ways: &Ways, least: &Descent, triangle: &[u32; WORD_PX], n: usize) -> Option<([f64; 2], [f64; 2])> {
    let Descent { top_mm, steepness, lowest_mm, on_part } = *least;
    let (mut low, mut high) = ([[f64::INFINITY; STEP]; 2], [[f64::NEG_INFINITY; STEP]; 2]);
    let mut other = [0.0; STEP];
    let Ways { from: [fx, fy, fz], way: [wx, wy, wz], .. } = ways;
    for step in 0..n.min(WORD_PX).div_ceil(STEP) {
        let (fx, fy, fz) = (read(fx, step), read(fy, step), read(fz, step));
        let (wx, wy, wz) = (read(wx, step), read(wy, step), read(wz, step));
        let triangle = &triangle.as_chunks::<STEP>().0[step];
        for k in 0..STEP {
            let counts = (triangle[k] != NO_TRIANGLE) == on_part;
            // No comparison holds with what does not count.
            let (x, y, z) = (if counts { wx[k] } else { f64::NAN }, if counts { wy[k] } else { f64::NAN }, wz[k]);
            let end = fz[k] + z;
            let steep = (z < 0.0) & (z * z > steepness * steepness * (wx[k] * wx[k] + wy[k] * wy[k]));
            let well = steep & (fz[k] > top_mm) & (end > lowest_mm);
            let flaw = if well { 0.0 } else { 1.0 };
            other[k] += if counts { flaw } else { 0.0 };
            let up = (top_mm - end) / z;
            let foot = [fx[k] + x, fy[k] + y];
            let top = [foot[0] + x * up, foot[1] + y * up];
            for axis in 0..2 {
                let (foot, top) = (foot[axis], top[axis]);
                low[axis][k] = if foot < low[axis][k] { foot } else { low[axis][k] };
                low[axis][k] = if top < low[axis][k] { top } else { low[axis][k] };
                high[axis][k] = if foot > high[axis][k] { foot } else { high[axis][k] };
                high[axis][k] = if top > high[axis][k] { top } else { high[axis][k] };
            }
        }
    }
    let low = low.map(|low| low.into_iter().fold(f64::INFINITY, f64::min));
    let high = high.map(|high| high.into_iter().fold(f64::NEG_INFINITY, f64::max));
    (other == [0.0; STEP] && low[0] <= high[0]).then_some((low, high))
}
