//! Why a calibration is refused, each with what to do about it.

use std::borrow::Cow;

use remedy::Remedy;

/// Why a calibration was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The caller asked to stop.
    #[error("the calibration was cancelled")]
    Cancelled,
    /// Fewer pictures of the board than the camera needs.
    #[error("the camera needs {needed} pictures of the board, got {got}")]
    TooFewViews {
        /// Pictures needed.
        needed: usize,
        /// Pictures given.
        got: usize,
    },
    /// Fewer poses with laser light than the light sheets need.
    #[error("the light sheets need {needed} board poses with laser light, got {got}")]
    TooFewLaserPoses {
        /// Poses needed.
        needed: usize,
        /// Poses given.
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
    /// The focal length has too large a σ.
    #[error("the focal length is unobservable: {focal_px:.0} ± {sigma_px:.0} px")]
    FocalUnobservable {
        /// Estimate.
        focal_px: f64,
        /// Its σ.
        sigma_px: f64,
    },
    /// Stage views at too few positions.
    #[error(
        "the straightness of the stage is unobservable: the board was seen at {got} of its positions, {needed} are needed (any two lie on a straight line)"
    )]
    TooFewStageViews {
        /// Positions needed.
        needed: usize,
        /// Positions that differ.
        got: usize,
    },
    /// Views of a turntable at too few angles.
    #[error(
        "the axis of the turntable is unobservable: the board was seen at {got} of its angles, {needed} are needed (whole turns apart are one angle)"
    )]
    TooFewStageAngles {
        /// Angles needed.
        needed: usize,
        /// Angles that differ.
        got: usize,
    },
    /// A board that did not turn by what was stated.
    #[error(
        "the board of stage view {view} turned by {seen_deg:.2}° against {reference}, but its angle_deg states {stated_deg:.2}°"
    )]
    TurnMismatch {
        /// The view that disagrees most.
        view: String,
        /// The view that agrees most.
        reference: String,
        /// Stated turn between them.
        stated_deg: f64,
        /// Turn of the board.
        seen_deg: f64,
    },
    /// The views leave the axis open.
    #[error(
        "the axis of the turntable is unobservable: its place is known to ± {shift_mm:.2} mm and its direction to ± {tilt_deg:.2}°"
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
        /// The first that differs.
        view: String,
        /// Kind of its position.
        found: &'static str,
        /// Kind of the first view.
        expected: &'static str,
    },
    /// A fit ended away from a minimum.
    #[error("the fit got stuck before it reached a minimum: {fit}")]
    Stuck {
        /// Which fit.
        fit: &'static str,
    },
    /// The corner positions do not fit any camera.
    #[error("the camera is unobservable: the board's corners fit no pinhole camera")]
    CameraUnobservable,
    /// Too few laser pictures with a line on the board.
    #[error(
        "the light sheets need {needed} board poses with laser light, but a line lies on the board in {got} only (on none in {dark})"
    )]
    LinesOffBoard {
        /// Poses needed.
        needed: usize,
        /// Poses with a line on the board.
        got: usize,
        /// The others, by name.
        dark: String,
    },
    /// The orders of the data sheet are not in order.
    #[error("the orders {orders:?} are not strictly rising or falling")]
    OrdersUnsorted {
        /// As given.
        orders: Vec<i8>,
    },
    /// Too few pictures show all lines side by side, so the lines cannot be given their orders.
    #[error(
        "the orders are unobservable: {pictures} laser pictures show all {needed} lines side by side, {needed_pictures} are needed (most lines seen at once: {seen})"
    )]
    OrdersUnobservable {
        /// Lines listed.
        needed: usize,
        /// Most lines seen side by side in one picture.
        seen: usize,
        /// Pictures that show them all.
        pictures: usize,
        /// Such pictures needed.
        needed_pictures: usize,
    },
    /// An order was never seen with certainty.
    #[error("order {order} is unobservable: it was seen on {got} boards, {needed} are needed")]
    OrderUnseen {
        /// The order.
        order: i8,
        /// Boards it was seen on.
        got: usize,
        /// Boards needed.
        needed: usize,
    },
    /// All boards at the same depth.
    #[error(
        "the direction of the light sheets is unobservable: along the lines the boards' depths span {span_mm:.1} mm, {needed_mm:.1} mm are needed"
    )]
    NoDepthRange {
        /// Range seen.
        span_mm: f64,
        /// Range needed.
        needed_mm: f64,
    },
    /// The chosen light model does not fit, with the reason.
    #[error("the light model `{model}` cannot be fitted: {reason}")]
    LightModel {
        /// The model's name.
        model: &'static str,
        /// Why, in words.
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
            Self::TurnMismatch { .. } => "correct angle_deg, take the view out, or check that the board is fixed to the table and turns with it".into(),
            Self::AxisUnobservable { .. } => "add stage views at angles that are 30–90° apart".into(),
            Self::MixedStages { .. } => "state all positions of one kind".into(),
            Self::Stuck { .. } => "look for pictures that do not belong to the others (a board or camera that was moved, another focus), take them out or take them again".into(),
            Self::CameraUnobservable => "check the board's size in the capture".into(),
            Self::LinesOffBoard { .. } => "check exposure and laser, and that the light falls on the board".into(),
            Self::OrdersUnsorted { .. } => "list them from the top (left) of the image".into(),
            Self::OrdersUnobservable { .. } => "check the listed orders, or take poses that show them all".into(),
            Self::OrderUnseen { .. } => "add poses in which it falls on the board".into(),
            Self::NoDepthRange { .. } => "move the board nearer and farther between poses".into(),
            Self::LightModel { .. } => "choose another light model, or add poses at other depths and tilts".into(),
            Self::Cancelled => return None,
        })
    }
}
