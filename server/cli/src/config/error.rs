//! Configuration errors.

use std::borrow::Cow;
use std::path::PathBuf;

use app::doors::BadSetting;
use capture::TargetError;
use remedy::Remedy;

use crate::config::origin::Origin;
use crate::drivers::NoStation;

/// A configuration error: the setting, its origin, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration file {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{}, line {line}: {what}", path.display())]
    NotToml {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Message of the parser.
        what: String,
    },
    /// No setting of that name.
    #[error("unknown setting \"{key}\" ({origin})")]
    UnknownKey {
        /// The key.
        key: String,
        /// Its origin.
        origin: Origin,
        /// A suggestion.
        hint: String,
    },
    /// An invalid value.
    #[error("{key} cannot be {found} ({origin})")]
    BadValue {
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// Its origin.
        origin: Origin,
        /// The allowed values.
        expected: String,
    },
    /// A value that is invalid or missing for this kind of board.
    #[error("{key} cannot be {found} ({origin}): target.kind is {kind}")]
    BadTarget {
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// Its origin.
        origin: Origin,
        /// Kind of the board.
        kind: &'static str,
        /// The reason, with the allowed values.
        why: Box<TargetError>,
    },
    /// An invalid entry of a list of tables.
    #[error("[[{key}]] number {number} ({origin}): {why}")]
    BadEntry {
        /// The list.
        key: String,
        /// Position in it, from 1.
        number: usize,
        /// Origin of the list.
        origin: Origin,
        /// The reason.
        why: String,
    },
    /// An invalid setting of a door.
    #[error("[[{key}]] number {number} ({origin}): {bad}")]
    BadDoor {
        /// The list.
        key: &'static str,
        /// Position in it, from 1.
        number: usize,
        /// Origin of the list.
        origin: Origin,
        /// The reason.
        bad: BadSetting,
    },
    /// `--set` without `=`.
    #[error("--set {text} has no \"=\"")]
    NoEqualSign {
        /// The value.
        text: String,
    },
    /// A setting that the chosen driver requires is missing.
    #[error("{key} is {kind} ({origin}), and station.{kind}.{name} is empty")]
    Missing {
        /// The key that chose the driver.
        key: String,
        /// Kind of the driver.
        kind: &'static str,
        /// Its origin.
        origin: Origin,
        /// The missing setting.
        name: &'static str,
        /// Its meaning.
        expected: String,
    },
    /// A device from another driver than the one it must be combined with.
    #[error("{key} is {found} ({origin}), but the {kind} devices belong together")]
    Apart {
        /// The device's key.
        key: String,
        /// The chosen kind.
        found: String,
        /// Its origin.
        origin: Origin,
        /// The kind that both must have.
        kind: &'static str,
    },
    /// `station.kind`, which is not a setting: each device has its own kind.
    #[error("the setting \"station.kind\" does not exist ({origin}): each device has its own kind")]
    OldKind {
        /// Its origin.
        origin: Origin,
        /// The settings to write instead.
        lines: String,
    },
    /// A value that is invalid or missing for this kind of projector.
    #[error("{key} cannot be {found} ({origin}): projector.kind is {kind}")]
    BadProjector {
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// Where.
        origin: Origin,
        /// Kind of the projector.
        kind: &'static str,
        /// The allowed values.
        expected: String,
    },
    /// A kind of projector that a station does not support.
    #[error(
        "projector.kind is {found} ({origin}), but a station searches its images for lines along one direction"
    )]
    OtherProjector {
        /// The value.
        found: String,
        /// Its origin.
        origin: Origin,
    },
    /// `data` in the configuration file of the data folder.
    #[error("\"data\" cannot be set in the data folder's own file ({origin})")]
    DataInside {
        /// Its origin.
        origin: Origin,
    },
}

impl Remedy for ConfigError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::Unreadable { .. } => "give a readable file with --config".into(),
            Self::NotToml { .. } => "correct the file (TOML)".into(),
            Self::UnknownKey { hint, .. } => hint.into(),
            Self::BadValue { expected, .. } | Self::BadProjector { expected, .. } => {
                format!("give {expected}").into()
            }
            Self::BadTarget { why, .. } => return why.remedy(),
            Self::BadEntry { .. } | Self::BadDoor { .. } => {
                "correct the entry; server/docs/service/doors.md describes the settings of doors".into()
            }
            Self::NoEqualSign { .. } => "write --set KEY=VALUE".into(),
            Self::Missing { kind, name, expected, .. } => {
                format!("set station.{kind}.{name} to {expected}").into()
            }
            Self::Apart { key, kind, found, .. } => {
                format!("set {key} to {kind}, or the other one to {found}").into()
            }
            Self::OldKind { lines, .. } => format!("write\n{lines}").into(),
            Self::OtherProjector { .. } => {
                "lines that cross are calibrated and scanned from captures: record the images, write the \
                projector's kind in capture.json, then use `sheaf calibrate` and `sheaf scan`; here give grating \
                or planes"
                    .into()
            }
            Self::DataInside { .. } => "use --data or SHEAF_DATA".into(),
        })
    }
}

impl ConfigError {
    /// The error for devices that cannot form a station; `found` is the value of the setting at fault.
    pub fn no_station(why: NoStation, found: &str, origin: Origin) -> Self {
        let key = why.key();
        match why {
            NoStation::NoSuchKind { known, .. } => {
                let expected = format!("one of {}", known.join(", "));
                Self::BadValue { key, found: format!("\"{found}\""), origin, expected }
            }
            NoStation::Missing { kind, setting, found, .. } => {
                let here = if found.is_empty() { String::new() } else { format!(" (here: {})", found.join(", ")) };
                let expected = format!("{}{here}", setting.expected);
                Self::Missing { key, kind, origin, name: setting.name, expected }
            }
            NoStation::Apart { kind, .. } => Self::Apart { key, found: found.to_owned(), origin, kind },
        }
    }

    /// Refuses lines that cross, which exist only in captures.
    pub fn refuse_projector_kind(key: &str, kind: &str, origin: &Origin) -> Result<(), Self> {
        match key {
            "projector.kind" if kind == "cross" => {
                Err(Self::OtherProjector { found: format!("\"{kind}\""), origin: origin.clone() })
            }
            _ => Ok(()),
        }
    }

    /// Refuses `station.kind` and lists the kinds of the devices to write instead.
    pub fn refuse_old_kind(key: &str, kind: &str, origin: &Origin) -> Result<(), Self> {
        if key != "station.kind" {
            return Ok(());
        }
        // A GRBL controller is no camera: with it, the camera is simulated.
        let camera = if kind == "replay" { "replay" } else { "twin" };
        let other = if kind == "grbl" { "grbl" } else { camera };
        let lines = [("camera", camera), ("stage", other), ("laser", other)].map(|(device, kind)| match origin {
            Origin::Flag { .. } => format!("--set station.{device}.kind={kind}"),
            Origin::Environment { .. } => format!("SHEAF_STATION__{}__KIND={kind}", device.to_ascii_uppercase()),
            _ => format!("[station.{device}]\nkind = \"{kind}\""),
        });
        Err(Self::OldKind { origin: origin.clone(), lines: lines.join("\n") })
    }
}
