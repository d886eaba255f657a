//! Values against known truth. What these tests do not show: how real centrelines err at edges and on shiny metal.

mod coverage;
mod doubts;
mod offset;
mod rig_a;
mod shading;
pub(crate) mod station;
mod surfaces;
mod synthetic;
mod turntable;
