//! From evidence to labels: inferred for all pieces together, then tested against other labellings.

pub mod conditional_modes;
pub mod inference;
pub mod interval_bounds;
pub mod min_cut;
pub mod overlooked;
pub mod shift_together;
pub mod shifts;
pub mod strip_graph;
pub mod strip_test;
pub mod trial;
