//! Labels held against the surfaces that they make: what is left out, and what is taken after all.

pub mod carried;
pub mod columns;
pub mod compare;
pub mod decision;
pub mod rivals;
