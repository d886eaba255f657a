//! The kernel's interface, and the only unsafe code of this crate: each request is documented with the contract that
//! makes it sound.
//!
//! Contracts of all requests (Linux, `Documentation/userspace-api/media/v4l`): a request reads and writes only the
//! structure given by its number, which outlives the call and has the size encoded in the number; nothing writes to a
//! buffer between DQBUF and QBUF; a mapping is valid until it is unmapped, also after the camera was unplugged.
//!
//! The structures follow `linux/videodev2.h`, whose declarations never change; a test compiles that header and compares
//! sizes, offsets and numbers.
#![allow(unsafe_code)]

mod device;
mod mapping;
mod requests;
mod structures;

pub use device::KernelDevice;
