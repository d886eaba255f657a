//! What speaks for and against every label: samples tried with every order, lines followed, surfaces seen twice.

pub mod agreement;
pub mod evidence;
pub mod hypotheses;
pub mod looks;
pub mod outlook;
pub mod patches;
pub mod ranks;
pub mod sheets;
pub mod tracks;
