//! A buffer filled by a stream.

use std::ptr::NonNull;
use std::slice;

use aravis_sys as arv;
use gobject_sys::g_object_unref;

/// Status of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BufferStatus {
    /// Complete.
    Complete,
    /// Packets are missing.
    MissingPackets,
    /// It was larger than the buffer.
    WrongSize,
    /// The acquisition ended while it was being filled.
    Ended,
    /// Not an image, or not supported by the library.
    NotSupported,
}

/// A received image.
#[derive(Debug, Clone, Copy)]
pub struct Image<'b> {
    /// Its bytes as sent by the camera.
    pub bytes: &'b [u8],
    /// Pixel format by its number in the Pixel Format Naming Convention.
    pub format: u32,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Padding bytes after each row.
    pub padding_bytes: usize,
}

/// A buffer outside its stream.
pub struct Buffer(NonNull<arv::ArvBuffer>);

// SAFETY: a popped buffer is referred to by nobody else; the library ties it to no thread.
unsafe impl Send for Buffer {}

impl Buffer {
    /// Memory for `size` bytes.
    pub fn allocate(size: usize) -> Option<Self> {
        // SAFETY: any size is allowed; the reference returned is the caller's.
        NonNull::new(unsafe { arv::arv_buffer_new_allocate(size) }).map(Self)
    }

    /// Takes ownership of a reference.
    ///
    /// # Safety
    /// `buffer` is valid, and its reference is owned by the caller.
    pub(super) unsafe fn owned(buffer: NonNull<arv::ArvBuffer>) -> Self {
        Self(buffer)
    }

    /// Releases ownership of the reference.
    pub(super) fn into_raw(self) -> *mut arv::ArvBuffer {
        let pointer = self.0.as_ptr();
        std::mem::forget(self);
        pointer
    }

    /// Status of the frame in it.
    pub fn status(&self) -> BufferStatus {
        // SAFETY: the buffer is valid as long as `self`.
        match unsafe { arv::arv_buffer_get_status(self.0.as_ptr()) } {
            arv::ARV_BUFFER_STATUS_SUCCESS => BufferStatus::Complete,
            arv::ARV_BUFFER_STATUS_TIMEOUT
            | arv::ARV_BUFFER_STATUS_MISSING_PACKETS
            | arv::ARV_BUFFER_STATUS_WRONG_PACKET_ID
            | arv::ARV_BUFFER_STATUS_FILLING => BufferStatus::MissingPackets,
            arv::ARV_BUFFER_STATUS_SIZE_MISMATCH => BufferStatus::WrongSize,
            arv::ARV_BUFFER_STATUS_CLEARED | arv::ARV_BUFFER_STATUS_ABORTED => BufferStatus::Ended,
            _ => BufferStatus::NotSupported,
        }
    }

    /// The camera's number of the frame (GigE Vision: block id).
    pub fn frame_id(&self) -> u64 {
        // SAFETY: the buffer is valid as long as `self`.
        unsafe { arv::arv_buffer_get_frame_id(self.0.as_ptr()) }
    }

    /// The camera's clock, ns; 0 if it has none.
    pub fn device_timestamp_ns(&self) -> u64 {
        // SAFETY: the buffer is valid as long as `self`.
        unsafe { arv::arv_buffer_get_timestamp(self.0.as_ptr()) }
    }

    /// When its first packet was received, by this computer's wall clock, Unix time in ns.
    pub fn received_wall_ns(&self) -> u64 {
        // SAFETY: the buffer is valid as long as `self`.
        unsafe { arv::arv_buffer_get_system_timestamp(self.0.as_ptr()) }
    }

    /// The image of a complete frame; `None` otherwise.
    pub fn image(&self) -> Option<Image<'_>> {
        if self.status() != BufferStatus::Complete {
            return None;
        }
        let (mut x, mut y, mut width, mut height) = (0, 0, 0, 0);
        let (mut x_padding, mut y_padding, mut size) = (0, 0, 0_usize);
        // SAFETY: the buffer is complete and has at least one part, as these functions ask of image payloads (others
        // are refused first); all out-pointers are to initialised integers of the right size. The bytes live as long as
        // the buffer, which `self` owns and nobody fills before it is pushed again, for which `self` is consumed.
        unsafe {
            let buffer = self.0.as_ptr();
            let payload = arv::arv_buffer_get_payload_type(buffer);
            let is_image = payload == arv::ARV_BUFFER_PAYLOAD_TYPE_IMAGE
                || payload == arv::ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA;
            if !is_image || arv::arv_buffer_get_n_parts(buffer) == 0 {
                return None;
            }
            arv::arv_buffer_get_image_region(buffer, &mut x, &mut y, &mut width, &mut height);
            arv::arv_buffer_get_image_padding(buffer, &mut x_padding, &mut y_padding);
            let bytes = arv::arv_buffer_get_image_data(buffer, &mut size);
            if bytes.is_null() {
                return None;
            }
            Some(Image {
                bytes: slice::from_raw_parts(bytes, size),
                format: arv::arv_buffer_get_image_pixel_format(buffer),
                width_px: usize::try_from(width).ok()?,
                height_px: usize::try_from(height).ok()?,
                padding_bytes: usize::try_from(x_padding).ok()?,
            })
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the reference is ours and given back once.
        unsafe { g_object_unref(self.0.as_ptr().cast()) };
    }
}
