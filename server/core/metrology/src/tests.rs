//! Values compared with known truth. Not covered: errors of real centrelines at edges and on shiny metal.

mod coverage;
mod doubts;
mod offset;
mod rig_a;
mod shading;
pub(crate) mod station;
mod surfaces;
mod synthetic;
mod turntable;
