//! How long calls take, and how long it is waited for a state.

use std::time::Duration;

use super::stopwatch::Stopwatch;
use crate::CALL_LIMIT;

/// What the operating system may add to a call where processors are free.
pub const SCHEDULING_SLACK: Duration = Duration::from_millis(80);

/// Pause between two looks at a state that is waited for; a station polls at this pace or slower.
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// Calls `act`, which must come back within [`CALL_LIMIT`].
pub fn short<T>(name: &str, act: impl FnOnce() -> T) -> T {
    within(CALL_LIMIT, name, act)
}

/// Calls `act`, which must come back within `limit` and what the machine adds.
pub fn within<T>(limit: Duration, name: &str, act: impl FnOnce() -> T) -> T {
    let watch = Stopwatch::start();
    let result = act();
    let took = watch.own_time();
    assert!(took <= limit + SCHEDULING_SLACK, "`{name}` kept its caller for {took:?}; a call may take {limit:?}");
    result
}

/// Looks until `seen` gives a value; panics with `what` after `limit`.
pub fn wait_for<T>(limit: Duration, what: &str, mut seen: impl FnMut() -> Option<T>) -> T {
    let watch = Stopwatch::start();
    loop {
        if let Some(value) = seen() {
            return value;
        }
        assert!(watch.own_time() < limit, "{what}: not within {limit:?}");
        crate::time::sleep(LOOK_PERIOD);
    }
}
