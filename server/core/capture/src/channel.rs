//! The channel in which colour images show the laser: given, or selected from the images.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vision::{CameraImage, CentrelineParams, Channel, ChannelScore, ColourImage, laser_channel};

use crate::params::CHANNEL_SAMPLE_IMAGES;

/// The channel, as in `camera.channel` and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelChoice {
    /// The one that shows the laser best, selected from the images.
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
    /// The channel, unless it is selected from the images.
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

    /// Whether it is selected from the images.
    pub fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// The name is not that of a channel.
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

/// How the channel was determined.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelBasis {
    /// It was given.
    Given,
    /// No image has colour.
    GreyImages,
    /// It was selected from some of the images.
    Decided {
        /// Their number.
        n_images: usize,
        /// The result for each channel.
        scores: Vec<ChannelScore>,
    },
}

/// The channel in which the images show the laser, and how it was determined.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserChannel {
    /// The channel.
    pub channel: Channel,
    /// How it was determined.
    pub basis: ChannelBasis,
}

impl LaserChannel {
    /// For images without colour.
    pub fn of_grey() -> Self {
        Self { channel: Channel::Luma, basis: ChannelBasis::GreyImages }
    }

    /// Selects the channel from up to [`CHANNEL_SAMPLE_IMAGES`] of `n_lit` images with the laser on, evenly
    /// spread.
    ///
    /// `read`: image by index, with the background already subtracted if there is one; `None` if it cannot be
    /// read. `params`: settings of the extraction, one for each direction the lines may run in.
    pub fn decided(
        n_lit: usize,
        read: impl Fn(usize) -> Option<CameraImage>,
        params: &[CentrelineParams],
    ) -> Self {
        let n_sampled = n_lit.min(CHANNEL_SAMPLE_IMAGES);
        let sampled = (0..n_sampled).map(|k| (2 * k + 1) * n_lit / (2 * n_sampled));
        let images: Vec<ColourImage> = sampled
            .filter_map(|idx| match read(idx) {
                Some(CameraImage::Colour(image)) => Some(image),
                _ => None,
            })
            .collect();
        if images.is_empty() {
            return Self::of_grey();
        }
        let (channel, scores) = laser_channel(&images, params);
        Self { channel, basis: ChannelBasis::Decided { n_images: images.len(), scores } }
    }
}

/// Formatted for the operator.
impl fmt::Display for LaserChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.basis {
            ChannelBasis::Given => write!(f, "channel {}", self.channel.name()),
            ChannelBasis::GreyImages => f.write_str("grey images"),
            ChannelBasis::Decided { n_images, scores } => {
                write!(f, "channel {} (auto, from {n_images} images", self.channel.name())?;
                if scores.iter().all(|score| score.n_laser_points == 0) {
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
