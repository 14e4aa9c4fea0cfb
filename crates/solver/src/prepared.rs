//! A problem made ready for sweeping: every scalar row J_i with its response M^-1 J_i^T and J_i M^-1 J_i^T
//! (theory eqs. 5.2 to 5.5). A contact's rows act on a and opposite on b, so they keep one direction instead of
//! two twists: a sweep is bound by the memory it reads. Knows no solver.

use crate::problem::{Contact, ContactProblem, Impulse, Impulses, InverseMass, Twist};
use crate::resistance::PreparedResistance;
use carom_math::{Column, Inertia, Space};

/// One scalar row of J in full, with what a solver needs of it.
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
        let mut row = Row { a, b, on_a, on_b, response_a, response_b, inverse_effective_mass: 0.0 };
        row.inverse_effective_mass = row.coupling(&row);
        row
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
    /// J_i M^-1 J_j^T: an entry of A. A row may name one body twice.
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

/// One direction of a contact: the row [d, r_a x d, -d, -(r_b x d)] between two different bodies.
#[derive(Clone, Copy, Debug)]
pub struct ContactRow<S: Space> {
    /// Index of body a.
    pub a: u32,
    /// Index of body b.
    pub b: u32,
    /// Unit direction d.
    pub direction: S::Vector,
    /// r_a x d.
    pub moment_a: S::Spin,
    /// r_b x d.
    pub moment_b: S::Spin,
    /// I_a^-1 (r_a x d): change of a's spin per unit impulse.
    pub turn_a: S::Spin,
    /// I_b^-1 (r_b x d): change of b's spin per unit impulse, sign reversed.
    pub turn_b: S::Spin,
    /// J M^-1 J^T of this row: inverse effective mass \[1/kg\].
    pub inverse_effective_mass: f64,
}

/// Velocity of a's point relative to b's along a direction d, whose moments r_a x d and r_b x d are given.
#[inline(always)]
pub(crate) fn along<S: Space>(
    direction: &S::Vector,
    (moment_a, moment_b): &(S::Spin, S::Spin),
    a: &Twist<S>,
    b: &Twist<S>,
) -> f64 {
    direction.dot(a.linear - b.linear) + (moment_a.dot(a.angular) - moment_b.dot(b.angular))
}

impl<S: Space> ContactRow<S> {
    #[inline]
    pub(crate) fn new(c: &Contact<S>, direction: S::Vector, masses: &[InverseMass<S>]) -> Self {
        let (moment_a, moment_b) = (S::moment(c.arm_a, direction), S::moment(c.arm_b, direction));
        let (mass_a, mass_b) = (&masses[c.a], &masses[c.b]);
        let (turn_a, turn_b) = (mass_a.angular.apply(moment_a), mass_b.angular.apply(moment_b));
        let sliding = (mass_a.linear + mass_b.linear) * direction.norm_squared();
        let inverse_effective_mass = sliding + moment_a.dot(turn_a) + moment_b.dot(turn_b);
        let (a, b) = (c.a as u32, c.b as u32);
        ContactRow { a, b, direction, moment_a, moment_b, turn_a, turn_b, inverse_effective_mass }
    }
    /// J u: velocity of a's point relative to b's along the direction.
    #[inline]
    pub fn velocity(&self, v: &[Twist<S>]) -> f64 {
        self.velocity_between(&v[self.a as usize], &v[self.b as usize])
    }
    /// The same from the velocities of the two bodies.
    #[inline]
    pub fn velocity_between(&self, a: &Twist<S>, b: &Twist<S>) -> f64 {
        along(&self.direction, &(self.moment_a, self.moment_b), a, b)
    }
    /// Adds the response to an impulse along the row to the velocities of the two bodies, of these inverse masses \[1/kg\].
    #[inline]
    pub fn push(&self, impulse: f64, (mass_a, mass_b): (f64, f64), (a, b): (&mut Twist<S>, &mut Twist<S>)) {
        let force = self.direction * impulse;
        a.linear += force * mass_a;
        b.linear -= force * mass_b;
        a.angular += self.turn_a * impulse;
        b.angular -= self.turn_b * impulse;
    }
    /// The row in full.
    pub fn full(&self, masses: &[InverseMass<S>]) -> Row<S> {
        let on_a = Twist::new(self.direction, self.moment_a);
        let on_b = Twist::new(-self.direction, -self.moment_b);
        Row::new(self.a as usize, self.b as usize, on_a, on_b, masses)
    }
}

/// The rows of one contact and the numbers of its law.
#[derive(Clone, Copy, Debug)]
pub struct PreparedContact<S: Space> {
    /// Normal row.
    pub normal: ContactRow<S>,
    /// Tangential rows; in the plane the second repeats the first and is never read.
    pub tangents: [ContactRow<S>; 2],
    /// Inverse mass of a \[1/kg\].
    pub inverse_mass_a: f64,
    /// Inverse mass of b \[1/kg\].
    pub inverse_mass_b: f64,
    /// m_n = 1/W_nn \[kg\].
    pub normal_mass: f64,
    /// m_t = 1/lambda_max(W_tt) \[kg\]: the scalar friction step whose fixed point is Coulomb's law.
    pub tangent_mass: f64,
    /// lambda_max(W_tt) \[1/kg\].
    pub inverse_tangent_mass: f64,
    /// W_tn: what a unit normal impulse adds to the slip \[1/kg\].
    pub normal_coupling: S::Slip,
    /// Entry of W_tt that couples the two tangents \[1/kg\]; zero in the plane.
    pub tangent_coupling: f64,
    /// Normal velocity that a pressed contact ends with \[m/s\].
    pub target: f64,
    /// Slip that a contact ends with inside its friction limit \[m/s\].
    pub slip_target: S::Slip,
    /// Coefficient of restitution \[1\].
    pub restitution: f64,
    /// Coefficient of friction \[1\].
    pub friction: f64,
}

impl<S: Space> PreparedContact<S> {
    /// The rows of a contact.
    pub fn new(c: &Contact<S>, masses: &[InverseMass<S>]) -> Self {
        let normal = ContactRow::new(c, c.normal, masses);
        let first = ContactRow::new(c, S::tangent(c.normal, 0), masses);
        let second = if S::SLIP > 1 { ContactRow::new(c, S::tangent(c.normal, 1), masses) } else { first };
        let tangents = [first, second];
        // the directions are perpendicular, so only the turning couples them
        let coupling =
            |p: &ContactRow<S>, q: &ContactRow<S>| p.moment_a.dot(q.turn_a) + p.moment_b.dot(q.turn_b);
        let tangent_coupling = if S::SLIP > 1 { coupling(&tangents[0], &tangents[1]) } else { 0.0 };
        let largest = largest_eigenvalue::<S>(&tangents, tangent_coupling);
        // where no impulse changes the slip, any step length has the same fixed point
        let inverse_tangent_mass = if largest > 0.0 { largest } else { normal.inverse_effective_mass };
        PreparedContact {
            normal,
            tangents,
            inverse_mass_a: masses[c.a].linear,
            inverse_mass_b: masses[c.b].linear,
            normal_mass: 1.0 / normal.inverse_effective_mass,
            tangent_mass: 1.0 / inverse_tangent_mass,
            inverse_tangent_mass,
            normal_coupling: S::Slip::from_fn(|k| coupling(&tangents[k], &normal)),
            tangent_coupling,
            target: c.target,
            slip_target: c.slip_target,
            restitution: c.restitution,
            friction: c.friction,
        }
    }
    /// W_ii of the contact, the normal first \[1/kg\]; D is 1 for its normal alone.
    pub fn block<const D: usize>(&self) -> [[f64; D]; D] {
        std::array::from_fn(|r| {
            std::array::from_fn(|c| match (r.min(c), r.max(c)) {
                (0, 0) => self.normal.inverse_effective_mass,
                (0, k) => self.normal_coupling[k - 1],
                (k, l) if k == l => self.tangents[k - 1].inverse_effective_mass,
                _ => self.tangent_coupling,
            })
        })
    }
    /// Normal relative velocity, and the slip over the slip asked for.
    #[inline]
    pub fn relative_velocity(&self, v: &[Twist<S>]) -> (f64, S::Slip) {
        let (a, b) = self.pair(v);
        self.velocity_between(&a, &b)
    }
    /// The same from the velocities of the two bodies.
    #[inline]
    pub fn velocity_between(&self, a: &Twist<S>, b: &Twist<S>) -> (f64, S::Slip) {
        (self.normal.velocity_between(a, b), self.slip_between(a, b))
    }
    /// The slip over the slip asked for, u_t - slip_target: what friction acts against.
    #[inline]
    pub fn slip(&self, v: &[Twist<S>]) -> S::Slip {
        let (a, b) = self.pair(v);
        self.slip_between(&a, &b)
    }
    /// The same from the velocities of the two bodies.
    #[inline]
    pub fn slip_between(&self, a: &Twist<S>, b: &Twist<S>) -> S::Slip {
        S::Slip::from_fn(|k| self.tangents[k].velocity_between(a, b) - self.slip_target[k])
    }
    /// Velocities of the two bodies. A sweep works on these copies and stores them once.
    #[inline]
    pub fn pair(&self, v: &[Twist<S>]) -> (Twist<S>, Twist<S>) {
        (v[self.normal.a as usize], v[self.normal.b as usize])
    }
    /// Stores the velocities of the two bodies.
    #[inline]
    pub fn store(&self, (a, b): (Twist<S>, Twist<S>), v: &mut [Twist<S>]) {
        v[self.normal.a as usize] = a;
        v[self.normal.b as usize] = b;
    }
    /// Adds the response to a normal impulse to the velocities of the two bodies.
    #[inline]
    pub fn push_normal(&self, impulse: f64, a: &mut Twist<S>, b: &mut Twist<S>) {
        self.normal.push(impulse, (self.inverse_mass_a, self.inverse_mass_b), (a, b));
    }
    /// Adds the response to an impulse to the velocities of the two bodies.
    #[inline]
    pub fn push(&self, impulse: &Impulse<S>, a: &mut Twist<S>, b: &mut Twist<S>) {
        if impulse.tangent == S::Slip::ZERO {
            return self.push_normal(impulse.normal, a, b);
        }
        self.push_all(impulse, a, b);
    }
    /// The same without a look at whether there is friction: sweeps know it.
    #[inline(always)]
    pub fn push_all(&self, impulse: &Impulse<S>, a: &mut Twist<S>, b: &mut Twist<S>) {
        let mut force = self.normal.direction * impulse.normal;
        let mut turn_a = self.normal.turn_a * impulse.normal;
        let mut turn_b = self.normal.turn_b * impulse.normal;
        for k in 0..S::SLIP {
            force += self.tangents[k].direction * impulse.tangent[k];
            turn_a += self.tangents[k].turn_a * impulse.tangent[k];
            turn_b += self.tangents[k].turn_b * impulse.tangent[k];
        }
        a.linear += force * self.inverse_mass_a;
        b.linear -= force * self.inverse_mass_b;
        a.angular += turn_a;
        b.angular -= turn_b;
    }
    /// Applies an impulse of the contact.
    #[inline]
    pub fn apply(&self, impulse: &Impulse<S>, v: &mut [Twist<S>]) {
        let (mut a, mut b) = self.pair(v);
        self.push(impulse, &mut a, &mut b);
        self.store((a, b), v);
    }
}

/// All rows of a problem.
#[derive(Clone, Debug, Default)]
pub struct Prepared<S: Space> {
    /// The contacts.
    pub contacts: Vec<PreparedContact<S>>,
    /// The bounded rows.
    pub rows: Vec<Row<S>>,
    /// Rolling and spinning friction.
    pub resistances: Vec<PreparedResistance<S>>,
}

impl<S: Space> Prepared<S> {
    /// Prepares a problem, reusing memory.
    pub fn update(&mut self, problem: &ContactProblem<S>) {
        let masses = &problem.inverse_masses;
        self.contacts.clear();
        self.contacts.extend(problem.contacts.iter().map(|c| PreparedContact::new(c, masses)));
        self.rows.clear();
        self.rows.extend(problem.rows.iter().map(|r| Row::new(r.a, r.b, r.on_a, r.on_b, masses)));
        self.resistances.clear();
        let ready = |r| PreparedResistance::new(r, problem, &self.contacts[r.contact]);
        self.resistances.extend(problem.resistances.iter().map(ready));
    }
    /// A prepared problem.
    pub fn of(problem: &ContactProblem<S>) -> Self {
        let mut prepared = Prepared { contacts: Vec::new(), rows: Vec::new(), resistances: Vec::new() };
        prepared.update(problem);
        prepared
    }
    /// v += M^-1 J^T impulses.
    pub fn apply(&self, impulses: &Impulses<S>, v: &mut [Twist<S>]) {
        for (c, g) in self.contacts.iter().zip(&impulses.contacts) {
            if *g != Impulse::default() {
                c.apply(g, v);
            }
        }
        for (r, &l) in self.rows.iter().zip(&impulses.rows) {
            r.apply(l, v);
        }
        for (r, &m) in self.resistances.iter().zip(&impulses.moments) {
            r.apply(m, v);
        }
    }
    /// J u - target of every scalar row after the impulses, in the order of `Impulses::flat`. This is A gamma - b,
    /// formed on the bodies: impulses that nearly cancel lose no digits.
    pub fn velocity_errors(&self, problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Vec<f64> {
        let mut after = problem.velocities.clone();
        self.apply(impulses, &mut after);
        let mut errors = Vec::with_capacity(problem.scalar_rows());
        for c in &self.contacts {
            let (normal, slip) = c.relative_velocity(&after);
            errors.push(normal - c.target);
            errors.extend_from_slice(slip.as_slice());
        }
        errors.extend(
            self.rows.iter().zip(&problem.rows).map(|(row, given)| row.velocity(&after) - given.target),
        );
        self.resistances.iter().for_each(|r| errors.extend_from_slice(r.spin(&after).as_slice()));
        errors
    }
    /// All scalar rows in the problem's order: contacts (normal, tangents), then bounded rows, then
    /// moments.
    pub fn scalar_rows(&self, masses: &[InverseMass<S>]) -> Vec<Row<S>> {
        let mut all = Vec::with_capacity(self.contacts.len() * (1 + S::SLIP) + self.rows.len());
        for c in &self.contacts {
            all.push(c.normal.full(masses));
            all.extend(c.tangents.iter().take(S::SLIP).map(|t| t.full(masses)));
        }
        all.extend_from_slice(&self.rows);
        for (a, b, axis) in self.resistances.iter().flat_map(PreparedResistance::rows) {
            let turning = |axis| Twist::new(S::Vector::ZERO, axis);
            all.push(Row::new(a, b, turning(axis), turning(-axis), masses));
        }
        all
    }
}

/// Largest eigenvalue of the 1x1 or 2x2 tangential block of W.
fn largest_eigenvalue<S: Space>([first, second]: &[ContactRow<S>; 2], coupling: f64) -> f64 {
    let (a, d) = (first.inverse_effective_mass, second.inverse_effective_mass);
    if S::SLIP == 1 { a } else { 0.5 * (a + d) + (0.25 * (a - d) * (a - d) + coupling * coupling).sqrt() }
}
