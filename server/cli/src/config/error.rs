//! Why a configuration is refused.

use std::path::PathBuf;

use crate::config::layers::Origin;

/// Why a configuration is refused: what, where it was said, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration file {}; name a readable file with --config", path.display())]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{}, line {line}: {what}; correct the file (TOML)", path.display())]
    NotToml {
        /// Which file.
        path: PathBuf,
        /// Which line.
        line: usize,
        /// What the parser says.
        what: String,
    },
    /// No setting of that name.
    #[error("there is no setting \"{key}\" ({origin}); {hint}")]
    UnknownKey {
        /// The key.
        key: String,
        /// Where it was said.
        origin: Origin,
        /// What may have been meant.
        hint: String,
    },
    /// A value that the setting cannot take.
    #[error("{key} cannot be {found} ({origin}); give {expected}")]
    BadValue {
        /// The key.
        key: &'static str,
        /// What was said.
        found: String,
        /// Where.
        origin: Origin,
        /// What is possible.
        expected: String,
    },
    /// `--set` without `=`.
    #[error("--set {text} has no \"=\"; write --set KEY=VALUE")]
    NoEqualSign {
        /// What was said.
        text: String,
    },
    /// A kind of station without what it is made of.
    #[error("station.kind is {kind} ({origin}), and {key} is empty; set {key} to {expected}")]
    Missing {
        /// The kind.
        kind: &'static str,
        /// Where it was said.
        origin: Origin,
        /// What it needs.
        key: &'static str,
        /// What that is.
        expected: &'static str,
    },
    /// The data folder inside its own file.
    #[error("\"data\" cannot be set in the data folder's own file ({origin}); use --data or SHEAF_DATA")]
    DataInside {
        /// Where it was said.
        origin: Origin,
    },
}
