//! Every sheet on its own: what would it cost if its label were another and all others gave way?

use std::collections::BTreeMap;

use super::evidence::{Evidence, Kind, wrong_labels};
use super::trial::Trial;
use crate::params::{
    CHALLENGE_MARGIN, CHALLENGE_MARGIN_UNSEEN, CHALLENGE_MARGIN_WITHOUT_RANKS, PIECES_PER_TASK,
    RANK_ONLY_LENGTH_PITCHES, SECOND_LOOK_SAMPLES, SECOND_LOOK_SHARE, SEEN_SHARE,
};
use crate::threads::{for_each_chunk, map_with};

/// Evidence between sheets; continuity between them does not count.
pub struct SheetGraph {
    /// The calibration's orders, then "none".
    pub n_labels: usize,
    /// Per sheet: full samples.
    pub sizes: Vec<f64>,
    /// Per sheet and label: what the sheet says about itself.
    pub own: Vec<f64>,
    /// Per sheet and label: (other sheet, its label, weight), both halves added up.
    pub pairs: Vec<Vec<(u32, u32, f64)>>,
    /// Per sheet: the sheets beside it, ascending.
    pub ranks: Vec<Vec<Beside>>,
    /// Per sheet and label: agreements (other sheet, its label, weight).
    agreements: Vec<Vec<(u32, u32, f64)>>,
    /// Per sheet: the label in question.
    pub labels: Vec<usize>,
}

/// A sheet that shares scan columns (rows) with another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Which one.
    pub sheet: usize,
    /// Whether it lies above (left of) the other.
    pub is_above: bool,
    /// What two labels in the wrong order cost, both halves added up.
    pub cost: f64,
}

impl Beside {
    /// Its labels that are in the wrong order beside `label` of the other.
    pub fn wrong_labels(&self, label: usize, none: usize) -> std::ops::Range<usize> {
        wrong_labels(self.is_above, label, none)
    }
}

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
        if trial.has_rival(sheet, margin, |_| true) {
            return true;
        }
        let short = unranked.as_mut().filter(|_| is_short);
        short.is_some_and(|trial| {
            let graph = trial.graph;
            trial.has_rival(sheet, CHALLENGE_MARGIN_WITHOUT_RANKS, |rival| graph.is_seen_again(sheet, rival))
        })
    };
    let trials = || (Trial::new(&graph), unranked.as_ref().map(Trial::new));
    let doubtful = map_with(graph.labels.len(), PIECES_PER_TASK, trials, in_doubt);
    sheets.iter().map(|&sheet| doubtful[sheet]).collect()
}

impl SheetGraph {
    /// The evidence between pieces, added up sheet by sheet.
    pub fn new(evidence: &Evidence, labels: &[usize], sheets: &[usize], with_ranks: bool) -> Self {
        let n_labels = evidence.n_labels;
        let n_sheets = sheets.iter().max().map_or(0, |last| last + 1);
        let mut sizes = vec![0.0; n_sheets];
        let mut own = vec![0.0; n_sheets * n_labels];
        let mut of_sheet = vec![0; n_sheets];
        let mut pairs: Vec<Vec<(u32, u32, f64)>> = vec![Vec::new(); n_sheets * n_labels];
        let mut agreements = pairs.clone();
        for (piece, &sheet) in sheets.iter().enumerate() {
            sizes[sheet] += evidence.sizes[piece];
            of_sheet[sheet] = labels[piece];
            for label in 0..n_labels {
                own[sheet * n_labels + label] += evidence.single[piece * n_labels + label];
                for pair in &evidence.pairs[piece * n_labels + label] {
                    let other = sheets[pair.piece as usize];
                    let weight = f64::from(pair.weight);
                    if pair.kind == Kind::Bond {
                        continue;
                    }
                    if other == sheet {
                        if pair.label as usize == label {
                            own[sheet * n_labels + label] += weight;
                        }
                        continue;
                    }
                    let slots = [sheet * n_labels + label, other * n_labels + pair.label as usize];
                    pairs[slots[0]].push((other as u32, pair.label, weight));
                    pairs[slots[1]].push((sheet as u32, label as u32, weight));
                    if pair.kind == Kind::SecondLook && weight > 0.0 {
                        agreements[slots[0]].push((other as u32, pair.label, weight));
                    }
                }
            }
        }
        let mut ranks: Vec<Vec<Beside>> = vec![Vec::new(); n_sheets];
        if with_ranks {
            for ((upper, lower), cost) in rank_costs(evidence, sheets) {
                if upper == lower {
                    // Beside itself every label is in the wrong place.
                    own[upper * n_labels..][..n_labels - 1].iter_mut().for_each(|own| *own -= cost);
                    continue;
                }
                ranks[upper].push(Beside { sheet: lower, is_above: false, cost });
                ranks[lower].push(Beside { sheet: upper, is_above: true, cost });
            }
            ranks.iter_mut().for_each(|beside| beside.sort_by_key(|beside| beside.sheet));
        }
        for lists in [&mut pairs, &mut agreements] {
            for_each_chunk(lists, n_labels, PIECES_PER_TASK, |_, lists| lists.iter_mut().for_each(merge));
        }
        Self { n_labels, sizes, own, pairs, ranks, agreements, labels: of_sheet }
    }

    /// The label "none".
    pub fn none(&self) -> usize {
        self.n_labels - 1
    }

    /// What agrees and disagrees with (sheet, label).
    pub fn pairs(&self, sheet: usize, label: usize) -> &[(u32, u32, f64)] {
        &self.pairs[sheet * self.n_labels + label]
    }

    /// What two labels of two sheets weigh together, their ranks included.
    pub fn weight(&self, (sheet, label): (usize, usize), (other, other_label): (usize, usize)) -> f64 {
        let pairs = self.pairs(sheet, label);
        let place = pairs.binary_search_by_key(&(other as u32, other_label as u32), |pair| (pair.0, pair.1));
        let ranks = &self.ranks[sheet];
        let first = ranks.partition_point(|beside| beside.sheet < other);
        let beside = ranks[first..].iter().take_while(|beside| beside.sheet == other);
        let wrong = beside.filter(|beside| beside.wrong_labels(label, self.none()).contains(&other_label));
        place.map_or(0.0, |place| pairs[place].2) - wrong.map(|beside| beside.cost).sum::<f64>()
    }

    /// By how much other sheets, labelled as they are, see the surface that `label` would give this sheet.
    fn second_looks(&self, sheet: usize, label: usize) -> f64 {
        let agreeing = self.agreements[sheet * self.n_labels + label].iter();
        agreeing.filter(|pair| self.labels[pair.0 as usize] == pair.1 as usize).map(|pair| pair.2).sum()
    }

    /// Whether they see enough of it to make the label plausible.
    fn is_seen_again(&self, sheet: usize, label: usize) -> bool {
        self.second_looks(sheet, label) >= (SECOND_LOOK_SHARE * self.sizes[sheet]).max(SECOND_LOOK_SAMPLES)
    }
}

/// What two sheets cost in the wrong order, (upper, lower), both halves added up.
fn rank_costs(evidence: &Evidence, sheets: &[usize]) -> BTreeMap<(usize, usize), f64> {
    let mut costs = BTreeMap::new();
    for (piece, ranks) in evidence.ranks.iter().enumerate() {
        for rank in ranks.iter().filter(|rank| !rank.is_above) {
            let pair = (sheets[piece], sheets[rank.piece as usize]);
            *costs.entry(pair).or_insert(0.0) += 2.0 * f64::from(rank.cost);
        }
    }
    costs
}

/// Adds up the weights of equal entries.
fn merge(pairs: &mut Vec<(u32, u32, f64)>) {
    pairs.sort_by_key(|pair| (pair.0, pair.1));
    pairs.dedup_by(|next, kept| {
        let same = (next.0, next.1) == (kept.0, kept.1);
        if same {
            kept.2 += next.2;
        }
        same
    });
}
