//! Control charts, run rules and capability of processes.

mod charts;
mod normality;
mod process;
mod rules;
