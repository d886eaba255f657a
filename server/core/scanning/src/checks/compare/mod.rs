//! Comparison of the surfaces of different orders: contradictions and self-consistency.

mod closure;

use std::borrow::Cow;

use nalgebra::{Vector2, Vector3};
use optics::Calibration;
use rayon::prelude::*;
use vision::LineDirection;

use crate::error::ScanError;
use crate::input::motions::FrameMotion;
use crate::label::{Labels, PatchGrid, ReferenceView, ViewPoint};
use crate::params::{
    AGREEMENT_SIGMAS, COMPARE_STRIDE_PX, CONTRADICTING_SURFACES, CONTRADICTION_TOLERANCES, PATCH_MAX_GRADIENT,
    PATCH_RADIUS_SPACINGS, SMOOTH_SIGMAS,
};
use crate::points::profile::{Profile, ProfilePoint};
use crate::points::profiles::Profiles;

pub use closure::{Closure, ClosureGap, ClosurePairs};

/// Agreement of two orders on the surface that both have observed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderPair {
    /// The lower order.
    pub order_a: i8,
    /// The higher order.
    pub order_b: i8,
    /// Points of `order_b` on smooth surface observed by `order_a`.
    pub n_pairs: usize,
    /// Mean depth of `order_b` minus `order_a` along z, mm.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included, mm.
    pub rms_mm: f64,
}

/// A small piece of surface observed by one order: a point with its four neighbours along line and travel.
#[derive(Debug, Clone, Copy)]
struct Patch {
    in_part_mm: Vector3<f64>,
    gradient: Vector2<f64>,
    sigma_mm: f64,
    order: i8,
    frame: u32,
    smooth: bool,
}

impl Patch {
    /// Its position in the reference view; computed on demand, as there are millions of patches.
    fn view(&self, reference_view: &ReferenceView) -> ViewPoint {
        reference_view.view_of(&self.in_part_mm)
    }
}

/// The surfaces of all orders, indexed by position.
pub struct Surfaces<'a> {
    reference_view: ReferenceView,
    motions: &'a [FrameMotion],
    patches: Vec<Patch>,
    grid: PatchGrid,
}

/// A point compared with a surface that another order has observed.
struct Other<'a> {
    in_part: Vector3<f64>,
    view: ViewPoint,
    patch: &'a Patch,
    patch_view: ViewPoint,
    apart_mm: f64,
    tolerance_mm: f64,
}

/// The patch nearest to a point, and the view of the point from which it is nearest.
#[derive(Clone, Copy)]
struct NearestPatch {
    distance: f64,
    idx: usize,
    view: ViewPoint,
}

/// Frames whose patches are computed together, from their profiles and those of one more frame on either side.
const WINDOW_FRAMES: usize = 32;

impl<'a> Surfaces<'a> {
    /// Builds the patches of all labelled points; `None` if the stage does not move the part across the view.
    ///
    /// `travel_order`: the frames in the sequence of their stage positions.
    ///
    /// # Errors
    /// [`ScanError::UnreadableFrame`].
    pub fn new(
        profiles: &Profiles,
        motions: &'a [FrameMotion],
        travel_order: &[usize],
        reference_view: ReferenceView,
    ) -> Result<Option<Self>, ScanError> {
        let step = reference_view.step_mm.norm();
        if !(step > 0.0 && step.is_finite()) {
            return Ok(None);
        }
        let n_places = travel_order.len();
        let mut patches: Vec<Patch> = Vec::new();
        for first in (0..n_places).step_by(WINDOW_FRAMES) {
            let end = n_places.min(first + WINDOW_FRAMES);
            let from = first.saturating_sub(1);
            let window = from..n_places.min(end + 1);
            let window_profiles: Result<Vec<(usize, Cow<Profile>)>, ScanError> = window
                .into_par_iter()
                .map(|place| travel_order[place])
                .map(|f| Ok((f, profiles.of(f)?)))
                .collect();
            let lookup = PointLookup::new(window_profiles?, &profiles.labels, profiles.calibration);
            let per_frame: Vec<Vec<Patch>> = (first..end)
                .into_par_iter()
                .map(|place| lookup.patches_of(place - from, motions, &reference_view))
                .collect();
            patches.extend(per_frame.into_iter().flatten());
        }
        let spacing_mm = reference_view.column_mm * COMPARE_STRIDE_PX as f64;
        let radii = [spacing_mm * PATCH_RADIUS_SPACINGS, step * PATCH_RADIUS_SPACINGS];
        let grid = PatchGrid::new(
            patches.par_iter().map(|patch| patch.view(&reference_view).xy_mm),
            reference_view.step_mm,
            radii,
        );
        Ok(Some(Self { reference_view, motions, patches, grid }))
    }

    /// Whether the surfaces of other orders contradict the point.
    pub fn contradict(&self, point: &ProfilePoint, frame: usize) -> bool {
        let (mut n_agreeing, mut n_contradicting) = (0, 0);
        self.for_each_other(point, frame, |Other { in_part, view, patch, patch_view, apart_mm, tolerance_mm }| {
            let hides = if view.depth_mm > patch_view.depth_mm { frame } else { patch.frame as usize };
            if apart_mm.abs() <= tolerance_mm * CONTRADICTION_TOLERANCES {
                n_agreeing += 1;
            } else if patch.smooth && self.occludes(&in_part, patch, hides) {
                n_contradicting += 1;
            }
        });
        n_contradicting >= CONTRADICTING_SURFACES && n_contradicting > n_agreeing
    }

    /// Distance of the point from the nearest surface that another order has observed in another frame, in depth and in
    /// tolerances.
    pub fn nearest_tolerances(&self, point: &ProfilePoint, frame: usize) -> f64 {
        let mut nearest_tolerances = f64::INFINITY;
        self.for_each_other(point, frame, |Other { apart_mm, tolerance_mm, .. }| {
            nearest_tolerances = nearest_tolerances.min(apart_mm.abs() / tolerance_mm);
        });
        nearest_tolerances
    }

    /// Compares a point with the surfaces around it that other orders have observed in other frames.
    fn for_each_other(&self, point: &ProfilePoint, frame: usize, mut each: impl FnMut(Other)) {
        let in_part = self.motions[frame].chart_from_camera(&point.hit_in_camera);
        for view in self.reference_view.views_of(&in_part) {
            self.grid.for_each_near(&view.xy_mm, |idx, _| {
                let patch = &self.patches[idx];
                if patch.order == point.order || patch.frame as usize == frame {
                    return;
                }
                let patch_view = patch.view(&self.reference_view);
                let (apart_mm, tolerance_mm) = self.difference(point, &view, patch, &patch_view);
                each(Other { in_part, view, patch, patch_view, apart_mm, tolerance_mm });
            });
        }
    }

    /// Depth of the point minus that of the patch at its position, and the tolerance of this difference, mm.
    fn difference(
        &self,
        point: &ProfilePoint,
        view: &ViewPoint,
        patch: &Patch,
        patch_view: &ViewPoint,
    ) -> (f64, f64) {
        let offset = view.xy_mm - patch_view.xy_mm;
        let apart = view.depth_mm - patch_view.depth_mm - patch.gradient.dot(&offset);
        // Without `hypot`, which guards a range of numbers that no σ has and is called for every pair.
        let noise = AGREEMENT_SIGMAS * (point.noise_sigma_mm.powi(2) + patch.sigma_mm.powi(2)).sqrt();
        let curvature = 0.5 * self.reference_view.curvature_per_mm() * offset.norm_squared();
        (apart, noise + self.reference_view.floor_mm + curvature)
    }

    /// Whether the nearer of the two would have occluded the farther one in frame `seen_at`.
    fn occludes(&self, in_part_mm: &Vector3<f64>, patch: &Patch, seen_at: usize) -> bool {
        let from = &self.motions[seen_at];
        let offset = self.reference_view.seen_from(from, in_part_mm).xy_mm
            - self.reference_view.seen_from(from, &patch.in_part_mm).xy_mm;
        self.grid.within(&offset)
    }

    /// Sums over one frame's points, by (lower order, own order); `orders` are sorted.
    pub fn differences_of(&self, points: &[ProfilePoint], frame: usize, orders: &[i8]) -> Vec<Sums> {
        let mut sums = vec![Sums::default(); orders.len() * orders.len()];
        let place = |order: i8| orders.binary_search(&order).ok();
        for point in points.iter().step_by(COMPARE_STRIDE_PX) {
            let in_part = self.motions[frame].chart_from_camera(&point.hit_in_camera);
            let mut nearest: Vec<Option<NearestPatch>> = vec![None; orders.len()];
            for view in self.reference_view.views_of(&in_part) {
                self.grid.for_each_near(&view.xy_mm, |idx, distance| {
                    let patch = &self.patches[idx];
                    let Some(slot) = place(patch.order) else { return };
                    if patch.order < point.order
                        && patch.smooth
                        && nearest[slot].as_ref().is_none_or(|best| distance < best.distance)
                    {
                        nearest[slot] = Some(NearestPatch { distance, idx, view });
                    }
                });
            }
            let Some(own) = place(point.order) else { continue };
            for (slot, found) in nearest.iter().enumerate() {
                let Some(NearestPatch { idx, view, .. }) = found else { continue };
                let patch = &self.patches[*idx];
                let (apart, tolerance) = self.difference(point, view, patch, &patch.view(&self.reference_view));
                if apart.abs() <= tolerance * CONTRADICTION_TOLERANCES {
                    sums[slot * orders.len() + own].add(apart);
                }
            }
        }
        sums
    }
}

/// Differences in depth between two orders.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    n: usize,
    sum: f64,
    squares: f64,
}

/// Bias and RMS of every pair of `orders`, which are sorted, from the sums of all frames.
pub fn order_pairs(totals: &[Sums], orders: &[i8]) -> Vec<OrderPair> {
    let mut pairs = Vec::new();
    for (a, &order_a) in orders.iter().enumerate() {
        for (b, &order_b) in orders.iter().enumerate().skip(a + 1) {
            let sums = totals[a * orders.len() + b];
            if sums.n > 0 {
                let n = sums.n as f64;
                let (bias_mm, rms_mm) = (sums.sum / n, (sums.squares / n).sqrt());
                pairs.push(OrderPair { order_a, order_b, n_pairs: sums.n, bias_mm, rms_mm });
            }
        }
    }
    pairs
}

impl Sums {
    /// Adds the sums of another frame.
    pub fn add_all(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.squares += other.squares;
    }

    fn add(&mut self, value: f64) {
        self.n += 1;
        self.sum += value;
        self.squares += value * value;
    }
}

/// No point of this order in this column (row).
const ABSENT: u32 = u32::MAX;

/// Points of consecutive frames by frame, order and scan column (row).
struct PointLookup<'a> {
    profiles: Vec<(usize, Cow<'a, Profile>)>,
    orders: &'a [i8],
    labels: &'a Labels,
    n_along: usize,
    slots: Vec<u32>,
}

impl<'a> PointLookup<'a> {
    fn new(profiles: Vec<(usize, Cow<'a, Profile>)>, labels: &'a Labels, calibration: &'a Calibration) -> Self {
        let (width_px, height_px) = (calibration.camera.width_px, calibration.camera.height_px);
        let n_along = match (labels.crossing, labels.direction) {
            (Some(_), _) => width_px.max(height_px),
            (None, LineDirection::Rows) => width_px,
            (None, LineDirection::Columns) => height_px,
        };
        let orders = &calibration.orders[..];
        let mut lookup = Self {
            orders,
            labels,
            n_along,
            slots: vec![ABSENT; profiles.len() * orders.len() * n_along],
            profiles,
        };
        for place in 0..lookup.profiles.len() {
            for idx in 0..lookup.profiles[place].1.points.len() {
                let point = &lookup.profiles[place].1.points[idx];
                if let Some(slot) = lookup.slot(place, point.order, lookup.along(point)) {
                    lookup.slots[slot] = idx as u32;
                }
            }
        }
        lookup
    }

    fn along(&self, point: &ProfilePoint) -> i64 {
        self.labels.along_across(point.order, &point.centreline).0.round() as i64
    }

    fn slot(&self, place: usize, order: i8, along: i64) -> Option<usize> {
        let order = self.orders.iter().position(|&candidate| candidate == order)?;
        let along = usize::try_from(along).ok().filter(|&along| along < self.n_along)?;
        Some((place * self.orders.len() + order) * self.n_along + along)
    }

    fn find(&self, place: Option<usize>, order: i8, along: i64) -> Option<&ProfilePoint> {
        let place = place.filter(|&place| place < self.profiles.len())?;
        let idx = self.slots[self.slot(place, order, along)?];
        (idx != ABSENT).then(|| &self.profiles[place].1.points[idx as usize])
    }

    /// The patches of one frame, every few columns.
    fn patches_of(&self, place: usize, motions: &[FrameMotion], reference_view: &ReferenceView) -> Vec<Patch> {
        let (frame, profile) = &self.profiles[place];
        let frame = *frame;
        let stride = COMPARE_STRIDE_PX as i64;
        let on_grid = profile.points.iter().filter(|point| self.along(point) % stride == 0);
        let patch = |point: &ProfilePoint| {
            let along = self.along(point);
            let in_part = |place: Option<usize>, along: i64| {
                let point = self.find(place, point.order, along)?;
                Some(motions[self.profiles[place?].0].chart_from_camera(&point.hit_in_camera))
            };
            let centre = motions[frame].chart_from_camera(&point.hit_in_camera);
            let line = [in_part(Some(place), along - stride)?, in_part(Some(place), along + stride)?];
            let travel = [in_part(place.checked_sub(1), along)?, in_part(Some(place + 1), along)?];
            let gradient =
                gradient(&line.map(|p| reference_view.view_of(&p)), &travel.map(|p| reference_view.view_of(&p)))?;
            let bend = |ends: &[Vector3<f64>; 2]| (ends[0].z + ends[1].z - 2.0 * centre.z).abs();
            // A second difference has √6 times the noise of one point.
            let limit = SMOOTH_SIGMAS * 6f64.sqrt() * point.noise_sigma_mm;
            let smooth = bend(&line) <= limit && bend(&travel) <= limit;
            let (order, sigma_mm, frame) = (point.order, point.noise_sigma_mm, frame as u32);
            Some(Patch { in_part_mm: centre, gradient, sigma_mm, order, frame, smooth })
        };
        on_grid.filter_map(patch).collect()
    }
}

/// Gradient of depth over the view; `None` where line and travel are parallel or the surface is too steep.
fn gradient(line: &[ViewPoint; 2], travel: &[ViewPoint; 2]) -> Option<Vector2<f64>> {
    let tangent = |ends: &[ViewPoint; 2]| {
        let across = ends[1].xy_mm - ends[0].xy_mm;
        Vector3::new(across.x, across.y, ends[1].depth_mm - ends[0].depth_mm)
    };
    let (line, travel) = (tangent(line), tangent(travel));
    crate::label::gradient(&line, &travel).filter(|gradient| gradient.norm() <= PATCH_MAX_GRADIENT)
}
