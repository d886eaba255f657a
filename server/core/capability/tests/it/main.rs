//! Tests of the public functions against published examples, closed forms and simulations.

#![allow(clippy::unwrap_used)]

mod examples;
mod gauge_rr;
mod spc;
mod type_1;
