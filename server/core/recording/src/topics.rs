//! Topics of the messages.

/// The topics of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// Images, `foxglove.RawImage`.
    Image,
    /// Metadata of an image, `sheaf.Frame`.
    Frame,
    /// Profiles in metres, `foxglove.PointCloud`.
    Profile,
    /// Centrelines, `sheaf.Peaks`.
    Peaks,
    /// State of the stage between frames, `sheaf.Stage`.
    Stage,
    /// Frames that are rows of a scan, `sheaf.ScanRow`.
    Row,
    /// Devices and their settings, `sheaf.DeviceSettings`.
    Settings,
    /// Events, `sheaf.Event`.
    Event,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 8] = [
        Self::Image,
        Self::Frame,
        Self::Profile,
        Self::Peaks,
        Self::Stage,
        Self::Row,
        Self::Settings,
        Self::Event,
    ];

    /// Its name in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Image => "/camera/image",
            Self::Frame => "/camera/frame",
            Self::Profile => "/profile",
            Self::Peaks => "/peaks",
            Self::Stage => "/stage",
            Self::Row => "/scan/row",
            Self::Settings => "/devices/settings",
            Self::Event => "/events",
        }
    }
}
