//! The verdict on a part: every screen, list and door asks this one function.

use crate::interface::verdict::Verdict;

/// How a characteristic or a whole part was judged, from the best to the worst.
///
/// Everything but [`PartVerdict::Ok`] keeps the part out of the good ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PartVerdict {
    /// Within the limits beyond doubt.
    Ok,
    /// Too close to a limit to decide.
    Undecided,
    /// Could not be measured, or the scan is no base of a verdict: a reject.
    Invalid,
    /// Outside the limits beyond doubt.
    NotOk,
}

impl PartVerdict {
    /// All, from the best to the worst.
    pub const ALL: [Self; 4] = [Self::Ok, Self::Undecided, Self::Invalid, Self::NotOk];

    /// Its word in records, in the API and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => Verdict::Pass.name(),
            Self::Undecided => Verdict::Undecided.name(),
            Self::Invalid => "invalid",
            Self::NotOk => Verdict::Fail.name(),
        }
    }

    /// The verdict of a word; records of earlier versions say `pass` and `fail`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "pass" => Some(Self::Ok),
            "fail" => Some(Self::NotOk),
            _ => Self::ALL.into_iter().find(|verdict| verdict.name() == name),
        }
    }

    /// As people read it.
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

/// What is judged separately: a tool, and the name that distinguishes two uses of one tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CharacteristicKey<'a> {
    /// The tool's name.
    pub tool: &'a str,
    /// The characteristic's name; `None` where nobody gave one.
    pub name: Option<&'a str>,
}

/// The verdict on a part: of every characteristic the newest verdict counts, and of these the worst is the part's.
///
/// `newest_first`: its measurements; one without a verdict was not asked to judge and takes none back.
/// `required`: characteristics that had to be judged; one that was not is [`PartVerdict::Invalid`].
/// `None` if nothing was judged and nothing had to be.
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
            // Sphere, flatness, sphere again: the flatness stands.
            (&[("sphere", Some(Ok)), ("flatness", Some(NotOk)), ("sphere", Some(Ok))], &[], Some(NotOk)),
            // Measured again: the earlier verdict is gone.
            (&[("sphere", Some(Ok)), ("sphere", Some(NotOk))], &[], Some(Ok)),
            (&[("sphere", Some(NotOk)), ("sphere", Some(Ok))], &[], Some(NotOk)),
            // Measured again without limits: nothing is taken back.
            (&[("sphere", None), ("sphere", Some(NotOk))], &[], Some(NotOk)),
            // Two names are two characteristics.
            (&[("sphere/left", Some(Ok)), ("sphere/right", Some(NotOk))], &[], Some(NotOk)),
            (&[("sphere", Some(Undecided)), ("step", Some(Invalid)), ("plane", Some(Ok))], &[], Some(Invalid)),
            (&[("sphere", Some(Undecided)), ("plane", Some(Ok))], &[], Some(Undecided)),
            (&[("sphere", Some(NotOk)), ("plane", Some(Invalid))], &[], Some(NotOk)),
            // What had to be judged and was not.
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
    fn words_are_read_back_and_those_of_earlier_records_are_known() {
        for verdict in PartVerdict::ALL {
            assert_eq!(PartVerdict::from_name(verdict.name()), Some(verdict));
        }
        let earlier = ["pass", "fail", "good"].map(PartVerdict::from_name);
        assert_eq!(earlier, [Some(Ok), Some(NotOk), None]);
    }
}
