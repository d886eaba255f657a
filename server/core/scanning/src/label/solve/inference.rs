//! From evidence to labels: mean field, ICM (iterated conditional modes), then tests against other labellings
//! (`docs/maths/labelling.md`, "Inference").

use super::conditional_modes::{ConditionalModes, largest};
use super::interval_bounds::IntervalBounds;
use super::overlooked::with_overlooked_surfaces;
use super::shift_together::shift_together;
use crate::label::gather::evidence::Evidence;
use crate::label::union_find::UnionFind;
use crate::params::{
    CONTINUITY_ALONE, GROUP_MARGIN, LABEL_MARGIN, MEAN_FIELD_ITERATIONS, MEAN_FIELD_SHARPNESS, OVERRULED_MARGIN,
    PIECES_PER_TASK, UNLABELLED_FROM,
};
use crate::threads::for_each_chunk;

/// The outcome of labelling for a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LabelOutcome {
    /// Index into the calibration's orders.
    Order(usize),
    /// Another label has about the same score.
    Doubtful,
    /// Every order is contradicted: a reflection, a ghost, a point outside the depth range.
    Contradicted,
}

/// The best label of every piece, and whether it is accepted. `confirmation`: score per sample that a label needs
/// from other pieces; where a repeated observation was possible, the absence of contradictions is not enough.
/// `doubtful_by_strip`: which pieces belong to doubtful strips under given labels. `bounds`: of a single frame.
pub fn label_outcomes(
    evidence: &Evidence,
    confirmation: Option<f64>,
    bounds: Option<&IntervalBounds>,
    doubtful_by_strip: impl Fn(&[usize]) -> Vec<bool>,
) -> (Vec<usize>, Vec<LabelOutcome>) {
    let (mut labels, doubtful_groups) = best_labels(evidence, bounds);
    if confirmation.is_some() {
        // In a single frame this adds nothing to the shifts of groups.
        shift_together(evidence, &mut labels);
    }
    let doubtful_by_strip = doubtful_by_strip(&labels);
    let (mut scores, mut without_bonds) = (Vec::new(), Vec::new());
    let doubtful: Vec<bool> = (0..evidence.n_pieces())
        .map(|piece| {
            if labels[piece] == evidence.none() {
                return false;
            }
            evidence.scores_given(piece, &labels, &mut scores);
            let unconfirmed = confirmation.is_some_and(|least| scores[labels[piece]] < least);
            evidence.scores_without_bonds(piece, &labels, &mut without_bonds);
            let without_bonds = &without_bonds[..evidence.none()];
            let label = labels[piece];
            doubtful_groups[piece]
                || doubtful_by_strip[piece]
                || unconfirmed
                || margin(&scores[..evidence.none()], label) < LABEL_MARGIN
                || margin(without_bonds, label) < -OVERRULED_MARGIN
                || confirmation.is_some()
                    && margin(without_bonds, label) < OVERRULED_MARGIN
                    && scores[label] < CONTINUITY_ALONE
        })
        .collect();
    let outcome = |(label, doubtful): (&usize, bool)| match *label {
        label if label == evidence.none() => LabelOutcome::Contradicted,
        _ if doubtful => LabelOutcome::Doubtful,
        label => LabelOutcome::Order(label),
    };
    let outcomes = labels.iter().zip(doubtful).map(outcome).collect();
    (labels, outcomes)
}

/// The best label of every piece, and whether it belongs to a group for which other labels are about as good.
/// `bounds`: of a single frame.
pub fn best_labels(evidence: &Evidence, bounds: Option<&IntervalBounds>) -> (Vec<usize>, Vec<bool>) {
    let mut labels = most_probable_labels(evidence, bounds);
    let doubtful = shift_groups(evidence, &mut labels);
    (labels, doubtful)
}

/// The better of [`best_labels`] and the improved `start`, with the missed surfaces. Mean field finds joint
/// changes of many pieces, but leaves wrong regions on slopes, where shifted surfaces agree.
pub fn best_labels_from(evidence: &Evidence, mut start: Vec<usize>) -> Vec<usize> {
    let improve = || ConditionalModes::new(evidence).improve(&mut start, &all_pieces(evidence));
    let ((), (updated, _)) = rayon::join(improve, || best_labels(evidence, None));
    let better = if total_score(evidence, &updated) > total_score(evidence, &start) { updated } else { start };
    with_overlooked_surfaces(evidence, better)
}

/// Mean-field marginals with slowly increasing sharpness (inverse temperature): every label's score is averaged
/// over the marginals of the other pieces.
///
/// While the others' labels are undecided, every order appears to be on the wrong side of some line, and "none" does
/// not: it takes part once the orders have converged.
fn mean_field_marginals(evidence: &Evidence) -> Vec<f64> {
    let n = evidence.n_labels;
    let mut marginals = vec![1.0 / n as f64; evidence.n_pieces() * n];
    let mut updated = marginals.clone();
    for round in 0..MEAN_FIELD_ITERATIONS {
        let progress = round as f64 / (MEAN_FIELD_ITERATIONS - 1) as f64;
        let sharpness =
            MEAN_FIELD_SHARPNESS[0] * (MEAN_FIELD_SHARPNESS[1] / MEAN_FIELD_SHARPNESS[0]).powf(progress);
        for_each_chunk(&mut updated, n, PIECES_PER_TASK, |piece, updated| {
            evidence.scores(piece, &marginals, updated);
            if progress < UNLABELLED_FROM {
                updated[evidence.none()] = f64::NEG_INFINITY;
            }
            softmax(updated, sharpness);
        });
        for (marginal, updated) in marginals.iter_mut().zip(&updated) {
            *marginal = 0.5 * (*marginal + updated);
        }
    }
    marginals
}

fn softmax(scores: &mut [f64], sharpness: f64) {
    let top = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    scores.iter_mut().for_each(|score| *score = ((*score - top) * sharpness).exp());
    let sum: f64 = scores.iter().sum();
    scores.iter_mut().for_each(|weight| *weight /= sum);
}

/// Labels of the largest marginals, improved by ICM. Those that the bounds prove are not inferred.
fn most_probable_labels(evidence: &Evidence, bounds: Option<&IntervalBounds>) -> Vec<usize> {
    let inferred = |evidence: &Evidence| -> Vec<usize> {
        mean_field_marginals(evidence).chunks_exact(evidence.n_labels).map(largest).collect()
    };
    let mut labels = match bounds {
        None => inferred(evidence),
        Some(bounds) => {
            let mut labels = bounds.certain_labels(evidence);
            let (open, pieces) = evidence.given(&labels);
            pieces.into_iter().zip(inferred(&open)).for_each(|(piece, label)| labels[piece] = Some(label));
            labels.into_iter().map(|label| label.expect("a piece without a certain label is open")).collect()
        }
    };
    ConditionalModes::new(evidence).improve(&mut labels, &all_pieces(evidence));
    labels
}

/// All pieces.
pub fn all_pieces(evidence: &Evidence) -> Vec<usize> {
    (0..evidence.n_pieces()).collect()
}

/// Score of a label minus that of the best other label, per sample.
fn margin(scores: &[f64], label: usize) -> f64 {
    let rivals = scores.iter().enumerate().filter(|(rival, _)| *rival != label);
    scores[label] - rivals.map(|(_, score)| *score).fold(f64::NEG_INFINITY, f64::max)
}

/// Shifts whole groups of mutually supporting pieces by one or more orders; a better labelling is adopted, one nearly
/// as good makes the group doubtful. Returns which pieces are doubtful.
///
/// Pieces of one group support each other, so that a common error is not visible in any single piece.
fn shift_groups(evidence: &Evidence, labels: &mut [usize]) -> Vec<bool> {
    let mut doubtful = vec![false; labels.len()];
    let mut modes = ConditionalModes::new(evidence);
    let n_orders = evidence.none() as isize;
    for group in groups(evidence, labels) {
        let of_group = |labels: &[usize]| -> Vec<usize> { group.iter().map(|&piece| labels[piece]).collect() };
        let kept = of_group(labels);
        let mut best = (group_score(evidence, labels, &group), kept.clone());
        let mut runner_up = f64::NEG_INFINITY;
        // A piece alone takes the best label given the others, however it was shifted.
        let shifts = if group.len() == 1 { 1..2 } else { 1 - n_orders..n_orders };
        for shift in shifts.filter(|shift| *shift != 0) {
            for (&piece, &label) in group.iter().zip(&kept) {
                let label = label as isize + shift;
                labels[piece] = if (0..n_orders).contains(&label) { label as usize } else { evidence.none() };
            }
            modes.improve(labels, &group);
            let rival = of_group(labels);
            if mostly_same(&rival, &kept) {
                continue;
            }
            let score = group_score(evidence, labels, &group);
            if score > best.0 {
                runner_up = best.0;
                best = (score, rival);
            } else {
                runner_up = runner_up.max(score);
            }
        }
        group.iter().zip(&best.1).for_each(|(&piece, &label)| labels[piece] = label);
        let size: f64 = group.iter().map(|&piece| evidence.sizes[piece]).sum();
        if best.0 - runner_up < GROUP_MARGIN * size {
            group.iter().for_each(|&piece| doubtful[piece] = true);
        }
    }
    doubtful
}

/// Whether most of a shifted group returned to its labels.
fn mostly_same(rival: &[usize], kept: &[usize]) -> bool {
    let same = rival.iter().zip(kept).filter(|(rival, kept)| rival == kept).count();
    2 * same > kept.len()
}

/// The total score of a labelling.
pub fn total_score(evidence: &Evidence, labels: &[usize]) -> f64 {
    group_score(evidence, labels, &all_pieces(evidence))
}

/// Total score of the labels of a group.
fn group_score(evidence: &Evidence, labels: &[usize], group: &[usize]) -> f64 {
    group.iter().map(|&piece| evidence.score(piece, labels[piece], labels) * evidence.sizes[piece]).sum()
}

/// Labelled pieces connected by pairs that support each other's labels.
fn groups(evidence: &Evidence, labels: &[usize]) -> Vec<Vec<usize>> {
    let mut unions = UnionFind::new(labels.len());
    for piece in 0..labels.len() {
        if labels[piece] == evidence.none() {
            continue;
        }
        for (other, label, weight) in evidence.terms_under(piece, labels[piece]) {
            if weight > 0.0 && labels[other] == label {
                unions.join(piece, other);
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); labels.len()];
    for piece in (0..labels.len()).filter(|&piece| labels[piece] != evidence.none()) {
        groups[unions.first_of(piece)].push(piece);
    }
    groups.retain(|group| !group.is_empty());
    groups
}
