//! A pyramid of boxes in the plane stands for ten seconds; the books close.
//! Run with `cargo run --release -p carom --example pyramid -- 20`.

use carom::{BodySpec, BuildError, Ledger, PlanarShape, Settings, World2, vec2};

/// A pyramid of unit boxes with `base` boxes in its lowest row.
fn pyramid(base: usize) -> Result<World2, BuildError> {
    let mut world = World2::new(Settings::default())?;
    world.add("floor", BodySpec::fixed(PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) }))?;
    for row in 0..base {
        for k in 0..base - row {
            let position = vec2(1.05 * k as f64 + 0.525 * row as f64, 0.5 + row as f64);
            let spec = BodySpec::dense(PlanarShape::Box { size: [1.0, 1.0] }, 1.0).at(position);
            world.add(&format!("box{row}.{k}"), spec)?;
        }
    }
    Ok(world)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let base = std::env::args().nth(1).map_or(Ok(10), |a| a.parse())?;
    let mut world = pyramid(base)?;
    let mut ledger = Ledger::default();
    let (mut worst, mut deepest) = (0.0_f64, 0.0_f64);
    for _ in 0..2400 {
        let report = world.step(1.0 / 240.0)?;
        ledger.add(&report.ledger);
        worst = worst.max(report.residual());
        deepest = deepest.min(report.deepest.map_or(0.0, |d| d.0));
    }
    println!(
        "{} boxes, {:.1} s: worst residual {worst:.1e} m/s, deepest gap {deepest:.1e} m",
        world.bodies().len() - 1,
        world.time()
    );
    for (name, line) in Ledger::NAMES.iter().zip(ledger.lines()) {
        println!("{name:>16} {line:13.6e} J");
    }
    Ok(())
}
