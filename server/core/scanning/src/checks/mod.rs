//! Checks of labels against the surfaces they form: which points are rejected, and which doubtful ones are
//! reinstated.

pub mod carried;
pub mod columns;
pub mod compare;
pub mod decision;
pub mod rivals;
pub mod widths;
