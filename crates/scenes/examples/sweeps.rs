//! sweeps: compare sweep orders
use carom::*;
use carom::geometry::Geometry;
use carom::solver::prepared::Prepared;
use carom::solver::methods::pgs::relax_contact;
use carom::solver::residual::residual_of;
fn study<S: Geometry>(mut w: World<S>, t: f64) {
    let dt = w.settings().dt;
    while w.time() < t { w.step(dt).unwrap(); }
    // velocities before the next step, contacts of it
    let before: Vec<_> = (0..w.bodies().len()).map(|i| w.bodies().motion.twist(i)).collect();
    let b = w.bodies().clone();
    w.step(dt).unwrap();
    let masses = (0..b.len()).map(|i| b.inverse_mass(i)).collect();
    let mut p = ContactProblem::new(masses, before);
    for t in w.touches() {
        p.contacts.push(Contact { id: t.id, a: t.a, b: t.b, normal: t.normal, arm_a: t.point - b.motion.position[t.a], arm_b: t.point - b.motion.position[t.b], gap: t.gap, target: -t.gap.max(0.0)/dt, restitution: 0.0, friction: t.friction });
    }
    run("impact", &p);
    let (p, warm, _) = w.last_problem();
    run("contact cold", p);
    let _ = warm;
}
fn run<S: Geometry>(name: &str, p: &ContactProblem<S>) {
    let prep = Prepared::of(p);
    println!("{name}: {} contacts", p.contacts.len());
    for mode in ["forward", "backward", "alternate", "by a.h"] {
        let mut g = Impulses::zero(p);
        let mut v = p.velocities.clone();
        let n = p.contacts.len();
        print!("  {mode:10}");
        for s in 0..400 {
            let go = |k: usize, g: &mut Impulses<S>, v: &mut Vec<Twist<S>>| { relax_contact(&prep.contacts[k], &mut g.contacts[k], p.friction_law, v); };
            let back = match mode { "forward" => false, "backward" => true, "alternate" => s % 2 == 1, _ => (s / 4) % 2 == 1 };
            if back { for k in (0..n).rev() { go(k, &mut g, &mut v) } } else { for k in 0..n { go(k, &mut g, &mut v) } }
            if [4, 9, 19, 29, 49, 99, 199, 399].contains(&s) { print!(" {}:{:.2e}", s + 1, residual_of(p, &prep, &g).absolute); }
        }
        println!();
    }
}
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    for t in args[1].split(',') { let t: f64 = t.parse().unwrap(); println!("== {} {t}", args[0]);
    if let Some(w) = carom_scenes::planar(&args[0]) { study(w.unwrap(), t) } else { study(carom_scenes::spatial(&args[0]).unwrap().unwrap(), t) } }
}
