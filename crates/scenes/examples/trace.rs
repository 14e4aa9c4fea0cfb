//! trace: scene a b t0 t1 it
use carom::*;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut w = carom_scenes::spatial(&args[0]).unwrap().unwrap();
    let (a, b) = (w.index(&args[1]).unwrap(), w.index(&args[2]).unwrap());
    let (t0, t1): (f64, f64) = (args[3].parse().unwrap(), args[4].parse().unwrap());
    let mut s = w.settings().clone();
    s.iterations = args[5].parse().unwrap();
    if let Some(m) = args.get(6) { s.contact_margin = Some(m.parse().unwrap()); }
    let dt = s.dt;
    w.set_settings(s).unwrap();
    println!("{:?} {:?}", w.bodies().data[a].shape, w.bodies().data[b].shape);
    while w.time() < t1 {
        let pa = w.bodies().shape_pose(a); let pb = w.bodies().shape_pose(b);
        let r = w.step(dt).unwrap();
        if w.time() < t0 { continue; }
        let (p, g, pressed) = w.last_problem();
        println!("   {pa:?} {pb:?}"); println!("t {:.4} res {:.1e} {:?} v {:?} w {:?}", w.time(), r.residual(), r.worst(), w.bodies().motion.velocity[b].0.map(|x| (x * 1e4).round() / 1e4), w.bodies().motion.angular_velocity[b].0.map(|x| (x * 1e4).round() / 1e4));
        for (k, t) in w.touches().iter().enumerate().filter(|(_, t)| (t.a == a && t.b == b) || (t.a == b && t.b == a)) {
            let c = pressed.iter().position(|&x| x == k);
            println!("     gap {:+.5} n {:?} p {:?} target {:?} imp {:?} id {:x}", t.gap, t.normal.0.map(|x| (x * 1e3).round() / 1e3), t.point.0.map(|x| (x * 1e4).round() / 1e4), c.map(|c| p.contacts[c].target), c.map(|c| g.contacts[c].normal), t.id & 0xffff);
        }
    }
}
