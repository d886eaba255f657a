//! A recipe as people write it.

use std::collections::BTreeMap;

use metrology::Plan;
use serde::{Deserialize, Serialize};

use crate::resources::scan_run::{BackgroundInput, ScanMode};

/// How a part is scanned, measured and judged. It holds no calibration: an inspection uses the active one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// What people call it.
    pub name: String,
    /// By which a PLC calls it, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<u32>,
    /// A regular expression for whole serial numbers: it is chosen for parts whose number matches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial_pattern: Option<String>,
    /// How the part is scanned.
    pub scan: RecipeScan,
    /// What is measured, and within which limits.
    pub plan: Plan,
    /// Handed on to other systems as they are.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub attributes: BTreeMap<String, String>,
}

/// How a part is scanned on the station: the fields of a scan request that are the same for every part.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecipeScan {
    /// First position of a linear stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Last position of a linear stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Distance between rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan; the step follows from the frame rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// First angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Last angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Angle between rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan on a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_deg_s: Option<f64>,
    /// Motion of the stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<ScanMode>,
    /// Exposure time; `None`: chosen by the station.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<f64>,
    /// Two to four exposure times per row instead of one (HDR).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exposures_us: Vec<f64>,
    /// Laser power, share of full power.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser_power: Option<f64>,
    /// When laser-off images are captured; `None`: never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundInput>,
    /// Keep the frames as a capture.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub keep_frames: bool,
    /// Record everything that the camera delivers as an MCAP file.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub record: bool,
}
