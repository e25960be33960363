//! GLB: binary glTF 2.0, as tablets' scanning apps export it.
//!
//! Every mesh of the scene, moved by its nodes, in metres with y up (glTF 2.0
//! specification, sections 3.5 to 3.7 and 4). Positions may be quantised
//! (KHR_mesh_quantization). Read by hand: a crate for it would bring its own tree
//! of the whole format, and bounds that are checked here against the file's bytes.
//!
//! Refused, with what to do: sparse accessors, Draco and meshopt compression, data
//! outside the file. Left out: materials, textures, skins, morphs, lines.

use std::collections::HashMap;

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::assemble::Raw;
use super::error::shown;
use super::{At, Fault};
use crate::base::Point3;

const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;
/// Extensions that do not change where the points are.
const HARMLESS: [&str; 6] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_xmp",
];

const REPEATED: &str =
    "the scene repeats its meshes to more than the file has bytes; export the specimen once";

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let (json, data) = chunks(bytes)?;
    let document: Document = serde_json::from_slice(json).map_err(|error| {
        layout(format!("the GLB's JSON cannot be read ({error}); export the scene again"))
    })?;
    document.check_required()?;
    Scene { document: &document, data, most_points: bytes.len() }.read()
}

fn layout(fault: impl Into<String>) -> At {
    Fault::Layout(fault.into()).anywhere()
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

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Document {
    scene: Option<usize>,
    #[serde(default)]
    scenes: Vec<SceneRoots>,
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    meshes: Vec<Mesh>,
    #[serde(default)]
    accessors: Vec<Accessor>,
    #[serde(default)]
    buffer_views: Vec<BufferView>,
    #[serde(default)]
    buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct SceneRoots {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
struct Node {
    #[serde(default)]
    children: Vec<usize>,
    mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: HashMap<String, usize>,
    indices: Option<usize>,
    #[serde(default = "triangles")]
    mode: u32,
    #[serde(default)]
    extensions: HashMap<String, serde_json::Value>,
}

fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    #[serde(default)]
    normalized: bool,
    count: usize,
    #[serde(rename = "type")]
    kind: String,
    sparse: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct BufferView {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
    #[serde(default)]
    extensions: HashMap<String, serde_json::Value>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

impl Document {
    fn check_required(&self) -> Result<(), At> {
        let unknown = |name: &&String| !HARMLESS.iter().any(|known| name.starts_with(known));
        match self.extensions_required.iter().find(unknown) {
            Some(name) if name.contains("draco") || name.contains("meshopt") => {
                Err(compressed(name))
            }
            Some(name) => Err(layout(format!(
                "the GLB needs the extension `{}`, which is not read; export it without",
                shown(name.as_bytes())
            ))),
            None => Ok(()),
        }
    }

    fn roots(&self) -> Vec<usize> {
        if let Some(scene) = self.scenes.get(self.scene.unwrap_or(0)) {
            return scene.nodes.clone();
        }
        let mut is_child = vec![false; self.nodes.len()];
        for &child in self.nodes.iter().flat_map(|node| &node.children) {
            if let Some(flag) = is_child.get_mut(child) {
                *flag = true;
            }
        }
        (0..self.nodes.len()).filter(|&node| !is_child[node]).collect()
    }
}

fn compressed(name: &str) -> At {
    let name = shown(name.as_bytes());
    layout(format!("the GLB's meshes are compressed ({name}); export it without compression"))
}

impl Node {
    /// From the node's frame to its parent's.
    fn motion(&self) -> Matrix4<f64> {
        if let Some(columns) = self.matrix {
            return Matrix4::from_column_slice(&columns);
        }
        let shift = Matrix4::new_translation(&Vector3::from(self.translation.unwrap_or([0.0; 3])));
        let turn = self.rotation.map_or_else(UnitQuaternion::identity, |[x, y, z, w]| {
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
        });
        let scale = Vector3::from(self.scale.unwrap_or([1.0; 3]));
        shift * turn.to_homogeneous() * Matrix4::new_nonuniform_scaling(&scale)
    }
}

struct Scene<'a> {
    document: &'a Document,
    data: &'a [u8],
    /// A point takes 3 bytes at least; a mesh shown by many nodes must not grow
    /// beyond the file.
    most_points: usize,
}

impl Scene<'_> {
    fn read(&self) -> Result<Raw, At> {
        let nodes = &self.document.nodes;
        let mut raw = Raw::default();
        let mut colored = true;
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<(usize, Matrix4<f64>)> =
            self.document.roots().into_iter().map(|root| (root, Matrix4::identity())).collect();
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
                let meshes = &self.document.meshes;
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
            let count = self.accessor(positions)?.count;
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
        if let (Some(name), None) = (draco, self.accessor(accessor)?.buffer_view) {
            return Err(compressed(name));
        }
        let numbers = self.numbers(accessor, "VEC3")?;
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
        let accessor = self.accessor(index)?;
        let kind = if accessor.kind == "VEC4" { "VEC4" } else { "VEC3" };
        if accessor.count != count {
            return Ok(false);
        }
        let numbers = self.numbers(index, kind)?;
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
                let numbers = self.numbers(indices, "SCALAR")?;
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

    fn accessor(&self, index: usize) -> Result<&Accessor, At> {
        self.document.accessors.get(index).ok_or_else(|| missing("accessor", index))
    }

    /// The numbers of an accessor, one component after another.
    fn numbers(&self, index: usize, kind: &str) -> Result<Vec<f64>, At> {
        let accessor = self.accessor(index)?;
        if accessor.sparse.is_some() {
            return Err(layout(format!(
                "accessor {index} is sparse; export the mesh as plain GLB"
            )));
        }
        if accessor.kind != kind {
            let found = shown(accessor.kind.as_bytes());
            return Err(layout(format!(
                "accessor {index} is {found}, not {kind}; export it again"
            )));
        }
        let Some(component) = Component::of(accessor.component_type) else {
            let found = accessor.component_type;
            return Err(layout(format!(
                "accessor {index} has component type {found}, none of glTF's"
            )));
        };
        let Some(view) = accessor.buffer_view else {
            return Err(layout(format!("accessor {index} has no data; export the mesh again")));
        };
        let (bytes, stride) = self.view(view)?;
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let size = component.bytes() * width;
        let stride = stride.unwrap_or(size).max(size);
        let bytes = bytes.get(accessor.byte_offset..).unwrap_or_default();
        let has = if bytes.len() < size { 0 } else { (bytes.len() - size) / stride + 1 };
        if accessor.count > has {
            let (count, needs) = (accessor.count as u64, accessor.count as u128 * size as u128);
            let element = format!("accessor {index}");
            return Err(Fault::Count { element, count, needs, has: bytes.len() }.anywhere());
        }
        let scale = component.full_scale().filter(|_| accessor.normalized);
        let mut numbers = Vec::with_capacity(accessor.count * width);
        for element in 0..accessor.count {
            for part in 0..width {
                let at = element * stride + part * component.bytes();
                let value = component.read(&bytes[at..]);
                numbers.push(scale.map_or(value, |scale| (value / scale).max(-1.0)));
            }
        }
        Ok(numbers)
    }

    /// The bytes of a buffer view, and its stride.
    fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), At> {
        let view = self.document.buffer_views.get(index).ok_or_else(|| missing("view", index))?;
        if let Some(name) = view.extensions.keys().find(|name| name.contains("meshopt")) {
            return Err(compressed(name));
        }
        let buffers = &self.document.buffers;
        let buffer = buffers.get(view.buffer).ok_or_else(|| missing("buffer", view.buffer))?;
        if view.buffer != 0 || buffer.uri.is_some() {
            let what =
                "the GLB keeps its data in another file; export it as one self-contained .glb";
            return Err(layout(what));
        }
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| self.data.get(view.byte_offset..end)).ok_or_else(|| {
            layout(format!(
                "buffer view {index} reaches beyond the file's {} bytes of data; copy or export it \
                 again",
                self.data.len()
            ))
        })?;
        Ok((bytes, view.byte_stride))
    }
}

fn missing(what: &str, index: usize) -> At {
    layout(format!("the GLB names {what} {index}, which is not there; export the scene again"))
}

#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// What a normalised integer counts as 1; `None` for what is never normalised.
    fn full_scale(self) -> Option<f64> {
        match self {
            Self::I8 => Some(f64::from(i8::MAX)),
            Self::U8 => Some(f64::from(u8::MAX)),
            Self::I16 => Some(f64::from(i16::MAX)),
            Self::U16 => Some(f64::from(u16::MAX)),
            Self::U32 | Self::F32 => None,
        }
    }

    /// The first component of `bytes`, which has enough of them.
    fn read(self, bytes: &[u8]) -> f64 {
        let two = || bytes.first_chunk().copied().unwrap_or_default();
        let four = || bytes.first_chunk().copied().unwrap_or_default();
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(two())),
            Self::U16 => f64::from(u16::from_le_bytes(two())),
            Self::U32 => f64::from(u32::from_le_bytes(four())),
            Self::F32 => f64::from(f32::from_le_bytes(four())),
        }
    }
}
