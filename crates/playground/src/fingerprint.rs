//! One number for the moving state of a world: FNV-1a over the bits of positions, rotations, velocities and angular
//! velocities, array by array, number by number. Equal fingerprints mean equal bits, but for one chance in 2^64.

use carom::{Column, Geometry, Rotation, World};

/// Start and factor of FNV-1a with 64 bits.
const BEGIN: u64 = 0xcbf2_9ce4_8422_2325;
const FACTOR: u64 = 0x0000_0100_0000_01b3;

/// The fingerprint of a world's motion.
pub fn of<S: Geometry>(world: &World<S>) -> u64 {
    let motion = &world.bodies().motion;
    let mut found = BEGIN;
    let mut add = |values: &[f64]| {
        for value in values {
            found = (found ^ value.to_bits()).wrapping_mul(FACTOR);
        }
    };
    motion.position.iter().for_each(|v| add(v.as_slice()));
    motion.rotation.iter().for_each(|v| add(v.as_slice()));
    motion.velocity.iter().for_each(|v| add(v.as_slice()));
    motion.angular_velocity.iter().for_each(|v| add(v.as_slice()));
    found
}
