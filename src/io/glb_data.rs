//! The data of a GLB: its JSON as types, and the numbers of its accessors, each held
//! against the bytes that are there.

use std::collections::HashMap;

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::error::shown;
use super::{At, Fault};

/// Extensions that do not change where the points are.
const HARMLESS: [&str; 6] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_xmp",
];

pub(super) fn layout(fault: impl Into<String>) -> At {
    Fault::Layout(fault.into()).anywhere()
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    pub(super) scene: Option<usize>,
    #[serde(default)]
    pub(super) scenes: Vec<SceneRoots>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    pub(super) extensions_required: Vec<String>,
}

#[derive(Deserialize)]
pub(super) struct SceneRoots {
    #[serde(default)]
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: HashMap<String, usize>,
    pub(super) indices: Option<usize>,
    #[serde(default = "triangles")]
    pub(super) mode: u32,
    #[serde(default)]
    pub(super) extensions: HashMap<String, serde_json::Value>,
}

fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
    #[serde(default)]
    pub(super) extensions: HashMap<String, serde_json::Value>,
}

#[derive(Deserialize)]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
}

impl Document {
    pub(super) fn check_required(&self) -> Result<(), At> {
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

    /// The nodes that the scene starts from.
    pub(super) fn roots(&self) -> Vec<usize> {
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

pub(super) fn compressed(name: &str) -> At {
    let name = shown(name.as_bytes());
    layout(format!("the GLB's meshes are compressed ({name}); export it without compression"))
}

impl Node {
    /// From the node's frame to its parent's.
    pub(super) fn motion(&self) -> Matrix4<f64> {
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

/// A document and the bytes that it describes.
pub(super) struct Data<'a> {
    pub(super) document: &'a Document,
    pub(super) bytes: &'a [u8],
}

impl Data<'_> {
    pub(super) fn accessor(&self, index: usize) -> Result<&Accessor, At> {
        self.document.accessors.get(index).ok_or_else(|| missing("accessor", index))
    }

    /// The numbers of an accessor, one component after another.
    pub(super) fn numbers(&self, index: usize, kind: &str) -> Result<Vec<f64>, At> {
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
        let bytes = end.and_then(|end| self.bytes.get(view.byte_offset..end)).ok_or_else(|| {
            layout(format!(
                "buffer view {index} reaches beyond the file's {} bytes of data; copy or export it \
                 again",
                self.bytes.len()
            ))
        })?;
        Ok((bytes, view.byte_stride))
    }
}

pub(super) fn missing(what: &str, index: usize) -> At {
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
