//! Whole procedures on rendered captures whose truth is known.

#![allow(clippy::unwrap_used)]

mod scales;
