//! Permitted imports and layout of the workspace's sources.

#![allow(clippy::unwrap_used)]

mod cycles;
mod folders;
mod wings;
