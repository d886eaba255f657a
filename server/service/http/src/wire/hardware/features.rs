//! Camera features (GenICam) and the camera link on the wire.

use devices::features::{Access, CameraLink, Feature, FeatureKind};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Type of a feature.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraFeatureKindDto {
    /// Integer.
    Integer,
    /// Floating-point number.
    Float,
    /// `true` or `false`.
    Boolean,
    /// One of the listed entries.
    Enumeration,
    /// Text.
    Text,
    /// Command; setting any value executes it.
    Command,
}

/// Current access mode of a feature.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FeatureAccessDto {
    /// Readable.
    ReadOnly,
    /// Writable.
    WriteOnly,
    /// Readable and writable.
    ReadWrite,
    /// Not available with the current settings.
    NotAvailable,
}

/// A camera feature.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraFeatureDto {
    /// Name, from the GenICam SFNC or vendor-specific.
    pub name: String,
    /// Type of the value.
    pub kind: CameraFeatureKindDto,
    /// Current access mode.
    pub access: FeatureAccessDto,
    /// Value as text; absent if it cannot be read.
    pub value: Option<String>,
    /// Minimum of a number.
    pub min: Option<f64>,
    /// Maximum of a number.
    pub max: Option<f64>,
    /// Entries of an enumeration.
    pub entries: Vec<String>,
    /// Description from the camera; may be empty.
    pub description: String,
}

/// State of the camera link. Frame counts are since connection, packet counts since the start of acquisition.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraLinkDto {
    /// Address of the camera: IP address or USB path.
    pub address: String,
    /// Negotiated packet size; absent on links without packets.
    pub packet_size_bytes: Option<u32>,
    /// Frames received completely.
    pub frames_complete: u64,
    /// Frames with missing packets; they are not processed.
    pub frames_incomplete: u64,
    /// Frames not received at all, from gaps in the frame counter.
    pub frames_missing: u64,
    /// Frames for which no buffer was free.
    pub underruns: u64,
    /// Packets not received.
    pub packets_missing: u64,
    /// Packet resend requests.
    pub resend_requests: u64,
    /// Packets received after a resend request.
    pub packets_resent: u64,
    /// Uncertainty of the mapping from camera time to computer time, excluding the constant transfer delay; absent until
    /// it is known.
    pub clock_uncertainty_us: Option<f64>,
    /// Temperature of the camera; absent if it does not report one.
    pub temperature_c: Option<f64>,
    /// Native pixel format and its conversion.
    pub pixels_from: String,
}

/// Features and link of a camera.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraFeaturesDto {
    /// State of the link.
    pub link: CameraLinkDto,
    /// All features, in the order of the camera.
    pub features: Vec<CameraFeatureDto>,
}

/// A feature to set.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetFeatureDto {
    /// Its name.
    #[schema(example = "GammaEnable", min_length = 1)]
    pub name: String,
    /// Value as text: a number, `true` or `false`, or an entry.
    #[schema(example = "false")]
    pub value: String,
}

/// Features to set, one after the other.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ChangeFeaturesDto {
    /// Set in this order; stops at the first one refused.
    #[schema(min_items = 1, max_items = 64)]
    pub features: Vec<SetFeatureDto>,
}

impl From<FeatureKind> for CameraFeatureKindDto {
    fn from(kind: FeatureKind) -> Self {
        match kind {
            FeatureKind::Integer => Self::Integer,
            FeatureKind::Float => Self::Float,
            FeatureKind::Boolean => Self::Boolean,
            FeatureKind::Enumeration => Self::Enumeration,
            FeatureKind::Text => Self::Text,
            FeatureKind::Command => Self::Command,
        }
    }
}

impl From<Access> for FeatureAccessDto {
    fn from(access: Access) -> Self {
        match access {
            Access::ReadOnly => Self::ReadOnly,
            Access::WriteOnly => Self::WriteOnly,
            Access::ReadWrite => Self::ReadWrite,
            Access::NotAvailable => Self::NotAvailable,
        }
    }
}

impl From<Feature> for CameraFeatureDto {
    fn from(feature: Feature) -> Self {
        // JSON has no infinity: an unbounded range has no limit.
        let finite = |limit: f64| limit.is_finite().then_some(limit);
        Self {
            name: feature.name,
            kind: feature.kind.into(),
            access: feature.access.into(),
            value: feature.value,
            min: feature.range.and_then(|range| finite(range.0)),
            max: feature.range.and_then(|range| finite(range.1)),
            entries: feature.entries,
            description: feature.description,
        }
    }
}

impl From<CameraLink> for CameraLinkDto {
    fn from(link: CameraLink) -> Self {
        Self {
            address: link.address,
            packet_size_bytes: link.packet_size_bytes,
            frames_complete: link.frames_complete,
            frames_incomplete: link.frames_incomplete,
            frames_missing: link.frames_missing,
            underruns: link.underruns,
            packets_missing: link.packets_missing,
            resend_requests: link.resend_requests,
            packets_resent: link.packets_resent,
            clock_uncertainty_us: link.clock_uncertainty.map(|time| time.as_secs_f64() * 1e6),
            temperature_c: link.temperature_c,
            pixels_from: link.pixels_from,
        }
    }
}
