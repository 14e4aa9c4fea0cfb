//! scratch: scene seconds [key=value...]
use carom::*;
use carom::geometry::Geometry;
use std::time::Instant;
fn probe<S: Geometry>(mut w: World<S>, duration: f64, args: &[String]) {
    let mut s = w.settings().clone();
    let mut every = 0.0;
    for a in args {
        let (k, v) = a.split_once('=').unwrap();
        match k {
            "dt" => s.dt = 1.0 / v.parse::<f64>().unwrap(),
            "it" => s.iterations = v.parse().unwrap(),
            "tol" => s.tolerance = v.parse().unwrap(),
            "solver" => s.solver = v.parse().unwrap(),
            "frac" => s.correction_fraction = v.parse().unwrap(),
            "warm" => s.warm_start = v == "1",
            "corr" => s.position_correction = match v { "none" => PositionCorrection::None, "nudge" => PositionCorrection::Nudge, _ => PositionCorrection::SplitImpulse },
            "every" => every = v.parse().unwrap(),
            _ => panic!("{k}"),
        }
    }
    let dt = s.dt;
    w.set_settings(s).unwrap();
    let steps = (duration / dt).round() as usize;
    let e0 = w.energy();
    let start = w.bodies().motion.position.clone();
    let (mut t, mut worst, mut deep, mut iters, mut vmax, mut closure) = (0.0, 0.0f64, (0.0f64, 0, 0, 0.0), 0usize, 0.0f64, 0.0f64);
    let mut next = every;
    let (mut unc, mut cmax) = (0, 0);
    let mut last = None;
    for k in 0..steps {
        let t0 = Instant::now();
        let r = match w.step(dt) { Ok(r) => r, Err(e) => { println!("step {k}: {e}"); break; } };
        t += t0.elapsed().as_secs_f64();
        worst = worst.max(r.residual());
        iters += r.iterations();
        cmax = cmax.max(r.contacts);
        if !r.converged() { unc += 1; }
        closure = closure.max(r.ledger.closure.abs());
        if let Some((g, a, b)) = r.deepest { if g < deep.0 { deep = (g, a, b, r.time); } }
        let v = (0..w.bodies().len()).map(|i| w.bodies().motion.velocity[i].norm()).fold(0.0, f64::max);
        vmax = vmax.max(v);
        if every > 0.0 && r.time >= next - 1e-9 {
            println!("t {:.3} contacts {} it {} res {:.2e} deep {:?} v {:.3e} kin {:.3e} pot {:.6e} c {:?} i {:?}", r.time, r.contacts, r.iterations(), r.residual(), r.deepest.map(|d| (format!("{:.2e}", d.0), &w.bodies().names[d.1], &w.bodies().names[d.2])), v, r.energy.kinetic(), r.energy.potential,
                r.contact_solve.as_ref().map(|s| (s.contacts, s.iterations)), r.impact_solve.as_ref().map(|s| (s.contacts, s.iterations)));
            next += every;
        }
        last = Some(r);
    }
    let e1 = w.energy();
    let b = w.bodies();
    println!("steps {} dt {dt:.5} wall {t:.2} s, {:.3} ms/step, iterations {:.1}/step, contacts max {cmax} last {}, unconverged {unc}", w.steps(), 1e3 * t / steps as f64, iters as f64 / steps as f64, last.as_ref().map_or(0, |r| r.contacts));
    println!("residual worst {worst:.3e} last {:.3e}; deepest {:.3e} ({} {}) at {:.3}; vmax {vmax:.3e}", last.as_ref().map_or(0.0, |r| r.residual()), deep.0, b.names[deep.1], b.names[deep.2], deep.3);
    println!("E {:.6e} -> {:.6e} (kin {:.3e} -> {:.3e}); closure {closure:.1e}", e0.total(), e1.total(), e0.kinetic(), e1.kinetic());
    for (n, x) in carom::Ledger::NAMES.iter().zip(w.ledger().lines()) { if x != 0.0 { print!("{n} {x:.3e}  "); } }
    println!();
    if b.len() <= 9 {
        for i in 0..b.len() { let m = &b.motion; println!("  {:14} x {:.6?} v {:.6?} w {:.6?} moved {:.6}", b.names[i], m.position[i].as_slice(), m.velocity[i].as_slice(), m.angular_velocity[i].as_slice(), (m.position[i]-start[i]).norm()); }
    } else {
        let d = (0..b.len()).max_by(|&i,&j| (b.motion.position[i]-start[i]).norm().total_cmp(&(b.motion.position[j]-start[j]).norm())).unwrap();
        let low = (0..b.len()).filter(|&i| b.is_dynamic(i)).min_by(|&i,&j| b.motion.position[i][S::DIM-1].total_cmp(&b.motion.position[j][S::DIM-1])).unwrap();
        println!("  moved most {} {:.5}; lowest {} {:?}", b.names[d], (b.motion.position[d]-start[d]).norm(), b.names[low], b.motion.position[low].as_slice());
    }
}
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let names: Vec<&str> = if args[0] == "all" { carom_scenes::catalogue().iter().map(|s| s.name).filter(|n| *n != "pile" && *n != "pyramid_planar").collect() } else { args[0].split(',').collect() };
    for name in names {
        let info = carom_scenes::catalogue().iter().find(|s| s.name == name).unwrap();
        let duration = args.get(1).and_then(|a| a.parse().ok()).filter(|d| *d > 0.0).unwrap_or(info.duration);
        let rest: Vec<String> = args.iter().skip(2).cloned().collect();
        println!("== {name} {duration} s {rest:?}");
        if let Some(w) = carom_scenes::planar(name) { probe(w.unwrap(), duration, &rest) } else { probe(carom_scenes::spatial(name).unwrap().unwrap(), duration, &rest) }
    }
}
