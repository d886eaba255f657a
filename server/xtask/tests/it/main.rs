//! What the workspace's sources may import.

#![allow(clippy::unwrap_used)]

mod circles;
mod wings;
