//! The topics of an edge node.

use app::doors::BadSetting;

/// The topics of an edge node and its devices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SparkplugTopics {
    group: String,
    node: String,
}

impl SparkplugTopics {
    /// Of the edge node `node`, which is one level of a topic, in a group.
    ///
    /// # Errors
    /// The group is empty, or contains a character that Sparkplug excludes.
    pub fn new(group: &str, node: &str) -> Result<Self, BadSetting> {
        if group.is_empty() || group.contains(['+', '#', '/']) || group.contains(char::is_control) {
            let why = format!("\"{group}\" is no group of Sparkplug: it must not be empty or contain / + #");
            return Err(BadSetting { setting: "sparkplug_group", why });
        }
        Ok(Self { group: group.to_owned(), node: node.to_owned() })
    }

    /// Of the node: `NBIRTH`, `NDATA`, `NDEATH`, `NCMD`.
    pub fn node(&self, kind: &str) -> String {
        format!("spBv1.0/{}/{kind}/{}", self.group, self.node)
    }

    /// Of a device: `DBIRTH`, `DDATA`.
    pub fn device(&self, kind: &str, device: &str) -> String {
        format!("{}/{device}", self.node(kind))
    }
}
