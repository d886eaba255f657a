//! The joint adjustment: what is observed, what is free, and the solver.

pub mod bundle;
pub(crate) mod cross_validation;
pub(crate) mod joint;
pub mod light_fit;
pub mod normal;
pub mod observation;
pub mod prior;
pub(crate) mod row_sums;
pub mod solver;
pub(crate) mod stage_fit;
pub mod station;
