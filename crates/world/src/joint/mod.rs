//! Joints: what holds two bodies together, or one to the world (theory chapter 9). A joint is a constraint function g of
//! the poses, and the rows G of its derivative, which act at one point on both bodies, so that no angular momentum leaks.
//! Schemes choose impulses for which g vanishes at the end of a motion (the SHAKE form), not G v.

mod begin;
mod build;
mod frame;
mod list;
mod reaction;
mod spec;

pub use begin::{Memory, left};
pub use frame::{Frame, Joint, JointKind};
pub use list::Joints;
pub(crate) use list::mover;
pub use reaction::Reaction;
pub(crate) use reaction::{JointImpulse, add_all, wrenches};
pub use spec::{Anchor, JointSpec};

pub(crate) use begin::{begin, still};
