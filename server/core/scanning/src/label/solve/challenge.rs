//! Challenge of every surface strip: the cost of another label once all other strips have adapted to it.

use super::strip_graph::StripGraph;
use super::trial::Trial;
use crate::label::gather::evidence::Evidence;
use crate::params::{
    CHALLENGE_MARGIN, CHALLENGE_MARGIN_UNSEEN, CHALLENGE_MARGIN_WITHOUT_RANKS, PIECES_PER_TASK,
    RANK_ONLY_LENGTH_PITCHES, SEEN_SHARE,
};
use crate::threads::map_with;

/// Per piece: whether its strip is doubtful. `lengths_pitches`: length of each strip along the line, in pitches.
///
/// `moving`: the stage moves, so that second looks were possible.
pub fn challenged(
    evidence: &Evidence,
    labels: &[usize],
    strips: &[usize],
    lengths_pitches: &[f64],
    moving: bool,
) -> Vec<bool> {
    let graph = StripGraph::new(evidence, labels, strips, true);
    let unranked = moving.then(|| StripGraph::new(evidence, labels, strips, false));
    let in_doubt = |(trial, unranked): &mut (Trial, Option<Trial>), strip: usize| {
        let is_short = moving && lengths_pitches[strip] < RANK_ONLY_LENGTH_PITCHES;
        let is_unseen =
            is_short && graph.second_looks(strip, graph.labels[strip]) < SEEN_SHARE * graph.sizes[strip];
        let margin = if is_unseen { CHALLENGE_MARGIN_UNSEEN } else { CHALLENGE_MARGIN };
        let rival = trial.rival(strip, margin, |_| true);
        rival.or_else(|| {
            let trial = unranked.as_mut().filter(|_| is_short)?;
            let graph = trial.graph;
            let plausible = |rival| graph.is_seen_again(strip, rival);
            trial.rival(strip, CHALLENGE_MARGIN_WITHOUT_RANKS, plausible).map(|_| Vec::new())
        })
    };
    let trials = || (Trial::new(&graph), unranked.as_ref().map(Trial::new));
    let rivals = map_with(graph.labels.len(), PIECES_PER_TASK, trials, in_doubt);
    let mut doubtful: Vec<bool> = rivals.iter().map(Option::is_some).collect();
    if moving {
        // These change their order whenever the doubtful strip does. In a single frame they would be nearly all of
        // them.
        rivals.iter().flatten().flatten().for_each(|&strip| doubtful[strip] = true);
    }
    strips.iter().map(|&strip| doubtful[strip]).collect()
}
