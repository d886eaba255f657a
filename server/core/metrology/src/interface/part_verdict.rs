//! The verdict on a part: the one function used by every screen, list and interface.

use crate::interface::verdict::Verdict;

/// Verdict on a characteristic or a whole part, from best to worst.
///
/// Only [`PartVerdict::Ok`] accepts the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PartVerdict {
    /// Within the limits, uncertainty included.
    Ok,
    /// Too close to a limit to decide.
    Undecided,
    /// Could not be measured, or the scan allows no verdict: rejected.
    Invalid,
    /// Outside the limits, uncertainty included.
    NotOk,
}

impl PartVerdict {
    /// All verdicts, from best to worst.
    pub const ALL: [Self; 4] = [Self::Ok, Self::Undecided, Self::Invalid, Self::NotOk];

    /// Its name in records, in the API and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => Verdict::Pass.name(),
            Self::Undecided => Verdict::Undecided.name(),
            Self::Invalid => "invalid",
            Self::NotOk => Verdict::Fail.name(),
        }
    }

    /// The verdict with that name; records of earlier versions use `pass` and `fail`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "pass" => Some(Self::Ok),
            "fail" => Some(Self::NotOk),
            _ => Self::ALL.into_iter().find(|verdict| verdict.name() == name),
        }
    }

    /// Its label for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ok => "OK",
            Self::Undecided => "UNDECIDED",
            Self::Invalid => "INVALID",
            Self::NotOk => "NOT OK",
        }
    }
}

impl From<Verdict> for PartVerdict {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Pass => Self::Ok,
            Verdict::Undecided => Self::Undecided,
            Verdict::Fail => Self::NotOk,
        }
    }
}

/// Identifies a characteristic: a tool, and the name that distinguishes two uses of one tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CharacteristicKey<'a> {
    /// The tool's name.
    pub tool: &'a str,
    /// The characteristic's name, if it has one.
    pub name: Option<&'a str>,
}

/// The verdict on a part: the newest verdict of every characteristic counts, and the worst of these is the part's.
///
/// `newest_first`: its measurements; one without a verdict does not replace an earlier verdict.
/// `required`: characteristics that must have a verdict; one without is [`PartVerdict::Invalid`].
/// `None` if there is no verdict and none is required.
pub fn part_verdict<'a>(
    newest_first: impl IntoIterator<Item = (CharacteristicKey<'a>, Option<PartVerdict>)>,
    required: &[CharacteristicKey<'_>],
) -> Option<PartVerdict> {
    let mut newest: Vec<(CharacteristicKey<'a>, PartVerdict)> = Vec::new();
    for (key, verdict) in newest_first {
        if let Some(verdict) = verdict
            && newest.iter().all(|(known, _)| *known != key)
        {
            newest.push((key, verdict));
        }
    }
    let missing = required.iter().any(|key| newest.iter().all(|(known, _)| known != key));
    newest.into_iter().map(|(_, verdict)| verdict).chain(missing.then_some(PartVerdict::Invalid)).max()
}

#[cfg(test)]
mod tests {
    use super::PartVerdict::{Invalid, NotOk, Ok, Undecided};
    use super::*;

    fn key(text: &'static str) -> CharacteristicKey<'static> {
        match text.split_once('/') {
            Some((tool, name)) => CharacteristicKey { tool, name: Some(name) },
            None => CharacteristicKey { tool: text, name: None },
        }
    }

    #[test]
    fn the_newest_of_each_characteristic_counts_and_the_worst_wins() {
        type Case = (&'static [(&'static str, Option<PartVerdict>)], &'static [&'static str], Option<PartVerdict>);
        let cases: &[Case] = &[
            (&[], &[], None),
            (&[("sphere", None)], &[], None),
            (&[("sphere", Some(Ok))], &[], Some(Ok)),
            // Sphere, flatness, sphere again: the flatness verdict remains.
            (&[("sphere", Some(Ok)), ("flatness", Some(NotOk)), ("sphere", Some(Ok))], &[], Some(NotOk)),
            // Measured again: the earlier verdict is replaced.
            (&[("sphere", Some(Ok)), ("sphere", Some(NotOk))], &[], Some(Ok)),
            (&[("sphere", Some(NotOk)), ("sphere", Some(Ok))], &[], Some(NotOk)),
            // Measured again without limits: the earlier verdict remains.
            (&[("sphere", None), ("sphere", Some(NotOk))], &[], Some(NotOk)),
            // Two names are two characteristics.
            (&[("sphere/left", Some(Ok)), ("sphere/right", Some(NotOk))], &[], Some(NotOk)),
            (&[("sphere", Some(Undecided)), ("step", Some(Invalid)), ("plane", Some(Ok))], &[], Some(Invalid)),
            (&[("sphere", Some(Undecided)), ("plane", Some(Ok))], &[], Some(Undecided)),
            (&[("sphere", Some(NotOk)), ("plane", Some(Invalid))], &[], Some(NotOk)),
            // Required but without a verdict.
            (&[], &["sphere"], Some(Invalid)),
            (&[("step", Some(Ok))], &["sphere", "step"], Some(Invalid)),
            (&[("sphere", Some(Ok))], &["sphere"], Some(Ok)),
        ];
        for (measured, required, expected) in cases {
            let measured: Vec<_> = measured.iter().map(|(text, verdict)| (key(text), *verdict)).collect();
            let required: Vec<_> = required.iter().copied().map(key).collect();
            assert_eq!(part_verdict(measured.clone(), &required), *expected, "{measured:?} {required:?}");
        }
    }

    #[test]
    fn names_are_read_back_including_those_of_earlier_records() {
        for verdict in PartVerdict::ALL {
            assert_eq!(PartVerdict::from_name(verdict.name()), Some(verdict));
        }
        let earlier = ["pass", "fail", "good"].map(PartVerdict::from_name);
        assert_eq!(earlier, [Some(Ok), Some(NotOk), None]);
    }
}
