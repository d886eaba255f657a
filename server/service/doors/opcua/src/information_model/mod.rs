//! The nodes that clients see: the types of OPC 40100-1, and one vision system.

pub mod ids;
pub mod instance;
pub mod nodeset;
pub mod structures;
