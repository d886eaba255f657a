//! The layers: defaults, file, environment, flags; later layers override earlier ones. The `config` crate merges them and
//! keeps an [`Origin`] with each value.

use std::collections::BTreeMap;
use std::path::PathBuf;

use capture::ProjectorError;
use config::{Map, Source, Value, ValueKind};

use crate::config::layer::{Layer, is_service_variable};
use crate::config::origin::Origin;
use crate::config::setting::{Setting, all};
use crate::config::settings::Settings;
use crate::config::{Config, ConfigError};
use crate::doors::BadDoor;
use crate::drivers::station_devices;

/// Configuration flags of the command line.
#[derive(Debug, Clone, Default)]
pub struct Flags {
    /// `--listen`.
    pub listen: Option<String>,
    /// `--data`.
    pub data: Option<PathBuf>,
    /// `--config`.
    pub config: Option<PathBuf>,
    /// Every `--set KEY=VALUE`.
    pub set: Vec<String>,
}

/// The effective configuration and the origin of each value.
#[derive(Debug, Clone)]
pub struct Effective {
    /// The configuration.
    pub config: Config,
    /// Every setting with value and origin, by key.
    pub values: Vec<(Setting, ValueKind, Origin)>,
}

/// Defaults, file, environment, flags.
///
/// # Errors
/// [`ConfigError`] for the first error, with its place and remedy.
pub fn effective(
    flags: &Flags,
    environment: impl Iterator<Item = (String, String)>,
) -> Result<Effective, ConfigError> {
    let environment: BTreeMap<String, String> =
        environment.filter(|(name, _)| is_service_variable(name)).collect();
    let settings = all();
    let mut above = Layer::new(&settings);
    above.add_environment(&environment)?;
    above.add_flags(flags)?;
    let mut file = Layer::new(&settings);
    file.add_file(flags, &environment, &above)?;
    let merged = merge([file.values, above.values]);
    let value = |key: &str| value_at(&merged.cache, key).cloned().unwrap_or_default();
    let read = merged.clone().try_deserialize::<Settings>().map_err(|error| {
        if let Some((key, number, why)) = entry_of(&error.to_string()) {
            let origin = Origin::of(&value(&key));
            return ConfigError::BadEntry { key, number, origin, why };
        }
        let key = key_of(&error);
        let setting = settings.iter().find(|setting| setting.key == key);
        let expected = setting.map_or_else(|| error.to_string(), Setting::expected);
        let (found, origin) = (format!("\"{}\"", value(&key)), Origin::of(&value(&key)));
        ConfigError::BadValue { key, found, origin, expected }
    })?;
    check_projector(&read, &value)?;
    let station = station_devices(&read.station()).map_err(|why| {
        let chosen = value(&why.key());
        ConfigError::no_station(why, &chosen.to_string(), Origin::of(&chosen))
    })?;
    let board = read.target.board();
    board.check().map_err(|error| {
        let key = format!("target.{}", error.entry());
        let found = value(&key);
        ConfigError::BadTarget {
            found: format!("\"{found}\""),
            origin: Origin::of(&found),
            kind: board.kind(),
            why: Box::new(error),
            key,
        }
    })?;
    read.doors.clone().doors().map_err(|BadDoor { key, number, bad }| {
        let origin = Origin::of(&value(key));
        ConfigError::BadDoor { key, number, origin, bad }
    })?;
    let values = settings.into_iter().map(|setting| {
        let value = value(&setting.key);
        let origin = Origin::of(&value);
        (setting, value.kind, origin)
    });
    Ok(Effective { values: values.collect(), config: read.with(station) })
}

/// Refuses a projector whose values do not fit its kind.
fn check_projector(read: &Settings, value: &dyn Fn(&str) -> Value) -> Result<(), ConfigError> {
    let projector = read.projector.projector();
    let lines = value("projector.lines");
    let error = match projector.check() {
        Err(error) => error,
        Ok(()) if projector.kind() == "grating" && read.projector.lines != 0 => {
            let allowed = "projector.kind = \"planes\" for independent lines, or leave lines out".to_owned();
            ProjectorError { entry: "lines", found: lines.to_string(), allowed }
        }
        Ok(()) => return Ok(()),
    };
    let key = format!("projector.{}", error.entry);
    let (kind, origin) = (projector.kind(), Origin::of(&value(&key)));
    Err(ConfigError::BadProjector { key, found: error.found, origin, kind, expected: error.allowed })
}

/// Key of the value that could not be read.
fn key_of(error: &config::ConfigError) -> String {
    match error {
        config::ConfigError::At { key, .. } | config::ConfigError::Type { key, .. } => {
            key.clone().unwrap_or_default()
        }
        _ => String::new(),
    }
}

/// List, position in it (from 1) and reason, if the error is about an entry of a list of tables. The crate writes
/// ``unknown field `prot` … for key `doors.modbus[0]` `` and `missing configuration field "doors.modbus[0]listen"`.
fn entry_of(error: &str) -> Option<(String, usize, String)> {
    let (before, place) = error.split_at(error.find("doors.")?);
    let (key, rest) = place.split_once('[')?;
    let (idx, field) = rest.split_once(']')?;
    let why = match before.starts_with("missing") {
        true => format!("{} is missing", field.trim_matches(['.', '"', '`'])),
        false => before.trim_end_matches(['`', '"']).trim_end_matches(" for key ").replace('`', "\""),
    };
    Some((key.to_owned(), idx.parse::<usize>().ok()? + 1, why))
}

/// A layer as a source for the `config` crate.
#[derive(Debug, Clone)]
struct Values(Map<String, Value>);

impl Source for Values {
    fn clone_into_box(&self) -> Box<dyn Source + Send + Sync> {
        Box::new(self.clone())
    }

    fn collect(&self) -> Result<Map<String, Value>, config::ConfigError> {
        Ok(self.0.clone())
    }
}

/// Merges the layers over the defaults; later layers override earlier ones.
fn merge(layers: [Map<String, Value>; 2]) -> config::Config {
    // Via JSON: the serializer of the crate drops empty lists.
    let defaults = serde_json::to_value(Settings::default()).and_then(serde_json::from_value);
    let defaults = Values(defaults.expect("the defaults are plain values"));
    let builder = config::Config::builder().add_source(defaults);
    let builder = layers.into_iter().fold(builder, |builder, layer| builder.add_source(Values(layer)));
    builder.build().expect("every layer was read and checked before")
}

/// The value of a key.
fn value_at<'v>(merged: &'v Value, key: &str) -> Option<&'v Value> {
    key.split('.').try_fold(merged, |value, name| match &value.kind {
        ValueKind::Table(fields) => fields.get(name),
        _ => None,
    })
}

#[cfg(test)]
#[path = "layers_tests.rs"]
mod tests;
