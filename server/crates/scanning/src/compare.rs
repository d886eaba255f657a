//! The surfaces of different orders held against each other: contradictions and self-consistency.

use nalgebra::{Vector2, Vector3};
use optics::Calibration;
use rayon::prelude::*;
use vision::LineDirection;

use crate::label::{Outlook, PatchGrid, ViewPoint, along_across};
use crate::params::{
    AGREEMENT_SIGMAS, COMPARE_STRIDE_PX, CONTRADICTING_SURFACES, CONTRADICTION_TOLERANCES, PATCH_CURVATURE_PER_MM,
    PATCH_MAX_GRADIENT, PATCH_RADIUS_SPACINGS, SMOOTH_SIGMAS,
};
use crate::profile::{Profile, ProfilePoint};

/// How well two orders agree about the surface both have seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderPair {
    /// The lower order.
    pub order_a: i8,
    /// The higher order.
    pub order_b: i8,
    /// Points of `order_b` that lie on smooth surface seen by `order_a`.
    pub n_pairs: usize,
    /// Mean depth of `order_b` minus `order_a` along z, mm.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included, mm.
    pub rms_mm: f64,
}

/// A small piece of surface seen by one order: a point with its four neighbours along line and travel.
#[derive(Debug, Clone, Copy)]
struct Patch {
    in_part_mm: Vector3<f64>,
    view: ViewPoint,
    gradient: Vector2<f64>,
    sigma_mm: f64,
    order: i8,
    frame: u32,
    smooth: bool,
}

/// The surfaces of all orders, ready to be asked.
pub struct Surfaces<'a> {
    outlook: Outlook,
    shifts_mm: &'a [Vector3<f64>],
    patches: Vec<Patch>,
    grid: PatchGrid,
}

/// What the other orders' surfaces say about a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Opinion {
    agreeing: usize,
    contradicting: usize,
}

impl<'a> Surfaces<'a> {
    /// Builds the patches of all labelled points; `None` if the stage does not move across the view.
    ///
    /// `travel_order`: the frames in the sequence of their stage positions.
    pub fn new(
        profiles: &[Profile],
        shifts_mm: &'a [Vector3<f64>],
        travel_order: &[usize],
        outlook: Outlook,
        direction: LineDirection,
        calibration: &Calibration,
    ) -> Option<Self> {
        let step = outlook.step_mm.norm();
        if !(step > 0.0 && step.is_finite()) {
            return None;
        }
        let lookup = Lookup::new(profiles, travel_order, direction, calibration);
        let per_frame: Vec<Vec<Patch>> = (0..travel_order.len())
            .into_par_iter()
            .map(|place| lookup.patches_of(place, shifts_mm, &outlook))
            .collect();
        let patches: Vec<Patch> = per_frame.into_iter().flatten().collect();
        let spacing_mm = outlook.column_mm * COMPARE_STRIDE_PX as f64;
        let radii = [spacing_mm * PATCH_RADIUS_SPACINGS, step * PATCH_RADIUS_SPACINGS];
        let grid = PatchGrid::new(patches.iter().map(|patch| patch.view.xy_mm), outlook.step_mm, radii);
        Some(Self { outlook, shifts_mm, patches, grid })
    }

    /// Whether the surfaces of other orders deny the point.
    pub fn contradict(&self, point: &ProfilePoint, frame: usize) -> bool {
        let opinion = self.opinion(point, frame);
        opinion.contradicting >= CONTRADICTING_SURFACES && opinion.contradicting > opinion.agreeing
    }

    fn opinion(&self, point: &ProfilePoint, frame: usize) -> Opinion {
        let in_part = point.hit_in_camera.xyz - self.shifts_mm[frame];
        let view = self.outlook.view_of(&in_part);
        let mut opinion = Opinion::default();
        self.grid.for_each_near(&view.xy_mm, |idx, _| {
            let patch = &self.patches[idx];
            if patch.order == point.order || patch.frame as usize == frame {
                return;
            }
            let (apart, tolerance) = self.difference(point, &view, patch);
            if apart.abs() <= tolerance * CONTRADICTION_TOLERANCES {
                opinion.agreeing += 1;
            } else if patch.smooth && self.hides(&in_part, frame, &view, patch) {
                opinion.contradicting += 1;
            }
        });
        opinion
    }

    /// Depth of the point beyond the patch, and the tolerance of that.
    fn difference(&self, point: &ProfilePoint, view: &ViewPoint, patch: &Patch) -> (f64, f64) {
        let offset = view.xy_mm - patch.view.xy_mm;
        let apart = view.depth_mm - patch.view.depth_mm - patch.gradient.dot(&offset);
        let noise = AGREEMENT_SIGMAS * point.noise_sigma_mm.hypot(patch.sigma_mm);
        (apart, noise + self.outlook.floor_mm + 0.5 * PATCH_CURVATURE_PER_MM * offset.norm_squared())
    }

    /// Whether one of the two would have hidden the other when that was seen.
    fn hides(&self, in_part_mm: &Vector3<f64>, frame: usize, view: &ViewPoint, patch: &Patch) -> bool {
        let seen_at = if view.depth_mm > patch.view.depth_mm { frame } else { patch.frame as usize };
        let from = &self.shifts_mm[seen_at];
        let offset =
            self.outlook.seen_from(from, in_part_mm).xy_mm - self.outlook.seen_from(from, &patch.in_part_mm).xy_mm;
        self.grid.within(&offset)
    }

    /// Bias and RMS of every pair of orders over the smooth surface both have seen.
    pub fn self_consistency(&self, profiles: &[Profile], orders: &[i8]) -> Vec<OrderPair> {
        let mut orders = orders.to_vec();
        orders.sort_unstable();
        let per_frame: Vec<Vec<Sums>> = profiles
            .par_iter()
            .enumerate()
            .map(|(frame, profile)| self.differences_of(profile, frame, &orders))
            .collect();
        let mut totals = vec![Sums::default(); orders.len() * orders.len()];
        for frame in per_frame {
            for (total, sums) in totals.iter_mut().zip(frame) {
                total.n += sums.n;
                total.sum += sums.sum;
                total.squares += sums.squares;
            }
        }
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

    /// Sums over one frame's points, by (lower order, own order).
    fn differences_of(&self, profile: &Profile, frame: usize, orders: &[i8]) -> Vec<Sums> {
        let mut sums = vec![Sums::default(); orders.len() * orders.len()];
        let place = |order: i8| orders.binary_search(&order).ok();
        for point in profile.points.iter().step_by(COMPARE_STRIDE_PX) {
            let view = self.outlook.view_of(&(point.hit_in_camera.xyz - self.shifts_mm[frame]));
            let mut nearest: Vec<Option<(f64, usize)>> = vec![None; orders.len()];
            self.grid.for_each_near(&view.xy_mm, |idx, distance| {
                let patch = &self.patches[idx];
                let Some(slot) = place(patch.order) else { return };
                if patch.order < point.order
                    && patch.smooth
                    && nearest[slot].is_none_or(|(best, _)| distance < best)
                {
                    nearest[slot] = Some((distance, idx));
                }
            });
            let Some(own) = place(point.order) else { continue };
            for (slot, found) in nearest.iter().enumerate() {
                let Some((_, idx)) = found else { continue };
                let (apart, tolerance) = self.difference(point, &view, &self.patches[*idx]);
                if apart.abs() <= tolerance * CONTRADICTION_TOLERANCES {
                    sums[slot * orders.len() + own].add(apart);
                }
            }
        }
        sums
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: usize,
    sum: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, value: f64) {
        self.n += 1;
        self.sum += value;
        self.squares += value * value;
    }
}

/// No point of this order in this column (row).
const ABSENT: u32 = u32::MAX;

/// Points by frame, order and scan column (row).
struct Lookup<'a> {
    profiles: Vec<(usize, &'a Profile)>,
    orders: &'a [i8],
    direction: LineDirection,
    n_along: usize,
    slots: Vec<u32>,
}

impl<'a> Lookup<'a> {
    fn new(
        profiles: &'a [Profile],
        travel_order: &[usize],
        direction: LineDirection,
        calibration: &'a Calibration,
    ) -> Self {
        let n_along = match direction {
            LineDirection::Rows => calibration.camera.width_px,
            LineDirection::Columns => calibration.camera.height_px,
        };
        let profiles: Vec<(usize, &Profile)> =
            travel_order.iter().map(|&frame| (frame, &profiles[frame])).collect();
        let orders = &calibration.orders[..];
        let mut lookup = Self {
            orders,
            direction,
            n_along,
            slots: vec![ABSENT; profiles.len() * orders.len() * n_along],
            profiles,
        };
        for place in 0..lookup.profiles.len() {
            let profile = lookup.profiles[place].1;
            for (idx, point) in profile.points.iter().enumerate() {
                if let Some(slot) = lookup.slot(place, point.order, lookup.along(point)) {
                    lookup.slots[slot] = idx as u32;
                }
            }
        }
        lookup
    }

    fn along(&self, point: &ProfilePoint) -> i64 {
        along_across(&point.seen, self.direction).0.round() as i64
    }

    fn slot(&self, place: usize, order: i8, along: i64) -> Option<usize> {
        let order = self.orders.iter().position(|&candidate| candidate == order)?;
        let along = usize::try_from(along).ok().filter(|&along| along < self.n_along)?;
        Some((place * self.orders.len() + order) * self.n_along + along)
    }

    fn find(&self, place: Option<usize>, order: i8, along: i64) -> Option<&'a ProfilePoint> {
        let place = place.filter(|&place| place < self.profiles.len())?;
        let idx = self.slots[self.slot(place, order, along)?];
        (idx != ABSENT).then(|| &self.profiles[place].1.points[idx as usize])
    }

    /// The patches of one frame, every few columns.
    fn patches_of(&self, place: usize, shifts_mm: &[Vector3<f64>], outlook: &Outlook) -> Vec<Patch> {
        let (frame, profile) = self.profiles[place];
        let stride = COMPARE_STRIDE_PX as i64;
        let on_grid = profile.points.iter().filter(|point| self.along(point) % stride == 0);
        let patch = |point: &ProfilePoint| {
            let along = self.along(point);
            let in_part = |place: Option<usize>, along: i64| {
                let point = self.find(place, point.order, along)?;
                Some(point.hit_in_camera.xyz - shifts_mm[self.profiles[place?].0])
            };
            let centre = point.hit_in_camera.xyz - shifts_mm[frame];
            let line = [in_part(Some(place), along - stride)?, in_part(Some(place), along + stride)?];
            let travel = [in_part(place.checked_sub(1), along)?, in_part(Some(place + 1), along)?];
            let view = outlook.view_of(&centre);
            let gradient = gradient(&line.map(|p| outlook.view_of(&p)), &travel.map(|p| outlook.view_of(&p)))?;
            let bend = |ends: &[Vector3<f64>; 2]| (ends[0].z + ends[1].z - 2.0 * centre.z).abs();
            // A second difference has √6 times the noise of one point.
            let limit = SMOOTH_SIGMAS * 6f64.sqrt() * point.noise_sigma_mm;
            let smooth = bend(&line) <= limit && bend(&travel) <= limit;
            let (order, sigma_mm, frame) = (point.order, point.noise_sigma_mm, frame as u32);
            Some(Patch { in_part_mm: centre, view, gradient, sigma_mm, order, frame, smooth })
        };
        on_grid.filter_map(patch).collect()
    }
}

/// Slope of depth over the view; `None` where line and travel are parallel or the surface is too steep.
fn gradient(line: &[ViewPoint; 2], travel: &[ViewPoint; 2]) -> Option<Vector2<f64>> {
    let tangent = |ends: &[ViewPoint; 2]| {
        let across = ends[1].xy_mm - ends[0].xy_mm;
        Vector3::new(across.x, across.y, ends[1].depth_mm - ends[0].depth_mm)
    };
    let (line, travel) = (tangent(line), tangent(travel));
    crate::label::gradient(&line, &travel).filter(|gradient| gradient.norm() <= PATCH_MAX_GRADIENT)
}
