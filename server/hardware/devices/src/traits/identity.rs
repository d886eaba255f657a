//! Identity of a device.

/// Identity as stated by the device; compared with the expected one when it is opened.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct DeviceIdentity {
    /// Its driver: `twin`, `replay`, `grbl`, `genicam`.
    pub driver: &'static str,
    /// Vendor; empty if unknown.
    pub vendor: String,
    /// Model.
    pub model: String,
    /// Serial number; empty if unknown.
    pub serial: String,
    /// Firmware version; empty if unknown.
    pub firmware: String,
}

impl DeviceIdentity {
    /// A device of unknown identity.
    pub fn unknown(driver: &'static str) -> Self {
        let text = String::new;
        Self { driver, vendor: text(), model: text(), serial: text(), firmware: text() }
    }
}
