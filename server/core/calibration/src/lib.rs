//! Board corners and centrelines to a calibrated station: camera, light sheets, stage, with covariance.
//!
//! Residuals are pixels, weighted by the observations' own standard deviations; the mathematics is in
//! `server/docs/maths/calibration.md`.

mod adjustment;
mod first;
mod result;
pub use adjustment::{bundle, light_fit, normal, observation, prior, solver, station};
pub use first::camera_fit;
pub use result::{difference, document, report};
pub mod calibrate;
pub mod error;
pub mod input;

mod params;

pub use adjustment::solver::Termination;
pub use adjustment::stage_fit::check_positions as check_stage_positions;
pub use calibrate::{CalibrationResult, Stop, calibrate};
pub use error::CalibrationError;
pub use input::{
    BoardGeometry, CalibrationInput, CalibrationOptions, LightModelChoice, PoseInput, ProjectorSheet,
    StageViewInput,
};
pub use result::difference::{
    CalibrationDifference, DepthDifference, DifferenceError, OrderDifference, WorstPlace, difference,
};
pub use result::document::{CalibrationDocument, CalibrationText, DocumentError, InputHash};
pub use result::report::{
    CalibrationReport, CameraReport, CrossValidation, LaserPoint, LightReport, ModelScore, OrderResidual,
    PoseResidual, Rejections, StageReport,
};
