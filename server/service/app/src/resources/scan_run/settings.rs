//! The settings of a scan on the station: what a request and a recipe have in common.

use serde::{Deserialize, Serialize};

use crate::resources::scan_run::{BackgroundInput, ScanMode};

/// How the station scans a part. A new scan parameter is a field here and in `http/src/wire/scan/settings.rs`.
///
/// Also the stored form, in jobs and recipes; absent fields are omitted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanSettings {
    /// First position of a linear stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Last position of a linear stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Distance between rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan on a linear stage; the step follows from the frame rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// First angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Last angle of a turntable; more than a full turn shows the closure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Angle between rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan on a turntable; the step follows from the frame rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_deg_s: Option<f64>,
    /// Motion of the stage; `None`: continuous if a speed is given, else stop-and-go.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<ScanMode>,
    /// Exposure time of the laser frames; `None`: chosen by the station.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<f64>,
    /// Two to four exposure times per row instead of one (HDR), for parts with dark and bright areas.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exposures_us: Vec<f64>,
    /// Laser power, fraction of full power; `None`: chosen by the station.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser_power: Option<f64>,
    /// When laser-off images are captured; `None`: never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundInput>,
    /// Keep the frames as a capture.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub keep_frames: bool,
    /// Record everything that the camera delivers during the scan as an MCAP file.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub record: bool,
}

impl ScanSettings {
    /// Motion of the stage: as set, or continuous if a speed is given.
    pub fn mode(&self) -> ScanMode {
        let has_speed = self.speed_mm_s.is_some() || self.speed_deg_s.is_some();
        self.mode.unwrap_or(if has_speed { ScanMode::Continuous } else { ScanMode::StopAndGo })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_makes_a_scan_continuous_unless_the_mode_is_set() {
        let swept = ScanSettings { speed_deg_s: Some(15.0), ..ScanSettings::default() };
        assert_eq!(swept.mode(), ScanMode::Continuous);
        let stepped = ScanSettings { mode: Some(ScanMode::StopAndGo), ..swept };
        assert_eq!(stepped.mode(), ScanMode::StopAndGo);
        assert_eq!(ScanSettings::default().mode(), ScanMode::StopAndGo);
    }
}
