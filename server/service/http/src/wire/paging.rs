//! Lists: newest first, `?limit=` per page, `next` links to the next page; damaged records are listed separately.

use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use serde::{Deserialize, Serialize};
use store::{DamagedRow, Listed, Page};
use utoipa::{IntoParams, ToSchema};

use crate::limits::{PAGE_LIMIT_DEFAULT, PAGE_LIMIT_MAX};
use crate::problem::{Problem, ProblemKind};

/// Selects a page of a list.
#[derive(Debug, Clone, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct PageQuery {
    /// Id of the last record of the previous page.
    pub before: Option<String>,
    /// Records per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

impl PageQuery {
    /// The page as the store expects it.
    pub fn page(&self) -> Result<Page, Problem> {
        page(self.before.clone(), self.limit)
    }
}

/// A page request for the store; limits outside 1 to 200 are refused.
pub fn page(before: Option<String>, limit: Option<u32>) -> Result<Page, Problem> {
    let limit = limit.unwrap_or(PAGE_LIMIT_DEFAULT);
    if !(1..=PAGE_LIMIT_MAX).contains(&limit) {
        return Err(Problem::new(ProblemKind::BadRequest, format!("a page of {limit} records is not possible"))
            .at("query/limit")
            .remedy(format!("request 1 to {PAGE_LIMIT_MAX}")));
    }
    Ok(Page { before, limit })
}

/// A page of a list.
#[derive(Debug, Serialize, ToSchema)]
pub struct ListDto<T> {
    /// The records, newest first.
    pub items: Vec<T>,
    /// Records in this range that are damaged in the database and cannot be shown, regardless of the filter; absent if
    /// there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub damaged: Vec<DamagedRecordDto>,
    /// URL of the next page; absent on the last page.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

/// A damaged record.
#[derive(Debug, Serialize, ToSchema)]
pub struct DamagedRecordDto {
    /// Kind of record.
    #[schema(example = "scan")]
    pub kind: &'static str,
    /// Its id, as far as readable.
    pub id: String,
    /// What is wrong.
    pub detail: String,
    /// What to do about it.
    pub remedy: String,
}

impl From<DamagedRow> for DamagedRecordDto {
    fn from(row: DamagedRow) -> Self {
        let (kind, id) = (row.kind, row.id.clone());
        let problem = Problem::from(store::StoreError::from(row));
        Self { kind, id, detail: problem.detail, remedy: problem.remedy.unwrap_or_default() }
    }
}

impl<T> ListDto<T> {
    /// The same for records whose JSON may be unreadable: such records are listed as damaged.
    pub fn whole_of<R>(
        path: &str,
        page: &Page,
        mut listed: Listed<R>,
        dto: impl Fn(R) -> Result<T, DamagedRow>,
    ) -> Self {
        let mut items = Vec::with_capacity(listed.records.len());
        for record in std::mem::take(&mut listed.records) {
            match dto(record) {
                Ok(item) => items.push(item),
                Err(row) => listed.damaged.push(row),
            }
        }
        Self { items, ..Self::new(path, page, listed, |_| unreachable!("the records were taken")) }
    }

    /// The page of the list at `path` (which may have a query), with at most `page.limit` records.
    pub fn new<R>(path: &str, page: &Page, listed: Listed<R>, dto: impl Fn(R) -> T) -> Self {
        let next = listed.next.map(|before| {
            let joint = if path.contains('?') { '&' } else { '?' };
            format!("{path}{joint}before={before}&limit={}", page.limit)
        });
        let damaged = listed.damaged.into_iter().map(DamagedRecordDto::from).collect();
        Self { items: listed.records.into_iter().map(dto).collect(), damaged, next }
    }
}

/// Text as a value of [`path_with`].
pub fn encoded(text: &str) -> String {
    utf8_percent_encode(text, NON_ALPHANUMERIC).to_string()
}

/// A URL with the given query parameters. Values are API codes, record ids and [`encoded`] text.
pub fn path_with(path: &str, query: &[(&str, Option<&str>)]) -> String {
    let asked = query.iter().filter_map(|(name, value)| Some(format!("{name}={}", (*value)?)));
    let asked: Vec<String> = asked.collect();
    if asked.is_empty() { path.to_owned() } else { format!("{path}?{}", asked.join("&")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_with_unreadable_json_is_listed_as_damaged_and_hides_no_other() {
        let listed = Listed { records: vec!["1", "two", "3"], damaged: Vec::new(), next: Some("3".to_owned()) };
        let page = Page { before: None, limit: 3 };
        let number = |text: &str| text.parse::<u8>().map_err(|_| DamagedRow { kind: "scan", id: text.to_owned() });
        let list = ListDto::whole_of("/api/v1/scans", &page, listed, number);
        assert_eq!(list.items, [1, 3]);
        assert_eq!((list.damaged.len(), list.damaged[0].id.as_str()), (1, "two"));
        assert_eq!(list.next.as_deref(), Some("/api/v1/scans?before=3&limit=3"));
    }
}
