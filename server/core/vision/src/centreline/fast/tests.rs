//! The extraction with the baseline of this architecture (NEON on aarch64), the only version compiled with these tests;
//! its *correctness* is tested in the parent module.

#[path = "../../../tests/it/stored_bits.rs"]
mod stored_bits;

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
    View { pixels, width: SIZE.0, height: SIZE.1, full_scale, hidden_noise: 0.0 }
}

fn eight(pixels: &[u8]) -> Centrelines {
    let mut found = Centrelines::default();
    extract_eight(&view(pixels, 255.0), &mut Memory::default(), &mut found);
    found
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
