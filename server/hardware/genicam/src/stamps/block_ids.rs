//! Conversion of the camera's own frame ids to a count from 0 without wrap-around.
//!
//! GigE Vision counts in 16 bits from 1 and skips 0; its extended ids and USB3 Vision count in 64 bits, the latter from
//! 0. Most cameras restart the count when an acquisition starts.

/// Largest id of 16 bits; 1 comes after it.
const MAX_16_BIT_ID: u64 = 0xFFFF;

/// Ids this close to the end of 16 bits wrap around at the next small one.
const WRAP_AROUND_START: u64 = MAX_16_BIT_ID - 4096;

/// Tracks the ids of one acquisition.
#[derive(Debug, Clone, Copy, Default)]
pub struct BlockIds {
    /// The last id, and its position in the count.
    last: Option<(u64, u64)>,
}

impl BlockIds {
    /// The position of a frame in the count; `first` is that of the first frame received.
    ///
    /// Returns `None` for a frame that is not newer than the previous one: a duplicate, or out of order.
    pub fn count(&mut self, id: u64, first: u64) -> Option<u64> {
        let count = match self.last {
            None => first,
            Some((last, count)) => count + steps(last, id)?,
        };
        self.last = Some((id, count));
        Some(count)
    }

    /// The position of the frame after the last one received.
    pub fn next(&self) -> Option<u64> {
        self.last.map(|(_, count)| count + 1)
    }
}

/// Distance of `id` from `last`, in frames.
fn steps(last: u64, id: u64) -> Option<u64> {
    if id > last {
        Some(id - last)
    } else if (WRAP_AROUND_START..=MAX_16_BIT_ID).contains(&last) && id < 4096 {
        // 65535 is followed by 1, or by 0 if a camera does not follow the standard.
        Some((MAX_16_BIT_ID - last + id).max(1))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(ids: &[u64]) -> Vec<Option<u64>> {
        let mut counting = BlockIds::default();
        ids.iter().map(|&id| counting.count(id, 0)).collect()
    }

    #[test]
    fn gaps_are_counted_and_the_first_frame_starts_the_count() {
        assert_eq!(counts(&[7, 8, 11]), [Some(0), Some(1), Some(4)]);
    }

    #[test]
    fn sixteen_bit_ids_wrap_around_without_zero() {
        assert_eq!(counts(&[65534, 65535, 1, 2]), [Some(0), Some(1), Some(2), Some(3)]);
        assert_eq!(counts(&[65534, 2]), [Some(0), Some(3)], "lost across the wrap-around");
        assert_eq!(counts(&[65535, 65536, 65537]), [Some(0), Some(1), Some(2)], "64 bits continue");
    }

    #[test]
    fn a_duplicate_frame_does_not_count() {
        assert_eq!(counts(&[3, 3, 2, 4]), [Some(0), None, None, Some(1)]);
    }
}
