//! Results of a plan: values, uncertainties and verdicts of its characteristics, and the verdict on the part.

pub(crate) mod characteristics;
pub(crate) mod evaluate;
pub(crate) mod no_verdict;
pub(crate) mod result;
pub(crate) mod surface_profile;
