//! Requests and results of measurements.

pub(crate) mod findings;
pub(crate) mod measurement;
pub(crate) mod part_verdict;
pub(crate) mod region;
pub(crate) mod request;
pub(crate) mod shape;
pub(crate) mod verdict;
