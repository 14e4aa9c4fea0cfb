//! Products with the short dense rows of contacts that are condensed: nearly all have six numbers, and loops of known
//! length stay in registers.

use super::skeleton::MOST;

/// out += each line times its factor.
#[inline(always)]
pub fn add_lines(lines: &[f64], factors: &[f64], out: &mut [f64]) {
    if let Ok(out) = <&mut [f64; MOST]>::try_from(&mut *out) {
        for (line, factor) in lines.as_chunks::<MOST>().0.iter().zip(factors) {
            (0..MOST).for_each(|k| out[k] += line[k] * factor);
        }
        return;
    }
    for (line, factor) in lines.chunks_exact(out.len()).zip(factors) {
        line.iter().zip(out.iter_mut()).for_each(|(x, o)| *o += x * factor);
    }
}

/// out += factor A x, row by row.
#[inline(always)]
pub fn add_rows(a: &[f64], (x, factor): (&[f64], f64), out: &mut [f64]) {
    if let Ok(x) = <&[f64; MOST]>::try_from(x) {
        for (row, out) in a.as_chunks::<MOST>().0.iter().zip(out) {
            *out += factor * dot(row, x);
        }
        return;
    }
    for (row, out) in a.chunks_exact(x.len()).zip(out) {
        *out += factor * row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

/// In three sums, for one would wait for itself.
#[inline(always)]
fn dot(a: &[f64; MOST], b: &[f64; MOST]) -> f64 {
    let [one, two, three] = std::array::from_fn(|k| a[k] * b[k] + a[k + 3] * b[k + 3]);
    one + two + three
}
