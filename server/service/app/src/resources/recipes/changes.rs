//! Differences between two versions of a recipe.

use serde_json::Value;

use crate::resources::recipes::Recipe;

/// A change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlaceChange {
    /// JSON pointer; features and characteristics are named by their id instead of their number.
    pub place: String,
    /// Old value, as JSON; `None`: added.
    pub old: Option<String>,
    /// New value, as JSON; `None`: removed.
    pub new: Option<String>,
}

/// The changes, ordered by pointer.
pub fn changes_between(old: &Recipe, new: &Recipe) -> Vec<PlaceChange> {
    let mut changes = Vec::new();
    compare("", Some(&old.to_value()), Some(&new.to_value()), &mut changes);
    changes
}

fn compare(place: &str, old: Option<&Value>, new: Option<&Value>, changes: &mut Vec<PlaceChange>) {
    if old == new {
        return;
    }
    let [of_old, of_new] = [old, new].map(|value| value.and_then(children));
    if let (Some(of_old), Some(of_new)) = (of_old, of_new) {
        let mut names: Vec<&String> = of_old.iter().chain(&of_new).map(|(name, _)| name).collect();
        names.sort();
        names.dedup();
        let n_before = changes.len();
        for name in names {
            let named = |children: &[(String, Value)]| {
                children.iter().find(|(known, _)| known == name).map(|(_, value)| value.clone())
            };
            compare(&format!("{place}/{name}"), named(&of_old).as_ref(), named(&of_new).as_ref(), changes);
        }
        if changes.len() > n_before {
            return;
        }
        // The same things in another order.
        let order = |children: &[(String, Value)]| {
            Some(Value::from(children.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>()).to_string())
        };
        changes.push(PlaceChange { place: place.to_owned(), old: order(&of_old), new: order(&of_new) });
        return;
    }
    let text = |value: Option<&Value>| value.map(ToString::to_string);
    changes.push(PlaceChange { place: place.to_owned(), old: text(old), new: text(new) });
}

/// Entries of an object by key, or of a list of objects with ids by id; `None` for values compared as a whole.
fn children(value: &Value) -> Option<Vec<(String, Value)>> {
    match value {
        Value::Object(map) => {
            let escaped = |key: &String| key.replace('~', "~0").replace('/', "~1");
            Some(map.iter().map(|(key, value)| (escaped(key), value.clone())).collect())
        }
        Value::Array(items) => {
            items.iter().map(|item| Some((item["id"].as_str()?.to_owned(), item.clone()))).collect()
        }
        _ => None,
    }
}
