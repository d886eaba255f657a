//! Bytes on a disk: how they become durable, where they are made, and room for when there is none.

pub mod bytes;
pub mod disk;
pub mod reserve;
pub mod workbench;
