//! The door against mosquitto, read by its own client, and against brokers that follow a script.

#![allow(clippy::unwrap_used)]

mod bench;
mod broker;
mod broker_failures;
mod commands;
mod deliveries;
mod presence;
mod refusals;
mod scripted;
mod scripted_broker;
mod settings;
mod sparkplug;
mod subscriber;
mod tls;
