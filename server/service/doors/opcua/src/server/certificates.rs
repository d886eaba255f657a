//! The server's own certificate.

use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::Path;

use opcua::crypto::{CertificateStore, X509, X509Data};

/// Certificate and private key in the folder.
pub const CERTIFICATE: &str = "own/cert.der";
/// See [`CERTIFICATE`].
pub const PRIVATE_KEY: &str = "private/private.pem";

/// Days that a new certificate is valid: clients trust it by hand, so that it should outlast the computer.
const VALID_DAYS: u32 = 20 * 365;

/// Bits of a new key, which all policies accept.
const KEY_BITS: u32 = 2048;

/// Creates certificate and key if there are none. Takes a second, and longer without optimisation.
///
/// # Errors
/// The folder cannot be written, or only one of the two exists.
pub fn ensure(folder: &Path, application_uri: &str, host: &str) -> Result<(), String> {
    let (certificate, key) = (folder.join(CERTIFICATE), folder.join(PRIVATE_KEY));
    match (certificate.exists(), key.exists()) {
        (true, true) => return Ok(()),
        (false, false) => {}
        _ => {
            return Err(format!(
                "{} has only one of {CERTIFICATE} and {PRIVATE_KEY}; add the other one, or delete it so that both are \
                 created",
                folder.display()
            ));
        }
    }
    let private = folder.join("private");
    let created = DirBuilder::new().recursive(true).mode(0o700).create(&private);
    created.map_err(|error| format!("{} cannot be created: {error}", private.display()))?;
    let names = X509Data::alt_host_names(application_uri, Some(vec![host.to_owned()]), false, true, false);
    let data = X509Data {
        key_size: KEY_BITS,
        common_name: "Sheaf".to_owned(),
        organization: "Sheaf".to_owned(),
        organizational_unit: String::new(),
        country: String::new(),
        state: String::new(),
        alt_host_names: names,
        certificate_duration_days: VALID_DAYS,
    };
    CertificateStore::create_certificate_and_key(&data, false, &certificate, &key).map(|_: (X509, _)| ())
}
