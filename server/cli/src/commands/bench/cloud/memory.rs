//! Memory use of this process as reported by the operating system.

use std::fs;

/// Current resident memory, bytes; `None` where the system does not report it.
pub fn resident_bytes() -> Option<u64> {
    status_bytes("VmRSS:")
}

/// Peak resident memory since [`reset_peak`], bytes; `None` where the system does not report it.
pub fn peak_bytes() -> Option<u64> {
    status_bytes("VmHWM:")
}

/// Resets the peak to the current resident memory. Where that is not permitted, the peak is that of the whole process.
pub fn reset_peak() {
    let _ = fs::write("/proc/self/clear_refs", "5");
}

fn status_bytes(field: &str) -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(field))?;
    Some(1024 * line.split_whitespace().next()?.parse::<u64>().ok()?)
}
