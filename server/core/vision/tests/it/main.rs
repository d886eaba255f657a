//! Centrelines and circle grids of rendered pictures with known truth.

#![allow(clippy::unwrap_used)]

mod centreline_rig;
mod circles;
mod line_widths;
mod touching;
