//! A virtual scan as depth images with their poses, as `io` reads them back.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::{Truth, VirtualScan};
use crate::io::{self, VIEWS_FILE, VIEWS_SCHEMA, WriteError};

/// Units in a metre that a 16-bit depth may have, finest first.
const SCALES: [f64; 6] = [1e5, 5e4, 2e4, 1e4, 5e3, 1e3];

impl VirtualScan {
    /// Writes each view as `view-NN.png` (16 bits), and `views.json` with camera,
    /// unit and the poses that the scanner estimates, in the scanner's
    /// frame \[m\]. Nothing is fused or downsampled. Returns the list's path, and what
    /// is true of the points that are read from it.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write_views(&self, folder: &Path) -> Result<(PathBuf, Truth), WriteError> {
        std::fs::create_dir_all(folder)
            .map_err(|source| WriteError { path: folder.to_owned(), source })?;
        let depths = || self.views.iter().flat_map(|view| &view.depth_m);
        let most_m = depths().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        let fits = |scale: &f64| most_m * scale < f64::from(u16::MAX) - 1.0;
        let scale = SCALES.into_iter().find(fits).unwrap_or(SCALES[SCALES.len() - 1]);
        let scanner_from_simulation = self.truth.simulation_from_scanner.inverse();
        let mut list = Vec::with_capacity(self.views.len());
        for (number, view) in self.views.iter().enumerate() {
            let name = format!("view-{number:02}.png");
            io::write_depth_png(folder.join(&name), view.camera.width, &view.depth_m, scale)?;
            let pose = scanner_from_simulation * view.pose_believed.simulation_from_camera;
            let rows = pose.to_homogeneous().transpose();
            let rows: Vec<&[f64]> = rows.as_slice().chunks(4).collect();
            list.push(json!({ "file": name, "world_from_camera": rows }));
        }
        let camera = self.views.first().map(|view| {
            let camera = view.camera;
            json!({
                "width": camera.width,
                "height": camera.height,
                "fx": camera.focal_px,
                "fy": camera.focal_px,
                "cx": 0.5 * (camera.width as f64 - 1.0),
                "cy": 0.5 * (camera.height as f64 - 1.0),
            })
        });
        let document = json!({
            "schema": VIEWS_SCHEMA,
            "intrinsics": camera,
            "depth_scale": scale,
            "views": list,
        });
        let path = folder.join(VIEWS_FILE);
        io::atomically(&path, |out| {
            serde_json::to_writer_pretty(&mut *out, &document)?;
            writeln!(out)
        })?;
        Ok((path, Truth { unit_m: 1.0, ..self.truth }))
    }
}
