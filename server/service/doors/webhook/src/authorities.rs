//! Who vouches for a receiver: the plant's own authority.

use std::fs;
use std::path::Path;

use app::doors::BadSetting;
use ureq::tls::{Certificate, PemItem, RootCerts, parse_pem};

/// The certificates in a file.
///
/// # Errors
/// It cannot be read, or there is no certificate in it.
pub fn read(path: &Path) -> Result<RootCerts, BadSetting> {
    let bad = |why: String| BadSetting { setting: "ca_file", why: format!("{}: {why}", path.display()) };
    let text = fs::read(path).map_err(|error| bad(error.to_string()))?;
    let mut certificates: Vec<Certificate<'static>> = Vec::new();
    for item in parse_pem(&text) {
        if let PemItem::Certificate(certificate) = item.map_err(|error| bad(error.to_string()))? {
            certificates.push(certificate);
        }
    }
    match certificates.is_empty() {
        true => Err(bad("there is no certificate (PEM) in it".to_owned())),
        false => Ok(RootCerts::new_with_certs(&certificates)),
    }
}

/// A file for an address without encryption.
pub fn unused() -> BadSetting {
    let why = "certificates are checked for https:// only; the url begins with http://".to_owned();
    BadSetting { setting: "ca_file", why }
}
