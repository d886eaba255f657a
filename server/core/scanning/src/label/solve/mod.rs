//! From evidence to labels: relaxed together, then held against every other answer.

pub mod challenge;
pub mod min_cut;
pub mod overlooked;
pub mod relax;
pub mod sheet_graph;
pub mod shift_together;
pub mod shifts;
pub mod trial;
