//! Who may connect, and what they may call.

use std::path::Path;

use app::doors::BadSetting;
use async_trait::async_trait;
use opcua::server::authenticator::{
    AuthManager, Password, UserToken, user_pass_security_policy_id, user_pass_security_policy_uri,
};
use opcua::server::{ANONYMOUS_USER_TOKEN_ID, ServerEndpoint};
use opcua::types::{Error, NodeId, StatusCode, UAString, UserTokenPolicy, UserTokenType};

use crate::server::methods::is_command;
use crate::server::nodes::path;
use crate::settings::User;

/// The policy id of anonymous users.
const ANONYMOUS_POLICY: &str = "anonymous";

/// The configured users with their passwords.
pub struct Users {
    users: Vec<(String, String)>,
    commands: bool,
    anonymous: bool,
}

impl Users {
    /// Reads the passwords.
    ///
    /// # Errors
    /// A file cannot be read, or nobody could log in.
    pub fn new(users: &[User], commands: bool, anonymous: bool) -> Result<Self, BadSetting> {
        if users.is_empty() && !anonymous {
            let why = "nobody could log in; list users, or set anonymous".to_owned();
            return Err(BadSetting { setting: "users", why });
        }
        if users.is_empty() && commands {
            let why = "commands need a user with a password; anonymous clients can only read".to_owned();
            return Err(BadSetting { setting: "commands", why });
        }
        let mut known: Vec<(String, String)> = Vec::new();
        for user in users {
            if user.name.trim().is_empty() || user.name == ANONYMOUS_USER_TOKEN_ID {
                let why = format!("\"{}\" cannot be a name", user.name);
                return Err(BadSetting { setting: "users", why });
            }
            if known.iter().any(|(name, _)| *name == user.name) {
                let why = format!("there are two users named \"{}\"", user.name);
                return Err(BadSetting { setting: "users", why });
            }
            known.push((user.name.clone(), password(&user.password_file)?));
        }
        Ok(Self { users: known, commands, anonymous })
    }
}

/// The content of the file without the end of its last line.
fn password(file: &Path) -> Result<String, BadSetting> {
    let bad = |why: &str| BadSetting { setting: "password_file", why: format!("{} {why}", file.display()) };
    let text = std::fs::read_to_string(file).map_err(|error| bad(&format!("cannot be read: {error}")))?;
    let text = text.strip_suffix('\n').unwrap_or(&text);
    let password = text.strip_suffix('\r').unwrap_or(text);
    if password.is_empty() { Err(bad("is empty")) } else { Ok(password.to_owned()) }
}

/// Compares without stopping at the first difference.
fn is_same(a: &str, b: &str) -> bool {
    let differences = a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differences == 0
}

fn rejected(why: &str) -> Error {
    Error::new(StatusCode::BadUserAccessDenied, why)
}

fn is_encrypted(endpoint: &ServerEndpoint) -> bool {
    endpoint.security_mode == "SignAndEncrypt"
}

#[async_trait]
impl AuthManager for Users {
    async fn authenticate_anonymous_token(&self, _endpoint: &ServerEndpoint) -> Result<(), Error> {
        if self.anonymous { Ok(()) } else { Err(rejected("anonymous clients are not accepted")) }
    }

    async fn authenticate_username_identity_token(
        &self,
        endpoint: &ServerEndpoint,
        username: &str,
        password: &Password,
    ) -> Result<UserToken, Error> {
        let known = self.users.iter().find(|(name, _)| name == username);
        let is_right = known.is_some_and(|(_, own)| is_same(own, password.get()));
        if is_right && is_encrypted(endpoint) {
            return Ok(UserToken(username.to_owned()));
        }
        tracing::warn!(user = username, "a login was refused");
        Err(rejected("unknown user or wrong password"))
    }

    fn is_user_executable(&self, token: &UserToken, method: &NodeId) -> bool {
        !is_command(path(method)) || (self.commands && !token.is_anonymous())
    }

    fn user_token_policies(&self, endpoint: &ServerEndpoint) -> Vec<UserTokenPolicy> {
        let policy = |id: UAString, of, uri| UserTokenPolicy {
            policy_id: id,
            token_type: of,
            issued_token_type: UAString::null(),
            issuer_endpoint_url: UAString::null(),
            security_policy_uri: uri,
        };
        let mut policies = Vec::new();
        if self.anonymous {
            policies.push(policy(ANONYMOUS_POLICY.into(), UserTokenType::Anonymous, UAString::null()));
        }
        if is_encrypted(endpoint) && !self.users.is_empty() {
            let uri = user_pass_security_policy_uri(endpoint);
            policies.push(policy(user_pass_security_policy_id(endpoint), UserTokenType::UserName, uri));
        }
        policies
    }
}
