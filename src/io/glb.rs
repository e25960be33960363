//! GLB: binary glTF 2.0, as tablets' scanning apps export it.
//!
//! Every mesh of the scene, moved by its nodes, in metres with y up (glTF 2.0
//! specification, sections 3.5 to 3.7 and 4). Positions may be quantised
//! (KHR_mesh_quantization).
//!
//! Read by hand: the crate `gltf` (1.4.1) was tried on the files that are read here. It
//! refuses those that require KHR_mesh_quantization, takes positions of any type for
//! three floats (those of bytes come out as other numbers, without an error), and panics
//! on a stride below the size of an element, on indices that are floats, and on damaged
//! files like those of `tests/io/fuzz.rs`, where a reader here must not. Its types for the JSON
//! alone would leave all checks of bounds to be done.
//!
//! Refused, with what to do: sparse accessors, Draco and meshopt compression, data
//! outside the file. Left out: materials, textures, skins, morphs, lines.

use std::collections::HashMap;

use nalgebra::Matrix4;

use super::assemble::Raw;
use super::glb_data::{Data, Document, Mesh, Primitive, compressed, layout, missing};
use super::{At, Fault};
use crate::base::Point3;

const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

const REPEATED: &str =
    "the scene repeats its meshes to more than the file has bytes; export the specimen once";

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let (json, data) = chunks(bytes)?;
    let document: Document = serde_json::from_slice(json).map_err(|error| {
        layout(format!("the GLB's JSON cannot be read ({error}); export the scene again"))
    })?;
    document.check_required()?;
    let data = Data { document: &document, bytes: data };
    Scene { data, most_points: bytes.len() }.read()
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|four| u32::from_le_bytes(*four))
}

/// The JSON and the binary chunk.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), At> {
    let cut = || layout("the GLB ends inside its header or a chunk; copy or export it again");
    if !bytes.starts_with(b"glTF") {
        return Err(layout("a GLB starts with `glTF`; this one is damaged: export it again"));
    }
    let version = u32_at(bytes, 4).ok_or_else(cut)?;
    if version != 2 {
        return Err(layout(format!("GLB of version {version}; export it as glTF 2.0")));
    }
    let length = u32_at(bytes, 8).ok_or_else(cut)? as usize;
    let bytes = bytes.get(..length).ok_or_else(cut)?;
    let (mut json, mut data): (Option<&[u8]>, Option<&[u8]>) = (None, None);
    let mut at = 12;
    while at + 8 <= bytes.len() {
        let length = u32_at(bytes, at).ok_or_else(cut)? as usize;
        let kind = u32_at(bytes, at + 4).ok_or_else(cut)?;
        let chunk = bytes[at + 8..].get(..length).ok_or_else(cut)?;
        match kind {
            JSON => drop(json.get_or_insert(chunk)),
            BIN => drop(data.get_or_insert(chunk)),
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or_else(|| layout("the GLB has no JSON chunk; export it again"))?;
    Ok((json, data.unwrap_or_default()))
}

struct Scene<'a> {
    data: Data<'a>,
    /// A point takes 3 bytes at least; a mesh shown by many nodes must not grow
    /// beyond the file.
    most_points: usize,
}

impl Scene<'_> {
    fn read(&self) -> Result<Raw, At> {
        let nodes = &self.data.document.nodes;
        let mut raw = Raw::default();
        let mut colored = true;
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<(usize, Matrix4<f64>)> = self
            .data
            .document
            .roots()
            .into_iter()
            .map(|root| (root, Matrix4::identity()))
            .collect();
        stack.reverse();
        while let Some((index, parent)) = stack.pop() {
            let node = nodes.get(index).ok_or_else(|| missing("node", index))?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(layout(format!(
                    "node {index} has two parents; export the scene again"
                )));
            }
            let motion = parent * node.motion();
            if let Some(index) = node.mesh {
                let meshes = &self.data.document.meshes;
                let mesh = meshes.get(index).ok_or_else(|| missing("mesh", index))?;
                colored &= self.add_mesh(mesh, &motion, &mut raw)?;
            }
            stack.extend(node.children.iter().rev().map(|&child| (child, motion)));
        }
        if !colored {
            raw.colors.clear();
        }
        Ok(raw)
    }

    /// Adds a mesh; returns whether all of its points have colours.
    fn add_mesh(&self, mesh: &Mesh, motion: &Matrix4<f64>, raw: &mut Raw) -> Result<bool, At> {
        let mut colored = true;
        // Primitives of several materials often share their vertices.
        let mut bases: HashMap<usize, usize> = HashMap::new();
        for primitive in &mesh.primitives {
            let Some(&positions) = primitive.attributes.get("POSITION") else {
                raw.ignored.push("primitive without POSITION".to_owned());
                continue;
            };
            let count = self.data.accessor(positions)?.count;
            let base = match bases.get(&positions) {
                Some(&base) => base,
                None => {
                    let base = raw.points.len();
                    self.add_points(primitive, positions, motion, raw)?;
                    colored &= self.add_colors(primitive, count, raw)?;
                    bases.insert(positions, base);
                    base
                }
            };
            self.add_faces(primitive, base, count, raw)?;
        }
        Ok(colored)
    }

    fn add_points(
        &self,
        primitive: &Primitive,
        accessor: usize,
        motion: &Matrix4<f64>,
        raw: &mut Raw,
    ) -> Result<(), At> {
        let draco = primitive.extensions.keys().find(|name| name.contains("draco"));
        if let (Some(name), None) = (draco, self.data.accessor(accessor)?.buffer_view) {
            return Err(compressed(name));
        }
        let numbers = self.data.numbers(accessor, "VEC3")?;
        if raw.points.len() + numbers.len() / 3 > self.most_points {
            return Err(layout(REPEATED));
        }
        raw.points.extend(numbers.as_chunks().0.iter().map(|&[x, y, z]| {
            let moved = motion * nalgebra::Vector4::new(x, y, z, 1.0);
            Point3::new(moved.x, moved.y, moved.z)
        }));
        Ok(())
    }

    fn add_colors(&self, primitive: &Primitive, count: usize, raw: &mut Raw) -> Result<bool, At> {
        let Some(&index) = primitive.attributes.get("COLOR_0") else {
            return Ok(false);
        };
        let accessor = self.data.accessor(index)?;
        let kind = if accessor.kind == "VEC4" { "VEC4" } else { "VEC3" };
        if accessor.count != count {
            return Ok(false);
        }
        let numbers = self.data.numbers(index, kind)?;
        let byte = |value: f64| (value * 255.0).round() as u8;
        let width = if kind == "VEC4" { 4 } else { 3 };
        let colors = numbers.chunks_exact(width).map(|c| [byte(c[0]), byte(c[1]), byte(c[2])]);
        raw.colors.extend(colors);
        Ok(true)
    }

    fn add_faces(
        &self,
        primitive: &Primitive,
        base: usize,
        vertices: usize,
        raw: &mut Raw,
    ) -> Result<(), At> {
        if !(4..=6).contains(&primitive.mode) {
            return Ok(());
        }
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => {
                let numbers = self.data.numbers(indices, "SCALAR")?;
                let inside = |index: &f64| (0.0..vertices as f64).contains(index);
                if let Some(bad) = numbers.iter().position(|index| !inside(index)) {
                    let (face, index) = (bad / 3 + 1, numbers[bad] as i64);
                    return Err(Fault::FaceIndex { face, index, vertices }.anywhere());
                }
                numbers.iter().map(|&index| (base + index as usize) as u32).collect()
            }
            None => (base..base + vertices).map(|index| index as u32).collect(),
        };
        if raw.faces.triangles() + corners.len() > self.most_points {
            return Err(layout(REPEATED));
        }
        match primitive.mode {
            4 => corners.as_chunks::<3>().0.iter().for_each(|face| raw.faces.push(face)),
            5 => {
                for (i, w) in corners.windows(3).enumerate() {
                    raw.faces.push(&if i % 2 == 0 {
                        [w[0], w[1], w[2]]
                    } else {
                        [w[1], w[0], w[2]]
                    });
                }
            }
            _ => raw.faces.push(&corners),
        }
        Ok(())
    }
}
