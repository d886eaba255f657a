//! Rims of planes, from the ends of laser lines.

pub(crate) mod contour;
pub(crate) mod crossings;
pub(crate) mod rim;
