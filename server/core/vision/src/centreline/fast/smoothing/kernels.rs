//! Kernels that fit a parabola to evenly spaced points: tapered least squares with equal weights for all points.

/// Largest lag, in columns, at which noise is treated as correlated.
pub const MAX_LAG: usize = 8;
/// A window whose determinant is a smaller fraction of its diagonal's product holds too few points. A parabola fitted
/// to one side of its vertex has about 0.003.
const MIN_DETERMINANT: f64 = 1e-4;

/// Weights of one point of a window.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Weights {
    /// For the value at the middle.
    pub value: f32,
    /// Its square, for the variance of the value.
    pub squared: f32,
    /// For the slope at the middle, per column.
    pub slope: f32,
}

/// Weights are stored in multiples of this length, padded with zeros.
pub const RUN: usize = 8;

/// The weights of a window, from its first point to its last; empty if it holds too few.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// For the value at the middle.
    pub value: Vec<f32>,
    /// Its square, for the variance of the value.
    pub squared: Vec<f32>,
    /// For the slope at the middle, per column.
    pub slope: Vec<f32>,
    /// Factor on the variance for noise correlated between neighbours.
    pub shared: f32,
    /// Σ value(k) value(k + lag) over Σ value², by lag.
    autocorrelation: [f64; MAX_LAG + 1],
}

/// All kernels of one length, computed on demand.
#[derive(Default)]
pub struct Kernels {
    half_length: usize,
    kernels: Vec<Option<Kernel>>,
    outwards: Vec<Weights>,
    correlations: [f64; MAX_LAG + 1],
}

impl Kernels {
    /// Prepares for windows of up to `half_length` points on either side, and for noise with these correlations.
    pub fn prepare(&mut self, half_length: usize, correlations: &[f64; MAX_LAG + 1]) {
        if half_length != self.half_length {
            self.kernels.clear();
        }
        self.half_length = half_length;
        self.correlations = *correlations;
        self.kernels.resize_with((half_length + 1) * (half_length + 1), || None);
        self.kernels.iter_mut().flatten().for_each(|kernel| kernel.share(correlations));
        self.at(half_length, half_length);
        self.outwards.clear();
        if let Some(whole) = self.kernels.last().and_then(Option::as_ref) {
            self.outwards.extend((half_length..=2 * half_length).map(|k| Weights {
                value: whole.value[k],
                squared: whole.squared[k],
                slope: whole.slope[k],
            }));
        }
    }

    /// Computes the kernels of all windows that are truncated by the ends of a line.
    pub fn prepare_cut(&mut self) {
        for before in 0..=self.half_length {
            for after in 0..=self.half_length {
                self.at(before, after);
            }
        }
    }

    /// A kernel computed before; `None` if it holds too few points.
    pub fn prepared(&self, before: usize, after: usize) -> Option<&Kernel> {
        let kernel = self.kernels[before * (self.half_length + 1) + after].as_ref();
        kernel.filter(|kernel| !kernel.value.is_empty())
    }

    /// Points on either side of the middle.
    pub fn half_length(&self) -> usize {
        self.half_length
    }

    /// Weights of a whole window from its middle outwards. Before the middle they are the same, with the opposite sign
    /// for the slope.
    pub fn outwards(&self) -> &[Weights] {
        &self.outwards
    }

    /// The kernel of a whole window.
    pub fn whole(&self) -> &Kernel {
        let last = self.kernels.last().and_then(Option::as_ref);
        last.expect("made while preparing")
    }

    /// The kernel for these numbers of points before and after the middle, each at most the half length.
    pub fn at(&mut self, before: usize, after: usize) -> &Kernel {
        let (half_length, correlations) = (self.half_length, self.correlations);
        let place = &mut self.kernels[before * (half_length + 1) + after];
        place.get_or_insert_with(|| {
            let mut kernel = Kernel::new(before, after, (half_length + 1) as f64);
            kernel.share(&correlations);
            kernel
        })
    }
}

impl Kernel {
    /// `reach` is the distance of the first point with weight zero.
    fn new(before: usize, after: usize, reach: f64) -> Self {
        let xs = || (0..before + after + 1).map(|k| (k as f64 - before as f64) / reach);
        let taper = |x: f64| 1.0 - x * x;
        let mut s = [0.0f64; 5];
        for x in xs() {
            (0..5).for_each(|power| s[power] += taper(x) * x.powi(power as i32));
        }
        let c = [
            [s[2] * s[4] - s[3] * s[3], s[2] * s[3] - s[1] * s[4], s[1] * s[3] - s[2] * s[2]],
            [s[2] * s[3] - s[1] * s[4], s[0] * s[4] - s[2] * s[2], s[1] * s[2] - s[0] * s[3]],
        ];
        let determinant = s[0] * c[0][0] + s[1] * c[0][1] + s[2] * c[0][2];
        let mut kernel = Self {
            value: vec![],
            squared: vec![],
            slope: vec![],
            shared: 1.0,
            autocorrelation: [0.0; MAX_LAG + 1],
        };
        if determinant <= MIN_DETERMINANT * s[0] * s[2] * s[4] {
            return kernel;
        }
        let rows: Vec<[f64; 2]> = xs()
            .map(|x| c.map(|row| taper(x) * (row[0] + x * (row[1] + x * row[2])) / determinant))
            .map(|[value, slope]| [value, slope / reach])
            .collect();
        let products = |lag: usize| rows.iter().zip(rows.iter().skip(lag)).map(|(a, b)| a[0] * b[0]).sum::<f64>();
        kernel.autocorrelation = std::array::from_fn(|lag| products(lag) / products(0));
        let padded = |weight: fn(&[f64; 2]) -> f64| {
            let mut weights: Vec<f32> = rows.iter().map(|row| weight(row) as f32).collect();
            weights.resize(rows.len().next_multiple_of(RUN), 0.0);
            weights
        };
        kernel.value = padded(|row| row[0]);
        kernel.squared = padded(|row| row[0] * row[0]);
        kernel.slope = padded(|row| row[1]);
        kernel
    }

    /// Sets the correlation of the noise.
    fn share(&mut self, correlations: &[f64; MAX_LAG + 1]) {
        let beyond = (1..=MAX_LAG).map(|lag| 2.0 * correlations[lag] * self.autocorrelation[lag]).sum::<f64>();
        self.shared = (1.0 + beyond).max(f64::from(f32::MIN_POSITIVE)) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_reproduces_a_parabola() {
        let mut kernels = Kernels::default();
        kernels.prepare(7, &[0.0; MAX_LAG + 1]);
        for (before, after) in [(7, 7), (0, 7), (7, 2), (3, 3)] {
            let kernel = kernels.at(before, after);
            assert_eq!(kernel.value.len(), (before + after + 1).next_multiple_of(RUN));
            assert!(kernel.value[before + after + 1..].iter().all(|&weight| weight == 0.0));
            let parabola = |x: f64| 2.0 - 0.3 * x + 0.05 * x * x;
            let sum = |weights: &[f32]| -> f64 {
                let terms = weights.iter().enumerate();
                terms.map(|(k, &weight)| f64::from(weight) * parabola(k as f64 - before as f64)).sum()
            };
            // Weights are single precision.
            assert!((sum(&kernel.value) - 2.0).abs() < 1e-5);
            assert!((sum(&kernel.slope) + 0.3).abs() < 1e-5);
        }
        assert!(kernels.at(1, 0).value.is_empty(), "two points make no parabola");
    }
}
