//! The channel in which colour pictures show the laser: given, or selected from the pictures.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vision::{CameraImage, CentrelineParams, Channel, ChannelScore, ColourImage, laser_channel};

use crate::params::CHANNEL_SAMPLE_PICTURES;

/// The channel, as in `camera.channel` and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelChoice {
    /// The one that shows the laser best, selected from the pictures.
    #[default]
    Auto,
    /// See [`Channel::Red`].
    Red,
    /// See [`Channel::Green`].
    Green,
    /// See [`Channel::Blue`].
    Blue,
    /// See [`Channel::Luma`].
    Luma,
    /// See [`Channel::RedMinusOthers`].
    RedMinusOthers,
    /// See [`Channel::GreenMinusOthers`].
    GreenMinusOthers,
    /// See [`Channel::BlueMinusOthers`].
    BlueMinusOthers,
}

impl ChannelChoice {
    /// The channel, unless it is selected from the pictures.
    pub fn fixed(self) -> Option<Channel> {
        match self {
            Self::Auto => None,
            Self::Red => Some(Channel::Red),
            Self::Green => Some(Channel::Green),
            Self::Blue => Some(Channel::Blue),
            Self::Luma => Some(Channel::Luma),
            Self::RedMinusOthers => Some(Channel::RedMinusOthers),
            Self::GreenMinusOthers => Some(Channel::GreenMinusOthers),
            Self::BlueMinusOthers => Some(Channel::BlueMinusOthers),
        }
    }

    /// Whether it is selected from the pictures.
    pub fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// Not the name of a channel.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown channel: use auto, {}", Channel::ALL.map(Channel::name).join(", "))]
pub struct UnknownChannel;

impl FromStr for ChannelChoice {
    type Err = UnknownChannel;

    fn from_str(name: &str) -> Result<Self, UnknownChannel> {
        let name = serde_json::Value::from(name);
        serde_json::from_value(name).map_err(|_| UnknownChannel)
    }
}

impl fmt::Display for ChannelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.fixed().map_or("auto", Channel::name))
    }
}

/// Why it is this channel.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelBasis {
    /// It was given.
    Given,
    /// No picture has colour.
    GreyPictures,
    /// It was selected from some of the pictures.
    Decided {
        /// Their number.
        n_pictures: usize,
        /// The result for each channel.
        views: Vec<ChannelScore>,
    },
}

/// The channel in which the pictures show the laser, and why it is this one.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserChannel {
    /// The channel.
    pub channel: Channel,
    /// Why.
    pub basis: ChannelBasis,
}

impl LaserChannel {
    /// For pictures without colour.
    pub fn of_grey() -> Self {
        Self { channel: Channel::Luma, basis: ChannelBasis::GreyPictures }
    }

    /// Selects the channel from up to [`CHANNEL_SAMPLE_PICTURES`] of `n_lit` pictures with the laser on, evenly spread.
    ///
    /// `read`: picture by index, with the background already subtracted if there is one; `None` if it cannot be read.
    /// `params`: settings of the extraction, one for each direction the lines may run in.
    pub fn decided(
        n_lit: usize,
        read: impl Fn(usize) -> Option<CameraImage>,
        params: &[CentrelineParams],
    ) -> Self {
        let n_looks = n_lit.min(CHANNEL_SAMPLE_PICTURES);
        let looks = (0..n_looks).map(|k| (2 * k + 1) * n_lit / (2 * n_looks));
        let pictures: Vec<ColourImage> = looks
            .filter_map(|idx| match read(idx) {
                Some(CameraImage::Colour(image)) => Some(image),
                _ => None,
            })
            .collect();
        if pictures.is_empty() {
            return Self::of_grey();
        }
        let (channel, views) = laser_channel(&pictures, params);
        Self { channel, basis: ChannelBasis::Decided { n_pictures: pictures.len(), views } }
    }
}

/// In words for the operator.
impl fmt::Display for LaserChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.basis {
            ChannelBasis::Given => write!(f, "channel {}", self.channel.name()),
            ChannelBasis::GreyPictures => f.write_str("grey pictures"),
            ChannelBasis::Decided { n_pictures, views } => {
                write!(f, "channel {} (auto, from {n_pictures} pictures", self.channel.name())?;
                if views.iter().all(|view| view.n_laser_points == 0) {
                    f.write_str(": none shows coloured light")?;
                }
                f.write_str(")")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_is_parsed_from_its_name() {
        for channel in Channel::ALL {
            let choice: ChannelChoice = channel.name().parse().unwrap();
            assert_eq!((choice.fixed(), choice.to_string().as_str()), (Some(channel), channel.name()));
        }
        assert_eq!("auto".parse(), Ok(ChannelChoice::Auto));
        let refused = "purple".parse::<ChannelChoice>().unwrap_err().to_string();
        assert!(refused.contains("auto, red, green") && refused.contains("red-minus-others"), "{refused}");
    }
}
