//! The second look: does another order, from another frame, see the same surface at the same place?

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;

use super::evidence::Evidence;
use super::hypotheses::{Hypothesis, Samples};
use super::patches::{PatchGrid, ViewPoint};
use super::pieces::Piece;
use super::tracks::Partners;
use crate::params::{
    AGREEMENT_SIGMAS, CONTRADICTION_TOLERANCES, PATCH_CURVATURE_PER_MM, PATCH_MAX_GRADIENT, PATCH_RADIUS_SPACINGS,
    SAME_ORDER_MIN_FRAMES, SAMPLE_STRIDE_PX,
};

/// How the scan looks at the part.
#[derive(Debug, Clone, Copy)]
pub struct Outlook {
    /// From the part frame to the camera in the middle of the scan: add this.
    pub middle_shift_mm: Vector3<f64>,
    /// Depth at which distances across the view are measured.
    pub reference_depth_mm: f64,
    /// Travel per frame as the camera sees it in (x, y), mm; zero if the stage does not move across the view.
    pub step_mm: Vector2<f64>,
    /// Width of a scan column (row) at the reference depth, mm.
    pub column_mm: f64,
    /// Smallest difference between two orders that counts, mm.
    pub floor_mm: f64,
}

impl Outlook {
    /// A point of the part as seen from the middle of the scan.
    pub fn view_of(&self, in_part_mm: &Vector3<f64>) -> ViewPoint {
        self.seen_from(&self.middle_shift_mm, in_part_mm)
    }

    /// A point of the part as seen while the stage has moved it by `shift_mm`.
    pub fn seen_from(&self, shift_mm: &Vector3<f64>, in_part_mm: &Vector3<f64>) -> ViewPoint {
        let seen = in_part_mm + shift_mm;
        ViewPoint { xy_mm: seen.xy() * (self.reference_depth_mm / seen.z), depth_mm: seen.z }
    }

    /// Every how many frames a line is asked: steps much finer than the samples along the line add nothing.
    pub fn frame_stride(&self) -> usize {
        let sample_mm = self.column_mm * SAMPLE_STRIDE_PX as f64;
        ((sample_mm / 4.0 / self.step_mm.norm()) as usize).max(1)
    }
}

/// A surface patch under one hypothesis.
struct Patch {
    in_part_mm: Vector3<f64>,
    view: ViewPoint,
    gradient: Vector2<f64>,
    sigma_mm: f64,
    piece: u32,
    label: u32,
    /// Frame by travel.
    frame: u32,
}

/// Adds agreements and contradictions between all hypotheses of different orders.
pub fn add_second_looks(
    evidence: &mut Evidence,
    samples: &Samples,
    pieces: &[Piece],
    partners: &Partners,
    travel_rank: &[usize],
    shifts_mm: &[Vector3<f64>],
    outlook: &Outlook,
) {
    let step = outlook.step_mm.norm() * outlook.frame_stride() as f64;
    if !(step > 0.0 && step.is_finite()) {
        return;
    }
    let patches = patches(samples, pieces, partners, travel_rank, outlook);
    let stride_mm = outlook.column_mm * SAMPLE_STRIDE_PX as f64;
    let radii = [stride_mm * PATCH_RADIUS_SPACINGS * 0.75, step * PATCH_RADIUS_SPACINGS];
    let grid = PatchGrid::new(patches.iter().map(|patch| patch.view.xy_mm), outlook.step_mm, radii);
    let density = std::f64::consts::PI * radii[0] * radii[1] / (stride_mm * step);
    let links: Vec<Vec<(u32, u32, u32, f64)>> = (0..pieces.len())
        .into_par_iter()
        .map(|piece| links_of(piece, samples, pieces, travel_rank, shifts_mm, outlook, &patches, &grid))
        .collect();
    for (piece, links) in links.into_iter().enumerate() {
        for (label, other, other_label, weight) in links {
            evidence.add_testimony(
                (piece, label as usize),
                (other as usize, other_label as usize),
                weight / density,
            );
        }
    }
}

/// Patches of all hypotheses whose surroundings are known along the line and along the travel.
fn patches(
    samples: &Samples,
    pieces: &[Piece],
    partners: &Partners,
    travel_rank: &[usize],
    outlook: &Outlook,
) -> Vec<Patch> {
    let stride = outlook.frame_stride();
    let per_piece: Vec<Vec<Patch>> = (0..pieces.len())
        .into_par_iter()
        .filter(|&piece| travel_rank[pieces[piece].frame].is_multiple_of(stride))
        .map(|piece| {
            let range = samples.range(piece);
            let frame = travel_rank[pieces[piece].frame] as u32;
            let mut found = Vec::new();
            for idx in range.clone() {
                for (label, hypothesis) in samples.all[idx].by_order.iter().enumerate() {
                    let Some(hypothesis) = hypothesis else { continue };
                    let at = |other: Option<usize>| {
                        other
                            .and_then(|other| samples.all[other].by_order[label])
                            .map(|h| outlook.view_of(&h.in_part_mm))
                    };
                    let before = (idx > range.start).then(|| idx - 1);
                    let after = (idx + 1 < range.end).then_some(idx + 1);
                    let view = outlook.view_of(&hypothesis.in_part_mm);
                    let along = difference(&view, at(before), at(after));
                    let travel = difference(&view, at(partners.previous[idx]), at(partners.next[idx]));
                    let gradient = along.zip(travel).and_then(|(along, travel)| gradient(&along, &travel));
                    let Some(gradient) = gradient else { continue };
                    let (piece, label) = (piece as u32, label as u32);
                    found.push(Patch {
                        in_part_mm: hypothesis.in_part_mm,
                        view,
                        gradient,
                        sigma_mm: hypothesis.sigma_mm,
                        piece,
                        label,
                        frame,
                    });
                }
            }
            found
        })
        .collect();
    per_piece.into_iter().flatten().collect()
}

/// From one neighbour to the other, or between the point and its only neighbour: (x, y, depth).
fn difference(at: &ViewPoint, before: Option<ViewPoint>, after: Option<ViewPoint>) -> Option<Vector3<f64>> {
    if before.is_none() && after.is_none() {
        return None;
    }
    let (from, to) = (before.unwrap_or(*at), after.unwrap_or(*at));
    let across = to.xy_mm - from.xy_mm;
    Some(Vector3::new(across.x, across.y, to.depth_mm - from.depth_mm))
}

/// Slope of depth over the view from two tangents; `None` if they are parallel or the patch is too steep.
pub fn gradient(along: &Vector3<f64>, travel: &Vector3<f64>) -> Option<Vector2<f64>> {
    let normal = along.cross(travel);
    let gradient = Vector2::new(-normal.x / normal.z, -normal.y / normal.z);
    let spread = along.xy().norm() * travel.xy().norm();
    (normal.z.abs() > 0.1 * spread && gradient.norm() <= PATCH_MAX_GRADIENT).then_some(gradient)
}

/// Everything other patches say about one piece: (label, other piece, its label, weight), merged and sorted.
fn links_of(
    piece: usize,
    samples: &Samples,
    pieces: &[Piece],
    travel_rank: &[usize],
    shifts_mm: &[Vector3<f64>],
    outlook: &Outlook,
    patches: &[Patch],
    grid: &PatchGrid,
) -> Vec<(u32, u32, u32, f64)> {
    let frame = travel_rank[pieces[piece].frame];
    let stride = outlook.frame_stride();
    let share = super::sample_weight(&pieces[piece]);
    let mut links = Vec::new();
    for sample in samples.of_piece(piece) {
        for (label, hypothesis) in sample.by_order.iter().enumerate() {
            let Some(hypothesis) = hypothesis else { continue };
            let view = outlook.view_of(&hypothesis.in_part_mm);
            grid.for_each_near(&view.xy_mm, |idx, _| {
                let patch = &patches[idx];
                let apart = frame.abs_diff(patch.frame as usize);
                let same_order = patch.label as usize == label;
                if apart == 0 || same_order && apart < SAME_ORDER_MIN_FRAMES as usize * stride {
                    return;
                }
                let mut verdict = verdict(hypothesis, &view, patch, outlook.floor_mm);
                if verdict < 0.0 {
                    let seen_at = if view.depth_mm > patch.view.depth_mm { piece } else { patch.piece as usize };
                    let shift_mm = &shifts_mm[pieces[seen_at].frame];
                    let offset = outlook.seen_from(shift_mm, &hypothesis.in_part_mm).xy_mm
                        - outlook.seen_from(shift_mm, &patch.in_part_mm).xy_mm;
                    if !grid.within(&offset) {
                        verdict = 0.0;
                    }
                }
                if verdict < 0.0 || verdict > 0.0 && !same_order {
                    links.push((label as u32, patch.piece, patch.label, verdict * share));
                }
            });
        }
    }
    links.sort_by_key(|link| (link.0, link.1, link.2));
    links.dedup_by(|next, kept| {
        let same = (next.0, next.1, next.2) == (kept.0, kept.1, kept.2);
        if same {
            kept.3 += next.3;
        }
        same
    });
    links
}

/// +1 … 0: agrees; 0: says nothing; −1: contradicts.
fn verdict(hypothesis: &Hypothesis, view: &ViewPoint, patch: &Patch, floor_mm: f64) -> f64 {
    let offset = view.xy_mm - patch.view.xy_mm;
    let apart = (view.depth_mm - patch.view.depth_mm - patch.gradient.dot(&offset)).abs();
    let tolerance = AGREEMENT_SIGMAS * hypothesis.sigma_mm.hypot(patch.sigma_mm)
        + floor_mm
        + 0.5 * PATCH_CURVATURE_PER_MM * offset.norm_squared();
    let ratio = apart / tolerance;
    if ratio < 1.0 {
        1.0 - ratio * ratio
    } else if ratio > CONTRADICTION_TOLERANCES {
        -1.0
    } else {
        0.0
    }
}
