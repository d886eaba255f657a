//! The model of a blurred chessboard corner.
//!
//! Two edges cross; the signed distances to them are d₁ and d₂. An isotropic Gaussian blur of sign(d₁)·sign(d₂) is,
//! with x = d₁/σ, y = d₂/σ and ρ the cosine between the edge normals,
//!
//! S(x, y; ρ) = 4 Φ₂(x, y; ρ) − 2 Φ(x) − 2 Φ(y) + 1 = erf(x/√2) erf(y/√2) + 4 φ(x) φ(y) (ρ + ρ² x y / 2 + ρ³
//! (x²−1)(y²−1) / 6 + …)
//!
//! (tetrachoric series of the bivariate normal Φ₂). The pixel's own box adds 1/12 px² to σ².

/// Local shape of the crossing: two edges with their curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossShape {
    /// Angles of the edge normals (rad); the first points to the next board column, the second to the next row.
    pub normal_rad: [f64; 2],
    /// Curvature of each edge, positive towards its normal (1/px).
    pub curvature_per_px: [f64; 2],
    /// Blur (Gaussian sigma, pixel box included).
    pub blur_px: f64,
}
