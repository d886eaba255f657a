//! Gauge R&R by analysis of variance (AIAG MSA 4, chapter III B and appendix A).

use super::result::{
    AnovaRow, Deviations, GaugeRr, GaugeRrError, InteractionTest, Method, Source, result_from_deviations,
};
use super::study::Study;
use crate::distributions::f_upper;
use crate::params::POOLING_P_VALUE;
use crate::sample::{mean, std_dev};

/// Sum of squares of one source.
#[derive(Clone, Copy)]
struct Squares {
    sum: f64,
    dof: usize,
}

impl Squares {
    /// Mean square; 0 without degrees of freedom.
    fn mean(self) -> f64 {
        if self.dof == 0 { 0.0 } else { self.sum / self.dof as f64 }
    }

    fn pooled_with(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, dof: self.dof + other.dof }
    }
}

struct SumsOfSquares {
    part: Squares,
    operator: Squares,
    interaction: Squares,
    repeatability: Squares,
}

/// Evaluates a study by analysis of variance with random parts and operators.
///
/// `tolerance`: upper minus lower limit of the characteristic, in the unit of the values; `None` if unknown.
///
/// Method: `server/docs/maths/capability.md`, eq. (4)–(7), after AIAG MSA 4. The interaction is pooled with repeatability
/// if its p-value is above 0.25. Negative components of variance are 0.
///
/// # Errors
/// [`GaugeRrError`] for a tolerance that is not positive, and for values without variation.
pub fn anova(study: &Study, tolerance: Option<f64>) -> Result<GaugeRr, GaugeRrError> {
    let sums = sums_of_squares(study);
    let interaction_test = (study.n_operators() > 1).then(|| test_interaction(&sums));
    let keeps_interaction = interaction_test.is_some_and(|test| !test.pooled);
    let (error, denominator) = if keeps_interaction {
        (sums.repeatability, sums.interaction)
    } else {
        let pooled = sums.repeatability.pooled_with(sums.interaction);
        (pooled, pooled)
    };
    let (n_parts, n_operators) = (study.n_parts() as f64, study.n_operators() as f64);
    let n_trials = study.n_trials() as f64;
    let component = |effect: Squares, reference: Squares, n_values: f64| {
        ((effect.mean() - reference.mean()) / n_values).max(0.0).sqrt()
    };
    let deviations = Deviations {
        repeatability: error.mean().sqrt(),
        reproducibility: (study.n_operators() > 1)
            .then(|| component(sums.operator, denominator, n_parts * n_trials)),
        interaction: keeps_interaction.then(|| component(sums.interaction, error, n_trials)),
        part_variation: component(sums.part, denominator, n_operators * n_trials),
    };
    let mut table = vec![row(Source::Part, sums.part, Some(denominator))];
    if study.n_operators() > 1 {
        table.push(row(Source::Operator, sums.operator, Some(denominator)));
    }
    if keeps_interaction {
        table.push(row(Source::Interaction, sums.interaction, Some(error)));
    }
    table.push(row(Source::Repeatability, error, None));
    result_from_deviations(study, Method::Anova { table, interaction_test }, &deviations, tolerance)
}

/// Sums of squares, eq. (4), from deviations and not from differences of large sums.
fn sums_of_squares(study: &Study) -> SumsOfSquares {
    let (n_parts, n_operators, n_trials) = (study.n_parts(), study.n_operators(), study.n_trials());
    let (part_means, operator_means, cell_means) =
        (study.part_means(), study.operator_means(), study.cell_means());
    let grand_mean = mean(&cell_means);
    let spread = |means: &[f64]| means.iter().map(|mean| (mean - grand_mean).powi(2)).sum::<f64>();
    let interaction_of = |(idx, cell_mean): (usize, &f64)| {
        let additive = part_means[idx / n_operators] + operator_means[idx % n_operators] - grand_mean;
        (cell_mean - additive).powi(2)
    };
    let interaction = if n_operators > 1 { cell_means.iter().enumerate().map(interaction_of).sum() } else { 0.0 };
    let within = |cell: &[f64]| std_dev(cell).powi(2) * (n_trials - 1) as f64;
    let repeatability = study.cells().map(within).sum();
    SumsOfSquares {
        part: Squares { sum: (n_operators * n_trials) as f64 * spread(&part_means), dof: n_parts - 1 },
        operator: Squares { sum: (n_parts * n_trials) as f64 * spread(&operator_means), dof: n_operators - 1 },
        interaction: Squares { sum: n_trials as f64 * interaction, dof: (n_parts - 1) * (n_operators - 1) },
        repeatability: Squares { sum: repeatability, dof: n_parts * n_operators * (n_trials - 1) },
    }
}

fn test_interaction(sums: &SumsOfSquares) -> InteractionTest {
    let AnovaRow { f, p_value, .. } = row(Source::Interaction, sums.interaction, Some(sums.repeatability));
    // Without repeatability every interaction is real.
    let pooled = p_value.map_or(sums.interaction.sum == 0.0, |p_value| p_value > POOLING_P_VALUE);
    InteractionTest { f, p_value, pooled }
}

fn row(source: Source, squares: Squares, denominator: Option<Squares>) -> AnovaRow {
    let denominator = denominator.filter(|denominator| denominator.mean() > 0.0);
    let f = denominator.map(|denominator| squares.mean() / denominator.mean());
    let p_value =
        f.zip(denominator).map(|(f, denominator)| f_upper(f, squares.dof as f64, denominator.dof as f64));
    AnovaRow { source, dof: squares.dof, sum_of_squares: squares.sum, mean_square: squares.mean(), f, p_value }
}
