//! Several numbers in one argument, separated by commas.

/// Reads exactly `N` finite numbers.
///
/// # Errors
/// What is wrong with the text.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let number = |part: &str| {
        let value = part.trim().parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| format!("\"{part}\" is not a number"))
    };
    let values = text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?;
    let n = values.len();
    values.try_into().map_err(|_| format!("{n} numbers instead of {N}, separated by commas"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use clap::Parser as _;

    use crate::arguments::{Cli, Command};

    fn region_mm(arguments: &[&str]) -> Result<Option<[f64; 6]>, String> {
        let line = ["sheaf", "measure", "cloud.ply", "--tool", "sphere"].iter().chain(arguments);
        match Cli::try_parse_from(line).map_err(|error| error.to_string())?.command {
            Command::Measure(args) => Ok(args.region_mm),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_list_of_numbers_is_one_argument_and_may_begin_with_a_negative_one() {
        let corners = [-30.0, -20.5, 300.0, 30.0, 20.0, 420.0];
        assert_eq!(region_mm(&["--region-mm", "-30,-20.5,300,30,20,420"]), Ok(Some(corners)));
        assert_eq!(region_mm(&["--region-mm=-30, -20.5, 300, 30, 20, 420"]), Ok(Some(corners)));
    }

    #[test]
    fn a_wrong_list_is_refused_with_the_reason() {
        let cases = [
            ("1,2,3", "3 numbers instead of 6"),
            ("1,2,3,4,5,x", "\"x\" is not a number"),
            ("1,2,3,4,5,inf", "\"inf\""),
        ];
        for (list, expected) in cases {
            let refusal = region_mm(&["--region-mm", list]).unwrap_err();
            assert!(refusal.contains(expected), "{list}: {refusal}");
        }
    }
}
