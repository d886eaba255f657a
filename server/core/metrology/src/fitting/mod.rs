//! Robust fits of shapes to points: samples, search, fits.

pub(crate) mod averaging;
pub(crate) mod features;
pub(crate) mod fit;
pub(crate) mod fitness;
pub(crate) mod footprint;
pub(crate) mod orders;
pub(crate) mod outline;
pub(crate) mod ransac;
pub(crate) mod robust;
pub(crate) mod sample;
