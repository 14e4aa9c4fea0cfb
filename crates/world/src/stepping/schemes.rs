//! The schemes side by side, and what the one that took the last step left behind. Knows no world.

use crate::bodies::Bodies;
use crate::force::Wrench;
use crate::impact::Impacts;
use crate::joint::JointImpulse;
use crate::narrow_phase::Touch;
use crate::observe::accounts::Accounts;
use crate::observe::event_log::{ContactSum, EventLog};
use crate::observe::report::SolveReport;
use crate::settings::Scheme;
use crate::stepping::events::EventsScheme;
use crate::stepping::fixed_step::FixedStep;
use crate::stepping::soft_step::SoftStep;
use carom_geometry::Geometry;
use carom_solver::{ContactProblem, Impulses, Twist};

/// What the joints gave in the last step, joint by joint.
#[derive(Clone, Debug, Default)]
pub struct JointsLast<S: Geometry> {
    /// Length of the step \[s\].
    pub dt: f64,
    /// Impulses.
    pub(crate) impulses: Vec<JointImpulse<S>>,
}

/// The schemes' memories, and which of them took the last step.
pub struct Schemes<S: Geometry> {
    /// Which took the last step.
    pub ran: Scheme,
    /// Steps of a fixed length.
    pub fixed_step: FixedStep<S>,
    /// Steps with events inside them.
    pub events: EventsScheme<S>,
    /// Soft steps.
    pub soft_step: SoftStep<S>,
    /// What the joints gave, the step's start included.
    pub joints: JointsLast<S>,
}

impl<S: Geometry> Default for Schemes<S> {
    fn default() -> Self {
        Schemes {
            ran: Scheme::default(),
            fixed_step: FixedStep::default(),
            events: EventsScheme::default(),
            soft_step: SoftStep::default(),
            joints: JointsLast::default(),
        }
    }
}

impl<S: Geometry> Schemes<S> {
    /// The last step's contact problem, its impulses, and the touch of each contact.
    pub fn contact(&self, bodies: &Bodies<S>) -> (&ContactProblem<S>, &Impulses<S>, &[usize]) {
        match self.ran {
            Scheme::FixedStep => {
                let s = &self.fixed_step;
                (&s.problem, &s.impulses, &s.pressed)
            }
            Scheme::Events => {
                let s = &self.events;
                (&s.problem, &s.impulses, &s.pressed)
            }
            Scheme::SoftStep => self.soft_step.contact(bodies),
        }
    }
    /// The last step's touches; the schemes that make none of their own found these.
    pub fn touches<'a>(&'a self, found: &'a [Touch<S>]) -> &'a [Touch<S>] {
        match self.ran {
            Scheme::FixedStep | Scheme::Events => found,
            Scheme::SoftStep => self.soft_step.touches(),
        }
    }
    /// How many they are, and the smallest gap \[m\] with its bodies.
    pub fn met(&self, found: &[Touch<S>]) -> (usize, Option<(f64, usize, usize)>) {
        if self.ran == Scheme::SoftStep {
            return self.soft_step.met();
        }
        let deepest = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap)).map(|t| (t.gap, t.a, t.b));
        (found.len(), deepest)
    }
    /// What the scheme's last step made the joints give.
    pub(crate) fn joint_impulses(&self) -> &[JointImpulse<S>] {
        match self.ran {
            Scheme::FixedStep => &self.fixed_step.joints,
            Scheme::Events => &self.events.joints,
            Scheme::SoftStep => &self.soft_step.joints,
        }
    }
    /// The last step's impacts.
    pub fn impacts(&self) -> &Impacts<S> {
        match self.ran {
            Scheme::FixedStep => &self.fixed_step.impacts,
            Scheme::Events => &self.events.impacts,
            Scheme::SoftStep => &self.soft_step.impacts,
        }
    }
    /// Makes room for what each body is given in the step to come, or none.
    pub fn begin_accounts(&mut self, bodies: usize, kept: bool) {
        let accounts = Accounts::new(bodies, kept);
        match self.ran {
            Scheme::FixedStep => self.fixed_step.accounts = accounts,
            Scheme::Events => self.events.accounts = accounts,
            Scheme::SoftStep => self.soft_step.accounts = accounts,
        }
    }
    /// What each body was given in the last step.
    pub fn accounts(&self) -> &Accounts<S> {
        match self.ran {
            Scheme::FixedStep => &self.fixed_step.accounts,
            Scheme::Events => &self.events.accounts,
            Scheme::SoftStep => &self.soft_step.accounts,
        }
    }
    /// What happened in the last step, where its scheme finds events.
    pub fn log(&self) -> Option<&EventLog<S>> {
        (self.ran == Scheme::Events).then_some(&self.events.log)
    }
    /// What each touch did in the whole last step, where its scheme divides steps.
    pub fn sums(&self) -> Option<&[ContactSum<S>]> {
        (self.ran == Scheme::Events).then_some(self.events.sums.as_slice())
    }
    /// The solve that the last step was refused for.
    pub fn take_failed(&mut self) -> Option<SolveReport> {
        match self.ran {
            Scheme::FixedStep => self.fixed_step.failed.take(),
            Scheme::Events => self.events.failed.take(),
            Scheme::SoftStep => self.soft_step.failed.take(),
        }
    }
    /// Applied loads of the last step on each body.
    pub fn loads(&self) -> &[Wrench<S>] {
        match self.ran {
            Scheme::FixedStep => &self.fixed_step.loads,
            Scheme::Events => &self.events.loads,
            Scheme::SoftStep => &self.soft_step.loads,
        }
    }
    /// How far the last step's position correction moved and turned each body; empty where there was none.
    pub fn correction(&self) -> &[Twist<S>] {
        match self.ran {
            Scheme::FixedStep => &self.fixed_step.correction.moved,
            Scheme::Events | Scheme::SoftStep => &[],
        }
    }
}
