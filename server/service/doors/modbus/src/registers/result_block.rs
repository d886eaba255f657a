//! A result as registers.

use app::doors::{CharacteristicMessage, InspectionMessage};

use crate::registers::map::{
    CHARACTERISTIC_WORDS, INPUT_WORDS, MAX_CHARACTERISTICS, N_CHARACTERISTICS, RECIPE_NUMBER, RECIPE_VERSION,
    RESULT_SEQ, SERIAL, TIME_US, UNCERTAINTY, VALUE, VALUE_F32, VALUE_VERDICT, VERDICT,
};
use crate::registers::value::Value;

/// Steps of the integer values per unit.
const STEPS_PER_UNIT: f64 = 1e4;

/// An integer value that is invalid.
const INVALID: i32 = i32::MIN;

/// An uncertainty that is unknown or too large.
const UNKNOWN: u16 = u16::MAX;

/// The part of a rounded-up uncertainty that is a rounding error of its decimal fraction.
const ROUNDING: f64 = 1e-6;

/// An image of the input registers with one result in it, and everything else 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultBlock {
    /// Its number; never 0.
    pub seq: u16,
    /// Whether its devices were simulated.
    pub simulated: bool,
    /// The registers.
    pub image: Vec<u16>,
}

impl ResultBlock {
    /// The result of an inspection.
    pub fn of(inspection: &InspectionMessage) -> Self {
        let mut image = no_result();
        let seq = result_seq(inspection.seq);
        let n = u16::try_from(inspection.results.len()).unwrap_or(u16::MAX);
        let version = u16::try_from(inspection.recipe.version).unwrap_or(u16::MAX);
        let time_us = u64::try_from(inspection.inspected_at_ms).unwrap_or(0).saturating_mul(1000);
        VERDICT.put(&mut image, Value::U16(verdict_number(&inspection.verdict)));
        N_CHARACTERISTICS.put(&mut image, Value::U16(n));
        RECIPE_VERSION.put(&mut image, Value::U16(version));
        RECIPE_NUMBER.put(&mut image, Value::U32(inspection.recipe.number.unwrap_or(0)));
        SERIAL.put(&mut image, Value::Text(&inspection.serial));
        TIME_US.put(&mut image, Value::U64(time_us));
        for (idx, one) in inspection.results.iter().take(MAX_CHARACTERISTICS).enumerate() {
            put_characteristic(&mut image, idx, one);
        }
        RESULT_SEQ.put(&mut image, Value::U16(seq));
        Self { seq, simulated: inspection.simulated, image }
    }
}

/// The image before the first result: every value is invalid.
pub fn no_result() -> Vec<u16> {
    let mut image = vec![0; INPUT_WORDS];
    for idx in 0..MAX_CHARACTERISTICS {
        put_value(&mut image, idx, None, None);
    }
    image
}

/// The number of a result: never 0, and the same after a restart.
pub fn result_seq(inspection_seq: i64) -> u16 {
    let position = (inspection_seq - 1).rem_euclid(i64::from(u16::MAX));
    u16::try_from(position + 1).unwrap_or(u16::MAX)
}

fn put_characteristic(image: &mut [u16], idx: usize, one: &CharacteristicMessage) {
    let verdict = one.verdict.as_deref().map_or(0, verdict_number);
    // A PLC that looks at the value alone must not use one that is invalid.
    let value = one.value.filter(|_| one.verdict.as_deref() != Some("invalid"));
    put_value(image, idx, value, one.expanded_uncertainty);
    VALUE_VERDICT.put_nth(image, idx, Value::U16(verdict));
}

fn put_value(image: &mut [u16], idx: usize, value: Option<f64>, uncertainty: Option<f64>) {
    let value_f32 = value.map_or(f32::NAN, |value| value as f32);
    let value_f32 = if value_f32.is_finite() { value_f32 } else { f32::NAN };
    VALUE.put_nth(image, idx, Value::I32(in_steps(value)));
    UNCERTAINTY.put_nth(image, idx, Value::U16(uncertainty_in_steps(uncertainty)));
    VALUE_F32.put_nth(image, idx, Value::F32(value_f32));
}

/// To the nearest step; what cannot be represented is invalid.
fn in_steps(value: Option<f64>) -> i32 {
    let steps = value.map(|value| (value * STEPS_PER_UNIT).round());
    let steps = steps.filter(|steps| steps.abs() <= f64::from(i32::MAX));
    steps.map_or(INVALID, |steps| steps as i32)
}

/// Rounded up, so that it is never understated.
fn uncertainty_in_steps(uncertainty: Option<f64>) -> u16 {
    let steps = uncertainty.map(|uncertainty| (uncertainty * STEPS_PER_UNIT - ROUNDING).ceil());
    let steps = steps.filter(|steps| (0.0..f64::from(UNKNOWN)).contains(steps));
    steps.map_or(UNKNOWN, |steps| steps as u16)
}

fn verdict_number(verdict: &str) -> u16 {
    match verdict {
        "ok" => 1,
        "not_ok" => 2,
        "undecided" => 3,
        _ => 4,
    }
}

const _: () = assert!(CHARACTERISTIC_WORDS == 6, "value, verdict, uncertainty, value_f32");

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::registers::map::{MAX_CHARACTERISTICS, VALUE};
    use crate::tests::inspection;

    fn measured(value: Option<f64>, uncertainty: Option<f64>, verdict: Option<&str>) -> CharacteristicMessage {
        let mut inspection = inspection(1, "S1");
        let one = inspection.results.remove(0);
        let verdict = verdict.map(str::to_owned);
        CharacteristicMessage { value, expanded_uncertainty: uncertainty, verdict, ..one }
    }

    fn registers(one: CharacteristicMessage) -> Vec<u16> {
        let mut inspection = inspection(1, "S1");
        inspection.results = vec![one];
        ResultBlock::of(&inspection).image[40..46].to_vec()
    }

    #[test]
    fn a_result_is_encoded_as_the_map_says() {
        let block = ResultBlock::of(&inspection(65_536 + 7, "S1"));
        assert_eq!(block.image[10..18], [8, 2, 3, 7, 0, 12, 0x5331, 0]);
        assert_eq!(block.image[32..36], [0x0006, 0x447F, 0x7903, 0xEE20]);
        let one = registers(measured(Some(8.912), Some(0.01), Some("ok")));
        assert_eq!(one, [1, 0x5C20, 1, 100, 0x410E, 0x978D]);
    }

    #[test]
    fn what_is_invalid_is_never_a_number() {
        let invalid = [0x8000, 0];
        for (value, verdict) in [
            (None, Some("invalid")),
            (Some(1.0), Some("invalid")),
            (Some(f64::NAN), Some("ok")),
            (Some(f64::INFINITY), None),
            (None, None),
        ] {
            let registers = registers(measured(value, None, verdict));
            assert_eq!((&registers[..2], registers[3]), (&invalid[..], 0xFFFF), "{value:?} {verdict:?}");
            assert!(f32::from_bits(u32::from(registers[4]) << 16 | u32::from(registers[5])).is_nan());
        }
        assert_eq!(registers(measured(Some(300_000.0), None, None))[..2], invalid, "beyond 32 bits");
        assert_eq!(VALUE.number(&no_result()), 0x8000_0000);
    }

    #[test]
    fn an_uncertainty_is_rounded_up_and_saturates() {
        for (uncertainty, expected) in
            [(0.01, 100), (0.000_7, 7), (0.000_71, 8), (6.553_4, 65_534), (6.6, 65_535), (f64::NAN, 65_535)]
        {
            assert_eq!(uncertainty_in_steps(Some(uncertainty)), expected, "{uncertainty}");
        }
    }

    #[test]
    fn characteristics_without_registers_are_counted_but_overwrite_nothing() {
        let mut inspection = inspection(1, "S1");
        inspection.results = vec![measured(Some(1.0), None, None); 500];
        let block = ResultBlock::of(&inspection);
        assert_eq!((block.image.len(), block.image[12]), (INPUT_WORDS, 500));
        assert_eq!(block.image[40 + 6 * (MAX_CHARACTERISTICS - 1) + 1], 10_000);
    }

    proptest! {
        #[test]
        fn a_result_number_is_never_0_and_differs_from_the_next_65_534(seq in 1..i64::MAX / 2, ahead in 1..65_535_i64) {
            prop_assert_ne!(result_seq(seq), 0);
            prop_assert_ne!(result_seq(seq), result_seq(seq + ahead));
            prop_assert_eq!(result_seq(seq), result_seq(seq + 65_535));
        }

        #[test]
        fn any_value_is_encoded_without_panic(value in any::<f64>(), uncertainty in any::<f64>()) {
            let registers = registers(measured(Some(value), Some(uncertainty), None));
            let steps = (u32::from(registers[0]) << 16 | u32::from(registers[1])).cast_signed();
            prop_assert!(steps == i32::MIN || (f64::from(steps) - value * 1e4).abs() <= 0.5 + 1e-4);
        }
    }

    #[test]
    fn the_first_65535_results_have_the_numbers_of_their_inspections() {
        for (inspection, expected) in [(1, 1), (41, 41), (65_535, 65_535), (65_536, 1), (65_537, 2)] {
            assert_eq!(result_seq(inspection), expected);
        }
    }
}
