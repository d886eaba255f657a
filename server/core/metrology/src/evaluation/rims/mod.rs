//! Rims of planes, from where lines of light end on them.

pub(crate) mod contour;
pub(crate) mod crossings;
pub(crate) mod rim;
