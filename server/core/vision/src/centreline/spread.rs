//! How far absolute differences spread in a tile: a robust standard deviation.

/// Root mean square of a unit Gaussian cut at 3 · 0.6745 σ.
const CUT_RMS: f32 = 0.884;

/// Differences side by side in a row of a tile.
pub const COLUMNS: usize = crate::params::NOISE_COLUMNS;

/// Part of itself to which a median is looked for: a cut that is larger by as much makes the spread of a Gaussian 1.4 %
/// larger, far less than one tile would set it.
const MEDIAN_PART: i32 = 32;

/// Rows whose differences 8 bits can count.
const ROWS_COUNTED: usize = 8;

/// An absolute difference, whole.
pub trait Difference: Copy + Default + Send + Sync {
    /// No difference is larger.
    const MOST: i32;
    /// The difference of this size, not negative and at most [`Self::MOST`].
    fn of(int: i32) -> Self;
    /// The difference as an integer.
    fn int(self) -> i32;
    /// One if the difference is larger than `limit`, otherwise nothing.
    fn beyond(self, limit: Self) -> Self;
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// The sum of the squares of those that are at most `limit`.
    fn squares_up_to(tile: &[[Self; COLUMNS]], limit: Self) -> f32;
}

macro_rules! difference {
    ($whole:ty) => {
        impl Difference for $whole {
            const MOST: i32 = <$whole>::MAX as i32;
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
                        // All bits where the difference counts, none where it does not.
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

/// How many of a tile are at most `limit`.
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

/// Standard deviation of absolute differences: the root mean square of those below three times the median (at 2.02 σ for
/// a Gaussian), which a line in the tile hardly touches. `median` goes from tile to tile, for they are much alike.
#[inline(always)]
pub fn sigma_of<D: Difference>(tile: &[[D; COLUMNS]], median: &mut D) -> f32 {
    if tile.is_empty() {
        return 0.0;
    }
    *median = median_of(tile, *median);
    let cut = D::of(median.int().saturating_mul(3).clamp(3, D::MOST));
    (D::squares_up_to(tile, cut) / (n_up_to(tile, cut) as f32).max(1.0)).sqrt() / CUT_RMS
}

/// The median by counting, or what exceeds it by less than one [`MEDIAN_PART`]th: from a guess in steps that double, then
/// halving.
#[inline(always)]
fn median_of<D: Difference>(tile: &[[D; COLUMNS]], guess: D) -> D {
    let rank = tile.len() * COLUMNS / 2;
    let near = (guess.int() / MEDIAN_PART).max(1);
    let (mut low, mut high, mut step) = (guess.int(), guess.int(), near);
    // More than `rank` are at most `high`, no more than `rank` at most `low`.
    if n_up_to(tile, guess) > rank {
        low = (low - near).max(-1);
        while low >= 0 && n_up_to(tile, D::of(low)) > rank {
            (high, step) = (low, 2 * step);
            low = (high - step).max(-1);
        }
    } else {
        high = (high + near).min(D::MOST);
        while high < D::MOST && n_up_to(tile, D::of(high)) <= rank {
            (low, step) = (high, 2 * step);
            high = low.saturating_add(step).min(D::MOST);
        }
    }
    while high - low > (low / MEDIAN_PART).max(1) {
        let middle = low + (high - low) / 2;
        if n_up_to(tile, D::of(middle)) > rank { high = middle } else { low = middle }
    }
    D::of(high)
}
