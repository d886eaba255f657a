//! The devices that captured the images of a calibration, as stored with its job and in its summary.

use devices::DeviceIdentity;
use serde::{Deserialize, Serialize};
use station::StationStatus;

/// Key in the summary of a calibration. Absent for a calibration from a stored capture, whose images do not tell.
pub const STATION: &str = "station";

/// The station as it was when the images were captured.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UsedStation {
    /// `twin` or `replay` if the devices were simulated.
    pub simulated: Option<String>,
    /// The connected devices.
    pub devices: Vec<UsedDevice>,
}

/// A device as it identified itself; texts are empty if unknown.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UsedDevice {
    /// `camera`, `stage` or `laser`.
    pub part: String,
    /// Vendor.
    pub vendor: String,
    /// Model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Firmware version.
    pub firmware: String,
}

impl UsedStation {
    /// The station in this state.
    pub fn of(status: &StationStatus) -> Self {
        let (camera, stage, laser) = (&status.camera, &status.stage, &status.laser);
        let parts = [
            ("camera", camera.connected, &camera.identity),
            ("stage", stage.connected, &stage.identity),
            ("laser", laser.connected, &laser.identity),
        ];
        let device = |(part, _, identity): (&str, bool, &DeviceIdentity)| UsedDevice {
            part: part.to_owned(),
            vendor: identity.vendor.clone(),
            model: identity.model.clone(),
            serial: identity.serial.clone(),
            firmware: identity.firmware.clone(),
        };
        Self {
            simulated: status.simulated.map(str::to_owned),
            devices: parts.into_iter().filter(|(_, connected, _)| *connected).map(device).collect(),
        }
    }
}
