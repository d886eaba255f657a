//! One layer: the values of the environment, the command line or a file, each checked against its setting.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use config::{Map, Value, ValueKind};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::config::origin::Origin;
use crate::config::setting::Setting;
use crate::config::settings::Settings;
use crate::config::{ConfigError, Flags};

/// Prefix of environment variables; the rest is the key in capitals with two underscores for each dot:
/// `SHEAF_STATION__TWIN__SEED`.
const PREFIX: &str = "SHEAF_";

/// Variables with this prefix that are not settings.
const NOT_SETTINGS: &[&str] = &["SHEAF_CONFIG", "SHEAF_LOG"];

/// Prefix of variables for tests.
const TEST_PREFIX: &str = "SHEAF_TEST_";

/// Whether an environment variable is meant for the service.
pub fn is_service_variable(name: &str) -> bool {
    name.starts_with(PREFIX) && !name.starts_with(TEST_PREFIX)
}

/// Configuration file in the data folder, read if no file is given.
pub const FILE_NAME: &str = "sheaf.toml";

/// The values of one layer, by key.
pub struct Layer<'a> {
    settings: &'a [Setting],
    /// The values, each with its origin.
    pub values: Map<String, Value>,
}

impl<'a> Layer<'a> {
    /// An empty layer.
    pub fn new(settings: &'a [Setting]) -> Self {
        Self { settings, values: Map::new() }
    }

    /// Adds the settings of the environment.
    pub fn add_environment(&mut self, environment: &BTreeMap<String, String>) -> Result<(), ConfigError> {
        for (name, text) in environment.iter().filter(|(name, _)| !NOT_SETTINGS.contains(&name.as_str())) {
            let key = name[PREFIX.len()..].to_ascii_lowercase().replace("__", ".");
            self.add_text(&key, text, Origin::Environment { name: name.clone() })?;
        }
        Ok(())
    }

    /// Adds the settings of the command line.
    pub fn add_flags(&mut self, flags: &Flags) -> Result<(), ConfigError> {
        let flag = |name: &str| Origin::Flag { name: name.to_owned() };
        for text in &flags.set {
            let (key, value) =
                text.split_once('=').ok_or_else(|| ConfigError::NoEqualSign { text: text.clone() })?;
            self.add_text(key.trim(), value, flag("--set"))?;
        }
        if let Some(listen) = &flags.listen {
            self.add_text("listen", listen, flag("--listen"))?;
        }
        if let Some(data) = &flags.data {
            self.add_text("data", &data.to_string_lossy(), flag("--data"))?;
        }
        Ok(())
    }

    fn add_text(&mut self, key: &str, text: &str, origin: Origin) -> Result<(), ConfigError> {
        ConfigError::refuse_old_kind(key, text, &origin)?;
        ConfigError::refuse_projector_kind(key, text, &origin)?;
        let setting = self.setting(key, &origin)?;
        let value = setting.read(text).ok_or_else(|| bad_value(setting, &format!("\"{text}\""), &origin))?;
        self.put(key, value, &origin);
        Ok(())
    }

    /// Adds the settings of the configuration file: the file given by flag or environment, which must exist, or else the
    /// one in the data folder, if it exists.
    pub fn add_file(
        &mut self,
        flags: &Flags,
        environment: &BTreeMap<String, String>,
        above: &Self,
    ) -> Result<(), ConfigError> {
        let named = flags.config.clone().or_else(|| environment.get("SHEAF_CONFIG").map(PathBuf::from));
        if let Some(path) = named {
            return self.add_toml(&path, &read(&path)?);
        }
        let configured = above.values.get("data").map(|value| PathBuf::from(value.to_string()));
        let path = configured.unwrap_or_else(|| Settings::default().data).join(FILE_NAME);
        if !path.exists() {
            return Ok(());
        }
        self.add_toml(&path, &read(&path)?)?;
        match self.values.get("data") {
            Some(data) => Err(ConfigError::DataInside { origin: Origin::of(data) }),
            None => Ok(()),
        }
    }

    fn add_toml(&mut self, path: &Path, text: &str) -> Result<(), ConfigError> {
        let table = DeTable::parse(text).map_err(|error| ConfigError::NotToml {
            path: path.to_owned(),
            line: line(text, error.span()),
            what: error.message().to_owned(),
        })?;
        let at = |span: Range<usize>| Origin::File { path: path.to_owned(), line: line(text, Some(span)) };
        self.add_table("", table.get_ref(), &at)
    }

    fn add_table(
        &mut self,
        prefix: &str,
        table: &DeTable<'_>,
        at: &dyn Fn(Range<usize>) -> Origin,
    ) -> Result<(), ConfigError> {
        for (name, value) in table {
            let key = format!("{prefix}{}", name.get_ref());
            let inside = format!("{key}.");
            match value.get_ref() {
                DeValue::Table(inner) if self.settings.iter().any(|setting| setting.key.starts_with(&inside)) => {
                    self.add_table(&inside, inner, at)?;
                }
                toml => {
                    let origin = at(name.span());
                    ConfigError::refuse_old_kind(&key, toml.as_str().unwrap_or_default(), &origin)?;
                    ConfigError::refuse_projector_kind(&key, toml.as_str().unwrap_or_default(), &origin)?;
                    let setting = self.setting(&key, &origin)?;
                    let found = || toml.as_str().map_or(toml.type_str().to_owned(), |text| format!("\"{text}\""));
                    let value = value_kind(toml, at).filter(|value| setting.admits(value));
                    let value = value.ok_or_else(|| bad_value(setting, &found(), &origin))?;
                    self.put(&key, value, &origin);
                }
            }
        }
        Ok(())
    }

    fn put(&mut self, key: &str, value: ValueKind, origin: &Origin) {
        self.values.insert(key.to_owned(), origin.tag(value));
    }

    fn setting(&self, key: &str, origin: &Origin) -> Result<&Setting, ConfigError> {
        self.settings.iter().find(|setting| setting.key == key).ok_or_else(|| ConfigError::UnknownKey {
            key: key.to_owned(),
            origin: origin.clone(),
            hint: hint(key, self.settings),
        })
    }
}

fn read(path: &Path) -> Result<String, ConfigError> {
    std::fs::read_to_string(path).map_err(|cause| ConfigError::Unreadable { path: path.to_owned(), cause })
}

/// Suggests a setting whose last part is the same, or `sheaf config`.
fn hint(key: &str, settings: &[Setting]) -> String {
    let last = key.rsplit('.').next();
    match settings.iter().find(|setting| setting.key.rsplit('.').next() == last) {
        Some(setting) => format!("did you mean \"{}\"?", setting.key),
        None => "`sheaf config` prints all settings".to_owned(),
    }
}

fn bad_value(setting: &Setting, found: &str, origin: &Origin) -> ConfigError {
    let (key, expected) = (setting.key.clone(), setting.expected());
    ConfigError::BadValue { key, found: found.to_owned(), origin: origin.clone(), expected }
}

/// Converts a TOML value, including tables in lists; `None` for dates and out-of-range numbers.
fn value_kind(toml: &DeValue<'_>, at: &dyn Fn(Range<usize>) -> Origin) -> Option<ValueKind> {
    let value = |one: &Spanned<DeValue<'_>>| Some(at(one.span()).tag(value_kind(one.get_ref(), at)?));
    Some(match toml {
        DeValue::String(text) => ValueKind::String(text.to_string()),
        DeValue::Integer(whole) => ValueKind::I64(i64::from_str_radix(whole.as_str(), whole.radix()).ok()?),
        DeValue::Float(number) => ValueKind::Float(number.as_str().parse().ok()?),
        DeValue::Boolean(on) => ValueKind::Boolean(*on),
        DeValue::Array(items) => ValueKind::Array(items.iter().map(value).collect::<Option<_>>()?),
        DeValue::Table(fields) => {
            let field = |(name, one): (&Spanned<_>, _)| {
                let name: &Cow<'_, str> = name.get_ref();
                Some((name.to_string(), value(one)?))
            };
            ValueKind::Table(fields.iter().map(field).collect::<Option<_>>()?)
        }
        DeValue::Datetime(_) => return None,
    })
}

/// Line of the first byte of `span`, from 1.
fn line(text: &str, span: Option<Range<usize>>) -> usize {
    let end = span.map_or(0, |span| span.start.min(text.len()));
    text.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count() + 1
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde::Deserialize;

    use super::*;
    use crate::config::setting::of;

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    struct Doors {
        doors: Vec<Door>,
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    struct Door {
        port: u16,
    }

    #[test]
    fn a_list_of_tables_is_read_and_each_value_has_its_line() {
        let settings = of::<Doors>();
        let mut layer = Layer::new(&settings);
        layer.add_toml(Path::new("sheaf.toml"), "[[doors]]\nport = 1\n[[doors]]\nport = 2\n").unwrap();
        let ValueKind::Array(doors) = &layer.values["doors"].kind else { panic!("{:?}", layer.values) };
        let ValueKind::Table(second) = &doors[1].kind else { panic!("{doors:?}") };
        assert_eq!(Origin::of(&second["port"]).to_string(), "sheaf.toml, line 4");
        let read: Doors = Value::new(None, ValueKind::Table(layer.values)).try_deserialize().unwrap();
        assert_eq!(read, Doors { doors: vec![Door { port: 1 }, Door { port: 2 }] });
    }
}
