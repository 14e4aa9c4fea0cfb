use carom_geometry::*; use carom_math::*;
fn main(){
 let a=SpatialShape::Capsule { length: 0.7, radius: 0.2 }; let pa=Pose::<Spatial> { position: Tuple([0.48442047736115784, 0.2735277630920569, 0.42668491973848677]), rotation: Quaternion([0.7596308104961533, -0.6003224003037184, 0.24895863039509425, 0.024364888473748382]) };
 let b=SpatialShape::RoundCylinder { height: 0.5, radius: 0.3, rounding: 0.1 }; let pb=Pose::<Spatial> { position: Tuple([-0.3023965218027362, 0.4296633460024315, 0.07852533251277828]), rotation: Quaternion([-0.6079710154686452, -0.17059357091908706, 0.3567633987513391, 0.6884685579040571]) };
 let (ca,cb)=(Spatial::collider(&a).unwrap(),Spatial::collider(&b).unwrap());
 let c=Spatial::closest(&ca,&pa,&cb,&pb,9.0).unwrap(); println!("{c:?} {}",c.normal.norm()-1.0); let n=c.normal;
 let rel=pa.inverse().compose(&pb); println!("rot norm {} {}",pa.rotation.0.iter().map(|x|x*x).sum::<f64>()-1.0, pb.rotation.0.iter().map(|x|x*x).sum::<f64>()-1.0);
 let na=pa.rotation.unrotate(n); println!("{:?}",na);
 let mut out=vec![]; Spatial::contacts(&ca,&pa,&cb,&pb,10.0,&mut out); for o in &out {println!("{o:?}");} println!("{rel:?}");
 let d=c.point_a-c.point_b; println!("{:?} {:?}",d*(1.0/d.norm())-n, d.norm());
 let (t,u)=(Spatial::tangent(n,0),Spatial::tangent(n,1)); let f=Pose::<Spatial>::new(Vec3::ZERO,Quaternion::from_matrix(&[n.0,t.0,u.0])); println!("{:?} {:?}",f.rotation.rotate(n),n); let q=f.compose(&pb); println!("{} {}",Spatial::bounds(&ca,&f.compose(&pa),0.0).min[0], Spatial::bounds(&cb,&q,0.0).max[0]); let nb=pb.rotation.unrotate(n); println!("{nb:?}"); let rho=(nb[0]*nb[0]+nb[1]*nb[1]).sqrt(); println!("{} ", n.dot(pb.position)+0.3*rho+0.25*nb[2].abs()+0.1); let e=pa.rotation.rotate(vec3(0.,0.,0.35)); println!("{}", n.dot(pa.position)-n.dot(e).abs()-0.2);
}
