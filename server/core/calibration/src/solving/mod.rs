//! The adjustment: observations, free parameters, solver.
pub mod bundle;
pub mod bundle_state;
pub mod normal;
pub mod observation;
pub mod prior;
pub(crate) mod row_sums;
pub mod solver;
