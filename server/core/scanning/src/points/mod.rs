//! Labelled lines as points: frame by frame, as a cloud, and the points dropped.

pub mod cloud;
pub mod dropped;
pub mod envelope;
pub mod profile;
pub mod profiles;
pub mod sigma_table;
