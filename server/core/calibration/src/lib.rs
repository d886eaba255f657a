//! Calibration of a station from board corners and centrelines: camera, light sheets and stage, with covariance.
//!
//! Residuals are pixels, weighted by the observations' own standard deviations; the mathematics is in
//! `server/docs/maths/calibration.md`. Images, files and devices do not belong here: input are the positions found in
//! images.

pub mod difference;
pub mod document;
mod findings;
mod first;
mod fits;
mod reporting;
mod solving;
pub use findings::report;
pub use first::camera_fit;
pub use first::homography::homography_from_points;
pub use fits::light_fit;
pub use solving::{bundle, bundle_state, normal, observation, prior, solver};
pub mod calibrate;
pub mod error;
pub mod input;

mod params;

pub use calibrate::{CalibrationResult, ProgressControl, calibrate};
pub use difference::{
    CalibrationDifference, DepthDifference, DifferenceError, LargestDifference, OrderDifference, difference,
};
pub use document::{CalibrationDocument, CalibrationText, DocumentError, InputHash};
pub use error::CalibrationError;
pub use findings::report::{
    AxisReport, CalibrationReport, CameraReport, CrossValidation, LaserPoint, LightReport, ModelScore,
    OrderResidual, PoseResidual, Rejections, StageReport,
};
pub use fits::axis_checks::check_angles as check_stage_angles;
pub use fits::stage_fit::check_positions as check_stage_positions;
pub use input::{
    BoardGeometry, BoardPattern, CalibrationInput, CalibrationOptions, LightModelChoice, NominalGrating,
    NominalProjector, PoseInput, StageViewInput,
};
pub use solving::solver::Termination;
