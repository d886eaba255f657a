//! Profiles on the wire.

use optics::StagePosition;
use scanning::{Profile, ProfilePoint};
use serde::Serialize;
use utoipa::ToSchema;

/// The frames of a scan.
#[derive(Debug, Serialize, ToSchema)]
pub struct ProfileListDto {
    /// In order of capture.
    pub items: Vec<ProfileItemDto>,
}

/// A frame of a scan.
#[derive(Debug, Serialize, ToSchema)]
pub struct ProfileItemDto {
    /// Index of the frame, from 0.
    pub sequence: u32,
    /// Position of a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Angle of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// URL of its profile.
    pub href: String,
}

/// The profile of one frame in the camera frame, as parallel arrays.
#[derive(Debug, Serialize, ToSchema)]
pub struct ProfileDto {
    /// Index of the frame, from 0.
    pub sequence: u32,
    /// Position of a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Angle of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// Time of exposure on the station's monotonic clock.
    pub captured_at_ns: Option<u64>,
    /// The calibration it was computed with.
    pub calibration_id: String,
    /// Order of each point.
    pub order: Vec<i8>,
    /// x of each point.
    pub x_mm: Vec<f64>,
    /// y of each point.
    pub y_mm: Vec<f64>,
    /// z of each point.
    pub z_mm: Vec<f64>,
    /// Standard deviation of each point along its camera ray.
    pub sigma_mm: Vec<f64>,
    /// Image column of each point.
    pub u_px: Vec<f64>,
    /// Image row of each point.
    pub v_px: Vec<f64>,
}

impl ProfileDto {
    /// The profile of the frame `sequence`.
    pub fn new(
        sequence: u32,
        position: StagePosition,
        captured_at_ns: Option<u64>,
        calibration_id: &str,
        profile: &Profile,
    ) -> Self {
        let column = |value: &dyn Fn(&ProfilePoint) -> f64| profile.points.iter().map(value).collect();
        Self {
            sequence,
            position_mm: position.mm(),
            angle_deg: position.deg(),
            captured_at_ns,
            calibration_id: calibration_id.to_owned(),
            order: profile.points.iter().map(|point| point.order).collect(),
            x_mm: column(&|point| point.hit_in_camera.xyz.x),
            y_mm: column(&|point| point.hit_in_camera.xyz.y),
            z_mm: column(&|point| point.hit_in_camera.xyz.z),
            sigma_mm: column(&|point| point.noise_sigma_mm),
            u_px: column(&|point| point.centreline.u_px),
            v_px: column(&|point| point.centreline.v_px),
        }
    }
}
