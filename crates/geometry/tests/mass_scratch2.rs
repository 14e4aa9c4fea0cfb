mod mass_common;
use mass_common::*;
use carom_geometry::{mass_spatial, SpatialShape, MassProperties};
use carom_math::*;
fn clip(points: &[Vec3], n: Vec3, d: f64, keep_below: bool) -> Vec<Vec3> {
    let s = if keep_below {1.0} else {-1.0};
    let f = |p: Vec3| s*(n.dot(p)-d);
    let mut out: Vec<Vec3> = points.iter().copied().filter(|p| f(*p) <= 0.0).collect();
    for a in points { for b in points { if f(*a) < 0.0 && f(*b) > 0.0 { let t = f(*a)/(f(*a)-f(*b)); out.push(*a + (*b-*a)*t); } } }
    out
}
fn report(name: &str, s: &SpatialShape, truth: &MassProperties<Spatial>, f: &dyn Fn(Vec3)->f64) {
    for tol in [1e-2,1e-3,1e-4,1e-5,1e-6] {
        let mut n=0;
        let q = mass_spatial::mass_properties_of(s, &mut |p| {n+=p.len(); p.iter().map(|&p| f(p)).collect()}, tol);
        match q { Ok(q) => println!("RATIO {:.2e} {:.12} {name} tol {tol:.0e} n {n} err {:.1e} diff {:.1e}", difference(&q, truth)/q.error, format!("{s:?}"), q.error, difference(&q,truth)), Err(e) => println!("{:.12} {name} {tol} {}", format!("{s:?}"), e.problem) }
    }
}
#[test]
fn truth() {
    let mut numbers = Numbers(77);
    for s in spatial_shapes() {
        for k in 0..2 {
        let c = vec3(0.1,0.05,-0.1) + numbers.spatial(0.03);
        let r = if k==0 {0.18} else {0.07};
        let inside = !matches!(s, SpatialShape::Cone{..}|SpatialShape::ConvexHull{..}|SpatialShape::TriMesh{..}|SpatialShape::Compound{..});
        if inside {
            let base = mass_spatial::mass_properties(&s, 900.0).unwrap();
            let inc = mass_spatial::mass_properties(&SpatialShape::Sphere{radius:r}, 4000.0).unwrap().placed(&Pose::new(c, Quaternion::IDENTITY));
            report("incl", &s, &base.joined(&inc), &|p| if (p-c).norm()<r {4900.} else {900.});
            report("alone", &s, &inc, &|p| if (p-c).norm()<r {4000.} else {0.});
        }
        }
        let hull: Option<Vec<Vec3>> = match &s { SpatialShape::ConvexHull{points} => Some(points.clone()), SpatialShape::Box{size} => Some((0..8).map(|i| Vec3::from_fn(|k| size[k]*0.5*if i>>k&1==1 {1.0} else {-1.0})).collect()), _ => None };
        if let Some(h) = hull { for _ in 0..2 {
            let n = numbers.spatial(1.0).normalized().unwrap(); let d = numbers.between(-0.1,0.2);
            let part = |below| mass_spatial::mass_properties(&SpatialShape::ConvexHull{points: clip(&h,n,d,below)}, if below {4900.0} else {900.0}).unwrap();
            report("tilt", &s, &part(true).joined(&part(false)), &|p| if n.dot(p)<d {4900.} else {900.});
        }}
        if let SpatialShape::Sphere{radius} = s { for _ in 0..3 {
            let n = numbers.spatial(1.0).normalized().unwrap(); let h = numbers.between(-0.3,0.3);
            // cap z>h of radius R: moments about the centre
            let pi=std::f64::consts::PI; let rr=radius;
            let v = pi*(2.0*rr.powi(3)/3.0 - rr*rr*h + h.powi(3)/3.0);
            let z1 = pi/4.0*(rr*rr-h*h).powi(2);
            let z2 = pi*(rr*rr*(rr.powi(3)-h.powi(3))/3.0 - (rr.powi(5)-h.powi(5))/5.0);
            let x2 = pi/4.0*(rr.powi(4)*(rr-h) - 2.0*rr*rr*(rr.powi(3)-h.powi(3))/3.0 + (rr.powi(5)-h.powi(5))/5.0);
            let a = Spatial::tangent(n,0); let b = Spatial::tangent(n,1);
            let (m,f,zz,xx) = (4900.0*4.0/3.0*pi*rr.powi(3) - 4000.0*v, -4000.0*z1, 4900.0*4.0/15.0*pi*rr.powi(5)-4000.0*z2, 4900.0*4.0/15.0*pi*rr.powi(5)-4000.0*x2);
            let c = f/m;
            let axial = 2.0*xx; let cross = xx + zz - m*c*c;
            let rows = |i:usize,j:usize| axial*n[i]*n[j] + cross*(a[i]*a[j]+b[i]*b[j]);
            let inertia = Sym3::from_rows(std::array::from_fn(|i| std::array::from_fn(|j| rows(i,j))));
            let truth = MassProperties{mass:m, center: n*c, inertia, error:0.0};
            report("cap", &s, &truth, &|p| if n.dot(p)<h {4900.} else {900.});
        }}
    }
}
