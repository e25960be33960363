//! What every input must satisfy: no panic, nothing larger than the bytes allow, and
//! what is read is what it promises to be. `tests/io/fuzz.rs` holds the same on a
//! fixed number of damaged files.

use scan2params::io;

/// A scan of the format that goes by `extension`.
pub fn scan(data: &[u8], extension: &str) {
    let Ok((cloud, notes)) = io::read_scan_bytes(data, extension) else {
        return;
    };
    // Deflate gives 1032 bytes for one, two to a pixel; LZF 88, one to a point.
    let most = if extension == "png" { 520 } else { 88 };
    assert!(notes.points_in_file <= most * data.len());
    assert!(cloud.triangles.len() <= data.len());
    let points = cloud.points.len() as u32;
    assert!(points > 0 && cloud.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
    assert!(cloud.triangles.iter().flatten().all(|&vertex| vertex < points));
    assert!(cloud.colors.is_empty() || cloud.colors.len() == cloud.points.len());
}

/// A `views.json`; the files that it names are not there.
pub fn views(data: &[u8]) {
    if let Ok(files) = io::read_views_bytes(data) {
        assert!((2..=data.len()).contains(&files));
    }
}

/// A camera's file.
pub fn intrinsics(data: &[u8]) {
    if let Ok(camera) = io::intrinsics::read_bytes(data) {
        assert!(camera.focal_px.iter().all(|f| *f > 0.0 && f.is_finite()));
        let _ = camera.ray(100.0, -3.0);
    }
}

/// A table of densities.
pub fn density_csv(data: &[u8]) {
    if let Ok(rows) = io::density_csv::read_bytes(data) {
        assert!(!rows.is_empty() && rows.iter().all(|row| row.density_g_m2.is_finite()));
    }
}

/// A boundary that was corrected by hand.
pub fn boundary_csv(data: &[u8]) {
    if let Ok(boundary) = io::boundary_csv::read_bytes(data) {
        assert!(boundary.positions_m().all(|p| p.iter().all(|c| c.is_finite())));
    }
}
