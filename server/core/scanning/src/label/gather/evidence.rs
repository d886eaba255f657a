//! Evidence for labels: unary and pairwise terms over (piece, label).

/// Unary and pairwise terms of the score (`docs/maths/labelling.md`, eq. 2), in units of one full sample; positive
/// weights support labels.
#[derive(Debug, Clone, Default)]
pub struct Evidence {
    /// Labels per piece: the calibration's orders, then "none".
    pub n_labels: usize,
    /// Size of each piece, in full samples.
    pub sizes: Vec<f64>,
    /// Per piece and label: the unary term.
    pub unary: Vec<f64>,
    /// Per piece and label: the pairwise terms with other pieces' labels.
    pub pairs: Vec<Vec<Pair>>,
    /// Per piece: the other lines of its frame and on which side they lie.
    pub ranks: Vec<Vec<Rank>>,
}

/// Another line of the same frame: if it lies above, its order must be lower, and vice versa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// The other piece.
    pub piece: u32,
    /// Whether the other lies above (left of) this one.
    pub is_above: bool,
    /// Cost of two labels in the wrong order.
    pub cost: f32,
}

/// The labels of another line that are in the wrong order for `label` of this one; "none" never is. `is_above`: whether
/// the other lies above (left of) this one.
pub fn wrong_labels(is_above: bool, label: usize, none: usize) -> std::ops::Range<usize> {
    match (label == none, is_above) {
        (true, true) => none..none,
        (true, false) => 0..0,
        (false, true) => label..none,
        (false, false) => 0..label + 1,
    }
}

/// A pairwise term with the label of another piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The other piece.
    pub piece: u32,
    /// The other piece's label.
    pub label: u32,
    /// Weight if both labels are assigned.
    pub weight: f32,
    /// Its source.
    pub kind: PairKind,
}

/// Source of a pairwise weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairKind {
    /// Another order, or the same order in a distant frame, at the same position on the part.
    RepeatedObservation,
    /// Continuity: the same line in a neighbouring frame, or beyond a gap or kink.
    Bond,
}

/// Weights are multiples of this, a millionth of a sample: sums of them in double precision are exact up to 2³²
/// samples, so that they do not depend on the summation order, and subtracting a weight restores the previous sum.
const WEIGHT_GRID: f64 = 1.0 / (1 << 20) as f64;

/// A weight as stored in the evidence: single precision, in which numbers above 16 are multiples of the grid
/// anyway.
pub fn quantised(weight: f64) -> f32 {
    ((weight / WEIGHT_GRID).round() * WEIGHT_GRID) as f32
}

impl Evidence {
    /// Without evidence, for pieces of the given sizes; `unlabelled_cost`: per sample of an unlabelled piece.
    pub fn new(n_orders: usize, sizes: Vec<f64>, unlabelled_cost: f64) -> Self {
        let n_labels = n_orders + 1;
        let mut unary = vec![0.0; sizes.len() * n_labels];
        for (piece, size) in sizes.iter().enumerate() {
            unary[piece * n_labels + n_orders] = -unlabelled_cost * size;
        }
        let pairs = vec![Vec::new(); sizes.len() * n_labels];
        let ranks = vec![Vec::new(); sizes.len()];
        Self { n_labels, sizes, unary, pairs, ranks }
    }

    /// The label "none".
    pub fn none(&self) -> usize {
        self.n_labels - 1
    }

    /// Number of pieces.
    pub fn n_pieces(&self) -> usize {
        self.sizes.len()
    }

    /// Adds to the unary term of one label.
    pub fn add_unary(&mut self, piece: usize, label: usize, weight: f64) {
        self.unary[piece * self.n_labels + label] += weight;
    }

    /// Adds a cost for two pieces of one frame with labels in the wrong order.
    pub fn add_rank(&mut self, upper: usize, lower: usize, cost: f64) {
        let cost = quantised(cost);
        self.ranks[upper].push(Rank { piece: lower as u32, is_above: false, cost });
        self.ranks[lower].push(Rank { piece: upper as u32, is_above: true, cost });
    }

    /// Adds a weight to the label of one piece given the label of another; the other piece adds its own term.
    pub fn add_pairwise(&mut self, to: (usize, usize), from: (usize, usize), weight: f64) {
        self.add_directed(to, from, weight, PairKind::RepeatedObservation);
    }

    /// Adds a weight for two pieces with equal labels, "none" included.
    pub fn add_bond(&mut self, piece_a: usize, piece_b: usize, weight: f64) {
        for label in 0..self.n_labels {
            self.add_directed((piece_a, label), (piece_b, label), weight, PairKind::Bond);
            self.add_directed((piece_b, label), (piece_a, label), weight, PairKind::Bond);
        }
    }

    fn add_directed(
        &mut self,
        (piece, label): (usize, usize),
        (other, other_label): (usize, usize),
        weight: f64,
        kind: PairKind,
    ) {
        let pair = Pair { piece: other as u32, label: other_label as u32, weight: quantised(weight), kind };
        self.pairs[piece * self.n_labels + label].push(pair);
    }

    /// Score of every label of `piece` per sample, given the marginals of all labels.
    pub fn scores(&self, piece: usize, marginals: &[f64], scores: &mut [f64]) {
        let n = self.n_labels;
        for (label, score) in scores.iter_mut().enumerate() {
            let pairs = self.pairs[piece * n + label].iter();
            *score = pairs.map(|p| f64::from(p.weight) * marginals[p.piece as usize * n + p.label as usize]).sum();
        }
        for rank in &self.ranks[piece] {
            let theirs = &marginals[rank.piece as usize * n..][..n - 1];
            let cost = f64::from(rank.cost);
            let mut wrong = 0.0;
            if rank.is_above {
                for (score, marginal) in scores[..n - 1].iter_mut().zip(theirs).rev() {
                    wrong += marginal;
                    *score -= cost * wrong;
                }
            } else {
                for (score, marginal) in scores[..n - 1].iter_mut().zip(theirs) {
                    wrong += marginal;
                    *score -= cost * wrong;
                }
            }
        }
        for (label, score) in scores.iter_mut().enumerate() {
            *score = (self.unary[piece * n + label] + *score) / self.sizes[piece];
        }
    }

    /// Score of every label of `piece` per sample, given the labels of all pieces: as [`Evidence::score`], for all
    /// labels at once.
    pub fn scores_given(&self, piece: usize, labels: &[usize], scores: &mut Vec<f64>) {
        let n = self.n_labels;
        scores.clear();
        scores.resize(n, 0.0);
        // Additional labels in the wrong order, compared with the label before.
        for rank in &self.ranks[piece] {
            let theirs = labels[rank.piece as usize];
            // For a line above, labels up to its own are wrong; for one below, its own and those after it.
            let wrong = wrong_labels(!rank.is_above, theirs, self.none());
            if !wrong.is_empty() {
                scores[wrong.start] += f64::from(rank.cost);
                scores[wrong.end] -= f64::from(rank.cost);
            }
        }
        let mut wrong = 0.0;
        for (label, score) in scores.iter_mut().enumerate() {
            wrong += *score;
            let slot = piece * n + label;
            let agrees = |pair: &&Pair| labels[pair.piece as usize] == pair.label as usize;
            let sum: f64 = self.pairs[slot].iter().filter(agrees).map(|pair| f64::from(pair.weight)).sum();
            *score = (self.unary[slot] + sum - wrong) / self.sizes[piece];
        }
    }

    /// Score of `label` of `piece` per sample, given the labels of all pieces.
    pub fn score(&self, piece: usize, label: usize, labels: &[usize]) -> f64 {
        self.score_of(piece, label, labels, |_| true)
    }

    /// [`Evidence::score`] without continuity.
    pub fn score_without_bonds(&self, piece: usize, label: usize, labels: &[usize]) -> f64 {
        self.score_of(piece, label, labels, |kind| kind != PairKind::Bond)
    }

    fn score_of(&self, piece: usize, label: usize, labels: &[usize], counts: impl Fn(PairKind) -> bool) -> f64 {
        let slot = piece * self.n_labels + label;
        let agrees = |pair: &&Pair| counts(pair.kind) && labels[pair.piece as usize] == pair.label as usize;
        let sum: f64 = self.pairs[slot].iter().filter(agrees).map(|pair| f64::from(pair.weight)).sum();
        let is_wrong =
            |rank: &&Rank| wrong_labels(rank.is_above, label, self.none()).contains(&labels[rank.piece as usize]);
        let wrong: f64 = self.ranks[piece].iter().filter(is_wrong).map(|rank| f64::from(rank.cost)).sum();
        (self.unary[slot] + sum - wrong) / self.sizes[piece]
    }
}
