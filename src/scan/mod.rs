//! From a scan of a draped specimen to its boundary vector.
//!
//! In: a cloud in the file's unit and an arbitrary frame. Out: the rim as 244
//! points in the simulation frame, each with sigma and an observed flag, and how
//! much to trust them; or a refusal that says what was measured and where.
//!
//! load (`io`) -> points in metres, meshes sampled and opened (`scene`, `underside`),
//! unit (`unit`) -> plate and up (`plate`) -> floor, pedestal and
//! background cut away, denoised (`cloth`) -> unrolled (`unroll`) -> the square in
//! the unrolled cloth (`square`) -> a smooth sheet (`sheet`), drawn onto the points
//! without changing its lengths (`conform`; both from `fit`) -> the plate under it
//! (`origin`) -> free edge (`edge`, of a mesh `loops`) -> rim (`rim`) -> what it is worth (`trust`).
//!
//! The idea that carries it: a draped cloth is nearly an isometric image of a
//! known square. In the unrolled plane the rim is four straight lines with known
//! corners, whatever the folds do, and holes, the plate's edge and the pedestal
//! lie inside it or outside the sheet. Tried and dropped: boundary points by their
//! angular gap, then ordering them; they need a threshold, come unordered, and an
//! occlusion looks like a rim.

mod cloth;
mod conform;
mod coverage;
mod edge;
pub mod error;
mod fit;
mod loops;
pub mod mark;
pub mod neighbours;
pub mod options;
mod origin;
mod plate;
mod relax;
mod rim;
mod scene;
mod sheet;
mod square;
pub mod thin;
mod trust;
mod underside;
pub mod unit;
mod unroll;

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use serde::Serialize;

pub use error::ScanError;
pub use mark::MarkColor;
pub use options::{ScanOptions, WarpToward};
pub use scene::{CutFacts, MeshFacts};
pub use unit::LengthUnit;

use crate::base::clock::Stages;
use crate::base::{Boundary, BoundaryPoint, Isometry3, Point3, Vector3};
use crate::geom::Cloud;
use square::Square;

/// Degrees, counter-clockwise seen from above, from the scan's own x axis laid
/// horizontal (its y axis if x points up). Every bearing of this module.
pub type Bearing = f64;

/// Fewest points that can carry a rim: about one per 3 mm square.
const MIN_POINTS: usize = 3000;

/// How far from level a floor under a scanned drape is \[rad\].
const FLOOR_SIGMA_RAD: f64 = 2e-3;
/// Points farther apart than this many spacings have unseen cloth between them.
const LONGEST_EDGE: f64 = 4.0;
/// A mesh whose chords cut more off its folds is too coarse for its length along the
/// cloth to tell what the sensor did to its edge [m].
const MOST_CHORD_M: f64 = 0.1e-3;
/// Relaxing the unrolled cloth: first, while its edges are pulled straight,
const FIRST: relax::Effort = relax::Effort { rounds: 6, steps: 8, enough_m: 0.02e-3 };
const STRAIGHTENING: relax::Effort = relax::Effort { rounds: 3, ..FIRST };
/// and with the plate's part loose, whose turn settles slowly.
const LOOSE: relax::Effort = relax::Effort { rounds: 6, steps: 12, enough_m: 0.002e-3 };
/// Rounds of pulling the unrolled edges straight.
const STRAIGHTENINGS: usize = 2;

/// Whether weft and warp are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// The caller said where the warp points, or a mark on the specimen.
    Given,
    /// Undecided: the boundary turned by one quarter is as likely.
    Ambiguous,
}

/// The rim of a scan.
#[derive(Clone, Debug)]
pub struct ScannedBoundary {
    /// 244 points, simulation frame.
    pub boundary: Boundary,
    /// Whether weft and warp are known.
    pub orientation: Orientation,
    /// The simulation frame from the scan's, both in metres.
    pub sim_from_scan: Isometry3,
    /// The file's unit, given or guessed.
    pub unit: LengthUnit,
    /// How much to trust it.
    pub quality: Quality,
    /// What was found on the way, for pictures and for comparing surfaces.
    pub evidence: Evidence,
}

/// Quality figures of one scan.
#[derive(Clone, Debug, Serialize)]
pub struct Quality {
    /// Points in the file.
    pub points: usize,
    /// What was found in a mesh; `None` for a cloud.
    pub mesh: Option<MeshFacts>,
    /// Points left after the cuts.
    pub cloth_points: usize,
    /// Whether the unit was guessed.
    pub unit_guessed: bool,
    /// Up, in the scan's frame.
    pub up: [f64; 3],
    /// Share of the 244 points that were observed.
    pub observed_fraction: f64,
    /// Share of the specimen's area that scanned points cover.
    pub seen_share: f64,
    /// Length of the rim \[m\].
    pub loop_length_m: f64,
    /// Lengths of the four sides along the cloth \[m\].
    pub side_lengths_m: [f64; 4],
    /// Length of the cloth from edge to opposite edge as scanned, along warp and
    /// weft \[m\]; less than the specimen's side where the sensor erodes edges.
    pub widths_m: [Option<f64>; 2],
    /// Distance of the four edges from the specimen's centre on the flat cloth \[m\].
    pub edge_m: [f64; 4],
    /// Offset of the specimen's centre from the plate's axis on the flat cloth \[m\].
    pub centre_offset_m: f64,
    /// Longest bridged arc \[m\] and the bearing of its middle.
    pub longest_gap_m: f64,
    /// See [`Bearing`].
    pub longest_gap_bearing_deg: f64,
    /// Radius at which the cloth leaves the plate \[m\] and its scatter.
    pub plate_radius_m: f64,
    /// Robust scatter of that radius over the bearings \[m\].
    pub plate_radius_scatter_m: f64,
    /// Standard error of the origin, per horizontal axis \[m\].
    pub origin_sigma_m: f64,
    /// Height of the floor \[m\], its scatter and its tilt against the plate, if seen.
    pub floor_height_m: Option<f64>,
    /// Root mean square of the floor's points \[m\].
    pub floor_rms_m: Option<f64>,
    /// Angle between floor and plate \[rad\].
    pub floor_tilt_rad: Option<f64>,
    /// Typical distance between neighbouring points \[m\].
    pub point_spacing_m: f64,
    /// Noise of single points, from the cloth on the plate \[m\].
    pub noise_m: f64,
    /// Root mean square distance of the smoothed surface to the fitted sheet \[m\].
    pub sheet_rms_m: f64,
    /// Largest area of scanned cloth within 12 mm of a rim point that the sheet does
    /// not explain \[m^2\].
    pub unexplained_m2: f64,
}

/// Intermediate products, simulation frame \[m\].
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Smoothed points of the cloth.
    pub cloth: Vec<Point3>,
    /// Material coordinates (x, z) of those points \[m\].
    pub material: Vec<[f64; 2]>,
    /// Raw points within 2 mm of the measured edge.
    pub edge_points: Vec<Point3>,
    /// The corners: ends of sides 0 to 3.
    pub corners: [Point3; 4],
}

/// Finds the boundary vector in a scan. A cloud with triangles on most of its points
/// is taken as a mesh.
///
/// # Errors
/// When the scan cannot be trusted; see [`ScanError`].
pub fn boundary_from_scan(
    cloud: &Cloud,
    options: &ScanOptions,
) -> Result<ScannedBoundary, ScanError> {
    boundary_in_stages(cloud.clone(), options, &mut Stages::off())
}

/// [`boundary_from_scan`] of a cloud that is not needed after, with the time that each
/// stage takes.
///
/// # Errors
/// As there.
pub fn boundary_in_stages(
    cloud: Cloud,
    options: &ScanOptions,
    stages: &mut Stages,
) -> Result<ScannedBoundary, ScanError> {
    let points_in_cloud = cloud.points.len();
    let scene::Scene { unit, points: scene, colors, rim: free_edge, chord_m, mut mesh } =
        scene::take(cloud, options)?;
    stages.done("points and unit");
    let mut plate = plate::find(&scene, options.plate_radius_m, unit)?;
    let sensor_noise_m = plate.noise_m;
    plate.noise_m = plate.noise_m.hypot(chord_m);
    stages.done("plate");
    let Local { from_scan: local_from_scan, floor } = local_frame(&scene, &plate, options);
    let mut local = scene;
    local.par_iter_mut().for_each(|p| *p = local_from_scan * *p);
    stages.done("floor");
    let cloth = cloth::isolate(&local, floor, &plate, options, stages);
    if options.mark.is_none() {
        local = Vec::new();
    }
    let reach_m = options.specimen_side_m * 0.5 * 2_f64.sqrt() * 1.12;
    let mut unrolled = unroll::unroll(&cloth, 0.8 * options.plate_radius_m, reach_m);
    stages.done("unroll");
    let square = straighten(&mut unrolled, cloth.spacing_m, options)?;
    let warp_toward = match (options.warp_toward, options.mark) {
        (None, Some(mark)) => {
            let marked = mark::Marked {
                points: &local,
                colors: &colors,
                cloth: &unrolled,
                square: &square,
                reach_m: 2.0 * cloth.spacing_m + 3.0 * plate.noise_m,
                plate_radius_m: options.plate_radius_m,
            };
            Some(WarpToward::BearingDeg(mark::bearing_deg(&marked, mark)?))
        }
        (given, _) => given,
    };
    drop(local);
    stages.done("square");
    let (square, unrolled) = (orient(square, &local_from_scan, warp_toward), unrolled);

    let fitted = fit::fit_sheet(&unrolled, &square, &cloth, plate.noise_m, options);
    let (sheet, mut material) = fitted?;
    stages.done("sheet");
    let conformed =
        fit::conform_sheet(sheet, &cloth, &unrolled, &mut material, plate.noise_m, options)?;
    let sheet = &conformed.sheet;
    let misfit_m = fit::misfit(sheet, &unrolled, &material, &square, plate.noise_m, options)?;
    stages.done("lengths");
    let origin = origin::find(sheet, &square, options).unwrap_or(origin::Origin {
        axis: [0.0; 2],
        axis_sigma_m: plate.centre_sigma_m,
        face_y_m: options.cloth_height_m,
    });
    let half_m = 0.5 * options.specimen_side_m;
    let most = fit::MOST_EDGE_CANDIDATES;
    let near_edge =
        fit::edge_points(&cloth, &unrolled.points, &material, sheet, plate.noise_m, half_m, most);
    let flat: Vec<[f64; 2]> = near_edge.iter().map(|e| e.1).collect();
    let mut edges = rim::edges(&flat, half_m, plate.noise_m);
    if let Some(facts) = &mut mesh {
        let off_m = 0.4e-3 + 3.0 * plate.noise_m;
        let own: Vec<Point3> = free_edge.iter().map(|p| local_from_scan * p).collect();
        let own = loops::on_sheet(&own, &unrolled.points, &material, sheet, off_m, half_m);
        facts.own_edge_share = loops::refine(&mut edges, &own, scene::RIM_STEP_M, half_m);
        underside::judge(facts)?;
    }
    let widths_m = rim::widths_m(sheet, &edges, half_m);
    // Chords make the unrolled cloth short: it then says nothing of the edge.
    let (shift_m, edge_sigma_m) = if chord_m < MOST_CHORD_M {
        conformed.sensor_shift_m(sensor_noise_m)
    } else {
        (0.0, chord_m)
    };
    edges.iter_mut().for_each(|edge| edge.shift(-shift_m));
    let mut traced = rim::trace(sheet, &edges, half_m);
    stages.done("edge and rim");
    let explained = trust::Explained {
        surface: &cloth.surface,
        unrolled: &unrolled.points,
        material: &material,
        spacing_m: cloth.spacing_m,
        noise_m: plate.noise_m,
        origin_sigma_m: origin.axis_sigma_m,
        edge_sigma_m,
    };
    let unexplained = trust::assess(&mut traced, sheet, &explained, half_m);
    rim::judge(&traced, &unexplained, plate.noise_m, options)?;
    stages.done("trust");
    let (gap_m, gap_bearing_deg) = rim::longest_gap(&traced.points);

    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -square.turn_rad);
    let rise_m = options.cloth_height_m - origin.face_y_m;
    let to_axis = Translation3::new(-origin.axis[0], rise_m, -origin.axis[1]);
    let sim_from_local = Isometry3::from_parts(Translation3::identity(), turn) * to_axis;
    for point in &mut traced.points {
        point.position_m = sim_from_local * point.position_m;
    }
    let quality = Quality {
        points: points_in_cloud,
        mesh,
        cloth_points: cloth.raw.len(),
        unit_guessed: options.unit.is_none(),
        up: local_from_scan.inverse_transform_vector(&Vector3::y()).into(),
        observed_fraction: share(&traced.points),
        seen_share: coverage::seen_share(
            &material,
            options.specimen_side_m,
            LONGEST_EDGE * cloth.spacing_m,
        ),
        loop_length_m: traced.side_lengths_m.iter().sum(),
        side_lengths_m: traced.side_lengths_m,
        widths_m,
        edge_m: traced.edge_m,
        centre_offset_m: (square.centre[0] - origin.axis[0])
            .hypot(square.centre[1] - origin.axis[1]),
        longest_gap_m: gap_m,
        longest_gap_bearing_deg: gap_bearing_deg,
        plate_radius_m: plate.radius_m,
        plate_radius_scatter_m: plate.radius_scatter_m,
        origin_sigma_m: origin.axis_sigma_m,
        floor_height_m: floor.map(|f| f.height_m),
        floor_rms_m: floor.map(|f| f.rms_m),
        floor_tilt_rad: floor.map(|f| (local_from_scan * plate.up.into_inner()).angle(&f.normal)),
        point_spacing_m: cloth.raw_spacing_m,
        noise_m: plate.noise_m,
        sheet_rms_m: misfit_m,
        unexplained_m2: unexplained.area_m2,
    };
    let corners = std::array::from_fn(|s| traced.points[61 * s + 60].position_m);
    let on_edge = |e: &&(Point3, [f64; 2])| e.1[0].abs().max(e.1[1].abs()) > half_m - 2e-3;
    let evidence = Evidence {
        cloth: unrolled.points.iter().map(|p| sim_from_local * p).collect(),
        material,
        edge_points: near_edge.iter().filter(on_edge).map(|e| sim_from_local * e.0).collect(),
        corners,
    };
    let boundary =
        Boundary::new(traced.points).unwrap_or_else(|| unreachable!("four sides of 61 points"));
    let orientation =
        if warp_toward.is_some() { Orientation::Given } else { Orientation::Ambiguous };
    let sim_from_scan = sim_from_local * local_from_scan;
    Ok(ScannedBoundary { boundary, orientation, sim_from_scan, unit, quality, evidence })
}

fn share(points: &[BoundaryPoint]) -> f64 {
    points.iter().filter(|p| p.observed).count() as f64 / points.len() as f64
}

/// The frame in which a scan is worked on, and what fixes it.
struct Local {
    /// Origin at the centre of the plate's top face, y up, x along the scan's x
    /// axis laid horizontal.
    from_scan: Isometry3,
    floor: Option<cloth::Floor>,
}

/// Finds the local frame: origin from the plate's edge, up from plate and floor,
/// each by its variance.
fn local_frame(scene: &[Point3], plate: &plate::Plate, options: &ScanOptions) -> Local {
    let frame = |up: Vector3| {
        let (u, v) = plate::horizontal_axes(&up, &Vector3::x());
        let rows = Matrix3::from_rows(&[u.transpose(), up.transpose(), v.transpose()]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
        let origin = plate.centre - up * options.cloth_height_m;
        Isometry3::from_parts(Translation3::identity(), turn) * Translation3::from(-origin.coords)
    };
    let mut from_scan = frame(plate.up.into_inner());
    let mut floor = cloth::find_floor(scene, &from_scan, options, plate.noise_m);
    // A plate that is clearly tilted keeps its own normal.
    let plate_sigma = 3.0 * plate.tilt_sigma_rad + 1e-3;
    let level =
        |f: &cloth::Floor| f.normal.angle(&Vector3::y()) < 4.0 * plate_sigma.hypot(FLOOR_SIGMA_RAD);
    if let Some(found) = floor.filter(level) {
        let weight = (FLOOR_SIGMA_RAD / plate_sigma).powi(2);
        let up =
            from_scan.inverse_transform_vector(&(found.normal + Vector3::y() * weight).normalize());
        let before = std::mem::replace(&mut from_scan, frame(up));
        let normal = from_scan * before.inverse_transform_vector(&found.normal);
        floor = Some(cloth::Floor { normal, ..found });
    }
    Local { from_scan, floor }
}

/// Turns the square by quarters so that its x axis is the warp, or lies nearest
/// to bearing 0 if nothing is known.
fn orient(square: Square, local_from_scan: &Isometry3, warp: Option<WarpToward>) -> Square {
    let wanted = match warp {
        Some(WarpToward::Direction(direction)) => {
            let local = local_from_scan * Vector3::from(direction);
            (-local.z).atan2(local.x)
        }
        Some(WarpToward::BearingDeg(degrees)) => degrees.to_radians(),
        None => 0.0,
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let quarters = ((wanted - square.turn_rad) / quarter).round();
    Square { turn_rad: square.turn_rad + quarters * quarter, ..square }
}

/// Relaxes the unrolled cloth and pulls its free edges onto the sides of the
/// square that fits best; returns that square. Uses the links up.
///
/// The front that unrolled the cloth may have carried it round the plate by a
/// degree, and ties to a square that is turned as far keep it there. So at the end
/// the edges hold the cloth and the part on the plate is loose: where it comes to
/// rest says how the square lies on the plate.
fn straighten(
    unrolled: &mut unroll::Unrolled,
    spacing_m: f64,
    options: &ScanOptions,
) -> Result<Square, ScanError> {
    let links = &std::mem::take(&mut unrolled.links);
    let unroll::Unrolled { fixed, flat, .. } = unrolled;
    relax::relax(links, fixed, &[], spacing_m, FIRST, flat);
    let mut square = square::find(flat, options.specimen_side_m)?;
    let half_m = 0.5 * options.specimen_side_m;
    for _ in 0..STRAIGHTENINGS {
        let mut material: Vec<[f64; 2]> = flat.iter().map(|&p| square.material(p)).collect();
        let ties = rim::ties(&material, half_m);
        relax::relax(links, fixed, &ties, spacing_m, STRAIGHTENING, &mut material);
        for (p, &m) in flat.iter_mut().zip(&material) {
            *p = square.flat(m);
        }
        square = square::find(flat, options.specimen_side_m)?;
    }
    let mut material: Vec<[f64; 2]> = flat.iter().map(|&p| square.material(p)).collect();
    let on_plate: Vec<usize> = (0..fixed.len()).filter(|&i| fixed[i]).collect();
    let places: Vec<[f64; 2]> = on_plate.iter().map(|&i| flat[i]).collect();
    let ties = rim::ties(&material, half_m);
    let loose = vec![false; fixed.len()];
    relax::relax(links, &loose, &ties, spacing_m, LOOSE, &mut material);
    square = square.turned_to(on_plate.iter().map(|&i| material[i]).zip(places));
    for (p, &m) in flat.iter_mut().zip(&material) {
        *p = square.flat(m);
    }
    Ok(square)
}
