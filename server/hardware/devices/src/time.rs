//! The clock of a thread: the computer's, or a simulated one in which waiting takes no time.
//!
//! A simulated clock belongs to a test ([`simulate`]) and to the threads started under it by [`spawn`]. One of them
//! runs at a time; when it waits, the clock advances to the next moment that any of them waits for. A test of seconds
//! takes only its computing time, its order does not depend on the load of the computer, and it tests the product with
//! its own timeouts. It does not test scheduling latency: a few tests stay in real time.
//!
//! Under a simulated clock a thread must wait only through this module: one that blocks otherwise stops the clock for
//! all.

use parking_lot::{Condvar, Mutex, MutexGuard};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Under a simulated clock, polling interval of a waiting thread.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Under a simulated clock: how long a thread lets the others run if its condition is already met.
const YIELD_TIME: Duration = Duration::from_micros(1);

thread_local! {
    static CLOCK: RefCell<Option<Arc<Simulation>>> = const { RefCell::new(None) };
}

/// Clock and threads of one simulation.
struct Simulation {
    state: Mutex<State>,
}

struct State {
    now: Instant,
    /// Waiting threads: until when, in the order of arrival, and how to wake them.
    waiting: BTreeMap<(Instant, u64), Arc<Condvar>>,
    n_waits: u64,
    /// Number of threads that are not waiting.
    n_running: usize,
}

impl Simulation {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }

    /// Waits for its turn at `until`; the caller counts as running before and after.
    fn wait(&self, until: impl FnOnce(&State) -> Instant, was_running: bool) {
        let woken = Arc::new(Condvar::new());
        let mut state = self.lock();
        let key = (until(&state), state.n_waits);
        state.n_waits += 1;
        state.waiting.insert(key, Arc::clone(&woken));
        if was_running {
            state.yield_turn();
        }
        while state.waiting.contains_key(&key) {
            woken.wait(&mut state);
        }
    }
}

impl State {
    /// A thread stops running; if none is left, the next one is woken.
    fn yield_turn(&mut self) {
        self.n_running -= 1;
        if self.n_running == 0
            && let Some(((until, _), woken)) = self.waiting.pop_first()
        {
            self.now = self.now.max(until);
            self.n_running = 1;
            woken.notify_one();
        }
    }
}

/// Membership of a thread in a simulated clock; ends when dropped, also in a panic.
#[derive(Debug)]
pub struct Membership {
    has_left: Arc<AtomicBool>,
}

impl Drop for Membership {
    fn drop(&mut self) {
        if let Some(simulation) = CLOCK.take() {
            self.has_left.store(true, Ordering::SeqCst);
            simulation.lock().yield_turn();
        }
    }
}

/// A thread that was started by [`spawn`].
#[derive(Debug)]
pub struct Thread<T> {
    thread: JoinHandle<T>,
    has_left: Arc<AtomicBool>,
}

impl<T> Thread<T> {
    /// Whether it has ended.
    pub fn is_finished(&self) -> bool {
        self.has_left.load(Ordering::SeqCst) || self.thread.is_finished()
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// Its panic payload.
    pub fn join(self) -> std::thread::Result<T> {
        while is_simulated() && !self.is_finished() {
            sleep(POLL_INTERVAL);
        }
        self.thread.join()
    }
}

fn clock() -> Option<Arc<Simulation>> {
    CLOCK.with_borrow(Clone::clone)
}

/// Puts this thread, and all that it starts, under a simulated clock while the returned value is kept; `None` if it
/// already is.
pub fn simulate() -> Option<Membership> {
    if is_simulated() {
        return None;
    }
    let state = State { now: Instant::now(), waiting: BTreeMap::new(), n_waits: 0, n_running: 1 };
    CLOCK.set(Some(Arc::new(Simulation { state: Mutex::new(state) })));
    Some(Membership { has_left: Arc::default() })
}

/// Runs `act` and all threads it starts under a simulated clock.
pub fn simulated<T>(act: impl FnOnce() -> T) -> T {
    let _membership = simulate();
    act()
}

/// Whether this thread is under a simulated clock.
pub fn is_simulated() -> bool {
    CLOCK.with_borrow(Option::is_some)
}

/// The current time, by this thread's clock.
pub fn now() -> Instant {
    CLOCK.with_borrow(|clock| clock.as_ref().map_or_else(Instant::now, |clock| clock.lock().now))
}

/// Time since `at`, by this thread's clock.
pub fn since(at: Instant) -> Duration {
    now().saturating_duration_since(at)
}

/// Sleeps for this duration.
pub fn sleep(duration: Duration) {
    match clock() {
        Some(clock) => clock.wait(|state| state.now + duration.max(YIELD_TIME), true),
        None => std::thread::sleep(duration),
    }
}

/// Starts a thread with the clock of this one.
///
/// # Errors
/// If the operating system cannot create a thread.
pub fn spawn<T: Send + 'static>(
    name: &str,
    act: impl FnOnce() -> T + Send + 'static,
) -> std::io::Result<Thread<T>> {
    let builder = std::thread::Builder::new().name(name.to_owned());
    let has_left = Arc::new(AtomicBool::new(false));
    let Some(clock) = clock() else { return Ok(Thread { thread: builder.spawn(act)?, has_left }) };
    let membership = Membership { has_left: Arc::clone(&has_left) };
    // It waits for its turn from the start, so that the clock does not advance without it.
    let (has_begun, begun) = std::sync::mpsc::channel();
    let at_once = move |state: &State| {
        has_begun.send(()).ok();
        state.now
    };
    let thread = builder.spawn(move || {
        clock.wait(at_once, false);
        CLOCK.set(Some(clock));
        let _membership = membership;
        act()
    })?;
    begun.recv().ok();
    Ok(Thread { thread, has_left })
}

/// Polls every millisecond until `condition` returns a value, for `limit` at most.
pub fn poll_for<T>(limit: Duration, mut condition: impl FnMut() -> Option<T>) -> Option<T> {
    let until = now() + limit;
    loop {
        let found = condition();
        let left = until.saturating_duration_since(now());
        if found.is_some() || left.is_zero() {
            return found;
        }
        sleep(POLL_INTERVAL.min(left));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn an_hour_of_waiting_takes_no_time_and_threads_wake_in_order_of_their_deadlines() {
        let real = Instant::now();
        simulated(|| {
            let (begun_at, (sender, receiver)) = (now(), channel());
            let wait_s = |s: u64| {
                let sender = sender.clone();
                let waiting = move || {
                    sleep(Duration::from_secs(s));
                    sender.send((s, since(begun_at).as_secs())).unwrap();
                };
                spawn("waiting", waiting).unwrap()
            };
            let threads = [3600, 2, 60].map(wait_s);
            sleep(Duration::from_secs(59));
            assert_eq!(receiver.try_iter().collect::<Vec<_>>(), [(2, 2)]);
            threads.into_iter().for_each(|thread| thread.join().unwrap());
            assert_eq!(receiver.try_iter().collect::<Vec<_>>(), [(60, 60), (3600, 3600)]);
        });
        assert!(real.elapsed() < Duration::from_secs(60) && !is_simulated());
    }

    #[test]
    fn the_clock_stops_while_a_thread_computes_and_survives_one_that_panics() {
        simulated(|| {
            let before = now();
            let thread = spawn("panicking", || panic!("as it is meant to")).unwrap();
            std::thread::sleep(Duration::from_millis(20));
            assert_eq!(now(), before);
            assert!(thread.join().is_err());
            assert!(since(before) <= 2 * POLL_INTERVAL);
        });
    }
}
