use carom_geometry::*;
use carom_math::*;
use std::time::Instant;
struct Rng(u64);
impl Rng { fn next(&mut self)->f64{ self.0^=self.0<<13; self.0^=self.0>>7; self.0^=self.0<<17; (self.0>>11) as f64/(1u64<<53) as f64 } fn sym(&mut self)->f64{2.0*self.next()-1.0} }
fn run<S:Geometry>(name:&str, a:&S::Shape, b:&S::Shape, mut pose:impl FnMut(&mut Rng,usize)->Pose<S>){
  let (ca,cb)=(S::collider(a).unwrap(),S::collider(b).unwrap()); let mut rng=Rng(88172645463325252); let mut line=format!("{name:32}");
  for mode in 0..3 { // resting, random near, separated
   let poses:Vec<Pose<S>>=(0..2000).map(|_| pose(&mut rng,mode)).collect(); let mut out=Vec::with_capacity(64); let mut best=f64::INFINITY; let mut count=0;
   for _ in 0..7 { let t=Instant::now(); count=0; for p in &poses { out.clear(); S::contacts(&ca,p,&cb,&Pose::default(),0.02,&mut out); count+=out.len(); } best=best.min(t.elapsed().as_secs_f64()/poses.len() as f64*1e9); }
   line+=&format!("  {:8.0} ns ({:.2} pts)",best,count as f64/poses.len() as f64); }
  println!("{line}");
}
fn main(){
  let any=|r:&mut Rng| Quaternion([r.sym(),r.sym(),r.sym(),r.sym()]).renormalized().unwrap();
  let yaw=|r:&mut Rng| Quaternion::from_axis_angle(vec3(0.,0.,1.),r.sym());
  // resting: pose on top with height h and gap random 1e-4; near: random rotation at distance d; sep: far
  let rest=move |h:f64,d:f64| move |r:&mut Rng,mode:usize| match mode { 0=>Pose::new(vec3(0.2*r.sym(),0.2*r.sym(),h+1e-4*r.sym()),yaw(r)), 1=>{let u=vec3(r.sym(),r.sym(),r.sym()).normalized().unwrap(); Pose::new(u*(d*(0.9+0.1*r.next())),any(r))}, _=>{let u=vec3(r.sym(),r.sym(),r.sym()).normalized().unwrap(); Pose::new(u*(d*1.5),any(r))} };
  let mut r=Rng(12345678912345); let mut pts=|n:usize| (0..n).map(|_| vec3(r.sym(),r.sym(),r.sym()).normalized().unwrap()*0.5).collect::<Vec<_>>();
  let (h24,h32,h100)=(pts(24),pts(32),pts(100));
  let bx=SpatialShape::Box{size:[1.,1.,1.]}; let sp=SpatialShape::Sphere{radius:0.5}; let cap=SpatialShape::Capsule{length:1.0,radius:0.25}; let cyl=SpatialShape::Cylinder{height:1.0,radius:0.5}; let cone=SpatialShape::Cone{height:1.0,radius:0.5};
  let hs=SpatialShape::HalfSpace{normal:vec3(0.,0.,1.)}; let hull=SpatialShape::ConvexHull{points:h24}; let hull32=SpatialShape::ConvexHull{points:h32}; let hull100=SpatialShape::ConvexHull{points:h100};
  let mesh=SpatialShape::HeightField{heights:vec![vec![0.0;41];41],size:[20.,20.]};
  run::<Spatial>("sphere-sphere",&sp,&sp,rest(1.0,1.0)); run::<Spatial>("sphere-box",&sp,&bx,rest(1.0,1.1)); run::<Spatial>("capsule-capsule",&cap,&cap,rest(0.5,0.8)); run::<Spatial>("capsule-box",&cap,&bx,rest(1.25,1.1));
  run::<Spatial>("box-box",&bx,&bx,rest(1.0,1.2)); run::<Spatial>("box-halfspace",&bx,&hs,rest(0.5,0.6)); run::<Spatial>("hull24-halfspace",&hull,&hs,rest(0.5,0.5)); run::<Spatial>("cyl-halfspace",&cyl,&hs,rest(0.5,0.6));
  run::<Spatial>("hull24-hull24",&hull,&hull,rest(0.95,0.95)); run::<Spatial>("hull32-hull32",&hull32,&hull32,rest(0.95,0.95)); run::<Spatial>("hull100-hull100",&hull100,&hull100,rest(0.97,0.97)); run::<Spatial>("hull24-box",&hull,&bx,rest(0.98,1.05));
  run::<Spatial>("cyl-box",&cyl,&bx,rest(1.0,1.1)); run::<Spatial>("cyl-cyl",&cyl,&cyl,rest(1.0,1.1)); run::<Spatial>("cone-box",&cone,&bx,rest(1.0,1.0)); run::<Spatial>("sphere-mesh",&sp,&mesh,rest(0.5,0.5)); run::<Spatial>("box-mesh(.5m)",&bx,&mesh,rest(0.5,0.6)); run::<Spatial>("hull24-mesh",&hull,&mesh,rest(0.5,0.5));run::<Spatial>("cyl-mesh",&cyl,&mesh,rest(0.5,0.5));
  let rest2=|h:f64,d:f64| move |r:&mut Rng,mode:usize| match mode { 0=>Pose::<Planar>::new(vec2(0.2*r.sym(),h+1e-4*r.sym()),Turn::IDENTITY), m=>{ let a=Turn::from_angle(3.0*r.sym()); let u=a.rotate(vec2(d*if m==1 {0.9+0.1*r.next()} else {1.5},0.0)); Pose::new(u,Turn::from_angle(3.0*r.sym()))} };
  let b2=PlanarShape::Box{size:[1.,1.]}; let c2=PlanarShape::Circle{radius:0.5}; let k2=PlanarShape::Capsule{length:1.0,radius:0.25}; let hp=PlanarShape::HalfPlane{normal:vec2(0.,1.)};
  let p8=PlanarShape::ConvexPolygon{points:(0..8).map(|k| Turn::from_angle(k as f64*0.785398).rotate(vec2(0.5,0.0))).collect()}; let pl=PlanarShape::HeightField{heights:vec![0.0;41],width:20.0};
  run::<Planar>("2d circle-circle",&c2,&c2,rest2(1.0,1.0)); run::<Planar>("2d circle-box",&c2,&b2,rest2(1.0,1.1)); run::<Planar>("2d box-box",&b2,&b2,rest2(1.0,1.15)); run::<Planar>("2d capsule-capsule",&k2,&k2,rest2(0.5,0.9)); run::<Planar>("2d octagon-octagon",&p8,&p8,rest2(0.92,0.96)); run::<Planar>("2d box-halfplane",&b2,&hp,rest2(0.5,0.6)); run::<Planar>("2d box-heightfield",&b2,&pl,rest2(0.5,0.6));
  // broad phase
  for n in [1000usize,10000] { let mut rng=Rng(987654321); let side=(n as f64).cbrt()*1.05; let mut boxes:Vec<Aabb<Spatial>>=(0..n).map(|k| { let c=vec3(side*rng.next(),side*rng.next(),side*rng.next()); let h=if k%10==0 {1.0} else {0.5}; Aabb{min:c-vec3(h,h,h),max:c+vec3(h,h,h)} }).collect(); boxes.push(Aabb{min:vec3(-1000.,-1000.,-1.),max:vec3(1000.,1000.,0.0)}); boxes.push(Aabb{min:vec3(f64::NEG_INFINITY,f64::NEG_INFINITY,f64::NEG_INFINITY),max:vec3(f64::INFINITY,f64::INFINITY,0.0)});
   let movable:Vec<bool>=(0..n+2).map(|i| i<n).collect(); let mut bp=BroadPhase::<Spatial>::new(); let mut best=f64::INFINITY; let mut k=0; for _ in 0..10 { let t=Instant::now(); k=bp.update(&boxes,&movable,&|_,_|true).len(); best=best.min(t.elapsed().as_secs_f64()); } println!("broad phase tree {n}: {:.3} ms, {k} pairs",best*1e3);
   let mut pairs=vec![]; let mut best=f64::INFINITY; for _ in 0..10 { let t=Instant::now(); pairs.clear(); let mut order:Vec<u32>=(0..boxes.len() as u32).collect(); order.sort_by(|&i,&j| boxes[i as usize].min[0].total_cmp(&boxes[j as usize].min[0])); for (s,&i) in order.iter().enumerate() { let bi=&boxes[i as usize]; for &j in &order[s+1..] { let bj=&boxes[j as usize]; if bj.min[0]>bi.max[0] {break;} if (movable[i as usize]||movable[j as usize]) && bi.overlaps(bj) {pairs.push((i.min(j),i.max(j)));} } } pairs.sort_unstable(); best=best.min(t.elapsed().as_secs_f64()); } println!("broad phase sweep {n}: {:.3} ms, {} pairs",best*1e3,pairs.len());
  use parry3d_f64::partitioning::*; use parry3d_f64::math::Vector; use parry3d_f64::bounding_volume::Aabb as PA; let leaves:Vec<PA>=boxes.iter().map(|b| PA::new(Vector::new(b.min[0].max(-1e6),b.min[1].max(-1e6),b.min[2].max(-1e6)),Vector::new(b.max[0].min(1e6),b.max[1].min(1e6),b.max[2].min(1e6)))).collect();
   let mut best=f64::INFINITY; let mut k=0; for _ in 0..10 { let t=Instant::now(); let bvh=Bvh::from_leaves(BvhBuildStrategy::Binned,&leaves); let mut pairs=vec![]; for (i,l) in leaves.iter().enumerate() { for j in bvh.intersect_aabb(l) { if (j as usize)>i {pairs.push((i as u32,j));} } } pairs.sort_unstable(); k=pairs.len(); best=best.min(t.elapsed().as_secs_f64()); } println!("broad phase parry bvh rebuilt {n}: {:.3} ms, {k} pairs",best*1e3);
  }
}
