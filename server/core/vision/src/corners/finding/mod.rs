//! From seeds to the labelled lattice of a board.

pub mod detect;
pub mod lattice;
pub mod orientation;
pub mod part;
pub mod quick;
