//! Rays and nearest points on meshes: the one place where our types meet parry's.
//!
//! parry speaks glam, the rest of the package nalgebra; both are `f64`, so that
//! nothing is lost on the way.

use parry3d_f64::math::Vec3;
use parry3d_f64::query::{IntersectResult, PointQuery as _, Ray, RayCast as _};
use parry3d_f64::shape::{HalfSpace, TriMesh, Triangle};

use super::mesh::Mesh;
use crate::base::{Point3, Vector3};

fn vec3(v: &Vector3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

fn vector3(v: Vec3) -> Vector3 {
    Vector3::new(v.x, v.y, v.z)
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, in lengths of its direction.
    pub distance: f64,
    /// Unit normal of the surface, towards the side that the ray comes from.
    pub normal: Vector3,
    /// The triangle hit; 0 for a shape without triangles.
    pub triangle: u32,
}

/// Why rays cannot be cast on a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// It has no triangles.
    #[error("the mesh has no triangles")]
    NoTriangles,
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} of the mesh names vertex {vertex}, but there are {vertices}")]
    NoVertex {
        /// Which triangle, counted from 0.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
}

/// A mesh, ready for many rays and nearest-point queries. Both sides count.
pub struct MeshIndex {
    mesh: TriMesh,
}

impl MeshIndex {
    /// Builds the hierarchy.
    ///
    /// # Errors
    /// When the mesh has no triangles, or one that names a vertex that is not there.
    pub fn new(mesh: &Mesh) -> Result<Self, MeshError> {
        let vertices = mesh.vertices.len();
        let corners = mesh.triangles.as_flattened().iter();
        let missing = corners.enumerate().find(|(_, vertex)| **vertex as usize >= vertices);
        if let Some((k, &vertex)) = missing {
            return Err(MeshError::NoVertex { triangle: k / 3, vertex, vertices });
        }
        let vertices = mesh.vertices.iter().map(|p| vec3(&p.coords)).collect();
        let mesh = TriMesh::new(vertices, mesh.triangles.clone());
        Ok(Self { mesh: mesh.map_err(|_| MeshError::NoTriangles)? })
    }

    /// The first point of the mesh on a ray, no further than `most` lengths of
    /// `direction`.
    #[must_use]
    pub fn cast(&self, origin: &Point3, direction: &Vector3, most: f64) -> Option<Hit> {
        let ray = Ray::new(vec3(&origin.coords), vec3(direction));
        let hit = self.mesh.cast_local_ray_and_get_normal(&ray, most, false)?;
        let normal = vector3(hit.normal);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(Hit { distance: hit.time_of_impact, normal, triangle: hit.subshape })
    }

    /// The line in which a plane cuts the mesh, as segments in no order: the places whose product
    /// with the unit vector `normal` is `bias` \[m\].
    #[must_use]
    pub fn cut(&self, normal: &Vector3, bias: f64) -> Vec<[Point3; 2]> {
        let at = |p: Vec3| Point3::from(vector3(p));
        match self.mesh.intersection_with_local_plane(vec3(normal), bias, 0.0) {
            IntersectResult::Intersect(line) => {
                line.segments().map(|s| [at(s.a), at(s.b)]).collect()
            }
            IntersectResult::Negative | IntersectResult::Positive => Vec::new(),
        }
    }

    /// The point of the mesh nearest to `point`.
    #[must_use]
    pub fn nearest(&self, point: &Point3) -> Point3 {
        let near = self.mesh.project_local_point(vec3(&point.coords), false);
        Point3::from(vector3(near.point))
    }
}

/// Every triangle that a ray meets, nearest first: distance in lengths of `direction`,
/// and the triangle. For a few rays; for many build a [`MeshIndex`].
#[must_use]
pub fn hits(mesh: &Mesh, origin: &Point3, direction: &Vector3) -> Vec<(f64, u32)> {
    let ray = Ray::new(vec3(&origin.coords), vec3(direction));
    let cast = |(face, corners): (u32, &[u32; 3])| {
        let [a, b, c] = corners.map(|v| vec3(&mesh.vertices[v as usize].coords));
        let distance = Triangle::new(a, b, c).cast_local_ray(&ray, f64::MAX, false)?;
        Some((distance, face))
    };
    let mut hits: Vec<(f64, u32)> = (0_u32..).zip(&mesh.triangles).filter_map(cast).collect();
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    hits
}

/// Where a ray from above meets the horizontal plane y = `y_m`.
#[must_use]
pub fn cast_on_floor(origin: &Point3, direction: &Vector3, y_m: f64, most: f64) -> Option<Hit> {
    let above = vec3(&(origin.coords - Vector3::new(0.0, y_m, 0.0)));
    let ray = Ray::new(above, vec3(direction));
    let hit = HalfSpace::new(Vec3::Y).cast_local_ray_and_get_normal(&ray, most, false)?;
    Some(Hit { distance: hit.time_of_impact, normal: vector3(hit.normal), triangle: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        let vertices = vec![Point3::origin(), Point3::new(1., 0., 0.), Point3::new(0., 1., 0.)];
        Mesh { vertices, triangles: vec![[0, 1, 2]] }
    }

    #[test]
    fn rays_hit_from_both_sides_with_the_normal_towards_them() {
        let index = MeshIndex::new(&triangle()).unwrap();
        for side in [1.0, -1.0] {
            let origin = Point3::new(0.25, 0.25, 2.0 * side);
            let hit = index.cast(&origin, &Vector3::new(0., 0., -side), 10.0).unwrap();
            assert!((hit.distance - 2.0).abs() < 1e-12);
            assert!((hit.normal - Vector3::new(0., 0., side)).norm() < 1e-12);
            assert!(index.cast(&origin, &Vector3::new(0., 0., side), 10.0).is_none());
            assert!(index.cast(&origin, &Vector3::new(0., 0., -side), 1.9).is_none());
        }
    }

    #[test]
    fn all_triangles_on_a_ray_are_hit_in_order() {
        let mut mesh = triangle();
        mesh.vertices.extend(triangle().vertices.iter().map(|p| p + Vector3::z()));
        mesh.triangles.push([3, 4, 5]);
        let all = hits(&mesh, &Point3::new(0.25, 0.25, 3.0), &-Vector3::z());
        assert_eq!(all.iter().map(|h| h.1).collect::<Vec<_>>(), [1, 0]);
        assert!((all[0].0 - 2.0).abs() < 1e-12 && (all[1].0 - 3.0).abs() < 1e-12);
        assert!(hits(&mesh, &Point3::new(0.9, 0.9, 3.0), &-Vector3::z()).is_empty());
    }

    #[test]
    fn the_nearest_point_is_on_the_triangle() {
        let index = MeshIndex::new(&triangle()).unwrap();
        let near = index.nearest(&Point3::new(1.0, 1.0, 3.0));
        assert!((near - Point3::new(0.5, 0.5, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let fault = |mesh: &Mesh| MeshIndex::new(mesh).err().unwrap();
        assert_eq!(fault(&Mesh::default()), MeshError::NoTriangles);
        let beyond = Mesh { triangles: vec![[0, 1, 2], [0, 1, 7]], ..triangle() };
        let wanted = MeshError::NoVertex { triangle: 1, vertex: 7, vertices: 3 };
        assert_eq!(fault(&beyond), wanted);
    }

    #[test]
    fn the_floor_is_met_from_above() {
        let origin = Point3::new(3.0, 1.0, 0.0);
        let hit = cast_on_floor(&origin, &Vector3::new(0.0, -0.5, 0.0), -0.5, 10.0).unwrap();
        assert!((hit.distance - 3.0).abs() < 1e-12);
        assert!(cast_on_floor(&origin, &Vector3::new(0.0, 0.5, 0.0), -0.5, 10.0).is_none());
    }
}
