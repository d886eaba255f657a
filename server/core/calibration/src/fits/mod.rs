//! Fits of light, stage and everything together; comparison of models.
pub(crate) mod axis_checks;
pub(crate) mod axis_fit;
pub(crate) mod cross_validation;
mod excess;
pub(crate) mod joint;
pub(crate) mod laser_points;
pub mod light_fit;
pub(crate) mod partial_sets;
pub(crate) mod section;
pub(crate) mod stage_fit;
mod tilt_fit;
