//! Scans at a small simulated station, with its true parameters as calibration. Tested here: nothing is lost, duplicated
//! or changed. Not tested: the accuracy of the result (`server/cli/tests/it/http`).

mod ambient;
mod belt;
pub(in crate::jobs) mod bench;
mod from_capture;
mod from_station;
mod measured;
mod probed;
mod recorded;
mod room;
mod stopped;
mod turntable;
mod verified;
mod watched;
