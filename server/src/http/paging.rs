//! Lists: newest first, `?limit=` at a time, `next` leads on.

use serde::{Deserialize, Serialize};
use store::Page;
use utoipa::{IntoParams, ToSchema};

use crate::config::limits::{PAGE_LIMIT_DEFAULT, PAGE_LIMIT_MAX};
use crate::problem::{Problem, ProblemKind};

/// Which part of a list.
#[derive(Debug, Clone, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct PageQuery {
    /// Id of the last record of the page before.
    pub before: Option<String>,
    /// Records of a page, 1 to 200; 50 if not said.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

impl PageQuery {
    /// As the store takes it.
    pub fn page(&self) -> Result<Page, Problem> {
        page(self.before.clone(), self.limit)
    }
}

/// A page of the store; limits outside 1 to 200 are refused.
pub fn page(before: Option<String>, limit: Option<u32>) -> Result<Page, Problem> {
    let limit = limit.unwrap_or(PAGE_LIMIT_DEFAULT);
    if !(1..=PAGE_LIMIT_MAX).contains(&limit) {
        return Err(Problem::new(ProblemKind::BadRequest, format!("a page cannot have {limit} records"))
            .at("query/limit")
            .remedy(format!("ask for 1 to {PAGE_LIMIT_MAX}")));
    }
    Ok(Page { before, limit })
}

/// A part of a list.
#[derive(Debug, Serialize, ToSchema)]
pub struct ListDto<T> {
    /// The records, newest first.
    pub items: Vec<T>,
    /// Address of the next page; missing on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

impl<T> ListDto<T> {
    /// The page of `items`; a full one leads on, with the cursor that `id` gives of its last record.
    pub fn new<R>(
        path: &str,
        page: &Page,
        records: Vec<R>,
        id: impl Fn(&R) -> String,
        dto: impl Fn(R) -> T,
    ) -> Self {
        let full = records.len() as u64 >= u64::from(page.limit);
        let next = records.last().filter(|_| full).map(|last| {
            let joint = if path.contains('?') { '&' } else { '?' };
            format!("{path}{joint}before={}&limit={}", id(last), page.limit)
        });
        Self { items: records.into_iter().map(dto).collect(), next }
    }
}
