//! A triangle mesh and a point cloud: positions in metres unless said otherwise.

use crate::base::Point3;

/// Triangles on shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions \[m\].
    pub vertices: Vec<Point3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The mesh without the vertices that no triangle names; the others keep their order.
    #[must_use]
    pub fn without_stray_vertices(mut self) -> Self {
        let mut used = vec![false; self.vertices.len()];
        for &vertex in self.triangles.iter().flatten() {
            used[vertex as usize] = true;
        }
        if used.iter().all(|&used| used) {
            return self;
        }
        let mut kept = 0;
        let new_index: Vec<u32> = used
            .iter()
            .map(|&used| {
                kept += u32::from(used);
                // That of a stray vertex is never used.
                kept.wrapping_sub(1)
            })
            .collect();
        let mut at = used.iter();
        self.vertices.retain(|_| at.next() == Some(&true));
        for vertex in self.triangles.iter_mut().flatten() {
            *vertex = new_index[*vertex as usize];
        }
        self
    }
}

/// Points, with what the file gave beside them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Positions; in the file's unit when fresh from a reader, else \[m\].
    pub points: Vec<Point3>,
    /// Red, green, blue of each point; empty if the source has none.
    pub colors: Vec<[u8; 3]>,
    /// Triangles on the points; empty for a bare cloud.
    pub triangles: Vec<[u32; 3]>,
}

impl Cloud {
    /// The part that lies inside of something: points with their colours, triangles on them. A
    /// corner of triangles that are all cut off goes with them, inside or not.
    #[must_use]
    pub fn part(&self, is_inside: impl Fn(&Point3) -> bool) -> Self {
        let mut kept: Vec<bool> = self.points.iter().map(is_inside).collect();
        let is_within = |t: &[u32; 3]| t.iter().all(|&v| kept.get(v as usize) == Some(&true));
        let (within, cut): (Vec<_>, Vec<_>) = self.triangles.iter().copied().partition(is_within);
        for (triangles, keep) in [(&cut, false), (&within, true)] {
            for &vertex in triangles.iter().flatten() {
                if let Some(kept) = kept.get_mut(vertex as usize) {
                    *kept = keep;
                }
            }
        }
        let mut next = 0;
        let numbers: Vec<u32> = kept
            .iter()
            .map(|&kept| {
                let number = next;
                next += u32::from(kept);
                number
            })
            .collect();
        let mut points = self.points.clone();
        retain(&mut points, &kept);
        let mut colors = self.colors.clone();
        if colors.len() == kept.len() {
            retain(&mut colors, &kept);
        }
        let triangles = within.into_iter().map(|t| t.map(|v| numbers[v as usize])).collect();
        Self { points, colors, triangles }
    }
}

/// Leaves the items that are kept.
pub fn retain<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    items.retain(|_| kept.next() == Some(&true));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stray_vertices_go_and_the_triangles_stay() {
        let at = |x: f64| Point3::new(x, 0.0, 0.0);
        let mesh = Mesh {
            vertices: [9.0, 1.0, 2.0, 9.0, 4.0, 5.0, 9.0].map(at).to_vec(),
            triangles: vec![[4, 1, 2], [2, 5, 4]],
        };
        let corners = |mesh: &Mesh| -> Vec<[f64; 3]> {
            mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices[v as usize].x)).collect()
        };
        let clean = mesh.clone().without_stray_vertices();
        assert_eq!(clean.vertices, [1.0, 2.0, 4.0, 5.0].map(at));
        assert_eq!(corners(&clean), corners(&mesh));
        assert_eq!(clean.clone().without_stray_vertices(), clean);
    }
}
