//! The table of doors: which interfaces deliver events to other systems.

use std::sync::Arc;

use app::doors::{BadSetting, Door};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[doors]`: each entry of a list is a door of that kind; without entries nothing is delivered.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
pub struct DoorSettings {
    /// `[[doors.folder]]`: results of inspections as files, orders from files
    pub folder: Vec<folder_door::Settings>,
    /// `[[doors.webhook]]`: signed events posted to a web server
    pub webhook: Vec<webhook_door::Settings>,
    /// `[[doors.mqtt]]`: events published to an MQTT broker
    pub mqtt: Vec<mqtt_door::Settings>,
    /// `[[doors.modbus]]`: results for programmable logic controllers, and triggers from them
    pub modbus: Vec<modbus_door::Settings>,
    /// `[[doors.opcua]]`: an OPC UA server after OPC 40100-1 Machine Vision
    pub opcua: Vec<opcua_door::Settings>,
}

/// A door that cannot be opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BadDoor {
    /// The list that it is in: `doors.webhook`.
    pub key: &'static str,
    /// Its position in the list, from 1.
    pub number: usize,
    /// What is wrong.
    pub bad: BadSetting,
}

impl DoorSettings {
    /// The doors; nothing is connected yet.
    ///
    /// # Errors
    /// A setting cannot be used, or two doors have the same name.
    pub fn doors(self) -> Result<Vec<Arc<dyn Door>>, BadDoor> {
        let mut doors = Vec::new();
        add(&mut doors, "doors.folder", self.folder, folder_door::open)?;
        add(&mut doors, "doors.webhook", self.webhook, webhook_door::open)?;
        add(&mut doors, "doors.mqtt", self.mqtt, mqtt_door::open)?;
        add(&mut doors, "doors.modbus", self.modbus, modbus_door::open)?;
        add(&mut doors, "doors.opcua", self.opcua, opcua_door::open)?;
        Ok(doors)
    }
}

fn add<S>(
    doors: &mut Vec<Arc<dyn Door>>,
    key: &'static str,
    settings: Vec<S>,
    open: impl Fn(S) -> Result<Arc<dyn Door>, BadSetting>,
) -> Result<(), BadDoor> {
    for (number, one) in (1..).zip(settings) {
        let bad = |bad| BadDoor { key, number, bad };
        let door = open(one).map_err(bad)?;
        // It is part of addresses and of the log.
        if !door
            .name()
            .bytes()
            .all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"_-".contains(&byte))
        {
            let why = format!("\"{}\" has other characters than lower-case letters, digits, - and _", door.name());
            return Err(bad(BadSetting { setting: "name", why }));
        }
        if doors.iter().any(|other| other.name() == door.name()) {
            let why = format!("there are two doors named \"{}\"; every door needs a name of its own", door.name());
            return Err(bad(BadSetting { setting: "name", why }));
        }
        doors.push(door);
    }
    Ok(())
}
