//! The linear systems of all second-order steps: (W~ + D) dx = rhs with D block diagonal, not symmetric. Contact
//! space factorises them as they stand; contacts between the same two bodies are condensed where that is cheaper
//! (`groups`), and bodies take the contacts' place where the problem knows them (`bodies`).

use super::analyses::Analyses;
use super::blocks::squared_length;
use super::bodies::BodySpace;
use super::bodies::Rows;
use super::groups::GroupSpace;
use super::krylov::Krylov;
use super::operator::{Matrix, Operator, assemble};
use super::pivoted::Pivoted;
use super::scaled::Scaled;
use crate::linear::{Analysis, Factor};
use std::sync::Arc;

/// D of one contact.
pub type Block<const D: usize> = [[f64; D]; D];

/// D per contact, and the least stiffness that a condensed form takes for its own.
pub type Stiffness<'a, const D: usize> = (&'a [Block<D>], &'a [f64]);

/// The system of a scaled problem in the form that is cheapest to factorise.
#[derive(Clone, Debug, Default)]
pub struct System<const D: usize> {
    form: Form<D>,
    /// D per contact, written by whoever asks for a factorisation; padded.
    pub blocks: Vec<Block<D>>,
    /// Factorisations so far.
    pub factorisations: usize,
    /// Refines solutions in contact space too.
    pub careful: bool,
    /// Goes over to a form that loses fewer digits where this one loses too many.
    pub falls_back: bool,
    /// Residual of the last refined solution over its right-hand side.
    pub left: f64,
    /// True where the last of these needed no refinement.
    is_plain: bool,
    /// Least stiffness per contact, `LEAST` times |W~_ii|.
    least: Vec<f64>,
    /// Right-hand side and residual of a refinement.
    given: Vec<[f64; D]>,
    residual: Vec<[f64; D]>,
    krylov: Krylov<D>,
    /// The rows that contact space was assembled from, values apart.
    assembled_from: Option<Rows<D>>,
    /// Memory of a form that was let go.
    spare: Spare,
}

/// Memory for factors and for the matrix that they are of.
#[derive(Clone, Debug, Default)]
pub struct Spare {
    pub factor: Factor,
    pub values: Vec<f64>,
}

#[derive(Clone, Debug, Default)]
enum Form<const D: usize> {
    /// None yet: a system that was put elsewhere leaves this behind, which takes no memory.
    #[default]
    Open,
    Contacts(ContactSpace),
    Groups(GroupSpace<D>),
    Bodies(BodySpace<D>),
    Pivoted(Pivoted<D>),
}

/// One node of the factorised graph per contact.
#[derive(Clone, Debug, Default)]
struct ContactSpace {
    analysis: Arc<Analysis>,
    factor: Factor,
    matrix: Arc<Matrix>,
    /// W~ + D.
    values: Vec<f64>,
}

impl ContactSpace {
    fn of(matrix: Arc<Matrix>, analyses: &mut Analyses, spare: Spare) -> Self {
        let Spare { factor, mut values } = spare;
        values.clone_from(&matrix.values);
        ContactSpace { analysis: analyses.of(&matrix.graph), factor, values, matrix }
    }
}

/// A solution of a condensed system is corrected while its residual is above this share of the right-hand side.
const REFINED: f64 = 1e-11;
/// Least stiffness of a contact next to |W~_ii| that is inverted as it is: the root of the rounding error. D^-1 costs
/// a condensed form rounding error times D^-1, stiffening costs as much as it changes D; here the two meet.
const LEAST: f64 = 1.5e-8;

/// Nanoseconds of a multiply-add of a factorisation, and of everything else in an iteration per contact, on one core of
/// 2026.
const PER_FLOP: f64 = 0.06;
const PER_CONTACT: f64 = 250.0;

/// Contact space is given up, where that is asked for, when its refined solutions leave more than this share.
const CAREFUL: f64 = 1e-9;
/// Contact space is no way out where its factorisation takes more multiply-adds.
const DEAR: f64 = 5e9;
/// A form whose refined solutions leave more than this share is given up.
const LOST: f64 = 1e-6;

impl<const D: usize> System<D> {
    /// Becomes the system of a scaled problem; while the graph of contacts and bodies stands, in the form that it had.
    pub fn update(&mut self, scaled: &Scaled<D>, analyses: &mut Analyses) {
        if !self.refill(&scaled.operator) {
            self.choose(&scaled.operator, analyses);
        }
        let n = scaled.velocity.len();
        self.blocks.clear();
        self.blocks.resize(n, [[0.0; D]; D]);
        self.factorisations = 0;
        self.careful = false;
        self.falls_back = true;
        self.left = 0.0;
        self.is_plain = false;
        self.least.clear();
        self.least.extend(scaled.step.iter().map(|step| LEAST / step));
        for vector in [&mut self.given, &mut self.residual] {
            vector.clear();
            vector.resize(n, [0.0; D]);
        }
        self.krylov.forget();
    }
    /// Puts the values of an operator into the present form; false where its graph or the form is not that one's.
    fn refill(&mut self, operator: &Operator<D>) -> bool {
        let Operator::Bodies(rows) = operator else { return false };
        match &mut self.form {
            Form::Bodies(space) => space.refill(rows),
            Form::Contacts(space) => {
                if !self.assembled_from.as_ref().is_some_and(|before| before.has_graph_of(rows)) {
                    return false;
                }
                let Some(matrix) = Arc::get_mut(&mut space.matrix) else { return false };
                assemble(rows, matrix);
                space.values.clone_from(&matrix.values);
                true
            }
            Form::Open | Form::Groups(_) | Form::Pivoted(_) => false,
        }
    }
    /// Takes the cheapest form.
    fn choose(&mut self, operator: &Operator<D>, analyses: &mut Analyses) {
        self.assembled_from = None;
        let spare = std::mem::take(&mut self.spare);
        self.form = match operator {
            Operator::Matrix(matrix) => match GroupSpace::of(matrix, analyses) {
                Some(groups) => Form::Groups(groups.with_memory(spare)),
                None => Form::Contacts(ContactSpace::of(matrix.clone(), analyses, spare)),
            },
            Operator::Bodies(rows) => match BodySpace::of(rows, operator, analyses) {
                Ok(bodies) => Form::Bodies(bodies),
                Err(matrix) => {
                    self.assembled_from = Some(Rows { values: Vec::new(), ..rows.clone() });
                    Form::Contacts(ContactSpace::of(matrix, analyses, spare))
                }
            },
        };
    }
    /// Lets go of a matrix that is the operator's own, and keeps the memory of its form for the next.
    pub fn let_go(&mut self, operator: &Operator<D>) {
        if matches!(operator, Operator::Bodies(_)) {
            return;
        }
        match std::mem::take(&mut self.form) {
            Form::Contacts(ContactSpace { factor, values, .. }) => self.spare = Spare { factor, values },
            Form::Groups(space) => self.spare = space.memory(),
            Form::Open | Form::Bodies(_) | Form::Pivoted(_) => {}
        }
    }
    /// What an iteration with one factorisation takes, from sizes alone \[ns\].
    pub fn price(&self) -> f64 {
        let flops = match &self.form {
            Form::Contacts(space) => space.analysis.flops,
            Form::Groups(space) => space.flops(),
            Form::Bodies(space) => space.flops(),
            Form::Pivoted(_) => (self.least.len() as f64 * D as f64).powi(3) / 3.0,
            Form::Open => 0.0,
        };
        PER_FLOP * flops + PER_CONTACT * self.least.len() as f64
    }
    /// Factorises W~ + D with the present `blocks`; false when it is singular.
    pub fn factorize(&mut self) -> bool {
        self.factorisations += 1;
        match &mut self.form {
            Form::Contacts(space) => {
                for (block, &at) in self.blocks.iter().zip(space.matrix.diagonal.iter()) {
                    let at = at as usize;
                    for (k, &d) in block.as_flattened().iter().enumerate() {
                        space.values[at + k] = space.matrix.values[at + k] + d;
                    }
                }
                space.factor.factorize(&space.analysis, &space.values)
            }
            Form::Groups(space) => space.factorize((&self.blocks, &self.least)),
            Form::Bodies(space) => space.factorize((&self.blocks, &self.least)),
            Form::Pivoted(space) => space.factorize(&self.blocks),
            Form::Open => false,
        }
    }
    /// The sign of the determinant of the factorised W~ + D, if that of D is positive (those of its condensed forms
    /// differ from it by the determinants of D).
    pub fn determinant_sign(&self) -> f64 {
        match &self.form {
            Form::Contacts(space) => space.factor.determinant_sign(&space.analysis),
            Form::Groups(space) => space.determinant_sign(),
            Form::Bodies(space) => space.determinant_sign(),
            Form::Pivoted(space) => space.determinant_sign(),
            Form::Open => 1.0,
        }
    }
    /// Replaces rhs by a dx that another solution with the same factor will follow: its residual is not looked at where the
    /// last one's was small; false when it is not finite.
    pub fn foresee(&mut self, scaled: &Scaled<D>, x: &mut [[f64; D]]) -> bool {
        if !self.is_plain {
            return self.solve(scaled, x);
        }
        self.form.solve(x);
        x[..scaled.count()].as_flattened().iter().all(|v| v.is_finite())
    }
    /// Replaces rhs by dx; false when it is not finite.
    pub fn solve(&mut self, scaled: &Scaled<D>, x: &mut [[f64; D]]) -> bool {
        let count = scaled.count();
        if let Form::Contacts(space) = &mut self.form
            && !self.careful
        {
            let used = &mut x[..count];
            space.factor.solve(&space.analysis, used.as_flattened_mut());
            return used.as_flattened().iter().all(|v| v.is_finite());
        }
        self.given[..count].copy_from_slice(&x[..count]);
        let size = length(&self.given[..count]);
        self.form.solve(x);
        applied(scaled, &self.blocks, x, &mut self.residual);
        for (left, given) in self.residual[..count].iter_mut().zip(&self.given) {
            for k in 0..D {
                left[k] = given[k] - left[k];
            }
        }
        let mut left = length(&self.residual[..count]);
        let exact_form = matches!(self.form, Form::Contacts(_));
        // 1/D next to 1/D' a billion times smaller costs digits; the operator itself gives them back
        let enough = REFINED * size;
        self.is_plain = left <= enough;
        if !self.is_plain {
            let (form, blocks) = (&mut self.form, &self.blocks);
            left = self.krylov.correct(
                (&self.residual, enough),
                |v| form.solve(v),
                |v, out| applied(scaled, blocks, v, out),
                x,
            );
        }
        if self.careful && exact_form && !(left <= CAREFUL * size) && self.fall_back(scaled) {
            return self.again(scaled, x);
        }
        self.left = if size > 0.0 { left / size } else { 0.0 };
        if !(self.left <= LOST) {
            if !self.falls_back {
                return false;
            }
            if self.fall_back(scaled) {
                return self.again(scaled, x);
            }
        }
        x[..count].as_flattened().iter().all(|v| v.is_finite())
    }
    /// Goes over to a form that loses fewer digits; false when there is none.
    fn fall_back(&mut self, scaled: &Scaled<D>) -> bool {
        let form = match &self.form {
            Form::Contacts(space) => Pivoted::of(&space.matrix).map(Form::Pivoted),
            Form::Groups(_) | Form::Bodies(_) => {
                let matrix = scaled.operator.matrix(60 * scaled.count() + 1000);
                let space = matrix.map(|m| ContactSpace::of(m, &mut Analyses::default(), Spare::default()));
                space.filter(|s| s.analysis.flops < DEAR as _).map(Form::Contacts)
            }
            Form::Open | Form::Pivoted(_) => None,
        };
        // the next solve chooses anew
        self.assembled_from = None;
        form.map(|form| self.form = form).is_some()
    }
    /// Solves anew after a change of form.
    fn again(&mut self, scaled: &Scaled<D>, x: &mut [[f64; D]]) -> bool {
        x[..scaled.count()].copy_from_slice(&self.given[..scaled.count()]);
        // the same matrix in another form counts once: a budget's last factorisation may be this one
        self.factorisations -= 1;
        self.factorize() && self.solve(scaled, x)
    }
}

impl<const D: usize> Form<D> {
    fn solve(&mut self, x: &mut [[f64; D]]) {
        match self {
            Form::Contacts(space) => space.factor.solve(&space.analysis, x.as_flattened_mut()),
            Form::Groups(space) => space.solve(x),
            Form::Bodies(space) => space.solve(x),
            Form::Pivoted(space) => space.solve(x),
            Form::Open => {}
        }
    }
}

/// (W~ + D) x.
fn applied<const D: usize>(scaled: &Scaled<D>, blocks: &[Block<D>], x: &[[f64; D]], out: &mut [[f64; D]]) {
    scaled.product(x, out);
    for ((out, x), block) in out.iter_mut().zip(x).zip(blocks).take(scaled.count()) {
        for r in 0..D {
            for c in 0..D {
                out[r] += block[r][c] * x[c];
            }
        }
    }
}

/// D^-1; D is stiffened first where it is softer than `least` in some direction.
#[inline(always)]
pub fn stiffened_inverse<const D: usize>(block: &Block<D>, least: f64) -> Block<D> {
    let plain = inverse(block);
    let mut square = 0.0;
    for row in &plain {
        for c in row {
            square += c * c;
        }
    }
    if square * least * least <= 1.0 {
        return plain;
    }
    let mut stiffer = *block;
    for k in 0..D {
        stiffer[k][k] += least;
    }
    inverse(&stiffer)
}

fn length<const D: usize>(v: &[[f64; D]]) -> f64 {
    squared_length(v.as_flattened()).sqrt()
}

/// The inverse of a D x D block, by cofactors (D at most 3).
#[inline(always)]
fn inverse<const D: usize>(m: &Block<D>) -> Block<D> {
    let mut out = [[0.0; D]; D];
    match D {
        1 => out[0][0] = 1.0 / m[0][0],
        2 => {
            let scale = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
            (out[0][0], out[0][1]) = (m[1][1] * scale, -m[0][1] * scale);
            (out[1][0], out[1][1]) = (-m[1][0] * scale, m[0][0] * scale);
        }
        _ => {
            let minor = |i: usize, j: usize| {
                let (r, s) = ((i + 1) % 3, (i + 2) % 3);
                let (c, d) = ((j + 1) % 3, (j + 2) % 3);
                m[r][c] * m[s][d] - m[r][d] * m[s][c]
            };
            let (a, b, c) = (minor(0, 0), minor(0, 1), minor(0, 2));
            let scale = 1.0 / (m[0][0] * a + m[0][1] * b + m[0][2] * c);
            for i in 0..3 {
                for j in 0..3 {
                    out[i][j] = minor(j, i) * scale;
                }
            }
        }
    }
    out
}
