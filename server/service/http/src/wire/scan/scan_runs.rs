//! Scan plans and the settings of completed scans, on the wire.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::job::job_inputs::{UnknownCode, measure_dtos};
use crate::wire::measurement::measurements::MeasureDto;
use crate::wire::scan::scans::ScanSourceDto;
use crate::wire::scan::settings::{BackgroundDto, ScanModeDto};
use app::scan_run::{ScanPlan, ScanPurpose, ScanRange, ScanRun};
use optics::StageKind;

/// Purpose of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanPurposeDto {
    /// Inspection of a part.
    Production,
    /// Verification of the calibration on a reference part.
    Verification,
}

impl ScanPurposeDto {
    /// Its code.
    pub fn code(self) -> &'static str {
        match self {
            Self::Production => "production",
            Self::Verification => "verification",
        }
    }
}

impl From<ScanPurpose> for ScanPurposeDto {
    fn from(purpose: ScanPurpose) -> Self {
        match purpose {
            ScanPurpose::Production => Self::Production,
            ScanPurpose::Verification => Self::Verification,
        }
    }
}

impl From<ScanPurposeDto> for ScanPurpose {
    fn from(dto: ScanPurposeDto) -> Self {
        match dto {
            ScanPurposeDto::Production => Self::Production,
            ScanPurposeDto::Verification => Self::Verification,
        }
    }
}

/// The plan of a scan.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ScanPlanDto {
    /// Motion of the stage.
    pub mode: ScanModeDto,
    /// Position of the first row, linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Position of the last row at most, linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Distance between rows, always positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan, linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// Angle of the first row, turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Angle of the last row at most, turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Angle between rows, always positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan, turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_deg_s: Option<f64>,
    /// Number of rows; each row is one frame.
    pub n_rows: usize,
    /// Frame rate of a continuous scan.
    pub frame_rate_hz: Option<f64>,
    /// Exposure time of the laser frames, µs; with several, the longest.
    pub exposure_us: f64,
    /// All exposure times of a row, µs, shortest first; empty if there is only one.
    pub exposures_us: Vec<f64>,
    /// Fraction of full laser power, 0–1.
    pub laser_power: f64,
    /// Whether the images are kept as a capture.
    pub keep_frames: bool,
    /// When laser-off images are captured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundDto>,
    /// Estimated duration of the whole job, s: frames, cloud and measurements, from recent scans on this machine.
    pub duration_s: f64,
    /// Duration of the acquisition, from the first motion to the last row, s.
    pub acquisition_s: f64,
    /// Duration of the evaluation after the last row, s.
    pub evaluation_s: f64,
    /// Duration of the measurements, s.
    pub measuring_s: f64,
    /// Number of orders; each sweeps the whole part.
    pub n_orders: usize,
    /// Rows per mm on a flat part perpendicular to the camera axis, per order; on a turntable, on a surface half-way
    /// between the axis and the nearest calibrated depth.
    pub rows_per_mm: f64,
    /// Points per mm along a line.
    pub points_per_mm_along_line: f64,
    /// Points per mm² on a flat part perpendicular to the camera axis, per order.
    pub points_per_mm2: f64,
    /// Maximum number of points in the cloud.
    pub max_points: u64,
    /// Predicted standard deviation of a point along its camera ray, mm, from image noise on matt grey paint and the
    /// calibration; absent if the calibrated depths are out of view.
    pub predicted_sigma_mm: Option<f64>,
    /// Depth range (z of the camera frame) for the part, mm: nearest and farthest.
    #[schema(min_items = 2, max_items = 2)]
    pub depth_mm: [f64; 2],
    /// Depth range in which the image position of a line alone determines its order, mm; beyond it, a surface must be seen
    /// twice.
    #[schema(min_items = 2, max_items = 2)]
    pub unambiguous_depth_mm: [f64; 2],
    /// Disk space needed, bytes.
    pub disk_bytes: u64,
    /// Notes for the operator before the start.
    pub notes: Vec<String>,
}

/// How a scan was made. Fields that only a station provides are absent for a scan of a capture.
#[derive(Debug, Serialize, ToSchema)]
pub struct ScanRunDto {
    /// Source of its frames.
    pub source: ScanSourceDto,
    /// Name of the scan in the header of its cloud.
    pub scan: String,
    /// Number of planned rows.
    pub n_rows: usize,
    /// What was measured in the same job.
    pub measure: Vec<MeasureDto>,
    /// Purpose.
    pub purpose: ScanPurposeDto,
    /// Motion of the stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<ScanModeDto>,
    /// Position of the first row, linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Position of the last row at most, linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Distance between rows, always positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan, linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// Angle of the first row, turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Angle of the last row at most, turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Angle between rows, always positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan, turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_deg_s: Option<f64>,
    /// Frame rate of a continuous scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate_hz: Option<f64>,
    /// Exposure time of the laser frames, µs; with several, the longest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<f64>,
    /// All exposure times of a row, µs, shortest first; empty if there is only one.
    pub exposures_us: Vec<f64>,
    /// Fraction of full laser power, 0–1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub laser_power: Option<f64>,
    /// Whether the images are kept as a capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_frames: Option<bool>,
    /// When laser-off images are captured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundDto>,
    /// Estimated duration of the whole job, s: frames, cloud and measurements, from recent scans on this machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Duration of the acquisition, from the first motion to the last row, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acquisition_s: Option<f64>,
    /// Duration of the evaluation after the last row, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evaluation_s: Option<f64>,
    /// Duration of the measurements, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measuring_s: Option<f64>,
    /// Number of orders; each sweeps the whole part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_orders: Option<usize>,
    /// Rows per mm on a flat part perpendicular to the camera axis, per order; on a turntable, on a surface half-way
    /// between the axis and the nearest calibrated depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows_per_mm: Option<f64>,
    /// Points per mm along a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points_per_mm_along_line: Option<f64>,
    /// Points per mm² on a flat part perpendicular to the camera axis, per order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points_per_mm2: Option<f64>,
    /// Maximum number of points in the cloud.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_points: Option<u64>,
    /// Predicted standard deviation of a point along its camera ray, mm, from image noise on matt grey paint and the
    /// calibration; absent if the calibrated depths are out of view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predicted_sigma_mm: Option<f64>,
    /// Depth range (z of the camera frame) for the part, mm: nearest and farthest.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(min_items = 2, max_items = 2)]
    pub depth_mm: Option<[f64; 2]>,
    /// Depth range in which the image position of a line alone determines its order, mm; beyond it, a surface must be seen
    /// twice.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(min_items = 2, max_items = 2)]
    pub unambiguous_depth_mm: Option<[f64; 2]>,
    /// Disk space needed, bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disk_bytes: Option<u64>,
    /// Notes for the operator before the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub notes: Option<Vec<String>>,
}

/// The range of a plan in millimetres or in degrees.
fn by_unit(plan: Option<&ScanPlan>) -> [Option<ScanRange>; 2] {
    let of = |stage| plan.map(|plan| plan.range).filter(|range| range.stage == stage);
    [of(StageKind::Linear), of(StageKind::Rotary)]
}

impl From<ScanPlan> for ScanPlanDto {
    fn from(plan: ScanPlan) -> Self {
        let [travel, turn] = by_unit(Some(&plan));
        Self {
            mode: plan.mode.into(),
            from_mm: travel.map(|range| range.from),
            to_mm: travel.map(|range| range.to),
            step_mm: travel.map(|range| range.step),
            speed_mm_s: travel.and_then(|range| range.speed),
            from_deg: turn.map(|range| range.from),
            to_deg: turn.map(|range| range.to),
            step_deg: turn.map(|range| range.step),
            speed_deg_s: turn.and_then(|range| range.speed),
            n_rows: plan.n_rows,
            frame_rate_hz: plan.frame_rate_hz,
            exposure_us: plan.exposure_us,
            exposures_us: plan.exposures_us.clone(),
            laser_power: plan.laser_power,
            keep_frames: plan.keep_frames,
            background: plan.background.map(BackgroundDto::from),
            duration_s: plan.duration_s,
            acquisition_s: plan.acquisition_s,
            evaluation_s: plan.evaluation_s,
            measuring_s: plan.measuring_s,
            n_orders: plan.n_orders,
            rows_per_mm: plan.rows_per_mm,
            points_per_mm_along_line: plan.points_per_mm_along_line,
            points_per_mm2: plan.points_per_mm2,
            max_points: plan.max_points,
            predicted_sigma_mm: plan.predicted_sigma_mm,
            depth_mm: plan.depth_mm,
            unambiguous_depth_mm: plan.unambiguous_depth_mm,
            disk_bytes: plan.disk_bytes,
            notes: plan.notes,
        }
    }
}

impl TryFrom<ScanRun> for ScanRunDto {
    type Error = UnknownCode;

    fn try_from(run: ScanRun) -> Result<Self, UnknownCode> {
        let plan = run.plan.as_ref();
        let [travel, turn] = by_unit(plan);
        Ok(Self {
            source: run.source.into(),
            scan: run.cloud_name,
            n_rows: run.n_rows,
            measure: measure_dtos(run.measure)?,
            purpose: run.purpose.into(),
            mode: plan.map(|plan| plan.mode.into()),
            from_mm: travel.map(|range| range.from),
            to_mm: travel.map(|range| range.to),
            step_mm: travel.map(|range| range.step),
            speed_mm_s: travel.and_then(|range| range.speed),
            from_deg: turn.map(|range| range.from),
            to_deg: turn.map(|range| range.to),
            step_deg: turn.map(|range| range.step),
            speed_deg_s: turn.and_then(|range| range.speed),
            frame_rate_hz: plan.and_then(|plan| plan.frame_rate_hz),
            exposure_us: plan.map(|plan| plan.exposure_us),
            exposures_us: plan.map(|plan| plan.exposures_us.clone()).unwrap_or_default(),
            laser_power: plan.map(|plan| plan.laser_power),
            keep_frames: plan.map(|plan| plan.keep_frames),
            background: plan.and_then(|plan| plan.background).map(BackgroundDto::from),
            duration_s: plan.map(|plan| plan.duration_s),
            acquisition_s: plan.map(|plan| plan.acquisition_s),
            evaluation_s: plan.map(|plan| plan.evaluation_s),
            measuring_s: plan.map(|plan| plan.measuring_s),
            n_orders: plan.map(|plan| plan.n_orders),
            rows_per_mm: plan.map(|plan| plan.rows_per_mm),
            points_per_mm_along_line: plan.map(|plan| plan.points_per_mm_along_line),
            points_per_mm2: plan.map(|plan| plan.points_per_mm2),
            max_points: plan.map(|plan| plan.max_points),
            predicted_sigma_mm: plan.and_then(|plan| plan.predicted_sigma_mm),
            depth_mm: plan.map(|plan| plan.depth_mm),
            unambiguous_depth_mm: plan.map(|plan| plan.unambiguous_depth_mm),
            disk_bytes: plan.map(|plan| plan.disk_bytes),
            notes: plan.map(|plan| plan.notes.clone()),
        })
    }
}
