//! Flat-faced convex cores of space: points, edges, faces with outward normals and rings of corners in
//! counter-clockwise order seen from outside. Built from a hull's triangles (coplanar ones are joined), from a
//! box or from one triangle. Knows no poses and no contacts.

use crate::columns::Columns;
use crate::planes::Planes;
use carom_math::lanes::Lanes;
use carom_math::{Column, Vec3, vec3};

/// Corners of neighbouring triangles within this fraction of the polytope's size of a plane share a face \[1\].
const COPLANAR: f64 = 1e-10;

/// A face: where its ring of corners stands and its plane normal.x = offset.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Outward unit normal.
    pub normal: Vec3,
    /// Largest n.x over the polytope \[m\].
    pub offset: f64,
    /// First entry in the ring array.
    pub first: u32,
    /// Number of corners.
    pub count: u32,
}

/// A convex polytope.
#[derive(Clone, Debug)]
pub struct Polytope {
    /// Corners \[m\].
    pub points: Vec<Vec3>,
    /// Faces.
    pub faces: Vec<Face>,
    /// Corner indices of all faces, one ring after the other.
    pub rings: Vec<u32>,
    /// Edges, smaller corner first.
    pub edges: Vec<[u32; 2]>,
    /// Normals of the two faces at each edge.
    pub arcs: Vec<[Vec3; 2]>,
    /// A point inside \[m\].
    pub center: Vec3,
    /// Largest distance of a corner from the frame's origin \[m\].
    pub size: f64,
    /// Half side lengths when this is a box about the origin; speeds up supports.
    pub half: Option<Vec3>,
    /// The corners and the faces' normals once more, to look for the farthest.
    columns: [Columns; 2],
    /// The faces' planes once more, to look for the best.
    planes: Planes,
    /// From the first to the second corner of each edge \[m\].
    spans: Vec<Vec3>,
    /// Edges at each corner, bit by bit, where corners are few enough.
    spokes: Vec<EdgeSet>,
}

/// A set of edges by number, bit by bit.
pub type EdgeSet = [u64; 3];

/// Borrowed polytope, also for the cores that own no arrays.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Corners \[m\].
    pub points: &'a [Vec3],
    /// Faces; none for points and segments, both sides for a triangle.
    pub faces: &'a [Face],
    /// Corner indices of all faces.
    pub rings: &'a [u32],
    /// Edges.
    pub edges: &'a [[u32; 2]],
    /// Normals of the two faces at each edge; none where edges have no two faces that bound a volume.
    pub arcs: &'a [[Vec3; 2]],
    /// A point inside \[m\].
    pub center: Vec3,
    /// Half side lengths of a box about the origin.
    pub half: Option<Vec3>,
    /// Columns of the corners and of the faces' normals, where they are many.
    pub columns: Option<&'a [Columns; 2]>,
    /// Planes of the faces, where they are many.
    pub planes: Option<&'a Planes>,
    /// Spans of the edges, of solids \[m\].
    pub spans: &'a [Vec3],
    /// Edges at each corner, where they are not too many.
    pub spokes: &'a [EdgeSet],
}

/// The edges at each corner of a triangle.
pub const TRIANGLE_SPOKES: [EdgeSet; 3] = [[0b101, 0, 0], [0b011, 0, 0], [0b110, 0, 0]];

/// Rings of the two sides of a triangle.
pub const TRIANGLE_RINGS: [u32; 6] = [0, 1, 2, 2, 1, 0];
/// Edges of a triangle.
pub const TRIANGLE_EDGES: [[u32; 2]; 3] = [[0, 1], [1, 2], [0, 2]];
/// The edge of a segment.
pub const SEGMENT_EDGE: [[u32; 2]; 1] = [[0, 1]];

impl<'a> View<'a> {
    /// Farthest corner along a direction, and its index.
    #[inline]
    pub fn support(&self, direction: Vec3) -> (Vec3, u32) {
        if let Some(half) = self.half {
            return support_of_box(half, direction);
        }
        if let Some([points, _]) = self.columns {
            let (index, _) = points.farthest(direction);
            return (self.points[index], index as u32);
        }
        let mut best = (0, direction.dot(self.points[0]));
        for (i, p) in self.points.iter().enumerate().skip(1) {
            let along = direction.dot(*p);
            if along > best.1 {
                best = (i, along);
            }
        }
        (self.points[best.0], best.0 as u32)
    }
    /// The same with this machine's instructions, without the index.
    #[inline(always)]
    pub fn farthest<L: Lanes>(&self, lanes: L, direction: Vec3) -> Vec3 {
        if let Some(half) = self.half {
            return Vec3::from_fn(|k| if direction[k] >= 0.0 { half[k] } else { -half[k] });
        }
        if let Some([points, _]) = self.columns {
            return self.points[points.farthest_in(lanes, direction)];
        }
        let mut best = (self.points[0], direction.dot(self.points[0]));
        for p in &self.points[1..] {
            let along = direction.dot(*p);
            if along > best.1 {
                best = (*p, along);
            }
        }
        best.0
    }
    /// Face whose normal leans most along a direction, with the cosine times the direction's length.
    #[inline]
    pub fn face_toward(&self, direction: Vec3) -> Option<(usize, f64)> {
        if self.half.is_some() {
            let [x, y, z] = direction.0;
            let mut best = (0, x);
            for (face, along) in [(1, -x), (2, y), (3, -y), (4, z), (5, -z)] {
                if along > best.1 {
                    best = (face, along);
                }
            }
            return Some(best);
        }
        if let Some([_, normals]) = self.columns {
            return Some(normals.farthest(direction));
        }
        let mut best: Option<(usize, f64)> = None;
        for (i, face) in self.faces.iter().enumerate() {
            let along = face.normal.dot(direction);
            if best.is_none_or(|b| along > b.1) {
                best = Some((i, along));
            }
        }
        best
    }
    /// Directions of the edges, parallel ones of a box once.
    pub fn directions(&self) -> impl Iterator<Item = Vec3> + 'a {
        let (points, count) = (self.points, if self.half.is_some() { 0 } else { self.edges.len() });
        let axes = if self.half.is_some() { 3 } else { 0 };
        let edge = move |e: &[u32; 2]| points[e[1] as usize] - points[e[0] as usize];
        let axis = |k: usize| Vec3::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        self.edges[..count].iter().map(edge).chain((0..axes).map(axis))
    }
    /// The direction out across an edge of a triangle, in its plane and of any length; `None` of other cores.
    #[inline]
    pub fn out_across(&self, edge: usize) -> Option<Vec3> {
        if self.faces.len() != 2 {
            return None;
        }
        let [p, q] = self.edges[edge].map(|i| self.points[i as usize]);
        let out = (q - p).cross(self.faces[0].normal);
        let inward = out.dot(self.center - p) > 0.0;
        Some(if inward { -out } else { out })
    }
    /// Corner indices of a face.
    pub fn ring(&self, face: usize) -> &'a [u32] {
        let Face { first, count, .. } = self.faces[face];
        &self.rings[first as usize..(first + count) as usize]
    }
}

/// Corner of a box about the origin that is farthest along a direction, and its number.
#[inline]
fn support_of_box(half: Vec3, direction: Vec3) -> (Vec3, u32) {
    let bit = |k: usize| u32::from(direction[k] >= 0.0);
    let index = bit(0) | bit(1) << 1 | bit(2) << 2;
    (Vec3::from_fn(|k| if direction[k] >= 0.0 { half[k] } else { -half[k] }), index)
}

impl Polytope {
    /// Farthest corner along a direction, and its index.
    #[inline]
    pub fn support(&self, direction: Vec3) -> (Vec3, u32) {
        if let Some(half) = self.half {
            return support_of_box(half, direction);
        }
        let (index, _) = self.columns[0].farthest(direction);
        (self.points[index], index as u32)
    }
    /// Least and most of the corners along each of three directions, of what is no box \[m\].
    #[inline]
    pub fn spans(&self, directions: &[[f64; 3]; 3]) -> [[f64; 2]; 3] {
        self.columns[0].spans(directions)
    }
    /// As a borrowed polytope.
    #[inline]
    pub fn view(&self) -> View<'_> {
        View {
            points: &self.points,
            faces: &self.faces,
            rings: &self.rings,
            edges: &self.edges,
            arcs: &self.arcs,
            center: self.center,
            half: self.half,
            columns: self.half.is_none().then_some(&self.columns),
            planes: self.half.is_none().then_some(&self.planes),
            spans: &self.spans,
            spokes: &self.spokes,
        }
    }
    /// A box about the origin; corner k has the signs of k's bits.
    pub fn cuboid(half: [f64; 3]) -> Self {
        let sign = |k: usize, bit: usize| if k >> bit & 1 == 1 { half[bit] } else { -half[bit] };
        let points: Vec<Vec3> = (0..8).map(|k| vec3(sign(k, 0), sign(k, 1), sign(k, 2))).collect();
        let rings: Vec<u32> =
            [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]].concat();
        let face = |i: usize| {
            let axis = i / 2;
            let sign = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
            let normal = Vec3::from_fn(|k| if k == axis { sign } else { 0.0 });
            Face { normal, offset: half[axis], first: 4 * i as u32, count: 4 }
        };
        let (half, size) = (vec3(half[0], half[1], half[2]), points[0].norm());
        let faces: Vec<Face> = (0..6).map(face).collect();
        let (edges, arcs) = edges_of(&faces, &rings);
        let (spans, spokes) = spans_and_spokes(&points, &edges);
        Polytope {
            spans,
            spokes,
            planes: Planes::default(),
            points,
            faces,
            rings,
            edges,
            arcs,
            center: Vec3::ZERO,
            size,
            half: Some(half),
            columns: Default::default(),
        }
    }
    /// A polytope from the corners and outward triangles of a convex hull.
    pub fn from_hull(points: Vec<Vec3>, triangles: &[[u32; 3]]) -> Self {
        let width = points.iter().fold(0.0, |m: f64, p| m.max((*p - points[0]).max_abs()));
        let patches = coplanar_patches(&points, triangles, COPLANAR * width);
        let (mut faces, mut rings) = (Vec::new(), Vec::new());
        for patch in &patches {
            let ring = outline(patch, triangles);
            let normal = ring_normal(&points, &ring);
            let offset = points.iter().fold(f64::NEG_INFINITY, |m, p| m.max(normal.dot(*p)));
            faces.push(Face { normal, offset, first: rings.len() as u32, count: ring.len() as u32 });
            rings.extend(ring);
        }
        let (edges, arcs) = edges_of(&faces, &rings);
        let center = points.iter().fold(Vec3::ZERO, |s, p| s + *p * (1.0 / points.len() as f64));
        let size = points.iter().fold(0.0, |m: f64, p| m.max(p.norm()));
        let columns = [Columns::of(points.iter().copied()), Columns::of(faces.iter().map(|f| f.normal))];
        let planes = Planes::of(faces.iter().map(|f| (f.normal, f.offset)));
        let (spans, spokes) = spans_and_spokes(&points, &edges);
        Polytope {
            points,
            faces,
            rings,
            edges,
            arcs,
            center,
            size,
            half: None,
            columns,
            planes,
            spans,
            spokes,
        }
    }
}

/// Both sides of a triangle; the first has the counter-clockwise ring.
pub fn triangle_faces(corners: &[Vec3; 3]) -> [Face; 2] {
    let normal = triangle_normal(corners);
    let offset = normal.dot(corners[0]);
    [
        Face { normal, offset, first: 0, count: 3 },
        Face { normal: -normal, offset: -offset, first: 3, count: 3 },
    ]
}

/// Unit normal of a triangle, counter-clockwise side.
pub fn triangle_normal(corners: &[Vec3]) -> Vec3 {
    let product = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    product.normalized().unwrap_or(vec3(0.0, 0.0, 1.0))
}

/// Sorted, distinct edges of all rings, and the normals of the faces on their two sides, right and left of the way from
/// the smaller corner to the larger: left x right points along it.
fn edges_of(faces: &[Face], rings: &[u32]) -> (Vec<[u32; 2]>, Vec<[Vec3; 2]>) {
    let mut sides: Vec<([u32; 2], bool, Vec3)> = Vec::new();
    for face in faces {
        let ring = &rings[face.first as usize..(face.first + face.count) as usize];
        for k in 0..ring.len() {
            let (u, v) = (ring[k], ring[(k + 1) % ring.len()]);
            sides.push(([u.min(v), u.max(v)], u < v, face.normal));
        }
    }
    // of the two at an edge the face to the right of it first
    sides.sort_by_key(|s| (s.0, s.1));
    let groups = || sides.chunk_by(|s, t| s.0 == t.0);
    (groups().map(|g| g[0].0).collect(), groups().map(|g| [g[0].2, g[g.len() - 1].2]).collect())
}

/// The span of each edge, and the edges at each corner where they fit into a set.
fn spans_and_spokes(points: &[Vec3], edges: &[[u32; 2]]) -> (Vec<Vec3>, Vec<EdgeSet>) {
    let spans = edges.iter().map(|e| points[e[1] as usize] - points[e[0] as usize]).collect();
    if points.len() > 64 || edges.len() > 192 {
        return (spans, Vec::new());
    }
    let mut spokes = vec![EdgeSet::default(); points.len()];
    for (k, e) in edges.iter().enumerate() {
        e.iter().for_each(|i| spokes[*i as usize][k / 64] |= 1 << (k % 64));
    }
    (spans, spokes)
}

/// Triangles gathered into faces: from the largest triangle outwards, neighbours join while their corners stay
/// within `slack` \[m\] of its plane.
fn coplanar_patches(points: &[Vec3], triangles: &[[u32; 3]], slack: f64) -> Vec<Vec<usize>> {
    let corner = |t: usize, k: usize| points[triangles[t][k % 3] as usize];
    let area = |t: usize| (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
    let mut sides: Vec<([u32; 2], usize)> = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in triangles.iter().enumerate() {
        sides.extend((0..3).map(|k| ([triangle[k], triangle[(k + 1) % 3]], t)));
    }
    sides.sort_unstable();
    let across = |u: u32, v: u32| sides.binary_search_by(|s| s.0.cmp(&[v, u])).ok().map(|i| sides[i].1);
    let mut order: Vec<usize> = (0..triangles.len()).collect();
    order.sort_by(|&s, &t| area(t).total_cmp(&area(s)).then(s.cmp(&t)));
    let mut taken = vec![false; triangles.len()];
    let mut patches = Vec::new();
    for seed in order {
        if taken[seed] {
            continue;
        }
        taken[seed] = true;
        let normal = triangle_normal(&[corner(seed, 0), corner(seed, 1), corner(seed, 2)]);
        let mut patch = vec![seed];
        let mut next = 0;
        while next < patch.len() {
            let t = patch[next];
            next += 1;
            for k in 0..3 {
                let neighbour = across(triangles[t][k], triangles[t][(k + 1) % 3]);
                let flush =
                    |n: usize| (0..3).all(|k| normal.dot(corner(n, k) - corner(seed, 0)).abs() <= slack);
                if let Some(n) = neighbour.filter(|&n| !taken[n] && flush(n)) {
                    taken[n] = true;
                    patch.push(n);
                }
            }
        }
        patches.push(patch);
    }
    patches
}

/// Outline of a patch of triangles, counter-clockwise.
fn outline(patch: &[usize], triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut sides: Vec<[u32; 2]> = Vec::new();
    for &t in patch {
        sides.extend((0..3).map(|k| [triangles[t][k], triangles[t][(k + 1) % 3]]));
    }
    sides.sort_unstable();
    let inner = |s: &[u32; 2]| sides.binary_search(&[s[1], s[0]]).is_ok();
    let rim: Vec<[u32; 2]> = sides.iter().filter(|s| !inner(s)).copied().collect();
    let mut ring = vec![rim[0][0]];
    let mut at = rim[0][1];
    while at != ring[0] && ring.len() < rim.len() {
        ring.push(at);
        match rim.binary_search_by(|s| s[0].cmp(&at)) {
            Ok(next) => at = rim[next][1],
            Err(_) => break,
        }
    }
    ring
}

/// Area-weighted normal of a ring (Newell's formula about its first corner).
fn ring_normal(points: &[Vec3], ring: &[u32]) -> Vec3 {
    let at = |k: usize| points[ring[k % ring.len()] as usize] - points[ring[0] as usize];
    let sum = (1..ring.len() - 1).fold(Vec3::ZERO, |s, k| s + at(k).cross(at(k + 1)));
    sum.normalized().unwrap_or(vec3(0.0, 0.0, 1.0))
}
