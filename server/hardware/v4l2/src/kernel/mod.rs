//! The kernel's interface, and the only unsafe code of this crate: each request stands beside the contract that makes it
//! sound.
//!
//! Contracts that hold for all of them (Linux, `Documentation/userspace-api/media/v4l`): a request reads and writes the one
//! structure that its number names, which lives longer than the call and has the size that is part of the number; a buffer
//! between DQBUF and QBUF is written to by nobody; a mapping is valid until it is unmapped, also after the camera was
//! unplugged.
//!
//! The structures are written after `linux/videodev2.h`, which never changes what it once declared; a test compiles that
//! header and compares sizes, places and numbers.
#![allow(unsafe_code)]

mod device;
mod mapping;
mod requests;
mod structures;

pub use device::KernelDevice;
