//! Evaluation of a plan on a cloud: features, datum frame, values as functions of features, their uncertainty.

pub(crate) mod alignment;
pub(crate) mod chain;
pub(crate) mod datum_pose;
pub(crate) mod fitted;
pub(crate) mod forms;
pub(crate) mod geometry;
pub(crate) mod rims;
pub(crate) mod select;
pub(crate) mod uncertainty;
pub(crate) mod values;
