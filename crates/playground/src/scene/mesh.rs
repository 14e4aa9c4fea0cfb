//! Triangles of mesh files, which the page has read (`player/playground/meshes`), as shapes of space: welded, checked,
//! turned outward, then a hull, convex parts or the triangles themselves, as `python/carom/meshes.py` makes them. The
//! mass of a closed mesh is that of the solid inside. Knows no file formats.

use super::fields::Fields;
use carom::geometry::hull::convex_hull_spatial;
use carom::geometry::{Decomposition, decompose};
use carom::{Column, Vec3, vec3};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Convex parts of a decomposition when nothing is asked for \[1\].
const PARTS: u32 = 16;
/// Vertices closer than this fraction of the mesh's extent are one vertex \[1\].
const WELD: f64 = 1e-9;

/// What a file held, three numbers to a vertex \[units of the file\] and three indices to a triangle.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct File {
    vertices: Vec<f64>,
    triangles: Vec<u32>,
}

/// The files that a page was given, by name.
pub type Files = BTreeMap<String, File>;

/// A mesh as a shape, and the closed surface whose solid gives its mass.
pub struct Solid {
    /// Table of a shape.
    pub shape: Value,
    /// The triangles as a shape, where they enclose a solid and the body may move.
    pub inside: Option<Value>,
}

/// The file that a scene means: the one of that path, else the one of that name.
fn found<'a>(files: &'a Files, path: &str) -> Option<&'a File> {
    let last = |path: &str| path.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    files.get(path).or_else(|| files.iter().find(|(name, _)| last(name) == last(path)).map(|(_, file)| file))
}

/// Refuses a scene some of whose files were not given, all named at once.
///
/// # Errors
/// Naming the files.
pub fn check(files: &Files, bodies: &[Value]) -> Result<(), String> {
    let named = bodies.iter().filter_map(|body| body.get("mesh")?.get("file")?.as_str());
    let missing: BTreeSet<&str> = named.filter(|path| found(files, path).is_none()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list = missing.into_iter().map(|path| format!("'{path}'")).collect::<Vec<_>>().join(", ");
    Err(format!("scene: mesh: a page has no folder to find {list} in; open or drop these files here too"))
}

/// Makes a body's mesh ready; `of` begins messages.
///
/// # Errors
/// Naming the field and what is wrong with the mesh.
pub fn read(value: Value, files: &Files, of: &str) -> Result<Solid, String> {
    let mut fields = Fields::new(format!("{of}: mesh"), value)?;
    let path: String = fields.need("file")?;
    let kind: String = fields.need("as")?;
    let scale = fields.take::<f64>("scale")?.unwrap_or(1.0);
    let parts = fields.take::<u32>("max_parts")?;
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(fields.wrong("scale", format!("must be > 0, got {scale}")));
    }
    if parts.is_some() && kind != "decomposition" {
        return Err(fields.wrong("max_parts", "has a meaning with as = \"decomposition\" only"));
    }
    let wrong = |problem: String| format!("{of}: mesh '{path}': {problem}");
    let file = found(files, &path).ok_or_else(|| wrong("was not given to this page".into()))?;
    let mesh = Mesh::of(file, scale).map_err(wrong)?;
    let shape = match kind.as_str() {
        "hull" => {
            let (corners, _) = convex_hull_spatial(&mesh.points).map_err(|e| wrong(e.to_string()))?;
            json!({ "type": "convex_hull", "points": corners })
        }
        "static" => mesh.surface(),
        "decomposition" => mesh.parts(parts.unwrap_or(PARTS)).map_err(wrong)?,
        other => {
            return Err(fields.wrong("as", format!("must be hull, decomposition or static, got '{other}'")));
        }
    };
    fields.finish()?;
    let solid = kind != "static" && mesh.open_edges() == 0;
    Ok(Solid { shape, inside: solid.then(|| mesh.surface()) })
}

/// Welded triangles, counter-clockwise seen from outside where they are closed.
struct Mesh {
    points: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
}

impl Mesh {
    fn of(file: &File, scale: f64) -> Result<Mesh, String> {
        let points: Vec<Vec3> =
            file.vertices.chunks_exact(3).map(|p| vec3(p[0] * scale, p[1] * scale, p[2] * scale)).collect();
        let faces: Vec<[u32; 3]> = file.triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        if points.len() < 3 || faces.is_empty() {
            return Err("holds no triangles; export it as triangles".into());
        }
        if !points.iter().all(|p| p.is_finite()) {
            return Err("has a vertex that is not finite; repair it".into());
        }
        if let Some(most) = faces.iter().flatten().find(|i| **i as usize >= points.len()) {
            return Err(format!("a triangle names vertex {most} of {}; repair it", points.len()));
        }
        let mut mesh = welded(&points, &faces)?;
        if mesh.open_edges() == 0 && mesh.volume() < 0.0 {
            mesh.faces.iter_mut().for_each(|t| t.reverse());
        }
        Ok(mesh)
    }
    /// Directed edges whose reverse is not there exactly once; none of a closed mesh.
    fn open_edges(&self) -> usize {
        let mut uses: HashMap<(u32, u32), usize> = HashMap::new();
        for t in &self.faces {
            for k in 0..3 {
                *uses.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
            }
        }
        uses.iter().filter(|((a, b), n)| **n != 1 || uses.get(&(*b, *a)) != Some(&1)).count()
    }
    /// Signed volume of the solid inside \[m^3\], about the first vertex: V = sum a . (b x c) / 6.
    fn volume(&self) -> f64 {
        let at = |i: u32| self.points[i as usize] - self.points[0];
        self.faces.iter().map(|t| triple(at(t[0]), at(t[1]), at(t[2]))).sum::<f64>() / 6.0
    }
    /// The triangles themselves, but for those without area.
    fn surface(&self) -> Value {
        let least = (1e-9 * extent(&self.points)).powi(2);
        let area = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|i| self.points[i as usize]);
            0.5 * cross(b - a, c - a).norm() > least
        };
        let faces: Vec<&[u32; 3]> = self.faces.iter().filter(area).collect();
        json!({ "type": "tri_mesh", "vertices": self.points, "triangles": faces })
    }
    fn parts(&self, most: u32) -> Result<Value, String> {
        let open = self.open_edges();
        if open > 0 {
            return Err(format!("is not closed at {open} edges; close the holes or use as = \"hull\""));
        }
        let options = Decomposition { max_parts: most, ..Decomposition::default() };
        let parts = decompose(&self.points, &self.faces, &options).map_err(|e| e.to_string())?;
        let mut hulls: Vec<Value> =
            parts.into_iter().map(|points| json!({ "type": "convex_hull", "points": points })).collect();
        if hulls.len() == 1 {
            return Ok(hulls.remove(0));
        }
        let hulls = hulls.into_iter().map(|hull| json!({ "shape": hull })).collect::<Vec<_>>();
        Ok(json!({ "type": "compound", "parts": hulls }))
    }
}

/// One vertex per place, no triangle twice or on fewer than three vertices, no vertex unused; the file's order stays.
fn welded(points: &[Vec3], faces: &[[u32; 3]]) -> Result<Mesh, String> {
    let low = points.iter().fold(points[0], |m, p| Vec3::from_fn(|i| m[i].min(p[i])));
    let step = WELD * extent(points);
    if step == 0.0 {
        return Err("has all its vertices in one point; repair it".into());
    }
    let mut place: HashMap<[i64; 3], usize> = HashMap::new();
    let mut same = Vec::with_capacity(points.len());
    for (number, p) in points.iter().enumerate() {
        let cell = std::array::from_fn(|i| ((p[i] - low[i]) / step).round_ties_even() as i64);
        same.push(*place.entry(cell).or_insert(number));
    }
    let mut seen = BTreeSet::new();
    let mut kept: Vec<[usize; 3]> = Vec::new();
    for face in faces {
        let t = face.map(|i| same[i as usize]);
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            continue;
        }
        let first = (0..3).min_by_key(|k| t[*k]).unwrap_or(0);
        if seen.insert([t[first], t[(first + 1) % 3], t[(first + 2) % 3]]) {
            kept.push(t);
        }
    }
    if kept.is_empty() {
        return Err("holds no triangles with an area; repair it".into());
    }
    let used: BTreeSet<usize> = kept.iter().flatten().copied().collect();
    let rank: HashMap<usize, u32> = used.iter().zip(0..).map(|(number, k)| (*number, k)).collect();
    Ok(Mesh {
        points: used.iter().map(|number| points[*number]).collect(),
        faces: kept.iter().map(|t| t.map(|number| rank[&number])).collect(),
    })
}

/// Diagonal of the box around points \[m\].
fn extent(points: &[Vec3]) -> f64 {
    let span = |i: usize| {
        let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[i]), h.max(p[i])));
        high - low
    };
    (0..3).map(|i| span(i).powi(2)).sum::<f64>().sqrt()
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    vec3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
}

fn triple(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    a.dot(cross(b, c))
}
