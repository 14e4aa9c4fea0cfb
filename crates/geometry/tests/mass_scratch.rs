mod mass_common;
use mass_common::*;
use carom_geometry::{mass_planar, mass_spatial, *};
use carom_math::*;
use std::time::Instant;
#[test]
fn scratch() {
    let fs: Vec<(&str, Box<dyn Fn(Vec2)->f64>)> = vec![
      ("y<0", Box::new(|p| if p[1]<0.0 {4900.} else {900.})),
      ("y<.1", Box::new(|p| if p[1]<0.1 {4900.} else {900.})),
      ("tilt", Box::new(|p| if p[1]+0.37*p[0]<0.1 {4900.} else {900.})),
      ("disc", Box::new(|p| if (p-vec2(0.1,0.05)).norm()<0.2 {4900.} else {900.})),
      ("abs", Box::new(|p| (p[0]+0.3*p[1]-0.1).abs())),
      ("exp", Box::new(|p| (1.3*p[0]-p[1]).exp())),
      ("layers", Box::new(|p| 1.0+((p[0]+p[1]*0.7)*10.0).floor().rem_euclid(2.0))),
      ("checker", Box::new(|p| 1.0+((p[0]*10.0).floor()+(p[1]*10.).floor()).rem_euclid(2.0))),
    ];
    for s in planar_shapes() { for (name,f) in &fs { for tol in [1e-3,1e-4,1e-5,1e-6,1e-7,1e-8,1e-9, 1e-10] {
        let mut n = 0; let t = Instant::now(); let mut calls=0;
        let q = mass_planar::mass_properties_of(&s, &mut |p| { n += p.len(); calls+=1; p.iter().map(|&p| f(p)).collect() }, tol);
        let r = mass_planar::mass_properties_of(&s, &mut |p| { p.iter().map(|&p| f(p)).collect() }, 1e-13);
        match (q,r) { (Ok(q),Ok(r)) => println!("{:.10} {name} tol {tol:.0e} n={n} calls={calls} t={:?} err={:.1e} diff={:.1e} ref {:.1e}", format!("{s:?}"), t.elapsed(), q.error, difference(&q, &r), r.error), e => println!("{:.10} {name} {e:?}", format!("{s:?}")) }
    }}}
}
#[test]
fn scratch3() {
 if std::env::var("S3").is_err() {return;}    let fs: Vec<(&str, Box<dyn Fn(Vec3)->f64>)> = vec![
      ("z<0", Box::new(|p| if p[2]<0.0 {4900.} else {900.})),
      ("z<.1", Box::new(|p| if p[2]<0.1 {4900.} else {900.})),
      ("x<.1", Box::new(|p| if p[0]<0.1 {4900.} else {900.})),
      ("tilt", Box::new(|p| if p[1]+0.37*p[0]-0.2*p[2]<0.1 {4900.} else {900.})),
      ("ball", Box::new(|p| if (p-vec3(0.1,0.05,-0.1)).norm()<0.2 {4900.} else {900.})),
      ("abs", Box::new(|p| (p[0]+0.3*p[1]-0.1*p[2]-0.1).abs())),
      ("exp", Box::new(|p| (1.3*p[0]-p[1]+0.5*p[2]).exp())),
      ("alone", Box::new(|p| if (p-vec3(0.1,0.05,-0.1)).norm()<0.2 {1.} else {0.})),
      ("gauss", Box::new(|p| (-(p-vec3(0.1,0.05,-0.1)).norm_squared()*50.).exp())),
      ("layers", Box::new(|p| 1.0+((p[0]+p[1]*0.7-p[2]*0.3)*10.0).floor().rem_euclid(2.0))),
    ];
    for s in spatial_shapes() { for (name,f) in &fs { for tol in [1e-3,1e-4, 1e-7] {
        let mut n = 0; let mut calls=0; let t = Instant::now();
        let q = mass_spatial::mass_properties_of(&s, &mut |p| { n += p.len(); calls+=1; p.iter().map(|&p| f(p)).collect() }, tol);
        match q { Ok(q) => println!("{:.10} {name} tol {tol:.0e} n={n} calls={calls} t={:?} err={:.1e} mass {:.10}", format!("{s:?}"), t.elapsed(), q.error, q.mass ), e => println!("{:.10} {name} {e:?}", format!("{s:?}")) }
    }}}
}
