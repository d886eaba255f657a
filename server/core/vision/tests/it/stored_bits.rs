//! The extraction gives the same bits with every instruction set: these tests are compiled into the unit tests, which run
//! the baseline of this architecture (NEON on aarch64; `cargo xtask neon`), and into the tests of the library, which runs
//! the best instruction set of the machine.

use vision::{CentrelineParams, Centrelines, GreyImage, Pixels, find_centrelines};

/// Columns and rows: not a multiple of a cell, a strip or a tile.
const SIZE: (usize, usize) = (541, 213);

/// Level, sloping and steep speckled lines, one crossing another, in integer arithmetic: the image does not depend on any
/// library's `exp`.
fn levels(width: i64, height: i64) -> Vec<u8> {
    /// Units per pixel of positions along a column.
    const PER_PX: i64 = 16;
    /// Half-height of a line's light; its full width at half height is 4.9 px.
    const REACH: i64 = 72;
    // Row at the first column, rows per 100 columns, grey levels in the middle.
    let lines = [(40, 2, 180), (90, -10, 60), (150, 0, 400), (-200, 100, 200)];
    let mut state = 9u64;
    let mut whole_below = |limit: i64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (((state >> 33) * limit as u64) >> 31) as i64
    };
    let mut pixel = |idx: i64| {
        let (u, v) = (idx % width, idx / width);
        let light = |&(row, slope, peak): &(i64, i64, i64)| {
            let distance = (v - row) * PER_PX - slope * u * PER_PX / 100;
            let bell = (REACH * REACH - distance * distance).max(0).pow(2);
            peak * bell / REACH.pow(4)
        };
        let speckle = 180 + whole_below(154);
        (8 + speckle * lines.iter().map(light).sum::<i64>() / 256 + whole_below(4)).min(255) as u8
    };
    (0..width * height).map(&mut pixel).collect()
}

/// A hash over every bit of every point (FNV-1a).
fn fingerprint(found: &Centrelines) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |bits: u64| {
        for byte in bits.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    add(found.correlation_px.to_bits());
    for segment in &found.segments {
        add(segment.points.len() as u64);
        for point in &segment.points {
            let [across_u, across_v] = point.normal;
            [point.u_px, point.v_px, across_u, across_v, point.sigma_px]
                .iter()
                .for_each(|number| add(number.to_bits()));
            [point.intensity, point.width_px].iter().for_each(|number| add(u64::from(number.to_bits())));
            add(u64::from(point.saturated));
        }
    }
    hash
}

/// The fingerprint of the image's lines. A deliberate change of the extraction updates it: it does not show that the
/// result is correct, only that AVX-512, AVX2, NEON and the baseline agree.
///
/// The remaining possible difference is `exp` and `ln` of the system's library, from which the extraction computes its
/// weights; those of glibc agree on x86-64 and aarch64.
const FINGERPRINT: u64 = 0xd203_c09c_ffda_5f34;

/// The same at 16 bits.
const FINGERPRINT_OF_SIXTEEN_BITS: u64 = 0x7433_6ffe_4025_2005;

fn assert_fingerprint(pixels: Pixels, expected: u64) {
    let image = GreyImage::new(SIZE.0, SIZE.1, pixels).unwrap();
    let found = find_centrelines(&image, &CentrelineParams::default());
    let n_points: usize = found.segments.iter().map(|segment| segment.points.len()).sum();
    assert!(found.segments.len() >= 4 && n_points > 2 * SIZE.0, "{n_points} points");
    let fingerprint = fingerprint(&found);
    assert_eq!(fingerprint, expected, "{fingerprint:#018x}");
}

#[test]
fn every_instruction_set_gives_the_stored_bits() {
    let pixels = levels(SIZE.0 as i64, SIZE.1 as i64);
    let sixteen = pixels.iter().map(|&level| u16::from(level) * 257).collect();
    assert_fingerprint(Pixels::Eight(pixels), FINGERPRINT);
    assert_fingerprint(Pixels::Sixteen(sixteen), FINGERPRINT_OF_SIXTEEN_BITS);
}
