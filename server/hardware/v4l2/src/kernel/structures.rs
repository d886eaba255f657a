//! Structures of `linux/videodev2.h`, with the kernel's field names.
//!
//! All consist of plain numbers, for which zero is valid.

use nix::libc::{c_ulong, timeval};

/// Structure for which all zeros is valid.
///
/// # Safety
/// Zero bytes are a valid value.
pub unsafe trait Plain: Sized {
    fn zeroed() -> Self {
        // SAFETY: guaranteed by the implementation.
        unsafe { std::mem::zeroed() }
    }
}

macro_rules! plain {
    ($($name:ident),*) => {
        $(
            // SAFETY: consists of numbers only.
            unsafe impl Plain for $name {}
        )*
    };
}

plain!(
    Capability,
    FormatDescription,
    Fraction,
    FrameSize,
    FrameInterval,
    Format,
    StreamParameters,
    QueryControl,
    ControlValue,
    RequestBuffers,
    Buffer,
    PixelFormat
);

/// `v4l2_capability`
#[repr(C)]
pub struct Capability {
    pub driver: [u8; 16],
    pub card: [u8; 32],
    pub bus_info: [u8; 32],
    pub version: u32,
    pub capabilities: u32,
    pub device_caps: u32,
    pub reserved: [u32; 3],
}

/// `v4l2_fmtdesc`
#[repr(C)]
pub struct FormatDescription {
    pub index: u32,
    pub type_: u32,
    pub flags: u32,
    pub description: [u8; 32],
    pub pixelformat: u32,
    pub mbus_code: u32,
    pub reserved: [u32; 3],
}

/// `v4l2_fract`
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Fraction {
    pub numerator: u32,
    pub denominator: u32,
}

/// `v4l2_frmsizeenum`
#[repr(C)]
pub struct FrameSize {
    pub index: u32,
    pub pixel_format: u32,
    pub type_: u32,
    /// `discrete`: width, height; `stepwise`: least, largest and step of the width, then of the height.
    pub sizes: [u32; 6],
    pub reserved: [u32; 2],
}

/// `v4l2_frmivalenum`
#[repr(C)]
pub struct FrameInterval {
    pub index: u32,
    pub pixel_format: u32,
    pub width: u32,
    pub height: u32,
    pub type_: u32,
    /// `discrete`: the first; `stepwise`: least, largest, step.
    pub intervals: [Fraction; 3],
    pub reserved: [u32; 2],
}

/// `v4l2_pix_format`
#[derive(Clone, Copy)]
#[repr(C)]
pub struct PixelFormat {
    pub width: u32,
    pub height: u32,
    pub pixelformat: u32,
    pub field: u32,
    pub bytesperline: u32,
    pub sizeimage: u32,
    pub colorspace: u32,
    pub priv_: u32,
    pub flags: u32,
    pub ycbcr_enc: u32,
    pub quantization: u32,
    pub xfer_func: u32,
}

/// The union within `v4l2_format`: other members hold pointers, which align it.
#[repr(C)]
pub union FormatUnion {
    pub pix: PixelFormat,
    pub raw_data: [u8; 200],
    pub pointer: c_ulong,
}

/// `v4l2_format`
#[repr(C)]
pub struct Format {
    pub type_: u32,
    pub fmt: FormatUnion,
}

/// `v4l2_streamparm` with the member `capture` of its union.
#[repr(C)]
pub struct StreamParameters {
    pub type_: u32,
    pub capability: u32,
    pub capturemode: u32,
    pub timeperframe: Fraction,
    pub extendedmode: u32,
    pub readbuffers: u32,
    pub reserved: [u32; 4],
    pub rest: [u8; 160],
}

/// `v4l2_queryctrl`
#[repr(C)]
pub struct QueryControl {
    pub id: u32,
    pub type_: u32,
    pub name: [u8; 32],
    pub minimum: i32,
    pub maximum: i32,
    pub step: i32,
    pub default_value: i32,
    pub flags: u32,
    pub reserved: [u32; 2],
}

/// `v4l2_control`
#[repr(C)]
pub struct ControlValue {
    pub id: u32,
    pub value: i32,
}

/// `v4l2_requestbuffers`
#[repr(C)]
pub struct RequestBuffers {
    pub count: u32,
    pub type_: u32,
    pub memory: u32,
    pub capabilities: u32,
    pub flags: u8,
    pub reserved: [u8; 3],
}

/// The union within `v4l2_buffer`: other members hold pointers.
#[repr(C)]
pub union BufferUnion {
    pub offset: u32,
    pub userptr: c_ulong,
}

/// `v4l2_buffer`
#[repr(C)]
pub struct Buffer {
    pub index: u32,
    pub type_: u32,
    pub bytesused: u32,
    pub flags: u32,
    pub field: u32,
    pub timestamp: timeval,
    pub timecode: [u32; 4],
    pub sequence: u32,
    pub memory: u32,
    pub m: BufferUnion,
    pub length: u32,
    pub reserved2: u32,
    pub request_fd: i32,
}
