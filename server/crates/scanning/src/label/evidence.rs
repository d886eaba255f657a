//! What speaks for and against labels: sums over pairs of (piece, label).

/// Weights of single labels and of pairs of labels; positive speaks for them. In units of one full sample.
#[derive(Debug, Clone, Default)]
pub struct Evidence {
    /// Labels per piece: the calibration's orders, then "none".
    pub n_labels: usize,
    /// Size of each piece, in full samples.
    pub sizes: Vec<f64>,
    /// Per piece and label: weight of the label by itself.
    pub single: Vec<f64>,
    /// Per piece and label: what other pieces' labels add to it.
    pub pairs: Vec<Vec<Pair>>,
}

/// A pair's other side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The other piece.
    pub piece: u32,
    /// The other piece's label.
    pub label: u32,
    /// Weight of the two together.
    pub weight: f32,
    /// Where it comes from.
    pub kind: Kind,
}

/// Where a weight comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The order of the lines across the image.
    Rank,
    /// Another order, or the same much later, at the same place of the part.
    SecondLook,
    /// Mere continuity: the same line elsewhere.
    Bond,
}

impl Evidence {
    /// No evidence yet, for pieces of the given sizes; leaving a piece unlabelled costs a little.
    pub fn new(n_orders: usize, sizes: Vec<f64>, unlabelled_cost: f64) -> Self {
        let n_labels = n_orders + 1;
        let mut single = vec![0.0; sizes.len() * n_labels];
        for (piece, size) in sizes.iter().enumerate() {
            single[piece * n_labels + n_orders] = -unlabelled_cost * size;
        }
        let pairs = vec![Vec::new(); sizes.len() * n_labels];
        Self { n_labels, sizes, single, pairs }
    }

    /// The label "none".
    pub fn none(&self) -> usize {
        self.n_labels - 1
    }

    /// Number of pieces.
    pub fn n_pieces(&self) -> usize {
        self.sizes.len()
    }

    /// Adds to the weight of one label.
    pub fn add_single(&mut self, piece: usize, label: usize, weight: f64) {
        self.single[piece * self.n_labels + label] += weight;
    }

    /// Adds a weight to two labels of one frame together.
    pub fn add_pair(&mut self, a: (usize, usize), b: (usize, usize), weight: f64) {
        self.add_half(a, b, weight, Kind::Rank);
        self.add_half(b, a, weight, Kind::Rank);
    }

    /// Adds a weight to the label of one piece if another piece has a label; the other finds its own testimony.
    pub fn add_testimony(&mut self, to: (usize, usize), from: (usize, usize), weight: f64) {
        self.add_half(to, from, weight, Kind::SecondLook);
    }

    /// Adds a weight to two pieces having the same label, whichever it is, "none" included.
    pub fn add_bond(&mut self, piece_a: usize, piece_b: usize, weight: f64) {
        for label in 0..self.n_labels {
            self.add_half((piece_a, label), (piece_b, label), weight, Kind::Bond);
            self.add_half((piece_b, label), (piece_a, label), weight, Kind::Bond);
        }
    }

    fn add_half(
        &mut self,
        (piece, label): (usize, usize),
        (other, other_label): (usize, usize),
        weight: f64,
        kind: Kind,
    ) {
        let pair = Pair { piece: other as u32, label: other_label as u32, weight: weight as f32, kind };
        self.pairs[piece * self.n_labels + label].push(pair);
    }

    /// What speaks for `label` of `piece` per sample, given how much each label of the others is believed.
    pub fn support(&self, piece: usize, label: usize, belief: impl Fn(usize, usize) -> f64) -> f64 {
        let slot = piece * self.n_labels + label;
        let pairs = &self.pairs[slot];
        let sum: f64 =
            pairs.iter().map(|p| f64::from(p.weight) * belief(p.piece as usize, p.label as usize)).sum();
        (self.single[slot] + sum) / self.sizes[piece]
    }

    /// [`Evidence::support`] without continuity.
    pub fn support_beside_bonds(&self, piece: usize, label: usize, labels: &[usize]) -> f64 {
        let slot = piece * self.n_labels + label;
        let counts = |pair: &&Pair| pair.kind != Kind::Bond && labels[pair.piece as usize] == pair.label as usize;
        let sum: f64 = self.pairs[slot].iter().filter(counts).map(|pair| f64::from(pair.weight)).sum();
        (self.single[slot] + sum) / self.sizes[piece]
    }
}
