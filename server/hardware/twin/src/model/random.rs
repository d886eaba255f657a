//! Random numbers that depend only on seed and index: the basis of bit-identical images.

use crate::params::QUANTILE_BITS;

/// Scrambles 64 bits (the finaliser of SplitMix64, Steele et al. 2014).
pub(crate) fn scrambled(bits: u64) -> u64 {
    let mut z = bits.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Seed of a stream within a stream: of a frame within a station, of a row within a frame.
pub(crate) fn derived_seed(seed: u64, stream: u64) -> u64 {
    scrambled(scrambled(seed) ^ stream.wrapping_mul(0xD6E8_FEB8_6659_FD93))
}

/// Quantiles of the standard normal distribution at the centres of 2^[`QUANTILE_BITS`] equal probabilities, scaled to
/// unit variance: a uniform index gives a normal number.
pub(crate) fn normal_quantiles() -> Vec<f32> {
    let n = 1_usize << QUANTILE_BITS;
    let raw: Vec<f64> = (0..n).map(|idx| normal_quantile((idx as f64 + 0.5) / n as f64)).collect();
    let scale = (raw.iter().map(|q| q * q).sum::<f64>() / n as f64).sqrt();
    raw.iter().map(|q| (q / scale) as f32).collect()
}

/// Inverse of the normal distribution function (Acklam's rational approximation, relative error 1.2e-9).
fn normal_quantile(p: f64) -> f64 {
    const A: [f64; 6] = [
        -3.969683028665376e1,
        2.209460984245205e2,
        -2.759285104469687e2,
        1.38357751867269e2,
        -3.066479806614716e1,
        2.506628277459239,
    ];
    const B: [f64; 5] = [
        -5.447609879822406e1,
        1.615858368580409e2,
        -1.556989798598866e2,
        6.680131188771972e1,
        -1.328068155288572e1,
    ];
    const C: [f64; 6] = [
        -7.784894002430293e-3,
        -3.223964580411365e-1,
        -2.400758277161838,
        -2.549732539343734,
        4.374664141464968,
        2.938163982698783,
    ];
    const D: [f64; 4] = [7.784695709041462e-3, 3.224671290700398e-1, 2.445134137142996, 3.754408661907416];
    const TAIL: f64 = 0.02425;
    let poly = |c: &[f64], x: f64| c.iter().fold(0.0, |sum, c| sum * x + c);
    if p > 0.5 {
        return -normal_quantile(1.0 - p);
    }
    if p < TAIL {
        let q = (-2.0 * p.ln()).sqrt();
        return poly(&C, q) / (poly(&D, q) * q + 1.0);
    }
    let q = p - 0.5;
    let r = q * q;
    q * poly(&A, r) / (poly(&B, r) * r + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_have_the_moments_of_the_normal_distribution() {
        let quantiles = normal_quantiles();
        let moment =
            |k: i32| quantiles.iter().map(|&q| f64::from(q).powi(k)).sum::<f64>() / quantiles.len() as f64;
        assert!(moment(1).abs() < 1e-6);
        assert!((moment(2) - 1.0).abs() < 1e-5);
        assert!((moment(4) - 3.0).abs() < 0.02); // the cut at 4 σ takes 0.5 % of the fourth moment
        assert!((normal_quantile(0.975) - 1.959_964).abs() < 1e-6);
    }

    #[test]
    fn neighbouring_seeds_give_different_streams() {
        let seeds: std::collections::HashSet<u64> =
            (0..100).flat_map(|seed| (0..100).map(move |stream| derived_seed(seed, stream))).collect();
        assert_eq!(seeds.len(), 10_000);
    }
}
