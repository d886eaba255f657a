//! Where lines can be: noise, line width, and rows brighter than what lies beside them.

pub mod candidates;
pub mod cells;
pub mod latest;
pub mod noise;
pub mod responses;
pub mod width;
