//! The stream of frames: a thread of the library fills the pushed buffers and returns them in order.

use std::ffi::{CStr, c_int, c_uint};
use std::ptr::{self, NonNull};
use std::time::Duration;

use aravis_sys as arv;
use gobject_sys::{g_object_set, g_object_unref, g_type_check_instance_is_a};

use super::buffer::Buffer;
use super::device::Device;
use super::error::{AravisError, checked};

/// Packet options of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamOptions {
    /// Whether missing packets are requested again.
    pub resend: bool,
    /// Size of the socket's buffer, bytes; the system may grant less.
    pub socket_buffer_bytes: usize,
}

/// A stream.
pub struct Stream(NonNull<arv::ArvStream>);

// SAFETY: the library ties a stream to no thread, and `&mut self` or the one owner uses it; pushing and popping while
// its own thread fills buffers is documented as safe.
unsafe impl Send for Stream {}

impl Stream {
    /// A stream of a device, with its thread, without buffers.
    pub fn new(device: &Device, options: StreamOptions) -> Result<Self, AravisError> {
        // SAFETY: the camera is valid as long as `device`; no callback and so no user data; the reference returned is
        // the caller's.
        let made = checked(|error| unsafe {
            arv::arv_camera_create_stream(device.camera(), None, ptr::null_mut(), error)
        })?;
        let stream = NonNull::new(made).ok_or_else(|| AravisError("no stream could be created".to_owned()))?;
        // SAFETY: the stream is a valid object; what is set are properties of a GigE Vision stream with their
        // documented types (enumerations and `int` passed as `int`, the list ended by null), and only on one.
        unsafe {
            if g_type_check_instance_is_a(stream.as_ptr().cast(), arv::arv_gv_stream_get_type()) != 0 {
                let resend = match options.resend {
                    true => arv::ARV_GV_STREAM_PACKET_RESEND_ALWAYS,
                    false => arv::ARV_GV_STREAM_PACKET_RESEND_NEVER,
                };
                let size = c_int::try_from(options.socket_buffer_bytes).unwrap_or(c_int::MAX);
                g_object_set(
                    stream.as_ptr().cast(),
                    c"packet-resend".as_ptr(),
                    resend,
                    c"socket-buffer".as_ptr(),
                    arv::ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                    c"socket-buffer-size".as_ptr(),
                    size,
                    ptr::null::<std::ffi::c_char>(),
                );
            }
        }
        Ok(Self(stream))
    }

    /// Pushes a buffer to be filled.
    pub fn push(&self, buffer: Buffer) {
        // SAFETY: both are valid; the buffer's reference goes to the stream.
        unsafe { arv::arv_stream_push_buffer(self.0.as_ptr(), buffer.into_raw()) };
    }

    /// The next finished buffer, complete or not; waits at most `timeout`.
    pub fn pop(&self, timeout: Duration) -> Option<Buffer> {
        let timeout_us = u64::try_from(timeout.as_micros()).unwrap_or(u64::MAX);
        // SAFETY: the stream is valid; the reference of a buffer that is returned is the caller's.
        unsafe {
            let popped = match timeout_us {
                0 => arv::arv_stream_try_pop_buffer(self.0.as_ptr()),
                _ => arv::arv_stream_timeout_pop_buffer(self.0.as_ptr(), timeout_us),
            };
            NonNull::new(popped).map(|buffer| Buffer::owned(buffer))
        }
    }

    /// A counter of the library by name; 0 if this kind of stream does not have it.
    pub fn count(&self, name: &CStr) -> u64 {
        // SAFETY: the stream is valid; names are compared with those that exist, and all counts requested are `uint64`.
        unsafe {
            let known = |id: c_uint| CStr::from_ptr(arv::arv_stream_get_info_name(self.0.as_ptr(), id)) == name;
            match (0..arv::arv_stream_get_n_infos(self.0.as_ptr())).any(known) {
                true => arv::arv_stream_get_info_uint64_by_name(self.0.as_ptr(), name.as_ptr()),
                false => 0,
            }
        }
    }
}

impl Drop for Stream {
    /// Ends its thread; buffers inside are freed with it.
    fn drop(&mut self) {
        // SAFETY: the reference is ours and given back once.
        unsafe { g_object_unref(self.0.as_ptr().cast()) };
    }
}
