//! Reasons for refusing a calibration, each with a remedy.

use std::borrow::Cow;

use remedy::Remedy;

/// Reason for refusing a calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The caller cancelled the calibration.
    #[error("the calibration was cancelled")]
    Cancelled,
    /// Fewer images of the board than the camera needs.
    #[error("the camera needs {needed} images of the board, got {got}")]
    TooFewViews {
        /// Images needed.
        needed: usize,
        /// Images available.
        got: usize,
    },
    /// Fewer poses with laser light than the light sheets need.
    #[error("the light sheets need {needed} board poses with laser light, got {got}")]
    TooFewLaserPoses {
        /// Poses needed.
        needed: usize,
        /// Poses available.
        got: usize,
    },
    /// The boards are all parallel: focal length and distance cannot be separated.
    #[error(
        "the focal length is unobservable: all boards are parallel within {spread_deg:.1}°, {needed_deg:.1}° are needed"
    )]
    BoardsParallel {
        /// Largest angle between two boards.
        spread_deg: f64,
        /// Angle needed.
        needed_deg: f64,
    },
    /// The σ of the focal length is too large.
    #[error("the focal length is unobservable: {focal_px:.0} ± {sigma_px:.0} px")]
    FocalUnobservable {
        /// Estimate.
        focal_px: f64,
        /// Its σ.
        sigma_px: f64,
    },
    /// Stage views at too few positions.
    #[error(
        "the straightness of the stage is unobservable: the board was observed at {got} of its positions, {needed} are needed (any two lie on a straight line)"
    )]
    TooFewStageViews {
        /// Positions needed.
        needed: usize,
        /// Different positions available.
        got: usize,
    },
    /// Views of a turntable at too few angles.
    #[error(
        "the axis of the turntable is unobservable: the board was observed at {got} of its angles, {needed} are needed (modulo full turns)"
    )]
    TooFewStageAngles {
        /// Angles needed.
        needed: usize,
        /// Different angles available.
        got: usize,
    },
    /// A board did not rotate by the stated angle.
    #[error(
        "the board in stage view {view} rotated by {observed_deg:.2}° relative to {reference}, but angle_deg states {stated_deg:.2}°"
    )]
    RotationMismatch {
        /// The view with the largest disagreement.
        view: String,
        /// The view with the smallest disagreement.
        reference: String,
        /// Stated rotation between them.
        stated_deg: f64,
        /// Observed rotation of the board.
        observed_deg: f64,
    },
    /// The views do not determine the axis.
    #[error(
        "the axis of the turntable is unobservable: σ of its position is {shift_mm:.2} mm, of its direction {tilt_deg:.2}°"
    )]
    AxisUnobservable {
        /// σ across the axis.
        shift_mm: f64,
        /// σ of the direction.
        tilt_deg: f64,
    },
    /// Stage views of both kinds of stage.
    #[error("stage view {view} states the position of a {found} stage, the others those of a {expected} one")]
    MixedStages {
        /// The first view of another kind.
        view: String,
        /// Kind of its position.
        found: &'static str,
        /// Kind of the first view.
        expected: &'static str,
    },
    /// A fit did not converge.
    #[error("the fit did not converge: {fit}")]
    NotConverged {
        /// The fit.
        fit: &'static str,
    },
    /// The corner positions do not fit any camera.
    #[error("the camera is unobservable: the board's corners fit no pinhole camera")]
    CameraUnobservable,
    /// Too few laser images with a line on the board.
    #[error(
        "the light sheets need {needed} board poses with laser light, but only {got} have a line on the board (none in {dark})"
    )]
    LinesOffBoard {
        /// Poses needed.
        needed: usize,
        /// Poses with a line on the board.
        got: usize,
        /// The other poses, by name.
        dark: String,
    },
    /// The listed orders are not monotonic.
    #[error("the orders {orders:?} are not strictly increasing or decreasing")]
    OrdersUnsorted {
        /// As given.
        orders: Vec<i8>,
    },
    /// Too few images contain all lines side by side, so the lines cannot be assigned to orders.
    #[error(
        "the orders are unobservable: {images} laser images show all {needed} lines side by side, {needed_images} are needed (most lines in one image: {seen})"
    )]
    OrdersUnobservable {
        /// Lines listed.
        needed: usize,
        /// Most lines side by side in one image.
        seen: usize,
        /// Images that show them all.
        images: usize,
        /// Such images needed.
        needed_images: usize,
    },
    /// An order was observed on too few boards.
    #[error("order {order} is unobservable: it was found on {got} boards, {needed} are needed")]
    OrderUnseen {
        /// The order.
        order: i8,
        /// Boards on which it was observed.
        got: usize,
        /// Boards needed.
        needed: usize,
    },
    /// All boards at the same depth.
    #[error(
        "the direction of the light sheets is unobservable: along the lines the boards' depths span {span_mm:.1} mm, {needed_mm:.1} mm are needed"
    )]
    NoDepthRange {
        /// Observed range.
        span_mm: f64,
        /// Required range.
        needed_mm: f64,
    },
    /// The chosen light model does not fit, with the reason.
    #[error("the light model `{model}` cannot be fitted: {reason}")]
    LightModel {
        /// The model's name.
        model: &'static str,
        /// The reason.
        reason: String,
    },
}

impl Remedy for CalibrationError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::TooFewViews { .. } => "add poses of the board with different tilts".into(),
            Self::TooFewLaserPoses { .. } => "add poses at other depths and tilts".into(),
            Self::BoardsParallel { .. } => "tilt the board by 15–30° about both of its axes between poses".into(),
            Self::FocalUnobservable { .. } => "add poses with the board tilted by 15–30° about both of its axes and filling the image".into(),
            Self::TooFewStageViews { .. } => "add stage views at other positions, or leave them all out and calibrate without a stage".into(),
            Self::TooFewStageAngles { .. } => "add stage views at other angles, or leave them all out and calibrate without a stage".into(),
            Self::RotationMismatch { .. } => "correct angle_deg, remove the view, or check that the board is fixed to the table and rotates with it".into(),
            Self::AxisUnobservable { .. } => "add stage views at angles that are 30–90° apart".into(),
            Self::MixedStages { .. } => "state all positions for the same kind of stage".into(),
            Self::NotConverged { .. } => "look for inconsistent images (board, camera or focus changed) and remove or capture them again".into(),
            Self::CameraUnobservable => "check the board's size in the capture".into(),
            Self::LinesOffBoard { .. } => "check exposure and laser, and that the light falls on the board".into(),
            Self::OrdersUnsorted { .. } => "list them from the top (left) of the image".into(),
            Self::OrdersUnobservable { .. } => "check the listed orders, or add poses that show all lines".into(),
            Self::OrderUnseen { .. } => "add poses in which it falls on the board".into(),
            Self::NoDepthRange { .. } => "move the board nearer and farther between poses".into(),
            Self::LightModel { .. } => "choose another light model, or add poses at other depths and tilts".into(),
            Self::Cancelled => return None,
        })
    }
}
