//! The program as people and other programs meet it: commands, files, REST, the stream, Stop, crashes.

#![allow(clippy::unwrap_used)]

mod accuracy;
mod bad_input;
mod common;
mod contract;
mod crash;
mod doctor;
mod few_lines;
mod genicam;
mod http;
mod lasers;
mod lines_of_photographs;
mod photographs;
mod readme;
mod rig_a;
mod schemas;
mod stop;
mod stream_load;
mod target;
mod turntable;
