//! The steps from a scan to its rim: each type is what is known after one of them, and
//! each is made from the one before, which it consumes.
//!
//! `Scene` -> `Plated` -> `Local` -> `Isolated` -> `Parameterised` -> `Relaxed` ->
//! `Oriented` -> `Sheeted` -> `Registered` -> `Edged` -> `Assessed`

use rayon::prelude::*;

use super::cloth::{self, Cloth};
use super::edge;
use super::error::{PlateCandidate, ScanError};
use super::fit::{self, EdgePoint, Raw};
use super::floor::Floor;
use super::hints::Region;
use super::mark::{self, Marked};
use super::measured::{MeasuredSize, Misfit, Scatter};
use super::mesh_facts::MeshFacts;
use super::options::{ScanOptions, WarpToward};
use super::origin::{self, Origin};
use super::parameterisation::{self, Parameterisation};
use super::plate::Plate;
use super::pose::{self, Pose};
use super::registration::Registration;
use super::rim::{self, Rim, Width};
use super::scene::Scene;
use super::sheet::Sheet;
use super::shift::EdgeShift;
use super::square::{Outline, Square};
use super::uncertainty::{self, Explained, Unexplained};
use super::unit::LengthUnit;
use super::warp::quarters_to_warp;
use super::{frame, limits, loops, misfit};
use crate::base::clock::Stages;
use crate::base::{Isometry3, Point3};

/// The scan besides the cloth: what stands there, and how it was seen.
pub(super) struct Bench {
    /// The file's unit, given or guessed.
    pub unit: LengthUnit,
    /// Points in the file.
    pub points_in_file: usize,
    /// What was found in a mesh; `None` for a cloud.
    pub mesh: Option<MeshFacts>,
    /// By how much a mesh's chords cut off folds \[m\]; 0 for a cloud.
    pub chord_m: f64,
    /// The noise of the sensor alone, without what chords add \[m\].
    pub sensor_noise_m: f64,
    /// The plate, in the scan's frame; its noise includes the chords.
    pub plate: Plate,
    /// How likely it is the drape.
    pub likely: Likely,
    /// The floor, in the local frame.
    pub floor: Option<Floor>,
    /// The local frame from the scan's, both in metres.
    pub local_from_scan: Isometry3,
}

impl Bench {
    /// Whether the scan is a mesh that was cut where it closes from below.
    fn is_cut(&self) -> bool {
        self.mesh.and_then(|mesh| mesh.cut).is_some()
    }
}

/// How likely what was found is a drape.
#[derive(Clone, Copy)]
pub(super) struct Likely {
    /// Log-likelihood ratio against anything \[nats\].
    pub nats: f64,
    /// By how much less likely the next place is \[nats\]; `None` if there is no other.
    pub ahead_nats: Option<f64>,
}

/// A scene whose plate is known.
pub(super) struct Plated {
    /// The scene.
    pub scene: Scene,
    /// The plate, in the scan's frame.
    pub plate: Plate,
    /// How likely it is the drape.
    likely: Likely,
    /// Its place, where that is hardly likelier than anything else.
    pub unlikely: Option<PlateCandidate>,
    /// That of another drape in the scene.
    another: Option<Plate>,
    /// Whether the cloth is as large as a specimen may be.
    pub is_of_size: bool,
    sensor_noise_m: f64,
}

/// A scene in the local frame.
pub(super) struct Local {
    /// The scan besides the cloth.
    pub bench: Bench,
    points: Vec<Point3>,
    /// Colours of the points; empty if nobody asks for a mark.
    colors: Vec<[u8; 3]>,
    /// Points on the mesh's own free edge; empty for a cloud.
    free_edge: Vec<Point3>,
}

/// The cloth, cut free.
pub(super) struct Isolated {
    bench: Bench,
    /// The cloth.
    pub cloth: Cloth,
    free_edge: Vec<Point3>,
    colored: Colored,
}

/// The points among which a mark is looked for; empty if nobody asks for one.
struct Colored {
    points: Vec<Point3>,
    colors: Vec<[u8; 3]>,
}

/// The cloth with material coordinates, up to where its square lies.
pub(super) struct Parameterised {
    bench: Bench,
    cloth: Cloth,
    free_edge: Vec<Point3>,
    colored: Colored,
    /// Its surface points, as the front has placed them.
    pub surface: Parameterisation,
}

/// The cloth, flattened as rigidly as possible, of any size.
pub(super) struct Relaxed {
    /// The scan besides the cloth.
    pub bench: Bench,
    cloth: Cloth,
    free_edge: Vec<Point3>,
    colored: Colored,
    /// Its surface points.
    pub surface: Parameterisation,
    /// The square that they make, if they make one.
    pub outline: Option<Outline>,
}

/// The cloth on its square, whose x axis is the warp if that is known.
pub(super) struct Oriented {
    /// The scan besides the cloth.
    pub bench: Bench,
    /// The cloth.
    pub cloth: Cloth,
    /// Its surface points, relaxed.
    pub surface: Parameterisation,
    /// The specimen's square in their plane.
    pub square: Square,
    /// Side of the square that they made before they were tied to the specimen's, if they
    /// made one \[m\].
    pub outline_side_m: Option<f64>,
    /// How far the direction given for the warp is from the axis taken for it \[rad\]; `None`
    /// if none was given.
    pub warp_off_rad: Option<f64>,
    free_edge: Vec<Point3>,
}

/// The first sheet through the surface points.
pub(super) struct Sheeted {
    cloth: Oriented,
    fitted: fit::Fitted,
}

/// The sheet, registered to the raw points.
pub(super) struct Registered<'a> {
    /// The cloth on its square.
    pub cloth: Oriented,
    /// The raw points near it.
    raw: Raw,
    /// The sheet, its stretch and the shift of its edge.
    pub registration: Registration<'a>,
    /// Material coordinates of the surface points on the sheet \[m\].
    pub material: Vec<[f64; 2]>,
    /// How far they lie off it.
    pub misfit: Misfit,
    /// How far raw points scatter across it.
    scatter: Scatter,
    /// Side of the specimen \[m\].
    pub side_m: f64,
}

/// The sheet with its free edges, and the plate under it.
pub(super) struct Edged<'a> {
    /// The sheet.
    pub registered: Registered<'a>,
    /// The plate's axis and face.
    pub origin: Origin,
    /// Raw points near the edge.
    pub near_edge: Vec<EdgePoint>,
    /// Length of the cloth from edge to opposite edge as scanned \[m\].
    pub widths_m: [Option<f64>; 2],
    /// Share of the edge that was read from the mesh's own.
    pub own_edge_share: f64,
    /// The rim along the edges, local frame.
    pub rim: Rim,
    /// What of the edges' shift was taken for the sensor's, and out of the rim.
    pub shift: EdgeShift,
}

/// The rim with flags and sigmas.
pub(super) struct Assessed<'a> {
    /// The rim, and what it was traced on.
    pub edged: Edged<'a>,
    /// Scanned cloth near it that the sheet does not explain.
    pub unexplained: Unexplained,
}

/// The drape in the part of a scene in which it is to be looked for.
fn find_drape(scene: &Scene, options: &ScanOptions) -> Result<Pose, ScanError> {
    let Some(region) = Region::to_search(options, scene.unit) else {
        return pose::find(&scene.points, scene.unit, options);
    };
    let inside = scene.points.par_iter().filter(|p| region.contains(p)).copied();
    let points: Vec<Point3> = inside.collect();
    limits::enough_points(points.len(), options)?;
    pose::find(&points, scene.unit, options)
}

impl Plated {
    /// Finds the drape, in the first of the scene's units in which there is one.
    pub fn of(mut scene: Scene, options: &ScanOptions) -> Result<Self, ScanError> {
        let find = |scene: &Scene| find_drape(scene, options);
        let first = find(&scene);
        let pose = match first {
            Ok(pose) => pose,
            Err(refused) => {
                let about = refused.candidate().map(|place| place.centre);
                let spacing_m = scene.least_spacing_m(about.as_ref(), options.specimen_side_m);
                let others = std::mem::take(&mut scene.other_units);
                let found = others.into_iter().find_map(|unit| {
                    scene.in_unit(unit);
                    find(&scene).ok().filter(|pose| pose.is_of_size(options))
                });
                found.ok_or_else(|| limits::underlying(refused, spacing_m, None, options))?
            }
        };
        let is_of_size = pose.is_of_size(options);
        let Pose { mut plate, another, nats, ahead_nats, unlikely, .. } = pose;
        // Who says where the plate is has said which of several drapes is meant.
        let mut another = another.filter(|_| options.plate_near.is_none());
        if let Some(region) = Region::about(&plate.centre, &plate.up, options) {
            another = another.filter(|another| region.contains(&another.centre));
            scene.crop(&region);
        }
        let sensor_noise_m = plate.noise_m;
        plate.noise_m = plate.noise_m.hypot(scene.chord_m);
        let likely = Likely { nats, ahead_nats };
        Ok(Self { scene, plate, likely, unlikely, another, is_of_size, sensor_noise_m })
    }

    /// Refuses a scan of several drapes, and a plate that is not the experiment's.
    pub fn judge(&self, options: &ScanOptions) -> Result<(), ScanError> {
        limits::one_drape(&self.plate, self.another.as_ref(), self.scene.unit)?;
        limits::plate(&self.plate, self.scene.unit, options)
    }
}

impl Local {
    /// Finds the local frame and takes the scene into it.
    pub fn of(plated: Plated, options: &ScanOptions) -> Self {
        let Plated { scene, plate, likely, sensor_noise_m, .. } = plated;
        let Scene { points_in_file, unit, mut points, colors, mut free_edge, .. } = scene;
        let (chord_m, mesh) = (scene.chord_m, scene.mesh);
        let found = frame::find(&points, &plate, options);
        let local_from_scan = found.local_from_scan;
        points.par_iter_mut().for_each(|p| *p = local_from_scan * *p);
        free_edge.iter_mut().for_each(|p| *p = local_from_scan * *p);
        let bench = Bench {
            unit,
            points_in_file,
            mesh,
            chord_m,
            sensor_noise_m,
            plate,
            likely,
            floor: found.floor,
            local_from_scan,
        };
        Self { bench, points, colors, free_edge }
    }
}

impl Isolated {
    /// Cuts the scene to the cloth.
    pub fn of(local: Local, options: &ScanOptions, stages: &mut Stages) -> Self {
        let Local { bench, mut points, colors, free_edge } = local;
        let cloth = cloth::isolate(&points, bench.floor, &bench.plate, options, stages);
        if options.mark.is_none() {
            points = Vec::new();
        }
        Self { bench, cloth, free_edge, colored: Colored { points, colors } }
    }
}

impl Parameterised {
    /// Gives the cloth material coordinates.
    pub fn of(isolated: Isolated, options: &ScanOptions) -> Self {
        let Isolated { bench, cloth, free_edge, colored } = isolated;
        let surface = parameterisation::grow(&cloth, options);
        Self { bench, cloth, free_edge, colored, surface }
    }
}

/// The size of a flattened cloth and of the plate that it lies on.
fn measured(side_m: f64, plate: &Plate) -> MeasuredSize {
    MeasuredSize { side_m, plate_radius_m: plate.radius_m, noise_m: plate.noise_m }
}

impl Relaxed {
    /// Relaxes the cloth and looks what square it makes.
    pub fn of(parameterised: Parameterised, options: &ScanOptions) -> Self {
        let Parameterised { bench, cloth, free_edge, colored, mut surface } = parameterised;
        parameterisation::relax(&mut surface, cloth.spacing_m, options);
        let outline = parameterisation::outline(&surface, options);
        Self { bench, cloth, free_edge, colored, surface, outline }
    }

    /// Refuses a cloth that is clearly not of the specimen's size.
    pub fn judge(&self, options: &ScanOptions) -> Result<(), ScanError> {
        let Some(Outline { side_m, .. }) = self.outline else { return Ok(()) };
        let measured = measured(side_m, &self.bench.plate);
        limits::size(&measured, self.bench.mesh.map(|mesh| mesh.edge_m), options)
    }
}

impl Oriented {
    /// Straightens the edges, finds the square and which of its axes is the warp.
    pub fn of(relaxed: Relaxed, options: &ScanOptions) -> Result<Self, ScanError> {
        let Relaxed { bench, cloth, free_edge, colored, mut surface, outline } = relaxed;
        let square = parameterisation::straighten(&mut surface, cloth.spacing_m, options)?;
        let warp_toward = match (options.warp_toward, options.mark) {
            (None, Some(color)) => {
                let tuning = &options.tuning.mark;
                let marked = Marked {
                    points: &colored.points,
                    colors: &colored.colors,
                    cloth: &surface,
                    square: &square,
                    reach_m: tuning.off_cells * cloth.spacing_m
                        + tuning.off_noises * bench.plate.noise_m,
                    plate_radius_m: options.plate_radius_m,
                    tuning,
                };
                Some(WarpToward::BearingDeg(limits::mark(mark::find(&marked, color), options)?))
            }
            (given, _) => given,
        };
        let mut wanted_rad = 0.0;
        if let Some(warp) = warp_toward {
            let least_deg = options.tuning.limits.least_warp_off_vertical_deg;
            wanted_rad = warp.bearing_rad(&bench.local_from_scan, least_deg)?;
        }
        let (square, off_rad) = orient(square, wanted_rad);
        let warp_off_rad = warp_toward.map(|_| off_rad);
        let outline_side_m = outline.map(|outline| outline.side_m);
        Ok(Self { bench, cloth, surface, square, outline_side_m, warp_off_rad, free_edge })
    }

    /// The noise of single points \[m\].
    pub fn noise_m(&self) -> f64 {
        self.bench.plate.noise_m
    }

    fn too_few_points(&self, options: &ScanOptions) -> ScanError {
        limits::too_few_points(self.cloth.count, options)
    }
}

/// Rotates the square by quarter turns so that its x axis lies nearest to this bearing \[rad\],
/// and tells how far it is from it \[rad\].
fn orient(square: Square, wanted_rad: f64) -> (Square, f64) {
    let (quarter_turns, off_rad) = quarters_to_warp(wanted_rad - square.rotation_rad);
    let rotation_rad = square.rotation_rad + quarter_turns * std::f64::consts::FRAC_PI_2;
    (Square { rotation_rad, ..square }, off_rad)
}

impl Sheeted {
    /// Fits the first sheet.
    pub fn of(cloth: Oriented, options: &ScanOptions) -> Result<Self, ScanError> {
        let fitted = fit::fit_sheet(&cloth.surface, &cloth.square, cloth.noise_m(), options);
        let fitted = fitted.ok_or_else(|| cloth.too_few_points(options))?;
        Ok(Self { cloth, fitted })
    }
}

impl<'a> Registered<'a> {
    /// Registers the sheet to the raw points.
    pub fn of(sheeted: Sheeted, options: &'a ScanOptions) -> Result<Self, ScanError> {
        let Sheeted { mut cloth, fitted: fit::Fitted { sheet, mut material } } = sheeted;
        let raw = std::mem::take(&mut cloth.cloth.raw);
        let (surface, noise_m, spacing_m) =
            (&cloth.surface, cloth.noise_m(), cloth.cloth.spacing_m);
        let raw = fit::on_surface(raw, spacing_m, &surface.points, noise_m, options);
        let registration = fit::register_sheet(sheet, &raw, surface, &mut material, options);
        let registration = registration.ok_or_else(|| cloth.too_few_points(options))?;
        let flat_m = options.tuning.plate.disc_radii * options.plate_radius_m;
        let (sheet, tuning) = (&registration.sheet, &options.tuning.sheet);
        let side_m = options.specimen_side_m;
        let lengths_m = [side_m, flat_m];
        let misfit = misfit::of_surface(sheet, surface, &material, &cloth.square, lengths_m);
        let scatter = misfit::scatter(sheet, &raw, &material, flat_m, tuning);
        Ok(Self { cloth, raw, registration, material, misfit, scatter, side_m })
    }

    /// Refuses a sheet that does not fit the points.
    pub fn judge(&self, options: &ScanOptions) -> Result<(), ScanError> {
        limits::misfit(&self.misfit, &self.scatter, self.cloth.noise_m(), options)
    }

    /// The sheet.
    pub fn sheet(&self) -> &Sheet {
        &self.registration.sheet
    }

    /// By how much the sensor shifted the edge of a cloth of such widths.
    fn edge_shift(&self, widths: &[Option<Width>; 2], options: &ScanOptions) -> EdgeShift {
        let bench = &self.cloth.bench;
        let (side_m, stretch_per_m) = (self.side_m, self.registration.stretch_per_m);
        let tuning = &options.tuning.shift;
        let shift = EdgeShift::of(widths, side_m, stretch_per_m, bench.sensor_noise_m, tuning);
        if bench.chord_m < options.tuning.scene.most_chord_m {
            shift
        } else {
            // Chords make the parameterised cloth short: it then says nothing of the edge.
            EdgeShift { by_m: 0.0, sigma_m: bench.chord_m, ..shift }
        }
    }
}

impl<'a> Edged<'a> {
    /// Measures the free edges on the sheet, traces the rim along them, and finds the plate
    /// under the sheet.
    pub fn of(registered: Registered<'a>, options: &ScanOptions) -> Self {
        let Registered { cloth, material, .. } = &registered;
        let (sheet, noise_m) = (registered.sheet(), cloth.noise_m());
        let origin = origin::find(sheet, &cloth.square, options).unwrap_or(Origin {
            axis: [0.0; 2],
            axis_sigma_m: cloth.bench.plate.centre_sigma_m,
            face_y_m: options.cloth_height_m,
            radius_m: cloth.bench.plate.radius_m,
            radius_scatter_m: cloth.bench.plate.radius_scatter_m,
        });
        let (half_m, tuning) = (0.5 * options.specimen_side_m, &options.tuning);
        let surface = &cloth.surface.points;
        let near_edge = fit::edge_points(&registered.raw, material, sheet, options);
        let flat: Vec<[f64; 2]> = near_edge.iter().map(|e| e.material).collect();
        let mut edges = edge::measure_sides(&flat, half_m, noise_m, &tuning.edge);
        let mut own_edge_share = 0.0;
        if cloth.bench.mesh.is_some() {
            let off_m = tuning.sheet.on_sheet_m + tuning.sheet.on_sheet_noises * noise_m;
            let reach_m = tuning.sheet.slide * half_m;
            let own = loops::on_sheet(&cloth.free_edge, surface, material, sheet, off_m, reach_m);
            own_edge_share = loops::refine(&mut edges, &own, half_m, tuning);
        }
        let widths = Width::of(sheet, &edges, half_m);
        let widths_m = widths.map(|width| width.map(|width| width.length_m));
        let shift = registered.edge_shift(&widths, options);
        edges.iter_mut().for_each(|edge| edge.shift(-shift.by_m));
        let rim = rim::trace(sheet, &edges, half_m);
        Self { registered, origin, near_edge, widths_m, own_edge_share, rim, shift }
    }

    /// Refuses the cut of a closed mesh that follows too little of the rim.
    pub fn judge(&self, options: &ScanOptions) -> Result<(), ScanError> {
        let is_cut = self.registered.cloth.bench.is_cut();
        if is_cut { limits::edge_of_cut(self.own_edge_share, options) } else { Ok(()) }
    }
}

impl<'a> Assessed<'a> {
    /// Gives the rim its flags and sigmas.
    pub fn of(mut edged: Edged<'a>, options: &ScanOptions) -> Self {
        let Registered { cloth, material, misfit, .. } = &edged.registered;
        let noise_m = cloth.noise_m();
        let explained = Explained {
            surface: &cloth.cloth.surface,
            parameterised: &cloth.surface.points,
            material,
            spacing_m: cloth.cloth.spacing_m,
            noise_m,
            on_plate_m: misfit.on_plate_m,
            origin_sigma_m: edged.origin.axis_sigma_m,
            edge_sigma_m: edged.shift.sigma_m,
            tuning: &options.tuning.uncertainty,
        };
        let half_m = 0.5 * options.specimen_side_m;
        let sheet = edged.registered.sheet();
        let unexplained = uncertainty::assess(&mut edged.rim, sheet, &explained, half_m);
        Self { edged, unexplained }
    }

    /// The refusal of a rim of which most of a side is not seen, if it is one.
    pub fn lacks_a_side(&self, options: &ScanOptions) -> Option<ScanError> {
        let Registered { cloth, misfit, .. } = &self.edged.registered;
        let lacking = limits::lacks_a_side(&self.edged.rim, cloth.noise_m(), options);
        lacking.map(|error| limits::strained(error, misfit.strain, options))
    }

    /// Refuses a rim whose uncertainty is not known.
    pub fn judge(&self, options: &ScanOptions) -> Result<(), ScanError> {
        let Registered { cloth, misfit, .. } = &self.edged.registered;
        let judged = limits::rim(
            &self.edged.rim,
            &self.unexplained,
            cloth.noise_m(),
            cloth.bench.is_cut(),
            options,
        );
        judged.map_err(|error| limits::strained(error, misfit.strain, options))
    }
}
