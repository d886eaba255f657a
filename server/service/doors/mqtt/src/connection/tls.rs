//! TLS by rustls, with ring.

use std::path::Path;
use std::sync::Arc;

use app::doors::BadSetting;
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject as _;
use rustls::{ClientConfig, RootCertStore};

/// Trusts the certificates in `ca_file`, or those of the system.
///
/// # Errors
/// The file cannot be read or contains no certificate, or the system has none.
pub fn client_config(ca_file: Option<&Path>) -> Result<Arc<ClientConfig>, BadSetting> {
    let bad = |why: String| BadSetting { setting: "ca_file", why };
    let certificates = match ca_file {
        Some(path) => {
            let all: Result<Vec<_>, _> =
                CertificateDer::pem_file_iter(path).and_then(|certificates| certificates.collect());
            all.map_err(|error| bad(format!("{} cannot be read: {error}", path.display())))?
        }
        None => rustls_native_certs::load_native_certs().certs,
    };
    let mut roots = RootCertStore::empty();
    let (n_added, _) = roots.add_parsable_certificates(certificates);
    match (n_added, ca_file) {
        (0, Some(path)) => return Err(bad(format!("{} contains no certificate (PEM)", path.display()))),
        (0, None) => {
            return Err(bad("this system has no certificates; name a file with those to trust".to_owned()));
        }
        _ => {}
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let versions = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let builder = versions.map_err(|error| bad(error.to_string()))?;
    Ok(Arc::new(builder.with_root_certificates(roots).with_no_client_auth()))
}
