//! Pieces that wait to be asked, first come, first served: those that came together are the bits of one word.

/// Pieces of one word of a set.
pub const PER_WORD: usize = u64::BITS as usize;

/// Words that a set of pieces takes.
#[inline(always)]
pub fn n_words(n_pieces: usize) -> usize {
    n_pieces.div_ceil(PER_WORD)
}

/// Where a piece is in a set: its word, and its bit alone.
#[inline(always)]
pub fn bit(piece: usize) -> (usize, u64) {
    (piece / PER_WORD, 1 << (piece % PER_WORD))
}

/// The pieces of one word of a set, in their order.
#[inline(always)]
pub fn pieces_of(word: usize, mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let piece = (bits != 0).then(|| word * PER_WORD + bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        piece
    })
}

/// The queue. Who waits already is not queued again.
#[derive(Debug, Default)]
pub struct Waiting {
    /// Who waits.
    queued: Vec<u64>,
    /// Those that came together: word of the set, and its bits that have not been asked; those before `first` all have.
    came: Vec<(usize, u64)>,
    first: usize,
}

impl Waiting {
    /// Nobody waits; room for as many sets as may come.
    #[inline(always)]
    pub fn prepare(&mut self, n_pieces: usize, n_sets: usize) {
        self.queued.clear();
        self.queued.resize(n_words(n_pieces), 0);
        self.came.clear();
        self.came.reserve(n_sets * n_words(n_pieces));
        self.first = 0;
    }

    /// Queues the pieces of one word of a set, in their order.
    #[inline(always)]
    pub fn add(&mut self, word: usize, bits: u64) {
        self.came.push((word, bits & !self.queued[word]));
        self.queued[word] |= bits;
    }

    /// Who is next.
    #[inline(always)]
    pub fn next(&mut self) -> Option<usize> {
        loop {
            let (word, bits) = self.came.get_mut(self.first)?;
            if *bits != 0 {
                let bit = *bits & bits.wrapping_neg();
                *bits ^= bit;
                self.queued[*word] ^= bit;
                return Some(*word * PER_WORD + bit.trailing_zeros() as usize);
            }
            self.first += 1;
        }
    }

    /// Sends all away.
    #[inline(always)]
    pub fn forget(&mut self) {
        self.queued.fill(0);
        self.came.clear();
        self.first = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_came_first_is_next_and_waits_but_once() {
        let mut waiting = Waiting::default();
        waiting.prepare(70, 4);
        waiting.add(0, 0b1100);
        waiting.add(1, 0b10);
        waiting.add(0, 0b0110);
        assert_eq!(waiting.next(), Some(2));
        waiting.add(0, 0b0100);
        let rest: Vec<usize> = std::iter::from_fn(|| waiting.next()).collect();
        assert_eq!(rest, [3, 65, 1, 2]);
        assert!(waiting.queued.iter().all(|word| *word == 0));
    }

    #[test]
    fn pieces_of_a_word_come_in_their_order() {
        assert_eq!(pieces_of(1, 1 << 63 | 0b101).collect::<Vec<_>>(), [64, 66, 127]);
        assert_eq!(bit(66), (1, 0b100));
    }
}
