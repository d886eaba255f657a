//! Gathers the evidence for and against every label: samples tried with every order, lines tracked, surfaces observed
//! twice.

pub mod agreement;
pub mod evidence;
pub mod features;
pub mod hypotheses;
pub mod patches;
pub mod ranks;
pub mod reference_view;
pub mod strips;
pub mod tracks;
pub mod widths;
