//! Pseudo-random numbers with a fixed seed (SplitMix64, Steele et al. 2014), so that a procedural scene has the
//! same bits on every machine and in every run.

use carom::{Quaternion, Rotation, Vec3, vec3};

/// A stream of numbers; equal seeds give equal streams.
pub struct Chance {
    state: u64,
}

impl Chance {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Chance { state: seed }
    }
    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// A number in \[low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }
    /// A direction, uniform on the sphere: a point of the ball, by rejection from the cube.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let [x, y, z] = [(); 3].map(|()| self.between(-1.0, 1.0));
            let length = (x * x + y * y + z * z).sqrt();
            if (0.1..=1.0).contains(&length) {
                return vec3(x / length, y / length, z / length);
            }
        }
    }
    /// An orientation, uniform over all: a point of the four-dimensional ball, by rejection from the cube.
    pub fn orientation(&mut self) -> Quaternion {
        loop {
            let q = Quaternion([(); 4].map(|()| self.between(-1.0, 1.0)));
            let length: f64 = q.0.iter().map(|x| x * x).sum::<f64>().sqrt();
            if let Some(q) = q.renormalized().filter(|_| (0.1..=1.0).contains(&length)) {
                return q;
            }
        }
    }
}
