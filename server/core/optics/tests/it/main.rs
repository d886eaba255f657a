//! Stages with deviations, by the public interface.

#![allow(clippy::unwrap_used)]

mod scene;
mod straightness;
mod tilt;
