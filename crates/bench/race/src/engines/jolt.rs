//! Jolt 5.0, through joltc's C interface: everything at its default (10 velocity and 2 position iterations) but gravity,
//! friction, sleeping and threads. Its gravity is fixed along -y, so the scene is turned: (x, y, z) is (x, z, -y) there, and a
//! factor of gravity makes up for its size. The interface has no meshes, no count of contacts and no profile.

#![allow(
    unsafe_code,
    reason = "a C interface; all objects live from their creation until drop, which alone deletes them"
)]

use crate::engine::{Choice, Engine, Spent, timed};
use crate::scene::{Arena, Body, DT, FRICTION, GRAVITY, Kind, Scene};
use carom::{Pose, Quaternion, Rotation, Spatial, SpatialShape, Vec3, vec3};
use joltc_sys::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::sync::Once;

/// Layers of bodies that do not move and of those that do.
const STILL: JPC_ObjectLayer = 0;
const MOVING: JPC_ObjectLayer = 1;
/// Jolt's own gravity \[m/s^2\].
const ITS_GRAVITY: f64 = 9.81;
/// Memory of a step \[bytes\]; pages that no step touches are never taken.
const MEMORY: u32 = 1 << 30;

/// Rounding of boxes' and hulls' edges in contact detection \[m\], Jolt's own default, which its C interface leaves out; less on
/// boxes thinner than four times that.
const ROUNDING: f32 = 0.05;

static READY: Once = Once::new();

/// A world of Jolt.
struct Jolt {
    system: *mut JPC_PhysicsSystem,
    memory: *mut JPC_TempAllocatorImpl,
    jobs: *mut JPC_JobSystemThreadPool,
    layers: *mut JPC_BroadPhaseLayerInterface,
    layer_filter: *mut JPC_ObjectVsBroadPhaseLayerFilter,
    pair_filter: *mut JPC_ObjectLayerPairFilter,
    bodies: Vec<JPC_BodyID>,
}

unsafe extern "C" fn layer_count(_: *const c_void) -> u32 {
    2
}
unsafe extern "C" fn layer_of(_: *const c_void, layer: JPC_ObjectLayer) -> JPC_BroadPhaseLayer {
    layer as JPC_BroadPhaseLayer
}
unsafe extern "C" fn meets_layer(_: *const c_void, one: JPC_ObjectLayer, other: JPC_BroadPhaseLayer) -> bool {
    one == MOVING || JPC_ObjectLayer::from(other) == MOVING
}
unsafe extern "C" fn meets(_: *const c_void, one: JPC_ObjectLayer, other: JPC_ObjectLayer) -> bool {
    one == MOVING || other == MOVING
}

/// A scene in Jolt.
///
/// # Errors
/// The shape that its C interface has no counterpart of.
pub fn build(scene: &Scene<Spatial>, choice: Choice) -> Result<Box<dyn Engine<Spatial>>, String> {
    // SAFETY: registered once, before anything else; the filters are functions without state
    let mut made = unsafe {
        READY.call_once(|| {
            JPC_RegisterDefaultAllocator();
            JPC_FactoryInit();
            JPC_RegisterTypes();
        });
        let layers = JPC_BroadPhaseLayerInterfaceFns {
            GetNumBroadPhaseLayers: Some(layer_count),
            GetBroadPhaseLayer: Some(layer_of),
        };
        let layer_filter = JPC_ObjectVsBroadPhaseLayerFilterFns { ShouldCollide: Some(meets_layer) };
        let pair_filter = JPC_ObjectLayerPairFilterFns { ShouldCollide: Some(meets) };
        Jolt {
            system: JPC_PhysicsSystem_new(),
            memory: JPC_TempAllocatorImpl_new(MEMORY),
            jobs: JPC_JobSystemThreadPool_new3(
                JPC_MAX_PHYSICS_JOBS as u32,
                JPC_MAX_PHYSICS_BARRIERS as u32,
                choice.threads as i32 - 1,
            ),
            layers: JPC_BroadPhaseLayerInterface_new(null(), layers),
            layer_filter: JPC_ObjectVsBroadPhaseLayerFilter_new(null(), layer_filter),
            pair_filter: JPC_ObjectLayerPairFilter_new(null(), pair_filter),
            bodies: Vec::with_capacity(scene.bodies.len()),
        }
    };
    let pairs = 65_536.max(32 * scene.moving() as u32);
    // SAFETY: all objects were just made; the system is initialised once
    unsafe {
        let (layers, to_layer, to_pair) = (made.layers, made.layer_filter, made.pair_filter);
        let most = scene.bodies.len() as u32 + 1;
        JPC_PhysicsSystem_Init(made.system, most, 0, pairs, pairs, layers, to_layer, to_pair);
    }
    let mut shared = super::Shared::<Spatial, _>::new();
    for body in &scene.bodies {
        let shape = shared.get(&body.shape, body.density, || shape(&body.shape, body.density))?;
        let id = made.body(body, shape, choice.sleeping);
        made.bodies.push(id);
    }
    // SAFETY: the system lives; nothing runs
    unsafe { JPC_PhysicsSystem_OptimizeBroadPhase(made.system) };
    Ok(Box::new(made))
}

fn vector(v: Vec3) -> JPC_Vec3 {
    // the fourth number is read by nobody and should be the third for speed's sake
    JPC_Vec3 { x: v[0] as f32, y: v[2] as f32, z: -v[1] as f32, _w: -v[1] as f32 }
}

fn rotation(q: &Quaternion) -> JPC_Quat {
    let [w, x, y, z] = q.0.map(|c| c as f32);
    JPC_Quat { x, y: z, z: -y, w }
}

/// The message of a call that failed, or the shape that it made.
fn made(ok: bool, shape: *mut JPC_Shape) -> Result<*mut JPC_Shape, String> {
    if ok && !shape.is_null() { Ok(shape) } else { Err("Jolt refuses a shape".into()) }
}

/// A shape of Jolt about its frame.
fn shape(of: &SpatialShape, density: f64) -> Result<*mut JPC_Shape, String> {
    let (mut out, mut error) = (null_mut(), null_mut());
    let density = density as f32;
    // SAFETY: settings are Jolt's defaults with plain numbers changed; points are copied
    unsafe {
        match of {
            SpatialShape::Sphere { radius } => {
                let settings = JPC_SphereShapeSettings {
                    Radius: *radius as f32,
                    Density: density,
                    ..Default::default()
                };
                made(JPC_SphereShapeSettings_Create(&settings, &mut out, &mut error), out)
            }
            SpatialShape::Capsule { length, radius } => {
                let settings = JPC_CapsuleShapeSettings {
                    Radius: *radius as f32,
                    HalfHeightOfCylinder: 0.5 * *length as f32,
                    Density: density,
                    ..Default::default()
                };
                made(JPC_CapsuleShapeSettings_Create(&settings, &mut out, &mut error), out)
            }
            SpatialShape::Box { size: [x, y, z] } => {
                let half = JPC_Vec3 {
                    x: 0.5 * *x as f32,
                    y: 0.5 * *z as f32,
                    z: 0.5 * *y as f32,
                    _w: 0.5 * *y as f32,
                };
                let rounding = ROUNDING.min(0.5 * half.x.min(half.y).min(half.z));
                let settings = JPC_BoxShapeSettings {
                    HalfExtent: half,
                    Density: density,
                    ConvexRadius: rounding,
                    ..Default::default()
                };
                made(JPC_BoxShapeSettings_Create(&settings, &mut out, &mut error), out)
            }
            SpatialShape::ConvexHull { points } => {
                let corners: Vec<JPC_Vec3> = points.iter().map(|p| vector(*p)).collect();
                let settings = JPC_ConvexHullShapeSettings {
                    Points: corners.as_ptr(),
                    PointsLen: corners.len(),
                    Density: density,
                    MaxConvexRadius: ROUNDING,
                    ..Default::default()
                };
                made(JPC_ConvexHullShapeSettings_Create(&settings, &mut out, &mut error), out)
            }
            SpatialShape::Compound { .. } => compound(of, f64::from(density)),
            other => Err(format!("Jolt's C interface has no {}", super::kind_of(other))),
        }
    }
}

/// Several shapes of Jolt in one.
fn compound(of: &SpatialShape, density: f64) -> Result<*mut JPC_Shape, String> {
    let mut parts = Vec::new();
    for (place, part) in Spatial::parts(of) {
        parts.push(JPC_SubShapeSettings {
            Shape: shape(part, density)?,
            Position: vector(place.position),
            Rotation: rotation(&place.rotation),
            ..Default::default()
        });
    }
    let settings = JPC_StaticCompoundShapeSettings {
        SubShapes: parts.as_ptr(),
        SubShapesLen: parts.len(),
        ..Default::default()
    };
    let (mut out, mut error) = (null_mut(), null_mut());
    // SAFETY: the parts live through the call, which copies them and holds their shapes
    let ok = unsafe { JPC_StaticCompoundShapeSettings_Create(&settings, &mut out, &mut error) };
    made(ok, out)
}

impl Jolt {
    fn body(&self, body: &Body<Spatial>, shape: *mut JPC_Shape, sleeping: bool) -> JPC_BodyID {
        let (motion, layer) = match body.kind {
            Kind::Dynamic => (JPC_MOTION_TYPE_DYNAMIC, MOVING),
            Kind::Fixed => (JPC_MOTION_TYPE_STATIC, STILL),
            Kind::Kinematic => (JPC_MOTION_TYPE_KINEMATIC, MOVING),
        };
        let settings = JPC_BodyCreationSettings {
            Position: vector(body.pose.position),
            Rotation: rotation(&body.pose.rotation),
            LinearVelocity: vector(body.velocity),
            AngularVelocity: vector(body.spin),
            ObjectLayer: layer,
            MotionType: motion,
            AllowSleeping: sleeping,
            Friction: FRICTION as f32,
            LinearDamping: 0.0,
            AngularDamping: 0.0,
            GravityFactor: (GRAVITY / ITS_GRAVITY) as f32,
            Shape: shape,
            ..Default::default()
        };
        let activation =
            if body.kind == Kind::Fixed { JPC_ACTIVATION_DONT_ACTIVATE } else { JPC_ACTIVATION_ACTIVATE };
        // SAFETY: the system lives and has room for all bodies of the scene; the body holds the shape
        unsafe {
            let bodies = JPC_PhysicsSystem_GetBodyInterface(self.system);
            JPC_BodyInterface_CreateAndAddBody(bodies, &settings, activation)
        }
    }
}

impl Engine<Spatial> for Jolt {
    fn step(&mut self) -> Result<Spent, String> {
        // SAFETY: all objects live; one collision step as Jolt recommends at 60 Hz
        let (error, spent) =
            timed(|| unsafe { JPC_PhysicsSystem_Update(self.system, DT as f32, 1, self.memory, self.jobs) });
        if error == JPC_PHYSICS_UPDATE_ERROR_NONE {
            Ok(spent)
        } else {
            Err(format!("Jolt ran out of room for pairs or contacts (error {error})"))
        }
    }
    fn poses(&mut self) -> Result<Vec<Pose<Spatial>>, String> {
        let pose = |id: &JPC_BodyID| {
            // SAFETY: system and body live; both places are written before they are read
            let (p, q) = unsafe {
                let bodies = JPC_PhysicsSystem_GetBodyInterface(self.system);
                let mut p = JPC_Vec3 { x: 0.0, y: 0.0, z: 0.0, _w: 0.0 };
                let mut q = JPC_Quat { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
                JPC_BodyInterface_GetPositionAndRotation(bodies, *id, &mut p, &mut q);
                (p, q)
            };
            let turn = Quaternion([q.w, q.x, -q.z, q.y].map(f64::from));
            let place = vec3(p.x.into(), (-p.z).into(), p.y.into());
            Pose::new(place, turn.renormalized().unwrap_or(turn))
        };
        Ok(self.bodies.iter().map(pose).collect())
    }
    fn contacts(&mut self) -> Option<usize> {
        None
    }
}

impl Drop for Jolt {
    fn drop(&mut self) {
        // SAFETY: each made once, deleted once, the system before what it refers to
        unsafe {
            JPC_PhysicsSystem_delete(self.system);
            JPC_JobSystemThreadPool_delete(self.jobs);
            JPC_TempAllocatorImpl_delete(self.memory);
            JPC_BroadPhaseLayerInterface_delete(self.layers);
            JPC_ObjectVsBroadPhaseLayerFilter_delete(self.layer_filter);
            JPC_ObjectLayerPairFilter_delete(self.pair_filter);
        }
    }
}
