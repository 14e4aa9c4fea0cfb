//! Rows of J on bodies of unit mass: a row of B = J M^-1/2 is the row's linear part times the root of the inverse mass
//! and its angular part times that of the inverse inertia. Bodies that cannot move have no rows.

use super::bodies::NO_BODY;
use crate::problem::ContactProblem;
use carom_math::{Column, Inertia, Space};

/// The roots of inverse mass and inertia of the bodies that can move.
#[derive(Clone, Debug, Default)]
pub struct MassRoots {
    places: Vec<u32>,
    roots: Vec<(f64, [[f64; 3]; 3])>,
}

impl MassRoots {
    /// Takes the roots of a problem's bodies, reusing memory.
    pub fn update<S: Space>(&mut self, problem: &ContactProblem<S>) {
        self.places.clear();
        self.roots.clear();
        for mass in &problem.inverse_masses {
            if mass.is_fixed() {
                self.places.push(NO_BODY);
            } else {
                self.places.push(self.roots.len() as u32);
                self.roots.push((mass.linear.sqrt(), root::<S>(&mass.angular)));
            }
        }
    }
    /// Number of bodies that can move.
    pub fn count(&self) -> usize {
        self.roots.len()
    }
    /// The number of a body among those that can move, or `NO_BODY`.
    pub fn place(&self, body: usize) -> u32 {
        self.places[body]
    }
    /// Appends the row of B for one body and a row of J, times a sign; zeros for a body that cannot move.
    #[inline]
    pub fn push<S: Space>(
        &self,
        body: usize,
        (on_linear, on_angular): (&S::Vector, &S::Spin),
        sign: f64,
        values: &mut Vec<f64>,
    ) {
        let mut row = [0.0; 6];
        if let Some((linear, angular)) = self.roots.get(self.places[body] as usize) {
            for k in 0..S::DIM {
                row[k] = sign * linear * on_linear[k];
            }
            for column in 0..S::SPIN {
                let along: f64 = (0..S::SPIN).map(|k| on_angular[k] * angular[k][column]).sum();
                row[S::DIM + column] = sign * along;
            }
        }
        values.extend_from_slice(&row[..S::DOF]);
    }
}

/// L with L L^T = I^-1 (Cholesky; a direction that nothing turns gives a zero column).
fn root<S: Space>(inertia: &S::Inertia) -> [[f64; 3]; 3] {
    let mut a = [[0.0; 3]; 3];
    for column in 0..S::SPIN {
        let unit = S::Spin::from_fn(|k| if k == column { 1.0 } else { 0.0 });
        let response = inertia.apply(unit);
        for (row, value) in a.iter_mut().zip(response.as_slice()) {
            row[column] = *value;
        }
    }
    let mut l = [[0.0; 3]; 3];
    for j in 0..S::SPIN {
        let pivot = a[j][j] - (0..j).map(|k| l[j][k] * l[j][k]).sum::<f64>();
        if !(pivot > 0.0) {
            continue;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..S::SPIN {
            l[i][j] = (a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>()) / l[j][j];
        }
    }
    l
}
