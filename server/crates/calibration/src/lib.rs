//! Board corners and centrelines to a calibrated station: camera, light sheets, stage, with covariance.
//!
//! Residuals are pixels, weighted by the observations' own standard deviations; the mathematics is in
//! `server/docs/maths/calibration.md`.

pub mod calibrate;
pub mod document;
pub mod input;
pub mod report;

pub use calibrate::{CalibrationError, CalibrationResult, Stop, calibrate};
pub use document::{CalibrationDocument, DocumentError};
pub use input::{
    BoardGeometry, CalibrationInput, CalibrationOptions, LightModelChoice, PoseInput, ProjectorSheet,
    StageViewInput,
};
pub use report::{
    CalibrationReport, CameraReport, CrossValidation, LaserPoint, LightReport, ModelScore, OrderResidual,
    PoseResidual, Rejections, StageReport,
};
