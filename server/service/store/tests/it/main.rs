//! The store against its contract, damage, full disks and `kill -9`.

#![allow(clippy::unwrap_used)]

mod common;
mod contract;
mod faults;
mod flipped_bits;
mod identity;
mod kill;
