//! A mesh as a shaded picture.
//!
//! In: a mesh in metres. Out: an image.

use image::{Rgb, RgbImage};

use crate::base::Vector3;
use crate::geom::Mesh;

const WHITE: Rgb<u8> = Rgb([255, 255, 255]);

/// A shaded picture of a mesh, looked at from `azimuth_rad` around the vertical (0: along
/// -x) and `elevation_rad` above the horizon, without perspective. Faces are blue, backs
/// ochre.
#[must_use]
pub fn picture(mesh: &Mesh, azimuth_rad: f64, elevation_rad: f64) -> RgbImage {
    const PIXELS: u32 = 560;
    let (sin_a, cos_a) = azimuth_rad.sin_cos();
    let (sin_e, cos_e) = elevation_rad.sin_cos();
    let view: Vec<[f64; 3]> = mesh
        .vertices
        .iter()
        .map(|p| {
            let (right, toward) = (p.x * sin_a - p.z * cos_a, p.x * cos_a + p.z * sin_a);
            [right, p.y * cos_e - toward * sin_e, p.y * sin_e + toward * cos_e]
        })
        .collect();
    let used = || mesh.triangles.iter().flatten().map(|&v| view[v as usize]);
    let bound = |c: usize, f: fn(f64, f64) -> f64, from: f64| used().map(|p| p[c]).fold(from, f);
    let (low, high) = ([0, 1], f64::INFINITY);
    let [left, bottom] = low.map(|c| bound(c, f64::min, high));
    let [right, top] = low.map(|c| bound(c, f64::max, -high));
    let scale = 0.92 * f64::from(PIXELS) / (right - left).max(top - bottom);
    let middle = 0.5 * f64::from(PIXELS);
    let pixel = |p: [f64; 3]| {
        let x = middle + (p[0] - 0.5 * (left + right)) * scale;
        [x, middle - (p[1] - 0.5 * (bottom + top)) * scale, p[2]]
    };
    let mut image = RgbImage::from_pixel(PIXELS, PIXELS, WHITE);
    let mut depth = vec![f64::NEG_INFINITY; (PIXELS * PIXELS) as usize];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| pixel(view[v as usize]));
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let normal = (b - a).cross(&(c - a));
        fill(&mut image, &mut depth, &corners, normal / normal.norm().max(1e-300));
    }
    image
}

fn fill(image: &mut RgbImage, depth: &mut [f64], corners: &[[f64; 3]; 3], normal: Vector3) {
    let [a, b, c] = corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 {
        return;
    }
    let light = Vector3::new(0.45, 0.75, 0.49);
    let shade = 0.35 + 0.65 * normal.dot(&light).abs();
    // counter-clockwise towards the eye is clockwise on the screen
    let base = if area < 0.0 { [150.0, 180.0, 225.0] } else { [225.0, 195.0, 140.0] };
    let colour = Rgb(base.map(|c: f64| (c * shade).min(255.0) as u8));
    let (width, height) = (image.width() as usize, image.height() as usize);
    let span = |k: usize, limit: usize| {
        let low = corners.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min).floor().max(0.0);
        let high = corners.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max).ceil();
        low as usize..(high.max(0.0) as usize + 1).min(limit)
    };
    for y in span(1, height) {
        for x in span(0, width) {
            let p = [x as f64, y as f64];
            let part = |q: &[f64; 3], r: &[f64; 3]| {
                ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / area
            };
            let (u, v, w) = (part(b, c), part(c, a), part(a, b));
            let z = u * a[2] + v * b[2] + w * c[2];
            if u >= -1e-9 && v >= -1e-9 && w >= -1e-9 && z > depth[y * width + x] {
                depth[y * width + x] = z;
                image.put_pixel(x as u32, y as u32, colour);
            }
        }
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
            image.pixels().filter(|p| **p != WHITE).all(|p| p[2] > p[0])
        };
        assert!(bluish(1.2) && !bluish(-1.2));
    }
}
