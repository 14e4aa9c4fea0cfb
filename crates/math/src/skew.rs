//! Skew maps: the matrix \[w\]x with \[w\]x r = w x r, in both dimensions (theory chapter 1, item 5).

use crate::tuple::{Vec2, Vec3};

/// \[w\]x in the plane, row by row: \[\[0, -w\], \[w, 0\]\].
pub fn skew_planar(w: f64) -> [[f64; 2]; 2] {
    [[0.0, -w], [w, 0.0]]
}
/// \[w\]x in space, row by row.
pub fn skew_spatial(w: Vec3) -> [[f64; 3]; 3] {
    let [x, y, z] = w.0;
    [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
}
/// w x r in the plane for a spin w: w (-r_y, r_x).
pub fn cross_planar(w: f64, r: Vec2) -> Vec2 {
    r.perp() * w
}
