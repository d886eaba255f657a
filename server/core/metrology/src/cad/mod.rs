//! Comparison of a scanned surface with CAD data.

pub(crate) mod areas;
pub(crate) mod best_fit;
pub(crate) mod budget;
pub(crate) mod cell_means;
pub(crate) mod compare;
pub(crate) mod comparison;
pub(crate) mod largest;
pub(crate) mod nominal;
pub(crate) mod statistics;
pub(crate) mod tree;
