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
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{}, line {line}: {what}", path.display())]
    NotToml {
        /// Which file.
        path: PathBuf,
        /// Which line.
        line: usize,
        /// What the parser says.
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
        /// Where.
        origin: Origin,
        /// The allowed values.
        expected: String,
    },
    /// A value that a board of this kind cannot have, or that it lacks.
    #[error("{key} cannot be {found} ({origin}): target.kind is {kind}")]
    BadTarget {
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// Where.
        origin: Origin,
        /// Kind of the board.
        kind: &'static str,
        /// Why, with what is possible.
        why: Box<TargetError>,
    },
    /// An entry of a list of tables that cannot be read.
    #[error("[[{key}]] number {number} ({origin}): {why}")]
    BadEntry {
        /// The list.
        key: String,
        /// Position in it, from 1.
        number: usize,
        /// Where the list is.
        origin: Origin,
        /// What is wrong.
        why: String,
    },
    /// A door that cannot be opened.
    #[error("[[{key}]] number {number} ({origin}): {bad}")]
    BadDoor {
        /// The list that it is in.
        key: &'static str,
        /// Its position in the list, from 1.
        number: usize,
        /// Where the list is.
        origin: Origin,
        /// What is wrong with it.
        bad: BadSetting,
    },
    /// `--set` without `=`.
    #[error("--set {text} has no \"=\"")]
    NoEqualSign {
        /// The value.
        text: String,
    },
    /// A driver without what it needs.
    #[error("{key} is {kind} ({origin}), and station.{kind}.{name} is empty")]
    Missing {
        /// The key that chose it.
        key: String,
        /// The driver's kind.
        kind: &'static str,
        /// Its origin.
        origin: Origin,
        /// The setting that it needs.
        name: &'static str,
        /// What that is.
        expected: String,
    },
    /// A device that another driver must make.
    #[error("{key} is {found} ({origin}), but the {kind} devices belong together")]
    Apart {
        /// The device's key.
        key: String,
        /// Who is to make it.
        found: String,
        /// Its origin.
        origin: Origin,
        /// Who must make both.
        kind: &'static str,
    },
    /// The key that was split in three.
    #[error("the setting \"station.kind\" no longer exists ({origin}), each device has its own kind")]
    OldKind {
        /// Its origin.
        origin: Origin,
        /// What to write there instead.
        lines: String,
    },
    /// A kind of projector that stations do not scan with.
    #[error("projector.kind is {found} ({origin}), but a station scans with a laser behind a grating")]
    OtherProjector {
        /// The value.
        found: String,
        /// Its origin.
        origin: Origin,
    },
    /// The data folder inside its own file.
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
            Self::BadValue { expected, .. } => format!("give {expected}").into(),
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
                "lasers without a grating, and lines that cross, are calibrated and scanned \
                from captures: record the pictures, write the projector's kind in capture.json, then use \
                `sheaf calibrate` and `sheaf scan`; here leave projector.kind out"
                    .into()
            }
            Self::DataInside { .. } => "use --data or SHEAF_DATA".into(),
        })
    }
}

impl ConfigError {
    /// The words for devices that make no station; the setting at fault says `found`.
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

    /// Refuses `projector.kind`, an entry of captures: a station's sessions and scans are those of a grating.
    pub fn refuse_projector_kind(key: &str, kind: &str, origin: &Origin) -> Result<(), Self> {
        match key {
            "projector.kind" => Err(Self::OtherProjector { found: format!("\"{kind}\""), origin: origin.clone() }),
            _ => Ok(()),
        }
    }

    /// Refuses `station.kind`: one kind for the whole station was all there was once.
    pub fn refuse_old_kind(key: &str, kind: &str, origin: &Origin) -> Result<(), Self> {
        if key != "station.kind" {
            return Ok(());
        }
        // A GRBL station had a simulated camera.
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
