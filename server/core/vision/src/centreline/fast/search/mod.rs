//! Search for lines: noise, line width, and rows brighter than their surroundings.

pub mod candidates;
pub mod cells;
pub mod latest;
pub mod noise;
pub mod responses;
pub mod width;
