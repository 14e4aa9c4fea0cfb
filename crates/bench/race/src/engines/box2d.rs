//! Box2D, through the bindings of its C interface: everything at its default but gravity, friction, sleeping and workers.
//! A step is one call; poses and contacts are read outside its time.

#![allow(
    unsafe_code,
    reason = "a C interface; handles are valid from their creation to the world's end, which drop alone makes"
)]

use crate::engine::{Choice, Engine, Phases, Spent, timed};
use crate::scene::{Arena, Body, DT, FRICTION, GRAVITY, Kind, Scene};
use boxdd_sys::ffi::*;
use carom::{Planar, PlanarShape, Pose, Rotation, Turn, Vec2, vec2};

/// Substeps that Box2D recommends.
const SUBSTEPS: i32 = 4;

/// A world of Box2D.
struct Box2d {
    world: b2WorldId,
    bodies: Vec<b2BodyId>,
}

/// A scene in Box2D.
///
/// # Errors
/// The shape that Box2D has no counterpart of.
pub fn build(scene: &Scene<Planar>, choice: Choice) -> Result<Box<dyn Engine<Planar>>, String> {
    // SAFETY: the definition is Box2D's own default with plain numbers changed
    let world = unsafe {
        let mut def = b2DefaultWorldDef();
        def.gravity = vector(vec2(0.0, -GRAVITY));
        def.enableSleep = choice.sleeping;
        def.workerCount = choice.threads as i32;
        b2CreateWorld(&def)
    };
    let mut made = Box2d { world, bodies: Vec::with_capacity(scene.bodies.len()) };
    for body in &scene.bodies {
        let id = made.body(body);
        made.bodies.push(id);
        for (place, shape) in Planar::parts(&body.shape) {
            add(id, &place, shape, body.density)?;
        }
    }
    Ok(Box::new(made))
}

fn vector(v: Vec2) -> b2Vec2 {
    b2Vec2 { x: v[0] as f32, y: v[1] as f32 }
}

fn rotation(r: &Turn) -> b2Rot {
    let [c, s] = r.0;
    b2Rot { c: c as f32, s: s as f32 }
}

impl Box2d {
    fn body(&self, body: &Body<Planar>) -> b2BodyId {
        // SAFETY: the world lives; the definition is Box2D's own default with plain numbers changed
        unsafe {
            let mut def = b2DefaultBodyDef();
            def.type_ = match body.kind {
                Kind::Dynamic => b2BodyType_b2_dynamicBody,
                Kind::Fixed => b2BodyType_b2_staticBody,
                Kind::Kinematic => b2BodyType_b2_kinematicBody,
            };
            def.position = vector(body.pose.position);
            def.rotation = rotation(&body.pose.rotation);
            def.linearVelocity = vector(body.velocity);
            def.angularVelocity = body.spin[0] as f32;
            b2CreateBody(self.world, &def)
        }
    }
}

/// Adds a shape at its place in the body's frame.
fn add(body: b2BodyId, place: &Pose<Planar>, shape: &PlanarShape, density: f64) -> Result<(), String> {
    // SAFETY: the body lives, and Box2D copies definitions and geometry
    unsafe {
        let mut def = b2DefaultShapeDef();
        def.density = density as f32;
        def.material.friction = FRICTION as f32;
        match shape {
            PlanarShape::Circle { radius } => {
                let circle = b2Circle { center: vector(place.position), radius: *radius as f32 };
                b2CreateCircleShape(body, &def, &circle);
            }
            PlanarShape::Capsule { length, radius } => {
                let end = |side: f64| vector(place.to_world(vec2(side * 0.5 * length, 0.0)));
                let capsule = b2Capsule { center1: end(-1.0), center2: end(1.0), radius: *radius as f32 };
                b2CreateCapsuleShape(body, &def, &capsule);
            }
            PlanarShape::Box { size: [x, y] } => {
                let (center, turn) = (vector(place.position), rotation(&place.rotation));
                let polygon = b2MakeOffsetBox(0.5 * *x as f32, 0.5 * *y as f32, center, turn);
                b2CreatePolygonShape(body, &def, &polygon);
            }
            PlanarShape::ConvexPolygon { points } if points.len() <= B2_MAX_POLYGON_VERTICES as usize => {
                let corners: Vec<b2Vec2> = points.iter().map(|p| vector(place.to_world(*p))).collect();
                let hull = b2ComputeHull(corners.as_ptr(), corners.len() as i32);
                if hull.count == 0 {
                    return Err("Box2D finds no hull of a polygon's corners".into());
                }
                b2CreatePolygonShape(body, &def, &b2MakePolygon(&hull, 0.0));
            }
            other => return Err(format!("Box2D has no {}", super::kind_of(other))),
        }
    }
    Ok(())
}

impl Engine<Planar> for Box2d {
    fn step(&mut self) -> Result<Spent, String> {
        // SAFETY: the world lives
        let ((), spent) = timed(|| unsafe { b2World_Step(self.world, DT as f32, SUBSTEPS) });
        Ok(spent)
    }
    fn poses(&mut self) -> Result<Vec<Pose<Planar>>, String> {
        let pose = |id: &b2BodyId| {
            // SAFETY: the body lives
            let b2Transform { p, q } = unsafe { b2Body_GetTransform(*id) };
            let turn = Turn([q.c, q.s].map(f64::from));
            Pose::new(vec2(p.x.into(), p.y.into()), turn.renormalized().unwrap_or(turn))
        };
        Ok(self.bodies.iter().map(pose).collect())
    }
    fn contacts(&mut self) -> Option<usize> {
        let mut points = 0;
        // SAFETY: bodies and the shapes of their contacts live; the array is as long as Box2D asks for
        unsafe {
            let movable = |id: b2BodyId| b2Body_GetType(id) == b2BodyType_b2_dynamicBody;
            for &id in self.bodies.iter().filter(|id| movable(**id)) {
                let mut data = Vec::<b2ContactData>::with_capacity(b2Body_GetContactCapacity(id) as usize);
                let count = b2Body_GetContactData(id, data.as_mut_ptr(), data.capacity() as i32);
                data.set_len(count as usize);
                for contact in &data {
                    let other = |s| b2Shape_GetBody(s);
                    let both = movable(other(contact.shapeIdA)) && movable(other(contact.shapeIdB));
                    // seen from both sides, or from one
                    points += contact.manifold.pointCount as usize * if both { 1 } else { 2 };
                }
            }
        }
        Some(points / 2)
    }
    fn phases(&self) -> Option<Phases> {
        // SAFETY: the world lives
        let p = unsafe { b2World_GetProfile(self.world) };
        Some(Phases::of(p.step.into(), p.pairs.into(), p.collide.into(), p.solve.into()))
    }
}

impl Drop for Box2d {
    fn drop(&mut self) {
        // SAFETY: made once, destroyed once
        unsafe { b2DestroyWorld(self.world) }
    }
}
