//! What is measured on a part: features, datums, characteristics; a document of its own.

pub(crate) mod alignment;
pub(crate) mod characteristic;
pub(crate) mod check;
pub(crate) mod document;
pub(crate) mod feature;
