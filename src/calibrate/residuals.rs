//! The distances of a measured drape from a simulated one, and how they change with every unknown.
//!
//! Of a picture: even points of the measured outline, each from the simulated outline across the
//! latter. Of a scan: the rim's points that were seen, each from its own place on the simulated
//! rim, along three directions: across the rim and level, across the rim and upwards, and along it,
//! which is known less well; and places within the sheet, each across it.

use nalgebra::{DMatrix, DVector};

use super::effect::{Acts, Cloth, Harmonic, Lies, Number, Stays, number_of, tilt_parts};
use super::options::FitOptions;
use super::pose::{POSE, Pose, frame_of, plan_of, scaled};
use super::prediction::{Move, Prediction, STRIDE, compared};
use super::target::{Rim, Target};
use crate::base::boundary::POINTS as RIM_POINTS;
use crate::base::{Boundary, Outline, Surface, Vector3};
use crate::fabric::STIFFNESSES;
use crate::sim::sensitivity::Parameter;
use crate::sim::{Experiment, Setup};

/// Even points of a measured outline.
const POINTS: usize = 240;

/// One measured point compared with a drape.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Bearing of its place on the drape about the plate's axis, from the warp towards the weft
    /// \[rad\].
    pub bearing_rad: f64,
    /// Distance of the measured point from the drape's outline or rim, level and across it,
    /// positive outwards \[m\].
    pub outwards_m: f64,
    /// Its whole distance across outline or rim \[m\].
    pub across_m: f64,
}

/// A measured drape compared with a simulated one in a pose.
#[derive(Clone, Debug)]
pub(super) struct Residuals {
    /// The measured points.
    pub rows: Vec<Row>,
    /// Distances of the measured from the simulated \[m\], and the standard deviation of each
    /// \[m\].
    pub off_m: DVector<f64>,
    pub sigma_m: DVector<f64>,
    /// Share of an independent one that each of these is.
    pub counts: DVector<f64>,
    /// Moves of the drape along these distances with each unknown: shared ones, then the pose \[m
    /// per unit\].
    pub columns: DMatrix<f64>,
    /// Mean stretch of the springs \[m\], and its change with each unknown.
    pub stretch_m: f64,
    pub stretch: DVector<f64>,
}

/// The cloth of the predictions and the numbers that are unknown of it.
#[derive(Clone, Copy)]
pub(super) struct Unknowns<'a> {
    pub cloth: &'a Cloth,
    pub numbers: &'a [&'static Number],
    pub options: &'a FitOptions,
}

/// Where a place is among those whose moves a trial knows.
#[derive(Clone, Copy)]
enum On {
    /// On the outline: a segment, and how far along it.
    Outline { segment: usize, fraction: f64 },
    /// A point of the rim.
    Rim(usize),
    /// A place of the sheet, and how far out it lies: 0 at the plate's edge, 1 at the rim.
    Sheet { index: usize, out: f64 },
}

/// A place of a drape and a direction in which a distance is measured there.
#[derive(Clone, Copy)]
struct At<'a> {
    normal: Vector3,
    place: Vector3,
    on: On,
    per_height: f64,
    prediction: &'a Prediction,
    /// The place's move to finer cells \[m\].
    finer: Vector3,
    /// Its move with the edge's shift along the cloth \[-\].
    edge: Vector3,
}

impl At<'_> {
    /// How it moves in that direction.
    fn across(&self, move_: &Move) -> f64 {
        match self.on {
            On::Outline { segment, fraction } => {
                let moves = &move_.outline;
                let (a, b) = (moves[segment], moves[(segment + 1) % moves.len()]);
                let at = [0, 1].map(|c| a[c] + (b[c] - a[c]) * fraction);
                self.normal.x * at[0] + self.normal.z * at[1]
            }
            On::Rim(index) => self.normal.dot(&move_.rim[index]),
            On::Sheet { index, .. } => self.normal.dot(&move_.places[index]),
        }
    }

    /// The same with a number of an effect, per unit of it.
    fn with(&self, number: &Number, lies: Lies, setup: &Setup) -> f64 {
        let moves = |p: Parameter| self.across(self.prediction.with(p));
        match &number.acts {
            Acts::Scale => self.normal.dot(&self.place),
            Acts::Perspective => match self.on {
                On::Outline { .. } => {
                    let y = self.place.y;
                    self.normal.dot(&self.place) * y / (1.0 - self.per_height * y)
                }
                On::Rim(_) | On::Sheet { .. } => 0.0,
            },
            Acts::Edge => self.normal.dot(&self.edge),
            Acts::Outline(harmonic) => {
                let bearing_rad = self.place.z.atan2(self.place.x);
                let outwards = Vector3::new(bearing_rad.cos(), 0.0, bearing_rad.sin());
                let across = match self.on {
                    On::Outline { .. } => 1.0,
                    On::Rim(_) => self.normal.dot(&outwards),
                    // as cloth bends that is held at the plate's edge
                    On::Sheet { out, .. } => out.powi(2) * self.normal.dot(&outwards),
                };
                across * harmonic.at(bearing_rad, lies)
            }
            acts => on_sheet(acts, lies, setup, moves),
        }
    }

    /// The same with the numbers of a pose whose scale is the true one.
    fn with_pose(&self, posed: &Pose) -> Pose {
        let (sin, cos) = posed.rotation_rad.sin_cos();
        let scale = (-posed.ln_scale).exp();
        let ([nx, ny, nz], [x, y, z]): ([f64; 3], [f64; 3]) =
            (self.normal.into(), self.place.into());
        let [warp_m, weft_m, pull_m] = PLACED.map(|p| self.across(self.prediction.with(p)));
        Pose {
            offset_m: [scale * (nx * cos - nz * sin), scale * (nx * sin + nz * cos)],
            rotation_rad: nz * x - nx * z,
            ln_scale: self.normal.dot(&self.place),
            specimen_m: [warp_m, weft_m],
            pull_m,
            height_m: scale * ny,
            lean_rad: [nx * y - ny * x, nz * y - ny * z],
            cells: self.normal.dot(&self.finer),
        }
    }
}

/// What moves a drape within its pose.
const PLACED: [Parameter; 3] = [Parameter::OffsetX, Parameter::OffsetZ, Parameter::Pull];

/// What a number does to the sheet, of what its parameters do.
fn on_sheet(acts: &Acts, lies: Lies, setup: &Setup, of: impl Fn(Parameter) -> f64) -> f64 {
    match acts {
        Acts::Sheet(parameters) => parameters.iter().map(|&p| of(p)).sum(),
        Acts::Face(parameter) => lies.face * of(*parameter),
        Acts::Node(node) => {
            let (parameter, sign) = node.with_face(lies.face);
            sign * of(parameter)
        }
        Acts::Settling(parameters) => {
            // of v exp(-settled number)
            let lost = |&p: &Parameter| lies.settled * number_of(setup, p) * of(p);
            -parameters.iter().map(lost).sum::<f64>()
        }
        Acts::Tilt(side) => {
            let [x, z] = tilt_parts(*side, lies.bearing_rad);
            x * of(Parameter::TiltX) + z * of(Parameter::TiltZ)
        }
        Acts::Scale | Acts::Perspective | Acts::Edge | Acts::Outline(_) => 0.0,
    }
}

impl Harmonic {
    /// Its value at a bearing from the warp.
    fn at(&self, bearing_rad: f64, lies: Lies) -> f64 {
        let turn = if self.stays == Stays::Bench { lies.bearing_rad } else { 0.0 };
        let (sin, cos) = (f64::from(self.order) * (bearing_rad + turn)).sin_cos();
        let value = if self.sine { sin } else { cos };
        if self.stays == Stays::Face { lies.face * value } else { value }
    }
}

/// One distance: where it is, how far off, how well known.
struct Distance<'a> {
    at: At<'a>,
    off_m: f64,
    sigma_m: f64,
    counts: f64,
}

/// A measured drape beside a simulated one in a pose: the latter is moved by the specimen's place
/// and the springs' pull as far as these differ from the trial's.
pub(super) fn residuals(
    target: &Target,
    prediction: &Prediction,
    pose: &Pose,
    of: Unknowns<'_>,
) -> Residuals {
    let [warp_m, weft_m] = pose.specimen_m;
    let moved = [warp_m, weft_m, pose.pull_m - prediction.hold.pull_m];
    let view = of.cloth.view();
    let posed = scaled(pose, view.ln_scale);
    let (rows, distances) = match &target.rim {
        Some(rim) => {
            let shifted = (moved, view.edge_m);
            let (rows, mut distances) =
                on_rim((rim, target), prediction, shifted, &posed, of.options);
            if let Some(sheet) = &rim.sheet {
                distances.extend(on_sheet_of(sheet, target, prediction, moved, &posed, of.options));
            }
            (rows, distances)
        }
        None => on_outline(target, prediction, (moved, target.seen_from(view)), &posed, of.options),
    };
    let lies = target.lies(pose);
    let setup = of.cloth.setup(&target.bench, lies);
    let values = setup.fabric.in_si();
    let shared = STIFFNESSES + of.numbers.len();
    let mut columns = DMatrix::zeros(distances.len(), shared + POSE);
    for (r, Distance { at, .. }) in distances.iter().enumerate() {
        for (k, parameter) in Parameter::STIFFNESSES.into_iter().enumerate() {
            // d/d ln v = v d/dv
            columns[(r, k)] = values[k] * at.across(prediction.with(parameter));
        }
        for (k, number) in of.numbers.iter().enumerate() {
            columns[(r, STIFFNESSES + k)] = number.sigma * at.with(number, lies, &setup);
        }
        let with_pose: [f64; POSE] = at.with_pose(&posed).into();
        for (m, value) in with_pose.into_iter().enumerate() {
            columns[(r, shared + m)] = value;
        }
    }
    let stretched = |p: Parameter| prediction.with(p).stretch_m;
    let mut stretch = DVector::zeros(shared + POSE);
    for (k, parameter) in Parameter::STIFFNESSES.into_iter().enumerate() {
        stretch[k] = values[k] * stretched(parameter);
    }
    for (k, number) in of.numbers.iter().enumerate() {
        stretch[STIFFNESSES + k] = number.sigma * on_sheet(&number.acts, lies, &setup, stretched);
    }
    let placed = PLACED.map(stretched);
    let stretch_m = (0..3).fold(prediction.hold.mean_m, |sum, m| sum + moved[m] * placed[m]);
    let [warp_m, weft_m, pull_m] = placed;
    let placed = Pose { specimen_m: [warp_m, weft_m], pull_m, ..Pose::default() };
    stretch.rows_mut(shared, POSE).copy_from_slice(&<[f64; POSE]>::from(placed));
    let off_m = DVector::from_iterator(distances.len(), distances.iter().map(|d| d.off_m));
    let sigma_m = DVector::from_iterator(distances.len(), distances.iter().map(|d| d.sigma_m));
    let counts = DVector::from_iterator(distances.len(), distances.iter().map(|d| d.counts));
    Residuals { rows, off_m, sigma_m, counts, columns, stretch_m, stretch }
}

type Measured<'a> = (Vec<Row>, Vec<Distance<'a>>);

/// Even points of a measured outline beside the simulated one.
fn on_outline<'a>(
    target: &Target,
    prediction: &'a Prediction,
    (moved, per_height): ([f64; 3], f64),
    posed: &Pose,
    options: &FitOptions,
) -> Measured<'a> {
    let own = PLACED.map(|p| prediction.with(p));
    let (points, heights_m) = (prediction.outline.points_m(), &prediction.heights_m);
    let place = |k: usize| {
        let nearer = 1.0 - per_height * heights_m[k];
        let moved = |c: usize| (0..3).map(|m| moved[m] * own[m].outline[k][c]).sum::<f64>();
        [0, 1].map(|c| (points[k][c] + moved(c)) / nearer)
    };
    let drape = Outline::new((0..points.len()).map(place).collect());
    let drape = drape.unwrap_or_else(|_| prediction.outline.clone());
    let counts =
        (target.outline.length_m() / POINTS as f64 / options.correlation_length_m).min(1.0);
    let comparison = |point: [f64; 2]| {
        let foot = drape.foot(plan_of(point, posed));
        let ([nx, nz], [x, z]) = (foot.normal, foot.at_m);
        let (a, b) = (heights_m[foot.segment], heights_m[(foot.segment + 1) % heights_m.len()]);
        let at = At {
            normal: Vector3::new(nx, 0.0, nz),
            place: Vector3::new(x, a + (b - a) * foot.fraction, z),
            per_height,
            on: On::Outline { segment: foot.segment, fraction: foot.fraction },
            prediction,
            finer: Vector3::zeros(),
            edge: Vector3::zeros(),
        };
        let off_m = foot.outwards_m;
        let row = Row { bearing_rad: z.atan2(x), outwards_m: off_m, across_m: off_m.abs() };
        (row, Distance { at, off_m, sigma_m: options.outline_m.hypot(options.model_m), counts })
    };
    target.outline.evenly(POINTS).into_iter().map(comparison).unzip()
}

/// The points of a measured rim that were seen, beside their places on the simulated one.
fn on_rim<'a>(
    (rim, target): (&Rim, &Target),
    prediction: &'a Prediction,
    (moved, edge_m): ([f64; 3], f64),
    posed: &Pose,
    options: &FitOptions,
) -> Measured<'a> {
    let own = PLACED.map(|p| prediction.with(p));
    let points = rim.boundary.points();
    let measured: Vec<Vector3> =
        points.iter().map(|p| frame_of(&p.position_m.coords, posed)).collect();
    let counts = (mean_step_m(&measured) / options.correlation_length_m).min(1.0);
    // beyond what the scan path has taken for it
    let beyond_m = rim.edge.map_or(0.0, |edge| edge_m - edge.by_m);
    let (mut rows, mut distances) = (Vec::new(), Vec::new());
    for index in (0..RIM_POINTS).filter(|&index| points[index].observed) {
        let finer = target.finer.as_ref().map_or_else(Vector3::zeros, |finer| finer.rim[index]);
        let edge = along_the_cloth(rim, index, posed);
        let place = (0..3).fold(prediction.rim[index], |at, m| at + own[m].rim[index] * moved[m])
            + finer * posed.cells
            + edge * beyond_m;
        let next =
            measured[(index + 1) % RIM_POINTS] - measured[(index + RIM_POINTS - 1) % RIM_POINTS];
        let [level, upwards, along] = directions(&next, &place);
        let off = measured[index] - place;
        let sigma_m = points[index].sigma_m.hypot(options.scan_model_m);
        for (normal, sigma_m) in
            [(level, sigma_m), (upwards, sigma_m), (along, sigma_m.hypot(options.along_m))]
        {
            let at =
                At { normal, place, on: On::Rim(index), per_height: 0.0, prediction, finer, edge };
            distances.push(Distance { at, off_m: normal.dot(&off), sigma_m, counts });
        }
        rows.push(Row {
            bearing_rad: place.z.atan2(place.x),
            outwards_m: level.dot(&off),
            across_m: level.dot(&off).hypot(upwards.dot(&off)),
        });
    }
    (rows, distances)
}

/// How a point of a scanned rim moves as its edge is shifted outwards along the cloth, all round
/// \[-\]; corners along both their sides.
fn along_the_cloth(rim: &Rim, index: usize, posed: &Pose) -> Vector3 {
    let (Some(sheet), Some(_)) = (&rim.sheet, rim.edge) else { return Vector3::zeros() };
    let last = sheet.side() - 1;
    let out = Boundary::flat_xz_m(index, 2.0);
    let [i, j] = out.map(|out| (0.5 * (out + 1.0) * last as f64).round() as usize);
    let at = |i: usize, j: usize| {
        let [i, j] = [i, j].map(|k| k.min(last));
        frame_of(&sheet.points()[i * sheet.side() + j].position_m.coords, posed)
    };
    let warp = at(i + 1, j) - at(i.saturating_sub(1), j);
    let weft = at(i, j + 1) - at(i, j.saturating_sub(1));
    let along = |steps: Vector3| steps.try_normalize(0.0).unwrap_or_default();
    along(warp) * out[0] + along(weft) * out[1]
}

/// The places of a scanned sheet that were seen, each from its own place on the simulated one
/// across the former.
fn on_sheet_of<'a>(
    sheet: &'a Surface,
    target: &'a Target,
    prediction: &'a Prediction,
    moved: [f64; 3],
    posed: &'a Pose,
    options: &'a FitOptions,
) -> impl Iterator<Item = Distance<'a>> {
    let own = PLACED.map(|p| prediction.with(p));
    let side = Surface::SIDE;
    let measured =
        move |i: usize, j: usize| frame_of(&sheet.points()[i * side + j].position_m.coords, posed);
    let step_m = target.bench.specimen.weft_m * STRIDE as f64 / (side - 1) as f64;
    let counts = (step_m / options.correlation_length_m).min(1.0).powi(2);
    compared().enumerate().filter_map(move |(index, [i, j])| {
        let point = &sheet.points()[i * side + j];
        let warp = measured(i + 1, j) - measured(i - 1, j);
        let weft = measured(i, j + 1) - measured(i, j - 1);
        let normal = warp.cross(&weft).try_normalize(0.0).filter(|_| point.observed)?;
        let finer = target.finer.as_ref().map_or_else(Vector3::zeros, |finer| finer.places[index]);
        let place = (0..3)
            .fold(prediction.places[index], |at, m| at + own[m].places[index] * moved[m])
            + finer * posed.cells;
        let on = On::Sheet { index, out: out_of([i, j], &target.bench) };
        let edge = Vector3::zeros();
        let at = At { normal, place, on, per_height: 0.0, prediction, finer, edge };
        let sigma_m = point.sigma_m.hypot(options.scan_model_m);
        Some(Distance { at, off_m: normal.dot(&(measured(i, j) - place)), sigma_m, counts })
    })
}

/// How far out a place of a square lies on its way from the plate's edge to the rim.
fn out_of(place: [usize; 2], bench: &Experiment) -> f64 {
    let half_m = 0.5 * bench.specimen.weft_m;
    let [x, z] = place.map(|k| half_m * (2.0 * k as f64 / (Surface::SIDE - 1) as f64 - 1.0));
    let (from_m, nearest_side) = (x.hypot(z), x.abs().max(z.abs()));
    let plate_m = bench.plate.radius_m;
    let rim_m = half_m * from_m / nearest_side.max(1e-9);
    ((from_m - plate_m) / (rim_m - plate_m).max(1e-9)).clamp(0.0, 1.0)
}

/// Across a rim outwards and level, across it and mostly upwards, and along it.
fn directions(next: &Vector3, place: &Vector3) -> [Vector3; 3] {
    let outwards = Vector3::new(place.x, 0.0, place.z).try_normalize(0.0).unwrap_or(Vector3::x());
    let along = next.try_normalize(0.0).unwrap_or_else(|| Vector3::y().cross(&outwards));
    let level = Vector3::y().cross(&along);
    // where the rim hangs straight down, outwards is what is level and across it
    let level =
        if level.norm() < UPRIGHT { outwards - along * along.dot(&outwards) } else { level };
    let level = level.try_normalize(0.0).unwrap_or(outwards);
    let level = if level.dot(&outwards) < 0.0 { -level } else { level };
    [level, level.cross(&along), along]
}

/// Sine of the angle from the vertical below which a rim counts as hanging straight down.
const UPRIGHT: f64 = 0.1;

fn mean_step_m(points: &[Vector3]) -> f64 {
    let step = |k: usize| (points[(k + 1) % points.len()] - points[k]).norm();
    (0..points.len()).map(step).sum::<f64>() / points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_directions_stand_across_each_other() {
        for (next, place) in [
            ([0.0, 0.0, 1.0], [0.1, -0.05, 0.0]),
            ([0.01, -1.0, 0.02], [0.05, -0.05, 0.1]),
            ([0.5, 0.3, -0.2], [-0.1, -0.02, -0.1]),
        ] {
            let (next, place) = (Vector3::from(next), Vector3::from(place));
            let [level, upwards, along] = directions(&next, &place);
            for pair in [(level, upwards), (upwards, along), (along, level)] {
                assert!(pair.0.dot(&pair.1).abs() < 1e-12, "{next} {place}");
            }
            assert!((level.norm() - 1.0).abs() + (upwards.norm() - 1.0).abs() < 1e-12);
            assert!(level.x * place.x + level.z * place.z >= 0.0);
        }
        let [level, upwards, _] = directions(&Vector3::z(), &Vector3::x());
        assert!((level - Vector3::x()).norm() + (upwards.cross(&Vector3::y())).norm() < 1e-12);
    }
}
