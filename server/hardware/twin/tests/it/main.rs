//! The simulated station against its ground truth, other renderers' conventions and the devices' contract.

#![allow(clippy::unwrap_used)]

mod colour;
mod conventions;
mod live;
mod mesh;
mod recording;
mod stations;
mod targets;
