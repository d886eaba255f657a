//! Files on disk: durability, temporary files, and a reserve for a full disk.

pub mod bytes;
pub mod disk;
pub mod reserve;
pub mod workbench;
