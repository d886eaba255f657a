//! Details of a camera beyond the settings common to all cameras: its own features by name, and the state of its link
//! to this computer. For engineers; nothing in the service depends on a name.

use std::time::Duration;

/// Type of a feature's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FeatureKind {
    /// An integer.
    Integer,
    /// A floating-point number.
    Float,
    /// `true` or `false`.
    Boolean,
    /// One of its entries.
    Enumeration,
    /// Any text.
    Text,
    /// A command; it has no value.
    Command,
}

/// Access to a feature in the current state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read.
    ReadOnly,
    /// Set.
    WriteOnly,
    /// Both.
    ReadWrite,
    /// Neither, with the current settings.
    NotAvailable,
}

/// A feature as described by the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// Its name, from the standard or from the vendor.
    pub name: String,
    /// Type of its value.
    pub kind: FeatureKind,
    /// Current access.
    pub access: Access,
    /// Its value as text; `None` if it cannot be read.
    pub value: Option<String>,
    /// Smallest and largest value of a number.
    pub range: Option<(f64, f64)>,
    /// Values of an enumeration.
    pub entries: Vec<String>,
    /// The camera's own explanation; may be empty.
    pub description: String,
}

/// Why a feature was not read or set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FeatureError {
    /// The camera has no such feature.
    #[error("the camera has no feature `{name}`; those it has are listed with their values")]
    Unknown {
        /// The requested name.
        name: String,
    },
    /// The camera refused.
    #[error("the camera refused {name} = {value}: {reason}")]
    Refused {
        /// The feature.
        name: String,
        /// The requested value.
        value: String,
        /// Message of the camera or its driver.
        reason: String,
    },
    /// It does not respond.
    #[error("the camera is disconnected: {reason}")]
    Disconnected {
        /// What was detected.
        reason: String,
    },
}

/// State of the link to a camera; counts are since it was opened.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CameraLink {
    /// Its address or bus.
    pub address: String,
    /// Negotiated packet size; `None` without packets.
    pub packet_size_bytes: Option<u32>,
    /// Complete frames.
    pub frames_complete: u64,
    /// Incomplete frames, which are not processed.
    pub frames_incomplete: u64,
    /// Frames lost completely, by gaps in the camera's count.
    pub frames_missing: u64,
    /// Number of times that no buffer was free for a frame.
    pub underruns: u64,
    /// Missing packets.
    pub packets_missing: u64,
    /// Packet resend requests.
    pub resend_requests: u64,
    /// Packets received after a resend request.
    pub packets_resent: u64,
    /// Uncertainty of the camera's clock in this computer's time; `None` until it is known, or without a clock. It does
    /// not include the shortest time from exposure to arrival, which cannot be measured from here.
    pub clock_uncertainty: Option<Duration>,
    /// Temperature of the camera, °C; `None` if not available.
    pub temperature_c: Option<f64>,
    /// The camera's pixel format, and its conversion: `Mono8`; `BayerRG8: green, interpolated`.
    pub pixels_from: String,
}

/// Reads and sets features of a camera, independently of its owner; calls may take as long as the camera does.
pub trait CameraDetails: Send + Sync {
    /// All features, in the camera's order.
    ///
    /// # Errors
    /// [`FeatureError::Disconnected`].
    fn features(&self) -> Result<Vec<Feature>, FeatureError>;

    /// Sets a feature from text and returns it as read back. Features that were set are set again after a reconnection.
    ///
    /// # Errors
    /// [`FeatureError`].
    fn set_feature(&self, name: &str, value: &str) -> Result<Feature, FeatureError>;

    /// State of its link.
    fn link(&self) -> CameraLink;
}
