//! Evidence for labels: unary and pairwise terms over (piece, label).

use crate::params::PIECES_PER_TASK;
use crate::threads::for_each_chunk;

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
    /// Per piece: bonds to other pieces.
    pub bonds: Vec<Vec<Bond>>,
    /// Per piece: its repeated observations, sorted by its own label.
    observations: Vec<Vec<Observation>>,
    /// The pieces with an observation of a piece, those of one piece after those of the piece before it; some repeated.
    observers: Vec<u32>,
    /// Per piece: the end of its observers.
    observers_end: Vec<usize>,
    /// Per piece: the other lines of its frame and on which side they lie.
    pub ranks: Vec<Vec<Rank>>,
}

/// Continuity: the same line in a neighbouring frame, or beyond a gap or kink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// The other piece.
    pub piece: u32,
    /// Weight if both have the same label, "none" included.
    pub weight: f32,
}

/// Another order, or the same order in a distant frame, at the same position on the part. There are dozens per sample,
/// so the entry is small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// The other piece.
    pub piece: u32,
    /// Weight if both labels are assigned: positive if the surfaces agree, negative if they contradict each other.
    pub weight: f32,
    /// Label of this piece; never "none".
    pub own_label: u8,
    /// Label of the other piece; never "none".
    pub label: u8,
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

/// Weights are multiples of this, a millionth of a sample: sums of them in double precision are exact up to 2³²
/// samples, so that they do not depend on the summation order, and subtracting a weight restores the previous sum.
const WEIGHT_GRID: f64 = 1.0 / (1 << 20) as f64;

/// A weight as stored in the evidence: single precision, in which numbers above 16 are multiples of the grid
/// anyway.
pub fn quantised(weight: f64) -> f32 {
    ((weight / WEIGHT_GRID).round() * WEIGHT_GRID) as f32
}

/// Place of a piece in an ascending list that contains it.
fn place(pieces: &[usize], piece: u32) -> u32 {
    pieces.partition_point(|&other| other < piece as usize) as u32
}

impl Evidence {
    /// Without evidence, for pieces of the given sizes; `unlabelled_cost`: per sample of an unlabelled piece.
    pub fn new(n_orders: usize, sizes: Vec<f64>, unlabelled_cost: f64) -> Self {
        let n_labels = n_orders + 1;
        let mut unary = vec![0.0; sizes.len() * n_labels];
        for (piece, size) in sizes.iter().enumerate() {
            unary[piece * n_labels + n_orders] = -unlabelled_cost * size;
        }
        let bonds = vec![Vec::new(); sizes.len()];
        let observations = vec![Vec::new(); sizes.len()];
        let ranks = vec![Vec::new(); sizes.len()];
        let observers_end = vec![0; sizes.len()];
        Self { n_labels, sizes, unary, bonds, observations, observers: Vec::new(), observers_end, ranks }
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

    /// Adds a weight for two pieces with equal labels, "none" included.
    pub fn add_bond(&mut self, piece_a: usize, piece_b: usize, weight: f64) {
        let weight = quantised(weight);
        self.bonds[piece_a].push(Bond { piece: piece_b as u32, weight });
        self.bonds[piece_b].push(Bond { piece: piece_a as u32, weight });
    }

    /// Sets the repeated observations of all pieces, which add to a piece's own score alone: the other piece has its own.
    pub fn set_observations(&mut self, mut of_pieces: Vec<Vec<Observation>>) {
        for_each_chunk(&mut of_pieces, 1, PIECES_PER_TASK, |_, of_piece| {
            of_piece[0].sort_by_key(|observation| observation.own_label);
        });
        let mut n_observers = vec![0; self.n_pieces()];
        of_pieces.iter().flatten().for_each(|seen| n_observers[seen.piece as usize] += 1);
        let firsts = n_observers.iter().scan(0, |n_before: &mut usize, n| {
            *n_before += n;
            Some(*n_before - n)
        });
        let mut ends: Vec<usize> = firsts.collect();
        self.observers = vec![0; n_observers.iter().sum()];
        for (piece, of_piece) in of_pieces.iter().enumerate() {
            for seen in of_piece {
                let end = &mut ends[seen.piece as usize];
                self.observers[*end] = piece as u32;
                *end += 1;
            }
        }
        (self.observations, self.observers_end) = (of_pieces, ends);
    }

    /// The evidence for the pieces of a single frame without a label, given those with one; and which they are.
    pub fn given(&self, labels: &[Option<usize>]) -> (Self, Vec<usize>) {
        let (n, open): (usize, Vec<usize>) =
            (self.n_labels, (0..labels.len()).filter(|&piece| labels[piece].is_none()).collect());
        let mut given = Self::new(self.none(), open.iter().map(|&piece| self.sizes[piece]).collect(), 0.0);
        for (idx, &piece) in open.iter().enumerate() {
            let unary = &mut given.unary[idx * n..][..n];
            unary.copy_from_slice(&self.unary[piece * n..][..n]);
            for bond in &self.bonds[piece] {
                match labels[bond.piece as usize] {
                    Some(label) => unary[label] += f64::from(bond.weight),
                    None => given.bonds[idx].push(Bond { piece: place(&open, bond.piece), ..*bond }),
                }
            }
            for rank in &self.ranks[piece] {
                match labels[rank.piece as usize] {
                    Some(label) => wrong_labels(!rank.is_above, label, self.none())
                        .for_each(|wrong| unary[wrong] -= f64::from(rank.cost)),
                    None => given.ranks[idx].push(Rank { piece: place(&open, rank.piece), ..*rank }),
                }
            }
        }
        (given, open)
    }

    /// All pieces whose score depends on the label of `piece`; some repeated.
    pub fn dependents(&self, piece: usize) -> impl Iterator<Item = usize> {
        let first = piece.checked_sub(1).map_or(0, |before| self.observers_end[before]);
        let observers = self.observers[first..self.observers_end[piece]].iter().copied();
        let bonds = self.bonds[piece].iter().map(|bond| bond.piece);
        let ranks = self.ranks[piece].iter().map(|rank| rank.piece);
        bonds.chain(observers).chain(ranks).map(|piece| piece as usize)
    }

    /// The repeated observations of a piece under all of its labels.
    pub fn observations(&self, piece: usize) -> &[Observation] {
        &self.observations[piece]
    }

    /// The repeated observations of a piece under one label.
    pub fn observations_under(&self, piece: usize, label: usize) -> &[Observation] {
        let all = &self.observations[piece][..];
        let first = all.partition_point(|observation| usize::from(observation.own_label) < label);
        let n = all[first..].partition_point(|observation| usize::from(observation.own_label) == label);
        &all[first..first + n]
    }

    /// Bonds and repeated observations of a piece under one label: the other piece, the label that it must have, and the
    /// weight.
    pub fn terms_under(&self, piece: usize, label: usize) -> impl Iterator<Item = (usize, usize, f64)> {
        let bonds = self.bonds[piece].iter().map(move |bond| (bond.piece, label, bond.weight));
        let seen = self.observations_under(piece, label).iter();
        let seen = seen.map(|seen| (seen.piece, usize::from(seen.label), seen.weight));
        bonds.chain(seen).map(|(other, theirs, weight)| (other as usize, theirs, f64::from(weight)))
    }

    /// Score of every label of `piece` per sample, given the marginals of all labels.
    pub fn scores(&self, piece: usize, marginals: &[f64], scores: &mut [f64]) {
        let (n, none) = (self.n_labels, self.none());
        scores.fill(0.0);
        // Costs of additional labels in the wrong order, compared with the label before, then their running sum. For a line
        // above, all are wrong at first.
        let mut sum = 0.0;
        for rank in &self.ranks[piece] {
            let theirs = &marginals[rank.piece as usize * n..][..n];
            let cost = f64::from(rank.cost);
            if rank.is_above {
                sum -= cost * (1.0 - theirs[none]);
                scores[1..].iter_mut().zip(theirs).for_each(|(score, marginal)| *score += cost * marginal);
            } else {
                scores[..none].iter_mut().zip(theirs).for_each(|(score, marginal)| *score -= cost * marginal);
            }
        }
        for score in &mut scores[..none] {
            sum += *score;
            *score = sum;
        }
        scores[none] = 0.0;
        for bond in &self.bonds[piece] {
            let theirs = &marginals[bond.piece as usize * n..][..n];
            for (score, marginal) in scores.iter_mut().zip(theirs) {
                *score += f64::from(bond.weight) * marginal;
            }
        }
        for of_label in self.observations(piece).chunk_by(|a, b| a.own_label == b.own_label) {
            let score = &mut scores[usize::from(of_label[0].own_label)];
            *score = of_label.iter().fold(*score, |sum, seen| {
                let theirs = marginals[seen.piece as usize * n + usize::from(seen.label)];
                sum + f64::from(seen.weight) * theirs
            });
        }
        for (label, score) in scores.iter_mut().enumerate() {
            *score = (self.unary[piece * n + label] + *score) / self.sizes[piece];
        }
    }

    /// Score of every label of `piece` per sample, given the labels of all pieces: as [`Evidence::score`], for all
    /// labels at once.
    pub fn scores_given(&self, piece: usize, labels: &[usize], scores: &mut Vec<f64>) {
        self.fill_scores(piece, labels, &self.bonds[piece], scores);
    }

    /// [`Evidence::scores_given`] without continuity.
    pub fn scores_without_bonds(&self, piece: usize, labels: &[usize], scores: &mut Vec<f64>) {
        self.fill_scores(piece, labels, &[], scores);
    }

    fn fill_scores(&self, piece: usize, labels: &[usize], bonds: &[Bond], scores: &mut Vec<f64>) {
        let n = self.n_labels;
        scores.clear();
        scores.resize(n, 0.0);
        // Costs of additional labels in the wrong order, compared with the label before, then their running sum.
        for rank in &self.ranks[piece] {
            let theirs = labels[rank.piece as usize];
            // For a line above, labels up to its own are wrong; for one below, its own and those after it.
            let wrong = wrong_labels(!rank.is_above, theirs, self.none());
            if !wrong.is_empty() {
                scores[wrong.start] -= f64::from(rank.cost);
                scores[wrong.end] += f64::from(rank.cost);
            }
        }
        for label in 1..n {
            scores[label] += scores[label - 1];
        }
        for bond in bonds {
            scores[labels[bond.piece as usize]] += f64::from(bond.weight);
        }
        for seen in self.observations(piece) {
            if labels[seen.piece as usize] == usize::from(seen.label) {
                scores[usize::from(seen.own_label)] += f64::from(seen.weight);
            }
        }
        for (score, unary) in scores.iter_mut().zip(&self.unary[piece * n..]) {
            *score = (unary + *score) / self.sizes[piece];
        }
    }

    /// Score of `label` of `piece` per sample, given the labels of all pieces.
    pub fn score(&self, piece: usize, label: usize, labels: &[usize]) -> f64 {
        let agreeing = self.terms_under(piece, label).filter(|(other, theirs, _)| labels[*other] == *theirs);
        let is_wrong =
            |rank: &&Rank| wrong_labels(rank.is_above, label, self.none()).contains(&labels[rank.piece as usize]);
        let wrong = self.ranks[piece].iter().filter(is_wrong);
        let sum = agreeing.map(|(_, _, weight)| weight).sum::<f64>()
            - wrong.map(|rank| f64::from(rank.cost)).sum::<f64>();
        (self.unary[piece * self.n_labels + label] + sum) / self.sizes[piece]
    }
}
