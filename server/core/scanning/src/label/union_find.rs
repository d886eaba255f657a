//! Union-find: disjoint sets of numbers.

/// Disjoint sets of the numbers 0 … n − 1; at first each is its own set.
#[derive(Debug, Clone)]
pub struct UnionFind {
    root: Vec<usize>,
}

impl UnionFind {
    /// For `n` numbers.
    pub fn new(n: usize) -> Self {
        Self { root: (0..n).collect() }
    }

    /// Merges the sets of `a` and `b`.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first_of(a), self.first_of(b));
        self.root[a.max(b)] = a.min(b);
    }

    /// The smallest number of the set.
    pub fn first_of(&mut self, mut number: usize) -> usize {
        while self.root[number] != number {
            self.root[number] = self.root[self.root[number]];
            number = self.root[number];
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_identified_by_its_smallest_number() {
        let mut groups = UnionFind::new(6);
        groups.join(5, 3);
        groups.join(4, 5);
        groups.join(0, 1);
        let firsts: Vec<usize> = (0..6).map(|number| groups.first_of(number)).collect();
        assert_eq!(firsts, [0, 0, 2, 3, 3, 3]);
        groups.join(1, 4);
        assert_eq!(groups.first_of(3), 0);
    }
}
