//! The fault × state matrix of every kind of device; the tables are in `server/docs/station.md`.
//!
//! A module is a table, a module in it a row, and a test in that a column. `document` compares the tests with the tables: a
//! cell without a test says there why it cannot happen.

mod cell;
mod controllers;
mod document;
pub mod genicam;
mod grbl;
mod marlin;
mod twin;
mod zaber;
