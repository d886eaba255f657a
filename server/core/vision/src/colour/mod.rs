//! Grey and colour images as delivered by cameras, and the channel that is evaluated.

mod ambient_light;
mod hidden_noise;

use std::borrow::Cow;

use crate::{GreyImage, ImageError, Pixels};
use ambient_light::AmbientLight;
use hidden_noise::hidden_noise;

/// How the grey levels are derived from a colour image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// The red channel: full resolution for a red laser.
    Red,
    /// The green channel.
    Green,
    /// The blue channel.
    Blue,
    /// Luma (ITU-R BT.601): boards, white light, monochrome cameras.
    Luma,
    /// Red minus the red of ambient light predicted from green and blue, clamped at zero: a red laser in daylight.
    RedMinusOthers,
    /// Green minus the green of ambient light, predicted from red and blue.
    GreenMinusOthers,
    /// Blue minus the blue of ambient light, predicted from red and green.
    BlueMinusOthers,
}

impl Channel {
    /// All channels, the simplest first.
    pub const ALL: [Self; 7] = [
        Self::Red,
        Self::Green,
        Self::Blue,
        Self::Luma,
        Self::RedMinusOthers,
        Self::GreenMinusOthers,
        Self::BlueMinusOthers,
    ];

    /// Name on the command line and in `camera.channel` of a capture.
    pub fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::Luma => "luma",
            Self::RedMinusOthers => "red-minus-others",
            Self::GreenMinusOthers => "green-minus-others",
            Self::BlueMinusOthers => "blue-minus-others",
        }
    }

    /// The channel for images of a board with the same camera: without subtraction of ambient light, which would remove
    /// black and white. The colour stays the same, because of the lens's chromatic aberration.
    pub fn for_boards(self) -> Self {
        match self {
            Self::RedMinusOthers => Self::Red,
            Self::GreenMinusOthers => Self::Green,
            Self::BlueMinusOthers => Self::Blue,
            plain => plain,
        }
    }

    /// Index of its colour: 0 red, 1 green, 2 blue; `None` for luma.
    pub(crate) fn colour(self) -> Option<usize> {
        match self {
            Self::Red | Self::RedMinusOthers => Some(0),
            Self::Green | Self::GreenMinusOthers => Some(1),
            Self::Blue | Self::BlueMinusOthers => Some(2),
            Self::Luma => None,
        }
    }
}

/// Red, green and blue of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourImage {
    width: usize,
    height: usize,
    /// Red, green, blue, pixel by pixel.
    pixels: Pixels,
    /// As [`GreyImage::hidden_noise`], of each colour.
    hidden_noise: [f32; 3],
}

impl ColourImage {
    /// Wraps `pixels` (red, green, blue in turn, row-major) as an image of `width` × `height`.
    ///
    /// # Errors
    /// [`ImageError::Empty`] if a side is zero, [`ImageError::WrongLength`] if the buffer does not fit.
    pub fn new(width: usize, height: usize, pixels: Pixels) -> Result<Self, ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Empty { width, height });
        }
        let got = match &pixels {
            Pixels::Eight(p) => p.len(),
            Pixels::Sixteen(p) => p.len(),
        };
        let needed = 3 * width * height;
        if got != needed {
            return Err(ImageError::WrongLength { width, height, needed, got });
        }
        Ok(Self { width, height, pixels, hidden_noise: [0.0; 3] })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green and blue in turn, row-major.
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// As [`ColourImage::pixels`], without the image.
    pub fn into_pixels(self) -> Pixels {
        self.pixels
    }

    /// The largest level a sample can hold: 255 or 65535.
    pub fn full_scale(&self) -> f32 {
        match self.pixels {
            Pixels::Eight(_) => 255.0,
            Pixels::Sixteen(_) => 65535.0,
        }
    }

    /// Red, green and blue of column `u`, row `v`, which must be inside the image.
    pub fn at(&self, u: usize, v: usize) -> [f32; 3] {
        let idx = 3 * (v * self.width + u);
        match &self.pixels {
            Pixels::Eight(p) => [0, 1, 2].map(|c| f32::from(p[idx + c])),
            Pixels::Sixteen(p) => [0, 1, 2].map(|c| f32::from(p[idx + c])),
        }
    }

    /// The grey levels of one channel, with the bit depth of the image.
    pub fn channel(&self, channel: Channel) -> GreyImage {
        let of_colours = self.hidden_noise;
        let (pixels, sigma) = match (channel.colour(), channel == channel.for_boards()) {
            (Some(colour), false) => {
                let light = AmbientLight::of(self, colour);
                let signed = |u, v| light.signed_excess(self.at(u, v));
                let sigma = hidden_noise(self.width, self.height, signed).max(of_colours[colour]);
                (self.pixel_by_pixel(|rgb| light.excess(rgb), |rgb| light.excess(rgb)), sigma)
            }
            (Some(colour), true) => {
                (self.pixel_by_pixel(|rgb| rgb[colour], |rgb| rgb[colour]), of_colours[colour])
            }
            (None, _) => {
                let weighted = |(sigma, weight): (f32, u64)| (sigma * weight as f32 / LUMA_UNIT as f32).powi(2);
                let sigma = of_colours.into_iter().zip(LUMA_WEIGHTS).map(weighted).sum::<f32>().sqrt();
                (self.pixel_by_pixel(Level::luma, Level::luma), sigma)
            }
        };
        let image = GreyImage::new(self.width, self.height, pixels);
        image.expect("a third of the samples fits the same sides").with_hidden_noise(sigma)
    }

    /// One level of every pixel, in either bit depth.
    fn pixel_by_pixel(&self, eight: impl Fn([u8; 3]) -> u8, sixteen: impl Fn([u16; 3]) -> u16) -> Pixels {
        match &self.pixels {
            Pixels::Eight(p) => Pixels::Eight(triples(p).map(eight).collect()),
            Pixels::Sixteen(p) => Pixels::Sixteen(triples(p).map(sixteen).collect()),
        }
    }

    /// Whether red, green and blue are equal everywhere: the image of a monochrome camera in a colour file.
    fn is_grey(&self) -> bool {
        fn equal<T: PartialEq>(pixels: &[T]) -> bool {
            pixels.chunks_exact(3).all(|rgb| rgb[0] == rgb[1] && rgb[1] == rgb[2])
        }
        match &self.pixels {
            Pixels::Eight(p) => equal(p),
            Pixels::Sixteen(p) => equal(p),
        }
    }
}

/// An image as delivered by a camera.
#[derive(Debug, Clone, PartialEq)]
pub enum CameraImage {
    /// One channel.
    Grey(GreyImage),
    /// Red, green and blue.
    Colour(ColourImage),
}

impl CameraImage {
    /// A colour image, or a grey one if its three channels are equal everywhere.
    pub fn from_colour(image: ColourImage) -> Self {
        if image.is_grey() { Self::Grey(image.channel(Channel::Green)) } else { Self::Colour(image) }
    }

    /// This image (laser on) minus `off` (laser off), pixel by pixel, clamped at zero. `None` if size or bit depth
    /// differ.
    pub fn minus(&self, off: &Self) -> Option<Self> {
        if let (Self::Grey(on), Self::Grey(off)) = (self, off) {
            let same_size = (on.width(), on.height()) == (off.width(), off.height());
            let pixels = same_size.then(|| difference(on.pixels(), off.pixels())).flatten()?;
            let sigma = hidden_noise(on.width(), on.height(), |u, v| on.at(u, v) - off.at(u, v));
            let image = GreyImage::new(on.width(), on.height(), pixels).ok()?;
            return Some(Self::Grey(image.with_hidden_noise(sigma)));
        }
        let (on, off) = (self.to_colour(), off.to_colour());
        let same_size = (on.width, on.height) == (off.width, off.height);
        let pixels = same_size.then(|| difference(&on.pixels, &off.pixels)).flatten()?;
        let mut image = ColourImage::new(on.width, on.height, pixels).ok()?;
        image.hidden_noise = [0, 1, 2]
            .map(|colour| hidden_noise(on.width, on.height, |u, v| on.at(u, v)[colour] - off.at(u, v)[colour]));
        Some(Self::Colour(image))
    }

    /// Whether a pixel, column and row, is at full scale: the colour of this channel or, for luma, any colour.
    pub fn is_saturated(&self, u: usize, v: usize, channel: Channel) -> bool {
        match self {
            Self::Grey(image) => image.is_saturated(u, v),
            Self::Colour(image) => {
                let levels = image.at(u, v);
                let is_full = |level: f32| level >= image.full_scale();
                channel.colour().map_or_else(|| levels.into_iter().any(is_full), |colour| is_full(levels[colour]))
            }
        }
    }

    /// The image with three channels.
    fn to_colour(&self) -> Cow<'_, ColourImage> {
        fn tripled<T: Copy>(levels: &[T]) -> Vec<T> {
            levels.iter().flat_map(|&level| [level; 3]).collect()
        }
        match self {
            Self::Colour(image) => Cow::Borrowed(image),
            Self::Grey(image) => {
                let pixels = match image.pixels() {
                    Pixels::Eight(p) => Pixels::Eight(tripled(p)),
                    Pixels::Sixteen(p) => Pixels::Sixteen(tripled(p)),
                };
                let hidden_noise = [image.hidden_noise(); 3];
                Cow::Owned(ColourImage { width: image.width(), height: image.height(), pixels, hidden_noise })
            }
        }
    }

    /// Bits per sample: 8 or 16.
    pub fn bit_depth(&self) -> u32 {
        match self {
            Self::Grey(image) => image.bit_depth(),
            Self::Colour(image) => match image.pixels {
                Pixels::Eight(_) => 8,
                Pixels::Sixteen(_) => 16,
            },
        }
    }

    /// The grey levels of one channel; a grey image is returned unchanged for any channel.
    pub fn channel(&self, channel: Channel) -> GreyImage {
        match self {
            Self::Grey(image) => image.clone(),
            Self::Colour(image) => image.channel(channel),
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        match self {
            Self::Grey(image) => image.width(),
            Self::Colour(image) => image.width(),
        }
    }

    /// Rows.
    pub fn height(&self) -> usize {
        match self {
            Self::Grey(image) => image.height(),
            Self::Colour(image) => image.height(),
        }
    }
}

/// Pixel by pixel, clamped at zero; `None` if the bit depths differ.
fn difference(on: &Pixels, off: &Pixels) -> Option<Pixels> {
    fn levels<T: Level>(on: &[T], off: &[T]) -> Vec<T> {
        on.iter().zip(off).map(|(on, off)| on.above(*off)).collect()
    }
    match (on, off) {
        (Pixels::Eight(on), Pixels::Eight(off)) => Some(Pixels::Eight(levels(on, off))),
        (Pixels::Sixteen(on), Pixels::Sixteen(off)) => Some(Pixels::Sixteen(levels(on, off))),
        _ => None,
    }
}

/// Arithmetic of grey levels.
trait Level: Copy + Ord + Into<f32> {
    /// Luma (ITU-R BT.601).
    fn luma(rgb: [Self; 3]) -> Self;
    /// The difference, clamped at zero.
    fn above(self, other: Self) -> Self;
    /// The nearest representable level.
    fn nearest(level: f32) -> Self;
}

/// Weights of ITU-R BT.601.
const LUMA_WEIGHTS: [u64; 3] = [19595, 38470, 7471];
/// Their sum.
const LUMA_UNIT: u64 = 1 << 16;

macro_rules! level {
    ($($t:ty),*) => {$(
        impl Level for $t {
            fn luma(rgb: [Self; 3]) -> Self {
                let sum: u64 = rgb.iter().zip(LUMA_WEIGHTS).map(|(&level, weight)| u64::from(level) * weight).sum();
                ((sum + LUMA_UNIT / 2) / LUMA_UNIT) as Self
            }

            fn above(self, other: Self) -> Self {
                self.saturating_sub(other)
            }

            fn nearest(level: f32) -> Self {
                // The cast saturates at the limits of the type.
                level.round() as Self
            }
        }
    )*};
}
level!(u8, u16);

fn triples<T: Copy>(pixels: &[T]) -> impl Iterator<Item = [T; 3]> {
    pixels.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]])
}

#[cfg(test)]
mod tests {
    use crate::{CentrelineParams, find_centrelines};

    use super::*;

    #[test]
    fn every_channel_is_derived_from_a_colour_image() {
        let image = ColourImage::new(2, 1, Pixels::Eight(vec![200, 10, 30, 40, 90, 50])).unwrap();
        let expected = [
            (Channel::Red, [200, 40]),
            (Channel::Green, [10, 90]),
            (Channel::Blue, [30, 50]),
            // 0.299 · 200 + 0.587 · 10 + 0.114 · 30 = 69.1, 70.5
            (Channel::Luma, [69, 70]),
            (Channel::RedMinusOthers, [170, 0]),
            (Channel::GreenMinusOthers, [0, 40]),
            (Channel::BlueMinusOthers, [0, 0]),
        ];
        for (channel, levels) in expected {
            assert_eq!(image.channel(channel).pixels(), &Pixels::Eight(levels.to_vec()), "{channel:?}");
        }
        let deep = ColourImage::new(1, 1, Pixels::Sixteen(vec![65_535, 65_535, 65_535])).unwrap();
        assert_eq!(deep.channel(Channel::Luma).pixels(), &Pixels::Sixteen(vec![65_535]));
    }

    #[test]
    fn a_colour_file_of_a_monochrome_camera_is_grey() {
        let grey = ColourImage::new(1, 2, Pixels::Eight(vec![7, 7, 7, 9, 9, 9])).unwrap();
        let CameraImage::Grey(image) = CameraImage::from_colour(grey) else { panic!("three equal channels") };
        assert_eq!(image.pixels(), &Pixels::Eight(vec![7, 9]));
    }

    /// A line along row 40, clipped by the sensor, in ambient light of 60.
    #[test]
    fn a_clipped_line_is_saturated_after_subtraction_of_ambient_light_too() {
        let image = |height: f64| {
            let level = |idx: usize| {
                let across = ((idx / 320) as f64 - 40.0) / 6.0;
                let line = height * (-across * across * 4.0 * 2.0_f64.ln()).exp();
                (60.0 + line + (idx * 7919 % 3) as f64).min(255.0).round() as u8
            };
            CameraImage::Grey(GreyImage::new(320, 80, Pixels::Eight((0..320 * 80).map(level).collect())).unwrap())
        };
        let off = image(0.0);
        for (height, is_clipped) in [(300.0, true), (150.0, false)] {
            let on = image(height);
            let light = on.minus(&off).unwrap().channel(Channel::Luma);
            let mut lines = find_centrelines(&light, &CentrelineParams::default());
            let n_saturated = |lines: &crate::Centrelines| {
                lines.segments.iter().flat_map(|segment| &segment.points).filter(|point| point.saturated).count()
            };
            assert_eq!(n_saturated(&lines), 0, "the difference is nowhere at full scale");
            lines.mark_saturated((320, 80), |u, v| on.is_saturated(u, v, Channel::Luma));
            let n_points = lines.segments.iter().map(|segment| segment.points.len()).sum::<usize>();
            assert!(n_points > 300);
            assert_eq!(n_saturated(&lines), if is_clipped { n_points } else { 0 }, "{height}");
        }
    }
}
