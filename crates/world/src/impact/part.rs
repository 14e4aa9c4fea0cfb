//! Who takes part in a round of impacts (theory sections 4.5 and 6.1): contacts that approach, and those that touch
//! and would feel it, as each law says. Contacts hang together through bodies that move. Knows no solver.

use crate::bodies::Bodies;
use crate::impact::{Role, Thresholds, reflections};
use crate::narrow_phase::{Touch, normal_velocity};
use crate::settings::ImpactLaw;
use carom_geometry::Geometry;
use carom_solver::Partition;

/// What one touch is to one round.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Ends with a bounce, as its law has it.
    pub bounces: bool,
    /// Normal velocity that it ends with when pressed \[m/s\].
    pub target: f64,
    /// Comes nearer than its target.
    pub approaches: bool,
    /// Makes the round necessary.
    pub calls: bool,
}

/// Sets what each touch is to the coming round; `done` marks those whose slow approach was resolved already. True
/// when anything calls for a round.
pub fn choose<S: Geometry>(
    bodies: &Bodies<S>,
    touches: &[Touch<S>],
    law: ImpactLaw,
    limits: &Thresholds,
    done: &[bool],
    parts: &mut Vec<Option<Part>>,
) -> bool {
    parts.clear();
    parts.extend(touches.iter().zip(done).map(|(t, done)| part(bodies, t, law, limits, *done)));
    match law {
        // asking contacts that separate to stop would make energy (theory eq. 4.23)
        ImpactLaw::Newton | ImpactLaw::Moreau if parts.iter().flatten().any(|p| p.bounces) => {
            for (t, part) in touches.iter().zip(&mut *parts) {
                let separates = normal_velocity(bodies, t) > limits.still_speed;
                *part = part.filter(|_| !separates);
            }
        }
        ImpactLaw::GeneralizedReflections => reflections::keep_approaches(bodies, touches, parts),
        _ => {}
    }
    parts.iter().flatten().any(|p| p.calls)
}

fn part<S: Geometry>(
    bodies: &Bodies<S>,
    t: &Touch<S>,
    law: ImpactLaw,
    limits: &Thresholds,
    done: bool,
) -> Option<Part> {
    let u = normal_velocity(bodies, t);
    let role = limits.role(t.gap, u, t.restitution);
    let bounces = role == Role::Bounces;
    let target = if bounces { -t.restitution * u } else { limits.closing(t.gap) };
    let approaches = u < target.min(0.0) - limits.still_speed;
    // slower ones leave an overlap of h u/2 at most, which the kick stops and the correction closes
    let calls = bounces || (role == Role::Holds && u < target.min(0.0) - limits.call_speed && !done);
    // an elastic contact that is open waits for its own approach; all others feel their neighbours at once
    let feels = t.restitution == 0.0 || t.gap <= limits.touching;
    let one_by_one = law == ImpactLaw::Sequential;
    let takes_part = bounces || one_by_one || (role == Role::Holds && (approaches || feels));
    takes_part.then_some(Part { bounces, target, approaches, calls })
}

/// The islands of the touches that take part.
pub struct Islands(Partition);

impl Islands {
    /// Joins the bodies that move and touch.
    pub fn of<S: Geometry>(bodies: &Bodies<S>, touches: &[Touch<S>], parts: &[Option<Part>]) -> Self {
        let pairs = touches.iter().zip(parts).filter(|(_, p)| p.is_some()).map(|(t, _)| (t.a, t.b));
        let mut islands = Partition::default();
        islands.reset(bodies.len());
        let joins = |&(a, b): &(usize, usize)| bodies.is_dynamic(a) && bodies.is_dynamic(b);
        pairs.filter(joins).for_each(|(a, b)| islands.join(a, b));
        bodies.jointed().for_each(|(a, b)| islands.join(a, b));
        Islands(islands)
    }
    /// The body that names a touch's island: an obstacle belongs to none, a contact is where its body that moves is.
    pub fn root<S: Geometry>(&mut self, bodies: &Bodies<S>, t: &Touch<S>) -> usize {
        self.0.root(if bodies.is_dynamic(t.a) { t.a } else { t.b })
    }
    /// The body that names a body's island.
    pub fn root_of(&mut self, body: usize) -> usize {
        self.0.root(body)
    }
    /// For each body that names an island, whether any of its parts is so.
    pub fn where_any<S: Geometry>(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        parts: &[Option<Part>],
        is_so: impl Fn(&Part) -> bool,
    ) -> Vec<bool> {
        let mut any = vec![false; bodies.len()];
        for (t, part) in touches.iter().zip(parts) {
            if part.as_ref().is_some_and(&is_so) {
                any[self.root(bodies, t)] = true;
            }
        }
        any
    }
}
