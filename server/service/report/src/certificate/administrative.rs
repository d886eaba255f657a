//! The first part of a certificate: software, dates, the station and its parts, the people, statements.

use calibration::CalibrationDocument;

use super::element::{Element, LANGUAGE, leaf, parent, words};
use super::{Certificate, StationPart};

/// That nobody may take the certificate for one of an accredited laboratory.
const NOT_ACCREDITED: &str = "This certificate was written by the program of the station itself. It is not a \
    certificate of an accredited calibration laboratory: no accreditation body has confirmed competence by \
    ISO/IEC 17025 for these results.";

/// What the results can be traced to.
const TRACEABILITY: &str = "Lengths are traceable only as far as the dimensions of the calibration board are. Its \
    certificate and its uncertainty are not known to the program, and are not part of the stated uncertainties.";

/// What the results are about.
const SCOPE: &str = "The results refer to the station as it was when the images were captured.";

/// The administrative data.
pub fn data(document: &CalibrationDocument, certificate: &Certificate) -> Element {
    let issuer = &certificate.issuer;
    parent(
        "dcc:administrativeData",
        [
            parent("dcc:dccSoftware", [software(env!("CARGO_PKG_VERSION"), "Writes this certificate.")]),
            core_data(document, certificate),
            items(certificate),
            parent("dcc:calibrationLaboratory", [issuer.laboratory.element("dcc:contact")]),
            persons(&issuer.responsible),
            issuer.customer.element("dcc:customer"),
            statements(certificate),
        ],
    )
}

/// This program in a version.
pub fn software(version: &str, purpose: &str) -> Element {
    parent(
        "dcc:software",
        [
            parent("dcc:name", [leaf("dcc:content", "Sheaf")]),
            leaf("dcc:release", format!("v{version}")),
            leaf("dcc:type", "application"),
            words("dcc:description", purpose),
        ],
    )
}

fn core_data(document: &CalibrationDocument, certificate: &Certificate) -> Element {
    let Certificate { issuer, begun, ended, issued, .. } = certificate;
    let id = &document.calibration.id;
    parent(
        "dcc:coreData",
        [
            leaf("dcc:countryCodeISO3166_1", &issuer.laboratory.country),
            leaf("dcc:usedLangCodeISO639_1", LANGUAGE),
            leaf("dcc:mandatoryLangCodeISO639_1", LANGUAGE),
            leaf("dcc:uniqueIdentifier", format!("sheaf-{id}-{issued}")),
            parent("dcc:identifications", [identification("other", id, "Id of the calibration document")]),
            leaf("dcc:beginPerformanceDate", begun.to_string()),
            leaf("dcc:endPerformanceDate", ended.to_string()),
            leaf("dcc:performanceLocation", issuer.place.name()),
            leaf("dcc:issueDate", issued.to_string()),
        ],
    )
}

fn identification(issuer: &str, value: &str, name: &str) -> Element {
    parent("dcc:identification", [leaf("dcc:issuer", issuer), leaf("dcc:value", value), words("dcc:name", name)])
}

/// The station, with the devices whose serial numbers are known as parts of it.
fn items(certificate: &Certificate) -> Element {
    let has_serial = |part: &&StationPart| !part.serial.trim().is_empty();
    let mut station = vec![
        words("dcc:name", "Laser line scanner: camera, line projector and stage"),
        words("dcc:description", description(&certificate.parts)),
        parent(
            "dcc:identifications",
            [identification("owner", &certificate.issuer.station_number, "Inventory or serial number")],
        ),
    ];
    let parts: Vec<Element> = certificate.parts.iter().filter(has_serial).map(item).collect();
    if !parts.is_empty() {
        station.push(parent("dcc:subItems", parts));
    }
    parent("dcc:items", [parent("dcc:item", station)])
}

/// Which devices are known, and which have no serial number.
fn description(parts: &[StationPart]) -> String {
    if parts.is_empty() {
        return "The devices that captured the images are not known to the program.".to_owned();
    }
    let nameless = parts.iter().filter(|part| part.serial.trim().is_empty()).map(|part| {
        let model = [part.vendor.as_str(), part.model.as_str()].join(" ");
        match model.trim() {
            "" => part.part.clone(),
            model => format!("{} ({model})", part.part),
        }
    });
    match nameless.collect::<Vec<_>>().join(", ") {
        none if none.is_empty() => "Its devices state their serial numbers.".to_owned(),
        some => format!("Devices that state no serial number: {some}."),
    }
}

fn item(part: &StationPart) -> Element {
    let filled = |text: &str, element: Element| Some(element).filter(|_| !text.trim().is_empty());
    let firmware = format!("Firmware: {}", part.firmware);
    let vendor = parent("dcc:manufacturer", [parent("dcc:name", [leaf("dcc:content", &part.vendor)])]);
    let serial =
        identification("manufacturer", &part.serial, "Serial number").with("refType", "basic_serialNumber");
    let parts = [
        Some(words("dcc:name", &part.part)),
        filled(&part.firmware, words("dcc:description", firmware)),
        filled(&part.vendor, vendor),
        filled(&part.model, leaf("dcc:model", &part.model)),
        Some(parent("dcc:identifications", [serial])),
    ];
    parent("dcc:item", parts.into_iter().flatten())
}

fn persons(names: &[String]) -> Element {
    let names = names.iter().filter(|name| !name.trim().is_empty()).enumerate();
    let person = |(idx, name): (usize, &String)| {
        let person = parent("dcc:person", [parent("dcc:name", [leaf("dcc:content", name)])]);
        let signer = (idx == 0).then(|| leaf("dcc:mainSigner", "true"));
        parent("dcc:respPerson", [Some(person), signer].into_iter().flatten())
    };
    parent("dcc:respPersons", names.map(person))
}

fn statements(certificate: &Certificate) -> Element {
    let statement = |name: &str, traceable: Option<bool>, text: &str| {
        let parts = [
            Some(words("dcc:name", name)),
            traceable.map(|traceable| leaf("dcc:traceable", traceable.to_string())),
            Some(words("dcc:declaration", text)),
        ];
        parent("dcc:statement", parts.into_iter().flatten())
    };
    let simulated = certificate.simulated.as_ref().map(|devices| {
        let text =
            format!("The devices were simulated ({devices}): this is not the calibration of a real station.");
        statement("Simulated devices", None, &text)
    });
    let all = [
        Some(statement("Not accredited", None, NOT_ACCREDITED)),
        Some(statement("Traceability", Some(false), TRACEABILITY)),
        Some(statement("Scope", None, SCOPE)),
        simulated,
    ];
    parent("dcc:statements", all.into_iter().flatten())
}
