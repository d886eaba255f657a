//! Trial labellings: one strip takes a rival label, and all affected strips adapt.

use std::collections::{BTreeMap, VecDeque};

use super::shifts::{Change, Shifts};
use super::strip_graph::StripGraph;
use crate::params::{STRIP_TEST_MAX_UPDATES, STRIP_TEST_SHIFT_LIMITS};

/// Tries other labellings: one strip takes a rival label, others adapt. Afterwards all labels are restored.
pub struct Trial<'a> {
    /// The evidence.
    pub graph: &'a StripGraph,
    labels: Vec<usize>,
    /// Per strip and label: the sum of its pairs and ranks with the strips' labels. Weights are multiples of one number
    /// ([`crate::label::gather::evidence::quantised`]), so that sums are exact and subtraction restores them: the result
    /// does not depend on earlier trials of the same thread.
    sums: Vec<f64>,
    /// Strips whose label was changed, each once.
    changed: Vec<usize>,
    is_changed: Vec<bool>,
    pending: VecDeque<usize>,
    queued: Vec<bool>,
    affected: Vec<usize>,
    /// Per number of orders: the best joint shift.
    shifts: BTreeMap<isize, Shifts>,
    /// Additional cost compared with the current labelling.
    cost: f64,
}

impl<'a> Trial<'a> {
    /// A trial with the current labels.
    pub fn new(graph: &'a StripGraph) -> Self {
        let n_strips = graph.labels.len();
        let mut sums = vec![0.0; n_strips * graph.n_labels];
        for (strip, &label) in graph.labels.iter().enumerate() {
            add_pairs(&mut sums, graph, (strip, label), 1.0);
            add_ranks(&mut sums, graph, strip, (graph.none(), label));
        }
        Self {
            graph,
            labels: graph.labels.clone(),
            sums,
            changed: Vec::new(),
            is_changed: vec![false; n_strips],
            pending: VecDeque::new(),
            queued: vec![false; n_strips],
            affected: Vec::new(),
            shifts: BTreeMap::new(),
            cost: 0.0,
        }
    }

    /// Whether another label of this strip is nearly as good (within `margin` per sample) once the others have adapted:
    /// alone, or together with the best joint shift. If so, returns the smaller strips whose orders depend on it.
    pub fn rival(&mut self, strip: usize, margin: f64, plausible: impl Fn(usize) -> bool) -> Option<Vec<usize>> {
        let graph = self.graph;
        let label = graph.labels[strip];
        if label == graph.none() {
            return None;
        }
        let limit = margin * graph.sizes[strip];
        let is_candidate = |&rival: &usize| rival != label && plausible(rival);
        (0..graph.none()).filter(is_candidate).find_map(|rival| {
            [false, true].into_iter().find_map(|with_others| {
                self.change(strip, rival);
                let is_possible = !with_others || self.shift_others(strip, STRIP_TEST_SHIFT_LIMITS * limit);
                let is_rival = is_possible && self.adapts_below(strip, limit);
                let dependents = is_rival.then(|| self.smaller_dependents(strip));
                self.undo();
                dependents
            })
        })
    }

    /// The strips smaller than `strip` whose order has changed.
    fn smaller_dependents(&self, strip: usize) -> Vec<usize> {
        let graph = self.graph;
        let is_other = |&other: &usize| {
            let (before, now) = (graph.labels[other], self.labels[other]);
            before != now && now != graph.none() && graph.sizes[other] < graph.sizes[strip]
        };
        self.changed.iter().copied().filter(is_other).collect()
    }

    fn score(&self, strip: usize, label: usize) -> f64 {
        let slot = strip * self.graph.n_labels + label;
        self.graph.own[slot] + self.sums[slot]
    }

    fn change(&mut self, strip: usize, label: usize) {
        self.cost += self.score(strip, self.labels[strip]) - self.score(strip, label);
        self.relabel(strip, label);
        if !std::mem::replace(&mut self.is_changed[strip], true) {
            self.changed.push(strip);
        }
    }

    fn relabel(&mut self, strip: usize, label: usize) {
        let before = std::mem::replace(&mut self.labels[strip], label);
        add_pairs(&mut self.sums, self.graph, (strip, before), -1.0);
        add_pairs(&mut self.sums, self.graph, (strip, label), 1.0);
        add_ranks(&mut self.sums, self.graph, strip, (before, label));
    }

    fn undo(&mut self) {
        while let Some(strip) = self.changed.pop() {
            self.is_changed[strip] = false;
            self.relabel(strip, self.graph.labels[strip]);
        }
        self.cost = 0.0;
    }

    /// Shifts or unlabels other strips by the cheapest joint change; false if it costs `limit` or more.
    fn shift_others(&mut self, strip: usize, limit: f64) -> bool {
        let graph = self.graph;
        let by = self.labels[strip] as isize - graph.labels[strip] as isize;
        let shifts = self.shifts.entry(by).or_insert_with(|| graph.shifts(by).clone());
        let Some(changes) = shifts.best_with(strip, limit) else { return false };
        for (other, change) in changes.into_iter().filter(|(other, _)| *other != strip) {
            let label = match change {
                Change::Shifted => graph.shifted(graph.labels[other], by),
                Change::Unlabelled => graph.none(),
            };
            self.change(other, label);
        }
        true
    }

    /// Lets every affected strip take its best label, until nothing improves or the cost is below `limit`.
    fn adapts_below(&mut self, tried: usize, limit: f64) -> bool {
        let graph = self.graph;
        let mut changed = self.changed.clone();
        changed.sort_unstable();
        for strip in changed {
            self.queue_affected(strip, graph.labels[strip], self.labels[strip]);
            self.queue(strip);
        }
        for _ in 0..STRIP_TEST_MAX_UPDATES {
            if self.cost < limit {
                break;
            }
            let Some(other) = self.pending.pop_front() else { break };
            self.queued[other] = false;
            if other == tried {
                continue;
            }
            let current = self.labels[other];
            let start = (current, self.score(other, current) + 1e-9);
            let (best, _) = (0..graph.n_labels)
                .map(|label| (label, self.score(other, label)))
                .fold(start, |best, next| if next.1 > best.1 { next } else { best });
            if best != current {
                self.change(other, best);
                self.queue_affected(other, current, best);
            }
        }
        while let Some(strip) = self.pending.pop_front() {
            self.queued[strip] = false;
        }
        self.cost < limit
    }

    /// Queues the strips affected by a change from one label to another.
    fn queue_affected(&mut self, strip: usize, from: usize, to: usize) {
        let mut affected = std::mem::take(&mut self.affected);
        affected.clear();
        affected.extend(self.graph.ranks[strip].iter().map(|beside| beside.strip));
        let n_ranks = affected.len();
        for label in [from, to] {
            affected.extend(self.graph.pairs(strip, label).iter().map(|pair| pair.0 as usize));
        }
        if affected.len() > n_ranks {
            affected.sort_unstable();
        }
        affected.dedup();
        affected.iter().for_each(|&other| self.queue(other));
        self.affected = affected;
    }

    fn queue(&mut self, strip: usize) {
        if !std::mem::replace(&mut self.queued[strip], true) {
            self.pending.push_back(strip);
        }
    }
}

/// Adds the pairs of `label` of `strip` to the sums of the other strips, `sign` times.
fn add_pairs(sums: &mut [f64], graph: &StripGraph, (strip, label): (usize, usize), sign: f64) {
    for &(other, other_label, weight) in graph.pairs(strip, label) {
        sums[other as usize * graph.n_labels + other_label as usize] += sign * weight;
    }
}

/// Updates the rank costs of the strips beside `strip` after its label has changed; only labels between the old and the
/// new one are affected.
fn add_ranks(sums: &mut [f64], graph: &StripGraph, strip: usize, (before, label): (usize, usize)) {
    for beside in &graph.ranks[strip] {
        let sums = &mut sums[beside.strip * graph.n_labels..][..graph.n_labels];
        // Wrong labels above end with the last order, wrong labels below begin with the first: one boundary moves.
        let edge = |label| {
            let wrong = beside.wrong_labels(label, graph.none());
            if beside.is_above { wrong.start } else { wrong.end }
        };
        let (was, is) = (edge(before), edge(label));
        let freed = if (is > was) == beside.is_above { beside.cost } else { -beside.cost };
        sums[was.min(is)..was.max(is)].iter_mut().for_each(|sum| *sum += freed);
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::label::gather::evidence::{Evidence, Observation, quantised};
    use crate::params::STRIP_TEST_MARGIN;

    /// Random evidence: ranks, and repeated observations that agree or contradict.
    fn evidence(n_pieces: usize, rng: &mut Pcg64Mcg) -> Evidence {
        let mut evidence = Evidence::new(5, (0..n_pieces).map(|_| rng.random_range(0.5..8.0)).collect(), 0.4);
        let mut seen: Vec<Vec<Observation>> = vec![Vec::new(); n_pieces];
        for _ in 0..4 * n_pieces {
            let (a, b) = (rng.random_range(0..n_pieces), rng.random_range(0..n_pieces));
            if a < b {
                evidence.add_rank(a, b, rng.random_range(0.1..6.0) * magnitude(rng));
                let labels = (rng.random_range(0..5), rng.random_range(0..5));
                let weight = rng.random_range(-4.0..4.0) * magnitude(rng);
                let (own_label, label) = labels;
                seen[a].push(Observation { piece: b as u32, weight: quantised(weight), own_label, label });
            }
        }
        evidence.set_observations(seen);
        evidence
    }

    /// Factor for weights of very short and very long lines.
    fn magnitude(rng: &mut Pcg64Mcg) -> f64 {
        if rng.random_bool(0.7) { 1.0 } else { 10f64.powf(rng.random_range(-9.0..3.0)) }
    }

    /// Weight of two labels of two strips, including their ranks.
    fn weight(graph: &StripGraph, (strip, label): (usize, usize), (other, other_label): (usize, usize)) -> f64 {
        let pairs = graph.pairs(strip, label);
        let place = pairs.binary_search_by_key(&(other as u32, other_label as u32), |pair| (pair.0, pair.1));
        let ranks = &graph.ranks[strip];
        let first = ranks.partition_point(|beside| beside.strip < other);
        let beside = ranks[first..].iter().take_while(|beside| beside.strip == other);
        let wrong = beside.filter(|beside| beside.wrong_labels(label, graph.none()).contains(&other_label));
        place.map_or(0.0, |place| pairs[place].2) - wrong.map(|beside| beside.cost).sum::<f64>()
    }

    #[test]
    fn earlier_trials_do_not_affect_later_ones() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut n_rivals = 0;
        for _ in 0..40 {
            let evidence = evidence(30, &mut rng);
            let labels: Vec<usize> = (0..30).map(|_| rng.random_range(0..6)).collect();
            let strips: Vec<usize> = (0..30).map(|piece| piece / 2).collect();
            let graph = StripGraph::new(&evidence, &labels, &strips, true);
            let mut used = Trial::new(&graph);
            for strip in 0..15 {
                let fresh = Trial::new(&graph).rival(strip, STRIP_TEST_MARGIN, |_| true);
                assert_eq!(used.rival(strip, STRIP_TEST_MARGIN, |_| true), fresh);
                n_rivals += usize::from(fresh.is_some());
            }
            assert_eq!(used.labels, graph.labels);
            assert!(!used.queued.contains(&true) && used.pending.is_empty());
        }
        assert!((60..540).contains(&n_rivals), "{n_rivals} of 600 strips have a rival");
    }

    #[test]
    fn incremental_sums_match_the_labels() {
        let mut rng = Pcg64Mcg::seed_from_u64(6);
        let evidence = evidence(30, &mut rng);
        let labels: Vec<usize> = (0..30).map(|_| rng.random_range(0..6)).collect();
        let graph = StripGraph::new(&evidence, &labels, &(0..30).collect::<Vec<_>>(), true);
        let mut trial = Trial::new(&graph);
        for _ in 0..200 {
            trial.change(rng.random_range(0..30), rng.random_range(0..6));
        }
        for (slot, kept) in trial.sums.iter().enumerate() {
            let (strip, label) = (slot / graph.n_labels, slot % graph.n_labels);
            let others = trial.labels.iter().enumerate().filter(|(other, _)| *other != strip);
            let sum: f64 = others.map(|(other, &theirs)| weight(&graph, (strip, label), (other, theirs))).sum();
            assert!(*kept == sum, "slot {slot}: {kept} {sum}");
        }
    }

    #[test]
    fn sums_have_identical_bits_after_any_earlier_trials() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        for _ in 0..20 {
            let evidence = evidence(40, &mut rng);
            let labels: Vec<usize> = (0..40).map(|_| rng.random_range(0..6)).collect();
            let graph = StripGraph::new(&evidence, &labels, &(0..40).collect::<Vec<_>>(), true);
            let bits = |trial: &Trial| trial.sums.iter().map(|sum| (sum + 0.0).to_bits()).collect::<Vec<_>>();
            let fresh = bits(&Trial::new(&graph));
            let mut trial = Trial::new(&graph);
            for _ in 0..100 {
                trial.rival(rng.random_range(0..40), STRIP_TEST_MARGIN, |_| true);
            }
            assert!(bits(&trial) == fresh);
        }
    }

    #[test]
    fn the_doubtful_strips_do_not_depend_on_the_number_of_threads() {
        let mut rng = Pcg64Mcg::seed_from_u64(8);
        for _ in 0..5 {
            let evidence = evidence(400, &mut rng);
            let labels: Vec<usize> = (0..400).map(|_| rng.random_range(0..6)).collect();
            let strips: Vec<usize> = (0..400).collect();
            let lengths = vec![1.0; 400];
            let doubtful = |n_threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
                pool.install(|| {
                    super::super::strip_test::doubtful_by_strip(&evidence, &labels, &strips, &lengths, None)
                })
            };
            let alone = doubtful(1);
            assert!([2, 3, 8].into_iter().all(|n_threads| doubtful(n_threads) == alone));
        }
    }
}
