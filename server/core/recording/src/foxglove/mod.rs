//! The Foxglove protobuf messages used by a recording, and their descriptors. The names and numbers are those of
//! github.com/foxglove/foxglove-sdk (`schemas/proto/foxglove`); a test compares the descriptors with the published
//! ones.

mod descriptors;

pub use descriptors::{point_cloud_descriptors, raw_image_descriptors};
pub use prost_types::Timestamp;

/// `foxglove.RawImage`: an image as delivered by the sensor.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RawImage {
    /// Capture time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// Frame of reference.
    #[prost(string, tag = "7")]
    pub frame_id: String,
    /// Columns.
    #[prost(fixed32, tag = "2")]
    pub width: u32,
    /// Rows.
    #[prost(fixed32, tag = "3")]
    pub height: u32,
    /// `mono8`, `mono16`.
    #[prost(string, tag = "4")]
    pub encoding: String,
    /// Bytes of a row.
    #[prost(fixed32, tag = "5")]
    pub step: u32,
    /// Row by row, little endian.
    #[prost(bytes = "bytes", tag = "6")]
    pub data: bytes::Bytes,
}

/// `foxglove.PointCloud`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PointCloud {
    /// Capture time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// Frame of reference.
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// Pose of the cloud's origin in it.
    #[prost(message, optional, tag = "3")]
    pub pose: Option<Pose>,
    /// Bytes of a point.
    #[prost(fixed32, tag = "4")]
    pub point_stride: u32,
    /// Fields of a point.
    #[prost(message, repeated, tag = "5")]
    pub fields: Vec<PackedElementField>,
    /// Point by point, little endian.
    #[prost(bytes = "bytes", tag = "6")]
    pub data: bytes::Bytes,
}

/// `foxglove.Pose`.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Pose {
    /// Position.
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3>,
    /// Orientation.
    #[prost(message, optional, tag = "2")]
    pub orientation: Option<Quaternion>,
}

/// `foxglove.Vector3`.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Vector3 {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
}

/// `foxglove.Quaternion`.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Quaternion {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
    /// w.
    #[prost(double, tag = "4")]
    pub w: f64,
}

/// `foxglove.PackedElementField`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PackedElementField {
    /// Its name.
    #[prost(string, tag = "1")]
    pub name: String,
    /// Offset within a point.
    #[prost(fixed32, tag = "2")]
    pub offset: u32,
    /// Its numeric type.
    #[prost(enumeration = "NumericType", tag = "3")]
    pub r#type: i32,
}

/// `foxglove.PackedElementField.NumericType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum NumericType {
    /// Unspecified.
    Unknown = 0,
    /// Unsigned, 8 bits.
    Uint8 = 1,
    /// Signed, 8 bits.
    Int8 = 2,
    /// Unsigned, 16 bits.
    Uint16 = 3,
    /// Signed, 16 bits.
    Int16 = 4,
    /// Unsigned, 32 bits.
    Uint32 = 5,
    /// Signed, 32 bits.
    Int32 = 6,
    /// Single precision.
    Float32 = 7,
    /// Double precision.
    Float64 = 8,
}
