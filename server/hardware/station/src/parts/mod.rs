//! Per-device state of the station thread: motion, light, frames, exposures, faults.
pub(crate) mod acquisition;
pub(crate) mod devices;
pub(crate) mod exposures;
pub(crate) mod faults;
pub(crate) mod light;
pub(crate) mod machine;
pub(crate) mod motion;
pub(crate) mod tap;
pub(crate) mod track;
