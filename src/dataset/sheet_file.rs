//! A sheet of the specimen read from a mesh: what `simulate --start` takes.
//!
//! In: an OBJ or PLY in mm, simulation frame, of which each vertex's place on the flat cloth is
//! known: by its number, where the vertices are the square grid that `simulate` writes (vertex (i,
//! j) at i n + j, i along the warp, any n from 5), or by the OBJ's texture coordinates. These run
//! along warp and weft from the flat specimen's corner (-x, -z): shares from 0 to 1, or mm where
//! one of them is larger than 2. Out: a [`Surface`]. Between the vertices of an unwrapped mesh the
//! sheet is linear; what no triangle covers is refused.

use std::ffi::OsStr;
use std::path::Path;

use super::drape_file::{DrapeFileError, read_drape};
use crate::base::units::M_PER_MM;
use crate::base::{Point3, Surface, SurfacePoint};
use crate::geom::Mesh;
use crate::io::read_obj_texture;

/// Texture coordinates beyond this are mm, not shares.
const LARGEST_SHARE: f64 = 2.0;
/// How far outside a triangle, in barycentric coordinates, a place still counts as on it: the edges
/// of an unwrapped mesh end a little inside 0 and 1.
const SLACK: f64 = 0.05;

/// Reads a sheet; `extents_m` are the specimen's along warp and weft \[m\].
///
/// # Errors
/// When the file cannot be read, is not of a drape's size, or does not say where its vertices lie
/// on the flat specimen.
pub fn read_sheet(path: &Path, extents_m: [f64; 2]) -> Result<Surface, DrapeFileError> {
    let mesh = read_drape(path)?;
    let no_sheet =
        |fault: String| DrapeFileError::NoSheet { path: path.display().to_string(), fault };
    let is_obj =
        path.extension().and_then(OsStr::to_str).is_some_and(|e| e.eq_ignore_ascii_case("obj"));
    let texture = if is_obj { read_obj_texture(path)? } else { None };
    if let Some(places) = texture {
        return unwrapped(&mesh, &places, extents_m).map_err(no_sheet);
    }
    let count = mesh.vertices.len();
    let side = count.isqrt();
    if side < 5 || side * side != count {
        let fault =
            format!("{count} vertices are no square grid, and it has no texture coordinates");
        return Err(no_sheet(fault));
    }
    let step = |a: usize, b: usize| (mesh.vertices[a] - mesh.vertices[b]).norm();
    let even_m = extents_m.map(|extent_m| extent_m / (side - 1) as f64);
    for k in 0..count {
        for (next, even_m) in [(k + side, even_m[0]), (k + 1, even_m[1])] {
            let inside = if next == k + 1 { next % side != 0 } else { next < count };
            if inside && step(next, k) > 2.0 * even_m {
                let fault = format!(
                    "vertices {} and {}, neighbours on a grid of {side} x {side}, lie {:.1} mm apart, \
                     {:.1} on the flat specimen",
                    k + 1,
                    next + 1,
                    step(next, k) / M_PER_MM,
                    even_m / M_PER_MM
                );
                return Err(no_sheet(fault));
            }
        }
    }
    Surface::exact(mesh.vertices).map_err(|error| no_sheet(error.to_string()))
}

/// The sheet of a mesh whose vertices' places on the flat cloth are given.
fn unwrapped(
    mesh: &Mesh,
    places: &[Option<[f64; 2]>],
    extents_m: [f64; 2],
) -> Result<Surface, String> {
    let values = || places.iter().flatten().flatten();
    let largest = values().copied().fold(0.0, f64::max);
    let in_mm = largest > LARGEST_SHARE;
    let share = |place: [f64; 2]| -> [f64; 2] {
        if in_mm { [0, 1].map(|c| place[c] * M_PER_MM / extents_m[c]) } else { place }
    };
    let n = Surface::SIDE;
    let mut found: Vec<Option<(f64, Point3)>> = vec![None; n * n];
    let last = (n - 1) as f64;
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| places.get(v as usize).copied().flatten().map(share));
        let [Some(a), Some(b), Some(c)] = corners else { continue };
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 {
            continue;
        }
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            let slack = SLACK * (high - low);
            let low = ((low - slack) * last).ceil().max(0.0) as usize;
            low..((high + slack) * last).floor().clamp(-1.0, last) as isize as usize + 1
        };
        let positions = triangle.map(|v| mesh.vertices[v as usize].coords);
        for i in range(0) {
            for j in range(1) {
                let p = [i as f64 / last, j as f64 / last];
                let of = |q: [f64; 2], r: [f64; 2]| {
                    ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / area
                };
                let weights = [of(b, c), of(c, a), of(a, b)];
                let outside = -weights.iter().copied().fold(f64::INFINITY, f64::min);
                let slot = &mut found[i * n + j];
                if outside <= SLACK && slot.is_none_or(|(before, _)| outside < before) {
                    let at =
                        (0..3).map(|k| positions[k] * weights[k]).sum::<crate::base::Vector3>();
                    *slot = Some((outside, at.into()));
                }
            }
        }
    }
    let missing = found.iter().filter(|slot| slot.is_none()).count();
    if let Some(first) = found.iter().position(Option::is_none) {
        let unit = if in_mm { "taken as mm" } else { "taken as shares of its sides" };
        return Err(format!(
            "its texture coordinates, {unit}, leave {:.0} % of the specimen uncovered, first at the \
             shares ({:.2}, {:.2}) of warp and weft",
            100.0 * missing as f64 / found.len() as f64,
            (first / n) as f64 / last,
            (first % n) as f64 / last
        ));
    }
    let exact = |position_m| SurfacePoint { position_m, sigma_m: 0.0, observed: true };
    Surface::new(found.into_iter().flatten().map(|(_, p)| exact(p)).collect())
        .map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    const SIDE_M: [f64; 2] = [0.3, 0.3];

    /// A bent sheet at shares of the specimen \[mm\].
    fn at([u, v]: [f64; 2]) -> [f64; 3] {
        [300.0 * u - 150.0, -40.0 * u - 30.0 * v, 300.0 * v - 150.0]
    }

    /// An OBJ of n x n vertices; `texture` writes the coordinates of a share.
    fn obj(n: usize, texture: Option<fn(f64) -> f64>) -> String {
        let mut text = String::new();
        let share = |k: usize| [k / n, k % n].map(|c| c as f64 / (n - 1) as f64);
        for k in 0..n * n {
            let [x, y, z] = at(share(k));
            let _ = writeln!(text, "v {x} {y} {z}");
            if let Some(texture) = texture {
                let [u, v] = share(k).map(texture);
                let _ = writeln!(text, "vt {u} {v}");
            }
        }
        for k in 0..n * (n - 1) {
            if k % n != n - 1 {
                let corner = |k: usize| match texture {
                    Some(_) => format!("{k}/{k}"),
                    None => k.to_string(),
                };
                let [a, b, c, d] = [k + 1, k + 2, k + n + 2, k + n + 1].map(corner);
                let _ = writeln!(text, "f {a} {b} {c} {d}");
            }
        }
        text
    }

    fn read(text: &str) -> Result<Surface, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.obj");
        std::fs::write(&path, text).unwrap();
        read_sheet(&path, SIDE_M).map_err(|error| error.to_string())
    }

    #[test]
    fn a_grid_is_read_by_its_order_and_an_unwrapped_mesh_by_its_texture() {
        let texts = [
            (obj(31, None), 31),
            (obj(13, Some(|share| share)), 61),
            (obj(13, Some(|share| 300.0 * share)), 61),
        ];
        for (text, side) in texts {
            let sheet = read(&text).unwrap();
            assert_eq!(sheet.side(), side);
            for shares in [[0.0, 1.0], [0.3, 0.45], [0.977, 0.01]] {
                let off = sheet.at(shares).position_m - Point3::from(at(shares)) * 1e-3;
                assert!(off.norm() < 1e-9, "{side} {shares:?} {off}");
            }
        }
    }

    #[test]
    fn meshes_that_do_not_say_where_they_lie_are_refused_with_the_remedy() {
        let refused = |text: &str| read(text).unwrap_err();
        let order = obj(31, None).replacen("v -150 ", "v 150 ", 1);
        let order = refused(&order);
        assert!(order.contains("vertices 1 and 32") && order.contains("texture"), "{order}");
        let count = refused(&format!("v 150 0 0\n{}", obj(31, None)));
        assert!(count.contains("962 vertices are no square grid"), "{count}");
        let half = refused(&obj(13, Some(|share| 0.5 * share)));
        assert!(half.contains("uncovered") && half.contains("taken as shares"), "{half}");
    }
}
