//! Gathers the evidence for and against every label: samples triangulated with every order, lines tracked from
//! frame to frame, surfaces observed twice.

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
