//! Writers. A file appears whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::WriteError;
use crate::base::units::M_PER_MM;
use crate::geom::{Cloud, Mesh};

/// Writes a file through `<name>.part`, which takes its name when complete.
///
/// # Errors
/// When the system refuses; the `.part` file is removed then.
pub fn atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let path = path.as_ref();
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let written = File::create(&part).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()?;
        drop(out);
        std::fs::rename(&part, path)
    });
    written.map_err(|source| {
        // Whether there is a part to remove depends on where it failed.
        let _ = std::fs::remove_file(&part);
        WriteError { path: path.to_owned(), source }
    })
}

/// Writes a cloud as binary little-endian PLY with float coordinates multiplied
/// by `scale`, its colours and its triangles.
///
/// # Errors
/// When the system refuses.
pub fn write_ply(path: impl AsRef<Path>, cloud: &Cloud, scale: f64) -> Result<(), WriteError> {
    let colored = cloud.colors.len() == cloud.points.len() && !cloud.points.is_empty();
    atomically(path, |out| {
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
    })
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
