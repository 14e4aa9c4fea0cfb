//! scratch
use carom::*;
use carom::geometry::{Geometry, ContactPoint};
fn main() {
    let a = Spatial::collider(&SpatialShape::Box { size: [0.17932031143866076, 0.21247005362956534, 0.2416731713965845] }).unwrap();
    let b = Spatial::collider(&SpatialShape::Box { size: [0.16649981966115437, 0.18681266399104138, 0.16764726227266663] }).unwrap();
    let pa = Pose::new(vec3(-0.236118955627801, 1.5244832836397815, 0.12083582737505294), Quaternion([0.41515141239688563, 1.2517865489833237e-6, -2.8623006453908953e-6, -0.9097523315579419]));
    let pb = Pose::new(vec3(-0.1680590693035688, 1.5527042162640738, 0.32549515401205054), Quaternion([3.131313086140644e-6, 0.6580939241859325, 0.7529358451659109, -2.0125847736756487e-6]));
    let mut out: Vec<ContactPoint<Spatial>> = vec![];
    Spatial::contacts(&a, &pa, &b, &pb, 0.01, &mut out);
    for p in &out { println!("{:?}", p); }
    for (p, h) in [(pa, [0.17932031143866076, 0.21247005362956534, 0.2416731713965845]), (pb, [0.16649981966115437, 0.18681266399104138, 0.16764726227266663])] {
        for k in 0..8 { let s = |b: usize| if k >> b & 1 == 1 { 0.5*h[b] } else { -0.5*h[b] }; println!("   {:?}", p.to_world(vec3(s(0), s(1), s(2)))); }
    }
}
