//! Names of the points in which the faces of two boxes overlap: of every pair of faces a number for every corner of either and
//! every crossing of their sides, made once when the program is. Knows no places.

use crate::kernel::{NONE, code_of, mix};

/// Corners of the face that is cut; then those of the face that cuts, then crossings.
pub const CORNERS: usize = 4;
/// Where crossings begin; of each edge of the face that is cut with each side of the other in turn.
pub const CROSSINGS: usize = 2 * CORNERS;
/// All of them.
pub const NAMES: usize = CROSSINGS + 16;

/// Corners at the ends of the edges of a face, along the first axis that follows the face's and then along the second. Corners go
/// round from below the middle along both, and then along the first axis.
pub const EDGES: [[usize; 2]; 4] = [[0, 1], [3, 2], [0, 3], [1, 2]];
/// The corners of the face that cuts that bound each of its sides: above and below along its first axis, and along its second.
const SIDES: [[usize; 2]; 4] = [[1, 2], [0, 3], [3, 2], [0, 1]];

/// Whether a corner is above the middle along the first axis, and along the second.
pub const fn is_above(k: usize) -> [bool; 2] {
    [(k + 1) & 2 == 2, k & 2 == 2]
}

/// Names by the box that cuts (b, a), its face and the face that is cut, which are numbered by twice their axis, and one more below.
static ALL: [[[u64; NAMES]; 36]; 2] = all();

/// The names of the points of two faces, by six times the number of the one that cuts and that of the other.
#[inline]
pub fn names(knife_is_a: bool, faces: usize) -> &'static [u64; NAMES] {
    &ALL[usize::from(knife_is_a)][faces % 36]
}

/// The number of a corner of a face among those of its box.
const fn corner(face: usize, k: usize) -> u32 {
    let (axis, above) = (face / 2, 1 - face % 2);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let [x, y] = is_above(k);
    (above << axis | (x as usize) << u | (y as usize) << v) as u32
}

const fn name(knife_is_a: bool, of_knife: [u32; 2], of_cut: [u32; 2]) -> u64 {
    let code = if knife_is_a { code_of(of_knife, of_cut) } else { code_of(of_cut, of_knife) };
    mix(mix(0, 0), code)
}

const fn of_faces(knife_is_a: bool, knife: usize, cut: usize) -> [u64; NAMES] {
    let mut names = [0; NAMES];
    let mut k = 0;
    while k < CORNERS {
        names[k] = name(knife_is_a, [NONE, NONE], [corner(cut, k), NONE]);
        names[CORNERS + k] = name(knife_is_a, [corner(knife, k), NONE], [NONE, NONE]);
        let mut side = 0;
        while side < 4 {
            let (p, q) = (EDGES[k], SIDES[side]);
            let of_cut = [corner(cut, p[0]), corner(cut, p[1])];
            let of_knife = [corner(knife, q[0]), corner(knife, q[1])];
            names[CROSSINGS + 4 * k + side] = name(knife_is_a, of_knife, of_cut);
            side += 1;
        }
        k += 1;
    }
    names
}

const fn all() -> [[[u64; NAMES]; 36]; 2] {
    let mut all = [[[0; NAMES]; 36]; 2];
    let mut n = 0;
    while n < 72 {
        all[n / 36][n % 36] = of_faces(n / 36 == 1, n / 6 % 6, n % 6);
        n += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::Polytope;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_points_of_two_boxes_have_one_name_but_by_the_same_features() {
        let mut all = BTreeSet::new();
        for faces in 0..36 {
            let own: BTreeSet<u64> = names(true, faces).iter().copied().collect();
            assert_eq!(own.len(), NAMES);
            all.extend(own);
        }
        // corners of either, and edges of either crossing each other
        assert_eq!(all.len(), 8 + 8 + 12 * 12);
    }

    #[test]
    fn corners_are_those_of_a_box() {
        let cuboid = Polytope::cuboid([1.0, 2.0, 3.0]);
        for face in 0..6 {
            let mut own: Vec<u32> = (0..4).map(|k| corner(face, k)).collect();
            own.sort_unstable();
            let mut ring = cuboid.view().ring(face).to_vec();
            ring.sort_unstable();
            assert_eq!(own, ring);
        }
    }
}
