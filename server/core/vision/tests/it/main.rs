//! Centrelines and boards of rendered images with known truth.

#![allow(clippy::unwrap_used)]

mod averaging_bias;
mod centreline_rig;
mod charuco;
mod circles;
mod corners_rig;
mod line_widths;
mod stored_bits;
mod touching;
