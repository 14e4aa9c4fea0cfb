use carom_geometry::*;
use carom_math::*;
struct Rng(u64);
impl Rng { fn next(&mut self)->f64{ self.0^=self.0<<13; self.0^=self.0>>7; self.0^=self.0<<17; (self.0>>11) as f64/(1u64<<53) as f64 } fn sym(&mut self)->f64{2.0*self.next()-1.0}
 fn pose(&mut self, far:f64)->Pose<Spatial>{ Pose::new(vec3(far*self.sym(),far*self.sym(),far*self.sym()), Quaternion([self.sym(),self.sym(),self.sym(),self.sym()]).renormalized().unwrap()) } }
fn hull_points(n:usize, rng:&mut Rng)->Vec<Vec3>{ let mut v:Vec<Vec3>=(0..n).map(|_| loop{ let p=vec3(rng.sym(),rng.sym(),rng.sym()); if p.norm()<1.0 {break p*(0.5/p.norm())}}).collect(); 
  // flat bottom octagon at z=-0.4
  v.retain(|p| p[2]>-0.39); for k in 0..7 { let a=k as f64*0.9; v.push(vec3(0.3*a.cos(),0.3*a.sin(),-0.4)); } v }
fn main(){
  let mut rng=Rng(88172645463325252);
  let hull=hull_points(24,&mut rng);
  let q=|x:f64,y:f64,z:f64,a:f64| Quaternion::from_axis_angle(vec3(x,y,z).normalized().unwrap(),a);
  let pi=std::f64::consts::PI;
  // (name, shape, rotation so that lowest point at -h, h, expected count)
  let slope=(0.6f64/1.0).atan(); // cone h=1,r=.6?
  let cone_h=1.0; let cone_r=0.6;
  let side_len=(cone_h*cone_h+cone_r*cone_r as f64).sqrt();
  let _=slope;
  let cases:Vec<(&str,SpatialShape,Quaternion,f64)>=vec![
   ("sphere",SpatialShape::Sphere{radius:0.3},q(1.,2.,3.,1.),0.3),
   ("capsule lying",SpatialShape::Capsule{length:1.0,radius:0.2},q(1.,0.,0.,pi/2.),0.2),
   ("capsule up",SpatialShape::Capsule{length:1.0,radius:0.2},q(1.,0.,0.,0.),0.7),
   ("box",SpatialShape::Box{size:[0.4,0.6,0.8]},q(0.,0.,1.,0.7),0.4),
   ("roundbox",SpatialShape::RoundBox{size:[0.4,0.6,0.8],radius:0.1},q(0.,0.,1.,0.7),0.5),
   ("hull",SpatialShape::ConvexHull{points:hull.clone()},q(0.,0.,1.,0.3),0.4),
   ("roundhull",SpatialShape::RoundConvexHull{points:hull.clone(),radius:0.05},q(0.,0.,1.,0.3),0.45),
   ("cylinder up",SpatialShape::Cylinder{height:1.0,radius:0.3},q(0.,0.,1.,0.3),0.5),
   ("cylinder lying",SpatialShape::Cylinder{height:1.0,radius:0.3},q(1.,0.,0.,pi/2.),0.3),
   ("roundcyl lying",SpatialShape::RoundCylinder{height:1.0,radius:0.3,rounding:0.1},q(1.,0.,0.,pi/2.),0.4),
   ("cone up",SpatialShape::Cone{height:cone_h,radius:cone_r},q(0.,0.,1.,0.3),0.5),
   ("cone lying",SpatialShape::Cone{height:cone_h,radius:cone_r},q(1.,0.,0.,-(pi/2.0-(cone_r/cone_h as f64).atan())-0.0),f64::NAN),
  ];
  let floors:Vec<(&str,SpatialShape,f64)>=vec![("halfspace",SpatialShape::HalfSpace{normal:vec3(0.,0.,1.)},0.0),("box",SpatialShape::Box{size:[20.,20.,2.]},1.0),
   ("hull",SpatialShape::ConvexHull{points:vec![vec3(-3.,-3.,0.5),vec3(3.,-3.,0.5),vec3(3.,3.,0.5),vec3(-3.,3.,0.5),vec3(0.,0.,-1.),vec3(1.,0.,-0.9)]},0.5),
   ("cylinder",SpatialShape::Cylinder{height:1.0,radius:3.0},0.5),
   ("mesh",SpatialShape::HeightField{heights:vec![vec![0.0;9];9],size:[8.0,8.0]},0.0)];
  for (fname,floor,top) in &floors { let cf=Spatial::collider(floor).unwrap();
   for (name,shape,rot,h) in &cases { let c=Spatial::collider(shape).unwrap();
    let mut line=format!("{fname:10} {name:15}");
    for gap in [1e-2,1e-4,1e-6,1e-9,1e-12,0.0,-1e-12,-1e-9,-1e-6,-1e-4,-1e-2] { let (mut eg,mut en,mut cnt)=(0.0f64,0.0f64,[99usize,0]);
     for _ in 0..50 { let base=rng.pose(1.0); 
       let mut h=*h; if h.is_nan(){ // compute by bounds
          let b=Spatial::bounds(&c,&Pose::new(Vec3::ZERO,*rot),0.0); h=-b.min[2]; }
       let local=Pose::new(vec3(0.37*rng.sym(),0.37*rng.sym(),top+h+gap),rot.then(&q(0.,0.,1.,rng.sym()))); let local:Pose<Spatial>=local; 
       let pa=base.compose(&local); let n=base.rotation.rotate(vec3(0.,0.,1.));
       let mut out=vec![]; Spatial::contacts(&c,&pa,&cf,&base,0.02,&mut out);
       let g=out.iter().fold(f64::INFINITY,|m,p|m.min(p.gap)); eg=eg.max((g-gap).abs()); 
       for p in &out { en=en.max((p.normal-n).norm()); } cnt=[cnt[0].min(out.len()),cnt[1].max(out.len())]; }
     line+=&format!(" {:.0e}/{:.0e}/{}-{}",eg,en,cnt[0],cnt[1]); }
    println!("{line}"); let _=side_len; } }
}
