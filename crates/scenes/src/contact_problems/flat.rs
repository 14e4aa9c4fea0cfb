//! Friction problems as flat little-endian binary files, for programs in other languages: i32 d, nc, nnz;
//! i32 indptr\[d nc + 1\]; i32 indices\[nnz\]; f64 values\[nnz\]; f64 q\[d nc\] \[m/s\]; f64 mu\[nc\].

use carom::solver::{Csr, FrictionProblem};
use std::io::{self, Read, Write};

fn write_whole(out: &mut impl Write, numbers: impl Iterator<Item = usize>) -> io::Result<()> {
    let too_large = |_| io::Error::new(io::ErrorKind::InvalidInput, "an index is beyond 2^31 - 1");
    let numbers = numbers.map(|n| i32::try_from(n).map_err(too_large)).collect::<io::Result<Vec<_>>>()?;
    out.write_all(&numbers.into_iter().flat_map(i32::to_le_bytes).collect::<Vec<u8>>())
}

fn write_real(out: &mut impl Write, numbers: &[f64]) -> io::Result<()> {
    out.write_all(&numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
}

/// Writes a problem.
///
/// # Errors
/// What the writer says; `InvalidInput` for more stored values than an i32 counts.
pub fn write_flat(problem: &FrictionProblem, out: &mut impl Write) -> io::Result<()> {
    let w = &problem.matrix;
    write_whole(out, [problem.dimension, problem.contacts(), w.values.len()].into_iter())?;
    write_whole(out, w.starts.iter().copied())?;
    write_whole(out, w.indices.iter().copied())?;
    write_real(out, &w.values)?;
    write_real(out, &problem.velocity)?;
    write_real(out, &problem.friction)
}

/// Bytes taken at once while reading: a false header allocates no more than this beyond what the file holds.
const PIECE: usize = 1 << 20;

fn read_bytes(input: &mut impl Read, count: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    while bytes.len() < count {
        let start = bytes.len();
        bytes.resize(start + PIECE.min(count - start), 0);
        input.read_exact(&mut bytes[start..])?;
    }
    Ok(bytes)
}

fn read_whole(input: &mut impl Read, count: usize) -> io::Result<Vec<usize>> {
    let negative = |_| io::Error::new(io::ErrorKind::InvalidData, "a count or an index is negative");
    let bytes = read_bytes(input, 4 * count)?;
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|b| usize::try_from(i32::from_le_bytes(*b)).map_err(negative)).collect()
}

fn read_real(input: &mut impl Read, count: usize) -> io::Result<Vec<f64>> {
    let bytes = read_bytes(input, 8 * count)?;
    let (words, _) = bytes.as_chunks::<8>();
    Ok(words.iter().map(|b| f64::from_le_bytes(*b)).collect())
}

/// Reads a checked problem.
///
/// # Errors
/// What the reader says; `InvalidData` for a file that is no problem.
pub fn read_flat(input: &mut impl Read) -> io::Result<FrictionProblem> {
    let head = read_whole(input, 3)?;
    let [dimension, contacts, stored] = [head[0], head[1], head[2]];
    let n = dimension * contacts;
    let starts = read_whole(input, n + 1)?;
    let indices = read_whole(input, stored)?;
    let values = read_real(input, stored)?;
    let problem = FrictionProblem {
        dimension,
        matrix: Csr { shape: (n, n), starts, indices, values }.into(),
        velocity: read_real(input, n)?,
        friction: read_real(input, contacts)?,
    };
    problem.check().map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e.to_string()))?;
    Ok(problem)
}
