//! `carom-contact generate`: our own problems as files, flat (.bin) and as bodies and contacts (.json).

use crate::families::{Made, large, small, structures};
use crate::options::Options;
use crate::piles::settled;
use carom_scenes::contact_problems::write_flat;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

fn write(folder: &Path, made: &Made) -> Result<(), String> {
    let told = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut out = BufWriter::new(File::create(folder.join(format!("{}.bin", made.name))).map_err(told)?);
    write_flat(&made.matrix, &mut out).and_then(|()| out.flush()).map_err(told)?;
    std::fs::write(folder.join(format!("{}.json", made.name)), &made.json).map_err(told)?;
    println!("{:<32} {:>7} contacts", made.name, made.matrix.contacts());
    Ok(())
}

/// Writes the structures, the small families of every seed, the two of 5,000 contacts, and the piles asked for.
///
/// # Errors
/// What is wrong with the folder, or what a world says.
pub fn run(options: &Options) -> Result<(), String> {
    let folder = options.out.as_deref().ok_or("generate needs --out FOLDER")?;
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let refused = |e: carom::ShapeError| e.to_string();
    for made in structures().map_err(refused)? {
        write(folder, &made)?;
    }
    for seed in options.seed..options.seed + options.seeds {
        for made in small(seed).map_err(refused)?.iter().chain(&large(seed).map_err(refused)?) {
            write(folder, made)?;
        }
    }
    for &bodies in &options.piles {
        write(folder, &Made::of("pile", format!("pile_{bodies}"), &settled(bodies)?))?;
    }
    Ok(())
}
