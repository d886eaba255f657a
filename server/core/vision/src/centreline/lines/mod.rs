//! What lines are made of, however they are searched: where one may cross a column, how crossings join, what their noise is.

pub mod candidates;
pub mod crossing;
pub mod ends;
pub mod noise;
pub mod parabola;
pub mod scatter;
pub mod segments;
pub mod taps;
pub mod traces;
pub mod width;
