#[path="../tests/common/mod.rs"] mod common; use common::*;
use carom_geometry::*; use carom_math::*;
fn main(){
 let mut r=Random::new(5); let shapes=convex_spatial(); let mut bins=vec![(0usize,0usize,0.0f64);12]; 
 for (ia,a) in shapes.iter().enumerate() { for (ib,b) in shapes.iter().enumerate() { if ia<6 && ib<6 {continue;} let (ca,cb)=(collider::<Spatial>(a),collider::<Spatial>(b));
  for _ in 0..200 { let (pa,pb)=(r.pose3(0.6),r.pose3(0.6)); let c=Spatial::closest(&ca,&pa,&cb,&pb,9.0).unwrap(); 
   let sep=|n:Vec3| { let (t,u)=(Spatial::tangent(n,0),Spatial::tangent(n,1)); let f=Pose::<Spatial>::new(Vec3::ZERO,Quaternion::from_matrix(&[n.0,t.0,u.0])); Spatial::bounds(&ca,&f.compose(&pa),0.0).min[0]-Spatial::bounds(&cb,&f.compose(&pb),0.0).max[0] };
   let mut best=(c.gap,c.normal); for _ in 0..300 { let n=r.direction3(); let s=sep(n); if s>best.0 {best=(s,n);} } let mut h=0.1; while h>1e-7 { let mut hit=false; for _ in 0..12 { let n=(best.1+r.vec3()*h).normalized().unwrap(); let s=sep(n); if s>best.0 {best=(s,n);hit=true;} } if !hit {h*=0.5;} }
   let depth=-c.gap; let k=if depth<=0.0 {0} else if depth<1e-3 {1} else if depth<1e-2 {2} else if depth<0.03 {3} else if depth<0.1 {4} else if depth<0.2 {5} else if depth<0.3 {6} else {7}; bins[k].0+=1; let bad=best.0-c.gap; if bad>1e-7 { bins[k].1+=1; bins[k].2=bins[k].2.max(bad); if k<5 { println!("{ia} {ib} depth {depth:.4} better by {bad:.2e}"); } } } } }
 println!("{bins:?}");
}
