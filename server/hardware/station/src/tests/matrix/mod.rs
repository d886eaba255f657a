//! The fault × state matrix of every kind of device; the tables are in `server/docs/station.md`.
//!
//! Each module is a table, each module in it a row, and each test in that a column. `document` compares the tests with
//! the tables: a cell without a test states there why the case cannot occur.

mod cell;
mod controllers;
mod conveyor;
mod document;
pub mod genicam;
mod grbl;
mod marlin;
mod twin;
mod zaber;
