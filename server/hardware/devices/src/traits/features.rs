//! What a camera says about itself beyond the settings that all cameras share: its own features by name, and how its link
//! to this computer does. For engineers; nothing in the service depends on a name.

use std::time::Duration;

/// What a feature's value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FeatureKind {
    /// A whole number.
    Integer,
    /// A number.
    Float,
    /// `true` or `false`.
    Boolean,
    /// One of its entries.
    Enumeration,
    /// Any text.
    Text,
    /// Something it does; it has no value.
    Command,
}

/// What may be done with a feature now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read.
    ReadOnly,
    /// Set.
    WriteOnly,
    /// Both.
    ReadWrite,
    /// Neither, as the camera is set now.
    NotAvailable,
}

/// A feature as the camera describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// Its name, of the standard or of the camera's maker.
    pub name: String,
    /// What its value is.
    pub kind: FeatureKind,
    /// What may be done with it now.
    pub access: Access,
    /// Its value as text; `None` if it cannot be read.
    pub value: Option<String>,
    /// Smallest and largest value of a number.
    pub range: Option<(f64, f64)>,
    /// What an enumeration may be set to.
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
        /// The name asked for.
        name: String,
    },
    /// The camera refused.
    #[error("the camera refused {name} = {value}: {reason}")]
    Refused {
        /// Which feature.
        name: String,
        /// The value wanted.
        value: String,
        /// What the camera or its driver said.
        reason: String,
    },
    /// It does not answer any more.
    #[error("the camera is gone: {reason}")]
    Gone {
        /// What was noticed.
        reason: String,
    },
}

/// How the link to a camera does; counts are since it was opened.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CameraLink {
    /// How it is reached: an address, a bus.
    pub address: String,
    /// Size of the packets agreed on; `None` where it has none.
    pub packet_size_bytes: Option<u32>,
    /// Frames that arrived whole.
    pub frames_complete: u64,
    /// Frames of which packets never came; not processed.
    pub frames_incomplete: u64,
    /// Frames of which nothing came, by gaps in the camera's count.
    pub frames_missing: u64,
    /// Times that no buffer was free for a frame.
    pub underruns: u64,
    /// Packets that never came.
    pub packets_missing: u64,
    /// Packets asked for again.
    pub resend_requests: u64,
    /// Packets that came when they were asked for again.
    pub packets_resent: u64,
    /// How well the camera's clock is known in this computer's time; `None` before that is known, or without a clock.
    /// Beyond it lies what no one can see from here: the shortest time from exposure to arrival.
    pub clock_uncertainty: Option<Duration>,
    /// Temperature of the camera, °C; `None` if it does not say.
    pub temperature_c: Option<f64>,
    /// The camera's pixel format, and what is made of it: `Mono8`; `BayerRG8: green, interpolated`.
    pub pixels_from: String,
}

/// Reads and sets features of a camera, beside what its owner does; calls may take as long as the camera does.
pub trait CameraDetails: Send + Sync {
    /// All features, in the camera's order.
    ///
    /// # Errors
    /// [`FeatureError::Gone`].
    fn features(&self) -> Result<Vec<Feature>, FeatureError>;

    /// Sets a feature from text and returns it as the camera says it is then. What was set is set again when the camera
    /// was away.
    ///
    /// # Errors
    /// [`FeatureError`].
    fn set_feature(&self, name: &str, value: &str) -> Result<Feature, FeatureError>;

    /// How its link does.
    fn link(&self) -> CameraLink;
}
