//! Permitted imports and layout of the workspace's sources.

#![allow(clippy::unwrap_used)]

mod circles;
mod folders;
mod wings;
