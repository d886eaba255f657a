//! Every sample triangulated with every possible label.

use nalgebra::Vector3;
use optics::{DepthRangeMm, Hits, RayHit, Triangulator};
use statistics::median;
use vision::{CentrelinePoint, Centrelines, LineDirection};

use crate::input::motions::FrameMotion;
use crate::label::pieces::Piece;
use crate::params::WIDTH_WINDOW_WIDTHS;

/// A sample under the hypothesis of one order: its 3D position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Position in the part frame, or in the chart of a turntable. NaN in a single frame, in which no surface is seen twice.
    pub in_part_mm: Vector3<f64>,
    /// Depth in the camera frame.
    pub depth_mm: f64,
    /// Standard deviation of the depth from image noise. NaN in a single frame.
    pub sigma_mm: f64,
}

/// A sample of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Index of the piece.
    pub piece: usize,
    /// Scan column (row).
    pub along: i64,
    /// Position across the lines, px.
    pub across_px: f64,
    /// Distance to the neighbouring order's line in the image at this depth, px. In a single frame only that of the first
    /// sample of a piece is computed; NaN for the others.
    pub pitch_px: f64,
    /// ln of the line's full width at half height, px: the median of its surroundings. NaN in a single frame, in which
    /// widths are no evidence.
    pub log_width: f64,
}

/// The samples of all pieces, grouped by piece.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// All samples, by piece, then along the line.
    pub all: Vec<Sample>,
    /// Per piece: index of its first sample; one more entry than pieces.
    pub first_of_piece: Vec<usize>,
    /// Per sample and order: see [`Samples::by_order`].
    hypotheses: Vec<Option<Hypothesis>>,
    n_orders: usize,
}

impl Samples {
    /// No samples yet.
    pub fn new(n_orders: usize) -> Self {
        Self { all: Vec::new(), first_of_piece: vec![0], hypotheses: Vec::new(), n_orders }
    }

    /// Appends the samples of the next pieces.
    pub fn append(&mut self, other: Self) {
        if self.first_of_piece.len() == 1 {
            *self = other;
            return;
        }
        let n = self.all.len();
        self.first_of_piece.extend(other.first_of_piece[1..].iter().map(|first| n + first));
        self.all.extend(other.all);
        self.hypotheses.extend(other.hypotheses);
    }

    /// Per order (index into the calibration's list): the hypothesis of a sample, `None` if the ray misses the sheet or
    /// the depth is out of range.
    pub fn by_order(&self, idx: usize) -> &[Option<Hypothesis>] {
        &self.hypotheses[idx * self.n_orders..][..self.n_orders]
    }

    /// The samples of one piece.
    pub fn of_piece(&self, piece: usize) -> &[Sample] {
        &self.all[self.range(piece)]
    }

    /// Index of the sample of `piece` (index `idx`) in column (row) `along`, if there is one.
    pub fn at(&self, idx: usize, piece: &Piece, along: i64) -> Option<usize> {
        let range = self.range(idx);
        let steps = along - self.all.get(range.start)?.along;
        let stride = piece.stride as i64;
        let place = range.start + usize::try_from(steps / stride).ok()?;
        (steps >= 0 && steps % stride == 0 && range.contains(&place)).then_some(place)
    }

    /// Indices of the samples of one piece.
    pub fn range(&self, piece: usize) -> std::ops::Range<usize> {
        self.first_of_piece[piece]..self.first_of_piece[piece + 1]
    }
}

/// What the features of frames are extracted with.
pub struct View<'a> {
    /// The station's triangulator.
    pub triangulator: &'a Triangulator,
    /// Depth range of valid labels.
    pub depth_range_mm: DepthRangeMm,
    /// Direction of the lines.
    pub direction: LineDirection,
    /// Per frame: full width of its lines in focus, px.
    pub widths_px: &'a [f64],
    /// Whether there are several frames, so that surfaces seen twice and the widths of lines are evidence.
    pub is_scan: bool,
}

impl View<'_> {
    /// Triangulates the samples of a frame's pieces, which are numbered from `first_piece`; `motion` transforms camera
    /// points to the chart.
    pub fn samples(
        &self,
        pieces: &[Piece],
        first_piece: usize,
        lines: &Centrelines,
        motion: &FrameMotion,
    ) -> Samples {
        let n_orders = self.triangulator.calibration().orders.len();
        let mut samples = Samples::new(n_orders);
        let (mut points, mut near): (Vec<&CentrelinePoint>, Vec<f64>) = (Vec::new(), Vec::new());
        for (idx, piece) in pieces.iter().enumerate() {
            for (along, point) in piece.samples().filter_map(|along| Some((along, piece.point_at(lines, along)?)))
            {
                let across_px = point.along_across(self.direction).1;
                let log_width = match self.is_scan {
                    true => log_width(piece.points(lines), (along - piece.along) as usize, &mut near),
                    false => f64::NAN,
                };
                let piece = first_piece + idx;
                samples.all.push(Sample { piece, along, across_px, pitch_px: f64::NAN, log_width });
                points.push(point);
            }
            samples.first_of_piece.push(samples.all.len());
        }
        let u_px: Vec<f64> = points.iter().map(|point| point.u_px).collect();
        let v_px: Vec<f64> = points.iter().map(|point| point.v_px).collect();
        if !self.is_scan {
            self.add_depths(&mut samples, &u_px, &v_px);
            return samples;
        }
        let mut of_orders = vec![Hits::default(); n_orders];
        for (order_idx, hits) in of_orders.iter_mut().enumerate() {
            self.triangulator.triangulate_all(order_idx, &u_px, &v_px, hits);
        }
        samples.hypotheses.reserve(points.len() * n_orders);
        for (at, point) in points.iter().enumerate() {
            samples.all[at].pitch_px = pitch_px(of_orders.iter().map(|hits| hits.at(at)), self.direction);
            samples.hypotheses.extend(of_orders.iter().map(|hits| {
                let hit = hits.at(at);
                let in_range = self.depth_range_mm.contains(hit.in_camera.xyz.z);
                let sigma_mm = || hit.noise_sigma_mm(&point.normal, point.sigma_px);
                in_range.then(|| Hypothesis {
                    in_part_mm: motion.chart_from_camera(&hit.in_camera),
                    depth_mm: hit.in_camera.xyz.z,
                    sigma_mm: sigma_mm(),
                })
            }));
        }
        samples
    }

    /// The depths of samples of a single frame at these pixels, and the line pitch of every piece.
    fn add_depths(&self, samples: &mut Samples, u_px: &[f64], v_px: &[f64]) {
        let (n, n_orders) = (u_px.len(), samples.n_orders);
        let mut depths_mm = Vec::new();
        self.triangulator.depths(u_px, v_px, &mut depths_mm);
        let hypothesis = |depth_mm: f64| {
            let unknown = Hypothesis { in_part_mm: Vector3::repeat(f64::NAN), depth_mm, sigma_mm: f64::NAN };
            self.depth_range_mm.contains(depth_mm).then_some(unknown)
        };
        samples.hypotheses = vec![None; n * n_orders];
        for (order_idx, of_order) in depths_mm.chunks_exact(n.max(1)).enumerate() {
            let slots = samples.hypotheses[order_idx..].iter_mut().step_by(n_orders);
            slots.zip(of_order).for_each(|(slot, &depth_mm)| *slot = hypothesis(depth_mm));
        }
        for at in samples.first_of_piece[..samples.first_of_piece.len() - 1].iter().copied().filter(|at| *at < n) {
            let by_order = (0..n_orders).map(|order_idx| self.triangulator.hit(order_idx, u_px[at], v_px[at]));
            samples.all[at].pitch_px = pitch_px(by_order, self.direction);
        }
    }
}

/// ln of the median width about a point of a line; `near` is reusable memory.
fn log_width(points: &[CentrelinePoint], at: usize, near: &mut Vec<f64>) -> f64 {
    let reach = (WIDTH_WINDOW_WIDTHS * f64::from(points[at].width_px)).ceil() as usize;
    let around = at.saturating_sub(reach)..(at + reach + 1).min(points.len());
    near.clear();
    near.extend(points[around].iter().map(|point| f64::from(point.width_px)));
    median(near).map_or(0.0, f64::ln)
}

/// Distance between neighbouring lines in the image: distance of the ray's hits on their sheets over the movement of
/// its hit per pixel, both along the ray. `by_order`: the ray's hits under consecutive orders.
pub fn pitch_px(by_order: impl Iterator<Item = RayHit>, direction: LineDirection) -> f64 {
    let mut least = f64::INFINITY;
    let mut before: Option<RayHit> = None;
    for hit in by_order {
        if let Some(before) = before.replace(hit) {
            let by_px = match direction {
                LineDirection::Rows => before.range_by_pixel.y,
                LineDirection::Columns => before.range_by_pixel.x,
            };
            let pitch = ((hit.in_camera.xyz.norm() - before.in_camera.xyz.norm()) / by_px).abs();
            least = if pitch.is_finite() { least.min(pitch) } else { least };
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Rotation3};
    use optics::{Calibration, Camera, LightSurfaces, Plane};

    use super::*;

    /// Angle between neighbouring sheets: so small that the line spacing is constant over one pitch.
    const SHEET_SPACING_RAD: f64 = 2e-4;
    /// The second-order term of that spacing, at the steepest ray.
    const TOLERANCE: f64 = 5e-3;

    #[test]
    fn the_line_pitch_matches_the_next_sheet_at_the_same_depth_for_any_ray() {
        // Half angles of the field 52° and 46°: rays in its corners are 1.7 times as long as their depth.
        let source = Vector3::new(0.0, -170.0, 0.0);
        let sheet = |order: i8| {
            let turned = Rotation3::new(-Vector3::x() * (0.4 + SHEET_SPACING_RAD * f64::from(order)));
            (order, Plane::through(&source, turned * -Vector3::y()))
        };
        let matrix = [[500.0, 0.0, 639.5], [0.0, 500.0, 511.5], [0.0, 0.0, 1.0]];
        let triangulator = Triangulator::new(Calibration {
            id: String::new(),
            camera: Camera::from_opencv(1280, 1024, matrix, &[]),
            orders: vec![0, 1],
            light: LightSurfaces::Planes(vec![sheet(0), sheet(1)]),
            stage: None,
            depth_range_mm: DepthRangeMm { near_mm: 0.0, far_mm: 1e4 },
            covariance: DMatrix::zeros(15, 15),
        });
        for (u_px, v_px) in [(639.5, 511.5), (1250.0, 511.5), (20.0, 300.0), (1250.0, 20.0)] {
            let hit = |order: usize, v_px: f64| triangulator.hit(order, u_px, v_px);
            let depth_mm = hit(0, v_px).in_camera.xyz.z;
            // The next order's line in this column at the same depth: a few steps along the slope.
            let miss_mm = |v_px: f64| hit(1, v_px).in_camera.xyz.z - depth_mm;
            let slope_mm_per_px = miss_mm(v_px + 0.5) - miss_mm(v_px - 0.5);
            let at = (0..6).fold(v_px, |at, _| at - miss_mm(at) / slope_mm_per_px);
            let expected = (at - v_px).abs();
            let pitch = pitch_px([hit(0, v_px), hit(1, v_px)].into_iter(), LineDirection::Rows);
            assert!((pitch / expected - 1.0).abs() < TOLERANCE, "({u_px}, {v_px}): {pitch} for {expected} px");
        }
    }
}
