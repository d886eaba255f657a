//! Tests of the whole program: commands, files, REST, live stream, Stop, crashes.

#![allow(clippy::unwrap_used)]

mod commands;
mod common;
mod http;
mod readme;
mod rigs;
mod service;
