//! A door that publishes events to an MQTT 5 broker.
//!
//! All topics begin with `{prefix}/{station}/`:
//!
//! | topic | content | retained |
//! |---|---|---|
//! | `result` | `inspection.finished` with the inspection, `sheaf-event/1` | no |
//! | `event` | every other chosen event, `sheaf-event/1` | no |
//! | `state` | whether the service is online, and the state of the station, `sheaf-state/1` | yes |
//! | `health` | faults waiting for acknowledgement, `sheaf-health/1` | yes |
//!
//! With `commands`, the door also listens on `cmd` (`commands`): a command is a JSON object, and its answer,
//! `sheaf-answer/1`, goes to the response topic of the command.
//!
//! With `sparkplug_group`, the station is an edge node of Sparkplug B (`sparkplug`) instead of publishing `state` and
//! `health`; results are published in both ways.
//!
//! Everything else is published with QoS 1. An event is delivered once the broker has acknowledged exactly its message: what
//! the client library keeps for a later connection does not count (`connection/link.rs`). The same event may arrive twice, with
//! the same `id`; `seq` gives the order. `state` is also the last will: the broker publishes `online: false` when the
//! connection breaks.

mod commands;
mod connection;
mod door;
mod params;
mod settings;
mod sparkplug;
mod station;

#[cfg(test)]
mod tests;

pub use door::open;
pub use settings::Settings;
