//! Minimum cut: which of many nodes are best changed together?
//!
//! Each node is changed or not; a change has a cost of its own, and there is a cost if one of two nodes is changed and
//! the other is not. The flow that saturates the minimum cut is kept, so that the cost of one more forced change is
//! found by augmenting it. (Dinitz 1970; min-marginals from residual flow: Kohli and Torr 2008)

use std::collections::VecDeque;

/// Nodes, the costs of changing them, and the flow so far.
#[derive(Debug, Clone)]
pub struct MinCut {
    /// Per node: its first edge; one more entry than nodes.
    first_edge: Vec<u32>,
    /// Head of an edge.
    to: Vec<u32>,
    /// The reverse edge.
    back: Vec<u32>,
    /// Residual cost if the node is changed and the edge's head is not.
    capacity: Vec<f64>,
    /// Per node: residual cost of its own change; a gain if negative.
    own: Vec<f64>,
    /// Flow since the last restoration, newest last.
    charged: Vec<Charge>,
    /// Per node: distance from the changed nodes, in the present phase.
    level: Vec<u32>,
    next_edge: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
enum Charge {
    Edge(u32, f64),
    Own(u32, f64),
}

/// Unreachable.
const FAR: u32 = u32::MAX;

impl MinCut {
    /// `own`: the cost of every change alone; `edges`: (changed, unchanged, cost). The flow of the best set of changes
    /// is computed; later queries are relative to it.
    pub fn new(own: Vec<f64>, edges: &[(u32, u32, f64)]) -> Self {
        let n = own.len();
        let mut first_edge = vec![0u32; n + 1];
        for (from, to, _) in edges {
            first_edge[*from as usize + 1] += 1;
            first_edge[*to as usize + 1] += 1;
        }
        for thing in 0..n {
            first_edge[thing + 1] += first_edge[thing];
        }
        let mut free = first_edge.clone();
        let n_edges = 2 * edges.len();
        let (mut to, mut back, mut capacity) = (vec![0; n_edges], vec![0; n_edges], vec![0.0; n_edges]);
        for &(from, other, cost) in edges {
            let [there, here] = [from, other].map(|thing| {
                let edge = free[thing as usize];
                free[thing as usize] += 1;
                edge
            });
            (to[there as usize], back[there as usize], capacity[there as usize]) = (other, here, cost);
            (to[here as usize], back[here as usize]) = (from, there);
        }
        let (level, next_edge) = (vec![FAR; n], vec![0; n]);
        let mut cut = Self { first_edge, to, back, capacity, own, charged: Vec::new(), level, next_edge };
        cut.charge(None, f64::INFINITY);
        cut.charged.clear();
        cut
    }

    /// Whether each node belongs to the best set of changes.
    pub fn best(&mut self) -> Vec<bool> {
        self.levels(None);
        self.reached()
    }

    /// Whether each node is changed in the cheapest set of changes that includes `thing`; `None` if that costs `limit`
    /// or more beyond the best set.
    pub fn with(&mut self, thing: usize, limit: f64) -> Option<Vec<bool>> {
        let cost = self.charge(Some(thing), limit);
        let set = (cost < limit).then(|| self.reached());
        while let Some(charge) = self.charged.pop() {
            match charge {
                Charge::Edge(edge, amount) => {
                    self.capacity[edge as usize] += amount;
                    self.capacity[self.back[edge as usize] as usize] -= amount;
                }
                Charge::Own(thing, amount) => self.own[thing as usize] += amount,
            }
        }
        set
    }

    /// Augments the flow from changed nodes (`forced`, or those with a gain) to unchanged ones, up to `limit`; returns
    /// the amount.
    fn charge(&mut self, forced: Option<usize>, limit: f64) -> f64 {
        let mut total = 0.0;
        while total < limit && self.levels(forced) {
            self.next_edge.copy_from_slice(&self.first_edge[..self.own.len()]);
            let sources = match forced {
                Some(thing) => thing..thing + 1,
                None => 0..self.own.len(),
            };
            for source in sources {
                loop {
                    let most = if forced.is_some() { f64::INFINITY } else { -self.own[source] };
                    if most <= 0.0 || total >= limit {
                        break;
                    }
                    let amount = self.charge_way(source, most);
                    if amount == 0.0 {
                        break;
                    }
                    if forced.is_none() {
                        self.charge_own(source, -amount);
                    }
                    total += amount;
                }
            }
        }
        total
    }

    /// Distances of the nodes from the changed ones over edges with residual cost; whether a node with a cost of its
    /// own is reached.
    fn levels(&mut self, forced: Option<usize>) -> bool {
        self.level.fill(FAR);
        let mut waiting = VecDeque::new();
        for thing in 0..self.own.len() {
            if forced.map_or(self.own[thing] < 0.0, |forced| forced == thing) {
                self.level[thing] = 0;
                waiting.push_back(thing);
            }
        }
        let mut found = false;
        while let Some(thing) = waiting.pop_front() {
            found |= self.own[thing] > 0.0;
            for edge in self.first_edge[thing]..self.first_edge[thing + 1] {
                let other = self.to[edge as usize] as usize;
                if self.capacity[edge as usize] > 0.0 && self.level[other] == FAR {
                    self.level[other] = self.level[thing] + 1;
                    waiting.push_back(other);
                }
            }
        }
        found
    }

    /// Augments along one shortest path from `source`, by at most `most`; zero if there is none.
    fn charge_way(&mut self, source: usize, most: f64) -> f64 {
        let mut way: Vec<u32> = Vec::new();
        let mut at = source;
        loop {
            if self.own[at] > 0.0 {
                let least = way.iter().map(|&edge| self.capacity[edge as usize]).fold(most, f64::min);
                let amount = least.min(self.own[at]);
                for &edge in &way {
                    self.capacity[edge as usize] -= amount;
                    self.capacity[self.back[edge as usize] as usize] += amount;
                    self.charged.push(Charge::Edge(edge, amount));
                }
                self.charge_own(at, amount);
                return amount;
            }
            let is_ahead = |edge: &u32| {
                self.capacity[*edge as usize] > 0.0
                    && self.level[self.to[*edge as usize] as usize] == self.level[at] + 1
            };
            let end = self.first_edge[at + 1];
            let ahead = (self.next_edge[at]..end).find(is_ahead);
            self.next_edge[at] = ahead.unwrap_or(end);
            if let Some(edge) = ahead {
                way.push(edge);
                at = self.to[edge as usize] as usize;
            } else if let Some(last) = way.pop() {
                at = self.to[self.back[last as usize] as usize] as usize;
                self.next_edge[at] += 1;
            } else {
                return 0.0;
            }
        }
    }

    fn charge_own(&mut self, thing: usize, amount: f64) {
        self.own[thing] -= amount;
        self.charged.push(Charge::Own(thing as u32, amount));
    }

    /// The nodes reached in the last phase: the changed ones.
    fn reached(&self) -> Vec<bool> {
        self.level.iter().map(|level| *level != FAR).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const N: usize = 9;

    /// Costs that are multiples of a quarter, whose sums are exact.
    fn random(rng: &mut Pcg64Mcg) -> (Vec<f64>, Vec<(u32, u32, f64)>) {
        let own = (0..N).map(|_| 0.25 * f64::from(rng.random_range(-12..16))).collect();
        let edge = |rng: &mut Pcg64Mcg| {
            let (a, b) = (rng.random_range(0..N as u32), rng.random_range(0..N as u32));
            (a != b).then(|| (a, b, 0.25 * f64::from(rng.random_range(1..14))))
        };
        (own, (0..3 * N).filter_map(|_| edge(rng)).collect())
    }

    fn cost(own: &[f64], edges: &[(u32, u32, f64)], changed: &[bool]) -> f64 {
        let alone: f64 = own.iter().zip(changed).filter(|(_, changed)| **changed).map(|(own, _)| own).sum();
        let torn = edges.iter().filter(|(a, b, _)| changed[*a as usize] && !changed[*b as usize]);
        alone + torn.map(|edge| edge.2).sum::<f64>()
    }

    fn all_sets() -> impl Iterator<Item = Vec<bool>> {
        (0..1u32 << N).map(|set| (0..N).map(|thing| set >> thing & 1 == 1).collect())
    }

    #[test]
    fn the_best_changes_have_the_lowest_cost() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for _ in 0..60 {
            let (own, edges) = random(&mut rng);
            let least = all_sets().map(|set| cost(&own, &edges, &set)).fold(f64::INFINITY, f64::min);
            assert_eq!(cost(&own, &edges, &MinCut::new(own.clone(), &edges).best()), least);
        }
    }

    #[test]
    fn the_cost_of_one_more_change_is_found_and_does_not_affect_later_queries() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let (mut n_dear, mut n_cheap) = (0, 0);
        for _ in 0..60 {
            let (own, edges) = random(&mut rng);
            let mut cut = MinCut::new(own.clone(), &edges);
            let best = cut.best();
            for thing in 0..N {
                let with = all_sets().filter(|set| set[thing]).map(|set| cost(&own, &edges, &set));
                let beyond = with.fold(f64::INFINITY, f64::min) - cost(&own, &edges, &best);
                match cut.with(thing, 3.0) {
                    None => {
                        assert!(beyond >= 3.0, "{beyond}");
                        n_dear += 1;
                    }
                    Some(set) => {
                        // What belongs to the best set is changed, too.
                        let set: Vec<bool> = set.iter().zip(&best).map(|(a, b)| *a || *b).collect();
                        assert!(set[thing]);
                        assert_eq!(cost(&own, &edges, &set) - cost(&own, &edges, &best), beyond);
                        n_cheap += 1;
                    }
                }
            }
            assert_eq!(cut.best(), best);
        }
        assert!(n_dear > 50 && n_cheap > 50, "{n_dear} {n_cheap}");
    }
}
