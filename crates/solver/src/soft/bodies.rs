//! Bodies as the lanes see them: records of eight numbers, gathered eight at a time and turned. Record 0 is the
//! obstacle at rest that empty lanes and walls point to: nothing moves it, so lanes may share it.

use super::shared::Shared;
use carom_math::lanes::{Eight, Lanes, Real, WIDTH};
use carom_math::{Several, Wide};
use std::ops::Range;

/// A body at the step's start.
#[derive(Clone, Copy)]
pub struct SoftBody<S: Wide> {
    /// Velocity of the centre of mass \[m/s\].
    pub velocity: S::Vectors<f32>,
    /// Angular velocity \[rad/s\].
    pub spin: S::Spins<f32>,
    /// Change of velocity by loads in a substep \[m/s\].
    pub load: S::Vectors<f32>,
    /// Change of angular velocity by loads in a substep \[rad/s\].
    pub spin_load: S::Spins<f32>,
    /// Inverse mass \[1/kg\]; 0 for obstacles.
    pub inverse_mass: f32,
    /// Inverse inertia in world axes \[1/(kg m^2)\].
    pub inverse_inertia: S::Inertias<f32>,
}

/// Records of all bodies, one list per use.
pub struct Records<S: Wide> {
    /// Velocity, spin, inverse mass, and the inverse inertia where it fits.
    pub motion: Vec<Eight>,
    /// Displacement and change of attitude since the step began.
    pub moved: Vec<Eight>,
    /// Inverse inertias that do not fit beside the motion.
    inertia: Vec<Eight>,
    /// Loads of a substep.
    load: Vec<Eight>,
    /// Motion at the start of the substep before.
    before: Vec<Eight>,
    /// Motion at the start of the step.
    start: Vec<Eight>,
    space: std::marker::PhantomData<S>,
}

impl<S: Wide> Default for Records<S> {
    fn default() -> Self {
        let (motion, moved, inertia, load, before, start) = Default::default();
        Records { motion, moved, inertia, load, before, start, space: std::marker::PhantomData }
    }
}

/// Numbers of a motion: velocity and spin.
const fn freedoms<S: Wide>() -> usize {
    <S::Vectors<f32> as Several<f32>>::LEN + <S::Spins<f32> as Several<f32>>::LEN
}

const fn inertia_fits<S: Wide>() -> bool {
    freedoms::<S>() + 1 + <S::Inertias<f32> as Several<f32>>::LEN <= WIDTH
}

/// Eight bodies in registers.
pub struct Eightfold<S: Wide, L: Lanes> {
    rows: [Real<L>; WIDTH],
    /// Velocities.
    pub velocity: S::Vectors<Real<L>>,
    /// Angular velocities.
    pub spin: S::Spins<Real<L>>,
    /// Inverse masses.
    pub inverse_mass: Real<L>,
    /// Inverse inertias.
    pub inverse_inertia: S::Inertias<Real<L>>,
}

/// Eight bodies' changes of pose.
pub struct Moved<S: Wide, L: Lanes> {
    /// Displacements.
    pub by: S::Vectors<Real<L>>,
    /// Changes of attitude.
    pub turn: S::Turns<Real<L>>,
}

#[inline(always)]
fn gather<L: Lanes>(lanes: L, record: impl Fn(usize) -> Eight, ids: &[u32; WIDTH]) -> [Real<L>; WIDTH] {
    let mut rows = [Real::all(lanes, 0.0); WIDTH];
    for k in 0..WIDTH {
        rows[k] = Real::load(lanes, &record(ids[k] as usize));
    }
    Real::turn(rows)
}

/// The records while workers share them.
pub struct Table<'a, S: Wide> {
    motion: Shared<'a, Eight>,
    moved: Shared<'a, Eight>,
    before: Shared<'a, Eight>,
    inertia: &'a [Eight],
    load: &'a [Eight],
    start: &'a [Eight],
    /// Records before this one are obstacles.
    obstacles: u32,
    space: std::marker::PhantomData<S>,
}

impl<S: Wide> Records<S> {
    /// Only the obstacle at rest.
    pub fn begin(&mut self) {
        for list in [
            &mut self.motion,
            &mut self.moved,
            &mut self.inertia,
            &mut self.load,
            &mut self.before,
            &mut self.start,
        ] {
            list.clear();
        }
        let (v, w) = (S::Vectors::all(0.0), S::Spins::all(0.0));
        let inverse_inertia = S::Inertias::all(0.0);
        self.push(&SoftBody {
            velocity: v,
            spin: w,
            load: v,
            spin_load: w,
            inverse_mass: 0.0,
            inverse_inertia,
        });
    }

    /// Adds a body and returns its record.
    pub fn push(&mut self, body: &SoftBody<S>) -> u32 {
        let (d, a) = (body.velocity.slice().len(), body.spin.slice().len());
        let mut motion = Eight::default();
        motion.0[..d].copy_from_slice(body.velocity.slice());
        motion.0[d..d + a].copy_from_slice(body.spin.slice());
        let mut load = Eight::default();
        load.0[..d].copy_from_slice(body.load.slice());
        load.0[d..d + a].copy_from_slice(body.spin_load.slice());
        self.before.push(motion);
        self.start.push(motion);
        motion.0[d + a] = body.inverse_mass;
        let inertia = body.inverse_inertia.slice();
        if inertia_fits::<S>() {
            motion.0[d + a + 1..d + a + 1 + inertia.len()].copy_from_slice(inertia);
        } else {
            let mut record = Eight::default();
            record.0[..inertia.len()].copy_from_slice(inertia);
            self.inertia.push(record);
        }
        let mut moved = Eight::default();
        let still = S::no_turn();
        moved.0[d..d + still.slice().len()].copy_from_slice(still.slice());
        self.motion.push(motion);
        self.moved.push(moved);
        self.load.push(load);
        (self.motion.len() - 1) as u32
    }

    /// For workers to share; records before `obstacles` are those of obstacles.
    pub fn table(&mut self, obstacles: u32) -> Table<'_, S> {
        Table {
            motion: Shared::new(&mut self.motion),
            moved: Shared::new(&mut self.moved),
            before: Shared::new(&mut self.before),
            inertia: &self.inertia,
            load: &self.load,
            start: &self.start,
            obstacles,
            space: std::marker::PhantomData,
        }
    }
}

impl<S: Wide> Table<'_, S> {
    /// Means of the velocities at the step's start and now, of eight bodies.
    #[inline(always)]
    pub fn mean<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH]) -> Eightfold<S, L> {
        let start = gather(lanes, |i| self.start[i], ids);
        let mut bodies = self.gather(lanes, ids);
        let half = Real::all(lanes, 0.5);
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        for (v, start) in bodies.velocity.slice_mut().iter_mut().zip(&start) {
            *v = half * (*start + *v);
        }
        for (w, start) in bodies.spin.slice_mut().iter_mut().zip(&start[d..]) {
            *w = half * (*start + *w);
        }
        bodies
    }

    /// Velocities and inverse masses of eight bodies.
    #[inline(always)]
    pub fn gather<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH]) -> Eightfold<S, L> {
        let rows = gather(lanes, |i| self.motion.get(i), ids);
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let mut velocity = S::Vectors::all(rows[0]);
        let mut spin = S::Spins::all(rows[0]);
        let mut inverse_inertia = S::Inertias::all(rows[0]);
        for k in 0..d {
            velocity[k] = rows[k];
        }
        for k in 0..a {
            spin[k] = rows[d + k];
        }
        let n = <S::Inertias<f32> as Several<f32>>::LEN;
        if inertia_fits::<S>() {
            for k in 0..n {
                inverse_inertia[k] = rows[d + a + 1 + k];
            }
        } else {
            let inertia = gather(lanes, |i| self.inertia[i], ids);
            for k in 0..n {
                inverse_inertia[k] = inertia[k];
            }
        }
        Eightfold { rows, velocity, spin, inverse_mass: rows[d + a], inverse_inertia }
    }

    /// Writes velocities back. Not those of obstacles, which impulses do not change and packs of a colour share.
    #[inline(always)]
    pub fn scatter<L: Lanes>(&self, ids: &[u32; WIDTH], bodies: &Eightfold<S, L>) {
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let mut rows = bodies.rows;
        rows[..d].copy_from_slice(bodies.velocity.slice());
        rows[d..d + a].copy_from_slice(bodies.spin.slice());
        let rows = Real::turn(rows);
        for k in 0..WIDTH {
            if ids[k] >= self.obstacles {
                self.motion.set(ids[k] as usize, rows[k].store());
            }
        }
    }

    /// How eight bodies moved since the step began.
    #[inline(always)]
    pub fn moved<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH]) -> Moved<S, L> {
        let rows = gather(lanes, |i| self.moved.get(i), ids);
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        let mut by = S::Vectors::all(rows[0]);
        let mut turn = S::Turns::all(rows[0]);
        for k in 0..d {
            by[k] = rows[k];
        }
        for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
            turn[k] = rows[d + k];
        }
        Moved { by, turn }
    }

    /// Velocities of some records after a substep's loads. From the second substep on also after its warm start: arms and inertias
    /// stand still in a step, so what all contacts gave a body in the substep before is v - v_before - load.
    #[inline(always)]
    pub fn accelerate<L: Lanes>(&self, lanes: L, records: Range<usize>, substep: usize) {
        for i in records {
            let (motion, before) = (self.motion.get(i), self.before.get(i));
            let (v, load) = (Real::load(lanes, &motion), Real::load(lanes, &self.load[i]));
            // before the first substep `before` is the velocity without the warm start; inverse masses, beside it, have no load
            let then = Real::load(lanes, &before);
            let faster = if substep == 0 { v + load } else { v + (v - then) };
            let mut after = faster.store();
            let n = freedoms::<S>();
            after.0[n..].copy_from_slice(&motion.0[n..]);
            self.motion.set(i, after);
            if substep > 0 {
                self.before.set(i, motion);
            }
        }
    }

    /// Poses of some records after a substep of length `h` \[s\], eight at a time.
    #[inline(always)]
    pub fn move_on<L: Lanes>(&self, lanes: L, records: Range<usize>, h: f32) {
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        let h = Real::all(lanes, h);
        for first in records.clone().step_by(WIDTH) {
            // where fewer than eight are left the last is moved by several lanes, to the same place
            let ids = std::array::from_fn(|k| (first + k).min(records.end - 1) as u32);
            let motion = gather(lanes, |i| self.motion.get(i), &ids);
            let mut moved = gather(lanes, |i| self.moved.get(i), &ids);
            let mut turn = S::Turns::all(h);
            let mut angle = S::Spins::all(h);
            for k in 0..d {
                moved[k] += h * motion[k];
            }
            for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
                angle[k] = h * motion[d + k];
            }
            for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
                turn[k] = moved[d + k];
            }
            let turn = S::turned_by(&turn, &angle);
            moved[d..d + turn.slice().len()].copy_from_slice(turn.slice());
            let moved = Real::turn(moved);
            for k in 0..WIDTH {
                self.moved.set(ids[k] as usize, moved[k].store());
            }
        }
    }
}
