//! What a pair of bodies that touch costs `soft_step`, in time and in memory, in scenes from a hundred pairs to a million: pyramids
//! of ten rows beside each other, one thread. `growth [PAIRS]` stops at about so many pairs, a million unless said. Each size runs
//! in a process of its own, which tells what memory it holds; the same boxes far from each other tell what a body takes without
//! pairs. What it does not do: run another engine (the race does, `SCENES=pyramids:8,pyramids:83`).

use carom::{BodySpec, Planar, Scheme, Settings, Spatial, World};
use carom_scenes::stacking;
use carom_scenes::stage::Stage;
use std::error::Error;
use std::process::Command;
use std::time::Instant;

/// Rows of a pyramid, and its boxes and pairs: each row but the lowest stands on two boxes, and all stand beside each other.
const ROWS: usize = 10;
const BOXES: usize = ROWS * (ROWS + 1) / 2;
/// Pyramids of each size.
const COUNTS: [usize; 9] = [1, 3, 7, 22, 70, 220, 700, 2200, 6900];
/// Steps that are not told: what is found once.
const BEGINNING: usize = 4;
/// Times that every size runs, one after another: the least median is told, for who shares a processor with others is slowed down
/// by them, and never sped up.
const TURNS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["plane", what, count] => told::<Planar>(what, count.parse()?),
        ["space", what, count] => told::<Spatial>(what, count.parse()?),
        [] => table(1_000_000),
        [pairs] => table(pairs.parse()?),
        _ => Err("growth [PAIRS]".into()),
    }
}

/// One size in this process: pairs, nanoseconds of a step over them, and bytes that the process holds.
fn told<S: Stage>(what: &str, count: usize) -> Result<(), Box<dyn Error>> {
    let mut world =
        if what == "pyramids" { stacking::pyramids::<S>(count, ROWS)? } else { apart::<S>(count * BOXES)? };
    world.set_settings(Settings { scheme: Scheme::SoftStep, solver: None, ..world.settings().clone() })?;
    let (mut spent, mut contacts) = (Vec::new(), 0);
    for _ in 0..BEGINNING + (20_000 / (count * BOXES).max(1)).clamp(15, 200) {
        let (begun, dt) = (Instant::now(), world.settings().dt);
        let report = world.step(dt)?;
        spent.push(begun.elapsed().as_secs_f64() * 1e9);
        contacts = report.contact_solve.map_or(0, |solve| solve.contacts);
    }
    let pairs = contacts / if S::DIM == 2 { 2 } else { 4 };
    println!("{pairs} {} {}", median(spent.split_off(BEGINNING)) / pairs.max(1) as f64, resident());
    Ok(())
}

/// Boxes that touch nothing and that nothing pulls.
fn apart<S: Stage>(count: usize) -> Result<World<S>, Box<dyn Error>> {
    let mut world =
        World::new(Settings { gravity: <S as carom::Space>::Vector::default(), ..Settings::default() })?;
    for k in 0..count {
        let spec = BodySpec::dense(S::block(1.0, 1.0, 1.0), 1000.0).at(S::place(3.0 * k as f64, 0.0));
        world.add(&format!("box{k}"), spec)?;
    }
    Ok(world)
}

/// A line for each size, in both spaces.
fn table(most: usize) -> Result<(), Box<dyn Error>> {
    println!(
        "{:8}{:>10}{:>10}{:>12}{:>14}{:>14}{:>10}",
        "space", "bodies", "pairs", "ns a pair", "bytes a body", "bytes a pair", "over 1e3"
    );
    for space in ["plane", "space"] {
        let counts: Vec<usize> = COUNTS.into_iter().filter(|count| count * ROWS * ROWS <= most).collect();
        let mut told = Vec::new();
        for turn in 0..TURNS {
            for (k, count) in counts.iter().enumerate() {
                eprint!("\r{space}: turn {} of {TURNS}, {count} pyramids      ", turn + 1);
                let [pairs, cost, held] = run(space, "pyramids", *count)?;
                if turn == 0 {
                    told.push([pairs, cost, held]);
                }
                told[k][1] = told[k][1].min(cost);
            }
        }
        eprint!("\r{:60}\r", "");
        let mut first = None;
        for (count, [pairs, cost, held]) in counts.iter().zip(told) {
            if pairs >= 900.0 {
                first = first.or(Some(cost));
            }
            let bytes = bytes(space, *count, (pairs, held))?;
            let growth = first.map_or(String::new(), |first| format!("{:10.2}", cost / first));
            println!("{space:8}{:10}{pairs:10}{cost:12.0}{bytes}{growth}", count * BOXES);
        }
    }
    Ok(())
}

/// What a body and a pair take of the bytes that are held with so many pairs.
fn bytes(space: &str, count: usize, (pairs, held): (f64, f64)) -> Result<String, Box<dyn Error>> {
    let bodies = count * BOXES;
    // what a process holds is told in pages, and a few pairs have none of their own
    if bodies < 1000 {
        return Ok("          –             –".into());
    }
    let [_, _, empty] = run(space, "apart", 0)?;
    let [_, _, alone] = run(space, "apart", count)?;
    Ok(format!("{:14.0}{:14.0}", (alone - empty) / bodies as f64, (held - alone) / pairs))
}

/// What another process tells of a size.
fn run(space: &str, what: &str, count: usize) -> Result<[f64; 3], Box<dyn Error>> {
    let done = Command::new(std::env::current_exe()?).args([space, what, &count.to_string()]).output()?;
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).into());
    }
    let line = String::from_utf8(done.stdout)?;
    let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    numbers.try_into().map_err(|_| line.into())
}

/// Bytes of memory that this process holds now; 0 where the system does not tell.
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) * 1024.0
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}
