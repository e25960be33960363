//! Neighbour queries: the one place where points meet kiddo's k-d tree.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::base::Point3;

/// A k-d tree over points that stay in place.
pub struct Neighbours {
    tree: Option<ImmutableKdTree<f64, 3>>,
}

/// A point of the tree, as a query finds it.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour {
    /// Its place in the list that the tree was made of.
    pub index: usize,
    /// The square of its distance from the place asked for.
    pub distance_sq: f64,
}

impl Neighbour {
    /// Its distance from the place asked for.
    #[must_use]
    pub fn distance(&self) -> f64 {
        self.distance_sq.sqrt()
    }
}

impl Neighbours {
    /// The tree of `points`; of none, every query is empty.
    #[must_use]
    pub fn new(points: &[Point3]) -> Self {
        let rows: Vec<[f64; 3]> = points.iter().map(|p| [p.x, p.y, p.z]).collect();
        let tree = if rows.is_empty() { None } else { ImmutableKdTree::new_from_slice(&rows).ok() };
        Self { tree }
    }

    /// Indices of the points within `radius` of `at`, in the order of the tree, which depends on
    /// the points alone. (To sort them took a sixth of the whole scan path.)
    #[must_use]
    pub fn within(&self, at: &Point3, radius: f64) -> Vec<usize> {
        let Some(tree) = &self.tree else { return Vec::new() };
        tree.query(&[at.x, at.y, at.z])
            .within::<SquaredEuclidean<f64>>(radius * radius)
            .unsorted()
            .execute()
            .iter()
            .map(|item| item.item as usize)
            .collect()
    }

    /// The `count` nearest points, nearest first.
    #[must_use]
    pub fn nearest(&self, at: &Point3, count: usize) -> Vec<Neighbour> {
        let (Some(tree), Some(count)) = (&self.tree, NonZero::new(count)) else {
            return Vec::new();
        };
        tree.query(&[at.x, at.y, at.z])
            .nearest_n::<SquaredEuclidean<f64>>(count)
            .execute()
            .iter()
            .map(|item| Neighbour { index: item.item as usize, distance_sq: item.distance })
            .collect()
    }

    /// The nearest point; `None` of no points.
    #[must_use]
    pub fn one(&self, at: &Point3) -> Option<Neighbour> {
        self.nearest(at, 1).first().copied()
    }
}
