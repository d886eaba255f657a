//! Which device is at the other end of the cable.

/// What a device says about itself; checked against what the station expects when it is opened.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct DeviceIdentity {
    /// The driver that talks to it: `twin`, `replay`, `grbl`, `genicam`.
    pub driver: &'static str,
    /// Who made it, or an empty text if it does not say.
    pub vendor: String,
    /// Which model it is.
    pub model: String,
    /// What tells it from another of the same model; empty if it does not say.
    pub serial: String,
    /// Version of its firmware; empty if it does not say.
    pub firmware: String,
}

impl DeviceIdentity {
    /// A device that says nothing about itself.
    pub fn unknown(driver: &'static str) -> Self {
        let text = String::new;
        Self { driver, vendor: text(), model: text(), serial: text(), firmware: text() }
    }
}
