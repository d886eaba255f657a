//! The secrets shared with a receiver, and signatures made with them.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use app::doors::BadSetting;
use base64::Engine;
use base64::alphabet;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig, STANDARD};
use hmac::{Hmac, Mac};
use parking_lot::Mutex;
use sha2::Sha256;

use crate::params::SECRET_BYTES;

/// Before the base64 of a secret.
const PREFIX: &str = "whsec_";

/// Base64 with or without `=` at the end: tools differ.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// One secret, or several while receivers change from one to the next.
pub struct Secrets(Vec<Vec<u8>>);

impl Secrets {
    /// Reads a file with one secret per line.
    ///
    /// # Errors
    /// It cannot be read, or a line is no secret; the lines themselves are not repeated.
    pub fn read(path: &Path) -> Result<Self, BadSetting> {
        let bad = |why: String| BadSetting { setting: "secret_file", why: format!("{}: {why}", path.display()) };
        let text = fs::read_to_string(path).map_err(|error| bad(error.to_string()))?;
        let mut secrets = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.trim();
            if line.is_empty() {
                continue;
            }
            let secret = decode(line).filter(|secret| SECRET_BYTES.contains(&secret.len()));
            secrets.push(secret.ok_or_else(|| bad(format!("line {number} is no secret; {EXPECTED}")))?);
        }
        match secrets.is_empty() {
            true => Err(bad(format!("there is no secret; {EXPECTED}"))),
            false => Ok(Self(secrets)),
        }
    }

    /// The value of `webhook-signature`: one signature per secret, over id, time and body.
    pub fn sign(&self, id: &str, timestamp_s: u64, body: &[u8]) -> String {
        let sign = |secret: &Vec<u8>| {
            let mut mac = Hmac::<Sha256>::new_from_slice(secret).expect("HMAC takes keys of any length");
            mac.update(format!("{id}.{timestamp_s}.").as_bytes());
            mac.update(body);
            format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()))
        };
        self.0.iter().map(sign).collect::<Vec<_>>().join(" ")
    }
}

/// A file with secrets, which may be changed while the server runs.
pub struct SecretFile {
    path: PathBuf,
    known: Mutex<Secrets>,
}

impl SecretFile {
    /// The file with the secrets that it has now.
    ///
    /// # Errors
    /// As [`Secrets::read`].
    pub fn open(path: &Path) -> Result<Self, BadSetting> {
        Ok(Self { path: path.to_owned(), known: Mutex::new(Secrets::read(path)?) })
    }

    /// As [`Secrets::sign`], with the secrets in the file now; while it cannot be used, with the last ones that could.
    pub fn sign(&self, id: &str, timestamp_s: u64, body: &[u8]) -> String {
        let mut known = self.known.lock();
        match Secrets::read(&self.path) {
            Ok(secrets) => *known = secrets,
            Err(bad) => tracing::warn!(reason = bad.why, "the secrets read before are still used"),
        }
        known.sign(id, timestamp_s, body)
    }
}

const EXPECTED: &str = "expected are whsec_ and base64 of 24 to 64 bytes, \
                        as of: echo \"whsec_$(openssl rand -base64 32)\"";

/// The bytes of a secret.
fn decode(line: &str) -> Option<Vec<u8>> {
    BASE64.decode(line.strip_prefix(PREFIX)?).ok()
}

impl fmt::Debug for Secrets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} secrets", self.0.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the Standard Webhooks libraries.
    const PUBLISHED: &str = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";
    const SIGNATURE: &str = "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=";

    fn sign(file: &str) -> String {
        read(file).unwrap().sign("msg_p5jXN8AQM9LWM0D4loKWxJek", 1_614_265_330, br#"{"test": 2432232314}"#)
    }

    fn read(text: impl AsRef<[u8]>) -> Result<Secrets, BadSetting> {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), text).unwrap();
        Secrets::read(file.path())
    }

    fn secret_of(n_bytes: usize) -> String {
        format!("{PREFIX}{}", STANDARD.encode(vec![7; n_bytes]))
    }

    #[test]
    fn a_signature_is_the_published_one() {
        assert_eq!(sign(PUBLISHED), SIGNATURE);
    }

    #[test]
    fn each_secret_signs_in_the_order_of_the_file() {
        let other = secret_of(32);
        let both = sign(&format!("{PUBLISHED}\n\n  {other}\r\n"));
        assert_eq!(both, format!("{SIGNATURE} {}", sign(&other)));
        assert_eq!(sign(other.trim_end_matches('=')), sign(&other));
    }

    #[test]
    fn a_secret_has_24_to_64_bytes() {
        for (n_bytes, is_secret) in [(23, false), (24, true), (64, true), (65, false)] {
            assert_eq!(read(secret_of(n_bytes)).is_ok(), is_secret, "{n_bytes}");
        }
    }

    #[test]
    fn what_is_no_secret_is_refused_without_repeating_it() {
        let unprefixed = STANDARD.encode([7; 32]);
        for text in ["", "\n", &unprefixed, "whsec_not*base64*of*anything*at*all*"] {
            let refused = read(text).unwrap_err();
            assert_eq!(refused.setting, "secret_file");
            assert!(text.trim().is_empty() || !refused.why.contains(text), "{}", refused.why);
        }
        assert!(read([0xff, 0xfe]).is_err());
        let second = read(format!("{}\n{unprefixed}", secret_of(32))).unwrap_err();
        assert!(second.why.contains("line 2"), "{}", second.why);
        assert!(Secrets::read(Path::new("/nowhere/secret")).unwrap_err().why.contains("/nowhere/secret"));
    }

    #[test]
    fn a_changed_file_counts_at_the_next_signature_unless_it_cannot_be_used() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let [old, new] = [24, 32].map(secret_of);
        fs::write(file.path(), &old).unwrap();
        let secrets = SecretFile::open(file.path()).unwrap();
        let signed = || secrets.sign("msg_1", 1, b"{}");
        let of = |text: &str| read(text).unwrap().sign("msg_1", 1, b"{}");
        for (text, expected) in [
            (format!("{old}\n{new}"), format!("{} {}", of(&old), of(&new))),
            (new.clone(), of(&new)),
            ("half a sec".to_owned(), of(&new)),
        ] {
            fs::write(file.path(), &text).unwrap();
            assert_eq!(signed(), expected, "{text}");
        }
    }

    #[test]
    fn secrets_are_not_shown() {
        let shown = format!("{:?} {:#?}", read(secret_of(32)).unwrap(), read(secret_of(32)).unwrap());
        assert_eq!(shown, "1 secrets 1 secrets");
    }
}
