//! What the threads of this process have done: processor time and, where counted, requests for memory, by name.

use std::collections::BTreeMap;
use std::fs;

/// Totals of the threads of one name.
#[derive(Debug, Clone, Copy, Default)]
pub struct Work {
    /// Time on a processor, ms.
    pub cpu_ms: f64,
    /// Requests for memory; 0 in programs that do not count them.
    pub allocations: u64,
}

/// What every thread that lives has done so far; threads that differ by a number count as one. Empty where the system
/// does not report it.
pub fn by_name() -> BTreeMap<String, Work> {
    let mut work: BTreeMap<String, Work> = BTreeMap::new();
    let allocations = crate::heap::allocations::by_thread();
    for task in fs::read_dir("/proc/self/task").into_iter().flatten().flatten() {
        let read = |file: &str| fs::read_to_string(task.path().join(file)).unwrap_or_default();
        let name = read("comm").trim_end().trim_end_matches(|c: char| c.is_ascii_digit() || c == '-').to_owned();
        let on_cpu_ns = read("schedstat").split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok());
        let id: i32 = task.file_name().to_string_lossy().parse().unwrap_or_default();
        let total = work.entry(name).or_default();
        total.cpu_ms += on_cpu_ns.unwrap_or(0.0) / 1e6;
        total.allocations += allocations.get(&id).copied().unwrap_or(0);
    }
    work
}

/// What was done between two looks.
pub fn between(before: &BTreeMap<String, Work>, after: &BTreeMap<String, Work>) -> BTreeMap<String, Work> {
    let since = |(name, now): (&String, &Work)| {
        let then = before.get(name).copied().unwrap_or_default();
        let allocations = now.allocations.saturating_sub(then.allocations);
        (name.clone(), Work { cpu_ms: now.cpu_ms - then.cpu_ms, allocations })
    };
    after.iter().map(since).collect()
}
