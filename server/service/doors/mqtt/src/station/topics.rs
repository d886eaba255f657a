//! The topics of a station, and the id of its client.

use app::doors::BadSetting;

/// The topics of a station.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    prefix: String,
    station: String,
}

impl Topics {
    /// `prefix` has one or more levels, `station` one.
    ///
    /// # Errors
    /// A level is empty or contains a character that topics or clients must not contain.
    pub fn new(prefix: &str, station: &str) -> Result<Self, BadSetting> {
        let is_level = |level: &str| {
            !level.is_empty() && !level.contains(['+', '#', '/']) && !level.contains(char::is_control)
        };
        if prefix.starts_with('$') || !prefix.split('/').all(is_level) {
            let why = format!("\"{prefix}\" cannot begin a topic; examples: sheaf, plant/hall3");
            return Err(BadSetting { setting: "prefix", why });
        }
        if !is_level(station) {
            let why = format!("\"{station}\" is no level of a topic: it must not be empty or contain / + #");
            return Err(BadSetting { setting: "station", why });
        }
        Ok(Self { prefix: prefix.to_owned(), station: station.to_owned() })
    }

    /// Topic of an event of this kind.
    pub fn of_event(&self, kind: &str) -> String {
        self.topic(if kind == "inspection.finished" { "result" } else { "event" })
    }

    /// Topic of the state.
    pub fn state(&self) -> String {
        self.topic("state")
    }

    /// Topic of the health.
    pub fn health(&self) -> String {
        self.topic("health")
    }

    /// Topic of commands to this station.
    pub fn commands(&self) -> String {
        self.topic("cmd")
    }

    /// Whether a topic is one of this station.
    pub fn contain(&self, topic: &str) -> bool {
        topic.starts_with(&self.topic(""))
    }

    /// All of them, as a subscriber writes it.
    pub fn all(&self) -> String {
        self.topic("#")
    }

    /// Id of the client, the same after every start, so that the broker knows that the earlier connection is over.
    pub fn client_id(&self) -> String {
        format!("{}-{}", self.prefix, self.station)
    }

    fn topic(&self, last: &str) -> String {
        format!("{}/{}/{last}", self.prefix, self.station)
    }
}
