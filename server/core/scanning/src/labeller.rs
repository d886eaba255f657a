//! Labels and points of one frame after the other, in the memory of those before.

use multiversion::multiversion;
use nalgebra::{Vector2, Vector3};
use optics::{DepthRangeMm, Hits, PointMm, RayHit, Triangulator};
use vision::{CentrelinePoint, Centrelines};

use crate::dropped::{DropReason, Dropped};
use crate::label::{FrameLabels, Verdict, along_across, still_fits};
use crate::profile::{Profile, ProfilePoint, label_frame_by_reference};

/// Points that are triangulated at once: what they need stays in the nearest cache.
const POINTS_AT_ONCE: usize = 256;

/// Stands where a point will be written.
const NOWHERE: ProfilePoint = ProfilePoint {
    order: 0,
    hit_in_camera: PointMm::new(Vector3::new(0.0, 0.0, 0.0)),
    seen: CentrelinePoint::UNWRITTEN,
    noise_sigma_mm: 0.0,
};

/// Labels and triangulates one frame after the other. What it finds depends on the frame alone.
///
/// It keeps its memory: once the largest frame has been seen, none is asked for.
#[derive(Debug, Default)]
pub struct FrameLabeller {
    labels: FrameLabels,
    /// Pieces that have an order: (order, column or row of the first point, piece, index of the order).
    kept: Vec<(i8, i64, usize, usize)>,
    /// Per segment: points of the longest piece with a label.
    longest: Vec<usize>,
    hits: Hits,
    /// Per piece that has an order: where its points end in the profile.
    ends: Vec<usize>,
    sequence: Vec<u32>,
    sorted: Vec<ProfilePoint>,
}

impl FrameLabeller {
    /// As [`crate::label_frame`]; what `profile` held is replaced.
    pub fn label(
        &mut self,
        centrelines: &Centrelines,
        triangulator: &Triangulator,
        depth_range_mm: DepthRangeMm,
        profile: &mut Profile,
    ) {
        let orders = &triangulator.calibration().orders;
        if !still_fits(orders.len()) {
            *profile = label_frame_by_reference(centrelines, triangulator, depth_range_mm);
            return;
        }
        self.labels.find(centrelines, triangulator, depth_range_mm);
        profile.dropped = Default::default();
        self.take_verdicts(orders, profile);
        let n_points = self.kept.iter().map(|kept| self.labels.pieces[kept.2].n_points()).sum();
        // What was there before is written over.
        profile.points.resize(n_points, NOWHERE);
        let mut n_written = 0;
        self.ends.clear();
        for &(order, _, piece, order_idx) in &self.kept {
            let piece = &self.labels.pieces[piece];
            let points = piece.points(centrelines);
            let range = self.labels.lines.range(piece);
            let lines = &self.labels.lines;
            let (u_px, v_px) = (&lines.u_px[range.clone()], &lines.v_px[range]);
            for first in (0..points.len()).step_by(POINTS_AT_ONCE) {
                let part = first..points.len().min(first + POINTS_AT_ONCE);
                triangulator.triangulate_all(order_idx, &u_px[part.clone()], &v_px[part.clone()], &mut self.hits);
                let Profile { points: written, dropped, .. } = profile;
                let seen = (&points[part], order);
                n_written = write(written, n_written, seen, &self.hits, depth_range_mm, dropped);
            }
            self.ends.push(n_written);
        }
        profile.points.truncate(n_written);
        self.sort(&mut profile.points);
    }

    /// Labels of the segments, what was left out, and the pieces to triangulate in the order of the profile.
    fn take_verdicts(&mut self, orders: &[i8], profile: &mut Profile) {
        let FrameLabels { lines, pieces, verdicts, .. } = &self.labels;
        let n_segments = lines.starts.len() - 1;
        profile.labels.clear();
        profile.labels.resize(n_segments, None);
        self.longest.clear();
        self.longest.resize(n_segments, 0);
        self.kept.clear();
        let mut n_labelled = 0;
        for (idx, (piece, verdict)) in pieces.iter().zip(verdicts).enumerate() {
            n_labelled += piece.n_points();
            match *verdict {
                Verdict::Order(order_idx) => {
                    self.kept.push((orders[order_idx], piece.along, idx, order_idx));
                    if piece.n_points() > self.longest[piece.segment] {
                        self.longest[piece.segment] = piece.n_points();
                        profile.labels[piece.segment] = Some(orders[order_idx]);
                    }
                }
                Verdict::Doubtful => profile.dropped.add_piece(DropReason::Doubtful, piece.n_points()),
                Verdict::Contradicted => profile.dropped.add_piece(DropReason::Contradicted, piece.n_points()),
            }
        }
        profile.dropped.add_points(DropReason::TooShort, lines.u_px.len() - n_labelled);
        self.kept.sort_unstable();
    }

    /// By order, then along the line; equals stay as they are. Most pieces follow one another; points of those that do not
    /// move a few places up, as a rule.
    fn sort(&mut self, points: &mut Vec<ProfilePoint>) {
        let lines = &self.labels.lines;
        let along = |point: &ProfilePoint| along_across(&point.seen, lines.direction).0;
        let is_before = |a: &ProfilePoint, b: &ProfilePoint| {
            a.order < b.order || (a.order == b.order && along(a).total_cmp(&along(b)).is_lt())
        };
        let mut moves_left = MOVES_PER_POINT * points.len();
        let (mut start, mut reach) = (0, None);
        for (&(order, _, piece, _), &end) in self.kept.iter().zip(&self.ends) {
            let own = &lines.along()[lines.range(&self.labels.pieces[piece])];
            let follows = reach.is_none_or(|(before, reach)| before != order || reach <= own[0]);
            let is_rising = is_rising(own);
            let is_sorted = follows && is_rising;
            for idx in start.max(1)..if is_sorted { start } else { end } {
                if !is_before(&points[idx], &points[idx - 1]) {
                    continue;
                }
                let first = points[..idx].iter().rposition(|before| !is_before(&points[idx], before));
                let place = first.map_or(0, |first| first + 1);
                points[place..=idx].rotate_right(1);
                if moves_left < idx - place {
                    return self.sort_anew(points);
                }
                moves_left -= idx - place;
            }
            start = end;
            let before =
                reach.filter(|(before, _)| *before == order).map_or(f64::NEG_INFINITY, |(_, reach)| reach);
            reach = Some((order, if is_rising { before.max(own[own.len() - 1]) } else { f64::INFINITY }));
        }
    }

    /// The same for points in any sequence.
    fn sort_anew(&mut self, points: &mut Vec<ProfilePoint>) {
        let along = |idx: u32| along_across(&points[idx as usize].seen, self.labels.lines.direction).0;
        let order = |idx: u32| points[idx as usize].order;
        self.sequence.clear();
        self.sequence.extend(0..points.len() as u32);
        self.sequence.sort_unstable_by(|&a, &b| {
            order(a).cmp(&order(b)).then(along(a).total_cmp(&along(b))).then(a.cmp(&b))
        });
        self.sorted.clear();
        self.sorted.extend(self.sequence.iter().map(|&idx| points[idx as usize]));
        std::mem::swap(points, &mut self.sorted);
    }
}

/// Places that points may move up before sorting them anew is cheaper.
const MOVES_PER_POINT: usize = 4;

/// Whether no number is less than the one before it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn is_rising(numbers: &[f64]) -> bool {
    let n = numbers.len().max(1) - 1;
    let (before, after) = (&numbers[..n], &numbers[numbers.len() - n..]);
    let mut n_rising = 0;
    for (before, after) in before.iter().zip(after) {
        n_rising += u64::from(before <= after);
    }
    n_rising == n as u64
}

/// Writes the points that hit within the depth range over those from `first` on; counts the others. Returns where the
/// next points go.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn write(
    points: &mut [ProfilePoint],
    first: usize,
    (seen, order): (&[CentrelinePoint], i8),
    hits: &Hits,
    depth_range_mm: DepthRangeMm,
    dropped: &mut Dropped,
) -> usize {
    let n = seen.len();
    let points = &mut points[first..][..n];
    let (mut n_within, mut n_missed) = (0, 0);
    for depth_mm in &hits.z_mm[..n] {
        n_within += u64::from(depth_range_mm.contains(*depth_mm));
        n_missed += u64::from(depth_mm.is_nan());
    }
    if n_within == n as u64 {
        write_all(points, seen, order, hits);
        return first + n;
    }
    let mut place = 0;
    for (i, seen) in seen.iter().enumerate() {
        write_point(&mut points[place], seen, order, &hits.at(i));
        place += usize::from(depth_range_mm.contains(hits.z_mm[i]));
    }
    dropped.add_points(DropReason::NoHit, n_missed as usize);
    dropped.add_points(DropReason::OutsideDepth, n - (n_within + n_missed) as usize);
    first + place
}

#[inline(always)]
fn write_all(points: &mut [ProfilePoint], seen: &[CentrelinePoint], order: i8, hits: &Hits) {
    let n = points.len();
    let (x_mm, y_mm, z_mm) = (&hits.x_mm[..n], &hits.y_mm[..n], &hits.z_mm[..n]);
    let (by_u, by_v) = (&hits.reach_by_u[..n], &hits.reach_by_v[..n]);
    for (i, (point, seen)) in points.iter_mut().zip(seen).enumerate() {
        let in_camera = PointMm::new(Vector3::new(x_mm[i], y_mm[i], z_mm[i]));
        let hit = RayHit { in_camera, reach_by_pixel: Vector2::new(by_u[i], by_v[i]) };
        write_point(point, seen, order, &hit);
    }
}

/// Field by field: what was seen is copied as it is.
#[inline(always)]
fn write_point(point: &mut ProfilePoint, seen: &CentrelinePoint, order: i8, hit: &RayHit) {
    point.noise_sigma_mm = hit.noise_sigma_mm(&seen.normal, seen.sigma_px);
    point.hit_in_camera = hit.in_camera;
    point.seen = *seen;
    point.order = order;
}
