//! W as problems in matrix form hold it: compressed rows to read, blocks to solve with.

use crate::cone_matrix::norm_or_one;
use crate::delassus::Csr;
use crate::exact::couplings::Couplings;
use crate::exact::operator::Matrix;
use crate::exact::parts::Parts;
use crate::linear::Graph;
use std::borrow::Cow;
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

/// The Delassus operator of a friction problem: reads as compressed rows; its blocks are made once, on first need,
/// and shared by its clones.
#[derive(Clone, Debug, Default)]
pub struct Delassus {
    rows: Arc<Csr>,
    blocks: OnceLock<Made>,
}

/// What solvers read of W.
#[derive(Clone, Debug)]
pub(crate) struct Made {
    /// W in blocks.
    pub matrix: Arc<Matrix>,
    /// The spectral norms of its diagonal blocks, 1 for a block of zeros.
    pub norms: Arc<[f64]>,
    /// The same as it is multiplied by impulses.
    pub couplings: Arc<Couplings>,
    /// The contacts part by part; none where all hang together.
    pub parts: Option<Arc<Parts>>,
}

impl Delassus {
    /// W in blocks of `dimension` rows, with what is read of them.
    pub(crate) fn made(&self, dimension: usize) -> Cow<'_, Made> {
        let kept = self.blocks.get_or_init(|| Made::of(&self.rows, dimension));
        // the same W may be read with other contacts
        if kept.matrix.dimension() == dimension {
            Cow::Borrowed(kept)
        } else {
            Cow::Owned(Made::of(&self.rows, dimension))
        }
    }
}

impl Made {
    fn of(rows: &Csr, dimension: usize) -> Self {
        let matrix = in_blocks(rows, dimension);
        let norm = match dimension {
            1 => norm_or_one::<1>,
            2 => norm_or_one::<2>,
            _ => norm_or_one::<3>,
        };
        let norm = |at: &u32| norm(&matrix.values[*at as usize..][..dimension * dimension]);
        let norms = matrix.diagonal.iter().map(norm).collect();
        let couplings = Arc::new(Couplings::of(&matrix));
        let parts = Parts::of(&matrix).map(Arc::new);
        Made { matrix: Arc::new(matrix), norms, couplings, parts }
    }
}

impl From<Csr> for Delassus {
    fn from(rows: Csr) -> Self {
        Delassus { rows: Arc::new(rows), blocks: OnceLock::new() }
    }
}

impl Deref for Delassus {
    type Target = Csr;
    fn deref(&self) -> &Csr {
        &self.rows
    }
}

impl PartialEq for Delassus {
    fn eq(&self, other: &Self) -> bool {
        self.rows == other.rows
    }
}

fn in_blocks(w: &Csr, d: usize) -> Matrix {
    let count = w.shape.0 / d;
    let (starts, columns) = pattern(w, d);
    let graph = Graph::new(vec![d as u32; count], starts, columns);
    let mut values = vec![0.0; graph.values()];
    for i in 0..count {
        let row = graph.row(i);
        for r in 0..d {
            let mut at = row.start;
            // stored zeros couple nothing
            for (column, x) in w.row(d * i + r).filter(|e| e.1 != 0.0) {
                if graph.neighbours[at] as usize != column / d {
                    at = graph.position(i, column / d).expect("the pattern holds every entry");
                }
                values[graph.offsets[at] as usize + r * d + column % d] += x;
            }
        }
    }
    Matrix::new(graph, values)
}

/// Block pattern of W, made symmetric, diagonal included.
fn pattern(w: &Csr, d: usize) -> (Vec<u32>, Vec<u32>) {
    let count = w.shape.0 / d;
    let mut rows: Vec<Vec<u32>> = (0..count as u32).map(|i| vec![i]).collect();
    let mut last = vec![u32::MAX; count];
    for i in 0..count {
        for row in d * i..d * i + d {
            for (column, x) in w.row(row) {
                let j = column / d;
                if x != 0.0 && j != i && last[j] != i as u32 {
                    last[j] = i as u32;
                    rows[i].push(j as u32);
                    rows[j].push(i as u32);
                }
            }
        }
    }
    let (mut starts, mut columns) = (vec![0], Vec::new());
    for row in &mut rows {
        row.sort_unstable();
        row.dedup();
        columns.extend_from_slice(row);
        starts.push(columns.len() as u32);
    }
    (starts, columns)
}
