//! What is poured: a rain of mixed shapes in the plane, hulls into a box and rocks onto a mesh in space.

use super::{slab, walls};
use crate::scene::{Arena, Body, Kind};
use carom::{Planar, PlanarShape, Spatial, SpatialShape, Vec3, vec3};
use carom_scenes::chance::Chance;
use carom_scenes::stage::Stage;
use std::f64::consts::TAU;

/// `rows` rows of forty discs, capsules, boxes, pentagons and octagons fall past fixed boxes into a tray.
pub fn rain(rows: usize) -> Vec<Body<Planar>> {
    let width = 48.0;
    let mut bodies = vec![slab(0.0, 0.0, width + 2.0, 1.0)];
    bodies.extend(walls(width, 1.0, 40.0));
    for k in 0..9 {
        let (x, up) = (-20.0 + 5.0 * f64::from(k), if k % 2 == 0 { 8.0 } else { 12.0 });
        let pillar = Body::new(Kind::Fixed, Planar::block(1.5, 1.5, 1.0), Planar::spot(x, up, 0.0));
        bodies.push(pillar.turned(Planar::lean(TAU / 8.0)));
    }
    let mut chance = Chance::new(1);
    for k in 0..40 * rows {
        let size = chance.between(0.6, 1.0);
        let polygon = |corners: u32| PlanarShape::ConvexPolygon {
            points: (0..corners)
                .map(|c| Planar::lean(TAU * f64::from(c) / f64::from(corners)))
                .map(|t| carom::Rotation::rotate(&t, carom::vec2(0.5 * size, 0.0)))
                .collect(),
        };
        let shape = match k % 5 {
            0 => PlanarShape::Circle { radius: 0.5 * size },
            1 => PlanarShape::Capsule { length: 0.5 * size, radius: 0.25 * size },
            2 => PlanarShape::Box { size: [size, 0.6 * size] },
            3 => polygon(5),
            _ => polygon(8),
        };
        let spot = Planar::spot(-22.62 + 1.16 * (k % 40) as f64, 16.0 + 1.2 * (k / 40) as f64, 0.0);
        let turn = Planar::lean(chance.between(0.0, TAU));
        bodies.push(Body::new(Kind::Dynamic, shape, spot).turned(turn));
    }
    bodies
}

/// A hull of `count` corners on an ellipsoid with the longest half-axis `size` \[m\].
fn hull(chance: &mut Chance, count: usize, size: f64) -> SpatialShape {
    let axes = [size, chance.between(0.7, 0.9) * size, chance.between(0.55, 0.75) * size];
    let corner = |d: Vec3| vec3(axes[0] * d[0], axes[1] * d[1], axes[2] * d[2]);
    SpatialShape::ConvexHull { points: (0..count).map(|_| corner(chance.direction())).collect() }
}

/// `layers` layers of 16 x 16 hulls of 24 corners, of twelve kinds, fall into a box 18 m wide.
pub fn hulls(layers: usize) -> Vec<Body<Spatial>> {
    let width = 18.0;
    let mut bodies = vec![slab(0.0, 0.0, width + 2.0, width + 2.0)];
    bodies.extend(walls(width, width, 1.2 * layers as f64 + 4.0));
    let mut chance = Chance::new(2);
    let kinds: Vec<SpatialShape> = (0..12).map(|_| hull(&mut chance, 24, 0.5)).collect();
    for k in 0..256 * layers {
        let at = |k: usize| 1.1 * ((k % 16) as f64 - 7.5);
        let spot = vec3(at(k), at(k / 16), 1.0 + 1.05 * (k / 256) as f64);
        let body = Body::new(Kind::Dynamic, kinds[k % 12].clone(), spot);
        bodies.push(body.turned(chance.orientation()));
    }
    bodies
}

/// `layers` layers of 10 x 10 rocks of 20 corners fall into a valley of 3,200 triangles.
pub fn rocks(layers: usize) -> Vec<Body<Spatial>> {
    let mut bodies = vec![Body::new(Kind::Fixed, valley(40, 1.0), vec3(0.0, 0.0, 0.0))];
    let mut chance = Chance::new(3);
    for k in 0..100 * layers {
        let at = |k: usize| 1.6 * ((k % 10) as f64 - 4.5);
        let size = chance.between(0.4, 0.75);
        let spot = vec3(at(k), at(k / 10), 4.0 + 1.6 * (k / 100) as f64);
        let body = Body::new(Kind::Dynamic, hull(&mut chance, 20, size), spot);
        bodies.push(body.turned(chance.orientation()));
    }
    bodies
}

/// A rough bowl as a mesh of `cells` by `cells` squares of side `cell` \[m\], two triangles each, facing up.
fn valley(cells: u32, cell: f64) -> SpatialShape {
    let at = |k: u32| (f64::from(k) - 0.5 * f64::from(cells)) * cell;
    let mut vertices = Vec::new();
    for j in 0..=cells {
        for i in 0..=cells {
            let (x, y) = (at(i), at(j));
            vertices.push(vec3(x, y, 0.03 * (x * x + y * y) + 0.3 * (1.3 * x).sin() * (1.1 * y).cos()));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..cells {
        for i in 0..cells {
            let corner = |di: u32, dj: u32| (j + dj) * (cells + 1) + i + di;
            triangles.push([corner(0, 0), corner(1, 0), corner(1, 1)]);
            triangles.push([corner(0, 0), corner(1, 1), corner(0, 1)]);
        }
    }
    SpatialShape::TriMesh { vertices, triangles }
}
