//! Lead's probe (not committed).
use carom::*;
fn go<S: Geometry>(mut w: World<S>, t: f64) {
    let dt = w.settings().dt; let n = (t/dt).round() as usize;
    let t0 = std::time::Instant::now();
    let mut total = Ledger::default(); let mut deepest=0.0f64; let mut worst=0.0f64; let mut its=0usize; let mut imp=0;
    for s in 0..n { let r = w.step(dt).unwrap(); total.add(&r.ledger); deepest=deepest.min(r.deepest.map_or(0.0,|d|d.0)); worst=worst.max(r.residual()); its+=r.iterations(); imp+=r.impact_solve.is_some() as usize;
      if s % (n/10).max(1) == 0 || s==n-1 { let vmax=w.bodies().motion.velocity.iter().map(|v|v.norm()).fold(0.0,f64::max); println!("{:5.2}s n {} contacts {} res {:.2e} it {} deepest now {:.2e} KE {:.3e} E {:.6e} vmax {:.2e} closure {:.1e} ms/step {:.2}", r.time, w.bodies().len(), r.contacts, r.residual(), r.iterations(), r.deepest.map_or(0.0,|d|d.0), r.energy.kinetic(), r.energy.total(), vmax, total.closure, t0.elapsed().as_secs_f64()*1e3/(s+1) as f64); } }
    println!("deepest {deepest:.2e} worst {worst:.2e} mean it {:.1} impacts in {imp} steps\n{total:?}", its as f64/n as f64);
}
fn main() {
    let name = std::env::args().nth(1).unwrap(); let t: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let it: Option<usize> = std::env::args().nth(3).map(|a| a.parse().unwrap());
    if let Some(w) = carom_scenes::planar(&name) { let mut w=w.unwrap(); if let Some(i)=it { let mut s=w.settings().clone(); s.iterations=i; w.set_settings(s).unwrap(); } go(w, t) } else { let mut w = carom_scenes::spatial(&name).unwrap().unwrap(); if let Some(i)=it { let mut s=w.settings().clone(); s.iterations=i; w.set_settings(s).unwrap(); } go(w, t) }
}
