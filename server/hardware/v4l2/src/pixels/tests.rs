use vision::Pixels;

use super::*;

fn format(code: &[u8; 4], (width_px, height_px): (usize, usize), row_bytes: usize) -> Format {
    Format { pixels: FourCc(*code), width_px, height_px, row_bytes }
}

fn unpack(bytes: &[u8], format: &Format) -> Result<Vec<u16>, InvalidImage> {
    channel_of(CameraChannel::Luma, bytes, format)
}

fn channel_of(channel: CameraChannel, bytes: &[u8], format: &Format) -> Result<Vec<u16>, InvalidImage> {
    let is_deep = FORMATS.iter().find(|known| known.code == format.pixels).unwrap().is_deep();
    let source = SourceFormat::choose(&[format.pixels], is_deep, "").unwrap();
    let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
    source.unpack(bytes, format, channel, &mut image)?;
    assert_eq!((image.width(), image.height()), (format.width_px, format.height_px));
    Ok(match image.pixels() {
        Pixels::Eight(pixels) => pixels.iter().map(|&pixel| u16::from(pixel)).collect(),
        Pixels::Sixteen(pixels) => pixels.clone(),
    })
}

#[test]
fn every_format_gives_the_grey_levels_that_were_sent() {
    for (code, bytes, expected) in [
        (b"GREY", vec![1, 2, 3, 4], [1, 2, 3, 4]),
        (b"YUYV", vec![1, 128, 2, 128, 3, 99, 4, 99], [1, 2, 3, 4]),
        (b"Y16 ", vec![0x34, 0x12, 0xFF, 0xFF, 0, 0, 1, 0], [0x1234, 0xFFFF, 0, 1]),
        (b"Y12 ", vec![0xBC, 0x0A, 0xFF, 0x0F, 0, 0, 1, 0], [0xABCA, 0xFFFF, 0, 16]),
        (b"Y10 ", vec![0xA5, 0x03, 0xFF, 0x03, 0, 0, 1, 0], [0xE97A, 0xFFFF, 0, 64]),
    ] {
        let row_bytes = bytes.len() / 2;
        assert_eq!(unpack(&bytes, &format(code, (2, 2), row_bytes)).unwrap(), expected, "{code:?}");
        let short = unpack(&bytes[..bytes.len() - 1], &format(code, (2, 2), row_bytes));
        assert_eq!(short, Err(InvalidImage::Incomplete), "{code:?}: a byte is missing");
    }
}

#[test]
fn a_colour_of_the_laser_is_taken_from_luma_and_chroma() {
    let channels = [CameraChannel::Luma, CameraChannel::Red, CameraChannel::Green, CameraChannel::Blue];
    let (width, height) = (16, 16);
    for rgb in [[200_u8, 10, 30], [10, 180, 20], [15, 25, 220], [90, 90, 90]] {
        let [r, g, b] = rgb.map(f32::from);
        let luma = 0.299 * r + 0.587 * g + 0.114 * b;
        let chroma = |colour: f32, range: f32| (128.0 + (colour - luma) / range).round() as u8;
        let pair = [luma.round() as u8, chroma(b, 1.772), luma.round() as u8, chroma(r, 1.402)];
        let yuyv = pair.repeat(width * height / 2);
        let mut jpeg = Vec::new();
        let pixels = rgb.repeat(width * height);
        let encoder = jpeg_encoder::Encoder::new(&mut jpeg, 95);
        encoder.encode(&pixels, width as u16, height as u16, jpeg_encoder::ColorType::Rgb).unwrap();
        for (code, bytes) in [(b"YUYV", &yuyv), (b"MJPG", &jpeg)] {
            for (channel, expected) in channels.into_iter().zip([luma, r, g, b]) {
                let got = channel_of(channel, bytes, &format(code, (width, height), 0)).unwrap();
                let off = got.iter().map(|&level| (f32::from(level) - expected).abs()).fold(0.0, f32::max);
                assert!(off <= 4.0, "{rgb:?} {channel:?}: {off} levels off in {code:?}");
            }
        }
    }
}

#[test]
fn row_padding_is_ignored() {
    assert_eq!(unpack(&[1, 2, 99, 99, 3, 4], &format(b"GREY", (2, 2), 4)).unwrap(), [1, 2, 3, 4]);
    assert_eq!(unpack(&[1, 0, 9, 9, 2, 0, 9, 9], &format(b"Y16 ", (1, 2), 4)).unwrap(), [1, 2]);
}

/// A ramp of 64 × 32 pixels as a colour JPEG.
fn jpeg() -> Vec<u8> {
    let rgb: Vec<u8> = (0..64 * 32_usize).flat_map(|at| [(at % 64 * 4) as u8; 3]).collect();
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, 95);
    encoder.encode(&rgb, 64, 32, jpeg_encoder::ColorType::Rgb).unwrap();
    bytes
}

fn assert_ramp(pixels: &[u16]) {
    for (at, &pixel) in pixels.iter().enumerate() {
        // Quality 95 changes a smooth ramp by a level or two.
        assert!(pixel.abs_diff((at % 64 * 4) as u16) <= 3, "pixel {at} is {pixel}");
    }
}

#[test]
fn jpeg_images_are_decoded_with_padding_and_without_tables() {
    let format = format(b"MJPG", (64, 32), 0);
    assert_ramp(&unpack(&jpeg(), &format).unwrap());
    let filled_up = [jpeg(), vec![0; 300]].concat();
    assert_ramp(&unpack(&filled_up, &format).unwrap());
    // Many cameras omit the Huffman tables, in which case those of the standard apply (AVI's MJPG).
    assert_ramp(&unpack(&without_huffman_tables(&jpeg()), &format).unwrap());
}

#[test]
fn a_truncated_or_wrongly_sized_jpeg_image_is_an_error() {
    let whole = jpeg();
    let agreed = format(b"MJPG", (64, 32), 0);
    for keep in [0, 2, 100, whole.len() / 2, whole.len() - 2] {
        assert_eq!(unpack(&whole[..keep], &agreed), Err(InvalidImage::Incomplete), "{keep} bytes");
    }
    assert_eq!(unpack(&whole, &format(b"MJPG", (32, 64), 0)), Err(InvalidImage::WrongSize(64, 32)));
}

fn without_huffman_tables(jpeg: &[u8]) -> Vec<u8> {
    let (mut kept, mut at) = (jpeg[..2].to_vec(), 2);
    while jpeg[at + 1] != 0xDA {
        let length = 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if jpeg[at + 1] != 0xC4 {
            kept.extend(&jpeg[at..at + length]);
        }
        at += length;
    }
    assert!(kept.len() + 100 < jpeg.len(), "there were no tables to leave out");
    kept.extend(&jpeg[at..]);
    kept
}

#[test]
fn the_best_format_offered_is_chosen_unless_another_is_preferred() {
    let offered = [*b"MJPG", *b"YUYV", *b"H264", *b"Y10 ", *b"Y16 "].map(FourCc);
    let chosen = |is_deep, preferred| {
        SourceFormat::choose(&offered, is_deep, preferred).map(|format| format.code.to_string())
    };
    assert_eq!(chosen(false, "").as_deref(), Some("YUYV"));
    assert_eq!(chosen(false, "MJPG").as_deref(), Some("MJPG"));
    assert_eq!(chosen(false, "GREY").as_deref(), Some("YUYV"), "one that is not offered");
    assert_eq!(chosen(true, "").as_deref(), Some("Y16"));
    assert_eq!(chosen(true, "Y10").as_deref(), Some("Y10"));
    assert_eq!(SourceFormat::choose(&[FourCc(*b"H264")], false, ""), None);
}
