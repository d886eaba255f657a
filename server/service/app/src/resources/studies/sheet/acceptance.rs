//! The report of an acceptance test.

use metrology::PartVerdict;
use metrology::acceptance::{
    AcceptancePlan, AcceptanceResult, Dispersion, Figures, OrderMean, Procedure, Quantity, QuantityResult,
};
use report::study::{SheetChart, SheetTable, StudySheet};

use super::{label, or_dash, um};
use crate::resources::studies::{Study, StudyPosition};

pub(super) fn fill(
    sheet: StudySheet,
    study: &Study,
    plan: &AcceptancePlan,
    result: &AcceptanceResult,
) -> StudySheet {
    let positions = &study.body.positions;
    let mut facts = sheet.facts;
    facts.extend(artefacts(plan));
    facts.extend(positions.first().map(|position| ("calibration", position.calibration_id.clone())));
    let mut tables = vec![results(result)];
    tables.extend(heights(result));
    tables.extend(plan.procedures().filter_map(|procedure| positions_of(procedure, positions, result)));
    tables.extend(orders(positions));
    StudySheet {
        simulated: positions.iter().any(|position| position.simulated),
        criteria: vec![
            "after VDI/VDE 2634-2 and -3 and ISO 10360-13: an error is OK if it is within its limit (MPE) by the uncertainty \
             of the test or more, and NOT OK if it is beyond by more (ISO 14253-1); the worst position counts"
                .to_owned(),
            "form: all points inside the outline but the 3 of 1000 farthest from the least-squares feature; D95: the narrowest \
             band with 95 % of all points"
                .to_owned(),
            "the uncertainty of the test contains the artefact (certificate, form) and its temperature (0.5 K, 10 % of its \
             expansion), and for a standard deviation the number of scans; U with k = 2"
                .to_owned(),
        ],
        facts,
        tables,
        charts: result.quantities.iter().filter_map(chart).collect(),
        ..sheet
    }
}

fn name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::ProbingForm => "probing error of form PF",
        Quantity::ProbingFormD95 => "probing dispersion D95",
        Quantity::ProbingSize => "probing error of size PS",
        Quantity::SphereSpacing => "sphere spacing error SD",
        Quantity::Flatness => "flatness error F",
        Quantity::FlatnessD95 => "flatness dispersion D95",
        Quantity::Linearity => "linearity along z",
        Quantity::RepeatabilitySingle => "repeatability along z, single point, 1 sigma",
        Quantity::RepeatabilityAveraged => "repeatability along z, averaged, 1 sigma",
    }
}

fn artefacts(plan: &AcceptancePlan) -> Vec<(&'static str, String)> {
    let mut facts = Vec::new();
    if let Some(ball) = &plan.sphere {
        let text = format!(
            "{}: diameter {} mm, U {} µm, form {} µm",
            ball.artefact,
            ball.diameter_mm,
            um(ball.uncertainty_mm),
            um(ball.form_mm)
        );
        facts.push(("ball", text));
    }
    if let Some(pair) = &plan.sphere_pair {
        let text =
            format!("{}: distance {} mm, U {} µm", pair.artefact, pair.distance_mm, um(pair.uncertainty_mm));
        facts.push(("ball bar", text));
    }
    if let Some(plate) = &plan.plate {
        facts.push(("plate", format!("{}: flatness {} µm", plate.artefact, um(plate.form_mm))));
    }
    if let Some(test) = &plan.linearity {
        facts.push(("heights", format!("{}: U {} µm", test.artefact, um(test.uncertainty_mm))));
    }
    facts.extend(plan.repeatability.iter().map(|test| ("repeated plate", test.artefact.clone())));
    facts
}

fn results(result: &AcceptanceResult) -> SheetTable {
    let row = |found: &QuantityResult| {
        let uncertainties = found.errors.iter().map(|error| error.test_uncertainty_mm);
        let largest = uncertainties.collect::<Option<Vec<f64>>>().and_then(|all| all.into_iter().reduce(f64::max));
        vec![
            name(found.quantity).to_owned(),
            or_dash(found.worst_mm.map(um)),
            or_dash(found.mpe_mm.map(um)),
            or_dash(largest.map(um)),
            found.errors.len().to_string(),
            label(found.verdict),
        ]
    };
    let is_bad = |found: &QuantityResult| found.verdict.is_some_and(|verdict| verdict != PartVerdict::Ok);
    let marked = result.quantities.iter().enumerate().filter(|(_, found)| is_bad(found));
    SheetTable {
        title: "Results".to_owned(),
        about: "In micrometres. U is missing if the temperature of a position is not stated.".to_owned(),
        head: vec!["quantity", "worst", "MPE", "U of test", "errors", "verdict"],
        rows: result.quantities.iter().map(row).collect(),
        marked: marked.map(|(idx, _)| idx).collect(),
    }
}

/// Linearity and repeatability as makers of line scanners state them.
fn heights(result: &AcceptanceResult) -> Option<SheetTable> {
    let fact = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = Vec::new();
    if let Some(found) = &result.linearity {
        rows.extend([
            fact("linearity, least-squares line, µm", um(found.largest_mm.abs())),
            fact("linearity, % of full scale", format!("{:.4}", found.percent_of_range)),
            fact("linearity, peak to peak, µm", um(found.peak_to_peak_mm)),
            fact("full scale: heights covered, mm", format!("{:.3}", found.range_mm)),
            fact("slope of the line", format!("{:.6}", found.slope)),
            fact("points averaged for a height, at least", found.n_averaged.to_string()),
        ]);
    }
    if let Some(found) = &result.repeatability {
        rows.extend([
            fact("repeatability of a single point, 1 sigma, µm", um(found.single_mm)),
            fact("repeatability averaged, 1 sigma, µm", um(found.averaged_mm)),
            fact("points averaged, at least", found.n_averaged.to_string()),
            fact("scans", found.n_scans.to_string()),
        ]);
    }
    (!rows.is_empty()).then(|| SheetTable {
        title: "Heights of a plate".to_owned(),
        about: "As makers of line scanners state them: the line is the least-squares line through all heights."
            .to_owned(),
        head: vec!["figure", "value"],
        rows,
        marked: Vec::new(),
    })
}

/// The scatter of the points of a position: of both balls of a pair, the larger.
fn dispersion(figures: &Figures) -> Dispersion {
    match figures {
        Figures::Ball(ball) => ball.dispersion,
        Figures::Plate(plate) => plate.dispersion,
        Figures::Pair { balls: [a, b], .. } => Dispersion {
            n_points: a.dispersion.n_points + b.dispersion.n_points,
            n_rejected: a.dispersion.n_rejected + b.dispersion.n_rejected,
            range_mm: a.dispersion.range_mm.max(b.dispersion.range_mm),
            d95_mm: a.dispersion.d95_mm.max(b.dispersion.d95_mm),
        },
    }
}

fn positions_of(
    procedure: Procedure,
    positions: &[StudyPosition],
    result: &AcceptanceResult,
) -> Option<SheetTable> {
    let signed = match procedure {
        Procedure::Sphere => Some(Quantity::ProbingSize),
        Procedure::SpherePair => Some(Quantity::SphereSpacing),
        Procedure::Linearity => Some(Quantity::Linearity),
        Procedure::Plate | Procedure::Repeatability => None,
    };
    let errors = result.quantities.iter().find(|found| Some(found.quantity) == signed);
    let row = |(number, (idx, position)): (usize, (usize, &StudyPosition))| {
        let shown = dispersion(&position.position.figures);
        let of_position = errors.and_then(|found| found.errors.iter().find(|error| error.position_idx == idx));
        vec![
            format!("{number} {}", position.scan_name),
            place(&position.position.figures),
            or_dash(position.position.temperature_c.map(|celsius| format!("{celsius:.1}"))),
            shown.n_points.to_string(),
            shown.n_rejected.to_string(),
            um(shown.range_mm),
            um(shown.d95_mm),
            or_dash(position.position.reference_mm.map(|height| format!("{height:.4}"))),
            or_dash(of_position.map(|error| um(error.error_mm))),
        ]
    };
    let of_procedure =
        positions.iter().enumerate().filter(|(_, position)| position.position.procedure == procedure);
    let rows: Vec<Vec<String>> = (1..).zip(of_procedure).map(row).collect();
    (!rows.is_empty()).then(|| SheetTable {
        title: format!("Positions: {}", procedure.name().replace('_', " ")),
        about: "Place in the part frame, mm. Range (without the rejected points), D95 and error in micrometres."
            .to_owned(),
        head: vec!["scan", "place", "°C", "points", "rejected", "range", "D95", "height, mm", "error"],
        rows,
        marked: Vec::new(),
    })
}

/// Where the artefact was: the centre of a ball, the middle of a pair, the centroid of a plate.
fn place(figures: &Figures) -> String {
    let [x, y, z] = match figures {
        Figures::Ball(ball) => ball.centre_mm,
        Figures::Plate(plate) => plate.point_mm,
        Figures::Pair { balls: [a, b], .. } => [0, 1, 2].map(|k| (a.centre_mm[k] + b.centre_mm[k]) / 2.0),
    };
    format!("{x:.0} {y:.0} {z:.0}")
}

/// Mean residual of every order over all positions.
fn orders(positions: &[StudyPosition]) -> Option<SheetTable> {
    let of_position = |position: &StudyPosition| -> Vec<OrderMean> {
        match &position.position.figures {
            Figures::Ball(ball) => ball.per_order.clone(),
            Figures::Plate(plate) => plate.per_order.clone(),
            Figures::Pair { balls, .. } => balls.iter().flat_map(|ball| ball.per_order.clone()).collect(),
        }
    };
    let all: Vec<OrderMean> = positions.iter().flat_map(of_position).collect();
    let mut orders: Vec<i8> = all.iter().map(|mean| mean.order).collect();
    orders.sort_unstable();
    orders.dedup();
    let row = |order: &i8| {
        let of_order = || all.iter().filter(|mean| mean.order == *order);
        let n_points: usize = of_order().map(|mean| mean.n_points).sum();
        let sum: f64 = of_order().map(|mean| mean.mean_mm * mean.n_points as f64).sum();
        let largest = of_order().map(|mean| mean.mean_mm.abs()).fold(0.0, f64::max);
        vec![order.to_string(), n_points.to_string(), um(sum / n_points.max(1) as f64), um(largest)]
    };
    (!orders.is_empty()).then(|| SheetTable {
        title: "Orders".to_owned(),
        about: "Mean distance of the points of an order from the least-squares feature, in micrometres: over all positions, \
                and the largest of one position."
            .to_owned(),
        head: vec!["order", "points", "mean", "largest"],
        rows: orders.iter().map(row).collect(),
        marked: Vec::new(),
    })
}

fn chart(found: &QuantityResult) -> Option<SheetChart> {
    let is_signed =
        matches!(found.quantity, Quantity::ProbingSize | Quantity::SphereSpacing | Quantity::Linearity);
    let limits = found.mpe_mm.map_or_else(Vec::new, |mpe_mm| match is_signed {
        true => vec![-1000.0 * mpe_mm, 1000.0 * mpe_mm],
        false => vec![1000.0 * mpe_mm],
    });
    (found.errors.len() > 1).then(|| SheetChart {
        title: name(found.quantity).to_owned(),
        x: "position",
        y: "µm".to_owned(),
        values: found.errors.iter().map(|error| 1000.0 * error.error_mm).collect(),
        rules: limits,
    })
}
