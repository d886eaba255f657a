//! What the workspace's sources may import, and how they are laid out.

#![allow(clippy::unwrap_used)]

mod circles;
mod folders;
mod wings;
