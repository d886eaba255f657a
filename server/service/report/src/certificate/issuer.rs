//! Who issues a certificate, for whom, and for which station.

use std::borrow::Cow;

use remedy::Remedy;

use super::element::{Element, leaf, parent};

/// Who issues certificates, for whom, and what identifies the station.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Issuer {
    /// The laboratory, or whoever calibrates.
    pub laboratory: Contact,
    /// The customer.
    pub customer: Contact,
    /// The persons who answer for the results; the first one signs.
    pub responsible: Vec<String>,
    /// Inventory or serial number of the station.
    pub station_number: String,
    /// Where the calibration takes place.
    pub place: Place,
}

/// Name and address.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Contact {
    /// Name.
    pub name: String,
    /// Street and number; may be empty.
    pub street: String,
    /// Post code; may be empty.
    pub post_code: String,
    /// City.
    pub city: String,
    /// Country: two capital letters, ISO 3166-1.
    pub country: String,
    /// E-mail address; may be empty.
    pub email: String,
}

/// Where a calibration takes place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Place {
    /// At the laboratory.
    Laboratory,
    /// At the customer's.
    Customer,
    /// Anywhere else.
    #[default]
    Other,
}

/// Why a certificate cannot be issued.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CertificateError {
    /// Entries are missing.
    #[error("settings that a certificate requires are missing: {}", .entries.join(", "))]
    Missing {
        /// The settings.
        entries: Vec<String>,
    },
    /// A country is no code.
    #[error("{entry} is \"{found}\", which is not a country code")]
    NoCountry {
        /// The setting.
        entry: String,
        /// As found.
        found: String,
    },
}

impl Remedy for CertificateError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::Missing { .. } => {
                "set them in the configuration: its table [certificate] states who issues certificates, and for whom"
                    .into()
            }
            Self::NoCountry { entry, .. } => {
                format!("set {entry} to two capital letters of ISO 3166-1, such as DE").into()
            }
        })
    }
}

impl Issuer {
    /// Whether everything is set that a certificate has to state.
    ///
    /// # Errors
    /// [`CertificateError`] names the entries that are missing or wrong.
    pub fn check(&self) -> Result<(), CertificateError> {
        let contacts = [("certificate.laboratory", &self.laboratory), ("certificate.customer", &self.customer)];
        let mut needed: Vec<(String, &str)> = contacts
            .iter()
            .flat_map(|(table, contact)| {
                let of = |name: &str| format!("{table}.{name}");
                [(of("name"), &*contact.name), (of("city"), &*contact.city), (of("country"), &*contact.country)]
            })
            .collect();
        let person = self.responsible.iter().find(|name| !name.trim().is_empty());
        needed.push(("certificate.responsible".to_owned(), person.map_or("", String::as_str)));
        needed.push(("certificate.station_number".to_owned(), &self.station_number));
        let entries: Vec<String> =
            needed.into_iter().filter(|(_, value)| value.trim().is_empty()).map(|(entry, _)| entry).collect();
        if !entries.is_empty() {
            return Err(CertificateError::Missing { entries });
        }
        let is_code = |code: &str| code.len() == 2 && code.bytes().all(|letter| letter.is_ascii_uppercase());
        match contacts.iter().find(|(_, contact)| !is_code(&contact.country)) {
            Some((table, contact)) => Err(CertificateError::NoCountry {
                entry: format!("{table}.country"),
                found: contact.country.clone(),
            }),
            None => Ok(()),
        }
    }
}

impl Contact {
    /// The contact as an element of this name.
    pub(super) fn element(&self, name: &'static str) -> Element {
        let filled = |name, text: &str| Some(leaf(name, text)).filter(|_| !text.trim().is_empty());
        let address = [
            filled("dcc:street", &self.street),
            filled("dcc:postCode", &self.post_code),
            filled("dcc:city", &self.city),
            filled("dcc:countryCode", &self.country),
        ];
        let parts = [
            Some(parent("dcc:name", [leaf("dcc:content", &self.name)])),
            filled("dcc:eMail", &self.email),
            Some(parent("dcc:location", address.into_iter().flatten())),
        ];
        parent(name, parts.into_iter().flatten())
    }
}

impl Place {
    /// As the schema names it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Laboratory => "laboratory",
            Self::Customer => "customer",
            Self::Other => "other",
        }
    }
}
