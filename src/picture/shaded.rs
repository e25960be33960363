//! A mesh as a shaded picture.
//!
//! In: a mesh in metres. Out: an image. Nine parallel rays per pixel.

use image::{Rgb, RgbImage};
use rayon::prelude::*;

use crate::base::{Point3, Vector3};
use crate::geom::{Mesh, MeshIndex};

const WHITE: [f64; 3] = [255.0; 3];
/// Faces: what is seen counter-clockwise.
const FACE: [f64; 3] = [150.0, 180.0, 225.0];
const BACK: [f64; 3] = [225.0, 195.0, 140.0];
/// Width and height in pixels.
const PIXELS: u32 = 560;
/// Rays along one side of a pixel.
const RAYS: u32 = 3;

/// A shaded picture of a mesh, looked at from `azimuth_rad` around the vertical (0: along
/// -x) and `elevation_rad` above the horizon, without perspective. Faces are blue, backs
/// ochre; a mesh without triangles is a white picture.
#[must_use]
pub fn picture(mesh: &Mesh, azimuth_rad: f64, elevation_rad: f64) -> RgbImage {
    let mut image = RgbImage::from_pixel(PIXELS, PIXELS, Rgb([255; 3]));
    let Ok(index) = MeshIndex::new(mesh) else { return image };
    let view = View::of(mesh, azimuth_rad, elevation_rad);
    image.par_chunks_exact_mut(3).enumerate().for_each(|(at, pixel)| {
        let corner = [at as u32 % PIXELS, at as u32 / PIXELS].map(|v| f64::from(v * RAYS) + 0.5);
        let mut sum = [0.0; 3];
        for ray in 0..RAYS * RAYS {
            let [x, y] = [corner[0] + f64::from(ray % RAYS), corner[1] + f64::from(ray / RAYS)];
            let seen = view.colour(mesh, &index, [x, y].map(|v| v / f64::from(RAYS * PIXELS)));
            sum = std::array::from_fn(|k| sum[k] + seen[k]);
        }
        pixel.copy_from_slice(&sum.map(|c| (c / f64::from(RAYS * RAYS)).round() as u8));
    });
    image
}

/// How the picture lies in space.
struct View {
    /// The picture's upper left corner, in front of all of the mesh.
    corner: Point3,
    /// To its upper right corner.
    across: Vector3,
    /// To its lower left corner.
    down: Vector3,
    /// The way that is looked, as long as there is something to be seen.
    along: Vector3,
}

impl View {
    /// The mesh in the middle, with a margin.
    fn of(mesh: &Mesh, azimuth_rad: f64, elevation_rad: f64) -> Self {
        let (sin_a, cos_a) = azimuth_rad.sin_cos();
        let (sin_e, cos_e) = elevation_rad.sin_cos();
        let right = Vector3::new(sin_a, 0.0, -cos_a);
        let toward = Vector3::new(cos_a * cos_e, sin_e, sin_a * cos_e);
        let axes = [right, toward.cross(&right), toward];
        let used = || mesh.triangles.iter().flatten().map(|&v| mesh.vertices[v as usize].coords);
        let extent = axes.map(|axis| {
            let along = || used().map(|p| p.dot(&axis));
            (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max))
        });
        let sizes = extent.map(|(low, high)| high - low);
        let side = sizes[0].max(sizes[1]) / 0.92;
        let middle = extent.map(|(low, high)| 0.5 * (low + high));
        let [right, up, toward] = axes;
        let corner = right * (middle[0] - 0.5 * side)
            + up * (middle[1] + 0.5 * side)
            + toward * (extent[2].1 + 0.5 * side);
        let along = -toward * (sizes[2] + side);
        Self { corner: corner.into(), across: right * side, down: -up * side, along }
    }

    /// What is seen at a place of the picture, both its coordinates from 0 to 1.
    fn colour(&self, mesh: &Mesh, index: &MeshIndex, [x, y]: [f64; 2]) -> [f64; 3] {
        let origin = self.corner + self.across * x + self.down * y;
        let Some(hit) = index.cast(&origin, &self.along, 1.0) else { return WHITE };
        let [a, b, c] = mesh.triangles[hit.triangle as usize].map(|v| mesh.vertices[v as usize]);
        let is_face = (b - a).cross(&(c - a)).dot(&self.along) < 0.0;
        let light = Vector3::new(0.45, 0.75, 0.49);
        let shade = 0.35 + 0.65 * hit.normal.dot(&light).abs();
        (if is_face { FACE } else { BACK }).map(|c| (c * shade).min(255.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Point3;

    #[test]
    fn a_picture_shows_the_face_from_above_and_the_back_from_below() {
        let vertices = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]];
        let mesh = Mesh {
            vertices: vertices.map(|[x, z]| Point3::new(x, 0.0, z)).to_vec(),
            triangles: vec![[0, 1, 2]],
        };
        let bluish = |elevation: f64| {
            let image = picture(&mesh, 0.0, elevation);
            image.pixels().filter(|p| p.0 != [255; 3]).all(|p| p[2] > p[0])
        };
        assert!(bluish(1.2) && !bluish(-1.2));
    }

    #[test]
    fn a_picture_is_as_large_as_the_mesh_and_the_right_way_up() {
        // a triangle that stands on a side of 2, its tip 1 above it, seen from +x
        let corners = [[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let mesh = Mesh {
            vertices: corners.map(|[z, y]| Point3::new(0.0, y, z)).to_vec(),
            triangles: vec![[0, 1, 2]],
        };
        let image = picture(&mesh, 0.0, 0.0);
        let seen = image.pixels().filter(|p| p.0 != [255; 3]).count() as f64;
        let side = 0.92 * f64::from(PIXELS);
        assert!((seen / (side * side / 4.0) - 1.0).abs() < 0.02, "{seen}");
        let row = |y| (0..PIXELS).filter(|&x| image.get_pixel(x, y).0 != [255; 3]).count();
        assert!(row(PIXELS / 2 + 100) > row(PIXELS / 2 - 100) + 150);
    }
}
