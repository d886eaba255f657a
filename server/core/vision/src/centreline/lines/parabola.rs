//! A parabola through weighted points.

/// Coefficients and their covariance.
pub struct Parabola {
    coefficients: [f64; 3],
    covariance: [[f64; 3]; 3],
}

impl Parabola {
    /// Value at `x` and its variance, if the points' errors are independent with variance 1 / weight.
    pub fn at(&self, x: f64) -> (f64, f64) {
        let powers = [1.0, x, x * x];
        let value = (0..3).map(|i| self.coefficients[i] * powers[i]).sum();
        let variance =
            (0..3).map(|i| (0..3).map(|j| powers[i] * self.covariance[i][j] * powers[j]).sum::<f64>()).sum();
        (value, variance)
    }
}

/// Fits a parabola to (x, y, weight) by least squares; `None` with fewer than three different x.
pub fn parabola(points: impl Iterator<Item = (f64, f64, f64)>) -> Option<Parabola> {
    let (mut s, mut t) = ([0.0f64; 5], [0.0f64; 3]);
    for (x, y, weight) in points {
        let mut moment = weight;
        for k in 0..5 {
            s[k] += moment;
            if k < 3 {
                t[k] += moment * y;
            }
            moment *= x;
        }
    }
    let covariance = inverse_rows(&s)?;
    let coefficients = covariance.map(|row| (0..3).map(|j| row[j] * t[j]).sum());
    Some(Parabola { coefficients, covariance })
}

/// Rows of the inverse of the normal matrix of a parabola with moments `s`; `None` if it is singular.
fn inverse_rows(s: &[f64; 5]) -> Option<[[f64; 3]; 3]> {
    let cofactors = [
        [s[2] * s[4] - s[3] * s[3], s[2] * s[3] - s[1] * s[4], s[1] * s[3] - s[2] * s[2]],
        [s[2] * s[3] - s[1] * s[4], s[0] * s[4] - s[2] * s[2], s[1] * s[2] - s[0] * s[3]],
        [s[1] * s[3] - s[2] * s[2], s[1] * s[2] - s[0] * s[3], s[0] * s[2] - s[1] * s[1]],
    ];
    let determinant = s[0] * cofactors[0][0] + s[1] * cofactors[0][1] + s[2] * cofactors[0][2];
    (determinant > 1e-9 * s[0] * s[2] * s[4]).then(|| cofactors.map(|row| row.map(|c| c / determinant)))
}
