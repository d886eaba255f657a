//! Scans at a small simulated station, with its true parameters as calibration: what is shown here is that nothing is
//! lost, doubled or changed on the way, not how accurate the result is (`server/cli/tests/http`).

mod ambient;
mod bench;
mod from_capture;
mod from_station;
mod measured;
mod recorded;
mod room;
mod stopped;
mod turntable;
mod verified;
mod watched;
