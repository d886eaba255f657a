//! The datums that define the datum frame.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Three features in order of precedence: each constrains degrees of freedom that those before it leave.
///
/// The first plane or line among them gives z (a plane's normal points towards the camera); the next plane, line, or second
/// point gives x or, for a plane, y; three points give x from the first to the second and z as the normal of all three.
/// The origin is determined by the first feature, then the second, then the third.
/// A secondary plane is at y = 0, a tertiary plane at x = 0; a secondary line runs along x.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Alignment {
    /// The first datum.
    pub primary: String,
    /// The second.
    pub secondary: String,
    /// The third.
    pub tertiary: String,
}

impl Alignment {
    /// The ids in order of precedence.
    pub fn datums(&self) -> [&str; 3] {
        [&self.primary, &self.secondary, &self.tertiary]
    }
}
