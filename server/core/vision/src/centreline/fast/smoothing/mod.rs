//! Averaging along the line: parabolas in the longest window that fits the line.

pub mod along;
pub mod cut;
pub mod departures;
pub mod expected;
pub mod kernels;
pub mod means;
pub mod points;
pub mod windows;
