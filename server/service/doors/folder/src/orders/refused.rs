//! The text beside a refused file: for the person who wrote the file.

use app::error::AppError;

use crate::orders::order::Refusal;

impl Refusal {
    /// An order that the service refuses.
    pub fn from_error(row: Option<u64>, error: AppError) -> Self {
        let mut reason = error.detail;
        if let Some(place) = error.pointer {
            reason += &format!(" ({})", place.trim_start_matches('/'));
        }
        if let Some(cause) = error.cause {
            reason += &format!(": {cause}");
        }
        Self { row, reason, remedy: error.remedy.unwrap_or_else(|| "correct the order".to_owned()) }
    }
}

/// Every refusal with its remedy, and what to do with the file.
pub fn note(file: &str, refusals: &[Refusal], n_accepted: usize) -> String {
    let mut lines = vec![format!("{file} was refused.")];
    for refusal in refusals {
        let place = refusal.row.map(|row| format!("Row {row}: ")).unwrap_or_default();
        lines.push(String::new());
        lines.push(format!("{place}{}", refusal.reason));
        lines.push(format!("Remedy: {}", refusal.remedy));
    }
    lines.push(String::new());
    lines.push(match n_accepted {
        0 => "No order of this file was accepted. Correct it and put it into the folder again.".to_owned(),
        n => format!(
            "{n} other orders of this file were accepted. Correct the file and put it into the folder again under the \
             same name: what was accepted is not repeated."
        ),
    });
    lines.push(String::new());
    // Editors on Windows.
    lines.join("\r\n")
}

#[cfg(test)]
mod tests {
    use app::error::ErrorKind;

    use super::*;

    #[test]
    fn the_note_names_row_reason_cause_and_remedy() {
        let error = AppError::new(ErrorKind::Impossible, "a name is empty")
            .at("/serial")
            .because("it is")
            .remedy("name it");
        let refusals = [Refusal::from_error(Some(3), error), Refusal::new("no", "yes")];
        let expected = "orders.csv was refused.\r\n\r\nRow 3: a name is empty (serial): it is\r\nRemedy: name it\r\n\r\n\
            no\r\nRemedy: yes\r\n\r\nNo order of this file was accepted. Correct it and put it into the folder again.\r\n";
        assert_eq!(note("orders.csv", &refusals, 0), expected);
        assert!(note("orders.csv", &refusals, 2).contains("2 other orders of this file were accepted"));
    }
}
