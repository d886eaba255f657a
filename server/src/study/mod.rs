//! Studies by Monte Carlo: what the light models buy, where they break, and how near the fits come to the bound.

pub mod bound;
pub mod fit;
pub mod paper;
pub mod regime;
pub mod simulate;
