//! The smooth map from board to image: a homography and a low-degree polynomial for the lens.
//!
//! It is used for directions and curvatures only, not for positions, so that the errors of the corners remain
//! independent.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::corners::params::{CORNERS_PER_TERM, MAX_DEGREE};

/// Board index (column, row) to pixel.
#[derive(Debug, Clone)]
pub struct BoardWarp {
    homography: Matrix3<f64>,
    centre: [f64; 2],
    scale: f64,
    /// Degree of the lens polynomial; 0 without one.
    degree: usize,
    coefficients: [Vec<f64>; 2],
}

/// Edge directions at one corner.
#[derive(Debug, Clone, Copy)]
pub struct LocalShape {
    /// Pixels per square along the board's columns and rows: d(u, v)/d column, d(u, v)/d row.
    pub square_px: [[f64; 2]; 2],
    /// Angles of the normals of the two edges (rad), towards the next column and the next row.
    pub normal_rad: [f64; 2],
    /// Curvatures of the edges, positive towards the normal (1/px).
    pub curvature_per_px: [f64; 2],
}

impl BoardWarp {
    /// Fits the map to pairs of board index and pixel; `None` for fewer than four corners or collinear ones.
    pub fn fit(pairs: &[([f64; 2], [f64; 2])]) -> Option<Self> {
        let homography = fit_homography(pairs)?;
        let n = pairs.len() as f64;
        let centre = [0, 1].map(|k| pairs.iter().map(|p| p.1[k]).sum::<f64>() / n);
        let distance2 = |p: &[f64; 2]| (p[0] - centre[0]).powi(2) + (p[1] - centre[1]).powi(2);
        let scale = pairs.iter().map(|p| distance2(&p.1)).fold(0.0, f64::max).sqrt();
        let degree = (2..=MAX_DEGREE).rev().find(|&d| pairs.len() >= CORNERS_PER_TERM * n_terms(d));
        let degree = degree.unwrap_or(0);
        let mut warp = Self { homography, centre, scale, degree, coefficients: [Vec::new(), Vec::new()] };
        if degree > 0 {
            warp.fit_polynomial(pairs)?;
        }
        Some(warp)
    }

    /// The homography alone, for extrapolation well outside the corners; `None` as for [`Self::fit`].
    pub fn plain(pairs: &[([f64; 2], [f64; 2])]) -> Option<Self> {
        let homography = fit_homography(pairs)?;
        Some(Self { homography, centre: [0.0; 2], scale: 1.0, degree: 0, coefficients: [Vec::new(), Vec::new()] })
    }

    fn fit_polynomial(&mut self, pairs: &[([f64; 2], [f64; 2])]) -> Option<()> {
        let ideal: Vec<[f64; 2]> = pairs.iter().map(|p| project(&self.homography, p.0)).collect();
        let n_terms = n_terms(self.degree);
        let terms: Vec<f64> = ideal.iter().flat_map(|&p| self.terms(p).into_iter().take(n_terms)).collect();
        let rows = DMatrix::from_row_slice(pairs.len(), n_terms, &terms);
        let normal = (rows.transpose() * &rows).cholesky()?;
        self.coefficients = [0, 1].map(|axis| {
            let right = DVector::from_fn(pairs.len(), |i, _| pairs[i].1[axis] - ideal[i][axis]);
            normal.solve(&(rows.transpose() * right)).as_slice().to_vec()
        });
        Some(())
    }

    /// All products of powers of the normalised coordinates up to the degree.
    fn terms(&self, p: [f64; 2]) -> [f64; MAX_TERMS] {
        let (x, y) = ((p[0] - self.centre[0]) / self.scale, (p[1] - self.centre[1]) / self.scale);
        let (mut xs, mut ys) = ([1.0; MAX_DEGREE + 1], [1.0; MAX_DEGREE + 1]);
        for k in 0..self.degree {
            (xs[k + 1], ys[k + 1]) = (xs[k] * x, ys[k] * y);
        }
        let mut terms = [0.0; MAX_TERMS];
        let mut next = 0;
        for d in 0..=self.degree {
            for k in 0..=d {
                terms[next] = xs[d - k] * ys[k];
                next += 1;
            }
        }
        terms
    }

    /// Pixel of the board index (column, row).
    pub fn at(&self, index: [f64; 2]) -> [f64; 2] {
        let ideal = project(&self.homography, index);
        let terms = self.terms(ideal);
        [0, 1].map(|axis| {
            let bend: f64 = self.coefficients[axis].iter().zip(&terms).map(|(c, t)| c * t).sum();
            ideal[axis] + bend
        })
    }

    /// Directions, spacing and edge curvatures at a board index, by central differences over half a square.
    pub fn shape_at(&self, index: [f64; 2]) -> LocalShape {
        let here = self.at(index);
        let along = |axis: usize| {
            let mut ahead = index;
            let mut behind = index;
            ahead[axis] += 0.5;
            behind[axis] -= 0.5;
            let (a, b) = (self.at(ahead), self.at(behind));
            ([a[0] - b[0], a[1] - b[1]], [0, 1].map(|k| 4.0 * (a[k] + b[k] - 2.0 * here[k])))
        };
        let ((by_column, bend_column), (by_row, bend_row)) = (along(0), along(1));
        let normals = edge_normals([by_column, by_row]);
        // The edge whose normal points to the next column runs along the rows, and vice versa.
        let curvature = |normal: f64, tangent: [f64; 2], bend: [f64; 2]| {
            (normal.cos() * bend[0] + normal.sin() * bend[1]) / (tangent[0].powi(2) + tangent[1].powi(2))
        };
        LocalShape {
            square_px: [by_column, by_row],
            normal_rad: normals,
            curvature_per_px: [
                curvature(normals[0], by_row, bend_row),
                curvature(normals[1], by_column, bend_column),
            ],
        }
    }
}

/// Normals (rad) of the two edges through a corner: the first perpendicular to the row direction on the side
/// of the next column, the second perpendicular to the column direction on the side of the next row.
pub fn edge_normals(square_px: [[f64; 2]; 2]) -> [f64; 2] {
    let [c, r] = square_px;
    let towards = |edge: [f64; 2], side: [f64; 2]| {
        let normal = [edge[1], -edge[0]];
        let sign = (normal[0] * side[0] + normal[1] * side[1]).signum();
        (sign * normal[1]).atan2(sign * normal[0])
    };
    [towards(r, c), towards(c, r)]
}

/// Terms of the lens polynomial of the highest degree.
const MAX_TERMS: usize = n_terms(MAX_DEGREE);

/// Terms of a polynomial of `degree` in two variables.
const fn n_terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

fn project(h: &Matrix3<f64>, p: [f64; 2]) -> [f64; 2] {
    let q = h * Vector3::new(p[0], p[1], 1.0);
    [q.x / q.z, q.y / q.z]
}

/// Direct linear transform on centred, scaled coordinates (Hartley & Zisserman, 4.4).
fn fit_homography(pairs: &[([f64; 2], [f64; 2])]) -> Option<Matrix3<f64>> {
    if pairs.len() < 4 {
        return None;
    }
    let from = normalisation(pairs.iter().map(|p| p.0))?;
    let to = normalisation(pairs.iter().map(|p| p.1))?;
    let mut normal = nalgebra::SMatrix::<f64, 9, 9>::zeros();
    for (source, target) in pairs {
        let s = from * Vector3::new(source[0], source[1], 1.0);
        let t = to * Vector3::new(target[0], target[1], 1.0);
        for row in [
            [s.x, s.y, 1.0, 0.0, 0.0, 0.0, -t.x * s.x, -t.x * s.y, -t.x],
            [0.0, 0.0, 0.0, s.x, s.y, 1.0, -t.y * s.x, -t.y * s.y, -t.y],
        ] {
            let row = nalgebra::SVector::<f64, 9>::from(row);
            normal += row * row.transpose();
        }
    }
    let eigen = normal.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let h = eigen.eigenvectors.column(smallest);
    let h = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(to.try_inverse()? * h * from)
}

/// Similarity that moves the points' mean to the origin and their RMS distance to √2.
fn normalisation(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Matrix3<f64>> {
    let n = points.clone().count() as f64;
    let mean = [0, 1].map(|k| points.clone().map(|p| p[k]).sum::<f64>() / n);
    let spread = points.map(|p| (p[0] - mean[0]).powi(2) + (p[1] - mean[1]).powi(2)).sum::<f64>() / n;
    let s = (2.0 / spread).sqrt();
    s.is_finite().then(|| Matrix3::new(s, 0.0, -s * mean[0], 0.0, s, -s * mean[1], 0.0, 0.0, 1.0))
}
