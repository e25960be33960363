//! What is before the camera: the drape, its stand (plate, pedestal, floor), and the things around.

use super::solids::Solid;
use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use crate::base::{Point3, Vector3};
use crate::geom::parry::cast_on_floor;
use crate::geom::{Hit, Mesh, MeshError, MeshIndex};

/// A drape on its stand, in the simulation frame.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The cloth \[m\].
    pub drape: Mesh,
    /// Colour of each vertex of the cloth; empty for [`Scene::CLOTH_COLOR`].
    pub cloth_colors: Vec<[u8; 3]>,
    /// What it lies on.
    pub stand: Stand,
    /// What stands around it.
    pub things: Vec<Thing>,
}

/// Something that stands around a drape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thing {
    /// Its shape, simulation frame \[m\].
    pub solid: Solid,
    /// Its colour.
    pub color: [u8; 3],
}

/// What carries the plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// An upright cylinder of [`Stand::pedestal_radius_m`].
    Column,
    /// An upright box; its horizontal sides are twice [`Stand::pedestal_radius_m`].
    Box,
    /// A glass: [`Stand::pedestal_radius_m`] wide under the plate, and this at its foot \[m\].
    Cone {
        /// Radius of the foot.
        foot_radius_m: f64,
    },
    /// Neither a support nor a plate.
    Nothing,
}

/// What the cloth lies on: a plate with an underside, on a column, on a table or on
/// nothing that is seen. All about the axis x = z = 0, simulation frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Radius of the plate, whose top face is y = 0 \[m\].
    pub plate_radius_m: f64,
    /// Thickness of the plate \[m\].
    pub plate_thickness_m: f64,
    /// Radius of the plate's rounded upper edge, at most its thickness; 0 for a sharp edge \[m\].
    pub plate_rounding_m: f64,
    /// What carries the plate.
    pub support: Support,
    /// Radius of the column that carries the plate, see [`Support`] \[m\].
    pub pedestal_radius_m: f64,
    /// Height of the floor and of the column's foot, below the lowest point of the
    /// cloth \[m\].
    pub floor_y_m: f64,
    /// The floor is a round table of this radius \[m\]; beyond it nothing is seen, and
    /// with a radius of 0 there is no floor.
    pub floor_radius_m: f64,
}

impl Stand {
    /// The stand of the modified Cusick drape: plate of radius 50 mm, 5 mm
    /// thick, on a column of radius 20 mm, 0.25 m above a table.
    pub const MODIFIED_CUSICK: Self = Self {
        plate_radius_m: PLATE_RADIUS_M,
        plate_thickness_m: 0.005,
        plate_rounding_m: 0.0,
        support: Support::Column,
        pedestal_radius_m: 0.020,
        floor_y_m: -0.25,
        floor_radius_m: 0.20,
    };
    /// A plate 6 mm thick on a post of radius 6 mm, held from far below: most of its
    /// underside shows from below, and no floor.
    pub const POST: Self = Self {
        plate_thickness_m: 0.006,
        pedestal_radius_m: 0.006,
        floor_y_m: -0.6,
        floor_radius_m: 0.0,
        ..Self::MODIFIED_CUSICK
    };
    /// A plate on a column nearly as wide, as on a jar, above a table.
    pub const PEDESTAL: Self = Self { pedestal_radius_m: 0.042, ..Self::MODIFIED_CUSICK };

    /// The plate and what carries it.
    #[must_use]
    pub fn solids(&self) -> Vec<(Solid, Surface)> {
        let Self { plate_radius_m: radius, pedestal_radius_m: half, .. } = *self;
        let (bottom, rounding) = (-self.plate_thickness_m, self.plate_rounding_m);
        let plate = match rounding {
            0.0 => Solid::Cylinder { radius, bottom, top: 0.0 },
            _ => Solid::Rounded { radius, bottom, top: 0.0, rounding },
        };
        let foot = self.floor_y_m;
        let support = match self.support {
            Support::Nothing => return Vec::new(),
            Support::Column => Solid::Cylinder { radius: half, bottom: foot, top: bottom },
            Support::Box => {
                let sides = [2.0 * half, bottom - foot, 2.0 * half];
                Solid::standing_block([0.0; 2], foot, sides, 0.0)
            }
            Support::Cone { foot_radius_m } => Solid::Cone {
                axis: [0.0; 2],
                radii: [foot_radius_m, half],
                heights: [foot, bottom],
            },
        };
        vec![(plate, Surface::Plate), (support, Surface::Pedestal)]
    }
}

/// A scene that cannot be scanned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// No triangles, or triangles of vertices that are not there.
    #[error("the drape cannot be scanned: {0}")]
    NoMesh(#[from] MeshError),
    /// A vertex that is NaN or infinite.
    #[error("vertex {0} of the drape is not finite")]
    NotFinite(usize),
    /// A size out of range.
    #[error("{key} is {value} m; it must lie in {low} to {high} m")]
    Size {
        /// The field.
        key: &'static str,
        /// Its value \[m\].
        value: f64,
        /// The least value \[m\].
        low: f64,
        /// The largest value \[m\].
        high: f64,
    },
    /// A mark needs to know where the specimen's sides are.
    #[error(
        "{0} vertices are no square grid, on which a side could be marked; simulate the drape anew"
    )]
    NoGrid(usize),
    /// Other than one colour per vertex.
    #[error("cloth_colors has {0} entries for {1} vertices")]
    Colors(usize, usize),
}

/// What a ray hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// The cloth, and which triangle of it.
    Cloth(u32),
    /// The plate.
    Plate,
    /// The column under the plate.
    Pedestal,
    /// The floor.
    Floor,
    /// One of the things around, by its place in the scene's list.
    Thing(u32),
}

impl Scene {
    /// Colour of a cloth without colours.
    pub const CLOTH_COLOR: [u8; 3] = [70, 110, 185];
    /// Colour of the plate and the pedestal.
    pub const STAND_COLOR: [u8; 3] = [205, 205, 200];
    /// Colour of the floor.
    pub const FLOOR_COLOR: [u8; 3] = [95, 85, 75];
    /// Size of a mark: from the edge inward, and along it \[m\].
    const MARK_M: [f64; 2] = [12e-3, 80e-3];

    /// A drape on the stand of the modified Cusick drape, [`Stand::MODIFIED_CUSICK`].
    #[must_use]
    pub fn modified_cusick(drape: Mesh) -> Self {
        Self::on(drape, Stand::MODIFIED_CUSICK)
    }

    /// A drape on a stand.
    #[must_use]
    pub fn on(drape: Mesh, stand: Stand) -> Self {
        Self { drape, cloth_colors: Vec::new(), stand, things: Vec::new() }
    }

    /// Marks the middle of the side to which the warp runs (x = +150 mm on the flat
    /// specimen) with a patch of 80 by 12 mm, as a garment technologist does with tape.
    /// The drape must be a square grid of vertices, weft fastest, as `sim` makes it.
    ///
    /// # Errors
    /// When it is none.
    pub fn mark_warp_side(&mut self, color: [u8; 3]) -> Result<(), SceneError> {
        let count = self.drape.vertices.len();
        let n = count.isqrt();
        if n < 5 || n * n != count {
            return Err(SceneError::NoGrid(count));
        }
        let step_m = SPECIMEN_SIDE_M / (n - 1) as f64;
        let marked = |i: usize| {
            let (inward_m, along_m) =
                ((n - 1 - i / n) as f64 * step_m, (i % n) as f64 * step_m - 0.5 * SPECIMEN_SIDE_M);
            inward_m < Self::MARK_M[0].max(1.5 * step_m) && along_m.abs() < 0.5 * Self::MARK_M[1]
        };
        let paint = |i| if marked(i) { color } else { Self::CLOTH_COLOR };
        self.cloth_colors = (0..count).map(paint).collect();
        Ok(())
    }

    pub(super) fn check(&self) -> Result<(), SceneError> {
        let vertices = &self.drape.vertices;
        if let Some(bad) = vertices.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(SceneError::NotFinite(bad));
        }
        if !self.cloth_colors.is_empty() && self.cloth_colors.len() != vertices.len() {
            return Err(SceneError::Colors(self.cloth_colors.len(), vertices.len()));
        }
        let lowest = vertices.iter().map(|p| p.y).fold(0.0, f64::min);
        let stand = &self.stand;
        // Under the cloth there is room for a plate, where there is one.
        let above_m = if stand.support == Support::Nothing { 0.0 } else { stand.plate_thickness_m };
        let sizes = [
            ("plate_radius_m", stand.plate_radius_m, 1e-3, 1.0),
            ("plate_thickness_m", stand.plate_thickness_m, 1e-4, 0.1),
            ("plate_rounding_m", stand.plate_rounding_m, 0.0, stand.plate_thickness_m),
            ("pedestal_radius_m", stand.pedestal_radius_m, 1e-4, stand.plate_radius_m),
            ("floor_y_m", stand.floor_y_m, -2.0, lowest - above_m),
            ("floor_radius_m", stand.floor_radius_m, 0.0, 10.0),
        ];
        match sizes.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value)) {
            Some((key, value, low, high)) => Err(SceneError::Size { key, value, low, high }),
            None => Ok(()),
        }
    }
}

/// A scene ready for rays.
pub(super) struct Stage<'a> {
    scene: &'a Scene,
    cloth: MeshIndex,
    /// The plate, what carries it, and the things around.
    parts: Vec<(Solid, Surface)>,
}

/// The cloth lies on the plate, and its mesh may cut into it by the simulator's
/// contact tolerance: where both are this close along a ray, the cloth is seen.
const CLOTH_WINS_M: f64 = 1e-3;

impl<'a> Stage<'a> {
    pub(super) fn new(scene: &'a Scene) -> Result<Self, SceneError> {
        scene.check()?;
        let cloth = MeshIndex::new(&scene.drape)?;
        let things = scene.things.iter().zip(0..).map(|(t, k)| (t.solid, Surface::Thing(k)));
        let parts = scene.stand.solids().into_iter().chain(things).collect();
        Ok(Self { scene, cloth, parts })
    }

    /// What a ray (unit direction) meets first within `most_m`.
    pub(super) fn cast(
        &self,
        origin: &Point3,
        ray: &Vector3,
        most_m: f64,
    ) -> Option<(Hit, Surface)> {
        let stand = &self.scene.stand;
        let on_table = |hit: &Hit| {
            let at = origin + ray * hit.distance;
            stand.floor_radius_m > 0.0 && at.x.hypot(at.z) <= stand.floor_radius_m
        };
        let floor = cast_on_floor(origin, ray, stand.floor_y_m, most_m).filter(on_table);
        let parts = self.parts.iter().map(|(solid, surface)| {
            let hit = solid.cast(origin, ray, most_m);
            (hit, *surface)
        });
        let nearest = parts
            .chain([(floor, Surface::Floor)])
            .filter_map(|(hit, surface)| Some((hit?, surface)))
            .min_by(|a, b| a.0.distance.total_cmp(&b.0.distance))
            .filter(|(hit, _)| hit.distance <= most_m);
        let reach = nearest.map_or(most_m, |(hit, _)| (hit.distance + CLOTH_WINS_M).min(most_m));
        let cloth = self.cloth.cast(origin, ray, reach);
        cloth.map(|hit| (hit, Surface::Cloth(hit.triangle))).or(nearest)
    }

    /// The colour of `surface` at `point`.
    pub(super) fn color(&self, surface: Surface, point: &Point3) -> [u8; 3] {
        match surface {
            Surface::Plate | Surface::Pedestal => Scene::STAND_COLOR,
            Surface::Floor => Scene::FLOOR_COLOR,
            Surface::Thing(thing) => self.scene.things[thing as usize].color,
            Surface::Cloth(_) if self.scene.cloth_colors.is_empty() => Scene::CLOTH_COLOR,
            Surface::Cloth(triangle) => {
                let corners = self.scene.drape.triangles[triangle as usize].map(|v| v as usize);
                let away = |v: &usize| (self.scene.drape.vertices[*v] - point).norm_squared();
                let near = corners.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)));
                near.map_or(Scene::CLOTH_COLOR, |vertex| self.scene.cloth_colors[vertex])
            }
        }
    }
}
