//! The weight of this session beside the kernel's threads.
//!
//! Linux weighs all processes of a session together (autogroup) against each kernel thread, so what `nice` divides within
//! the session does not help those threads. While tests use all processors, the thread that passes on the bytes of
//! pseudo-terminals was not run for up to 0.65 s, and simulated controllers fell silent: beside four busy loops all of
//! eight such tests failed, and none with a lower weight of the session.

use std::path::Path;

const AUTOGROUP: &str = "/proc/self/autogroup";

/// As of `nice`: a tenth of the weight of a kernel thread.
const NICE: &str = "10";

/// Gives the session a low weight until it is dropped; without effect where the kernel has no such groups.
pub struct LowWeight {
    before: Option<String>,
}

impl LowWeight {
    /// From now on.
    pub fn begin() -> Self {
        let before = std::fs::read_to_string(AUTOGROUP).ok().and_then(|text| nice_of(&text).map(str::to_owned));
        Self { before: before.filter(|_| set(NICE)) }
    }
}

impl Drop for LowWeight {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            set(before);
        }
    }
}

/// `/autogroup-7 nice 0`.
fn nice_of(text: &str) -> Option<&str> {
    text.split_whitespace().skip_while(|word| *word != "nice").nth(1)
}

/// Whether the kernel accepted it: a user may not raise the weight again.
fn set(nice: &str) -> bool {
    Path::new(AUTOGROUP).exists() && std::fs::write(AUTOGROUP, nice).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_is_read_from_the_kernels_words() {
        assert_eq!(nice_of("/autogroup-173 nice -5\n"), Some("-5"));
        assert_eq!(nice_of("/autogroup-173\n"), None);
    }
}
