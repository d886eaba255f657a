//! The camera's own features and its link on the wire.

use devices::features::{Access, CameraLink, Feature, FeatureKind};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What a feature's value is.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraFeatureKindDto {
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
    /// Something it does; any value carries it out.
    Command,
}

/// What may be done with a feature now.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AccessDto {
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
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraFeatureDto {
    /// Its name: of GenICam's standard, or of the camera's maker.
    pub name: String,
    /// What its value is.
    pub kind: CameraFeatureKindDto,
    /// What may be done with it now.
    pub access: AccessDto,
    /// Its value as text, as the camera says; missing if it cannot be read.
    pub value: Option<String>,
    /// Smallest value of a number.
    pub min: Option<f64>,
    /// Largest value of a number.
    pub max: Option<f64>,
    /// What an enumeration may be set to.
    pub entries: Vec<String>,
    /// The camera's own explanation; may be empty.
    pub description: String,
}

/// How the link to the camera does; counts are since it was connected, those of packets since acquisition started.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraLinkDto {
    /// Where the camera is: an IP address, a place on USB.
    pub address: String,
    /// Size of the packets agreed on; missing where it has none.
    pub packet_size_bytes: Option<u32>,
    /// Frames that arrived whole.
    pub frames_complete: u64,
    /// Frames of which packets never came; they are not processed.
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
    /// How well the camera's clock is known in this computer's time, the shortest way of a frame left out; missing before
    /// that is known.
    pub clock_uncertainty_us: Option<f64>,
    /// Temperature of the camera; missing if it does not say.
    pub temperature_c: Option<f64>,
    /// The camera's own pixel format, and what is made of it.
    pub pixels_from: String,
}

/// What a camera says about itself beyond its settings.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraFeaturesDto {
    /// How its link does.
    pub link: CameraLinkDto,
    /// All its features, in its own order.
    pub features: Vec<CameraFeatureDto>,
}

/// A feature that shall be set.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetFeatureDto {
    /// Its name.
    #[schema(example = "GammaEnable", min_length = 1)]
    pub name: String,
    /// Its value as text: a number, `true` or `false`, an entry.
    #[schema(example = "false")]
    pub value: String,
}

/// Features that shall be set, one after the other.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ChangeFeaturesDto {
    /// In this order; the first that is refused ends it.
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

impl From<Access> for AccessDto {
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
        // JSON has no infinities: a number without a limit has none.
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
