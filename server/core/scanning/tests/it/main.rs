//! Labels, points and clouds of scans whose truth is known: modelled, rendered here, rendered by others.

#![allow(clippy::unwrap_used)]

mod clouds;
mod common;
mod labelling;
mod lost_steps;
mod one_frame;
mod part_axis;
mod rendered;
mod rig_a_images;
mod turntable;
