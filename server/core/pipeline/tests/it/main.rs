//! Complete procedures on rendered captures with known truth.

#![allow(clippy::unwrap_used)]

mod parts;
mod scales;
mod warnings;
