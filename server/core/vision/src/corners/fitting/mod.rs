//! The sub-pixel position of a corner: a blurred-corner model fitted to its window.

pub mod fit;
pub mod model;
#[cfg(test)]
pub mod reference;
pub mod refine;
pub mod sums;
pub mod warp;
pub mod window;
