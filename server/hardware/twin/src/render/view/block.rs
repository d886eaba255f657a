//! A segment of an image row, evaluated in plain loops over arrays, which the compiler vectorises.

use crate::render::view::lit_pixels::WORD_PX;

/// One number per pixel of a word of a row.
pub(crate) type Block = [f64; WORD_PX];

/// A block of NaN: no comparison with it holds.
pub(crate) const NOTHING: Block = [f64::NAN; WORD_PX];
