//! Repeated observations: whether another order, in another frame, observes the same surface at the same position
//! on the part.

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;

use super::evidence::{Evidence, Observation, quantised};
use super::hypotheses::{Hypothesis, Samples};
use super::patches::{PatchGrid, ViewPoint};
use super::reference_view::ReferenceView;
use super::tracks::Partners;
use crate::input::motions::FrameMotion;
use crate::label::pieces::Piece;
use crate::params::{
    AGREEMENT_SIGMAS, CLOSE_TOLERANCES, CONTRADICTION_TOLERANCES, PATCH_MAX_GRADIENT, PATCH_RADIUS_SPACINGS,
    SAME_ORDER_MIN_FRAMES, SAMPLE_STRIDE_PX, SMOOTH_SIGMAS,
};

/// Inputs of the comparison.
pub struct Scene<'a> {
    /// Samples of all pieces.
    pub samples: &'a Samples,
    /// All pieces.
    pub pieces: &'a [Piece],
    /// The same line in neighbouring frames.
    pub partners: &'a Partners,
    /// Per frame: its rank along the travel.
    pub travel_rank: &'a [usize],
    /// Per frame: the motion of the part.
    pub motions: &'a [FrameMotion],
    /// The reference view.
    pub reference_view: &'a ReferenceView,
}

/// A surface patch under one hypothesis.
struct Patch {
    in_part_mm: Vector3<f64>,
    view: ViewPoint,
    gradient: Vector2<f64>,
    sigma_mm: f64,
    piece: u32,
    label: u8,
    /// Rank of its frame along the travel.
    place: u32,
    /// Whether the surface continues smoothly on all four sides; otherwise it is not evidence against a
    /// hypothesis.
    interior: bool,
}

/// A term of a label with another piece: (label, other piece, its label, weight).
type PairwiseTerm = (u8, u32, u8, f64);

/// Adds agreements and contradictions between all hypotheses of different orders.
pub fn add_repeated_observations(evidence: &mut Evidence, scene: &Scene) {
    let reference_view = scene.reference_view;
    let step = reference_view.step_mm.norm() * reference_view.frame_stride() as f64;
    if !(step > 0.0 && step.is_finite()) {
        return;
    }
    let patches = scene.patches();
    let stride_mm = reference_view.column_mm * SAMPLE_STRIDE_PX as f64;
    // Samples of one line share their columns, so that the search radius along the line may be smaller than along the
    // travel.
    let radii = [stride_mm * PATCH_RADIUS_SPACINGS * 0.75, step * PATCH_RADIUS_SPACINGS];
    let grid = PatchGrid::new(patches.par_iter().map(|patch| patch.view.xy_mm), reference_view.step_mm, radii);
    let density = std::f64::consts::PI * radii[0] * radii[1] / (stride_mm * step);
    let observed: Vec<Vec<Observation>> = (0..scene.pieces.len())
        .into_par_iter()
        .map_init(Vec::new, |terms, piece| {
            scene.pairwise_terms(piece, &patches, &grid, terms);
            let observation = |&(own_label, piece, label, weight): &PairwiseTerm| Observation {
                piece,
                weight: quantised(weight / density),
                own_label,
                label,
            };
            terms.iter().map(observation).collect()
        })
        .collect();
    evidence.set_observations(observed);
}

impl Scene<'_> {
    fn place(&self, piece: usize) -> usize {
        self.travel_rank[self.pieces[piece].frame]
    }

    /// Patches of all hypotheses with known neighbours along the line and along the travel.
    fn patches(&self) -> Vec<Patch> {
        let stride = self.reference_view.frame_stride();
        let of_piece = |piece: usize| -> Vec<Patch> {
            let line = self.line(piece);
            self.samples.range(piece).flat_map(|idx| self.patches_of_sample(idx, &line)).collect()
        };
        let sampled =
            (0..self.pieces.len()).into_par_iter().filter(|&piece| self.place(piece).is_multiple_of(stride));
        let per_piece: Vec<Vec<Patch>> = sampled.map(of_piece).collect();
        per_piece.into_iter().flatten().collect()
    }

    /// Samples of a piece and of those that continue it.
    fn line(&self, piece: usize) -> std::ops::Range<usize> {
        let continues_smoothly = |piece: &Piece| piece.continues;
        let first =
            piece - self.pieces[..=piece].iter().rev().take_while(|piece| continues_smoothly(piece)).count();
        let last = piece + self.pieces[piece + 1..].iter().take_while(|piece| continues_smoothly(piece)).count();
        self.samples.range(first).start..self.samples.range(last).end
    }

    fn patches_of_sample(&self, idx: usize, of_piece: &std::ops::Range<usize>) -> Vec<Patch> {
        let sample = &self.samples.all[idx];
        let curvature_per_mm = self.reference_view.curvature_per_mm();
        let line = [(idx > of_piece.start).then(|| idx - 1), (idx + 1 < of_piece.end).then_some(idx + 1)];
        let travel = [self.partners.previous[idx], self.partners.next[idx]];
        let patch = |label: usize| {
            let hypothesis = self.samples.by_order(idx)[label].as_ref()?;
            let at = |other: Option<usize>| {
                Some(self.reference_view.view_of(&self.samples.by_order(other?)[label].as_ref()?.in_part_mm))
            };
            let view = self.reference_view.view_of(&hypothesis.in_part_mm);
            let (line, travel) = (line.map(at), travel.map(at));
            let gradient = gradient(&difference(&view, &line)?, &difference(&view, &travel)?)?;
            let interior =
                [line, travel].iter().all(|ends| is_smooth(&view, ends, hypothesis.sigma_mm, curvature_per_mm));
            Some(Patch {
                in_part_mm: hypothesis.in_part_mm,
                view,
                gradient,
                sigma_mm: hypothesis.sigma_mm,
                piece: sample.piece as u32,
                label: label as u8,
                place: self.place(sample.piece) as u32,
                interior,
            })
        };
        (0..self.samples.by_order(idx).len()).filter_map(patch).collect()
    }

    /// Replaces `terms` by the pairwise terms of one piece with all patches, merged and sorted.
    fn pairwise_terms(&self, piece: usize, patches: &[Patch], grid: &PatchGrid, terms: &mut Vec<PairwiseTerm>) {
        let share = crate::label::sample_weight(&self.pieces[piece]);
        terms.clear();
        for sample in self.samples.range(piece) {
            for (label, hypothesis) in self.samples.by_order(sample).iter().enumerate() {
                let Some(hypothesis) = hypothesis else { continue };
                for view in self.reference_view.views_of(&hypothesis.in_part_mm) {
                    grid.for_each_near(&view.xy_mm, |idx, _| {
                        let patch = &patches[idx];
                        let agreement_score = self.agreement_score(piece, label, hypothesis, &view, patch, grid);
                        if agreement_score != 0.0 {
                            terms.push((label as u8, patch.piece, patch.label, agreement_score * share));
                        }
                    });
                }
            }
        }
        terms.sort_by_key(|term| (term.0, term.1, term.2));
        terms.dedup_by(|next, kept| {
            let is_same = (next.0, next.1, next.2) == (kept.0, kept.1, kept.2);
            if is_same {
                kept.3 += next.3;
            }
            is_same
        });
    }

    /// In (0, 1]: the patch agrees; 0: no evidence; −1: it contradicts.
    fn agreement_score(
        &self,
        piece: usize,
        label: usize,
        hypothesis: &Hypothesis,
        view: &ViewPoint,
        patch: &Patch,
        grid: &PatchGrid,
    ) -> f64 {
        let frames_apart = self.place(piece).abs_diff(patch.place as usize);
        let same_order = usize::from(patch.label) == label;
        if frames_apart == 0
            || same_order && frames_apart < SAME_ORDER_MIN_FRAMES * self.reference_view.frame_stride()
        {
            return 0.0;
        }
        let ratio = distance_in_tolerances(hypothesis, view, patch, self.reference_view);
        if ratio < CLOSE_TOLERANCES && !same_order {
            return 1.0 - (ratio / CLOSE_TOLERANCES).powi(2);
        }
        let contradicted = ratio > CONTRADICTION_TOLERANCES && patch.interior;
        if contradicted && self.occludes(piece, hypothesis, view, patch, grid) { -1.0 } else { 0.0 }
    }

    /// Whether the nearer of the two would have occluded the other when that was observed.
    fn occludes(
        &self,
        piece: usize,
        hypothesis: &Hypothesis,
        view: &ViewPoint,
        patch: &Patch,
        grid: &PatchGrid,
    ) -> bool {
        let farther = if view.depth_mm > patch.view.depth_mm { piece } else { patch.piece as usize };
        let motion = &self.motions[self.pieces[farther].frame];
        let seen = |in_part_mm: &Vector3<f64>| self.reference_view.seen_from(motion, in_part_mm).xy_mm;
        grid.within(&(seen(&hypothesis.in_part_mm) - seen(&patch.in_part_mm)))
    }
}

/// Distance in depth between a hypothesis and a patch, in tolerances.
fn distance_in_tolerances(
    hypothesis: &Hypothesis,
    view: &ViewPoint,
    patch: &Patch,
    reference_view: &ReferenceView,
) -> f64 {
    let offset = view.xy_mm - patch.view.xy_mm;
    let apart = (view.depth_mm - patch.view.depth_mm - patch.gradient.dot(&offset)).abs();
    let tolerance = AGREEMENT_SIGMAS * (hypothesis.sigma_mm.powi(2) + patch.sigma_mm.powi(2)).sqrt()
        + reference_view.floor_mm
        + 0.5 * reference_view.curvature_per_mm() * offset.norm_squared();
    apart / tolerance
}

/// Difference (x, y, depth) from one neighbour to the other, or between the point and its only neighbour.
fn difference(at: &ViewPoint, ends: &[Option<ViewPoint>; 2]) -> Option<Vector3<f64>> {
    if ends[0].is_none() && ends[1].is_none() {
        return None;
    }
    let [from, to] = ends.map(|end| end.unwrap_or(*at));
    let across = to.xy_mm - from.xy_mm;
    Some(Vector3::new(across.x, across.y, to.depth_mm - from.depth_mm))
}

/// Gradient of depth over the view from two tangents; `None` if they are parallel or the patch is too steep.
pub fn gradient(along: &Vector3<f64>, travel: &Vector3<f64>) -> Option<Vector2<f64>> {
    let normal = along.cross(travel);
    let gradient = Vector2::new(-normal.x / normal.z, -normal.y / normal.z);
    let spread = along.xy().norm() * travel.xy().norm();
    (normal.z.abs() > 0.1 * spread && gradient.norm() <= PATCH_MAX_GRADIENT).then_some(gradient)
}

/// Whether both neighbours exist and the surface passes them without a bend beyond noise and curvature.
fn is_smooth(at: &ViewPoint, ends: &[Option<ViewPoint>; 2], sigma_mm: f64, curvature_per_mm: f64) -> bool {
    let [Some(from), Some(to)] = ends else { return false };
    let bend = (from.depth_mm + to.depth_mm - 2.0 * at.depth_mm).abs();
    let reach = 0.25 * (to.xy_mm - from.xy_mm).norm_squared();
    // A second difference has √6 times the noise of one point.
    bend <= SMOOTH_SIGMAS * 6f64.sqrt() * sigma_mm + curvature_per_mm * reach
}
