//! Values compared with known truth. Not covered: errors of real centrelines at edges and on shiny metal.

mod cad;
mod coverage;
mod document;
mod findings;
mod offset;
mod plan;
mod rig_a;
mod seams;
mod shading;
mod shaped_scan;
mod speed;
pub(crate) mod station;
mod surfaces;
pub(crate) mod synthetic;
mod turntable;
