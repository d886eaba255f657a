//! A stopwatch that excludes the scheduling latency of the machine, so that a test measures the product and not the
//! machine.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::time;

/// Interval of the heartbeat.
const BEAT: Duration = Duration::from_millis(1);

/// Number of threads in sequence from a command to its visible effect: caller, station, driver, firmware. Each can be
/// as late as the heartbeat.
const N_HANDOVERS: u32 = 4;

/// A thread that is due every millisecond, and its lateness.
struct Heart {
    begun_at: Instant,
    /// Nanoseconds from `begun_at` to the latest beat.
    beaten_at: AtomicU64,
    /// Total lateness of all beats, nanoseconds.
    late: AtomicU64,
}

/// Measures the product's own time.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch {
    begun_at: Instant,
    late_before: Duration,
}

impl Stopwatch {
    /// Starts the measurement.
    pub fn start() -> Self {
        Self { late_before: late(), begun_at: time::now() }
    }

    /// Time since the start minus the estimated scheduling latency, which is next to nothing on an idle machine.
    pub fn own_time(&self) -> Duration {
        let elapsed = time::since(self.begun_at);
        elapsed.saturating_sub(N_HANDOVERS * late().saturating_sub(self.late_before))
    }
}

/// Total lateness of beats since the process began, including the one that is due.
fn late() -> Duration {
    if time::is_simulated() {
        return Duration::ZERO;
    }
    let heart = heart();
    let since_beat =
        (heart.begun_at.elapsed()).saturating_sub(Duration::from_nanos(heart.beaten_at.load(Ordering::SeqCst)));
    Duration::from_nanos(heart.late.load(Ordering::SeqCst)) + lateness_of(since_beat)
}

/// A beat may be late by its own interval, which is the timer's resolution.
fn lateness_of(pause: Duration) -> Duration {
    pause.saturating_sub(2 * BEAT)
}

fn heart() -> &'static Heart {
    static HEART: OnceLock<Heart> = OnceLock::new();
    let mut is_new = false;
    let heart = HEART.get_or_init(|| {
        is_new = true;
        Heart { begun_at: Instant::now(), beaten_at: AtomicU64::new(0), late: AtomicU64::new(0) }
    });
    if is_new {
        std::thread::spawn(move || beat(heart));
    }
    heart
}

fn beat(heart: &'static Heart) {
    let mut before = heart.begun_at;
    loop {
        std::thread::sleep(BEAT);
        let now = Instant::now();
        let nanos = |time: Duration| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        heart.late.fetch_add(nanos(lateness_of(now - before)), Ordering::SeqCst);
        heart.beaten_at.store(nanos(now - heart.begun_at), Ordering::SeqCst);
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_beats_are_counted_and_beats_in_time_are_not() {
        assert_eq!(lateness_of(BEAT), Duration::ZERO);
        assert_eq!(lateness_of(30 * BEAT), 28 * BEAT);
        let (watch, before) = (Stopwatch::start(), late());
        std::thread::sleep(50 * BEAT);
        let (own_time, late) = (watch.own_time(), N_HANDOVERS * (late() - before));
        assert!(
            own_time <= watch.begun_at.elapsed() && own_time + late >= 50 * BEAT,
            "{own_time:?}, late {late:?}"
        );
    }
}
