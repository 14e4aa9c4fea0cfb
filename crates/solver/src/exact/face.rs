//! Where the impulses of one contact may lie once its velocity is known: nowhere but at zero where it leaves, on a ray
//! against the slip where it slides, anywhere in the cone where it rests. Projection on that set, and its derivative.

use crate::friction_problem::project_on_cone;

/// A convex set of impulses of one contact.
pub trait Nearest<const D: usize> {
    /// The derivative of the projection inside the set: where a search begins.
    fn inside(&self) -> [[f64; D]; D];
    /// The nearest point of the set, and the derivative there.
    fn project(&self, z: &[f64; D]) -> Projected<D>;
}

/// The impulses that a contact's velocity allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face<const D: usize> {
    /// It leaves: none.
    Open,
    /// It slides, or has no friction: this direction, of length 1.
    Ray([f64; D]),
    /// It rests: |r_T| <= mu r_N with this mu.
    Cone(f64),
}

/// P and its derivative at a point.
pub type Projected<const D: usize> = ([f64; D], [[f64; D]; D]);

impl<const D: usize> Face<D> {
    /// The face of a contact with velocity `u` and impulse `r`; speeds up to `rest` count as none.
    pub fn of(u: &[f64; D], r: &[f64; D], friction: f64, rest: f64) -> Self {
        let length = |v: &[f64; D]| v[1..].iter().map(|x| x * x).sum::<f64>().sqrt();
        if u[0] > rest {
            return Face::Open;
        }
        if friction == 0.0 || D == 1 {
            return Face::Ray(std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 }));
        }
        let slip = length(u);
        if slip <= rest {
            return Face::Cone(friction);
        }
        // the impulse knows its direction better than a slow slip does
        let pulled = length(r);
        let (along, size) = if pulled > 0.0 { (r, pulled) } else { (u, -slip) };
        let norm = (1.0 + friction * friction).sqrt();
        Face::Ray(std::array::from_fn(|k| if k == 0 { 1.0 } else { friction * along[k] / size } / norm))
    }

    /// On the cone's surface P' has 1 along the surface's line below z, mu r_N / |z_T| across, and 0 outwards.
    fn project_on_cone(&self, z: &[f64; D], friction: f64) -> Projected<D> {
        let mut nearest = *z;
        project_on_cone(&mut nearest, friction);
        if nearest == *z {
            return (nearest, self.inside());
        }
        if nearest[0] == 0.0 {
            return (nearest, [[0.0; D]; D]);
        }
        let size = z[1..].iter().map(|x| x * x).sum::<f64>().sqrt();
        let norm = (1.0 + friction * friction).sqrt();
        let line: [f64; D] =
            std::array::from_fn(|k| if k == 0 { 1.0 } else { friction * z[k] / size } / norm);
        let mut derivative = outer(&line, &line);
        let across = friction * nearest[0] / size;
        for i in 1..D {
            for j in 1..D {
                let own = if i == j { 1.0 } else { 0.0 };
                derivative[i][j] += across * (own - z[i] * z[j] / (size * size));
            }
        }
        (nearest, derivative)
    }
}

impl<const D: usize> Nearest<D> for Face<D> {
    fn inside(&self) -> [[f64; D]; D] {
        match self {
            Face::Open => [[0.0; D]; D],
            Face::Ray(direction) => outer(direction, direction),
            Face::Cone(_) => std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 })),
        }
    }

    fn project(&self, z: &[f64; D]) -> Projected<D> {
        match self {
            Face::Open => ([0.0; D], [[0.0; D]; D]),
            Face::Ray(direction) => {
                let length: f64 = direction.iter().zip(z).map(|(d, z)| d * z).sum();
                if length <= 0.0 {
                    return ([0.0; D], [[0.0; D]; D]);
                }
                (direction.map(|d| length * d), self.inside())
            }
            Face::Cone(friction) => self.project_on_cone(z, *friction),
        }
    }
}

fn outer<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [[f64; D]; D] {
    a.map(|a| b.map(|b| a * b))
}
