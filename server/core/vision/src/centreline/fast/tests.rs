//! Compares the extraction between instruction sets; its *correctness* is tested in the parent module. Instruction sets
//! that the machine lacks are not run; their result is stored here, and `cargo xtask neon` runs the extraction for
//! aarch64.

use super::*;

/// Speckled lines: level, sloping and steep, bright enough to saturate, one crossing another.
fn levels(width: usize, height: usize) -> Vec<u8> {
    let mut state = 9u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let lines = [(40.3, 0.02, 180.0), (90.6, -0.1, 60.0), (150.2, 0.0, 400.0), (-200.0, 1.0, 200.0)];
    let pixel = |idx: usize| {
        let (u, v) = ((idx % width) as f64, (idx / width) as f64);
        let light = |&(v0, slope, peak): &(f64, f64, f64)| {
            let d: f64 = (v - v0 - slope * u) / f64::hypot(slope, 1.0);
            peak * (-0.5 * d * d / 4.0).exp()
        };
        let grain = 0.7 + 0.6 * uniform();
        (8.0 + grain * lines.iter().map(light).sum::<f64>() + 3.0 * uniform()).clamp(0.0, 255.0) as u8
    };
    (0..width * height).map(pixel).collect()
}

/// Not a multiple of a cell, a strip or a tile.
const SIZE: (usize, usize) = (541, 213);

fn view<T>(pixels: &[T], full_scale: f32) -> View<'_, T> {
    View { pixels, width: SIZE.0, height: SIZE.1, full_scale }
}

fn eight(pixels: &[u8]) -> Centrelines {
    let mut found = Centrelines::default();
    extract_eight(&view(pixels, 255.0), &mut Memory::default(), &mut found);
    found
}

/// All steps of the extraction, with the instruction set of the caller.
#[inline(always)]
fn extract<T: Level>(view: &View<T>, memory: &mut Memory<T>, found: &mut Centrelines) {
    memory.read(view);
    memory.estimate_width(view);
    memory.measure_box_noise(view);
    memory.search(view);
    memory.measure(view);
    memory.average_along_lines(found);
}

/// The version for AVX2, which a machine with AVX-512 would not choose.
#[multiversion(targets("x86_64+avx2"))]
fn extract_at_most_by_avx2(view: &View<u8>, memory: &mut Memory<u8>, found: &mut Centrelines) {
    extract(view, memory, found);
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let pixels = levels(SIZE.0, SIZE.1);
    let found = eight(&pixels);
    assert!(found.segments.len() >= 4, "{} segments", found.segments.len());
    // `extract` called from here is compiled for the baseline of this architecture.
    let (mut plain, mut by_avx2) = (Centrelines::default(), Centrelines::default());
    extract(&view(&pixels, 255.0), &mut Memory::default(), &mut plain);
    extract_at_most_by_avx2(&view(&pixels, 255.0), &mut Memory::default(), &mut by_avx2);
    assert_eq!(found, plain);
    assert_eq!(by_avx2, plain);
    let sixteen: Vec<u16> = pixels.iter().map(|&level| u16::from(level) * 257).collect();
    let (mut found, mut plain) = (Centrelines::default(), Centrelines::default());
    extract_sixteen(&view(&sixteen, 65535.0), &mut Memory::default(), &mut found);
    extract(&view(&sixteen, 65535.0), &mut Memory::default(), &mut plain);
    assert!(found.segments.len() >= 4, "{} segments", found.segments.len());
    assert_eq!(found, plain);
}

/// Lines like those of [`levels`] in integer arithmetic: the image does not depend on any library's `exp`.
fn whole_number_levels(width: i64, height: i64) -> Vec<u8> {
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

/// The fingerprint of the integer image's lines. A deliberate change of the extraction updates it: it does not show
/// that the result is correct, only that AVX-512, AVX2, NEON and the baseline agree.
///
/// The remaining possible difference is `exp` and `ln` of the system's library, from which the extraction computes its
/// weights; those of glibc agree on x86-64 and aarch64.
const FINGERPRINT: u64 = 0x584f_9421_486e_47c3;

#[test]
fn every_architecture_gives_the_stored_bits() {
    let pixels = whole_number_levels(SIZE.0 as i64, SIZE.1 as i64);
    let found = eight(&pixels);
    let n_points: usize = found.segments.iter().map(|segment| segment.points.len()).sum();
    assert!(found.segments.len() >= 4 && n_points > 2 * SIZE.0, "{n_points} points");
    let fingerprint = fingerprint(&found);
    assert_eq!(fingerprint, FINGERPRINT, "{fingerprint:#018x}");
}

#[test]
fn earlier_images_do_not_affect_the_result() {
    let (first, second) = (levels(SIZE.0, SIZE.1), vec![9u8; SIZE.0 * SIZE.1]);
    let (mut memory, mut found) = (Memory::default(), Centrelines::default());
    for pixels in [&first, &second, &first] {
        extract_eight(&view(pixels, 255.0), &mut memory, &mut found);
        assert_eq!(found, eight(pixels));
    }
}

#[test]
fn a_faint_line_on_a_gradient_is_found_at_any_position_relative_to_the_cells() {
    for offset in 0..8 {
        let row = 60.0 + f64::from(offset) * 0.5;
        let mut state = 5u64;
        let mut gauss = || {
            (0..12)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (state >> 33) as f64 / (1u64 << 31) as f64
                })
                .sum::<f64>()
                - 6.0
        };
        let pixel = |idx: usize| {
            let (u, v) = ((idx % SIZE.0) as f64, (idx / SIZE.0) as f64);
            let light = 10.0 + 0.2 * v + 0.05 * u + 20.0 * (-0.125 * (v - row - 0.05 * u).powi(2)).exp();
            (light + 1.2 * gauss()).round().clamp(0.0, 255.0) as u8
        };
        let pixels: Vec<u8> = (0..SIZE.0 * SIZE.1).map(pixel).collect();
        let found = eight(&pixels);
        let n: usize = found.segments.iter().map(|s| s.points.len()).sum();
        assert!(n >= SIZE.0 - 10, "row {row}: {n} columns");
    }
}
