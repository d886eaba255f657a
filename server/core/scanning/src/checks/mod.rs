//! Checks of labels against the surfaces they form: which points are dropped, which doubtful ones are accepted.

pub mod carried;
pub mod columns;
pub mod compare;
pub mod decision;
pub mod rivals;
pub mod widths;
