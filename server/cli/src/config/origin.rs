//! The origin of a value.

use std::fmt;
use std::path::PathBuf;

use config::{Value, ValueKind};
use serde::{Deserialize, Serialize};

/// The origin of a value, in the form of `sheaf config --json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "layer", rename_all = "snake_case")]
pub enum Origin {
    /// The default.
    Default,
    /// A file.
    File {
        /// Path.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
    },
    /// The environment.
    Environment {
        /// The variable.
        name: String,
    },
    /// The command line.
    Flag {
        /// The flag.
        name: String,
    },
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => write!(f, "default"),
            Self::File { path, line } => write!(f, "{}, line {line}", path.display()),
            Self::Environment { name } => write!(f, "environment {name}"),
            Self::Flag { name } => write!(f, "flag {name}"),
        }
    }
}

impl Origin {
    /// Tags a value with this origin; the `config` crate keeps it as text.
    pub fn tag(&self, kind: ValueKind) -> Value {
        let label = serde_json::to_string(self).expect("an origin is plain values");
        Value::new(Some(&label), kind)
    }

    /// The origin of `value`.
    pub fn of(value: &Value) -> Self {
        value.origin().and_then(|label| serde_json::from_str(label).ok()).unwrap_or(Self::Default)
    }
}
