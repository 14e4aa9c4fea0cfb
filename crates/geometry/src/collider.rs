//! Shapes made ready for queries, one text for the plane and for space: half-spaces, cavities, rounded convex cores,
//! surfaces and compounds of these, and the walk that finds the pairs of pieces worth asking.
//! Knows no bodies; what two convex cores say to each other is the kernel's matter.

use crate::geometry::Aabb;
use crate::kernel::{Kernel, mix};
use crate::surface::{Facet, Surface, around};
use crate::tree::Tree;
use crate::wall::Wall;
use carom_math::{Column, Pose, Rotation};
use std::cell::Cell;
use std::sync::Arc;

/// A shape made ready for queries; copies share their data.
#[derive(Clone, Debug)]
pub struct Collider<S: Kernel> {
    pub(crate) form: Arc<Form<S>>,
}

/// The kinds of colliders.
#[derive(Clone, Debug)]
pub(crate) enum Form<S: Kernel> {
    /// Everything behind the plane through the origin with this outward unit normal.
    HalfSpace(S::Vector),
    /// Everything farther from the origin than the radius \[m\].
    Cavity(f64),
    /// A convex core swept by a ball of the radius \[m\].
    Convex(S::Core, f64),
    /// Facets.
    Surface(Surface<S>),
    /// Parts at poses.
    Compound(Parts<S>),
}

/// The parts of a compound.
#[derive(Clone, Debug)]
pub(crate) struct Parts<S: Kernel> {
    pub(crate) parts: Vec<(Pose<S>, Collider<S>)>,
    /// Boxes of the bounded parts, in the compound's frame.
    pub(crate) tree: Tree<S>,
    /// Index of each box's part.
    pub(crate) bounded: Vec<usize>,
    /// Parts without bounds.
    pub(crate) unbounded: Vec<usize>,
}

impl<S: Kernel> Collider<S> {
    /// Everything behind a plane through the origin.
    pub(crate) fn half_space(normal: S::Vector) -> Self {
        Collider { form: Arc::new(Form::HalfSpace(normal)) }
    }
    /// Everything farther from the origin than a radius.
    pub(crate) fn cavity(radius: f64) -> Self {
        Collider { form: Arc::new(Form::Cavity(radius)) }
    }
    /// A rounded convex core.
    pub(crate) fn convex(core: S::Core, radius: f64) -> Self {
        Collider { form: Arc::new(Form::Convex(core, radius)) }
    }
    /// Facets.
    pub(crate) fn surface(surface: Surface<S>) -> Self {
        Collider { form: Arc::new(Form::Surface(surface)) }
    }
    /// Parts at poses.
    pub(crate) fn compound(parts: Vec<(Pose<S>, Collider<S>)>) -> Self {
        let boxes: Vec<Aabb<S>> = parts.iter().map(|(pose, c)| c.bounds(pose, 0.0)).collect();
        let (bounded, unbounded): (Vec<usize>, Vec<usize>) =
            (0..parts.len()).partition(|&i| boxes[i].is_finite());
        let tree = Tree::new(bounded.iter().map(|&i| boxes[i]).collect());
        Collider { form: Arc::new(Form::Compound(Parts { parts, tree, bounded, unbounded })) }
    }
    /// True where the surface has faces, edges and corners alone, none of them rounded.
    pub(crate) fn is_angular(&self) -> bool {
        match &*self.form {
            Form::HalfSpace(_) | Form::Surface(_) => true,
            Form::Cavity(_) => false,
            Form::Convex(core, radius) => *radius == 0.0 && !S::is_curved(core),
            Form::Compound(all) => all.parts.iter().all(|(_, part)| part.is_angular()),
        }
    }
    /// A distance that its parts surely have from another thing \[m\], of which its frame has the box, and at most the other number; 0
    /// of shapes without parts.
    pub(crate) fn clearance(&self, other: impl FnOnce() -> (Aabb<S>, f64)) -> f64 {
        let tree = match &*self.form {
            Form::Surface(surface) => &surface.tree,
            Form::Compound(all) if all.unbounded.is_empty() => &all.tree,
            _ => return 0.0,
        };
        let (bounds, most) = other();
        tree.clearance(&bounds, most)
    }
    /// Bounding box at a pose, grown by a margin \[m\]: tight, but infinite across half-spaces and cavities.
    pub fn bounds(&self, pose: &Pose<S>, margin: f64) -> Aabb<S> {
        let tight = match &*self.form {
            Form::HalfSpace(normal) => half_space_bounds(pose.rotation.rotate(*normal), pose.position),
            Form::Cavity(_) => everywhere(),
            Form::Convex(core, radius) => match S::only_point(core) {
                // a ball about its frame's origin is as its pose, whose turn does not matter
                Some(point) if point == S::Vector::ZERO => Aabb::of_point(pose.position).grown(*radius),
                Some(point) => Aabb::of_point(pose.to_world(point)).grown(*radius),
                None => S::bounds_of(core, pose).grown(*radius),
            },
            Form::Surface(surface) => surface_bounds(surface, pose),
            Form::Compound(all) => {
                let mut boxes = all.parts.iter().map(|(p, c)| c.bounds(&pose.compose(p), 0.0));
                boxes.next().map_or(reach_box(pose, |_| S::Vector::ZERO), |first| {
                    boxes.fold(first, |b, o| b.union(&o))
                })
            }
        };
        tight.grown(margin)
    }
}

fn everywhere<S: Kernel>() -> Aabb<S> {
    Aabb { min: S::Vector::from_fn(|_| f64::NEG_INFINITY), max: S::Vector::from_fn(|_| f64::INFINITY) }
}

/// Box of a half-space: bounded only on the side of an axis-parallel normal.
fn half_space_bounds<S: Kernel>(normal: S::Vector, origin: S::Vector) -> Aabb<S> {
    let alone = |i: usize| (0..S::DIM).all(|k| k == i || normal[k] == 0.0);
    let bound = |i: usize, sign: f64| {
        if alone(i) && normal[i] * sign > 0.0 { origin[i] } else { sign * f64::INFINITY }
    };
    Aabb { min: S::Vector::from_fn(|i| bound(i, -1.0)), max: S::Vector::from_fn(|i| bound(i, 1.0)) }
}

/// Box of a set given by its supports in its own frame.
pub(crate) fn reach_box<S: Kernel>(pose: &Pose<S>, support: impl Fn(S::Vector) -> S::Vector) -> Aabb<S> {
    let extreme = |i: usize, sign: f64| {
        let axis = S::Vector::from_fn(|k| if k == i { sign } else { 0.0 });
        pose.position[i] + pose.rotation.rotate(support(pose.rotation.unrotate(axis)))[i]
    };
    Aabb { min: S::Vector::from_fn(|i| extreme(i, -1.0)), max: S::Vector::from_fn(|i| extreme(i, 1.0)) }
}

fn surface_bounds<S: Kernel>(surface: &Surface<S>, pose: &Pose<S>) -> Aabb<S> {
    let unturned = pose.rotation == <S::Rotation as Rotation<S::Vector, S::Spin>>::IDENTITY;
    if let Some(whole) = surface.tree.whole().filter(|_| unturned) {
        return Aabb { min: whole.min + pose.position, max: whole.max + pose.position };
    }
    around(surface.extreme.iter().map(|p| pose.to_world(*p)))
}

/// A convex piece in hand during a query.
pub(crate) struct Piece<'a, S: Kernel> {
    pub(crate) core: &'a S::Core,
    pub(crate) radius: f64,
    /// Frame of the core in the world.
    pub(crate) pose: Pose<S>,
    /// Facet of a surface that the core is.
    pub(crate) facet: Option<&'a Facet<'a, S>>,
    /// Names the piece within its collider.
    pub(crate) name: u64,
}

/// A wall or a convex piece.
pub(crate) enum Leaf<'a, S: Kernel> {
    /// A wall and its name.
    Wall(Wall<S>, u64),
    /// A convex piece.
    Piece(&'a Piece<'a, S>),
}

/// What a walk looks for: everything within `limit` of another posed thing.
pub(crate) struct Query<'a, S: Kernel> {
    /// Box of the other thing seen from a frame.
    pub(crate) box_in: &'a dyn Fn(&Pose<S>) -> Aabb<S>,
    /// Largest distance of interest \[m\]; may shrink during the walk.
    pub(crate) limit: &'a Cell<f64>,
}

/// Calls `visit` with every leaf of a posed collider that the query may concern.
pub(crate) fn leaves<S: Kernel>(
    collider: &Collider<S>,
    pose: &Pose<S>,
    name: u64,
    query: &Query<S>,
    visit: &mut dyn FnMut(Leaf<S>),
) {
    match &*collider.form {
        Form::HalfSpace(_) | Form::Cavity(_) => {
            if let Some(wall) = Wall::of(&collider.form, pose) {
                visit(Leaf::Wall(wall, name));
            }
        }
        Form::Convex(core, radius) => {
            visit(Leaf::Piece(&Piece { core, radius: *radius, pose: *pose, facet: None, name }));
        }
        Form::Surface(surface) => surface.tree.near(&(query.box_in)(pose), query.limit.get(), |i| {
            let facet = surface.facet(i);
            let (core, name) = (facet.core(), mix(name, 1 + i as u64));
            visit(Leaf::Piece(&Piece { core: &core, radius: 0.0, pose: *pose, facet: Some(&facet), name }));
            query.limit.get()
        }),
        Form::Compound(all) => {
            let mut part = |i: usize| {
                let (inner, part) = &all.parts[i];
                leaves(part, &pose.compose(inner), mix(name, 1 + i as u64), query, visit);
                query.limit.get()
            };
            for &i in &all.unbounded {
                part(i);
            }
            all.tree.near(&(query.box_in)(pose), query.limit.get(), |k| part(all.bounded[k]));
        }
    }
}
