//! Averaging along the line: parabolas as long as the line agrees with one.

pub mod along;
pub mod cut;
pub mod kernels;
pub mod means;
pub mod points;
pub mod windows;
