//! Shared memory that is reused once it has no owner.

use std::sync::Arc;

/// Values shared by any number of readers; a value without other owners can be taken and refilled.
pub struct Recycling<T> {
    free: Vec<Arc<T>>,
    lent: Vec<Arc<T>>,
}

impl<T> Default for Recycling<T> {
    fn default() -> Self {
        Self { free: Vec::new(), lent: Vec::new() }
    }
}

impl<T> Recycling<T> {
    /// A pool of `n` values.
    pub fn of(n: usize, make: impl Fn() -> T) -> Self {
        Self { free: (0..n).map(|_| Arc::new(make())).collect(), lent: Vec::with_capacity(n) }
    }

    /// Takes a value without other owners, the most recently used one if possible, so that few are touched when few are
    /// needed; `None` if every value is in use.
    pub fn take(&mut self) -> Option<Arc<T>> {
        let mut idx = 0;
        while idx < self.lent.len() {
            if Arc::strong_count(&self.lent[idx]) == 1 {
                self.free.push(self.lent.swap_remove(idx));
            } else {
                idx += 1;
            }
        }
        self.free.pop()
    }

    /// Registers a value that is shared from now on.
    pub fn lend(&mut self, value: &Arc<T>) {
        self.lent.push(value.clone());
    }

    /// Returns a taken value that is not needed.
    pub fn give_back(&mut self, value: Arc<T>) {
        self.lent.push(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_reused_after_its_last_reader() {
        let mut values = Recycling::of(2, || 0);
        let mut first = values.take().unwrap();
        *Arc::get_mut(&mut first).unwrap() = 7;
        values.lend(&first);
        let reader = first.clone();
        let second = values.take().unwrap();
        values.lend(&second);
        drop(first);
        assert!(values.take().is_none(), "both are in use");
        drop(reader);
        let mut again = values.take().unwrap();
        assert_eq!(Arc::get_mut(&mut again), Some(&mut 7));
    }
}
