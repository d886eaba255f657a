//! Light of an order: its sheet, and the surfaces it reaches.

pub(crate) mod band;
pub(crate) mod mark;
pub(crate) mod sheet_map;
pub(crate) mod trace;
