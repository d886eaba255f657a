//! Work on many things by all threads, where there is enough of it to be worth waking another: a frame of the live view is
//! labelled where it was taken, without waiting for threads that compute a scan.

use rayon::prelude::*;

/// `work` on the numbers below `n`, the results in order; by one thread if they are not more than `least`. Each thread works
/// on a `state` of its own.
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

/// `work` on the values, `len` at once; by one thread if that is not more than `least` times.
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
