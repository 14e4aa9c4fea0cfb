//! A problem made ready for sweeping: every scalar row J_i with its response M^-1 J_i^T and effective mass
//! m_i = 1/(J_i M^-1 J_i^T) (theory chapter 5). One text serves contact rows, tangents and bounded rows.

use crate::problem::{ContactProblem, Impulse, Impulses, InverseMass, Twist};
use carom_math::{Column, Space};

/// One scalar row of J with what a sweep needs of it.
#[derive(Clone, Copy, Debug)]
pub struct Row<S: Space> {
    /// Index of the first body.
    pub a: usize,
    /// Index of the second body.
    pub b: usize,
    /// Coefficients on a's velocity.
    pub on_a: Twist<S>,
    /// Coefficients on b's velocity.
    pub on_b: Twist<S>,
    /// Change of a's velocity per unit impulse.
    pub response_a: Twist<S>,
    /// Change of b's velocity per unit impulse.
    pub response_b: Twist<S>,
    /// J M^-1 J^T of this row: inverse effective mass \[1/kg\].
    pub inverse_effective_mass: f64,
}

impl<S: Space> Row<S> {
    /// A row from its coefficients.
    pub fn new(a: usize, b: usize, on_a: Twist<S>, on_b: Twist<S>, masses: &[InverseMass<S>]) -> Self {
        let response_a = masses[a].apply(&on_a);
        let response_b = masses[b].apply(&on_b);
        let inverse_effective_mass = on_a.dot(&response_a) + on_b.dot(&response_b);
        Row { a, b, on_a, on_b, response_a, response_b, inverse_effective_mass }
    }
    /// J u.
    #[inline]
    pub fn velocity(&self, v: &[Twist<S>]) -> f64 {
        self.on_a.dot(&v[self.a]) + self.on_b.dot(&v[self.b])
    }
    /// v += M^-1 J^T impulse.
    #[inline]
    pub fn apply(&self, impulse: f64, v: &mut [Twist<S>]) {
        v[self.a].add_scaled(&self.response_a, impulse);
        v[self.b].add_scaled(&self.response_b, impulse);
    }
    /// J_i M^-1 J_j^T: an entry of A.
    pub fn coupling(&self, other: &Self) -> f64 {
        let mut sum = 0.0;
        for (body, on) in [(self.a, &self.on_a), (self.b, &self.on_b)] {
            if body == other.a {
                sum += on.dot(&other.response_a);
            }
            if body == other.b {
                sum += on.dot(&other.response_b);
            }
        }
        sum
    }
}

/// The rows of one contact and the numbers of its law.
#[derive(Clone, Copy, Debug)]
pub struct PreparedContact<S: Space> {
    /// Normal row.
    pub normal: Row<S>,
    /// Tangential rows; in the plane the second repeats the first and is never read.
    pub tangents: [Row<S>; 2],
    /// m_n = 1/W_nn \[kg\].
    pub normal_mass: f64,
    /// m_t = 1/lambda_max(W_tt) \[kg\]: the scalar friction step whose fixed point is Coulomb's law.
    pub tangent_mass: f64,
    /// Normal velocity that a pressed contact ends with \[m/s\].
    pub target: f64,
    /// Coefficient of restitution \[1\].
    pub restitution: f64,
    /// Coefficient of friction \[1\].
    pub friction: f64,
}

impl<S: Space> PreparedContact<S> {
    /// Normal and tangential relative velocity.
    #[inline]
    pub fn relative_velocity(&self, v: &[Twist<S>]) -> (f64, S::Slip) {
        (self.normal.velocity(v), self.slip(v))
    }
    /// Tangential relative velocity.
    #[inline]
    pub fn slip(&self, v: &[Twist<S>]) -> S::Slip {
        S::Slip::from_fn(|k| self.tangents[k].velocity(v))
    }
    /// Applies a tangential impulse.
    #[inline]
    pub fn apply_tangent(&self, impulse: S::Slip, v: &mut [Twist<S>]) {
        for k in 0..S::SLIP {
            self.tangents[k].apply(impulse[k], v);
        }
    }
}

/// All rows of a problem.
#[derive(Clone, Debug, Default)]
pub struct Prepared<S: Space> {
    /// The contacts.
    pub contacts: Vec<PreparedContact<S>>,
    /// The bounded rows.
    pub rows: Vec<Row<S>>,
}

impl<S: Space> Prepared<S> {
    /// Prepares a problem, reusing memory.
    pub fn update(&mut self, problem: &ContactProblem<S>) {
        let masses = &problem.inverse_masses;
        self.contacts.clear();
        self.contacts.extend(problem.contacts.iter().map(|c| {
            let along = |d: S::Vector| {
                let on_a = Twist::new(d, S::moment(c.arm_a, d));
                let on_b = Twist::new(-d, -S::moment(c.arm_b, d));
                Row::new(c.a, c.b, on_a, on_b, masses)
            };
            let normal = along(c.normal);
            let first = along(S::tangent(c.normal, 0));
            let tangents = [first, if S::SLIP > 1 { along(S::tangent(c.normal, 1)) } else { first }];
            PreparedContact {
                normal,
                tangents,
                normal_mass: 1.0 / normal.inverse_effective_mass,
                tangent_mass: 1.0 / largest_eigenvalue::<S>(&tangents),
                target: c.target,
                restitution: c.restitution,
                friction: c.friction,
            }
        }));
        self.rows.clear();
        self.rows.extend(problem.rows.iter().map(|r| Row::new(r.a, r.b, r.on_a, r.on_b, masses)));
    }
    /// A prepared problem.
    pub fn of(problem: &ContactProblem<S>) -> Self {
        let mut prepared = Prepared { contacts: Vec::new(), rows: Vec::new() };
        prepared.update(problem);
        prepared
    }
    /// v += M^-1 J^T impulses.
    pub fn apply(&self, impulses: &Impulses<S>, v: &mut [Twist<S>]) {
        for (c, g) in self.contacts.iter().zip(&impulses.contacts) {
            let Impulse { normal, tangent } = *g;
            if normal != 0.0 || tangent != S::Slip::ZERO {
                c.normal.apply(normal, v);
                c.apply_tangent(tangent, v);
            }
        }
        for (r, &l) in self.rows.iter().zip(&impulses.rows) {
            r.apply(l, v);
        }
    }
    /// All scalar rows in the problem's order: contacts (normal, tangents), then bounded rows.
    pub fn scalar_rows(&self) -> Vec<&Row<S>> {
        let mut all = Vec::with_capacity(self.contacts.len() * (1 + S::SLIP) + self.rows.len());
        for c in &self.contacts {
            all.push(&c.normal);
            all.extend(c.tangents.iter().take(S::SLIP));
        }
        all.extend(&self.rows);
        all
    }
}

/// Largest eigenvalue of the 1x1 or 2x2 tangential block of W.
fn largest_eigenvalue<S: Space>(tangents: &[Row<S>; 2]) -> f64 {
    let a = tangents[0].inverse_effective_mass;
    if S::SLIP == 1 {
        return a;
    }
    let (d, b) = (tangents[1].inverse_effective_mass, tangents[0].coupling(&tangents[1]));
    0.5 * (a + d) + (0.25 * (a - d) * (a - d) + b * b).sqrt()
}
