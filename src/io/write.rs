//! Writers. A file appears whole or not at all.

use std::io;
use std::io::Write;
use std::path::Path;

use png::{BitDepth, ColorType, Encoder, EncodingError};

use super::{WriteError, atomically};
use crate::base::units::M_PER_MM;
use crate::geom::{Cloud, Mesh};

/// Writes a cloud as binary little-endian PLY with float coordinates multiplied
/// by `scale`, its colours and its triangles.
///
/// # Errors
/// When the system refuses.
pub fn write_ply(path: impl AsRef<Path>, cloud: &Cloud, scale: f64) -> Result<(), WriteError> {
    atomically(path, |out| ply_to(out, cloud, scale))
}

/// Writes the bytes of [`write_ply`].
pub(crate) fn ply_to(out: &mut dyn Write, cloud: &Cloud, scale: f64) -> io::Result<()> {
    let colored = cloud.colors.len() == cloud.points.len() && !cloud.points.is_empty();
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment scan2params")?;
    writeln!(out, "element vertex {}", cloud.points.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    if colored {
        writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
    }
    if !cloud.triangles.is_empty() {
        writeln!(out, "element face {}", cloud.triangles.len())?;
        writeln!(out, "property list uchar int vertex_indices")?;
    }
    writeln!(out, "end_header")?;
    for (i, point) in cloud.points.iter().enumerate() {
        for coordinate in point.iter() {
            out.write_all(&((coordinate * scale) as f32).to_le_bytes())?;
        }
        if colored {
            out.write_all(&cloud.colors[i])?;
        }
    }
    for triangle in &cloud.triangles {
        out.write_all(&[3])?;
        for vertex in triangle {
            out.write_all(&vertex.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Writes depths \[m\], row by row, as a 16-bit grey PNG of `scale` units to a metre;
/// 0 where a depth is not finite or does not fit.
///
/// # Errors
/// When the system refuses, or the depths do not fill rows of `width`.
pub fn write_depth_png(
    path: impl AsRef<Path>,
    width: usize,
    depth_m: &[f64],
    scale: f64,
) -> Result<(), WriteError> {
    let unit = |depth: &f64| {
        let value = (depth * scale).round();
        if (1.0..f64::from(u16::MAX)).contains(&value) { value as u16 } else { 0 }
    };
    let samples: Vec<u8> = depth_m.iter().flat_map(|d| unit(d).to_be_bytes()).collect();
    atomically(path, |out| {
        let wrong = || io::Error::new(io::ErrorKind::InvalidInput, "depths do not fill the rows");
        let size = depth_m.len().checked_div(width).filter(|rows| rows * width == depth_m.len());
        let (columns, rows) =
            (u32::try_from(width), size.and_then(|rows| u32::try_from(rows).ok()));
        let (Ok(columns), Some(rows)) = (columns, rows) else {
            return Err(wrong());
        };
        encode_png(out, [columns, rows], (ColorType::Grayscale, BitDepth::Sixteen), &samples)
    })
}

/// Writes a picture as PNG: its width and height in pixels, and the red, green and blue of
/// each pixel, row by row.
///
/// # Errors
/// When the system refuses, or the colours do not fill the picture.
#[cfg(feature = "picture")]
pub fn write_png(path: impl AsRef<Path>, size: [u32; 2], rgb: &[u8]) -> Result<(), WriteError> {
    atomically(path, |out| encode_png(out, size, (ColorType::Rgb, BitDepth::Eight), rgb))
}

fn encode_png(
    out: &mut dyn Write,
    [width, height]: [u32; 2],
    (color, depth): (ColorType, BitDepth),
    samples: &[u8],
) -> io::Result<()> {
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().map_err(of_png)?;
    writer.write_image_data(samples).map_err(of_png)?;
    writer.finish().map_err(of_png)
}

/// The system's error for a picture that cannot be written.
fn of_png(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

/// A mesh as binary STL in millimetres: 80 bytes of header, the count, and 50 bytes for each
/// triangle with its normal.
#[must_use]
pub fn stl_bytes(mesh: &Mesh) -> Vec<u8> {
    const HEADER: &[u8; 80] =
        b"scan2params; millimetres; binary STL                                            ";
    let mut out = HEADER.to_vec();
    let count = u32::try_from(mesh.triangles.len()).unwrap_or(u32::MAX);
    out.extend(count.to_le_bytes());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize]);
        let normal = (b - a).cross(&(c - a));
        let normal = normal.try_normalize(0.0).unwrap_or_default();
        let corners = [a, b, c].map(|corner| corner.coords / M_PER_MM);
        for vector in [normal].into_iter().chain(corners) {
            out.extend(vector.iter().flat_map(|v| (*v as f32).to_le_bytes()));
        }
        out.extend([0; 2]);
    }
    out
}

/// Writes a mesh as OBJ in millimetres, to a nanometre, vertices in order.
///
/// # Errors
/// When the system refuses.
pub fn write_obj(path: impl AsRef<Path>, mesh: &Mesh) -> Result<(), WriteError> {
    atomically(path, |out| {
        writeln!(out, "# scan2params; millimetres; y up, weft along z, warp along x")?;
        for vertex in &mesh.vertices {
            let [x, y, z] = (vertex / M_PER_MM).coords.into();
            writeln!(out, "v {x:.6} {y:.6} {z:.6}")?;
        }
        for [a, b, c] in &mesh.triangles {
            writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
        }
        Ok(())
    })
}
