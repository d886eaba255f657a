//! Normal equations with the arrow structure of bundle adjustment: a few global parameters that any residual may depend
//! on, and blocks of six (poses) that are independent of each other (`docs/maths/calibration.md`, eq. 4–7).

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

/// Sums over the residuals of one block.
#[derive(Debug, Clone)]
pub struct BlockNormal {
    /// Global–global, upper triangle filled.
    pub gg: DMatrix<f64>,
    /// Global–block, globals × 6.
    pub gb: DMatrix<f64>,
    /// Block–block, upper triangle filled.
    pub bb: Matrix6<f64>,
    /// Gradient, global part.
    pub g: DVector<f64>,
    /// Gradient, block part.
    pub b: Vector6<f64>,
    /// Robust cost: half the sum of ρ.
    pub cost: f64,
}

impl BlockNormal {
    /// Empty sums for `globals` global parameters.
    pub fn zeros(globals: usize) -> Self {
        Self {
            gg: DMatrix::zeros(globals, globals),
            gb: DMatrix::zeros(globals, 6),
            bb: Matrix6::zeros(),
            g: DVector::zeros(globals),
            b: Vector6::zeros(),
            cost: 0.0,
        }
    }

    /// Adds one residual with its derivatives. `globals` holds (first index, derivatives) runs; `weight` is 1/σ²
    /// times the robust weight.
    pub fn add(&mut self, globals: &[(usize, &[f64])], block: &[f64; 6], residual: f64, weight: f64) {
        for (run_idx, (start, run)) in globals.iter().enumerate() {
            for (i, ji) in run.iter().enumerate() {
                let row = start + i;
                let weighted = weight * ji;
                self.g[row] += weighted * residual;
                for (column, jb) in block.iter().enumerate() {
                    self.gb[(row, column)] += weighted * jb;
                }
                for (j, jj) in run.iter().enumerate().skip(i) {
                    self.gg[(row, start + j)] += weighted * jj;
                }
                for (later_start, later) in &globals[run_idx + 1..] {
                    for (j, jj) in later.iter().enumerate() {
                        self.gg[(row, later_start + j)] += weighted * jj;
                    }
                }
            }
        }
        for (i, bi) in block.iter().enumerate() {
            let weighted = weight * bi;
            self.b[i] += weighted * residual;
            for (j, bj) in block.iter().enumerate().skip(i) {
                self.bb[(i, j)] += weighted * bj;
            }
        }
    }

    fn mirror(&mut self) {
        self.gg.fill_lower_triangle_with_upper_triangle();
        self.bb.fill_lower_triangle_with_upper_triangle();
    }
}

/// The whole system: global sums and one entry per block.
#[derive(Debug, Clone)]
pub struct ArrowNormal {
    globals: BlockNormal,
    blocks: Vec<BlockNormal>,
}

/// A step of all parameters.
#[derive(Debug, Clone)]
pub struct ArrowStep {
    /// Global part.
    pub globals: DVector<f64>,
    /// One entry per block.
    pub blocks: Vec<Vector6<f64>>,
}

impl ArrowStep {
    /// The largest change of a parameter, relative to its range.
    pub fn in_ranges(&self, ranges: &Ranges) -> f64 {
        let globals = self.globals.iter().zip(&ranges.globals);
        let blocks = self.blocks.iter().flat_map(|block| block.iter().zip(&ranges.block));
        globals.chain(blocks).map(|(step, range)| step.abs() / range).fold(0.0, f64::max)
    }
}

/// Quantities derived from the parameters of a fit: δq = `by_globals`·δg + Σ `by_block`·δb + an independent part.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// Quantities × globals.
    pub by_globals: DMatrix<f64>,
    /// Block and quantities × 6; every block at most once.
    pub by_block: Vec<(usize, DMatrix<f64>)>,
    /// Covariance of the independent part, quantities × quantities.
    pub own: DMatrix<f64>,
}

impl Derived {
    /// No quantities.
    pub fn none(n_globals: usize) -> Self {
        Self { by_globals: DMatrix::zeros(0, n_globals), by_block: Vec::new(), own: DMatrix::zeros(0, 0) }
    }

    /// These quantities, followed by others that depend on other blocks.
    pub fn and(&self, others: &Self) -> Self {
        let (n, m, n_globals) = (self.own.nrows(), others.own.nrows(), self.by_globals.ncols());
        let mut by_globals = DMatrix::zeros(n + m, n_globals);
        by_globals.view_mut((0, 0), (n, n_globals)).copy_from(&self.by_globals);
        by_globals.view_mut((n, 0), (m, n_globals)).copy_from(&others.by_globals);
        let mut own = DMatrix::zeros(n + m, n + m);
        own.view_mut((0, 0), (n, n)).copy_from(&self.own);
        own.view_mut((n, n), (m, m)).copy_from(&others.own);
        let upper =
            self.by_block.iter().map(|(block, by_block)| (*block, by_block.clone().insert_rows(n, m, 0.0)));
        let lower =
            others.by_block.iter().map(|(block, by_block)| (*block, by_block.clone().insert_rows(0, n, 0.0)));
        Self { by_globals, by_block: upper.chain(lower).collect(), own }
    }
}

/// Range of each parameter within which its residuals are linear: the unit of damping.
///
/// Damping by these, and not by the diagonal, restrains only the directions that the data hardly determine, and lets
/// the solver follow curved valleys of the cost, along which several parameters have nearly the same effect on the
/// light.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranges {
    /// One per global parameter.
    pub globals: Vec<f64>,
    /// For the six parameters of every block.
    pub block: [f64; 6],
}

impl Ranges {
    fn unused(n_globals: usize) -> Self {
        Self { globals: vec![1.0; n_globals], block: [1.0; 6] }
    }
}

impl ArrowNormal {
    /// Collects the sums of all blocks and of the priors (a block whose `bb` and `gb` stay empty). Parameters with
    /// `free[i] == false` are removed from the system.
    pub fn new(priors: BlockNormal, blocks: Vec<BlockNormal>, free: &[bool]) -> Self {
        let mut system = Self { globals: priors, blocks };
        for block in &mut system.blocks {
            block.mirror();
            let gg = std::mem::replace(&mut block.gg, DMatrix::zeros(0, 0));
            system.globals.gg += gg.upper_triangle();
            system.globals.g += &block.g;
            system.globals.cost += block.cost;
            for (idx, is_free) in free.iter().enumerate() {
                if !is_free {
                    block.gb.row_mut(idx).fill(0.0);
                }
            }
        }
        system.globals.mirror();
        for (idx, is_free) in free.iter().enumerate() {
            if !is_free {
                system.globals.gg.row_mut(idx).fill(0.0);
                system.globals.gg.column_mut(idx).fill(0.0);
                system.globals.gg[(idx, idx)] = 1.0;
                system.globals.g[idx] = 0.0;
            }
        }
        system
    }

    /// Half the robust sum of squares.
    pub fn cost(&self) -> f64 {
        self.globals.cost
    }

    /// Gradient of the robust cost by the globals and by every block.
    pub fn gradient(&self) -> (DVector<f64>, Vec<Vector6<f64>>) {
        (self.globals.g.clone(), self.blocks.iter().map(|block| block.b).collect())
    }

    /// Second derivative of the cost with respect to global `idx` alone: the squared scale of its residuals.
    pub fn sensitivity(&self, idx: usize) -> f64 {
        self.globals.gg[(idx, idx)]
    }

    /// The Gauss–Newton step with `damping` / range² added to the diagonal; `None` if the system is singular.
    pub fn solve(&self, damping: f64, ranges: &Ranges) -> Option<ArrowStep> {
        let (reduced, inverses) = self.reduced(damping, ranges)?;
        let mut right = self.globals.g.clone();
        for (block, inverse) in self.blocks.iter().zip(&inverses) {
            right -= &block.gb * (inverse * block.b);
        }
        let globals = -solve_scaled(&reduced, &right)?;
        let blocks = self
            .blocks
            .iter()
            .zip(&inverses)
            .map(|(block, inverse)| {
                let coupled = block.gb.tr_mul(&globals);
                -(inverse * (block.b + coupled.fixed_rows::<6>(0)))
            })
            .collect();
        Some(ArrowStep { globals, blocks })
    }

    /// Expected reduction of the cost by `step`, if the residuals are linear; a lower bound if the step was damped.
    pub fn expected_gain(&self, step: &ArrowStep) -> f64 {
        let globals = self.globals.g.dot(&step.globals);
        let blocks = self.blocks.iter().zip(&step.blocks).map(|(block, step)| block.b.dot(step));
        -0.5 * (globals + blocks.sum::<f64>())
    }

    /// Covariance of the globals, marginalised over the blocks; `None` if something is unobservable. Rows and columns
    /// of fixed parameters are zero.
    pub fn global_covariance(&self, free: &[bool]) -> Option<DMatrix<f64>> {
        let (reduced, _) = self.reduced(0.0, &Ranges::unused(self.globals.g.len()))?;
        let inverse = inverse_scaled(&reduced)?;
        Some(DMatrix::from_fn(reduced.nrows(), reduced.ncols(), |i, j| {
            if free[i] && free[j] { inverse[(i, j)] } else { 0.0 }
        }))
    }

    /// Covariance of a block for fixed globals; `None` if its residuals do not determine it.
    pub fn block_covariance(&self, block: usize) -> Option<Matrix6<f64>> {
        Some(self.blocks[block].bb.cholesky()?.inverse())
    }

    /// The globals from `first` on as functions of the others and the blocks, when only they are fitted to this system:
    /// δl = −H_ll⁻¹(H_lg δg + Σ H_lb δb). `None` if something is unobservable.
    pub fn last_globals(&self, first: usize) -> Option<Derived> {
        let gg = &self.globals.gg;
        let n = gg.nrows() - first;
        let own = inverse_scaled(&gg.view((first, first), (n, n)).into_owned())?;
        let dependent =
            self.blocks.iter().enumerate().filter(|(_, block)| block.gb.rows(first, n).iter().any(|v| *v != 0.0));
        Some(Derived {
            by_globals: -&own * gg.view((first, 0), (n, first)),
            by_block: dependent.map(|(idx, block)| (idx, -&own * block.gb.rows(first, n))).collect(),
            own,
        })
    }

    /// Covariance of (globals, quantities derived from globals and blocks), from this system's own `covariance` of the
    /// globals.
    /// `None` if a block with weight is unobservable.
    pub fn with_derived(&self, covariance: &DMatrix<f64>, derived: &Derived) -> Option<DMatrix<f64>> {
        let mut by_globals = derived.by_globals.clone();
        let mut own = derived.own.clone();
        for (block, by_block) in &derived.by_block {
            let noise = by_block * self.block_covariance(*block)?;
            // The blocks as functions of the globals: δb = −H_bb⁻¹ H_bg δg, plus their own noise.
            by_globals -= &noise * self.blocks[*block].gb.transpose();
            own += &noise * by_block.transpose();
        }
        let (n, m) = (covariance.nrows(), own.nrows());
        let across = &by_globals * covariance;
        let mut whole = DMatrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(covariance);
        whole.view_mut((n, 0), (m, n)).copy_from(&across);
        whole.view_mut((0, n), (n, m)).copy_from(&across.transpose());
        whole.view_mut((n, n), (m, m)).copy_from(&(own + &across * by_globals.transpose()));
        Some(whole)
    }

    fn reduced(&self, damping: f64, ranges: &Ranges) -> Option<(DMatrix<f64>, Vec<Matrix6<f64>>)> {
        let mut reduced = self.globals.gg.clone();
        for i in 0..reduced.nrows() {
            reduced[(i, i)] += damping / (ranges.globals[i] * ranges.globals[i]);
        }
        let mut inverses = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let mut bb = block.bb;
            for i in 0..6 {
                bb[(i, i)] += damping / (ranges.block[i] * ranges.block[i]);
            }
            let inverse = bb.cholesky()?.inverse();
            reduced -= &block.gb * inverse * block.gb.transpose();
            inverses.push(inverse);
        }
        Some((reduced, inverses))
    }
}

/// Inverse by Cholesky, with the diagonal scaled to one.
fn inverse_scaled(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let by_scale = |i: usize, j: usize| scale[i] * scale[j];
    let scaled = matrix.map_with_location(|i, j, value| value * by_scale(i, j));
    Some(scaled.cholesky()?.inverse().map_with_location(|i, j, value| value * by_scale(i, j)))
}

/// Cholesky solution with the diagonal scaled to one, so that pixels, millimetres and radians mix safely.
fn solve_scaled(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { f64::NAN });
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let solution = scaled.cholesky()?.solve(&right.component_mul(&scale));
    let solution = solution.component_mul(&scale);
    solution.iter().all(|v| v.is_finite()).then_some(solution)
}
