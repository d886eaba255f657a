//! Warnings of a procedure, collected.

use std::sync::Mutex;

use pipeline::{Reporter, Task};

/// Collects the warnings.
#[derive(Default)]
pub struct WarningCollector(pub Mutex<Vec<String>>);

struct NoTask;

impl Task for NoTask {
    fn step(&self) {}
    fn at(&self, _: &str, _: f64) {}
}

impl Reporter for WarningCollector {
    fn note(&self, _: &str) {}
    fn warn(&self, text: &str) {
        self.0.lock().unwrap().push(text.to_owned());
    }
    fn is_cancelled(&self) -> bool {
        false
    }
    fn count(&self, _: &str, _: &str, _: usize) -> Box<dyn Task> {
        Box::new(NoTask)
    }
    fn fraction(&self, _: &str) -> Box<dyn Task> {
        Box::new(NoTask)
    }
}
