//! Which events a door delivers, as configured.

use store::EventRecord;

use crate::doors::door::BadSetting;

/// Events by kind, and inspections by recipe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EventFilter {
    kinds: Vec<String>,
    recipes: Vec<String>,
}

impl EventFilter {
    /// `kinds` are kinds of events such as `inspection.finished`, beginnings such as `inspection.*`, or `*`; `recipes` are
    /// ids of recipes whose inspections are delivered, all if empty.
    ///
    /// # Errors
    /// A kind is neither of these.
    pub fn new(kinds: Vec<String>, recipes: Vec<String>) -> Result<Self, BadSetting> {
        let is_known = |kind: &String| {
            let letters = kind.strip_suffix('*').unwrap_or(kind);
            let is_whole = letters.len() == kind.len() && letters.contains('.');
            let is_beginning = letters.len() < kind.len() && (letters.is_empty() || letters.ends_with('.'));
            (is_whole || is_beginning)
                && letters.bytes().all(|byte| b"._".contains(&byte) || byte.is_ascii_lowercase())
        };
        match kinds.iter().find(|kind| !is_known(kind)) {
            None => Ok(Self { kinds, recipes }),
            Some(kind) => Err(BadSetting {
                setting: "events",
                why: format!("\"{kind}\" is no kind of event; examples: inspection.finished, inspection.*, *"),
            }),
        }
    }

    /// Whether it selects this event.
    pub fn matches(&self, event: &EventRecord) -> bool {
        let is_kind = |kind: &String| match kind.strip_suffix('*') {
            Some(beginning) => event.kind.starts_with(beginning),
            None => event.kind == *kind,
        };
        self.kinds.iter().any(is_kind) && self.matches_recipe(event)
    }

    fn matches_recipe(&self, event: &EventRecord) -> bool {
        let reference = event.body["recipe"].as_str();
        let id = reference.map(|reference| reference.split('@').next().unwrap_or(reference));
        self.recipes.is_empty() || id.is_none_or(|id| self.recipes.iter().any(|recipe| recipe == id))
    }
}

/// Whether the door of this name is among those that the recipe of an inspection names; events that name none are for all.
pub(super) fn is_addressed_to(door: &str, event: &EventRecord) -> bool {
    event.body["outputs"].as_array().is_none_or(|names| names.iter().any(|name| name == door))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn event(kind: &str, recipe: Option<&str>) -> EventRecord {
        let body = recipe.map_or_else(|| serde_json::json!({}), |recipe| serde_json::json!({ "recipe": recipe }));
        EventRecord { seq: 1, kind: kind.to_owned(), subject: String::new(), body, at_ms: 0 }
    }

    fn filter(kinds: &[&str], recipes: &[&str]) -> EventFilter {
        let [kinds, recipes] = [kinds, recipes].map(|all| all.iter().map(|one| (*one).to_owned()).collect());
        EventFilter::new(kinds, recipes).unwrap()
    }

    #[test]
    fn events_are_selected_by_kind_beginning_or_all() {
        let finished = event("inspection.finished", Some("bracket@7"));
        for kind in ["inspection.finished", "inspection.*", "*"] {
            assert!(filter(&[kind], &[]).matches(&finished), "{kind}");
        }
        for kind in ["inspection.held", "inspections.*", "scan.*"] {
            assert!(!filter(&[kind], &[]).matches(&finished), "{kind}");
        }
        assert!(!filter(&[], &[]).matches(&finished));
    }

    #[test]
    fn inspections_are_selected_by_recipe_and_other_events_pass() {
        let chosen = filter(&["*"], &["bracket"]);
        assert!(chosen.matches(&event("inspection.finished", Some("bracket@7"))));
        assert!(!chosen.matches(&event("inspection.finished", Some("brackets@7"))));
        assert!(chosen.matches(&event("station.stopped", None)));
    }

    #[test]
    fn an_event_that_names_its_doors_is_for_them_alone() {
        let naming = |outputs: serde_json::Value| EventRecord {
            body: serde_json::json!({ "outputs": outputs }),
            ..event("inspection.finished", None)
        };
        assert!(is_addressed_to("mes", &event("inspection.finished", None)));
        assert!(is_addressed_to("mes", &naming(serde_json::json!(null))));
        assert!(is_addressed_to("mes", &naming(serde_json::json!(["plc", "mes"]))));
        assert!(!is_addressed_to("mes", &naming(serde_json::json!(["plc"]))));
        assert!(!is_addressed_to("mes", &naming(serde_json::json!([]))));
    }

    #[test]
    fn what_is_no_kind_of_event_is_refused() {
        for kind in ["", "Inspection", "inspection", "inspection*", "inspection.finished ", "**"] {
            let refused = EventFilter::new(vec![kind.to_owned()], Vec::new()).unwrap_err();
            assert_eq!(refused.setting, "events", "{kind}");
        }
    }
}
