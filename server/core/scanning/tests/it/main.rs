//! Labels, points and clouds of scans with known truth: modelled, rendered here, or reference data.

#![allow(clippy::unwrap_used)]

mod clouds;
mod common;
mod exposures;
mod from_file;
mod labelling;
mod line_powers;
mod lost_steps;
mod one_frame;
mod part_axis;
mod rendered;
mod rig_a_images;
mod turntable;
mod watches;
