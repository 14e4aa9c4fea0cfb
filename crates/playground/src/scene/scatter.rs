//! Disorder of a body's copies: `scatter`. Its numbers are those that Python's loader draws from numpy, so that a file
//! means the same scene here and there: PCG64 (M. E. O'Neill, PCG: A Family of Simple Fast Space-Efficient
//! Statistically Good Algorithms, 2014: 128-bit state, XSL-RR output), its state spread from the file's seed and the
//! CRC-32 of the body's name by numpy's `SeedSequence`.

use super::fields::Fields;
use super::rotation::{Turned, axis_angle, product};
use serde_json::Value;
use std::f64::consts::PI;

/// Disorder of the copies of one body, drawn copy after copy.
pub struct Scatter {
    reach: Vec<f64>,
    most: f64,
    generator: Pcg64,
}

impl Scatter {
    /// Reads a body's `scatter`.
    ///
    /// # Errors
    /// When it is not what it must be; `of` begins the message.
    pub fn read(name: &str, value: Value, dimension: usize, of: &str) -> Result<Self, String> {
        let mut fields = Fields::new(format!("{of}: scatter"), value)?;
        let reach = fields.take::<Vec<f64>>("position")?.unwrap_or_else(|| vec![0.0; dimension]);
        let most = fields.take::<f64>("rotation")?.unwrap_or(0.0);
        let seed = fields.take::<u64>("seed")?.unwrap_or(0);
        if reach.len() != dimension || reach.iter().any(|d| !(*d >= 0.0 && d.is_finite())) {
            return Err(fields.wrong("position", format!("needs {dimension} finite numbers >= 0, in m")));
        }
        if !(most >= 0.0 && most.is_finite()) {
            return Err(fields.wrong("rotation", format!("must be finite and >= 0, got {most}; give rad")));
        }
        fields.finish()?;
        Ok(Scatter { reach, most, generator: Pcg64::of(&[seed, u64::from(crc32(name.as_bytes()))]) })
    }

    /// By how much the next copy is displaced \[m\], and its rotation in place of `rotation`.
    pub fn draw(&mut self, rotation: Option<Turned>) -> (Vec<f64>, Option<Turned>) {
        let Scatter { reach, most, generator } = self;
        let by = reach.iter().map(|d| d * generator.uniform(-1.0, 1.0)).collect();
        if *most == 0.0 {
            return (by, rotation);
        }
        let angle = generator.uniform(-*most, *most);
        if reach.len() == 2 {
            let before = if let Some(Turned::Angle(before)) = rotation { before } else { 0.0 };
            return (by, Some(Turned::Angle(angle + before)));
        }
        let (height, around) = (generator.uniform(-1.0, 1.0), generator.uniform(0.0, 2.0 * PI));
        let radius = (1.0 - height * height).sqrt();
        let drawn = axis_angle([radius * libm::cos(around), radius * libm::sin(around), height], angle);
        let turned = match rotation {
            Some(Turned::Quaternion(before)) => product(drawn, before),
            _ => drawn,
        };
        (by, Some(Turned::Quaternion(turned)))
    }
}

/// A generator of 64 bits over a state of 128.
struct Pcg64 {
    state: u128,
    increment: u128,
}

impl Pcg64 {
    const MULTIPLIER: u128 = 0x2360_ed05_1fc6_5da4_4385_df64_9fcc_f645;

    fn of(seeds: &[u64]) -> Self {
        let [a, b, c, d] = spread(seeds);
        let wide = |high: u64, low: u64| (u128::from(high) << 64) | u128::from(low);
        let mut made = Pcg64 { state: 0, increment: (wide(c, d) << 1) | 1 };
        made.advance();
        made.state = made.state.wrapping_add(wide(a, b));
        made.advance();
        made
    }
    fn advance(&mut self) {
        self.state = self.state.wrapping_mul(Self::MULTIPLIER).wrapping_add(self.increment);
    }
    fn next(&mut self) -> u64 {
        self.advance();
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        folded.rotate_right((self.state >> 122) as u32)
    }
    /// Even between two numbers, 53 bits of it.
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 * (1.0 / (1u64 << 53) as f64))
    }
}

/// One of the two hashes of `SeedSequence`: its constant runs on from number to number.
struct Hash {
    constant: u32,
    multiplier: u32,
}

impl Hash {
    fn of(&mut self, number: u32) -> u32 {
        let mixed = number ^ self.constant;
        self.constant = self.constant.wrapping_mul(self.multiplier);
        let mixed = mixed.wrapping_mul(self.constant);
        mixed ^ (mixed >> 16)
    }
}

/// Four numbers from some seeds, as numpy's `SeedSequence` makes them.
fn spread(seeds: &[u64]) -> [u64; 4] {
    let mut entropy = Vec::new();
    for seed in seeds {
        entropy.push(*seed as u32);
        if *seed >> 32 != 0 {
            entropy.push((*seed >> 32) as u32);
        }
    }
    let mut hash = Hash { constant: 0x43b0_d7e5, multiplier: 0x931e_8875 };
    let mix = |x: u32, y: u32| {
        let mixed = 0xca01_f9dd_u32.wrapping_mul(x).wrapping_sub(0x4973_f715_u32.wrapping_mul(y));
        mixed ^ (mixed >> 16)
    };
    let mut pool = [0; 4];
    for (k, to) in pool.iter_mut().enumerate() {
        *to = hash.of(entropy.get(k).copied().unwrap_or(0));
    }
    for from in 0..4 {
        for to in (0..4).filter(|to| *to != from) {
            pool[to] = mix(pool[to], hash.of(pool[from]));
        }
    }
    for number in entropy.iter().skip(4) {
        for to in &mut pool {
            *to = mix(*to, hash.of(*number));
        }
    }
    let mut hash = Hash { constant: 0x8b51_f9dd, multiplier: 0x58f3_8ded };
    std::array::from_fn(|k| {
        let mut half = |place: usize| u64::from(hash.of(pool[place % 4]));
        half(2 * k) | (half(2 * k + 1) << 32)
    })
}

/// The checksum of zip files and PNG pictures (ISO 3309, reflected).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg()))
    })
}
