//! The driver over a scripted device: what the kernel would answer, without kernel and camera. Not shown here: that a
//! kernel and cameras of glass and silicon answer so. The structures of the kernel's interface are compared with its
//! header beside them.

#![allow(clippy::unwrap_used)]

mod contract;
mod faults;
mod frames;
mod opening;
mod scripted;
