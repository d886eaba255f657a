//! Processor time and, where counted, allocations of the threads of this process, by thread name.

use std::collections::BTreeMap;
use std::fs;

/// Totals of the threads of one name.
#[derive(Debug, Clone, Copy, Default)]
pub struct Work {
    /// Processor time, ms.
    pub cpu_ms: f64,
    /// Number of allocations; 0 in builds that do not count them.
    pub allocations: u64,
}

/// Totals of all live threads; threads whose names differ only by a number are added up. Empty where the system does not
/// report them.
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

/// Differences between two totals.
pub fn between(before: &BTreeMap<String, Work>, after: &BTreeMap<String, Work>) -> BTreeMap<String, Work> {
    let since = |(name, now): (&String, &Work)| {
        let then = before.get(name).copied().unwrap_or_default();
        let allocations = now.allocations.saturating_sub(then.allocations);
        (name.clone(), Work { cpu_ms: now.cpu_ms - then.cpu_ms, allocations })
    };
    after.iter().map(since).collect()
}
