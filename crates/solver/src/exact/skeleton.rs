//! The rows that a group of contacts needs of W~: few of them, of which all others are sums. A group's rows span at most
//! six directions (three in the plane), so W_g = X W_P with rows P of W_g itself and X the identity on them: what is left
//! of W~ when its columns are treated so too is some of its own numbers (a skeleton: Cheng, Gimbutas, Martinsson, Rokhlin
//! 2005). Found on a few columns that a group's rows are added up into.

use super::operator::Matrix;

/// Most directions of a group.
pub const MOST: usize = 6;
/// Directions left out are smaller than this share of the group's largest.
const RANK: f64 = 1e-9;
/// Rounding of the numbers of W~, as a share of them.
const ALIKE: f64 = 1e-12;
/// Columns that rows are gathered into before their directions are found.
const SKETCH: usize = 12;

/// A contact's rows (or columns) of W~ added up, with signs, into few columns: their directions stay the same.
pub type Sketch<const D: usize> = [[f64; SKETCH]; D];

/// The rows and the columns of W~ of every contact, gathered. Signs and places are scattered, so that no direction
/// cancels except by accident, which a probe of what comes of it would tell.
#[inline(always)]
pub fn sketches<const D: usize>(matrix: &Matrix) -> (Vec<Sketch<D>>, Vec<Sketch<D>>) {
    let n = matrix.graph.nodes();
    let (mut rows, mut columns) = (vec![[[0.0; SKETCH]; D]; n], vec![[[0.0; SKETCH]; D]; n]);
    let scatter = |i: usize| {
        let mixed = (i as u32).wrapping_mul(0x9E37_79B1) >> 16;
        let sign = if mixed & 1 == 0 { 1.0 } else { -1.0 };
        (sign, (mixed >> 1) as usize % (SKETCH / D) * D)
    };
    for i in 0..n {
        let (own_sign, own_place) = scatter(i);
        for k in matrix.graph.row(i) {
            let j = matrix.graph.neighbours[k] as usize;
            let (sign, place) = scatter(j);
            let block = &matrix.values[matrix.graph.offsets[k] as usize..][..D * D];
            for r in 0..D {
                for c in 0..D {
                    rows[i][r][place + c] += sign * block[r * D + c];
                    columns[j][c][own_place + r] += own_sign * block[r * D + c];
                }
            }
        }
    }
    (rows, columns)
}

/// Rows of a group that all its rows are sums of.
#[derive(Clone, Debug, Default)]
pub struct Skeleton {
    /// Those rows, by their place among the group's.
    pub kept: Vec<u32>,
    /// X, one row of as many numbers as rows are kept for each row of the group.
    pub shares: Vec<f64>,
}

/// True where two sketches differ by no more than rounding may, as a share of the largest number of the first: what
/// spans the one spans the other.
#[inline(always)]
pub fn are_alike<const D: usize>(one: &Sketch<D>, other: &Sketch<D>) -> bool {
    let (mut largest, mut apart): (f64, f64) = (0.0, 0.0);
    for (a, b) in one.iter().zip(other) {
        for c in 0..SKETCH {
            largest = largest.max(a[c].abs());
            apart = apart.max((a[c] - b[c]).abs());
        }
    }
    apart <= ALIKE * largest
}

/// A row while others are taken out of it: what those that are kept leave of it, then what it has of them, `MOST` numbers
/// in room for more.
pub type Row = [f64; SKETCH + 8];

/// The skeleton of some contacts' rows: the largest number of the largest column that is left says which row is kept next.
/// `None` where more than `MOST` are needed, and where all rows are zero; `rows` is memory.
#[inline(always)]
pub fn skeleton<const D: usize>(
    contacts: &[u32],
    sketches: &[Sketch<D>],
    rows: &mut Vec<Row>,
) -> Option<Skeleton> {
    rows.clear();
    let mut sizes = [0.0; SKETCH];
    for &i in contacts {
        for line in &sketches[i as usize] {
            let mut row = [0.0; SKETCH + 8];
            row[..SKETCH].copy_from_slice(line);
            (0..SKETCH).for_each(|c| sizes[c] += line[c] * line[c]);
            rows.push(row);
        }
    }
    let mut kept = Vec::with_capacity(MOST);
    let first = sizes.iter().fold(0.0_f64, |m, s| m.max(*s));
    loop {
        let mut column = 0;
        for (c, size) in sizes.iter().enumerate() {
            column = if *size > sizes[column] { c } else { column };
        }
        if !(sizes[column] > RANK * RANK * first) {
            break;
        }
        if kept.len() == MOST {
            return None;
        }
        let (mut place, mut largest) = (0, 0.0);
        for (i, row) in rows.iter().enumerate() {
            let size = row[column].abs();
            (place, largest) = if size > largest { (i, size) } else { (place, largest) };
        }
        sizes = take_out(rows, place, (column, kept.len()));
        kept.push(place as u32);
    }
    if kept.is_empty() {
        return None;
    }
    let mut shares = Vec::with_capacity(rows.len() * kept.len());
    rows.iter().for_each(|row| shares.extend_from_slice(&row[SKETCH..SKETCH + kept.len()]));
    Some(Skeleton { kept, shares })
}

/// Takes one row out of the others, so that nothing is left of it and of one column; the squares of what is left of each.
#[inline(always)]
fn take_out(rows: &mut [Row], place: usize, (column, rank): (usize, usize)) -> [f64; SKETCH] {
    let mut sizes = [0.0; SKETCH];
    let kept = rows[place];
    let inverse = 1.0 / kept[column];
    for row in rows.iter_mut() {
        let share = row[column] * inverse;
        (0..SKETCH + 8).for_each(|c| row[c] -= share * kept[c]);
        row[SKETCH + rank] = share;
        row[column] = 0.0;
        (0..SKETCH).for_each(|c| sizes[c] += row[c] * row[c]);
    }
    // it was taken out of itself too, and is itself to rounding; now it is
    let own = &mut rows[place];
    *own = [0.0; SKETCH + 8];
    own[SKETCH + rank] = 1.0;
    sizes
}

#[cfg(test)]
mod tests {
    use super::super::local::tests::numbers;
    use super::*;

    /// Rows of contacts that are sums of so many.
    fn sums(count: usize, directions: usize, seed: u64) -> Vec<Sketch<3>> {
        let mut next = numbers(seed);
        let basis: Vec<[f64; SKETCH]> = (0..directions).map(|_| std::array::from_fn(|_| next())).collect();
        let mut sum = || {
            let mut row = [0.0; SKETCH];
            for (k, line) in basis.iter().enumerate() {
                // the later ones small, as arms of levers may be
                let factor = next() * 0.1_f64.powi(k as i32);
                (0..SKETCH).for_each(|c| row[c] += factor * line[c]);
            }
            row
        };
        (0..count).map(|_| [sum(), sum(), sum()]).collect()
    }

    #[test]
    fn all_rows_are_sums_of_those_that_are_kept() {
        for (seed, directions) in (0..60).map(|s| (s, 1 + s as usize % 6)) {
            let rows = sums(5, directions, seed);
            let found = skeleton(&[0, 2, 3, 4], &rows, &mut Vec::new()).expect("few directions");
            assert_eq!(found.kept.len(), directions);
            let flat: Vec<&[f64; SKETCH]> = [0, 2, 3, 4].iter().flat_map(|&i: &usize| &rows[i]).collect();
            for (row, shares) in flat.iter().zip(found.shares.chunks_exact(directions)) {
                for c in 0..SKETCH {
                    let kept = found.kept.iter().zip(shares);
                    let sum: f64 = kept.map(|(&p, share)| share * flat[p as usize][c]).sum();
                    assert!((sum - row[c]).abs() < 1e-14, "{seed}: {sum} {}", row[c]);
                }
                assert!(shares.iter().all(|share| share.abs() < 10.0), "{seed}: {shares:?}");
            }
            for (k, &place) in found.kept.iter().enumerate() {
                let own = &found.shares[place as usize * directions..][..directions];
                assert!(own.iter().enumerate().all(|(m, share)| *share == f64::from(u8::from(m == k))));
            }
        }
    }

    #[test]
    fn rows_of_zeros_that_a_file_stores_have_no_skeleton() {
        // an empty one would pass for a contact on its own
        assert!(skeleton(&[0, 1, 2], &[[[0.0; SKETCH]; 3]; 3], &mut Vec::new()).is_none());
    }

    #[test]
    fn rows_of_more_directions_have_no_skeleton() {
        assert!(skeleton(&[0, 1, 2, 3], &sums(4, 7, 3), &mut Vec::new()).is_none());
    }
}
