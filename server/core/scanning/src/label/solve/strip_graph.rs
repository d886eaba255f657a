//! The evidence between surface strips: unary and pairwise terms, summed over their pieces.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use super::shifts::{Costs, Shifts};
use crate::label::gather::evidence::{Evidence, wrong_labels};
use crate::params::{PIECES_PER_TASK, REPEATED_OBSERVATION_SAMPLES, REPEATED_OBSERVATIONS_PER_SAMPLE};
use crate::threads::for_each_chunk;

/// Evidence between strips, without continuity.
pub struct StripGraph {
    /// The calibration's orders, then "none".
    pub n_labels: usize,
    /// Per strip: its size in full samples.
    pub sizes: Vec<f64>,
    /// Per strip and label: the unary term.
    pub own: Vec<f64>,
    /// Per strip and label: (other strip, its label, weight), both halves summed.
    pub pairs: Vec<Vec<(u32, u32, f64)>>,
    /// Per strip: the strips beside it, ascending.
    pub ranks: Vec<Vec<AdjacentStrip>>,
    /// Per strip and label: agreements (other strip, its label, weight).
    agreements: Vec<Vec<(u32, u32, f64)>>,
    /// Per strip: its current label.
    pub labels: Vec<usize>,
    /// Per number of orders, from −(n − 1) on: the best joint shift by that number.
    shifts: Vec<OnceLock<Shifts>>,
}

/// A strip that shares scan columns (rows) with another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdjacentStrip {
    /// The other strip.
    pub strip: usize,
    /// Whether it lies above (left of) the other.
    pub is_above: bool,
    /// Cost of two labels in the wrong order, both halves summed.
    pub cost: f64,
}

impl AdjacentStrip {
    /// Its labels that are in the wrong order relative to `label` of the other.
    pub fn wrong_labels(&self, label: usize, none: usize) -> std::ops::Range<usize> {
        wrong_labels(self.is_above, label, none)
    }
}

impl StripGraph {
    /// The evidence between pieces, summed strip by strip.
    pub fn new(evidence: &Evidence, labels: &[usize], strips: &[usize], with_ranks: bool) -> Self {
        let n_labels = evidence.n_labels;
        let n_strips = strips.iter().max().map_or(0, |last| last + 1);
        let mut sizes = vec![0.0; n_strips];
        let mut own = vec![0.0; n_strips * n_labels];
        let mut of_strip = vec![0; n_strips];
        let mut pairs: Vec<Vec<(u32, u32, f64)>> = vec![Vec::new(); n_strips * n_labels];
        let mut agreements = pairs.clone();
        for (piece, &strip) in strips.iter().enumerate() {
            sizes[strip] += evidence.sizes[piece];
            of_strip[strip] = labels[piece];
            let own_terms = &mut own[strip * n_labels..][..n_labels];
            for (own, unary) in own_terms.iter_mut().zip(&evidence.unary[piece * n_labels..]) {
                *own += unary;
            }
            for seen in evidence.observations(piece) {
                let (other, label, weight) = (strips[seen.piece as usize], seen.own_label, f64::from(seen.weight));
                if other == strip {
                    if seen.label == label {
                        own_terms[usize::from(label)] += weight;
                    }
                    continue;
                }
                let slots = [strip * n_labels + usize::from(label), other * n_labels + usize::from(seen.label)];
                pairs[slots[0]].push((other as u32, seen.label.into(), weight));
                pairs[slots[1]].push((strip as u32, label.into(), weight));
                if weight > 0.0 {
                    agreements[slots[0]].push((other as u32, seen.label.into(), weight));
                }
            }
        }
        let mut ranks: Vec<Vec<AdjacentStrip>> = vec![Vec::new(); n_strips];
        if with_ranks {
            for ((upper, lower), cost) in rank_costs(evidence, strips) {
                if upper == lower {
                    // Relative to itself every label is in the wrong order.
                    own[upper * n_labels..][..n_labels - 1].iter_mut().for_each(|own| *own -= cost);
                    continue;
                }
                ranks[upper].push(AdjacentStrip { strip: lower, is_above: false, cost });
                ranks[lower].push(AdjacentStrip { strip: upper, is_above: true, cost });
            }
            ranks.iter_mut().for_each(|beside| beside.sort_by_key(|beside| beside.strip));
        }
        for lists in [&mut pairs, &mut agreements] {
            for_each_chunk(lists, n_labels, PIECES_PER_TASK, |_, lists| lists.iter_mut().for_each(merge));
        }
        let shifts = (0..2 * n_labels).map(|_| OnceLock::new()).collect();
        Self { n_labels, sizes, own, pairs, ranks, agreements, labels: of_strip, shifts }
    }

    /// The label "none".
    pub fn none(&self) -> usize {
        self.n_labels - 1
    }

    /// The label that is `by` orders higher; "none" where there is no such order.
    pub fn shifted(&self, label: usize, by: isize) -> usize {
        label.checked_add_signed(by).filter(|label| *label < self.none()).unwrap_or(self.none())
    }

    /// The best joint shift by so many orders, computed on first use.
    pub fn shifts(&self, by: isize) -> &Shifts {
        let slot = (by + self.n_labels as isize) as usize;
        self.shifts[slot].get_or_init(|| self.costs(by).cut())
    }

    fn costs(&self, by: isize) -> Costs {
        let none = self.none();
        let labels_of = |strip: usize| [self.labels[strip], self.shifted(self.labels[strip], by)];
        let mut costs = Costs::new(self.labels.len());
        let mut of_strip: BTreeMap<usize, [[f64; 2]; 2]> = BTreeMap::new();
        for strip in (0..self.labels.len()).filter(|&strip| self.labels[strip] != none) {
            let [label, shifted] = labels_of(strip);
            costs.add_own(strip, [label, none, shifted].map(|label| -self.own[strip * self.n_labels + label]));
            for (is_shifted, label) in [label, shifted].into_iter().enumerate() {
                let mut add = |other: usize, other_shifted: usize, cost: f64| {
                    of_strip.entry(other).or_default()[is_shifted][other_shifted] += cost;
                };
                for &(other, other_label, weight) in self.pairs(strip, label) {
                    let other = other as usize;
                    if other > strip && self.labels[other] != none {
                        let theirs = labels_of(other).map(|theirs| theirs == other_label as usize);
                        (0..2).filter(|&state| theirs[state]).for_each(|state| add(other, state, -weight));
                    }
                }
                for beside in self.ranks[strip].iter().filter(|beside| beside.strip > strip) {
                    if self.labels[beside.strip] != none {
                        let wrong = beside.wrong_labels(label, none);
                        let theirs = labels_of(beside.strip).map(|theirs| wrong.contains(&theirs));
                        (0..2)
                            .filter(|&state| theirs[state])
                            .for_each(|state| add(beside.strip, state, beside.cost));
                    }
                }
            }
            for (other, cost) in std::mem::take(&mut of_strip) {
                costs.add_pair(strip, other, cost);
            }
        }
        costs
    }

    /// Pairs that support or contradict (strip, label).
    pub fn pairs(&self, strip: usize, label: usize) -> &[(u32, u32, f64)] {
        &self.pairs[strip * self.n_labels + label]
    }

    /// Agreement of other strips, with their current labels, with the surface that `label` would give this strip.
    pub fn repeated_observations(&self, strip: usize, label: usize) -> f64 {
        let agreeing = self.agreements[strip * self.n_labels + label].iter();
        agreeing.filter(|pair| self.labels[pair.0 as usize] == pair.1 as usize).map(|pair| pair.2).sum()
    }

    /// Whether that agreement is enough to make the label plausible.
    pub fn is_plausible(&self, strip: usize, label: usize) -> bool {
        self.repeated_observations(strip, label)
            >= (REPEATED_OBSERVATIONS_PER_SAMPLE * self.sizes[strip]).max(REPEATED_OBSERVATION_SAMPLES)
    }
}

/// Costs of two strips in the wrong order, (upper, lower), both halves summed.
fn rank_costs(evidence: &Evidence, strips: &[usize]) -> BTreeMap<(usize, usize), f64> {
    let mut costs = BTreeMap::new();
    for (piece, ranks) in evidence.ranks.iter().enumerate() {
        for rank in ranks.iter().filter(|rank| !rank.is_above) {
            let pair = (strips[piece], strips[rank.piece as usize]);
            *costs.entry(pair).or_insert(0.0) += 2.0 * f64::from(rank.cost);
        }
    }
    costs
}

/// Sums the weights of equal entries.
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
