//! A door that posts signed events to a web server, as Standard Webhooks 1.0 defines it.
//!
//! Each event is a POST with the message as JSON, signed with a shared secret (`secret`). Where it goes is decided in
//! two steps: the URL is checked when the door is opened (`url`), and the addresses of its host are checked at every
//! attempt (`resolver`), so that a name cannot lead to machines of the own network that were not listed. What the
//! answer means is a table of status classes (`answer`); why a request failed is said in `failure`. When it is tried again is decided in
//! `app`.

mod address;
mod answer;
mod authorities;
mod door;
mod failure;
mod params;
mod post;
mod resolver;
mod secret;
mod settings;
#[cfg(test)]
mod tests;
mod url;

pub use door::open;
pub use settings::Settings;
