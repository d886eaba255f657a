//! The set of lines that is best relabelled together, all by the same number of orders (`docs/maths/labelling.md`,
//! eq. 3).
//!
//! Every line keeps its label, loses it, or is shifted. A line is represented by two nodes that change in
//! sequence: from its label to none, and from none to the shifted label. Except for chance agreements, the cost of
//! two lines is no lower if only one of them is changed than if both or neither are, so that the cheapest set is a
//! minimum cut.

use super::min_cut::MinCut;

/// Change of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// It loses its label.
    Unlabelled,
    /// Its label is shifted.
    Shifted,
}

/// Costs of lines, alone and in pairs; agreement is negative.
#[derive(Debug, Clone, Default)]
pub struct Costs {
    /// Per line: [cost of having no label, cost of being shifted].
    own: Vec<[f64; 2]>,
    /// (changed, unchanged, cost): two nodes per line.
    edges: Vec<(u32, u32, f64)>,
}

impl Costs {
    /// For `n` lines, all zero.
    pub fn new(n: usize) -> Self {
        let until_unlabelled = (0..n as u32).map(|line| (2 * line + 1, 2 * line, f64::INFINITY));
        Self { own: vec![[0.0; 2]; n], edges: until_unlabelled.collect() }
    }

    /// Adds the costs of a single line that keeps its label, loses it, or is shifted.
    pub fn add_own(&mut self, line: usize, [kept, none, shifted]: [f64; 3]) {
        self.own[line][0] += none - kept;
        self.own[line][1] += shifted - none;
    }

    /// Adds the cost of two lines: `[first shifted][second shifted]`, zero if one has no label.
    pub fn add_pair(
        &mut self,
        first: usize,
        second: usize,
        [[neither, only_second], [only_first, both]]: [[f64; 2]; 2],
    ) {
        let (a, b) = (2 * first as u32, 2 * second as u32);
        // Agreement that is lost once either is unlabelled; contradiction that both avoid.
        if neither < 0.0 {
            self.own[second][0] -= neither;
            self.edges.push((a, b, -neither));
        } else {
            self.own[first][0] -= 0.5 * neither;
            self.own[second][0] -= 0.5 * neither;
        }
        if both < 0.0 {
            self.own[first][1] += both;
            self.edges.push((a + 1, b + 1, -both));
        } else {
            self.own[first][1] += 0.5 * both;
            self.own[second][1] += 0.5 * both;
        }
        for (cost, [(shifted, moved), (kept, stays)]) in
            [(only_first, [(first, a), (second, b)]), (only_second, [(second, b), (first, a)])]
        {
            if cost > 0.0 {
                self.edges.push((moved + 1, stays, cost));
            } else if cost < 0.0 {
                // Exact except where only the other is shifted.
                self.own[shifted][1] += cost;
                self.own[kept][1] -= cost;
            }
        }
    }

    /// Adds the cost of separating two lines of one label: half of it where one of them loses its label.
    pub fn add_bond(&mut self, first: usize, second: usize, cost: f64) {
        for (a, b) in [(first, second), (second, first)] {
            let (a, b) = (2 * a as u32, 2 * b as u32);
            self.edges.push((a, b, 0.5 * cost));
            self.edges.push((a + 1, b + 1, 0.5 * cost));
        }
    }

    /// The minimum cut for these costs.
    pub fn cut(self) -> Shifts {
        let mut edges = self.edges;
        edges.retain(|edge| edge.2 > 0.0);
        Shifts { cut: MinCut::new(self.own.into_flattened(), &edges) }
    }
}

/// The best set of changes, and the best sets that include a given change.
#[derive(Debug, Clone)]
pub struct Shifts {
    cut: MinCut,
}

impl Shifts {
    /// The best set of changes.
    pub fn best(&mut self) -> Vec<(usize, Change)> {
        changes(&self.cut.best())
    }

    /// The cheapest set of changes in which `line` is shifted, unless it costs `limit` or more beyond the best set.
    pub fn best_with(&mut self, line: usize, limit: f64) -> Option<Vec<(usize, Change)>> {
        Some(changes(&self.cut.best_with(2 * line + 1, limit)?))
    }
}

fn changes(nodes: &[bool]) -> Vec<(usize, Change)> {
    let of_line = |(line, nodes): (usize, &[bool])| match nodes {
        [_, true] => Some((line, Change::Shifted)),
        [true, _] => Some((line, Change::Unlabelled)),
        _ => None,
    };
    nodes.chunks_exact(2).enumerate().filter_map(of_line).collect()
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const N: usize = 6;
    const KEPT: usize = 0;
    const NONE: usize = 1;
    const SHIFTED: usize = 2;

    struct Lines {
        own: Vec<[f64; 3]>,
        pairs: Vec<(usize, usize, [[f64; 2]; 2])>,
    }

    impl Lines {
        /// Lines that agree with each other unchanged or shifted, and conflict if only one is shifted.
        fn random(rng: &mut Pcg64Mcg) -> Self {
            let mut quarter = |low: i32, high: i32| 0.25 * f64::from(rng.random_range(low..high));
            let own = (0..N).map(|_| [quarter(-4, 1), quarter(-3, 2), quarter(-4, 2)]).collect();
            let mut pairs = Vec::new();
            for second in 1..N {
                for first in 0..second {
                    let cost = [[quarter(-1, 1), quarter(0, 20)], [quarter(0, 20), quarter(-1, 1)]];
                    pairs.push((first, second, cost));
                }
            }
            Self { own, pairs }
        }

        fn cost(&self, states: &[usize]) -> f64 {
            let alone: f64 = self.own.iter().zip(states).map(|(own, state)| own[*state]).sum();
            let labelled = self.pairs.iter().filter(|pair| states[pair.0] != NONE && states[pair.1] != NONE);
            let place = |state: usize| usize::from(state == SHIFTED);
            alone + labelled.map(|pair| pair.2[place(states[pair.0])][place(states[pair.1])]).sum::<f64>()
        }

        fn cut(&self) -> Shifts {
            let mut costs = Costs::new(N);
            self.own.iter().enumerate().for_each(|(line, own)| costs.add_own(line, *own));
            self.pairs.iter().for_each(|&(first, second, cost)| costs.add_pair(first, second, cost));
            costs.cut()
        }
    }

    fn states(changes: &[(usize, Change)]) -> Vec<usize> {
        let mut states = vec![KEPT; N];
        for &(line, change) in changes {
            states[line] = if change == Change::Shifted { SHIFTED } else { NONE };
        }
        states
    }

    fn all_states() -> impl Iterator<Item = Vec<usize>> {
        (0..3usize.pow(N as u32)).map(|mut code| {
            let digit = |_| {
                let digit = code % 3;
                code /= 3;
                digit
            };
            (0..N).map(digit).collect()
        })
    }

    #[test]
    fn lines_are_kept_shifted_or_unlabelled_at_the_lowest_cost() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let mut seen = [0; 3];
        for _ in 0..40 {
            let lines = Lines::random(&mut rng);
            let best = states(&lines.cut().best());
            let least = all_states().map(|states| lines.cost(&states)).fold(f64::INFINITY, f64::min);
            assert_eq!(lines.cost(&best), least);
            best.iter().for_each(|state| seen[*state] += 1);
        }
        assert!(seen.iter().all(|n| *n > 10), "{seen:?}");
    }

    #[test]
    fn a_line_is_shifted_with_the_lines_that_make_it_cheapest() {
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        for _ in 0..20 {
            let lines = Lines::random(&mut rng);
            let mut shifts = lines.cut();
            let best = states(&shifts.best());
            for line in (0..N).filter(|&line| best[line] == KEPT) {
                let found = states(&shifts.best_with(line, f64::INFINITY).unwrap());
                // Changes of the best set are not listed again.
                let found: Vec<usize> = found.iter().zip(&best).map(|(a, b)| *a.max(b)).collect();
                let with = all_states().filter(|states| states[line] == SHIFTED).map(|states| lines.cost(&states));
                assert_eq!(found[line], SHIFTED);
                assert_eq!(lines.cost(&found), with.fold(f64::INFINITY, f64::min));
            }
        }
    }

    #[test]
    fn bonds_keep_shifted_lines_together() {
        let mut costs = Costs::new(3);
        costs.add_own(0, [0.0, 0.5, -1.0]);
        costs.add_own(1, [0.0, 0.5, 0.25]);
        costs.add_own(2, [0.0, 0.5, 3.0]);
        costs.add_bond(0, 1, 0.5);
        costs.add_bond(1, 2, 0.5);
        assert_eq!(costs.cut().best(), [(0, Change::Shifted)]);
    }
}
