//! Board corners and centrelines to a calibrated station: camera, light sheets, stage, with covariance.
//!
//! Residuals are pixels, weighted by the observations' own standard deviations; the mathematics is in
//! `server/docs/maths/calibration.md`.

pub mod calibrate;
pub mod difference;
pub mod error;
pub mod input;
pub mod report;

pub mod camera_fit;
mod first_sheets;
mod homography;
mod zhang;

mod board_lines;
mod chaining;
mod laser_points;
pub mod light_fit;

pub mod bundle;
mod cross_validation;
mod joint;
pub mod normal;
pub mod observation;
pub mod prior;
mod row_sums;
pub mod solver;
mod stage_fit;
pub mod station;

pub mod document;
mod document_report;
mod params;
mod reporting;

pub use calibrate::{CalibrationResult, Stop, calibrate};
pub use difference::{
    CalibrationDifference, DepthDifference, DifferenceError, OrderDifference, WorstPlace, difference,
};
pub use document::{CalibrationDocument, CalibrationText, DocumentError, InputHash};
pub use error::CalibrationError;
pub use input::{
    BoardGeometry, CalibrationInput, CalibrationOptions, LightModelChoice, PoseInput, ProjectorSheet,
    StageViewInput,
};
pub use report::{
    CalibrationReport, CameraReport, CrossValidation, LaserPoint, LightReport, ModelScore, OrderResidual,
    PoseResidual, Rejections, StageReport,
};
pub use solver::Termination;
pub use stage_fit::check_positions as check_stage_positions;
