//! The crossings of an image as a structure of arrays, so that many columns are computed at a time.

use std::ops::Range;

use super::window::LANES as COLUMNS;
use crate::centreline::fast::lanes::{LANES, Numbers};
use crate::centreline::lines::crossing::{Crossing, Line};
use crate::centreline::lines::ends::without_faded_ends;
use crate::centreline::lines::scatter::{LANES as SAMPLE_LANES, ThirdDifferences};
use crate::params::{MIN_SEGMENT_COLUMNS, WIDTH_NEIGHBOURS};

/// Full width at half height of a Gaussian over its area by its height: 2 √(2 ln 2) / √(2π).
pub const WIDTH_PER_AREA: f32 = 0.939_437;

/// Measured steps of all traces, one after the other; `found` is false where no centre was found.
#[derive(Default)]
pub struct Crossings {
    /// Number of crossings; the arrays may be longer.
    n: usize,
    /// Whether a centre was found.
    pub found: Vec<bool>,
    /// Row.
    pub v: Vec<f64>,
    /// Variance from camera noise, px².
    pub camera_variance: Vec<f32>,
    /// Variance per unit of squared speckle contrast times speckle grain, px².
    pub speckle_variance: Vec<f32>,
    /// Grey levels above the background.
    pub intensity: Vec<f32>,
    /// Grey levels times rows above the background.
    pub area: Vec<f32>,
    /// Full width at half height along the column.
    pub width_px: Vec<f32>,
    /// Whether pixels near the centre are at full scale.
    pub saturated: Vec<bool>,
    /// Area and height of one trace, padded with neighbours beyond its ends.
    padded: [Vec<f32>; 2],
}

/// Columns measured together.
pub struct Measured {
    /// Whether a centre was found.
    pub found: [bool; COLUMNS],
    /// Row.
    pub v: [f64; COLUMNS],
    /// Variance from camera noise, px².
    pub camera_variance: [f32; COLUMNS],
    /// Variance per unit of squared speckle contrast times speckle grain, px².
    pub speckle_variance: [f32; COLUMNS],
    /// Grey levels above the background; 0 where nothing was found.
    pub intensity: [f32; COLUMNS],
    /// Grey levels times rows above the background; 0 where nothing was found.
    pub area: [f32; COLUMNS],
    /// Whether pixels near the centre are at full scale.
    pub saturated: [bool; COLUMNS],
}

/// Consecutive columns of one line, as a range of crossings.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Image column of the first.
    pub first_u: usize,
    /// Indices of the crossings.
    pub places: Range<usize>,
}

/// A piece with the crossings it refers to.
#[derive(Clone, Copy)]
pub struct PieceOf<'a> {
    /// All crossings.
    pub crossings: &'a Crossings,
    /// The piece.
    pub piece: &'a Piece,
}

impl Line for PieceOf<'_> {
    #[inline(always)]
    fn n_columns(&self) -> usize {
        self.piece.places.len()
    }

    #[inline(always)]
    fn at(&self, idx: usize) -> Crossing {
        let (all, place) = (self.crossings, self.piece.places.start + idx);
        Crossing {
            v: all.v[place],
            camera_variance: f64::from(all.camera_variance[place]),
            speckle_variance: f64::from(all.speckle_variance[place]),
            intensity: all.intensity[place],
            width_px: all.width_px[place],
        }
    }

    #[inline(always)]
    fn third_differences(&self, start: usize, lag: usize) -> ThirdDifferences {
        let all = self.crossings;
        let from = |k: usize| self.piece.places.start + start + k * lag;
        let rows: [&[f64; SAMPLE_LANES]; 4] = std::array::from_fn(|k| first_of(&all.v[from(k)..]));
        let cameras: [&[f32; SAMPLE_LANES]; 4] =
            std::array::from_fn(|k| first_of(&all.camera_variance[from(k)..]));
        let speckles: [&[f32; SAMPLE_LANES]; 4] =
            std::array::from_fn(|k| first_of(&all.speckle_variance[from(k)..]));
        let mut differences = ThirdDifferences::default();
        for i in 0..SAMPLE_LANES {
            let difference = ((rows[3][i] - rows[0][i]) - 3.0 * (rows[2][i] - rows[1][i])) as f32;
            differences.square[i] = difference * difference;
            differences.camera[i] = (cameras[0][i] + cameras[3][i]) + 9.0 * (cameras[1][i] + cameras[2][i]);
            differences.speckle[i] = (speckles[0][i] + speckles[3][i]) + 9.0 * (speckles[1][i] + speckles[2][i]);
        }
        differences
    }
}

#[inline(always)]
fn first_of<T>(slice: &[T]) -> &[T; SAMPLE_LANES] {
    slice.first_chunk().expect("the caller asks for places inside of the piece")
}

impl Crossings {
    /// Removes all crossings and keeps the memory.
    pub fn clear(&mut self) {
        self.n = 0;
    }

    /// Appends `n` crossings, none of them found yet, and returns the index of the first.
    pub fn extend(&mut self, n: usize) -> usize {
        let start = self.n;
        self.n += n;
        if self.found.len() < self.n {
            self.grow();
        }
        self.found[start..self.n].fill(false);
        self.intensity[start..self.n].fill(0.0);
        self.area[start..self.n].fill(0.0);
        start
    }

    fn grow(&mut self) {
        let n = self.n;
        self.found.resize(n, false);
        self.v.resize(n, 0.0);
        self.saturated.resize(n, false);
        let numbers = [
            &mut self.camera_variance,
            &mut self.speckle_variance,
            &mut self.intensity,
            &mut self.area,
            &mut self.width_px,
        ];
        numbers.into_iter().for_each(|number| number.resize(n, 0.0));
    }

    /// Stores consecutive columns from `place` on.
    #[inline(always)]
    pub fn put(&mut self, place: usize, measured: &Measured) {
        let places = place..place + COLUMNS;
        self.found[places.clone()].copy_from_slice(&measured.found);
        self.v[places.clone()].copy_from_slice(&measured.v);
        self.camera_variance[places.clone()].copy_from_slice(&measured.camera_variance);
        self.speckle_variance[places.clone()].copy_from_slice(&measured.speckle_variance);
        self.intensity[places.clone()].copy_from_slice(&measured.intensity);
        self.area[places.clone()].copy_from_slice(&measured.area);
        self.saturated[places].copy_from_slice(&measured.saturated);
    }

    /// Stores the column measured in lane `i`.
    #[inline(always)]
    pub fn put_one(&mut self, place: usize, measured: &Measured, i: usize) {
        self.found[place] = measured.found[i];
        self.v[place] = measured.v[i];
        self.camera_variance[place] = measured.camera_variance[i];
        self.speckle_variance[place] = measured.speckle_variance[i];
        self.intensity[place] = measured.intensity[i];
        self.area[place] = measured.area[i];
        self.saturated[place] = measured.saturated[i];
    }

    /// Sets the width of every crossing of one trace, from `start` on: area over height, both summed over its
    /// neighbourhood.
    #[inline(always)]
    pub fn widen(&mut self, start: usize) {
        let n = self.n - start;
        for (padded, numbers) in self.padded.iter_mut().zip([&self.area, &self.intensity]) {
            padded.clear();
            padded.resize(WIDTH_NEIGHBOURS, 0.0);
            padded.extend_from_slice(&numbers[start..self.n]);
            padded.resize(n + 2 * WIDTH_NEIGHBOURS + LANES, 0.0);
        }
        let [areas, heights] = &self.padded;
        let widths = &mut self.width_px[start..][..n];
        for (block, widths) in widths.chunks_mut(LANES).enumerate() {
            let (area, height) = (sum_near(&areas[block * LANES..]), sum_near(&heights[block * LANES..]));
            let mut width_px = [0.0; LANES];
            for i in 0..LANES {
                width_px[i] = (WIDTH_PER_AREA * area.0[i] / height.0[i].max(f32::MIN_POSITIVE)).max(0.5);
            }
            widths.copy_from_slice(&width_px[..widths.len()]);
        }
    }

    /// Splits the trace that begins at `start` where the line is missing, and trims its blurred ends.
    #[inline(always)]
    pub fn cut(&self, first_u: usize, start: usize, pieces: &mut Vec<Piece>) {
        let mut rest = start..self.n;
        while !rest.is_empty() {
            let of_rest = &self.found[rest.clone()];
            let n_missing = of_rest.iter().take_while(|&&found| !found).count();
            let n_found = of_rest[n_missing..].iter().take_while(|&&found| found).count();
            let begin = rest.start + n_missing;
            rest.start = begin + n_found;
            let whole = Piece { first_u: first_u + begin - start, places: begin..begin + n_found };
            let kept = without_faded_ends(&PieceOf { crossings: self, piece: &whole });
            if kept.len() >= MIN_SEGMENT_COLUMNS {
                let places = begin + kept.start..begin + kept.end;
                pieces.push(Piece { first_u: whole.first_u + kept.start, places });
            }
        }
    }
}

/// Sums over each number and its neighbours; the first number's first neighbour is at the beginning of `padded`.
#[inline(always)]
fn sum_near(padded: &[f32]) -> Numbers {
    let mut sum = Numbers::of(padded);
    for k in 1..=2 * WIDTH_NEIGHBOURS {
        sum = sum + Numbers::of(&padded[k..]);
    }
    sum
}
