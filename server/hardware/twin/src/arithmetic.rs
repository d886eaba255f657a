//! Arithmetic in plain loops over arrays, which the compiler vectorises, with the same bits for any instruction set.

/// Added and subtracted, it rounds to whole numbers: 1.5 · 2⁵².
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// ln 2 in two parts; whole multiples of the first up to 2¹⁰ are exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];

/// Below, the exponential is practically zero and its bits would leave their range.
const LEAST_EXPONENT: f64 = -700.0;

/// Largest whole number that is not above `x`, for |x| < 2⁵¹.
#[inline(always)]
pub(crate) fn floor(x: f64) -> f64 {
    let nearest = (x + ROUNDER) - ROUNDER;
    if nearest > x { nearest - 1.0 } else { nearest }
}

/// Smallest whole number that is not below `x`, for |x| < 2⁵¹.
#[inline(always)]
pub(crate) fn ceil(x: f64) -> f64 {
    -floor(-x)
}

/// The exponential of a number up to 700, to two units in the last place: a multiple of ln 2 gives the exponent, a
/// Taylor polynomial the rest. Unlike the system's it is the same on every machine.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    /// 1/k! from the highest power that is significant below (ln 2)/2 down to the constant.
    const TAYLOR: [f64; 14] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let x = if x < LEAST_EXPONENT { LEAST_EXPONENT } else { x };
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let whole = shifted - ROUNDER;
    let rest = (x - whole * LN_2[0]) - whole * LN_2[1];
    let mut power = TAYLOR[0];
    for term in &TAYLOR[1..] {
        power = power * rest + term;
    }
    power * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_agrees_with_the_system_s() {
        for idx in -69_000..1000 {
            let x = f64::from(idx) * 0.010_01;
            let error = exp(x) / x.exp() - 1.0;
            assert!(error.abs() < 5e-16, "{x}: {error}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert!(exp(-1e9) > 0.0 && exp(-1e9) < 1e-300);
        assert!(exp(f64::NAN).is_nan());
    }

    #[test]
    fn floor_rounds_down_and_ceil_up() {
        for x in [-2.0, -1.5, -1.0, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.5, 1e6 + 0.75] {
            assert_eq!(floor(x), x.floor());
            assert_eq!(ceil(x), x.ceil());
        }
    }
}
