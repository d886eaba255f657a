//! The URL of a receiver.

use std::net::IpAddr;

use app::doors::BadSetting;
use ureq::http::Uri;

use crate::address::Allowed;
use crate::resolver::{check, host_of};

/// A URL that events can be posted to.
///
/// # Errors
/// It is no `http(s)` URL, contains a password, or leads to an address that is not allowed. The addresses of a name are
/// checked at each attempt.
pub fn parse(url: &str, allowed: &Allowed) -> Result<Uri, BadSetting> {
    let bad = |why: String| BadSetting { setting: "url", why };
    let uri: Uri = url.parse().map_err(|_| bad(format!("is no URL; {EXAMPLE}")))?;
    let authority = uri.authority().filter(|authority| !authority.host().is_empty());
    let authority = authority.ok_or_else(|| bad(format!("names no host; {EXAMPLE}")))?;
    if authority.as_str().contains('@') {
        return Err(bad("contains a user name or password; the secret is in secret_file".to_owned()));
    }
    // A port that is no number is otherwise ignored.
    let port = authority.as_str().strip_prefix(authority.host()).and_then(|rest| rest.strip_prefix(':'));
    if port.is_some_and(|port| !port.parse::<u16>().is_ok_and(|port| port > 0)) {
        return Err(bad("has no valid port".to_owned()));
    }
    match uri.scheme_str() {
        Some("https") => {}
        Some("http") if allowed.is_empty() => return Err(bad(UNENCRYPTED.to_owned())),
        Some("http") => {}
        _ => return Err(bad(format!("is no https URL; {EXAMPLE}"))),
    }
    if let Ok(ip) = host_of(&uri).parse::<IpAddr>() {
        check(&uri, ip, allowed).map_err(|forbidden| bad(forbidden.to_string()))?;
    }
    Ok(uri)
}

const EXAMPLE: &str = "an example: https://mes.example/hooks";

const UNENCRYPTED: &str = "http:// is possible only for addresses listed in allowed_private; use https://";

/// The URL as it may be shown: without what follows `?`, which may be a secret.
pub fn shown(uri: &Uri) -> String {
    let authority = uri.authority().map_or("", |authority| authority.as_str());
    format!("{}://{authority}{}", uri.scheme_str().unwrap_or_default(), uri.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(url: &str, allowed: &[&str]) -> Result<Uri, BadSetting> {
        let allowed: Vec<_> = allowed.iter().map(|range| (*range).to_owned()).collect();
        parse(url, &Allowed::parse(&allowed).unwrap())
    }

    #[test]
    fn encrypted_public_receivers_and_listed_ones_can_be_used() {
        for (url, allowed) in [
            ("https://mes.example", &[][..]),
            ("https://mes.example:8443/hooks?line=2", &[]),
            ("https://8.8.8.8/", &[]),
            ("https://[2606:4700::1111]:443/", &[]),
            ("https://10.1.2.3/", &["10.1.0.0/16"]),
            ("http://10.1.2.3:8080/", &["10.1.0.0/16"]),
            ("http://[fd00::1]/", &["fd00::/8"]),
            ("http://mes.local/", &["10.1.0.0/16"]),
        ] {
            assert!(parsed(url, allowed).is_ok(), "{url} {:?}", parsed(url, allowed));
        }
    }

    #[test]
    fn what_cannot_be_posted_to_is_refused() {
        for (url, allowed) in [
            ("", &[][..]),
            ("mes.example", &[]),
            ("/hooks", &[]),
            ("https://", &[]),
            ("https:///hooks", &[]),
            ("ftp://mes.example/", &[]),
            ("https://mes example/", &[]),
            ("https://user:word@mes.example/", &[]),
            ("https://mes.example:99999/", &[]),
            ("https://mes.example:0/", &[]),
            ("https://mes.example:/", &[]),
            ("http://mes.example/", &[]),
            ("http://8.8.8.8/", &["10.1.0.0/16"]),
            ("https://10.1.2.3/", &[]),
            ("https://[::ffff:10.1.2.3]/", &[]),
            ("https://[::1]/", &["127.0.0.1"]),
        ] {
            let refused = parsed(url, allowed).map_err(|bad| bad.setting);
            assert_eq!(refused, Err("url"), "{url}");
        }
    }

    #[test]
    fn what_may_be_a_secret_is_not_shown() {
        let uri = parsed("https://mes.example:8443/hooks?key=abc", &[]).unwrap();
        assert_eq!(shown(&uri), "https://mes.example:8443/hooks");
        let refused = parsed("https://user:word@mes.example/", &[]).unwrap_err();
        assert!(!refused.why.contains("word@"), "{}", refused.why);
    }
}
