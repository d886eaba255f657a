//! From evidence to labels: solved for all pieces together, then tested against other labellings.

pub mod challenge;
pub mod min_cut;
pub mod overlooked;
pub mod relax;
pub mod shift_together;
pub mod shifts;
pub mod strip_graph;
pub mod trial;
