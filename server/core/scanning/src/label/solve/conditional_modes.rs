//! ICM (iterated conditional modes; J. Besag 1986): every piece takes its best label given the others, until none changes.

use crate::label::gather::evidence::Evidence;
use crate::params::MAX_SWEEPS;

/// ICM over some of the pieces; its memory is used again.
///
/// A piece is evaluated again only if a label that its score depends on has changed: the result is that of sweeps over all
/// pieces. Labels of some pieces may alternate for ever, beside many that have converged.
pub struct ConditionalModes<'a> {
    evidence: &'a Evidence,
    states: Vec<State>,
    scores: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Keeps its label.
    NotChosen,
    /// Has its best label.
    Settled,
    /// May have a better label.
    Stale,
}

impl<'a> ConditionalModes<'a> {
    /// For this evidence.
    pub fn new(evidence: &'a Evidence) -> Self {
        Self { evidence, states: vec![State::NotChosen; evidence.n_pieces()], scores: Vec::new() }
    }

    /// Improves the labels of `chosen`, in their order.
    pub fn improve(&mut self, labels: &mut [usize], chosen: &[usize]) {
        chosen.iter().for_each(|&piece| self.states[piece] = State::Stale);
        for _ in 0..MAX_SWEEPS {
            if !self.sweep(labels, chosen) {
                break;
            }
        }
        chosen.iter().for_each(|&piece| self.states[piece] = State::NotChosen);
    }

    /// Evaluates the stale pieces once; whether a label has changed.
    fn sweep(&mut self, labels: &mut [usize], chosen: &[usize]) -> bool {
        let mut changed = false;
        for &piece in chosen {
            if self.states[piece] != State::Stale {
                continue;
            }
            self.states[piece] = State::Settled;
            self.evidence.scores_given(piece, labels, &mut self.scores);
            let best = largest(&self.scores);
            if best == labels[piece] {
                continue;
            }
            labels[piece] = best;
            changed = true;
            for other in self.evidence.dependents(piece) {
                if self.states[other] == State::Settled {
                    self.states[other] = State::Stale;
                }
            }
        }
        changed
    }
}

/// Index of the largest value, the first of equals.
pub fn largest(values: &[f64]) -> usize {
    let mut best = 0;
    for (idx, value) in values.iter().enumerate() {
        if *value > values[best] {
            best = idx;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::label::gather::evidence::{Observation, quantised};

    const N_PIECES: usize = 60;
    const N_ORDERS: usize = 5;

    /// Random evidence of all kinds, with observations in one direction only.
    fn evidence(rng: &mut Pcg64Mcg) -> Evidence {
        let mut evidence = Evidence::new(N_ORDERS, vec![1.0; N_PIECES], 0.4);
        let mut seen: Vec<Vec<Observation>> = vec![Vec::new(); N_PIECES];
        for _ in 0..4 * N_PIECES {
            let (a, b) = (rng.random_range(0..N_PIECES), rng.random_range(0..N_PIECES));
            if a < b {
                evidence.add_rank(a, b, rng.random_range(0.1..1.0));
            } else if a > b + 30 {
                evidence.add_bond(a, b, rng.random_range(0.1..1.0));
            }
            let [own_label, label] = [0, 1].map(|_| rng.random_range(0..N_ORDERS as u8));
            let weight = quantised(rng.random_range(-2.0..2.0));
            seen[a].push(Observation { piece: b as u32, weight, own_label, label });
        }
        evidence.set_observations(seen);
        evidence
    }

    #[test]
    fn labels_are_those_of_sweeps_over_all_chosen_pieces() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let (mut n_changed, mut n_alternating) = (0, 0);
        for _ in 0..50 {
            let evidence = evidence(&mut rng);
            let mut modes = ConditionalModes::new(&evidence);
            for _ in 0..4 {
                let chosen: Vec<usize> = (0..N_PIECES).filter(|_| rng.random_bool(0.8)).collect();
                let start: Vec<usize> = (0..N_PIECES).map(|_| rng.random_range(0..=N_ORDERS)).collect();
                let (mut expected, mut scores, mut n_sweeps) = (start.clone(), Vec::new(), 0);
                loop {
                    let before = expected.clone();
                    for &piece in &chosen {
                        evidence.scores_given(piece, &expected, &mut scores);
                        expected[piece] = largest(&scores);
                    }
                    n_sweeps += 1;
                    if n_sweeps == MAX_SWEEPS || expected == before {
                        break;
                    }
                }
                let mut labels = start.clone();
                modes.improve(&mut labels, &chosen);
                assert_eq!(labels, expected);
                n_changed += usize::from(labels != start);
                n_alternating += usize::from(n_sweeps == MAX_SWEEPS);
            }
        }
        assert!(n_changed > 150 && n_alternating > 10, "{n_changed}, {n_alternating}");
    }
}
