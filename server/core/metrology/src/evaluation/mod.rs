//! Evaluation of a plan on a cloud: characteristics with their uncertainty.

pub(crate) mod alignment;
pub(crate) mod chain;
pub(crate) mod characteristics;
pub(crate) mod datum_pose;
pub(crate) mod evaluate;
pub(crate) mod fitted;
pub(crate) mod forms;
pub(crate) mod geometry;
pub(crate) mod no_verdict;
pub(crate) mod result;
pub(crate) mod rims;
pub(crate) mod select;
pub(crate) mod uncertainty;
pub(crate) mod values;
