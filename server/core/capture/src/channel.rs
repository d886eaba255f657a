//! The channel in which colour pictures show the laser: named, or decided from the pictures.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vision::{CentrelineParams, Channel, ChannelView, ColourImage, Picture, laser_channel};

use crate::params::CHANNEL_SAMPLE_PICTURES;

/// The channel asked for, as in `camera.channel` and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelChoice {
    /// The one that shows the laser best, decided from the pictures.
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
    /// The channel, unless the pictures decide.
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

    /// Whether the pictures decide.
    pub fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// A word that names no channel.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no channel has this name: write auto, {}", Channel::ALL.map(Channel::word).join(", "))]
pub struct UnknownChannel;

impl FromStr for ChannelChoice {
    type Err = UnknownChannel;

    fn from_str(word: &str) -> Result<Self, UnknownChannel> {
        let word = serde_json::Value::from(word);
        serde_json::from_value(word).map_err(|_| UnknownChannel)
    }
}

impl fmt::Display for ChannelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.fixed().map_or("auto", Channel::word))
    }
}

/// Why it is this channel.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelBasis {
    /// It was named.
    Given,
    /// No picture has colour.
    GreyPictures,
    /// Some of the pictures were looked at.
    Decided {
        /// How many.
        n_pictures: usize,
        /// What each channel showed.
        views: Vec<ChannelView>,
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
    /// Of pictures without colour.
    pub fn of_grey() -> Self {
        Self { channel: Channel::Luma, basis: ChannelBasis::GreyPictures }
    }

    /// Decides from up to [`CHANNEL_SAMPLE_PICTURES`] of `n_lit` pictures with the laser on, evenly spread.
    ///
    /// `read`: picture by index, a picture with the laser off already taken away where there is one; `None` where it
    /// cannot be read. `params`: how lines are looked for, once for each direction they may run in.
    pub fn decided(n_lit: usize, read: impl Fn(usize) -> Option<Picture>, params: &[CentrelineParams]) -> Self {
        let n_looks = n_lit.min(CHANNEL_SAMPLE_PICTURES);
        let looks = (0..n_looks).map(|k| (2 * k + 1) * n_lit / (2 * n_looks));
        let pictures: Vec<ColourImage> = looks
            .filter_map(|idx| match read(idx) {
                Some(Picture::Colour(image)) => Some(image),
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
            ChannelBasis::Given => write!(f, "channel {}", self.channel.word()),
            ChannelBasis::GreyPictures => f.write_str("grey pictures"),
            ChannelBasis::Decided { n_pictures, views } => {
                write!(f, "channel {} (auto, from {n_pictures} pictures", self.channel.word())?;
                if views.iter().all(|view| view.n_laser_points == 0) {
                    f.write_str(": none shows light of one colour")?;
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
    fn every_channel_is_named_by_its_word() {
        for channel in Channel::ALL {
            let choice: ChannelChoice = channel.word().parse().unwrap();
            assert_eq!((choice.fixed(), choice.to_string().as_str()), (Some(channel), channel.word()));
        }
        assert_eq!("auto".parse(), Ok(ChannelChoice::Auto));
        let refused = "purple".parse::<ChannelChoice>().unwrap_err().to_string();
        assert!(refused.contains("auto, red, green") && refused.contains("red-minus-others"), "{refused}");
    }
}
