//! Spread of absolute differences in a tile: a robust standard deviation.

/// Root mean square of a unit Gaussian truncated at 3 · 0.6745 σ.
const CUT_RMS: f32 = 0.884;

/// Differences per row of a tile.
pub const COLUMNS: usize = crate::params::NOISE_COLUMNS;

/// Relative precision of a median, as its reciprocal: a limit larger by this makes the spread of a Gaussian 1.4 %
/// larger, far less than the variation of one tile.
const MEDIAN_PART: i32 = 32;

/// Rows whose differences can be counted in 8 bits.
const ROWS_COUNTED: usize = 8;

/// An absolute difference, as an integer.
pub trait Difference: Copy + Default + Send + Sync {
    /// The largest possible difference.
    const MAX: i32;
    /// The difference of this size, not negative and at most [`Self::MAX`].
    fn of(int: i32) -> Self;
    /// The difference as an integer.
    fn int(self) -> i32;
    /// One if the difference is larger than `limit`, otherwise zero.
    fn beyond(self, limit: Self) -> Self;
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Sum of the squares of the differences up to `limit`.
    fn squares_up_to(tile: &[[Self; COLUMNS]], limit: Self) -> f32;
}

macro_rules! difference {
    ($whole:ty) => {
        impl Difference for $whole {
            const MAX: i32 = <$whole>::MAX as i32;
            #[inline(always)]
            fn of(int: i32) -> Self {
                int as Self
            }
            #[inline(always)]
            fn int(self) -> i32 {
                self as i32
            }
            #[inline(always)]
            fn beyond(self, limit: Self) -> Self {
                self.saturating_sub(limit).min(1)
            }
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                self + other
            }
            #[inline(always)]
            fn squares_up_to(tile: &[[Self; COLUMNS]], limit: Self) -> f32 {
                let mut sums = [0.0f32; COLUMNS];
                for row in tile {
                    for i in 0..COLUMNS {
                        // All bits set where the difference counts, none where it does not.
                        let d = row[i] & row[i].beyond(limit).wrapping_sub(1);
                        sums[i] += d as f32 * d as f32;
                    }
                }
                sums.iter().sum()
            }
        }
    };
}

difference!(u8);
difference!(u16);

/// Number of differences in a tile up to `limit`.
#[inline(always)]
fn n_up_to<D: Difference>(tile: &[[D; COLUMNS]], limit: D) -> usize {
    let mut n_beyond = 0;
    for rows in tile.chunks(ROWS_COUNTED) {
        let mut n = D::default();
        for &difference in rows.as_flattened() {
            n = n.add(difference.beyond(limit));
        }
        n_beyond += n.int() as usize;
    }
    tile.len() * COLUMNS - n_beyond
}

/// Standard deviation of absolute differences: the root mean square of those below three times the median (2.02 σ for a
/// Gaussian), which a line in the tile hardly affects. `median` is the initial guess, carried from tile to tile because
/// neighbouring tiles are similar.
#[inline(always)]
pub fn sigma_of<D: Difference>(tile: &[[D; COLUMNS]], median: &mut D) -> f32 {
    if tile.is_empty() {
        return 0.0;
    }
    *median = median_of(tile, *median);
    let cut = D::of(median.int().saturating_mul(3).clamp(3, D::MAX));
    (D::squares_up_to(tile, cut) / (n_up_to(tile, cut) as f32).max(1.0)).sqrt() / CUT_RMS
}

/// The median by counting, or a value above it by less than one [`MEDIAN_PART`]th: steps that double from a guess, then
/// bisection.
#[inline(always)]
fn median_of<D: Difference>(tile: &[[D; COLUMNS]], guess: D) -> D {
    let rank = tile.len() * COLUMNS / 2;
    let near = (guess.int() / MEDIAN_PART).max(1);
    let (mut low, mut high, mut step) = (guess.int(), guess.int(), near);
    // Invariant: more than `rank` differences are at most `high`, and no more than `rank` are at most `low`.
    if n_up_to(tile, guess) > rank {
        low = (low - near).max(-1);
        while low >= 0 && n_up_to(tile, D::of(low)) > rank {
            (high, step) = (low, 2 * step);
            low = (high - step).max(-1);
        }
    } else {
        high = (high + near).min(D::MAX);
        while high < D::MAX && n_up_to(tile, D::of(high)) <= rank {
            (low, step) = (high, 2 * step);
            high = low.saturating_add(step).min(D::MAX);
        }
    }
    while high - low > (low / MEDIAN_PART).max(1) {
        let middle = low + (high - low) / 2;
        if n_up_to(tile, D::of(middle)) > rank { high = middle } else { low = middle }
    }
    D::of(high)
}
