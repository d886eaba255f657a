//! Complete rigs, from images to results, compared with ground truth.

pub mod accuracy;
pub mod cross;
pub mod few_lines;
pub mod lasers;
pub mod rig_a;
pub mod turntable;
pub mod tutorial;
