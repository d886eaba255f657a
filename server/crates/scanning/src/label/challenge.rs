//! Every sheet on its own: what would it cost if its label were another and all others gave way?

use std::collections::{BTreeSet, VecDeque};

use rayon::prelude::*;

use super::evidence::{Evidence, Kind};
use crate::params::{
    CHALLENGE_MARGIN, CHALLENGE_MARGIN_WITHOUT_RANKS, CHALLENGE_STEPS, RANK_ONLY_LENGTH_PITCHES,
    SECOND_LOOK_SAMPLES, SECOND_LOOK_SHARE,
};

/// Evidence between sheets; continuity between them does not count.
struct SheetGraph {
    n_labels: usize,
    /// Per sheet: full samples.
    sizes: Vec<f64>,
    /// Per sheet and label: what the sheet says about itself.
    own: Vec<f64>,
    /// Per sheet and label: (other sheet, its label, weight), both halves added up.
    pairs: Vec<Vec<(u32, u32, f64)>>,
    /// Per sheet and label: agreements (other sheet, its label, weight).
    agreements: Vec<Vec<(u32, u32, f64)>>,
    labels: Vec<usize>,
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
    let unranked = SheetGraph::new(evidence, labels, sheets, false);
    let n_sheets = graph.labels.len();
    let in_doubt = |sheet: usize| {
        let short = moving && lengths_pitches[sheet] < RANK_ONLY_LENGTH_PITCHES;
        graph.has_rival(sheet, CHALLENGE_MARGIN, |_| true)
            || short
                && unranked
                    .has_rival(sheet, CHALLENGE_MARGIN_WITHOUT_RANKS, |rival| unranked.is_seen_again(sheet, rival))
    };
    let doubtful: Vec<bool> = (0..n_sheets).into_par_iter().map(in_doubt).collect();
    sheets.iter().map(|&sheet| doubtful[sheet]).collect()
}

impl SheetGraph {
    fn new(evidence: &Evidence, labels: &[usize], sheets: &[usize], with_ranks: bool) -> Self {
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
                    if pair.kind == Kind::Bond || pair.kind == Kind::Rank && !with_ranks {
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
        pairs.par_iter_mut().chain(agreements.par_iter_mut()).for_each(merge);
        Self { n_labels, sizes, own, pairs, agreements, labels: of_sheet }
    }

    fn none(&self) -> usize {
        self.n_labels - 1
    }

    fn support(&self, sheet: usize, label: usize, label_of: impl Fn(usize) -> usize) -> f64 {
        let slot = sheet * self.n_labels + label;
        let pairs = self.pairs[slot].iter().filter(|pair| label_of(pair.0 as usize) == pair.1 as usize);
        self.own[slot] + pairs.map(|pair| pair.2).sum::<f64>()
    }

    /// Whether another label of this sheet is nearly as good (by `margin` per sample) once the others have given way.
    fn has_rival(&self, sheet: usize, margin: f64, plausible: impl Fn(usize) -> bool) -> bool {
        let label = self.labels[sheet];
        if label == self.none() {
            return false;
        }
        let limit = margin * self.sizes[sheet];
        (0..self.none()).filter(|&rival| rival != label && plausible(rival)).any(|rival| {
            let alone = Answer::new(self, sheet, rival);
            if alone.falls_below(limit) {
                return true;
            }
            let mut pushed = Answer::new(self, sheet, rival);
            pushed.push_all();
            pushed.falls_below(limit)
        })
    }

    /// The sheets that feel a change from one label to another.
    fn touched(&self, sheet: usize, from: usize, to: usize) -> VecDeque<usize> {
        let slots = [from, to].map(|label| sheet * self.n_labels + label);
        let mut others: Vec<usize> =
            slots.iter().flat_map(|&slot| &self.pairs[slot]).map(|pair| pair.0 as usize).collect();
        others.sort_unstable();
        others.dedup();
        others.into()
    }

    /// Whether other sheets, labelled as they are, see the surface that `label` would give this sheet.
    fn is_seen_again(&self, sheet: usize, label: usize) -> bool {
        let agreeing = self.agreements[sheet * self.n_labels + label].iter();
        let seen: f64 =
            agreeing.filter(|pair| self.labels[pair.0 as usize] == pair.1 as usize).map(|pair| pair.2).sum();
        seen >= (SECOND_LOOK_SHARE * self.sizes[sheet]).max(SECOND_LOOK_SAMPLES)
    }
}

/// Another answer: one sheet has a rival label, others have followed.
struct Answer<'a> {
    graph: &'a SheetGraph,
    sheet: usize,
    rival: usize,
    labels: Vec<usize>,
    changed: BTreeSet<usize>,
    /// How much worse it is than the answer in question.
    cost: f64,
}

impl<'a> Answer<'a> {
    fn new(graph: &'a SheetGraph, sheet: usize, rival: usize) -> Self {
        let mut answer =
            Self { graph, sheet, rival, labels: graph.labels.clone(), changed: BTreeSet::new(), cost: 0.0 };
        answer.change(sheet, rival);
        answer
    }

    fn label(&self, sheet: usize) -> usize {
        self.labels[sheet]
    }

    fn support(&self, sheet: usize, label: usize) -> f64 {
        self.graph.support(sheet, label, |other| self.labels[other])
    }

    fn change(&mut self, sheet: usize, label: usize) {
        self.cost += self.support(sheet, self.label(sheet)) - self.support(sheet, label);
        self.labels[sheet] = label;
        self.changed.insert(sheet);
    }

    /// Shifts by as much whatever stands in the way of what has been shifted: a row of lines gives way only together.
    fn push_all(&mut self) {
        let graph = self.graph;
        let mut waiting = VecDeque::from([self.sheet]);
        while let Some(sheet) = waiting.pop_front() {
            let slot = sheet * graph.n_labels + self.label(sheet);
            for &(other, label, weight) in &graph.pairs[slot] {
                let other = other as usize;
                let in_the_way = weight < 0.0 && label as usize == self.label(other);
                if !in_the_way || self.changed.contains(&other) || label as usize == graph.none() {
                    continue;
                }
                let shifted = (label as usize + self.rival).checked_sub(graph.labels[self.sheet]);
                self.change(other, shifted.filter(|&label| label < graph.none()).unwrap_or(graph.none()));
                waiting.push_back(other);
            }
        }
    }

    /// Lets every sheet that feels the changes take its best label, until nothing improves or the cost is below `limit`.
    fn falls_below(mut self, limit: f64) -> bool {
        let graph = self.graph;
        let mut waiting = VecDeque::new();
        for &sheet in &self.changed {
            waiting.extend(graph.touched(sheet, graph.labels[sheet], self.labels[sheet]));
            waiting.push_back(sheet);
        }
        let mut queued = vec![false; graph.labels.len()];
        waiting.retain(|&sheet| !std::mem::replace(&mut queued[sheet], true));
        for _ in 0..CHALLENGE_STEPS {
            let Some(other) = waiting.pop_front().filter(|_| self.cost >= limit) else { break };
            queued[other] = false;
            if other == self.sheet {
                continue;
            }
            let current = self.label(other);
            let start = (current, self.support(other, current) + 1e-9);
            let (best, _) = (0..graph.n_labels)
                .map(|label| (label, self.support(other, label)))
                .fold(start, |best, next| if next.1 > best.1 { next } else { best });
            if best != current {
                self.change(other, best);
                for touched in graph.touched(other, current, best) {
                    if !std::mem::replace(&mut queued[touched], true) {
                        waiting.push_back(touched);
                    }
                }
            }
        }
        self.cost < limit
    }
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
