//! The fast search: the lattice of a clearly visible chessboard, ten times as fast as the exhaustive search.
//!
//! A crossing of two edges appears on a ring around it as bright, dark, bright, dark, with opposite positions alike
//! (the ChESS response of Bennett & Lasenby 2014, here in integers on the image at half size). The four transitions on
//! the ring are the directions of the edges; crossings that point at each other along an edge, with bright and dark on
//! the matching sides, are neighbours. The result is a seed like any other: each of its corners is verified afterwards.

use std::collections::BTreeMap;

use multiversion::multiversion;

use super::detect::Seed;
use super::lattice::Node;
use crate::corners::params::{
    FAST_MAX_PEAKS, FAST_MIN_RESPONSE, FAST_MIN_RESPONSE_FRACTION, FAST_POINTING_BACK_COSINE, FAST_POINTING_COSINE,
};
use crate::{GreyImage, Pixels};

/// The ring, anticlockwise in (u, right-handed with v up); position n + 8 is opposite to position n.
const RING: [(isize, isize); 16] = [
    (5, 0),
    (5, 2),
    (4, 4),
    (2, 5),
    (0, 5),
    (-2, 5),
    (-4, 4),
    (-5, 2),
    (-5, 0),
    (-5, -2),
    (-4, -4),
    (-2, -5),
    (0, -5),
    (2, -5),
    (4, -4),
    (5, -2),
];

/// Width of the image border without a response, and radius around a peak without another peak.
const RIM: usize = 5;
const APART: usize = 2;

/// The image at half size: sums of two by two pixels, 0–1020.
struct Half {
    width: usize,
    height: usize,
    levels: Vec<i16>,
}

/// A crossing of two edges.
struct Peak {
    /// Position in the half-size image.
    at: [f32; 2],
    rays: [Ray; 4],
}

/// One of the four half-edges that leave a crossing.
#[derive(Clone, Copy, Default)]
struct Ray {
    direction: [f32; 2],
    /// Whether the side towards the next ray is bright.
    bright_ahead: bool,
}

/// The largest lattice of crossings, or an empty one.
pub fn fast_seed(image: &GreyImage) -> Seed {
    let half = halved(image);
    let peaks = peaks(&half);
    let links: Vec<[Option<(usize, usize)>; 4]> =
        (0..peaks.len()).map(|a| [0, 1, 2, 3].map(|k| neighbour(&peaks, a, k))).collect();
    let mut seen = vec![false; peaks.len()];
    let mut largest: BTreeMap<Node, usize> = BTreeMap::new();
    for first in 0..peaks.len() {
        if !seen[first] {
            let lattice = connected(&links, first, &mut seen);
            if lattice.len() > largest.len() {
                largest = lattice;
            }
        }
    }
    let place = |peak: usize| peaks[peak].at.map(|x| 2.0 * f64::from(x) + 0.5);
    largest.into_iter().map(|(node, peak)| (node, place(peak))).collect()
}

fn halved(image: &GreyImage) -> Half {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mut levels = vec![0; width * height];
    match image.pixels() {
        Pixels::Eight(pixels) => halve_eight(pixels, image.width(), width, &mut levels),
        Pixels::Sixteen(pixels) => {
            // Drops the low bits beyond the eight highest used ones.
            let bits = u16::BITS - pixels.iter().fold(0, |all, &level| all | level).leading_zeros();
            halve_sixteen(pixels, image.width(), width, bits.saturating_sub(8), &mut levels);
        }
    }
    Half { width, height, levels }
}

#[multiversion(targets("x86_64+avx2"))]
fn halve_eight(pixels: &[u8], full_width: usize, width: usize, target: &mut [i16]) {
    if width == 0 {
        return;
    }
    for (rows, target) in pixels.chunks_exact(2 * full_width).zip(target.chunks_exact_mut(width)) {
        let (above, below) = rows.split_at(full_width);
        let pairs = above.as_chunks::<2>().0.iter().zip(below.as_chunks::<2>().0);
        for (target, (a, b)) in target.iter_mut().zip(pairs) {
            *target = i16::from(a[0]) + i16::from(a[1]) + i16::from(b[0]) + i16::from(b[1]);
        }
    }
}

fn halve_sixteen(pixels: &[u16], full_width: usize, width: usize, drop_bits: u32, target: &mut [i16]) {
    if width == 0 {
        return;
    }
    for (rows, target) in pixels.chunks_exact(2 * full_width).zip(target.chunks_exact_mut(width)) {
        let (above, below) = rows.split_at(full_width);
        let pairs = above.as_chunks::<2>().0.iter().zip(below.as_chunks::<2>().0);
        for (target, (a, b)) in target.iter_mut().zip(pairs) {
            let sum = u32::from(a[0]) + u32::from(a[1]) + u32::from(b[0]) + u32::from(b[1]);
            *target = (sum >> drop_bits) as i16;
        }
    }
}

/// Crossings, strongest first.
fn peaks(half: &Half) -> Vec<Peak> {
    let (w, h) = (half.width, half.height);
    if w <= 2 * (RIM + APART) || h <= 2 * (RIM + APART) {
        return Vec::new();
    }
    let mut responses = vec![0; w * h];
    for v in RIM..h - RIM {
        let ring = RING.map(|(du, dv)| row_from(half, v, RIM, du, dv));
        let cross = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(du, dv)| row_from(half, v, RIM, du, dv));
        response_row(&ring, &cross, &mut responses[v * w + RIM..(v + 1) * w - RIM]);
    }
    let strongest = responses.iter().copied().fold(0, i16::max);
    let least = FAST_MIN_RESPONSE.max((FAST_MIN_RESPONSE_FRACTION * f32::from(strongest)) as i16);
    let mut found: Vec<(i16, usize)> = Vec::new();
    for v in RIM + APART..h - RIM - APART {
        let row = &responses[v * w..(v + 1) * w];
        for (chunk_idx, chunk) in row.chunks(16).enumerate() {
            if chunk.iter().fold(0, |most, &r| i16::max(most, r)) < least {
                continue;
            }
            for (offset, &response) in chunk.iter().enumerate() {
                let u = 16 * chunk_idx + offset;
                if response >= least && u >= RIM + APART && u < w - RIM - APART && is_peak(&responses, w, u, v) {
                    found.push((response, v * w + u));
                }
            }
        }
    }
    found.sort_unstable_by_key(|&(response, place)| (std::cmp::Reverse(response), place));
    found.truncate(FAST_MAX_PEAKS);
    found.iter().filter_map(|&(_, place)| peak_at(half, &responses, place % w, place / w)).collect()
}

/// The half-size image's row `v` + `dv` from column `from` + `du` on.
fn row_from(half: &Half, v: usize, from: usize, du: isize, dv: isize) -> &[i16] {
    let start = (v.strict_add_signed(dv) * half.width + from).strict_add_signed(du);
    &half.levels[start..start + half.width - 2 * from]
}

/// Sum of the alternation, minus the asymmetry of opposite positions, minus the difference between ring and centre.
#[multiversion(targets("x86_64+avx2"))]
fn response_row(ring: &[&[i16]; 16], cross: &[&[i16]; 4], target: &mut [i16]) {
    let n = target.len();
    let ring = ring.map(|row| &row[..n]);
    let cross = cross.map(|row| &row[..n]);
    for k in 0..n {
        let mut alternation = 0i16;
        let mut unlike = 0i16;
        let mut sum = 0i16;
        for place in 0..4 {
            let (a, b) = (ring[place][k], ring[place + 8][k]);
            let (c, d) = (ring[place + 4][k], ring[place + 12][k]);
            alternation += (a + b - c - d).abs();
            unlike += (a - b).abs() + (c - d).abs();
            sum += a + b + c + d;
        }
        let middle = cross[0][k] + cross[1][k] + cross[2][k] + cross[3][k];
        target[k] = alternation - unlike - (sum - 4 * middle).abs();
    }
}

fn is_peak(responses: &[i16], width: usize, u: usize, v: usize) -> bool {
    let here = responses[v * width + u];
    (v - APART..=v + APART).all(|y| {
        (u - APART..=u + APART).all(|x| {
            let other = responses[y * width + x];
            other < here || (other == here && (y, x) >= (v, u))
        })
    })
}

/// The crossing at a peak, if the ring has four transitions and the edges are straight.
fn peak_at(half: &Half, responses: &[i16], u: usize, v: usize) -> Option<Peak> {
    let at = |du: isize, dv: isize| v.strict_add_signed(dv) * half.width + u.strict_add_signed(du);
    let ring = RING.map(|(du, dv)| f32::from(half.levels[at(du, dv)]));
    let mean = ring.iter().sum::<f32>() / 16.0;
    let mut rays = [Ray::default(); 4];
    let mut n_rays = 0;
    for n in 0..16 {
        let (a, b) = (ring[n] - mean, ring[(n + 1) % 16] - mean);
        if (a > 0.0) == (b > 0.0) {
            continue;
        }
        if n_rays == 4 {
            return None;
        }
        let share = a / (a - b);
        let [from, to] = [RING[n], RING[(n + 1) % 16]].map(|(du, dv)| [du as f32, dv as f32]);
        let place = [0, 1].map(|k| from[k] + share * (to[k] - from[k]));
        let length = place[0].hypot(place[1]);
        rays[n_rays] = Ray { direction: place.map(|p| p / length), bright_ahead: b > 0.0 };
        n_rays += 1;
    }
    let straight = |k: usize| dot(rays[k].direction, rays[k + 2].direction) < -FAST_POINTING_BACK_COSINE;
    if n_rays < 4 || !straight(0) || !straight(1) {
        return None;
    }
    let response = |du: isize, dv: isize| f32::from(responses[at(du, dv)]);
    let top = |before: f32, here: f32, after: f32| {
        (0.5 * (before - after) / (before - 2.0 * here + after).min(-1.0)).clamp(-0.5, 0.5)
    };
    let here = response(0, 0);
    let place = [
        u as f32 + top(response(-1, 0), here, response(1, 0)),
        v as f32 + top(response(0, -1), here, response(0, 1)),
    ];
    Some(Peak { at: place, rays })
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// The nearest crossing in the direction of ray `k` of crossing `a` that points back, and its ray.
fn neighbour(peaks: &[Peak], a: usize, k: usize) -> Option<(usize, usize)> {
    let (from, ray) = (&peaks[a], peaks[a].rays[k]);
    let mut nearest = None;
    let mut nearest_distance = f32::INFINITY;
    for (b, to) in peaks.iter().enumerate() {
        let step = [to.at[0] - from.at[0], to.at[1] - from.at[1]];
        let along = dot(step, ray.direction);
        // A distance is at least its component along the ray: this rejects most candidates.
        if along <= 0.0 || along >= nearest_distance {
            continue;
        }
        let distance = step[0].hypot(step[1]);
        if distance >= nearest_distance || along < FAST_POINTING_COSINE * distance {
            continue;
        }
        let points_back = |other: &Ray| {
            dot(other.direction, step) < -FAST_POINTING_COSINE * distance && other.bright_ahead != ray.bright_ahead
        };
        if let Some(back) = to.rays.iter().position(points_back) {
            (nearest, nearest_distance) = (Some((b, back)), distance);
        }
    }
    nearest
}

/// All crossings linked with `first`, by lattice index; links count where both ends agree.
fn connected(links: &[[Option<(usize, usize)>; 4]], first: usize, seen: &mut [bool]) -> BTreeMap<Node, usize> {
    const STEPS: [Node; 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
    let mut lattice = BTreeMap::from([((0, 0), first)]);
    // Node, crossing, and which of its rays runs along (1, 0).
    let mut open = vec![((0, 0), first, 0)];
    seen[first] = true;
    while let Some((node, a, turn)) = open.pop() {
        for k in 0..4 {
            let Some((b, back)) = links[a][k].filter(|&(b, back)| links[b][back] == Some((a, k))) else {
                continue;
            };
            let side = (k + 4 - turn) % 4;
            let next = (node.0 + STEPS[side].0, node.1 + STEPS[side].1);
            if seen[b] || lattice.contains_key(&next) {
                continue;
            }
            seen[b] = true;
            lattice.insert(next, b);
            open.push((next, b, (back + 4 - (side + 2) % 4) % 4));
        }
    }
    lattice
}
