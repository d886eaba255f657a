//! The datums that make the datum frame.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Three features in the order of their rank: each fixes what those before it left free.
///
/// The first plane or line among them gives z (a plane's normal looks to the camera); the next plane, line, or second
/// point gives x or, as a plane, y; three points give x from the first to the second and z as the normal of all three.
/// The origin is where the first feature, then the second, then the third says.
/// A plane that is second is at y = 0, one that is third at x = 0; a line that is second runs along x.
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
    /// The ids in the order of their rank.
    pub fn datums(&self) -> [&str; 3] {
        [&self.primary, &self.secondary, &self.tertiary]
    }
}
