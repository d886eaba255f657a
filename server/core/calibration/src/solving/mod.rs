//! The adjustment: what is observed, what is free, how it is solved.
pub mod bundle;
pub mod normal;
pub mod observation;
pub mod prior;
pub(crate) mod row_sums;
pub mod solver;
pub mod station;
