//! What a connection may do with the station: register a viewer, and stop it.

use std::time::Instant;

use futures_util::future::BoxFuture;

use crate::wire::hardware::station::StopResultDto;
use app::App;
use app::labels::label;
use app::principal::Principal;
use app::use_cases::stop;

/// The station, as a connection may use it.
pub trait Station: Send + Sync {
    /// Registers that a viewer was connected at that time.
    fn note_viewer(&self, at: Instant);

    /// Stops the station; the stop is in progress when this returns. `actor`: name for the log.
    fn stop(&self, actor: Option<&str>) -> BoxFuture<'static, StopResultDto>;
}

/// A client of the running service.
pub struct Client {
    app: App,
    address: String,
}

impl Client {
    /// A client at `address`.
    pub fn new(app: App, address: String) -> Self {
        Self { app, address }
    }
}

impl Station for Client {
    fn note_viewer(&self, at: Instant) {
        self.app.station.note_viewer(at);
    }

    fn stop(&self, actor: Option<&str>) -> BoxFuture<'static, StopResultDto> {
        let named = actor.filter(|name| label(name, "/actor").is_ok());
        let actor = named.map_or_else(|| format!("stream {}", self.address), |name| name.trim().to_owned());
        let by = Principal::local(&actor, &self.address, None);
        let (stopping, station) = (stop(&self.app, &by), self.app.station.clone());
        Box::pin(async move { StopResultDto::new(stopping.await, station.status().state) })
    }
}
