//! Neighbouring Gaussian lines fitted together to the grey levels across them.

use nalgebra::{DMatrix, DVector};

/// Longest step of a position and of the width in one iteration, relative to the width: the model is linear over that.
const LONGEST_STEP: f64 = 0.25;
const ITERATIONS: usize = 8;

/// One of several neighbouring lines.
#[derive(Debug, Clone, Copy)]
pub struct Member {
    /// Row of its centre.
    pub v: f64,
    /// Grey levels above the background.
    pub height: f64,
}

/// Lines beside each other, with Gaussian profiles of one standard deviation on a linear background.
#[derive(Debug, Clone)]
pub struct Together {
    pub members: Vec<Member>,
    pub sigma_px: f64,
}

/// Grey levels of consecutive rows; those at full scale are not used.
pub struct Across<'a> {
    pub first_row: f64,
    pub levels: &'a [f64],
    pub is_used: &'a [bool],
}

impl Across<'_> {
    fn rows(&self) -> impl Iterator<Item = (f64, f64)> {
        let rows = (0..self.levels.len()).filter(|&k| self.is_used[k]);
        rows.map(|k| (self.first_row + k as f64, self.levels[k]))
    }
}

/// Unknowns besides the lines: level and slope of the background.
const BACKGROUND: usize = 2;

impl Together {
    /// The derivatives of the profile at a row: background, its slope, then height and position of every member.
    fn derivatives(&self, row: f64) -> Vec<f64> {
        let middle = self.members.iter().map(|member| member.v).sum::<f64>() / self.members.len() as f64;
        let mut derivatives = vec![1.0, (row - middle) / self.sigma_px];
        for member in &self.members {
            let x = (row - member.v) / self.sigma_px;
            let bell = (-0.5 * x * x).exp();
            derivatives.extend([bell, member.height * bell * x / self.sigma_px]);
        }
        derivatives
    }

    /// The derivative by the standard deviation.
    fn by_sigma(&self, row: f64) -> f64 {
        let of = |member: &Member| {
            let x = (row - member.v) / self.sigma_px;
            member.height * (-0.5 * x * x).exp() * x * x / self.sigma_px
        };
        self.members.iter().map(of).sum()
    }

    /// Sets the heights to those that fit best.
    fn set_heights(&mut self, across: &Across) -> Option<()> {
        let n = BACKGROUND + self.members.len();
        let heights_of = |row: f64| {
            let all = self.derivatives(row);
            (0..n).map(|k| if k < BACKGROUND { all[k] } else { all[2 * k - BACKGROUND] }).collect::<Vec<_>>()
        };
        let (normal, right) = normal_equations(n, across.rows().map(|(row, level)| (heights_of(row), level)));
        let found = normal.cholesky()?.solve(&right);
        self.members.iter_mut().enumerate().for_each(|(k, member)| member.height = found[BACKGROUND + k]);
        Some(())
    }

    /// Fits positions and heights, and with `with_width` the common width; `None` if the rows do not determine them.
    pub fn fitted(mut self, across: &Across, with_width: bool) -> Option<Self> {
        let n_lines = BACKGROUND + 2 * self.members.len();
        let n = n_lines + usize::from(with_width);
        for _ in 0..ITERATIONS {
            self.set_heights(across)?;
            let terms = |row: f64| {
                let mut terms = self.derivatives(row);
                if with_width {
                    terms.push(self.by_sigma(row));
                }
                terms
            };
            let (mut normal, right) = normal_equations(n, across.rows().map(|(row, level)| (terms(row), level)));
            (0..n).for_each(|k| normal[(k, k)] *= 1.0 + 1e-6);
            let found = normal.cholesky()?.solve(&right);
            let longest = LONGEST_STEP * self.sigma_px;
            let mut moved: f64 = 0.0;
            for (k, member) in self.members.iter_mut().enumerate() {
                let step = found[BACKGROUND + 2 * k + 1].clamp(-longest, longest);
                member.v += step;
                moved = moved.max(step.abs());
            }
            if with_width {
                self.sigma_px += found[n_lines].clamp(-0.5 * longest, 0.5 * longest);
            }
            if moved < 1e-3 * self.sigma_px {
                break;
            }
        }
        self.set_heights(across)?;
        Some(self)
    }

    /// For every member: its shift from its position in these rows, its height, and the variance of the shift from
    /// unit noise of every pixel and from unit speckle.
    pub fn shifts(&self, across: &Across) -> Option<Vec<Shift>> {
        let n = BACKGROUND + 2 * self.members.len();
        let rows: Vec<(Vec<f64>, f64)> =
            across.rows().map(|(row, level)| (self.derivatives(row), level)).collect();
        let (normal, right) = normal_equations(n, rows.iter().cloned());
        let factor = normal.cholesky()?;
        let found = factor.solve(&right);
        let inverse = factor.inverse();
        let of = |k: usize| {
            let at = BACKGROUND + 2 * k + 1;
            let (member, height) = (self.members[k], found[at - 1]);
            // The derivative holds the member's mean height; in this column it may be lower.
            let scale = member.height / height.max(0.3 * member.height);
            let mut shift = Shift { shift: scale * found[at], height, per_noise: 0.0, per_speckle: 0.0 };
            for (terms, level) in &rows {
                let weight = scale * (0..n).map(|j| inverse[(at, j)] * terms[j]).sum::<f64>();
                let light = (level - found[0] - found[1] * terms[1]).max(0.0);
                shift.per_noise += weight * weight;
                shift.per_speckle += (weight * light).powi(2);
            }
            shift
        };
        Some((0..self.members.len()).map(of).collect())
    }
}

/// Where one member lies in one column.
#[derive(Debug, Clone, Copy)]
pub struct Shift {
    /// Rows from the member's position.
    pub shift: f64,
    /// Grey levels above the background.
    pub height: f64,
    /// Variance per unit variance of the pixels, px² per level².
    pub per_noise: f64,
    /// Variance per unit of squared speckle contrast, px².
    pub per_speckle: f64,
}

fn normal_equations(n: usize, rows: impl Iterator<Item = (Vec<f64>, f64)>) -> (DMatrix<f64>, DVector<f64>) {
    let (mut normal, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (terms, level) in rows {
        for i in 0..n {
            right[i] += terms[i] * level;
            for j in 0..n {
                normal[(i, j)] += terms[i] * terms[j];
            }
        }
    }
    (normal, right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_lines_less_than_a_width_apart_are_located() {
        let truth = Together {
            members: vec![Member { v: 20.3, height: 90.0 }, Member { v: 25.1, height: 60.0 }],
            sigma_px: 2.4,
        };
        let level = |row: f64| {
            let of = |m: &Member| m.height * (-0.5 * ((row - m.v) / truth.sigma_px).powi(2)).exp();
            7.0 + 0.1 * row + truth.members.iter().map(of).sum::<f64>()
        };
        let levels: Vec<f64> = (8..38).map(|row| level(f64::from(row))).collect();
        let across = Across { first_row: 8.0, levels: &levels, is_used: &[true; 30] };
        let start = Together { members: [19.5, 26.0].map(|v| Member { v, height: 1.0 }).to_vec(), sigma_px: 2.2 };
        let fitted = start.fitted(&across, true).unwrap();
        for (found, truth) in fitted.members.iter().zip(&truth.members) {
            assert!((found.v - truth.v).abs() < 0.01, "{found:?}");
        }
        assert!((fitted.sigma_px - truth.sigma_px).abs() < 0.01);
    }
}
