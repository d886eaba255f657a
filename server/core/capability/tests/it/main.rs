//! Tests of the public functions against published examples, closed forms and simulations.

#![allow(clippy::unwrap_used)]

mod gauge_rr;
mod type_1;
