//! Parts of a problem in matrix form: contacts that no chain of couplings joins to others, small groups of them together.
//! Each is a problem of its own, as islands are where bodies are known, and is solved as one: sweeps of one end where its
//! own errors are small, and what is hard in one costs nothing in the others.

use super::couplings::Couplings;
use super::operator::Matrix;
use crate::linear::Graph;
use std::ops::Range;
use std::sync::Arc;

const NONE: u32 = u32::MAX;
/// Groups of fewer contacts share a part until it has as many: a sweep of few contacts waits for the one before it.
const SMALL: usize = 16;

/// The contacts of a matrix part after part, those of a part in the order that they came in.
#[derive(Clone, Debug)]
pub struct Parts {
    /// The contact at every place.
    pub order: Vec<u32>,
    /// The place of every contact, from the first of its part on.
    places: Vec<u32>,
    /// Where each part begins; one entry more than parts.
    starts: Vec<u32>,
    /// W in this order, parts numbered each from zero on.
    pub couplings: Arc<Couplings>,
}

impl Parts {
    /// Those of a matrix; `None` where it has no more than one.
    pub fn of(matrix: &Matrix) -> Option<Self> {
        let (label, count) = labels(&matrix.graph);
        if count < 2 {
            return None;
        }
        let mut starts = vec![0; count + 1];
        label.iter().for_each(|&p| starts[p as usize + 1] += 1);
        for p in 0..count {
            starts[p + 1] += starts[p];
        }
        let (mut order, mut places, mut filled) =
            (vec![0; label.len()], vec![0; label.len()], vec![0; count]);
        for (i, &p) in label.iter().enumerate() {
            let p = p as usize;
            places[i] = filled[p];
            order[(starts[p] + filled[p]) as usize] = i as u32;
            filled[p] += 1;
        }
        let couplings = Arc::new(Couplings::in_order(matrix, &order, &places));
        Some(Parts { order, places, starts, couplings })
    }
    /// Where the contacts of each part lie.
    pub fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.starts.windows(2).map(|s| s[0] as usize..s[1] as usize)
    }
    /// What contacts have, in this order.
    pub fn gather<T: Copy>(&self, of_contacts: &[T], here: &mut Vec<T>) {
        here.clear();
        here.extend(self.order.iter().map(|&i| of_contacts[i as usize]));
    }
    /// The same back.
    pub fn scatter<T: Copy>(&self, here: &[T], of_contacts: &mut [T]) {
        self.order.iter().zip(here).for_each(|(&i, x)| of_contacts[i as usize] = *x);
    }
    /// The rows and columns of a part.
    pub fn matrix_of(&self, matrix: &Matrix, part: Range<usize>) -> Matrix {
        let (graph, d) = (&matrix.graph, matrix.dimension() as u32);
        let (mut starts, mut neighbours, mut values) = (vec![0], Vec::new(), Vec::new());
        for &i in &self.order[part.clone()] {
            let row = graph.row(i as usize);
            let (first, last) = (graph.offsets[row.start] as usize, graph.offsets[row.end] as usize);
            values.extend_from_slice(&matrix.values[first..last]);
            neighbours.extend(graph.neighbours[row].iter().map(|&j| self.places[j as usize]));
            starts.push(neighbours.len() as u32);
        }
        Matrix::new(Graph::new(vec![d; part.len()], starts, neighbours), values)
    }
}

/// The part of every contact, in the order of their first contacts, and how many there are.
fn labels(graph: &Graph) -> (Vec<u32>, usize) {
    let mut label = vec![NONE; graph.nodes()];
    let (mut count, mut waiting, mut group) = (0, Vec::new(), Vec::new());
    // the part that small groups join, and its contacts
    let (mut open, mut filled) = (NONE, 0);
    for first in 0..graph.nodes() {
        if label[first] != NONE {
            continue;
        }
        group.clear();
        label[first] = count;
        waiting.push(first as u32);
        while let Some(i) = waiting.pop() {
            group.push(i);
            for &j in &graph.neighbours[graph.row(i as usize)] {
                if label[j as usize] == NONE {
                    label[j as usize] = count;
                    waiting.push(j);
                }
            }
        }
        if group.len() >= SMALL || open == NONE {
            (open, filled) = if group.len() >= SMALL { (open, filled) } else { (count, group.len()) };
            count += 1;
            continue;
        }
        group.iter().for_each(|&i| label[i as usize] = open);
        filled += group.len();
        if filled >= SMALL {
            open = NONE;
        }
    }
    (label, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix of one number per pair: block (i, j) holds 100 i + j.
    fn matrix(rows: &[Vec<u32>]) -> Matrix {
        let mut starts = vec![0];
        let (mut neighbours, mut values) = (Vec::new(), Vec::new());
        for (i, row) in rows.iter().enumerate() {
            neighbours.extend_from_slice(row);
            values.extend(row.iter().map(|&j| (100 * i as u32 + j) as f64));
            starts.push(neighbours.len() as u32);
        }
        Matrix::new(Graph::new(vec![1; rows.len()], starts, neighbours), values)
    }

    /// Contacts that press on each other where they are so many places apart.
    fn chains(contacts: u32, apart: u32) -> Matrix {
        let rows = (0..contacts).map(|i| {
            let mut row = vec![i];
            if i >= apart {
                row.insert(0, i - apart);
            }
            if i + apart < contacts {
                row.push(i + apart);
            }
            row
        });
        matrix(&rows.collect::<Vec<_>>())
    }

    #[test]
    fn contacts_that_hang_together_are_a_part() {
        let (matrix, mut out) = (chains(2 * SMALL as u32, 2), Vec::new());
        let parts = Parts::of(&matrix).expect("there are several");
        assert_eq!(parts.ranges().collect::<Vec<_>>(), [0..SMALL, SMALL..2 * SMALL]);
        let all: Vec<usize> = (0..2 * SMALL).collect();
        parts.gather(&all, &mut out);
        assert_eq!(out[..3], [0, 2, 4]);
        assert_eq!(out[SMALL..SMALL + 3], [1, 3, 5]);
        let mut back = vec![0; 2 * SMALL];
        parts.scatter(&out, &mut back);
        assert_eq!(back, all);
        let own = parts.matrix_of(&matrix, SMALL..2 * SMALL);
        assert_eq!(own.graph.neighbours[..5], [0, 1, 0, 1, 2]);
        assert_eq!(own.values[..5], [101.0, 103.0, 301.0, 303.0, 305.0]);
        assert!(Parts::of(&own).is_none());
    }

    #[test]
    fn small_groups_share_parts() {
        // 40 contacts alone: three parts of which the last is not full
        let parts = Parts::of(&chains(40, 40)).expect("there are several");
        assert_eq!(parts.ranges().collect::<Vec<_>>(), [0..16, 16..32, 32..40]);
        assert!(Parts::of(&chains(SMALL as u32 - 1, 3)).is_none(), "few contacts are one part");
    }
}
