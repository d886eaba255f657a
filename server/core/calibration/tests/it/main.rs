//! Calibrations of stations with known truth, and of photographs.

#![allow(clippy::unwrap_used)]

mod common;
mod derivatives;
mod photographs;
mod refinement;
mod solver;
mod stage;
mod station;
mod turntable;
