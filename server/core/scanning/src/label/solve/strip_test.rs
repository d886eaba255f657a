//! Test of every surface strip: the cost of another label once all other strips have adapted to it.

use super::interval_bounds::IntervalBounds;
use super::strip_graph::StripGraph;
use super::trial::Trial;
use crate::label::gather::evidence::Evidence;
use crate::params::{
    CONFIRMED_PER_SAMPLE, PIECES_PER_TASK, RANK_ONLY_LENGTH_PITCHES, STRIP_TEST_MARGIN,
    STRIP_TEST_MARGIN_UNCONFIRMED, STRIP_TEST_MARGIN_WITHOUT_RANKS,
};
use crate::threads::map_with;

/// Per piece: whether its strip is doubtful. `lengths_pitches`: length of each strip along the line, in pitches.
///
/// `bounds`: of a single frame, whose strips are its pieces; in a scan, repeated observations were possible.
pub fn doubtful_by_strip(
    evidence: &Evidence,
    labels: &[usize],
    strips: &[usize],
    lengths_pitches: &[f64],
    bounds: Option<&IntervalBounds>,
) -> Vec<bool> {
    let is_moving = bounds.is_none();
    let bounds = bounds.map(|bounds| (bounds, bounds.headroom(evidence, labels)));
    let is_possible = |strip: usize, rival: usize| {
        bounds.is_none_or(|(bounds, headroom)| {
            bounds.loss(strip, rival) - headroom < STRIP_TEST_MARGIN * evidence.sizes[strip]
        })
    };
    let graph = StripGraph::new(evidence, labels, strips, true);
    let unranked = is_moving.then(|| StripGraph::new(evidence, labels, strips, false));
    let dependents_of_rival = |(trial, unranked): &mut (Trial, Option<Trial>), strip: usize| {
        let is_short = is_moving && lengths_pitches[strip] < RANK_ONLY_LENGTH_PITCHES;
        let is_unconfirmed = is_short
            && graph.repeated_observations(strip, graph.labels[strip]) < CONFIRMED_PER_SAMPLE * graph.sizes[strip];
        let margin = if is_unconfirmed { STRIP_TEST_MARGIN_UNCONFIRMED } else { STRIP_TEST_MARGIN };
        let rival = trial.rival(strip, margin, |rival| is_possible(strip, rival));
        rival.or_else(|| {
            let trial = unranked.as_mut().filter(|_| is_short)?;
            let graph = trial.graph;
            let plausible = |rival| graph.is_plausible(strip, rival);
            trial.rival(strip, STRIP_TEST_MARGIN_WITHOUT_RANKS, plausible).map(|_| Vec::new())
        })
    };
    let trials = || (Trial::new(&graph), unranked.as_ref().map(Trial::new));
    let rivals = map_with(graph.labels.len(), PIECES_PER_TASK, trials, dependents_of_rival);
    let mut doubtful: Vec<bool> = rivals.iter().map(Option::is_some).collect();
    if is_moving {
        // These strips change their order whenever the doubtful strip does. In a single frame they would be nearly
        // all strips.
        rivals.iter().flatten().flatten().for_each(|&strip| doubtful[strip] = true);
    }
    strips.iter().map(|&strip| doubtful[strip]).collect()
}
