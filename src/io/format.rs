//! The formats that are read, and how each is known.

use std::path::Path;

use serde::Serialize;

/// The formats that [`super::read_scan`] reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Format {
    /// Polygon file format: ascii, binary of both byte orders.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Point cloud library: ascii, binary, `binary_compressed`.
    Pcd,
    /// Stereolithography: ascii, binary.
    Stl,
    /// Binary glTF 2.0.
    Glb,
    /// ASTM E2807: Cartesian and spherical scans with their poses.
    E57,
    /// ASPRS LAS, and LAZ, which is LAS compressed.
    Las,
    /// Lines of `x y z`, with or without colours.
    Xyz,
    /// A 16-bit depth image.
    DepthPng,
    /// A `views.json`, or a folder of views.
    Views,
}

/// Extensions read, for messages.
pub const SUPPORTED: &str = ".ply, .obj, .pcd, .stl, .glb, .e57, .las, .laz, .xyz, .asc, .pts, .txt, .csv, .png (16-bit depth), views.json";

impl Format {
    pub(super) fn of_extension(path: &Path) -> Option<Self> {
        Self::named(path.extension()?.to_str()?)
    }

    /// The format of files whose names end so: `ply`, `XYZ`.
    #[must_use]
    pub fn named(extension: &str) -> Option<Self> {
        Some(match extension.to_ascii_lowercase().as_str() {
            "ply" => Self::Ply,
            "obj" => Self::Obj,
            "pcd" => Self::Pcd,
            "stl" => Self::Stl,
            "glb" => Self::Glb,
            "e57" => Self::E57,
            "las" | "laz" => Self::Las,
            "png" => Self::DepthPng,
            "json" => Self::Views,
            "xyz" | "asc" | "pts" | "txt" | "csv" => Self::Xyz,
            _ => return None,
        })
    }

    /// The format that the first bytes give away; OBJ and XYZ have no mark.
    pub(super) fn of_content(bytes: &[u8]) -> Option<Self> {
        let starts = |mark: &[u8]| bytes.starts_with(mark);
        if starts(b"ply\n") || starts(b"ply\r") || starts(b"ply ") {
            Some(Self::Ply)
        } else if starts(b"# .PCD") || starts(b"VERSION .7") || starts(b"VERSION 0.7") {
            Some(Self::Pcd)
        } else if starts(b"glTF") {
            Some(Self::Glb)
        } else if starts(b"ASTM-E57") {
            Some(Self::E57)
        } else if starts(b"LASF") {
            Some(Self::Las)
        } else if starts(b"\x89PNG") {
            Some(Self::DepthPng)
        } else {
            None
        }
    }

    /// The extension by which the format goes.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => ".ply",
            Self::Obj => ".obj",
            Self::Pcd => ".pcd",
            Self::Stl => ".stl",
            Self::Glb => ".glb",
            Self::E57 => ".e57",
            Self::Las => ".las",
            Self::Xyz => ".xyz",
            Self::DepthPng => ".png",
            Self::Views => ".json",
        }
    }
}

/// What to export in place of a format that is not read; docs/formats.md has a row for each app.
pub(super) fn export_instead(extension: &str) -> Option<&'static str> {
    Some(match extension.to_ascii_lowercase().as_str() {
        "usdz" | "usd" | "usda" | "usdc" | "gltf" | "fbx" | "dae" | "3mf" | "blend" => {
            "export the mesh as GLB or PLY, or the point cloud as PLY (docs/formats.md, \"Scanning apps\")"
        }
        "r3d" => {
            "in Record3D export the frames as PLY, or as depth images with their camera (docs/formats.md, \
             \"Scanning apps\")"
        }
        "spz" | "splat" | "ksplat" | "sog" => SPLATS,
        "ptx" | "rcp" | "rcs" | "lgs" | "lgsx" | "fls" | "zfs" | "dxf" | "dwg" => {
            "export the point cloud as E57, LAS or PLY"
        }
        "zip" | "gz" | "7z" | "rar" | "tar" => "unpack it first",
        "exr" | "tif" | "tiff" | "npy" | "npz" | "raw" | "pfm" => {
            "write depths as a PNG of 16 bits and one channel, in mm"
        }
        _ => return None,
    })
}

/// The error for Gaussian splats.
pub(super) const SPLATS: &str = "they hold Gaussian splats, which look like the scene and do not lie on its \
     surface: scan by LiDAR or in mesh mode, and export a mesh or a point cloud (docs/formats.md, \"Scanning apps\")";

/// What a file is known to be when it is none of ours, for the remedy.
pub(super) fn foreign_content(bytes: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 4] = [
        (b"\x1f\x8b", "gzip-compressed data; unpack it first"),
        (b"PK\x03\x04", "a zip archive; unpack it first"),
        (b"\xff\xd8\xff", "a JPEG image, not a point cloud"),
        (b"version https://git-lfs", "a Git LFS pointer; run `git lfs pull`"),
    ];
    known.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, name)| *name)
}
