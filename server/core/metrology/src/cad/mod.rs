//! How far a scanned surface is from the one it should be.

pub(crate) mod areas;
pub(crate) mod best_fit;
pub(crate) mod budget;
pub(crate) mod compare;
pub(crate) mod comparison;
pub(crate) mod nominal;
pub(crate) mod places;
pub(crate) mod statistics;
pub(crate) mod tree;
