//! The layers: each later one wins, and every value remembers where it came from.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use station::StationDevices;

use crate::config::settings::{SETTINGS, Setting, config, station};
use crate::config::value::Value;
use crate::config::{Config, ConfigError};
use crate::drivers::{NoStation, station_devices};

/// What the environment's names begin with; the rest is the key in capitals, dots written as two underscores:
/// `SHEAF_STATION__TWIN__SEED`.
const PREFIX: &str = "SHEAF_";

/// Names that begin alike and are not settings.
const NOT_SETTINGS: &[&str] = &["SHEAF_CONFIG", "SHEAF_LOG"];

/// What names begin with that only the tests read.
const TEST_PREFIX: &str = "SHEAF_TEST_";

/// The file looked for in the data folder if none is named.
const FILE_NAME: &str = "sheaf.toml";

/// Where a value came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// Nobody said anything.
    Default,
    /// A file.
    File {
        /// Which.
        path: PathBuf,
        /// Which line.
        line: usize,
    },
    /// The environment.
    Environment(String),
    /// The command line.
    Flag(&'static str),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => write!(f, "default"),
            Self::File { path, line } => write!(f, "{}, line {line}", path.display()),
            Self::Environment(name) => write!(f, "environment {name}"),
            Self::Flag(name) => write!(f, "flag {name}"),
        }
    }
}

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
    /// Every setting with value and origin, in the order of [`SETTINGS`].
    pub values: Vec<(&'static Setting, Value, Origin)>,
}

impl fmt::Debug for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.key)
    }
}

/// Values by key.
#[derive(Default)]
struct Layers(BTreeMap<&'static str, (Value, Origin)>);

/// Defaults, file, environment, flags.
///
/// # Errors
/// [`ConfigError`] for the first thing that is wrong, naming place and remedy.
pub fn effective(
    asked: &Asked,
    environment: impl Iterator<Item = (String, String)>,
) -> Result<Effective, ConfigError> {
    let environment: BTreeMap<String, String> =
        environment.filter(|(name, _)| name.starts_with(PREFIX) && !name.starts_with(TEST_PREFIX)).collect();
    let mut above = Layers::default();
    above.add_environment(&environment)?;
    above.add_flags(asked)?;
    let mut layers = Layers::default();
    layers.add_file(asked, &environment, &above)?;
    layers.0.extend(above.0);
    layers.finish()
}

impl Layers {
    fn add_environment(&mut self, environment: &BTreeMap<String, String>) -> Result<(), ConfigError> {
        for (name, text) in environment.iter().filter(|(name, _)| !NOT_SETTINGS.contains(&name.as_str())) {
            let key = name[PREFIX.len()..].to_ascii_lowercase().replace("__", ".");
            self.add_text(&key, text, Origin::Environment(name.clone()))?;
        }
        Ok(())
    }

    fn add_flags(&mut self, asked: &Asked) -> Result<(), ConfigError> {
        for text in &asked.set {
            let (key, value) =
                text.split_once('=').ok_or_else(|| ConfigError::NoEqualSign { text: text.clone() })?;
            self.add_text(key.trim(), value, Origin::Flag("--set"))?;
        }
        if let Some(listen) = &asked.listen {
            self.add_text("listen", listen, Origin::Flag("--listen"))?;
        }
        if let Some(data) = &asked.data {
            self.add_text("data", &data.to_string_lossy(), Origin::Flag("--data"))?;
        }
        Ok(())
    }

    fn add_text(&mut self, key: &str, text: &str, origin: Origin) -> Result<(), ConfigError> {
        refuse_old_kind(key, text, &origin)?;
        let setting = setting(key, &origin)?;
        let value = setting.kind.read_text(text).ok_or_else(|| ConfigError::BadValue {
            key: setting.key.to_owned(),
            found: format!("\"{text}\""),
            origin: origin.clone(),
            expected: setting.kind.expected(),
        })?;
        self.0.insert(setting.key, (value, origin));
        Ok(())
    }

    /// The file named by flag or environment, which must exist, or the one in the data folder, which may.
    fn add_file(
        &mut self,
        asked: &Asked,
        environment: &BTreeMap<String, String>,
        above: &Self,
    ) -> Result<(), ConfigError> {
        let named = asked.config.clone().or_else(|| environment.get("SHEAF_CONFIG").map(PathBuf::from));
        if let Some(path) = named {
            return self.add_toml(&path, &read(&path)?);
        }
        let path = Path::new(&above.value("data").to_string()).join(FILE_NAME);
        if !path.exists() {
            return Ok(());
        }
        self.add_toml(&path, &read(&path)?)?;
        match self.0.get("data") {
            Some((_, origin)) => Err(ConfigError::DataInside { origin: origin.clone() }),
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
            let origin = at(name.span());
            if let DeValue::Table(inner) = value.get_ref()
                && SETTINGS.iter().any(|setting| setting.key.starts_with(&format!("{key}.")))
            {
                self.add_table(&format!("{key}."), inner, at)?;
                continue;
            }
            let toml = value.get_ref();
            refuse_old_kind(&key, toml.as_str().unwrap_or_default(), &origin)?;
            let setting = setting(&key, &origin)?;
            let read = setting.kind.read_toml(toml).ok_or_else(|| ConfigError::BadValue {
                key: setting.key.to_owned(),
                found: toml.as_str().map_or_else(|| toml.type_str().to_owned(), |text| format!("\"{text}\"")),
                origin: origin.clone(),
                expected: setting.kind.expected(),
            })?;
            self.0.insert(setting.key, (read, origin));
        }
        Ok(())
    }

    fn value(&self, key: &str) -> Value {
        let default = || SETTINGS.iter().find(|setting| setting.key == key).map(|setting| (setting.default)());
        let said = self.0.get(key).map(|(value, _)| value.clone());
        said.or_else(default).expect("every key that is read stands in the table; a test holds this")
    }

    /// The station that the kinds of devices make.
    fn station(&self) -> Result<StationDevices, ConfigError> {
        let settings = station(&|key| self.value(key));
        station_devices(&settings).map_err(|why| {
            let device = match why {
                NoStation::NoSuchKind { device, .. }
                | NoStation::Missing { device, .. }
                | NoStation::Apart { device, .. } => device,
            };
            let key = format!("station.{device}.kind");
            let found = self.value(&key).to_string();
            ConfigError::no_station(why, &key, &found, self.origin(&key))
        })
    }

    fn origin(&self, key: &str) -> Origin {
        self.0.get(key).map_or(Origin::Default, |(_, origin)| origin.clone())
    }

    fn finish(self) -> Result<Effective, ConfigError> {
        let config = config(&|key| self.value(key), self.station()?);
        let values =
            SETTINGS.iter().map(|setting| (setting, self.value(setting.key), self.origin(setting.key))).collect();
        Ok(Effective { config, values })
    }
}

fn read(path: &Path) -> Result<String, ConfigError> {
    std::fs::read_to_string(path).map_err(|cause| ConfigError::Unreadable { path: path.to_owned(), cause })
}

fn setting(key: &str, origin: &Origin) -> Result<&'static Setting, ConfigError> {
    SETTINGS.iter().find(|setting| setting.key == key).ok_or_else(|| ConfigError::UnknownKey {
        key: key.to_owned(),
        origin: origin.clone(),
        hint: hint(key),
    })
}

/// One kind for the whole station was all there was once.
fn refuse_old_kind(key: &str, kind: &str, origin: &Origin) -> Result<(), ConfigError> {
    if key != "station.kind" {
        return Ok(());
    }
    // A GRBL station had a simulated camera.
    let camera = if kind == "replay" { "replay" } else { "twin" };
    let other = if kind == "grbl" { "grbl" } else { camera };
    let kinds = [("camera", camera), ("stage", other), ("laser", other)];
    let lines = kinds.map(|(device, kind)| match origin {
        Origin::Flag(_) => format!("--set station.{device}.kind={kind}"),
        Origin::Environment(_) => format!("SHEAF_STATION__{}__KIND={kind}", device.to_ascii_uppercase()),
        _ => format!("[station.{device}]\nkind = \"{kind}\""),
    });
    Err(ConfigError::OldKind { origin: origin.clone(), lines: lines.join("\n") })
}

/// A setting whose last part is the same, or where to look.
fn hint(key: &str) -> String {
    let last = key.rsplit('.').next().unwrap_or(key);
    let alike = SETTINGS.iter().find(|setting| setting.key.rsplit('.').next() == Some(last));
    match alike {
        Some(setting) => format!("did you mean \"{}\"?", setting.key),
        None => "`sheaf config` prints all settings".to_owned(),
    }
}

/// Line of the first byte of `span`, from 1.
fn line(text: &str, span: Option<Range<usize>>) -> usize {
    let end = span.map_or(0, |span| span.start.min(text.len()));
    text.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count() + 1
}

#[cfg(test)]
#[path = "layers_tests.rs"]
mod tests;
