//! Every sheet on its own: what would it cost if its label were another and all others gave way?

use std::collections::{BTreeMap, VecDeque};

use rayon::prelude::*;

use super::evidence::{Evidence, Kind};
use crate::params::{
    CHALLENGE_MARGIN, CHALLENGE_MARGIN_WITHOUT_RANKS, CHALLENGE_STEPS, PIECES_PER_TASK, RANK_ONLY_LENGTH_PITCHES,
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
    let unranked = moving.then(|| SheetGraph::new(evidence, labels, sheets, false));
    let in_doubt = |(trial, unranked): &mut (Trial, Option<Trial>), sheet: usize| {
        if trial.has_rival(sheet, CHALLENGE_MARGIN, |_| true) {
            return true;
        }
        let short = unranked.as_mut().filter(|_| lengths_pitches[sheet] < RANK_ONLY_LENGTH_PITCHES);
        short.is_some_and(|trial| {
            let graph = trial.graph;
            trial.has_rival(sheet, CHALLENGE_MARGIN_WITHOUT_RANKS, |rival| graph.is_seen_again(sheet, rival))
        })
    };
    let trials = || (Trial::new(&graph), unranked.as_ref().map(Trial::new));
    let n_sheets = graph.labels.len();
    let doubtful: Vec<bool> =
        (0..n_sheets).into_par_iter().with_min_len(PIECES_PER_TASK).map_init(trials, in_doubt).collect();
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
        if with_ranks {
            for ((upper, lower), cost) in rank_costs(evidence, sheets) {
                if upper == lower {
                    // Beside itself every label is in the wrong place.
                    own[upper * n_labels..][..n_labels - 1].iter_mut().for_each(|own| *own -= cost);
                    continue;
                }
                for upper_label in 0..evidence.none() {
                    for lower_label in 0..=upper_label {
                        let slots = [(upper, upper_label), (lower, lower_label)];
                        for [(sheet, label), (other, other_label)] in [slots, [slots[1], slots[0]]] {
                            pairs[sheet * n_labels + label].push((other as u32, other_label as u32, -cost));
                        }
                    }
                }
            }
        }
        let lists = pairs.par_iter_mut().with_min_len(PIECES_PER_TASK);
        lists.chain(agreements.par_iter_mut().with_min_len(PIECES_PER_TASK)).for_each(merge);
        Self { n_labels, sizes, own, pairs, agreements, labels: of_sheet }
    }

    fn none(&self) -> usize {
        self.n_labels - 1
    }

    /// What agrees and disagrees with (sheet, label).
    fn pairs(&self, sheet: usize, label: usize) -> &[(u32, u32, f64)] {
        &self.pairs[sheet * self.n_labels + label]
    }

    /// Whether other sheets, labelled as they are, see the surface that `label` would give this sheet.
    fn is_seen_again(&self, sheet: usize, label: usize) -> bool {
        let agreeing = self.agreements[sheet * self.n_labels + label].iter();
        let seen: f64 =
            agreeing.filter(|pair| self.labels[pair.0 as usize] == pair.1 as usize).map(|pair| pair.2).sum();
        seen >= (SECOND_LOOK_SHARE * self.sizes[sheet]).max(SECOND_LOOK_SAMPLES)
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

/// Tries other answers: one sheet has a rival label, others follow. Afterwards all labels are as before.
struct Trial<'a> {
    graph: &'a SheetGraph,
    labels: Vec<usize>,
    /// Per sheet and label: the sum of its pairs with the sheets' labels. Weights are multiples of what single precision
    /// resolves: their sums are exact in double precision, so that taking off gives back what was before.
    sums: Vec<f64>,
    /// Sheets whose label was changed, each once.
    changed: Vec<usize>,
    is_changed: Vec<bool>,
    waiting: VecDeque<usize>,
    queued: Vec<bool>,
    touched: Vec<usize>,
    /// How much worse it is than the answer in question.
    cost: f64,
}

impl<'a> Trial<'a> {
    fn new(graph: &'a SheetGraph) -> Self {
        let n_sheets = graph.labels.len();
        let sum = |pairs: &Vec<(u32, u32, f64)>| {
            let agreeing = pairs.iter().filter(|pair| graph.labels[pair.0 as usize] == pair.1 as usize);
            agreeing.map(|pair| pair.2).sum()
        };
        Self {
            graph,
            labels: graph.labels.clone(),
            sums: graph.pairs.iter().map(sum).collect(),
            changed: Vec::new(),
            is_changed: vec![false; n_sheets],
            waiting: VecDeque::new(),
            queued: vec![false; n_sheets],
            touched: Vec::new(),
            cost: 0.0,
        }
    }

    /// Whether another label of this sheet is nearly as good (by `margin` per sample) once the others have given way.
    fn has_rival(&mut self, sheet: usize, margin: f64, plausible: impl Fn(usize) -> bool) -> bool {
        let graph = self.graph;
        let label = graph.labels[sheet];
        if label == graph.none() {
            return false;
        }
        let limit = margin * graph.sizes[sheet];
        (0..graph.none()).filter(|&rival| rival != label && plausible(rival)).any(|rival| {
            [false, true].into_iter().any(|pushing| {
                self.change(sheet, rival);
                if pushing {
                    self.push_all(sheet);
                }
                let falls = self.falls_below(sheet, limit);
                self.take_back();
                falls
            })
        })
    }

    fn support(&self, sheet: usize, label: usize) -> f64 {
        let slot = sheet * self.graph.n_labels + label;
        self.graph.own[slot] + self.sums[slot]
    }

    fn change(&mut self, sheet: usize, label: usize) {
        self.cost += self.support(sheet, self.labels[sheet]) - self.support(sheet, label);
        self.relabel(sheet, label);
        if !std::mem::replace(&mut self.is_changed[sheet], true) {
            self.changed.push(sheet);
        }
    }

    fn relabel(&mut self, sheet: usize, label: usize) {
        let graph = self.graph;
        let before = std::mem::replace(&mut self.labels[sheet], label);
        for (label, sign) in [(before, -1.0), (label, 1.0)] {
            for &(other, other_label, weight) in graph.pairs(sheet, label) {
                self.sums[other as usize * graph.n_labels + other_label as usize] += sign * weight;
            }
        }
    }

    fn take_back(&mut self) {
        while let Some(sheet) = self.changed.pop() {
            self.is_changed[sheet] = false;
            self.relabel(sheet, self.graph.labels[sheet]);
        }
        self.cost = 0.0;
    }

    /// Shifts by as much whatever stands in the way of what has been shifted: a row of lines gives way only together.
    fn push_all(&mut self, pushing: usize) {
        let graph = self.graph;
        let (from, to) = (graph.labels[pushing], self.labels[pushing]);
        let mut waiting = VecDeque::from([pushing]);
        while let Some(sheet) = waiting.pop_front() {
            for &(other, label, weight) in graph.pairs(sheet, self.labels[sheet]) {
                let (other, label) = (other as usize, label as usize);
                let in_the_way = weight < 0.0 && label == self.labels[other];
                if !in_the_way || self.is_changed[other] || label == graph.none() {
                    continue;
                }
                let shifted = (label + to).checked_sub(from);
                self.change(other, shifted.filter(|&label| label < graph.none()).unwrap_or(graph.none()));
                waiting.push_back(other);
            }
        }
    }

    /// Lets every sheet that feels the changes take its best label, until nothing improves or the cost is below `limit`.
    fn falls_below(&mut self, tried: usize, limit: f64) -> bool {
        let graph = self.graph;
        let mut changed = self.changed.clone();
        changed.sort_unstable();
        for sheet in changed {
            self.queue_touched(sheet, graph.labels[sheet], self.labels[sheet]);
            self.queue(sheet);
        }
        for _ in 0..CHALLENGE_STEPS {
            if self.cost < limit {
                break;
            }
            let Some(other) = self.waiting.pop_front() else { break };
            self.queued[other] = false;
            if other == tried {
                continue;
            }
            let current = self.labels[other];
            let start = (current, self.support(other, current) + 1e-9);
            let (best, _) = (0..graph.n_labels)
                .map(|label| (label, self.support(other, label)))
                .fold(start, |best, next| if next.1 > best.1 { next } else { best });
            if best != current {
                self.change(other, best);
                self.queue_touched(other, current, best);
            }
        }
        while let Some(sheet) = self.waiting.pop_front() {
            self.queued[sheet] = false;
        }
        self.cost < limit
    }

    /// Puts the sheets that feel a change from one label to another in the queue.
    fn queue_touched(&mut self, sheet: usize, from: usize, to: usize) {
        let mut touched = std::mem::take(&mut self.touched);
        touched.clear();
        for label in [from, to] {
            touched.extend(self.graph.pairs(sheet, label).iter().map(|pair| pair.0 as usize));
        }
        touched.sort_unstable();
        touched.dedup();
        touched.iter().for_each(|&other| self.queue(other));
        self.touched = touched;
    }

    fn queue(&mut self, sheet: usize) {
        if !std::mem::replace(&mut self.queued[sheet], true) {
            self.waiting.push_back(sheet);
        }
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

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Evidence at random: lines in order, second looks that agree and deny.
    fn evidence(n_pieces: usize, rng: &mut Pcg64Mcg) -> Evidence {
        let mut evidence = Evidence::new(5, (0..n_pieces).map(|_| rng.random_range(0.5..8.0)).collect(), 0.4);
        for _ in 0..4 * n_pieces {
            let (a, b) = (rng.random_range(0..n_pieces), rng.random_range(0..n_pieces));
            if a < b {
                evidence.add_rank(a, b, rng.random_range(0.1..6.0));
                let labels = (rng.random_range(0..5), rng.random_range(0..5));
                evidence.add_testimony((a, labels.0), (b, labels.1), rng.random_range(-4.0..4.0));
            }
        }
        evidence
    }

    #[test]
    fn a_trial_leaves_nothing_behind_for_the_next() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut n_rivals = 0;
        for _ in 0..40 {
            let evidence = evidence(30, &mut rng);
            let labels: Vec<usize> = (0..30).map(|_| rng.random_range(0..6)).collect();
            let sheets: Vec<usize> = (0..30).map(|piece| piece / 2).collect();
            let graph = SheetGraph::new(&evidence, &labels, &sheets, true);
            let mut used = Trial::new(&graph);
            for sheet in 0..15 {
                let fresh = Trial::new(&graph).has_rival(sheet, CHALLENGE_MARGIN, |_| true);
                assert_eq!(used.has_rival(sheet, CHALLENGE_MARGIN, |_| true), fresh);
                n_rivals += usize::from(fresh);
            }
            assert_eq!(used.labels, graph.labels);
            assert!(!used.queued.contains(&true) && used.waiting.is_empty());
        }
        assert!((60..540).contains(&n_rivals), "{n_rivals} of 600 sheets have a rival");
    }

    #[test]
    fn sums_kept_while_labels_change_are_those_of_the_labels() {
        let mut rng = Pcg64Mcg::seed_from_u64(6);
        let evidence = evidence(30, &mut rng);
        let labels: Vec<usize> = (0..30).map(|_| rng.random_range(0..6)).collect();
        let graph = SheetGraph::new(&evidence, &labels, &(0..30).collect::<Vec<_>>(), true);
        let mut trial = Trial::new(&graph);
        for _ in 0..200 {
            trial.change(rng.random_range(0..30), rng.random_range(0..6));
        }
        for (slot, pairs) in graph.pairs.iter().enumerate() {
            let agreeing = pairs.iter().filter(|pair| trial.labels[pair.0 as usize] == pair.1 as usize);
            let sum: f64 = agreeing.map(|pair| pair.2).sum();
            assert!((trial.sums[slot] - sum).abs() < 1e-9, "slot {slot}: {} {sum}", trial.sums[slot]);
        }
    }
}
