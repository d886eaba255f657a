//! The nodes that clients see: the types of OPC 40100-1 and of OPC 10000-100, and one vision system with its health.

mod health;
pub mod ids;
pub mod instance;
pub mod nodeset;
pub mod structures;
