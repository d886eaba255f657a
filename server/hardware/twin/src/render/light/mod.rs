//! Where the light of an order falls: its sheet, and what stands in its way.

pub(crate) mod band;
pub(crate) mod mark;
pub(crate) mod sheet_map;
pub(crate) mod trace;
