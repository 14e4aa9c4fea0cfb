//! Box3D, through the bindings of its C interface: everything at its default but gravity, friction, sleeping and workers.
//! A step is one call; poses and contacts are read outside its time.

#![allow(
    unsafe_code,
    reason = "a C interface; handles are valid from their creation to the world's end, which drop alone makes"
)]

use crate::engine::{Choice, Engine, Phases, Spent, timed};
use crate::scene::{Arena, Body, DT, FRICTION, GRAVITY, Kind, Scene};
use boxddd_sys::ffi::*;
use carom::{Pose, Quaternion, Rotation, Spatial, SpatialShape, Vec3, vec3};

/// Substeps that Box3D recommends.
const SUBSTEPS: i32 = 4;

/// A world of Box3D.
struct Box3d {
    world: b3WorldId,
    bodies: Vec<b3BodyId>,
    /// Shapes of meshes refer to these.
    meshes: Vec<*mut b3MeshData>,
}

/// A scene in Box3D.
///
/// # Errors
/// The shape that Box3D has no counterpart of.
pub fn build(scene: &Scene<Spatial>, choice: Choice) -> Result<Box<dyn Engine<Spatial>>, String> {
    // SAFETY: the definition is Box3D's own default with plain numbers changed
    let world = unsafe {
        let mut def = b3DefaultWorldDef();
        def.gravity = vector(vec3(0.0, 0.0, -GRAVITY));
        def.enableSleep = choice.sleeping;
        def.workerCount = choice.threads as u32;
        b3CreateWorld(&def)
    };
    let mut made = Box3d { world, bodies: Vec::with_capacity(scene.bodies.len()), meshes: Vec::new() };
    for body in &scene.bodies {
        let id = made.body(body);
        made.bodies.push(id);
        for (place, shape) in Spatial::parts(&body.shape) {
            made.add(id, &place, shape, body.density)?;
        }
    }
    Ok(Box::new(made))
}

fn vector(v: Vec3) -> b3Vec3 {
    b3Vec3 { x: v[0] as f32, y: v[1] as f32, z: v[2] as f32 }
}

fn rotation(q: &Quaternion) -> b3Quat {
    let [w, x, y, z] = q.0;
    b3Quat { v: vector(vec3(x, y, z)), s: w as f32 }
}

impl Box3d {
    fn body(&self, body: &Body<Spatial>) -> b3BodyId {
        // SAFETY: the world lives; the definition is Box3D's own default with plain numbers changed
        unsafe {
            let mut def = b3DefaultBodyDef();
            def.type_ = match body.kind {
                Kind::Dynamic => b3BodyType_b3_dynamicBody,
                Kind::Fixed => b3BodyType_b3_staticBody,
                Kind::Kinematic => b3BodyType_b3_kinematicBody,
            };
            def.position = vector(body.pose.position);
            def.rotation = rotation(&body.pose.rotation);
            def.linearVelocity = vector(body.velocity);
            def.angularVelocity = vector(body.spin);
            b3CreateBody(self.world, &def)
        }
    }

    /// Adds a shape at its place in the body's frame.
    fn add(
        &mut self,
        body: b3BodyId,
        place: &Pose<Spatial>,
        shape: &SpatialShape,
        density: f64,
    ) -> Result<(), String> {
        // SAFETY: the body lives; Box3D copies all geometry but meshes, which live as long as the world
        unsafe {
            let mut def = b3DefaultShapeDef();
            def.density = density as f32;
            def.baseMaterial.friction = FRICTION as f32;
            match shape {
                SpatialShape::Sphere { radius } => {
                    let sphere = b3Sphere { center: vector(place.position), radius: *radius as f32 };
                    b3CreateSphereShape(body, &def, &sphere);
                }
                SpatialShape::Capsule { length, radius } => {
                    let end = |side: f64| vector(place.to_world(vec3(0.0, 0.0, side * 0.5 * length)));
                    let capsule = b3Capsule { center1: end(-1.0), center2: end(1.0), radius: *radius as f32 };
                    b3CreateCapsuleShape(body, &def, &capsule);
                }
                SpatialShape::Box { size } => {
                    let [x, y, z] = size.map(|s| 0.5 * s as f32);
                    let transform = b3Transform { p: vector(place.position), q: rotation(&place.rotation) };
                    let hull = b3MakeTransformedBoxHull(x, y, z, transform);
                    b3CreateHullShape(body, &def, &hull.base);
                }
                SpatialShape::ConvexHull { points } => {
                    let corners: Vec<b3Vec3> = points.iter().map(|p| vector(place.to_world(*p))).collect();
                    let hull = b3CreateHull(corners.as_ptr(), corners.len() as i32, corners.len() as i32);
                    if hull.is_null() {
                        return Err("Box3D finds no hull of a shape's corners".into());
                    }
                    b3CreateHullShape(body, &def, hull);
                    b3DestroyHull(hull);
                }
                SpatialShape::TriMesh { vertices, triangles } => {
                    let mesh = mesh(place, vertices, triangles)?;
                    self.meshes.push(mesh);
                    b3CreateMeshShape(body, &def, mesh, vector(vec3(1.0, 1.0, 1.0)));
                }
                other => return Err(format!("Box3D has no {}", super::kind_of(other))),
            }
        }
        Ok(())
    }
}

/// A mesh of Box3D, with its edges told apart as its examples do.
fn mesh(place: &Pose<Spatial>, vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<*mut b3MeshData, String> {
    let mut corners: Vec<b3Vec3> = vertices.iter().map(|p| vector(place.to_world(*p))).collect();
    let mut indices: Vec<i32> = triangles.iter().flatten().map(|i| *i as i32).collect();
    let def = b3MeshDef {
        vertices: corners.as_mut_ptr(),
        indices: indices.as_mut_ptr(),
        materialIndices: std::ptr::null_mut(),
        weldTolerance: 0.0,
        vertexCount: corners.len() as i32,
        triangleCount: triangles.len() as i32,
        weldVertices: false,
        useMedianSplit: false,
        identifyEdges: true,
    };
    // SAFETY: the arrays are as long as the definition says, and Box3D copies them
    let mesh = unsafe { b3CreateMesh(&def, std::ptr::null_mut(), 0) };
    if mesh.is_null() { Err("Box3D makes no mesh of these triangles".into()) } else { Ok(mesh) }
}

impl Engine<Spatial> for Box3d {
    fn step(&mut self) -> Result<Spent, String> {
        // SAFETY: the world lives
        let ((), spent) = timed(|| unsafe { b3World_Step(self.world, DT as f32, SUBSTEPS) });
        Ok(spent)
    }
    fn poses(&mut self) -> Result<Vec<Pose<Spatial>>, String> {
        let pose = |id: &b3BodyId| {
            // SAFETY: the body lives
            let b3Transform { p, q } = unsafe { b3Body_GetTransform(*id) };
            let turn = Quaternion([q.s, q.v.x, q.v.y, q.v.z].map(f64::from));
            let place = vec3(p.x.into(), p.y.into(), p.z.into());
            Pose::new(place, turn.renormalized().unwrap_or(turn))
        };
        Ok(self.bodies.iter().map(pose).collect())
    }
    fn contacts(&mut self) -> Option<usize> {
        let mut points = 0;
        // SAFETY: bodies and the shapes of their contacts live; the array is as long as Box3D asks for, and the manifolds
        // that it points to stay until the next step
        unsafe {
            let movable = |id: b3BodyId| b3Body_GetType(id) == b3BodyType_b3_dynamicBody;
            for &id in self.bodies.iter().filter(|id| movable(**id)) {
                let mut data = Vec::<b3ContactData>::with_capacity(b3Body_GetContactCapacity(id) as usize);
                let count = b3Body_GetContactData(id, data.as_mut_ptr(), data.capacity() as i32);
                data.set_len(count as usize);
                for contact in data.iter().filter(|c| c.manifoldCount > 0) {
                    let manifolds =
                        std::slice::from_raw_parts(contact.manifolds, contact.manifoldCount as usize);
                    let here: usize = manifolds.iter().map(|m| m.pointCount as usize).sum();
                    let other = |s| b3Shape_GetBody(s);
                    let both = movable(other(contact.shapeIdA)) && movable(other(contact.shapeIdB));
                    // seen from both sides, or from one
                    points += here * if both { 1 } else { 2 };
                }
            }
        }
        Some(points / 2)
    }
    fn phases(&self) -> Option<Phases> {
        // SAFETY: the world lives
        let p = unsafe { b3World_GetProfile(self.world) };
        Some(Phases::of(p.step.into(), p.pairs.into(), p.collide.into(), p.solve.into()))
    }
}

impl Drop for Box3d {
    fn drop(&mut self) {
        // SAFETY: made once, destroyed once; meshes after the shapes that refer to them
        unsafe {
            b3DestroyWorld(self.world);
            self.meshes.iter().for_each(|mesh| b3DestroyMesh(*mesh));
        }
    }
}
