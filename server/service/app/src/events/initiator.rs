//! Who initiated an action.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Who initiated an action, and from where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Initiator {
    /// Kind of principal: `local`, a user of this station.
    pub principal: String,
    /// Name: the holder of the control lease, else the name in the request.
    pub actor: String,
    /// Network address.
    pub source: String,
}
