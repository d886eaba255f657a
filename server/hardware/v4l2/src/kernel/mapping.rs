//! Kernel memory mapped into this process.

use std::fs::File;
use std::io;
use std::num::NonZeroUsize;
use std::os::raw::c_void;
use std::ptr::NonNull;
use std::slice;

use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};

/// A mapped buffer of a device; unmapped on drop.
pub struct Mapping {
    start: NonNull<c_void>,
    length: NonZeroUsize,
}

// SAFETY: the memory belongs to the process and not to a thread.
unsafe impl Send for Mapping {}

impl Mapping {
    /// Maps the buffer at `offset` of the device.
    pub fn new(device: &File, offset: u32, length: u32) -> io::Result<Self> {
        let length = NonZeroUsize::new(length as usize).ok_or(io::ErrorKind::InvalidData)?;
        // SAFETY: a new mapping at an address chosen by the kernel overlaps nothing.
        let start =
            unsafe { mmap(None, length, ProtFlags::PROT_READ, MapFlags::MAP_SHARED, device, i64::from(offset))? };
        Ok(Self { start, length })
    }

    /// The first `used` bytes, at most the whole buffer.
    ///
    /// # Safety
    /// Nothing writes to the buffer meanwhile: it is dequeued.
    pub unsafe fn bytes(&self, used: usize) -> &[u8] {
        // SAFETY: mapped for reading over this length for the lifetime of `self`.
        unsafe { slice::from_raw_parts(self.start.as_ptr().cast(), used.min(self.length.get())) }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: mapped by `new`, and nothing refers to it. It can fail only for invalid addresses.
        let _ = unsafe { munmap(self.start, self.length.get()) };
    }
}
