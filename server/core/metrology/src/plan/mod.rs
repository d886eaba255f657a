//! The measurement plan: features, datums, characteristics.

pub(crate) mod alignment;
pub(crate) mod characteristic;
pub(crate) mod check;
pub(crate) mod document;
pub(crate) mod feature;
