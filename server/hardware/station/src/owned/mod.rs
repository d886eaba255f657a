//! The station thread and all that only it may touch: devices, motion, light, the live view.

pub(crate) mod acquisition;
pub(crate) mod command;
pub(crate) mod devices;
pub(crate) mod exposures;
pub(crate) mod faults;
pub(crate) mod light;
pub(crate) mod live_view;
pub(crate) mod machine;
pub(crate) mod mirror;
pub(crate) mod motion;
pub(crate) mod obeying;
pub(crate) mod outlook;
pub(crate) mod owner;
pub(crate) mod reset;
pub(crate) mod run;
pub(crate) mod stamping;
pub(crate) mod stopping;
pub(crate) mod task;
pub(crate) mod thread;
pub(crate) mod track;
