//! Centrelines of rendered pictures with known truth.

#![allow(clippy::unwrap_used)]

mod centreline_rig;
mod line_widths;
