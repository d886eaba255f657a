//! Parts of every line search: where a line may cross a column, how crossings are linked, and their noise.

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
