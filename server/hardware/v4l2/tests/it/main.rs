//! The driver over a scripted device: the answers of a kernel, without kernel and camera. Not covered: that a kernel
//! and physical cameras answer so. The structures of the kernel's interface are compared with its header in their own
//! test.

#![allow(clippy::unwrap_used)]

mod contract;
mod faults;
mod frames;
mod opening;
mod scripted;
