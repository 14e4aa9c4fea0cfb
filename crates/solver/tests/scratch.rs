mod common;
use carom_math::*;
use carom_solver::*;
use common::*;

fn explore<S: Space>(law: FrictionLaw, friction: f64, kind: SolverKind) {
    let mut random = Random::new(77);
    for (bodies, contacts, rows) in [(3, 2, 1), (4, 6, 2), (6, 10, 3), (8, 30, 0), (40, 60, 0), (12, 40, 10)]
    {
        let (mut refused, mut bad, mut worst, mut n, mut piv) = (0, 0, 0.0f64, 0, 0);
        let count = if contacts > 35 { 30 } else { 300 };
        let t = std::time::Instant::now();
        let mut reasons = std::collections::BTreeMap::<String, usize>::new();
        for _ in 0..count {
            let p = random_problem::<S>(&mut random, Recipe { bodies, contacts, rows, friction, law });
            p.check().unwrap();
            let (g, o) = solve(&p, kind, 2000, 0.0);
            n += 1;
            piv += o.iterations;
            assert!(g.is_finite());
            if let Stop::Refused(r) = &o.stop {
                refused += 1;
                *reasons.entry(r.chars().take(40).collect()).or_default() += 1;
                continue;
            }
            if o.residual.relative > 1e-9 {
                bad += 1;
                if kind == SolverKind::Lemke {
                    println!(
                        "  {:?} rows {:?} g {:?}",
                        o.residual,
                        p.rows.iter().map(|r| (r.lo, r.hi, r.target)).collect::<Vec<_>>(),
                        g
                    );
                }
            }
            worst = worst.max(o.residual.relative);
        }
        println!(
            "{} {:?} mu<={friction} {}: {bodies}/{contacts}/{rows}: {n} refused {refused} bad {bad} worst {worst:.1e} iter {} time {:.1} us each {reasons:?}",
            S::NAME,
            law,
            kind.name(),
            piv / n,
            t.elapsed().as_secs_f64() * 1e6 / n as f64
        );
    }
}
#[test]
fn lemke() {
    for f in [0.0, 0.5, 10.0] {
        explore::<Planar>(FrictionLaw::Disc, f, SolverKind::Lemke);
        explore::<Spatial>(FrictionLaw::Box, f, SolverKind::Lemke);
    }
}
#[test]
fn pgs() {
    for f in [0.0, 0.5, 10.0] {
        explore::<Planar>(FrictionLaw::Disc, f, SolverKind::Pgs);
        explore::<Spatial>(FrictionLaw::Disc, f, SolverKind::Pgs);
    }
}
#[test]
fn direct() {
    explore::<Planar>(FrictionLaw::Disc, 0.0, SolverKind::Direct);
    explore::<Spatial>(FrictionLaw::Disc, 0.0, SolverKind::Direct);
}
