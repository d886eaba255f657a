//! The catalogue and the artifacts: what a station keeps.
