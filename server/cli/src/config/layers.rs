//! The layers: defaults, a file, the environment, flags. Each later one wins, and every value knows where it came from:
//! the `config` crate merges them and carries an [`Origin`] with each value.

use std::collections::BTreeMap;
use std::path::PathBuf;

use config::{Map, Source, Value, ValueKind};

use crate::config::layer::{Layer, is_ours};
use crate::config::origin::Origin;
use crate::config::setting::{Setting, all};
use crate::config::settings::Settings;
use crate::config::{Config, ConfigError};
use crate::doors::BadDoor;
use crate::drivers::station_devices;

/// What the command line said.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// `--listen`.
    pub listen: Option<String>,
    /// `--data`.
    pub data: Option<PathBuf>,
    /// `--config`.
    pub config: Option<PathBuf>,
    /// Every `--set KEY=VALUE`.
    pub set: Vec<String>,
}

/// The configuration in force and where each value came from.
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
/// [`ConfigError`] for the first thing that is wrong, naming place and remedy.
pub fn effective(
    asked: &Asked,
    environment: impl Iterator<Item = (String, String)>,
) -> Result<Effective, ConfigError> {
    let environment: BTreeMap<String, String> = environment.filter(|(name, _)| is_ours(name)).collect();
    let settings = all();
    let mut above = Layer::new(&settings);
    above.add_environment(&environment)?;
    above.add_flags(asked)?;
    let mut file = Layer::new(&settings);
    file.add_file(asked, &environment, &above)?;
    let merged = merge([file.values, above.values]);
    let value = |key: &str| look(&merged.cache, key).cloned().unwrap_or_default();
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
    let station = station_devices(&read.station).map_err(|why| {
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

/// The key of a value that could not be read.
fn key_of(error: &config::ConfigError) -> String {
    match error {
        config::ConfigError::At { key, .. } | config::ConfigError::Type { key, .. } => {
            key.clone().unwrap_or_default()
        }
        _ => String::new(),
    }
}

/// The list, the position in it from 1, and what is wrong, if the error is about an entry of a list of tables:
/// the crate writes ``unknown field `prot` … for key `doors.modbus[0]` `` and `missing configuration field
/// "doors.modbus[0]listen"`.
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

/// A layer as the crate takes it.
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

/// Later layers win; what none of them says is the default.
fn merge(layers: [Map<String, Value>; 2]) -> config::Config {
    // By way of JSON: the crate's own serializer drops empty lists.
    let defaults = serde_json::to_value(Settings::default()).and_then(serde_json::from_value);
    let defaults = Values(defaults.expect("the defaults are plain values"));
    let builder = config::Config::builder().add_source(defaults);
    let builder = layers.into_iter().fold(builder, |builder, layer| builder.add_source(Values(layer)));
    builder.build().expect("every layer was read and checked before")
}

/// The value of that key.
fn look<'v>(merged: &'v Value, key: &str) -> Option<&'v Value> {
    key.split('.').try_fold(merged, |value, name| match &value.kind {
        ValueKind::Table(fields) => fields.get(name),
        _ => None,
    })
}

#[cfg(test)]
#[path = "layers_tests.rs"]
mod tests;
