//! Memory of the kernel that is seen by this program.

use std::fs::File;
use std::io;
use std::num::NonZeroUsize;
use std::os::raw::c_void;
use std::ptr::NonNull;
use std::slice;

use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};

/// A buffer of a device, mapped; unmapped when it is dropped.
pub struct Mapping {
    start: NonNull<c_void>,
    length: NonZeroUsize,
}

// SAFETY: the memory belongs to the process and not to a thread.
unsafe impl Send for Mapping {}

impl Mapping {
    /// Maps the buffer that begins at `offset` of the device.
    pub fn new(device: &File, offset: u32, length: u32) -> io::Result<Self> {
        let length = NonZeroUsize::new(length as usize).ok_or(io::ErrorKind::InvalidData)?;
        // SAFETY: a new mapping at a place of the kernel's choice overlaps nothing.
        let start =
            unsafe { mmap(None, length, ProtFlags::PROT_READ, MapFlags::MAP_SHARED, device, i64::from(offset))? };
        Ok(Self { start, length })
    }

    /// The first `used` bytes, or all there are.
    ///
    /// # Safety
    /// Nobody writes to the buffer meanwhile: it is dequeued.
    pub unsafe fn bytes(&self, used: usize) -> &[u8] {
        // SAFETY: mapped for reading over this length for as long as `self` is.
        unsafe { slice::from_raw_parts(self.start.as_ptr().cast(), used.min(self.length.get())) }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: mapped by `new`, and nothing refers to it any more. It can fail only for addresses that are none.
        let _ = unsafe { munmap(self.start, self.length.get()) };
    }
}
