//! Planes through points, and axes in a plane.

use nalgebra::{Matrix3, SymmetricEigen};

use crate::base::{Point3, Vector3};

/// Mean, normal (smallest axis) and the three variances of points, smallest first; `None`
/// of fewer than three.
pub(super) fn principal(
    points: impl Iterator<Item = Point3> + Clone,
) -> Option<(Point3, Vector3, [f64; 3])> {
    let count = points.clone().count();
    if count < 3 {
        return None;
    }
    let mean = points.clone().fold(Vector3::zeros(), |s, p| s + p.coords) / count as f64;
    let covariance = points.fold(Matrix3::zeros(), |m, p| {
        let d = p.coords - mean;
        m + d * d.transpose()
    }) / count as f64;
    let eigen = SymmetricEigen::new(covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let normal = eigen.eigenvectors.column(order[0]).into_owned();
    Some((Point3::from(mean), normal, order.map(|k| eigen.eigenvalues[k].max(0.0))))
}

/// Two axes that make `(u, up, v)` right-handed with v = u x up.
pub(super) fn horizontal_axes(up: &Vector3, hint: &Vector3) -> (Vector3, Vector3) {
    let flat = |v: &Vector3| v - up * v.dot(up);
    let u = [*hint, Vector3::x(), Vector3::y(), Vector3::z()]
        .iter()
        .map(flat)
        .find(|v| v.norm() > 0.5)
        .unwrap_or_else(|| flat(&Vector3::x()))
        .normalize();
    (u, u.cross(up))
}
