//! Every sheet on its own: what would it cost if its label were another and all others gave way?

use super::sheet_graph::SheetGraph;
use super::trial::Trial;
use crate::label::gather::evidence::Evidence;
use crate::params::{
    CHALLENGE_MARGIN, CHALLENGE_MARGIN_UNSEEN, CHALLENGE_MARGIN_WITHOUT_RANKS, PIECES_PER_TASK,
    RANK_ONLY_LENGTH_PITCHES, SEEN_SHARE,
};
use crate::threads::map_with;

/// Per piece: whether its sheet is in doubt. `lengths_pitches`: how far each sheet reaches along the line.
///
/// `moving`: the stage moves, so that second looks were possible.
pub fn challenged(
    evidence: &Evidence,
    labels: &[usize],
    sheets: &[usize],
    lengths_pitches: &[f64],
    moving: bool,
) -> Vec<bool> {
    let graph = SheetGraph::new(evidence, labels, sheets, true);
    let unranked = moving.then(|| SheetGraph::new(evidence, labels, sheets, false));
    let in_doubt = |(trial, unranked): &mut (Trial, Option<Trial>), sheet: usize| {
        let is_short = moving && lengths_pitches[sheet] < RANK_ONLY_LENGTH_PITCHES;
        let is_unseen =
            is_short && graph.second_looks(sheet, graph.labels[sheet]) < SEEN_SHARE * graph.sizes[sheet];
        let margin = if is_unseen { CHALLENGE_MARGIN_UNSEEN } else { CHALLENGE_MARGIN };
        let rival = trial.rival(sheet, margin, |_| true);
        rival.or_else(|| {
            let trial = unranked.as_mut().filter(|_| is_short)?;
            let graph = trial.graph;
            let plausible = |rival| graph.is_seen_again(sheet, rival);
            trial.rival(sheet, CHALLENGE_MARGIN_WITHOUT_RANKS, plausible).map(|_| Vec::new())
        })
    };
    let trials = || (Trial::new(&graph), unranked.as_ref().map(Trial::new));
    let rivals = map_with(graph.labels.len(), PIECES_PER_TASK, trials, in_doubt);
    let mut doubtful: Vec<bool> = rivals.iter().map(Option::is_some).collect();
    if moving {
        // These change their order whenever the doubtful sheet does. In a single frame they would be nearly everything.
        rivals.iter().flatten().flatten().for_each(|&sheet| doubtful[sheet] = true);
    }
    sheets.iter().map(|&sheet| doubtful[sheet]).collect()
}
