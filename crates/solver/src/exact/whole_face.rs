//! Where all that one contact or row holds may lie once its velocity is known: the normal impulse n, friction and moments
//! each on a ray against its slip (tied to n) or within a multiple of n where it rests; a bounded row at a bound or
//! between both. Projection on that set, and its derivative.

use super::face::{Nearest, Projected};
use super::system::Block;

/// Consecutive components that are together no longer than `limit` n.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Part {
    /// First component.
    pub first: usize,
    /// Number of components; none where the part is not used.
    pub count: usize,
    /// Largest length per normal impulse.
    pub limit: f64,
}

/// What presses: n times a direction, and parts that rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed<const D: usize> {
    /// Components per normal impulse; the first is 1.
    pub along: [f64; D],
    /// Friction by component, rolling and spinning.
    pub parts: [Part; 4],
    /// Least normal impulse, 0 or above.
    pub least: f64,
}

/// The impulses that the velocities of a contact or a row allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WholeFace<const D: usize> {
    /// None.
    Open,
    /// The first component, between two numbers.
    Between(f64, f64),
    /// A contact that presses.
    Pressed(Pressed<D>),
}

impl<const D: usize> Nearest<D> for WholeFace<D> {
    fn inside(&self) -> Block<D> {
        let mut inside = [[0.0; D]; D];
        match self {
            WholeFace::Open => {}
            WholeFace::Between(..) => inside[0][0] = 1.0,
            WholeFace::Pressed(pressed) => {
                add_outer(&mut inside, &pressed.along, 1.0 / square(&pressed.along));
                let resting = pressed.parts.iter().flat_map(|p| p.first..p.first + p.count);
                resting.for_each(|k| inside[k][k] = 1.0);
            }
        }
        inside
    }

    fn project(&self, z: &[f64; D]) -> Projected<D> {
        let (mut nearest, mut slope) = ([0.0; D], [[0.0; D]; D]);
        match self {
            WholeFace::Open => {}
            WholeFace::Between(low, high) => {
                nearest[0] = z[0].max(*low).min(*high);
                slope[0][0] = if z[0] > *low && z[0] < *high { 1.0 } else { 0.0 };
            }
            WholeFace::Pressed(pressed) => return pressed.project(z),
        }
        (nearest, slope)
    }
}

impl<const D: usize> Pressed<D> {
    /// With n known every part is shortened to its limit; n is the least point of
    /// |n along - z|^2 / 2 + sum over the parts beyond it of (|z_p| - limit n)^2 / 2.
    fn project(&self, z: &[f64; D]) -> Projected<D> {
        let size = |p: &Part| z[p.first..p.first + p.count].iter().map(|z| z * z).sum::<f64>().sqrt();
        let mut sizes = self.parts.map(|p| (size(&p), p));
        // size / limit in falling order, without dividing by a limit of zero
        sizes.sort_unstable_by(|(s, p), (t, q)| (t * p.limit).total_cmp(&(s * q.limit)));
        let mut sum: f64 = self.along.iter().zip(z).map(|(a, z)| a * z).sum();
        let mut weight = square(&self.along);
        for (size, p) in sizes.iter().filter(|(_, p)| p.count > 0) {
            if *size <= p.limit * sum / weight {
                break;
            }
            sum += p.limit * size;
            weight += p.limit * p.limit;
        }
        let free = sum / weight;
        let normal = free.max(self.least);
        let mut nearest = self.along.map(|a| a * normal);
        let (mut slope, mut line) = ([[0.0; D]; D], self.along);
        for (size, p) in sizes.iter().filter(|(_, p)| p.count > 0) {
            let own = p.first..p.first + p.count;
            if *size <= p.limit * normal {
                own.for_each(|k| (nearest[k], slope[k][k]) = (z[k], 1.0));
                continue;
            }
            let share = p.limit * normal / size;
            for k in own.clone() {
                nearest[k] = share * z[k];
                line[k] = p.limit * z[k] / size;
                own.clone().for_each(|j| slope[k][j] -= share * z[k] * z[j] / (size * size));
                slope[k][k] += share;
            }
        }
        if free > self.least {
            add_outer(&mut slope, &line, 1.0 / square(&line));
        }
        (nearest, slope)
    }
}

fn square<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|v| v * v).sum()
}

/// m += factor v v^T.
fn add_outer<const D: usize>(m: &mut Block<D>, v: &[f64; D], factor: f64) {
    for (row, a) in m.iter_mut().zip(v) {
        row.iter_mut().zip(v).for_each(|(m, b)| *m += factor * a * b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACE: WholeFace<6> = WholeFace::Pressed(Pressed {
        along: [1.0, 0.3, -0.4, 0.0, 0.0, 0.0],
        parts: [
            Part { first: 3, count: 1, limit: 0.2 },
            Part { first: 4, count: 2, limit: 0.1 },
            Part { first: 0, count: 0, limit: 0.0 },
            Part { first: 0, count: 0, limit: 0.0 },
        ],
        least: 0.5,
    });

    fn points() -> impl Iterator<Item = [f64; 6]> {
        (1..400).map(|k| std::array::from_fn(|i| 4.0 * ((k * 7 + i * 13) as f64 * 0.618_034).fract() - 2.0))
    }

    #[test]
    fn a_projection_is_nearer_than_all_others() {
        let all: Vec<[f64; 6]> = points().map(|z| FACE.project(&z).0).collect();
        for (z, p) in points().zip(&all) {
            for x in &all {
                let apart: f64 = (0..6).map(|k| (z[k] - p[k]) * (x[k] - p[k])).sum();
                assert!(apart <= 1e-12, "{z:?}: {x:?} is nearer than {p:?}");
            }
        }
    }

    #[test]
    fn the_derivative_is_that_of_differences() {
        let step = 1e-7;
        for z in points() {
            let (nearest, slope) = FACE.project(&z);
            for j in 0..6 {
                let mut moved = z;
                moved[j] += step;
                let other = FACE.project(&moved).0;
                for k in 0..6 {
                    let off = (other[k] - nearest[k]) / step - slope[k][j];
                    assert!(off.abs() < 1e-4, "{z:?}: entry {k}, {j} is off by {off}");
                }
            }
        }
    }
}
