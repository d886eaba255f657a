//! Parallel loops that use other threads only if there is enough work: a frame of the live view is labelled in the
//! calling thread, without waiting for threads that compute a scan.

use rayon::prelude::*;

/// Runs `work` on the numbers below `n` and returns the results in order; in the calling thread if there are not more
/// than `least`. Each thread works on its own `state`.
pub fn map_with<S, T: Send>(
    n: usize,
    least: usize,
    state: impl Fn() -> S + Sync + Send,
    work: impl Fn(&mut S, usize) -> T + Sync + Send,
) -> Vec<T> {
    if n <= least {
        let mut state = state();
        return (0..n).map(|idx| work(&mut state, idx)).collect();
    }
    (0..n).into_par_iter().with_min_len(least).map_init(state, work).collect()
}

/// Runs `work` on the values, `len` at once; in the calling thread if that is not more than `least` times.
pub fn for_each_chunk<T: Send>(
    values: &mut [T],
    len: usize,
    least: usize,
    work: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    if values.len() <= least * len {
        values.chunks_mut(len).enumerate().for_each(|(idx, chunk)| work(idx, chunk));
    } else {
        values.par_chunks_mut(len).with_min_len(least).enumerate().for_each(|(idx, chunk)| work(idx, chunk));
    }
}
