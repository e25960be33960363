//! The scan as points in metres, from any unit.
//!
//! A cloud's points are taken as they are. A mesh's vertices are not measurements
//! spread over a surface: a decimated mesh has few, and its free edge is known
//! better than any density of points tells it. So a mesh is sampled by area, and its
//! edges that belong to one triangle are handed on as the free edge
//! ([`super::loops`]); what an app closed underneath is cut away before
//! ([`super::underside`]).
//!
//! A box of the file to which the scan is cropped is cut out first: nothing else of the
//! file counts for its unit.
//!
//! In: a cloud in the file's unit. Out: points in metres, the scan's own frame.

use rayon::prelude::*;

use super::error::ScanError;
use super::hints::{Hints, Region};
use super::mesh_facts::{CutFacts, MeshFacts};
use super::options::ScanOptions;
use super::tuning::SceneTuning;
use super::unit::LengthUnit;
use super::{limits, plate, underside, unit_guess};
use crate::base::{Point3, Vector3};
use crate::geom::Neighbours;
use crate::geom::adjacency::{Sample, area_vector2, spread, weld};
use crate::geom::{Adjacency, Cloud, Mesh, retain};
use crate::numeric::robust;

/// A scan in metres, in its own frame.
pub(super) struct Scene {
    /// Points in the file.
    pub points_in_file: usize,
    /// The file's unit, given or guessed.
    pub unit: LengthUnit,
    /// Units that it may also be in, if the plate is not found in that one.
    pub other_units: Vec<LengthUnit>,
    /// Points of all surfaces.
    pub points: Vec<Point3>,
    /// Their colours; empty if the file has none or nobody asks for a mark.
    pub colors: Vec<[u8; 3]>,
    /// Points on edges of a single triangle; empty for a cloud.
    pub free_edge: Vec<Point3>,
    /// By how much a mesh's chords cut off folds \[m\]; 0 for a cloud.
    pub chord_m: f64,
    /// What was found in a mesh.
    pub mesh: Option<MeshFacts>,
}

/// Takes a scan.
pub(super) fn take(cloud: Cloud, options: &ScanOptions) -> Result<Scene, ScanError> {
    let points_in_file = cloud.points.len();
    let cloud = match Region::of_file(options) {
        Some(region) => cloud.part(|p| region.contains(p)),
        None => cloud,
    };
    let scene = match mesh_of(&cloud) {
        Some(mesh) => of_mesh(&cloud, mesh, options),
        None => of_points(cloud, options),
    };
    Ok(Scene { points_in_file, ..scene? })
}

fn of_points(cloud: Cloud, options: &ScanOptions) -> Result<Scene, ScanError> {
    let points_in_file = cloud.points.len();
    let finite = |p: &Point3| p.iter().all(|c| c.is_finite());
    let wanted = options.mark.is_some() && cloud.colors.len() == cloud.points.len();
    let colors = cloud.points.iter().zip(&cloud.colors).filter(|(p, _)| wanted && finite(p));
    let colors = colors.map(|(_, color)| *color).collect();
    let mut points = cloud.points;
    points.retain(finite);
    limits::enough_points(points.len(), options)?;
    let units = units_of(&points, options)?;
    let unit = units[0];
    points.iter_mut().for_each(|p| *p *= unit.metres());
    Ok(Scene {
        points_in_file,
        unit,
        other_units: units[1..].to_vec(),
        points,
        colors,
        free_edge: Vec::new(),
        chord_m: 0.0,
        mesh: None,
    })
}

/// The unit that the caller gives, or else those that the scene's size leaves; one at least.
fn units_of(points: &[Point3], options: &ScanOptions) -> Result<Vec<LengthUnit>, ScanError> {
    let guess = || limits::units(unit_guess::guess(points, &options.tuning.scene), options);
    options.unit.map_or_else(guess, |unit| Ok(vec![unit]))
}

impl Scene {
    /// The same points in another unit of the file.
    pub fn in_unit(&mut self, unit: LengthUnit) {
        let factor = unit.metres() / self.unit.metres();
        self.points.par_iter_mut().for_each(|p| *p *= factor);
        self.unit = unit;
    }

    /// Leaves what lies within a region \[m\], scan's frame.
    pub fn crop(&mut self, region: &Region) {
        let inside: Vec<bool> = self.points.par_iter().map(|p| region.contains(p)).collect();
        retain(&mut self.points, &inside);
        if !self.colors.is_empty() {
            retain(&mut self.colors, &inside);
        }
        self.free_edge.retain(|p| region.contains(p));
    }

    /// Typical distance between neighbouring points \[m\]: the side of the square that each
    /// has to itself, from how far the third neighbours of some of them are. Of points that
    /// lie at random; of a regular grid it is 8 % too large. The lesser of the whole scene's and of
    /// that within `reach_m` of `about`, if that is known: a far table's points lie farther apart.
    pub fn least_spacing_m(&self, about: Option<&Point3>, reach_m: f64) -> Option<f64> {
        /// The point itself is among them.
        const AROUND: usize = 4;
        /// Points expected within the median distance of the third (of a gamma distribution
        /// of shape 3).
        const EXPECTED: f64 = 2.674;
        let tree = Neighbours::new(&self.points);
        let side = |i: usize| {
            let far = tree.nearest(&self.points[i], AROUND).get(AROUND - 1)?.distance_sq;
            Some((std::f64::consts::PI * far / EXPECTED).sqrt())
        };
        let stride = |count: usize| count.div_ceil(1000).max(1);
        let typical =
            |some: &mut dyn Iterator<Item = usize>| robust::median(some.filter_map(side).collect());
        let near = about.and_then(|about| {
            let near = tree.within(about, reach_m);
            let stride = stride(near.len());
            typical(&mut near.into_iter().step_by(stride))
        });
        let count = self.points.len();
        let whole = typical(&mut (0..count).step_by(stride(count)));
        near.into_iter().chain(whole).reduce(f64::min)
    }
}

/// The mesh that a file holds: at least half of its points carry triangles. `None`
/// also for what no reader gives: points that are not finite, triangles without.
fn mesh_of(cloud: &Cloud) -> Option<&[[u32; 3]]> {
    let mut carries = vec![false; cloud.points.len()];
    for &vertex in cloud.triangles.iter().flatten() {
        *carries.get_mut(vertex as usize)? = true;
    }
    if !cloud.points.iter().all(|p| p.iter().all(|c| c.is_finite())) {
        return None;
    }
    let carrying = carries.iter().filter(|c| **c).count();
    (carrying > 0 && 2 * carrying >= carries.len()).then_some(&cloud.triangles)
}

fn of_mesh(
    cloud: &Cloud,
    triangles: &[[u32; 3]],
    options: &ScanOptions,
) -> Result<Scene, ScanError> {
    let tuning = &options.tuning.scene;
    let (whole, plate, unit) = mesh_in_metres(cloud, triangles, options)?;
    let near = near_plate(&whole, &plate.centre, tuning.around_m);
    let mesh = weld(&near);
    let beside = Adjacency::new(&mesh.triangles);
    let cut = underside::find(&mesh, &beside, &plate, options);
    cut.as_ref().map_or(Ok(()), |cut| limits::crease(cut, options))?;
    let (mesh, cut, weak) = match cut {
        None => (mesh, None, Vec::new()),
        Some(cut) => {
            let facts = CutFacts { removed_share: cut.removed_share, crease_rad: cut.crease_rad };
            let kept = mesh.triangles.iter().zip(&cut.keep).filter(|(_, keep)| **keep);
            let triangles = kept.map(|(t, _)| *t).collect();
            (Mesh { triangles, ..mesh }, Some(facts), cut.weak)
        }
    };
    let weak = Neighbours::new(&weak);
    let clear = |p: &Point3| {
        weak.one(p).is_none_or(|near| near.distance_sq > tuning.weak_m * tuning.weak_m)
    };
    let samples =
        spread(&mesh, spacing_m(&mesh, tuning, tuning.most_fine)).filter(|s| clear(&s.at));
    let (points, corners): (Vec<Point3>, Vec<u32>) = samples.map(|s| (s.at, s.vertex)).unzip();
    let colored = options.mark.is_some() && cloud.colors.len() == cloud.points.len();
    let colors = if colored { colors_of(&whole, &mesh, &cloud.colors, &corners) } else { vec![] };
    let edge_m = typical_edge_m(&mesh);
    let facts = MeshFacts {
        triangles: triangles.len(),
        samples: points.len(),
        edge_m,
        cut,
        own_edge_share: 0.0,
    };
    Ok(Scene {
        points_in_file: cloud.points.len(),
        unit,
        other_units: Vec::new(),
        points,
        colors,
        free_edge: free_edge(&mesh, tuning.edge_step_m).into_iter().filter(clear).collect(),
        chord_m: edge_m * edge_m / (8.0 * tuning.fold_radius_m),
        mesh: Some(facts),
    })
}

/// A mesh in metres and its plate, in the first of the units in which there is one.
fn mesh_in_metres(
    cloud: &Cloud,
    triangles: &[[u32; 3]],
    options: &ScanOptions,
) -> Result<(Mesh, plate::Plate, LengthUnit), ScanError> {
    let mut refused = None;
    for unit in units_of(&cloud.points, options)? {
        let vertices: Vec<Point3> = cloud.points.iter().map(|p| p * unit.metres()).collect();
        let mut whole = Mesh { vertices, triangles: triangles.to_vec() };
        drop_bridges(&mut whole, &options.tuning.scene);
        let part = Region::to_search(options, unit).map(|region| part_of(&whole, &region));
        match plate_of(part.as_ref().unwrap_or(&whole), unit, options) {
            Ok(plate) => return Ok((whole, plate, unit)),
            Err(error) => _ = refused.get_or_insert(error),
        }
    }
    Err(refused.unwrap_or_else(|| limits::too_few_points(cloud.points.len(), options)))
}

/// The triangles of a mesh that lie within a region, on the vertices of the whole.
fn part_of(mesh: &Mesh, region: &Region) -> Mesh {
    let inside: Vec<bool> = mesh.vertices.iter().map(|p| region.contains(p)).collect();
    let within = |t: &&[u32; 3]| t.iter().all(|&v| inside[v as usize]);
    let triangles = mesh.triangles.iter().filter(within).copied().collect();
    Mesh { vertices: mesh.vertices.clone(), triangles }
}

/// Drops what spans the gaps of depth images in meshes that are made from them: in a
/// mesh whose edges are alike, triangles with far longer ones. A decimated mesh has
/// edges of all lengths and keeps its long ones.
fn drop_bridges(mesh: &mut Mesh, tuning: &SceneTuning) {
    let longest = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared()).sqrt()
    };
    let lengths: Vec<f64> = mesh.triangles.iter().map(longest).collect();
    let quantile = |share| robust::quantile(lengths.clone(), share).unwrap_or(0.0);
    let usual = quantile(0.5);
    if quantile(0.9) < tuning.alike * usual {
        let mut length = lengths.iter();
        let limit = (tuning.bridge * usual).max(tuning.least_bridge_m);
        mesh.triangles.retain(|_| length.next().is_some_and(|&length| length <= limit));
    }
}

/// The plate in a mesh. Two layers of a shell may hide it: then in what faces each of
/// six ways.
fn plate_of(
    mesh: &Mesh,
    unit: LengthUnit,
    options: &ScanOptions,
) -> Result<plate::Plate, ScanError> {
    let tuning = &options.tuning.scene;
    let samples: Vec<Sample> = spread(mesh, spacing_m(mesh, tuning, tuning.most_coarse)).collect();
    limits::enough_points(samples.len(), options)?;
    let hints = Hints::of(options, unit);
    let find = |points: Vec<Point3>| {
        let sought = plate::candidates(&points, &hints, options);
        let measured = |candidate| plate::measure(&points, candidate, &hints, options);
        sought.candidates.iter().find_map(measured).ok_or_else(|| ScanError::NoPlate {
            why: limits::no_place(&sought, options),
            radius_m: options.plate_radius_m,
            unit,
        })
    };
    let refused = match find(samples.iter().map(|s| s.at).collect()) {
        Ok(plate) => return Ok(plate),
        Err(refused) => refused,
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let ways = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let faces = |way: Vector3| {
        let faces = samples.iter().filter(|s| area_vector2(mesh, s.face as usize).dot(&way) > 0.0);
        find(faces.map(|s| s.at).collect()).ok()
    };
    let found = ways.filter_map(faces);
    let score = |plate: &plate::Plate| (plate.radius_m / options.plate_radius_m - 1.0).abs();
    found.min_by(|a, b| score(a).total_cmp(&score(b))).ok_or(refused)
}

/// Distance between the points that stand for a mesh, at most `most` of them \[m\].
fn spacing_m(mesh: &Mesh, tuning: &SceneTuning, most: f64) -> f64 {
    let area = 0.5 * (0..mesh.triangles.len()).map(|f| area_vector2(mesh, f).norm()).sum::<f64>();
    let own = (area / mesh.vertices.len().max(1) as f64).sqrt();
    own.min(tuning.sample_m).max((area / most).sqrt())
}

/// The triangles around the plate, on the vertices that they use.
fn near_plate(mesh: &Mesh, centre: &Point3, around_m: f64) -> Mesh {
    let near = |v: u32| (mesh.vertices[v as usize] - centre).norm() < around_m;
    let mut number = vec![u32::MAX; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let triangles = mesh
        .triangles
        .iter()
        .filter(|t| t.iter().any(|&v| near(v)))
        .map(|t| {
            t.map(|v| {
                let number = &mut number[v as usize];
                if *number == u32::MAX {
                    *number = vertices.len() as u32;
                    vertices.push(mesh.vertices[v as usize]);
                }
                *number
            })
        })
        .collect();
    Mesh { vertices, triangles }
}

/// The colours of vertices of `mesh`, by their places in the file's `whole`.
fn colors_of(whole: &Mesh, mesh: &Mesh, colors: &[[u8; 3]], corners: &[u32]) -> Vec<[u8; 3]> {
    let key = |p: &Point3| [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
    let by_place: std::collections::HashMap<[u64; 3], [u8; 3]> =
        whole.vertices.iter().map(key).zip(colors.iter().copied()).collect();
    let color = |v: &u32| by_place.get(&key(&mesh.vertices[*v as usize])).copied();
    corners.iter().map(|v| color(v).unwrap_or_default()).collect()
}

/// Mean edge, weighted by area \[m\].
fn typical_edge_m(mesh: &Mesh) -> f64 {
    let (mut sum, mut areas) = (0.0, 0.0);
    for (face, t) in mesh.triangles.iter().enumerate() {
        let area = area_vector2(mesh, face).norm();
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        sum += area * ((b - a).norm() + (c - b).norm() + (a - c).norm()) / 3.0;
        areas += area;
    }
    if areas > 0.0 { sum / areas } else { 0.0 }
}

/// Points along the edges of a single triangle.
fn free_edge(mesh: &Mesh, step_m: f64) -> Vec<Point3> {
    let beside = Adjacency::new(&mesh.triangles);
    let mut points = Vec::new();
    let mut owed = 0.0;
    for (face, t) in mesh.triangles.iter().enumerate() {
        for k in (0..3).filter(|&k| beside.is_boundary(face, k)) {
            let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| mesh.vertices[v as usize]);
            let steps = (b - a).norm() / step_m + owed;
            let count = steps.floor().max(0.0);
            owed = steps - count;
            let count = count as u32;
            let at = |i: u32| a + (b - a) * ((f64::from(i) + 0.5) / f64::from(count));
            points.extend((0..count).map(at));
        }
    }
    points
}
