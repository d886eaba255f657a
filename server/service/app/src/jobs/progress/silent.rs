//! A progress sink that discards everything.

use pipeline::{Reporter, Task};

/// Reports nothing and is never cancelled.
pub struct Silent;

impl Reporter for Silent {
    fn note(&self, _text: &str) {}

    fn warn(&self, _text: &str) {}

    fn is_cancelled(&self) -> bool {
        false
    }

    fn count(&self, _title: &str, _unit: &str, _total: usize) -> Box<dyn Task> {
        Box::new(Self)
    }

    fn fraction(&self, _title: &str) -> Box<dyn Task> {
        Box::new(Self)
    }
}

impl Task for Silent {
    fn step(&self) {}

    fn at(&self, _step: &str, _fraction: f64) {}
}
