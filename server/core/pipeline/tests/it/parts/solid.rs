//! Triangles of parts in their datum frame: x along the travel, y along the lines, z up from the table.

use std::f64::consts::{PI, TAU};

pub type Triangles = Vec<[[f64; 3]; 3]>;

/// Segments of a full circle: at a radius of 6 mm the chord is 1 µm off at most.
const N_SEGMENTS: usize = 180;

fn add_quad(triangles: &mut Triangles, [a, b, c, d]: [[f64; 3]; 4]) {
    triangles.extend([[a, b, c], [a, c, d]]);
}

/// Direction in which a profile is extruded.
#[derive(Clone, Copy)]
pub enum Along {
    X,
    Y,
}

/// A solid on the table below `profile` (distance, height), from `first` to `last` in the direction of extrusion.
pub fn add_extruded(triangles: &mut Triangles, along: Along, profile: &[[f64; 2]], [first, last]: [f64; 2]) {
    let at = |way: f64, [across, z]: [f64; 2]| match along {
        Along::X => [way, across, z],
        Along::Y => [across, way, z],
    };
    for pair in profile.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        add_quad(triangles, [at(first, a), at(first, b), at(last, b), at(last, a)]);
        for end in [first, last] {
            add_quad(triangles, [at(end, [a[0], 0.0]), at(end, [b[0], 0.0]), at(end, b), at(end, a)]);
        }
    }
}

/// A block with an opening through its top, down to the table; both rims are star-shaped about `centre`.
pub fn add_block_with_opening(
    triangles: &mut Triangles,
    [[x_min, x_max], [y_min, y_max]]: [[f64; 2]; 2],
    height: f64,
    centre: [f64; 2],
    opening: impl Fn(f64) -> f64,
) {
    let mut angles: Vec<f64> = (0..2 * N_SEGMENTS).map(|k| PI * k as f64 / N_SEGMENTS as f64).collect();
    for (x, y) in [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)] {
        angles.push((y - centre[1]).atan2(x - centre[0]).rem_euclid(TAU));
    }
    angles.sort_by(f64::total_cmp);
    angles.push(TAU);
    let rims = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let to_side = |low: f64, high: f64, from: f64, step: f64| {
            if step == 0.0 { f64::INFINITY } else { (if step > 0.0 { high - from } else { low - from }) / step }
        };
        let outer = to_side(x_min, x_max, centre[0], cos).min(to_side(y_min, y_max, centre[1], sin));
        [opening(angle), outer].map(|radius| [centre[0] + radius * cos, centre[1] + radius * sin])
    };
    for pair in angles.windows(2) {
        let ([inner_a, outer_a], [inner_b, outer_b]) = (rims(pair[0]), rims(pair[1]));
        let over = |[x, y]: [f64; 2], z: f64| [x, y, z];
        add_quad(triangles, [inner_a, outer_a, outer_b, inner_b].map(|rim| over(rim, height)));
        for [a, b] in [[inner_a, inner_b], [outer_a, outer_b]] {
            add_quad(triangles, [over(a, 0.0), over(b, 0.0), over(b, height), over(a, height)]);
        }
    }
}

pub fn add_ball(triangles: &mut Triangles, [x, y, z]: [f64; 3], radius: f64) {
    let at = |ring: usize, turn: usize| {
        let (sin, cos) = (PI * ring as f64 / N_SEGMENTS as f64).sin_cos();
        let (across, along) = (TAU * turn as f64 / N_SEGMENTS as f64).sin_cos();
        [x + radius * sin * along, y + radius * sin * across, z + radius * cos]
    };
    for ring in 0..N_SEGMENTS {
        for turn in 0..N_SEGMENTS {
            add_quad(triangles, [at(ring, turn), at(ring + 1, turn), at(ring + 1, turn + 1), at(ring, turn + 1)]);
        }
    }
}

/// A part of a circle as a profile, from one angle to another.
pub fn arc([across, z]: [f64; 2], radius: f64, [first_rad, last_rad]: [f64; 2]) -> Vec<[f64; 2]> {
    (0..=N_SEGMENTS)
        .map(|k| {
            let angle = first_rad + (last_rad - first_rad) * k as f64 / N_SEGMENTS as f64;
            [across + radius * angle.cos(), z + radius * angle.sin()]
        })
        .collect()
}
