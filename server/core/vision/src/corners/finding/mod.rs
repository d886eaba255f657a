//! From seeds to the labelled lattice of a board.

pub mod detect;
pub mod fast;
pub mod lattice;
pub mod orientation;
pub mod partial;
