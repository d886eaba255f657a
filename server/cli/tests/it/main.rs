//! The program as people and other programs meet it: commands, files, REST, the stream, Stop, crashes.

#![allow(clippy::unwrap_used)]

mod commands;
mod common;
mod http;
mod readme;
mod rigs;
mod service;
