//! Corrections by a factorisation that is nearly that of the operator: flexible GMRES (Saad 1993). Each step costs one
//! solve and one product, as a refinement step does, and none makes the residual larger.

use super::blocks::product_of;

/// Most steps.
const STEPS: usize = 8;

/// Memory of the corrections.
#[derive(Clone, Debug, Default)]
pub struct Krylov<const D: usize> {
    /// Orthonormal residuals.
    basis: Vec<Vec<[f64; D]>>,
    /// Their solutions.
    directions: Vec<Vec<[f64; D]>>,
}

/// The small least squares problem, triangular by rotations.
struct Triangle {
    columns: [[f64; STEPS + 1]; STEPS],
    rotations: [[f64; 2]; STEPS],
    right: [f64; STEPS + 1],
}

impl Triangle {
    /// Takes the next column; the size of the residual that it leaves.
    fn push(&mut self, j: usize, mut column: [f64; STEPS + 1]) -> f64 {
        let turned = |[c, s]: [f64; 2], a: f64, b: f64| (c * a + s * b, c * b - s * a);
        for (i, &rotation) in self.rotations[..j].iter().enumerate() {
            (column[i], column[i + 1]) = turned(rotation, column[i], column[i + 1]);
        }
        let size = libm::hypot(column[j], column[j + 1]);
        let rotation = if size > 0.0 { [column[j] / size, column[j + 1] / size] } else { [1.0, 0.0] };
        (column[j], column[j + 1]) = (size, 0.0);
        (self.right[j], self.right[j + 1]) = turned(rotation, self.right[j], 0.0);
        self.rotations[j] = rotation;
        self.columns[j] = column;
        self.right[j + 1].abs()
    }
    /// The weights of the first n directions.
    fn weights(&self, n: usize) -> [f64; STEPS] {
        let mut weights = [0.0; STEPS];
        for i in (0..n).rev() {
            let later: f64 = (i + 1..n).map(|j| self.columns[j][i] * weights[j]).sum();
            weights[i] = (self.right[i] - later) / self.columns[i][i];
        }
        weights
    }
}

impl<const D: usize> Krylov<D> {
    /// Forgets all numbers: padding must be zero whatever the size before was.
    pub fn forget(&mut self) {
        self.basis.iter_mut().chain(&mut self.directions).for_each(Vec::clear);
    }
    /// All vectors are padded, with zeros. Adds to x what brings its `residual` down to `enough`, or as far as steps help; the size of what is left.
    pub fn correct(
        &mut self,
        (residual, enough): (&[[f64; D]], f64),
        mut solve: impl FnMut(&mut [[f64; D]]),
        product: impl Fn(&[[f64; D]], &mut [[f64; D]]),
        x: &mut [[f64; D]],
    ) -> f64 {
        let n = residual.len();
        self.basis.resize(STEPS + 1, Vec::new());
        self.directions.resize(STEPS, Vec::new());
        let first = length(residual);
        if !first.is_finite() {
            return first;
        }
        self.basis[0].clear();
        self.basis[0].extend(residual.iter().map(|v| v.map(|r| r / first)));
        let mut triangle = Triangle {
            columns: [[0.0; STEPS + 1]; STEPS],
            rotations: [[0.0; 2]; STEPS],
            right: [0.0; STEPS + 1],
        };
        triangle.right[0] = first;
        let mut sizes = [first; STEPS + 2];
        let mut steps = 0;
        for j in 0..STEPS {
            let direction = &mut self.directions[j];
            direction.clone_from(&self.basis[j]);
            solve(direction);
            let (done, next) = self.basis.split_at_mut(j + 1);
            let next = &mut next[0];
            next.resize(n, [0.0; D]);
            product(direction, next);
            let mut column = [0.0; STEPS + 1];
            for (entry, known) in column.iter_mut().zip(done.iter()) {
                *entry = dot(next, known);
                add(next, -*entry, known);
            }
            column[j + 1] = length(next);
            if !column[j + 1].is_finite() {
                break;
            }
            steps = j + 1;
            let (size, left) = (column[j + 1], triangle.push(j, column));
            sizes[j + 2] = left;
            if left <= enough || size == 0.0 || (j > 0 && left > 0.5 * sizes[j]) {
                break;
            }
            next.as_flattened_mut().iter_mut().for_each(|v| *v /= size);
        }
        let weights = triangle.weights(steps);
        if weights.iter().all(|w| w.is_finite()) {
            for (&weight, direction) in weights[..steps].iter().zip(&self.directions) {
                add(x, weight, direction);
            }
            return sizes[steps + 1];
        }
        first
    }
}

fn dot<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    product_of(a.as_flattened(), b.as_flattened())
}

fn length<const D: usize>(v: &[[f64; D]]) -> f64 {
    dot(v, v).sqrt()
}

/// y += factor x.
fn add<const D: usize>(y: &mut [[f64; D]], factor: f64, x: &[[f64; D]]) {
    for (y, x) in y.as_flattened_mut().iter_mut().zip(x.as_flattened()) {
        *y += factor * x;
    }
}
