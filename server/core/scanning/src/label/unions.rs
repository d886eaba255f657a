//! What hangs together: numbers joined into groups.

/// Groups of the numbers 0 … n − 1; at first each is its own.
#[derive(Debug, Clone)]
pub struct Unions {
    root: Vec<usize>,
}

impl Unions {
    /// Of `n` numbers.
    pub fn new(n: usize) -> Self {
        Self { root: (0..n).collect() }
    }

    /// Makes one group of those of `a` and `b`.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first_of(a), self.first_of(b));
        self.root[a.max(b)] = a.min(b);
    }

    /// The smallest number of the group.
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
    fn a_group_is_named_by_its_smallest_number() {
        let mut unions = Unions::new(6);
        unions.join(5, 3);
        unions.join(4, 5);
        unions.join(0, 1);
        let firsts: Vec<usize> = (0..6).map(|number| unions.first_of(number)).collect();
        assert_eq!(firsts, [0, 0, 2, 3, 3, 3]);
        unions.join(1, 4);
        assert_eq!(unions.first_of(3), 0);
    }
}
