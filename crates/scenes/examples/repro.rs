//! repro: scan for contact points that are off the bodies
use carom::*;
use carom::geometry::{Geometry, Aabb};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut w = carom_scenes::spatial(&args[0]).unwrap().unwrap();
    let t1: f64 = args[1].parse().unwrap();
    let mut s = w.settings().clone();
    s.iterations = args[2].parse().unwrap();
    let dt = s.dt;
    w.set_settings(s).unwrap();
    let mut found = 0;
    while w.time() < t1 {
        let b = w.bodies().clone();
        w.step(dt).unwrap();
        for t in w.touches() {
            for i in [t.a, t.b] {
                let c = b.data[i].collider.as_ref().unwrap();
                let bounds: Aabb<Spatial> = Spatial::bounds(c, &b.shape_pose(i), 0.01 + t.gap.abs());
                let out = (0..3).any(|k| t.point[k] < bounds.min[k] || t.point[k] > bounds.max[k]);
                if out {
                    found += 1;
                    if found < 6 {
                        println!("t {} {} {} gap {} n {:?} point {:?} off {} bounds {:?}", w.time(), b.names[t.a], b.names[t.b], t.gap, t.normal, t.point, b.names[i], bounds);
                        for j in [t.a, t.b] { println!("   {:?} {:?}", b.data[j].shape, b.shape_pose(j)); }
                    }
                }
            }
        }
    }
    println!("{found} points off");
}
