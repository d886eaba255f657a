//! Minimum cut: the set of nodes that is changed at the lowest cost.
//!
//! Each node is changed or not; a change has a cost of its own, and there is a cost if one of two nodes is changed and
//! the other is not. The flow that saturates the minimum cut is kept, so that the cost of one more forced change is
//! found by augmenting it. (Dinitz 1970; min-marginals from residual flow: Kohli and Torr 2008)

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
    /// Flow added since the last reset, newest last.
    flow: Vec<Flow>,
    /// Per node: distance from the changed nodes, in the present phase.
    level: Vec<u32>,
    next_edge: Vec<u32>,
    /// Memory used again: nodes in the sequence in which they were reached, and the edges of a path.
    reached: Vec<u32>,
    path: Vec<u32>,
}

/// Flow through an edge, or through the own cost of a node.
#[derive(Debug, Clone, Copy)]
enum Flow {
    Edge(u32, f64),
    Own(u32, f64),
}

/// Unreachable.
const UNREACHED: u32 = u32::MAX;

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
        for node in 0..n {
            first_edge[node + 1] += first_edge[node];
        }
        let mut free = first_edge.clone();
        let n_edges = 2 * edges.len();
        let (mut to, mut back, mut capacity) = (vec![0; n_edges], vec![0; n_edges], vec![0.0; n_edges]);
        for &(from, other, cost) in edges {
            let [there, here] = [from, other].map(|node| {
                let edge = free[node as usize];
                free[node as usize] += 1;
                edge
            });
            (to[there as usize], back[there as usize], capacity[there as usize]) = (other, here, cost);
            (to[here as usize], back[here as usize]) = (from, there);
        }
        let (level, next_edge) = (vec![UNREACHED; n], vec![0; n]);
        let (reached, path) = (Vec::with_capacity(n), Vec::new());
        let mut cut =
            Self { first_edge, to, back, capacity, own, flow: Vec::new(), level, next_edge, reached, path };
        cut.augment(None, f64::INFINITY);
        cut.flow.clear();
        cut
    }

    /// Whether each node belongs to the best set of changes.
    pub fn best(&mut self) -> Vec<bool> {
        self.levels(None);
        self.changed()
    }

    /// Whether each node is changed in the cheapest set of changes that includes `node`; `None` if that costs `limit`
    /// or more beyond the best set.
    pub fn best_with(&mut self, node: usize, limit: f64) -> Option<Vec<bool>> {
        let cost = self.augment(Some(node), limit);
        let set = (cost < limit).then(|| self.changed());
        while let Some(flow) = self.flow.pop() {
            match flow {
                Flow::Edge(edge, amount) => {
                    self.capacity[edge as usize] += amount;
                    self.capacity[self.back[edge as usize] as usize] -= amount;
                }
                Flow::Own(node, amount) => self.own[node as usize] += amount,
            }
        }
        set
    }

    /// Augments the flow from changed nodes (`forced`, or those with a gain) to unchanged ones, up to `limit`; returns
    /// the amount.
    fn augment(&mut self, forced: Option<usize>, limit: f64) -> f64 {
        let mut total = 0.0;
        while total < limit && self.levels(forced) {
            self.next_edge.copy_from_slice(&self.first_edge[..self.own.len()]);
            let sources = match forced {
                Some(node) => node..node + 1,
                None => 0..self.own.len(),
            };
            for source in sources {
                loop {
                    let most = if forced.is_some() { f64::INFINITY } else { -self.own[source] };
                    if most <= 0.0 || total >= limit {
                        break;
                    }
                    let amount = self.augment_path(source, most);
                    if amount == 0.0 {
                        break;
                    }
                    if forced.is_none() {
                        self.use_own_cost(source, -amount);
                    }
                    total += amount;
                }
            }
        }
        total
    }

    /// Computes the distances of the nodes from the changed ones over edges with residual cost; returns whether a
    /// node with a cost of its own is reached.
    fn levels(&mut self, forced: Option<usize>) -> bool {
        self.level.fill(UNREACHED);
        let mut queue = std::mem::take(&mut self.reached);
        queue.clear();
        for node in 0..self.own.len() {
            if forced.map_or(self.own[node] < 0.0, |forced| forced == node) {
                self.level[node] = 0;
                queue.push(node as u32);
            }
        }
        let (mut found, mut next) = (false, 0);
        while let Some(&node) = queue.get(next) {
            next += 1;
            let node = node as usize;
            found |= self.own[node] > 0.0;
            for edge in self.first_edge[node]..self.first_edge[node + 1] {
                let other = self.to[edge as usize] as usize;
                if self.capacity[edge as usize] > 0.0 && self.level[other] == UNREACHED {
                    self.level[other] = self.level[node] + 1;
                    queue.push(other as u32);
                }
            }
        }
        self.reached = queue;
        found
    }

    /// Augments along one shortest path from `source`, by at most `most`; zero if there is none.
    fn augment_path(&mut self, source: usize, most: f64) -> f64 {
        let mut path = std::mem::take(&mut self.path);
        path.clear();
        let mut at = source;
        let amount = loop {
            if self.own[at] > 0.0 {
                let least = path.iter().map(|&edge| self.capacity[edge as usize]).fold(most, f64::min);
                let amount = least.min(self.own[at]);
                for &edge in &path {
                    self.capacity[edge as usize] -= amount;
                    self.capacity[self.back[edge as usize] as usize] += amount;
                    self.flow.push(Flow::Edge(edge, amount));
                }
                self.use_own_cost(at, amount);
                break amount;
            }
            let is_ahead = |edge: &u32| {
                self.capacity[*edge as usize] > 0.0
                    && self.level[self.to[*edge as usize] as usize] == self.level[at] + 1
            };
            let end = self.first_edge[at + 1];
            let ahead = (self.next_edge[at]..end).find(is_ahead);
            self.next_edge[at] = ahead.unwrap_or(end);
            if let Some(edge) = ahead {
                path.push(edge);
                at = self.to[edge as usize] as usize;
            } else if let Some(last) = path.pop() {
                at = self.to[self.back[last as usize] as usize] as usize;
                self.next_edge[at] += 1;
            } else {
                break 0.0;
            }
        };
        self.path = path;
        amount
    }

    fn use_own_cost(&mut self, node: usize, amount: f64) {
        self.own[node] -= amount;
        self.flow.push(Flow::Own(node as u32, amount));
    }

    /// The nodes reached in the last phase: the changed ones.
    fn changed(&self) -> Vec<bool> {
        self.level.iter().map(|level| *level != UNREACHED).collect()
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
        let cut_edges = edges.iter().filter(|(a, b, _)| changed[*a as usize] && !changed[*b as usize]);
        alone + cut_edges.map(|edge| edge.2).sum::<f64>()
    }

    fn all_sets() -> impl Iterator<Item = Vec<bool>> {
        (0..1u32 << N).map(|set| (0..N).map(|node| set >> node & 1 == 1).collect())
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
        let (mut n_expensive, mut n_cheap) = (0, 0);
        for _ in 0..60 {
            let (own, edges) = random(&mut rng);
            let mut cut = MinCut::new(own.clone(), &edges);
            let best = cut.best();
            for node in 0..N {
                let with = all_sets().filter(|set| set[node]).map(|set| cost(&own, &edges, &set));
                let extra = with.fold(f64::INFINITY, f64::min) - cost(&own, &edges, &best);
                match cut.best_with(node, 3.0) {
                    None => {
                        assert!(extra >= 3.0, "{extra}");
                        n_expensive += 1;
                    }
                    Some(set) => {
                        // Nodes of the best set are changed as well.
                        let set: Vec<bool> = set.iter().zip(&best).map(|(a, b)| *a || *b).collect();
                        assert!(set[node]);
                        assert_eq!(cost(&own, &edges, &set) - cost(&own, &edges, &best), extra);
                        n_cheap += 1;
                    }
                }
            }
            assert_eq!(cut.best(), best);
        }
        assert!(n_expensive > 50 && n_cheap > 50, "{n_expensive} {n_cheap}");
    }
}
