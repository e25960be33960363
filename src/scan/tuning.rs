//! Every tuned constant of the scan path, stage by stage: value, unit, and where it is from.
//!
//! The letter behind each value says which:
//! - m: measured. It was swept over simulated drapes and virtual scans, and other values
//!   gave larger errors, sigmas that do not hold, or rims that should have been refused.
//! - d: derived from the experiment's geometry or from another constant.
//! - l: from literature.
//! - c: chosen. Any value near it does as well, or it was never swept; costs are chosen so
//!   that more would not change the result.
//!
//! One command sweeps any of them:
//!
//! ```text
//! scan2params-lab scan DRAPES --seeds 3 --tune sheet.knot_m=4.5e-3
//! ```
//!
//! prints rim errors, what sigma is worth and the refusals with that value in place of its
//! own; `--tune` may be given more than once. [`Tuning::with`] is the same for programs.
//!
//! Not here: what a caller sets ([`super::ScanOptions`]), guards of arithmetic (beside their
//! use), identities of geometry.

use serde::{Deserialize, Serialize};

/// The tuned constants of all stages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// Taking the scan as points.
    pub scene: SceneTuning,
    /// The search for the plate.
    pub plate: PlateTuning,
    /// Which place is the drape.
    pub pose: PoseTuning,
    /// Cutting away what closes a mesh from below.
    pub underside: UndersideTuning,
    /// The local frame and the floor.
    pub frame: FrameTuning,
    /// Cutting the scene to the cloth, and smoothing it.
    pub cloth: ClothTuning,
    /// Material coordinates.
    pub parameterisation: ParameterisationTuning,
    /// The specimen's square in the parameter plane.
    pub square: SquareTuning,
    /// The mark that tells the warp.
    pub mark: MarkTuning,
    /// The first sheet.
    pub sheet: SheetTuning,
    /// Registration of the sheet to the raw points.
    pub registration: RegistrationTuning,
    /// The sensor's shift of the free edge.
    pub shift: ShiftTuning,
    /// The plate under the sheet.
    pub origin: OriginTuning,
    /// The free edge from the density of points.
    pub edge: EdgeTuning,
    /// The free edge of a mesh.
    pub mesh_edge: MeshEdgeTuning,
    /// The uncertainty of the rim.
    pub uncertainty: UncertaintyTuning,
    /// What is refused, beyond the limits that a caller sets.
    pub limits: LimitTuning,
}

/// Taking the scan as points (`scene`, `unit_guess`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneTuning {
    /// Smallest size of a scene with a drape in it \[m\]: a bit less than the drape alone.
    pub smallest_m: f64,
    /// Largest \[m\]: a room with a corridor. Below 1000 times the smallest, so that at most
    /// one of metres and millimetres fits.
    pub largest_m: f64,
    /// Largest distance between the points that stand for a mesh \[m\]; meshes with closer
    /// vertices are sampled as closely as these.
    pub sample_m: f64,
    /// Most points that stand for the whole of a mesh, where the plate is looked for.
    pub most_coarse: f64,
    /// Most points that stand for what lies around the plate.
    pub most_fine: f64,
    /// Radius of that \[m\]: everything that may be specimen, and some floor.
    pub around_m: f64,
    /// Distance between the points that stand for a mesh's free edge \[m\].
    pub edge_step_m: f64,
    /// What lies this near to a place where a cut shows no crease may be cloth or not, and
    /// is left to be bridged \[m\].
    pub weak_m: f64,
    /// The edges of a mesh are alike if nine in ten triangles have none longer than this
    /// many usual ones.
    pub alike: f64,
    /// Among edges that are alike, one longer than this many usual ones is a bridge;
    /// surfaces seen at a grazing angle have edges up to four times the usual.
    pub bridge: f64,
    /// Shortest edge that is taken for a bridge \[m\].
    pub least_bridge_m: f64,
    /// Radius of a fold, for what a chord of a mesh cuts off it \[m\].
    pub fold_radius_m: f64,
    /// A mesh whose chords cut more off its folds than this is too coarse for its length
    /// along the cloth to tell what the sensor did to its edge \[m\].
    pub most_chord_m: f64,
}

/// The search for the plate (`plate`). Names that end in `radii` count plate radii. What tells
/// the cloth on the plate from its underside is swept with
/// `--profiles structured-light@post@below,truedepth@post@below` (docs/validation/scan.md, "Stands
/// and views").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlateTuning {
    /// Points in which the plate is looked for: every 2 mm of a scene of a square metre.
    pub most_coarse: usize,
    /// Voxel in which these are downsampled.
    pub coarse_cell_radii: f64,
    /// Distance between the places at which a flat patch is tried.
    pub seed_cell_radii: f64,
    /// Radius of a patch.
    pub patch_radii: f64,
    /// Largest root mean square of a flat patch \[m\]: the cloth's arch and wrinkles, and the
    /// noise that downsampling leaves.
    pub flat_rms_m: f64,
    /// Least variance of a patch along its narrower axis, in those of a full disc.
    pub filled: f64,
    /// Radius around a patch in which level points are counted.
    pub around_radii: f64,
    /// Share of level points there above which the patch is a larger plane; a plate of half
    /// the sphere's radius has 0.5 or less.
    pub most_level: f64,
    /// Times that a patch is moved to the middle of what is level around it,
    pub patch_rounds: usize,
    /// until it moves by less than this.
    pub settled_radii: f64,
    /// Patches whose centres are nearer than this, with the same side up, are one.
    pub same_radii: f64,
    /// Radius around a patch that is looked at for its edge.
    pub reach_radii: f64,
    /// Bearings at which the edge is looked at.
    pub bearings: usize,
    /// Points whose tangent planes stand for the scene's, where planes wider than the specimen
    /// are looked for.
    pub most_tangents: usize,
    /// Radius of the neighbourhood that a tangent plane is laid through \[m\].
    pub tangent_m: f64,
    /// Points this near to a wide plane are on it \[m\].
    pub on_wide_m: f64,
    /// Least cosine between a wide plane and the tangent plane of a point on it.
    pub along_wide: f64,
    /// Fewest tangent planes that make a plane.
    pub least_tangents: usize,
    /// Planes tried for each that is found.
    pub wide_trials: usize,
    /// Planes that are looked at.
    pub most_wide_planes: usize,
    /// Wider than this in both directions is wider than the specimen, in its sides.
    pub wide_sides: f64,
    /// Radius around a patch in which a drape is looked for, in sides of the specimen: farther
    /// than corners lie.
    pub around_sides: f64,
    /// How far cloth reaches from the axis, in sides of the specimen.
    pub reach_sides: f64,
    /// How deep it hangs, in lengths of the longest overhang.
    pub hang: f64,
    /// How high it rises over the plate \[m\].
    pub rise_m: f64,
    /// Level points beyond this radius are not the disc's.
    pub level_outside_radii: f64,
    /// Level area outside of the disc, in the disc's, at which a place is half as unlikely as a
    /// table, which has ten and more.
    pub half_a_table: f64,
    /// Cloth hangs from this depth on.
    pub hanging_radii: f64,
    /// Cubic cells that a surface of the area of one side of a cell goes through, in the mean over
    /// directions.
    pub cells_per_area: f64,
    /// Places that are measured and verified at most.
    pub most_measured: usize,
    /// Of the first half of these at most within half a side of each other.
    pub most_at_one_drape: usize,
    /// Rounds of a measurement.
    pub measurements: usize,
    /// Most points around a place that it is measured on, as one of many and as the plate.
    pub most_near: [usize; 2],
    /// The plane is laid through what lies within this radius.
    pub disc_radii: f64,
    /// Fewest bearings that make a circle.
    pub least_edges: usize,
    /// Relative error of the radius beyond which it is not the plate.
    pub radius_tolerance: f64,
    /// Cell in which one layer of downsampled points is told from another.
    pub layer_cell_radii: f64,
    /// Downsampled points this far under the uppermost are another layer.
    pub layer_gap_radii: f64,
    /// Cell of the same among points as scanned.
    pub fine_layer_cell_radii: f64,
    /// Depth under the uppermost down to which another layer is looked for among these,
    pub layer_depth_radii: f64,
    /// and the share of the plate's radius within which it is: at the edge the cloth falls.
    pub layer_within: f64,
    /// Bin of depths among which the gap between two layers is looked for \[m\].
    pub layer_bin_m: f64,
    /// A layer has at least this share of the points of the fullest bin; less is strays.
    pub layer_share: f64,
    /// The next layer lies this far under the uppermost at least \[m\]: no plate is thinner.
    pub layer_apart_m: f64,
    /// Between two layers there are fewer points than this share of the lesser one.
    pub layer_valley: f64,
    /// What lies lower than the cloth farther out by this is not cloth \[m\],
    pub outside_higher_m: f64,
    /// nor less than this many times the noise,
    pub outside_noises: f64,
    /// and so far out does the plate's side lie, its axis being off at first.
    pub side_radii: f64,
    /// How far outward that cloth is looked for \[m\].
    pub outside_m: [f64; 2],
    /// Sectors about the axis in which it is.
    pub skirt_sectors: usize,
}

/// Which place is the drape (`pose`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseTuning {
    /// Most points that are flattened at a place.
    pub most_points: usize,
    /// Places that are verified at once, in the order in which they look like drapes,
    pub at_once: usize,
    /// until one is as likely a drape as this \[nats\]: of drapes most are.
    pub enough_nats: f64,
    /// Places beside the likeliest that are verified too, for another drape.
    pub most_beside: usize,
    /// Cell of their downsampling \[m\],
    pub cell_m: f64,
    /// and how far apart the centres of what comes together are, in cells.
    pub apart_cells: f64,
    /// Chance that the outline of a drape ends beyond the square's side.
    pub beyond: f64,
    /// Standard deviation of the outline about the side \[m\].
    pub edge_sigma_m: f64,
    /// Within this many of these it ends at the side, in the shares that are told.
    pub near_sigmas: f64,
    /// Farthest that the outline of anything ends \[m\].
    pub anywhere_m: f64,
    /// Bearings that err independently of each other.
    pub bearings: f64,
    /// Standard deviation of the specimen's middle about the plate's \[m\].
    pub off_sigma_m: f64,
    /// So far beyond the plate's edge, along the cloth, a drape has fallen \[m\],
    pub fallen_beyond_m: [f64; 2],
    /// by this much \[m\].
    pub fallen_m: f64,
    /// Chance that a drape has not, on a bearing on which it is seen;
    pub level_drape: f64,
    /// the same of anything.
    pub level_anything: f64,
    /// Standard deviation of a plate's tilt against the floor \[rad\].
    pub level_sigma_rad: f64,
    /// What is no likelier a drape than this is none \[nats\].
    pub least_nats: f64,
    /// What is likelier than this is surely a drape. Anything else is looked at twice, and a
    /// refusal later on says that it is none \[nats\].
    pub sure_nats: f64,
    /// [`PlateTuning::flat_rms_m`] of the second look \[m\].
    pub less_flat_rms_m: f64,
    /// What is likelier than this, away from the drape, is another \[nats\]:
    pub least_another_nats: f64,
    /// so far away, in sides of the specimen; nearer there is only the first one's cloth.
    pub apart_sides: f64,
    /// A cloth whose side is off by more than this share is none that was cut wrongly, but another
    /// unit's \[-\].
    pub cut_wrongly: f64,
    /// With this share of a scene on wide planes and no place for a drape, there is nothing else.
    pub only_wide: f64,
    /// Times that the plate's axis is looked for under a coarse sheet at most,
    pub centrings: usize,
    /// until it moves by less than this \[m\].
    pub centred_m: f64,
}

/// Cutting away what closes a mesh from below (`underside`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UndersideTuning {
    /// Share of half a side within which everything is cloth: less than 1, for distances
    /// along the mesh's edges are too long by up to 8 %, and for what bounds it.
    pub sure: f64,
    /// In lengths from centre to corner: beyond this nothing is cloth, however it stretches.
    pub beyond: f64,
    /// A triangle is taken to face down, as what closes a sheet from below does and cloth
    /// hardly, if its outer normal has this share upwards or less.
    pub down: f64,
    /// Keeping a triangle that faces down costs as much as this length of cut for its area
    /// \[m per m^2\].
    pub down_cost_per_m: f64,
    /// The dihedral angle is taken over this length on either side of an edge \[m\].
    pub reach_m: f64,
    /// Normals are averaged over this length \[m\]: shorter than `reach_m`.
    pub smooth_m: f64,
    /// A dihedral angle of this makes the cut cheap \[rad\]: folds have 40 to 60 degrees.
    pub cheap_dihedral_rad: f64,
    /// Least cost of a millimetre of cut, so that of many creases the shortest is taken.
    pub least_cost: f64,
    /// A second cut looks this far inward of the first \[m\]: a shell has a crease on either
    /// side of its band.
    pub inward_m: f64,
    /// Of two creases alike the inner one is the cloth's edge: cheaper by a factor e per
    /// this length \[m\].
    pub nearer_m: f64,
    /// Where a cut has a smaller dihedral angle than this, it runs along no crease \[rad\].
    pub min_crease_rad: f64,
    /// A cut shorter than this only parts bridges to the surroundings \[m\].
    pub whole_cut_m: f64,
}

/// The local frame and the floor (`frame`, `floor`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameTuning {
    /// How far from level a floor under a scanned drape is \[rad\].
    pub floor_sigma_rad: f64,
    /// How far the cloth on the plate is from level \[rad\], over its own error.
    pub plate_sigma_rad: f64,
    /// What the standard error of the plate's tilt is multiplied with.
    pub plate_error_factor: f64,
    /// A floor tilted against the plate by more standard deviations does not count.
    pub level_sigmas: f64,
    /// Most points in which the floor is looked for.
    pub most_floor_points: usize,
    /// Cell of the voxel downsampling of these \[m\].
    pub floor_cell_m: f64,
    /// Fewest cells that can be a floor.
    pub least_floor_cells: usize,
    /// Planes tried.
    pub planes: usize,
    /// Least cosine of a floor's tilt against the plate.
    pub least_cosine: f64,
    /// A point this near to a plane is on it \[m\], or this many times the noise.
    pub on_floor_m: f64,
    /// See `on_floor_m`.
    pub on_floor_noises: f64,
    /// Fewest cells of a floor beyond half a side from the axis: cloth hanging level would
    /// be narrower.
    pub least_wide_cells: usize,
    /// Bearings of twelve on which a floor must be seen,
    pub least_around: usize,
    /// farther than this from the axis, in plate radii.
    pub around_radii: f64,
    /// Points under the drape that may lie below a floor, of those on it.
    pub most_below: f64,
}

/// Cutting the scene to the cloth, and smoothing it (`cloth`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClothTuning {
    /// Size of a cell of the surface \[m\]: resolves folds of 4 mm radius.
    pub cell_m: f64,
    /// The cell is no less than this many distances between raw points.
    pub cell_spacings: f64,
    /// Surface points are means about centres that are so far apart, in cells.
    pub apart_cells: f64,
    /// Most points that are used: over ten in a cell, every 0.5 mm of the surface.
    pub most_points: usize,
    /// Cloth is seen this far above the floor \[m\], and this many times the noise.
    pub above_floor_m: f64,
    /// Clearances from floor and plate grow by this many times the noise.
    pub clear_noises: f64,
    /// Depth under the plate's top within which nothing but the plate is expected inside
    /// its edge \[m\].
    pub under_plate_m: f64,
    /// The plate's edge is taken this much narrower there \[m\].
    pub inside_plate_m: f64,
    /// The plate's side reaches this much farther out, where the cloth outside of it is
    /// higher \[m\].
    pub beside_plate_m: f64,
    /// It is looked for where the scan sees this many points under the plate for one on it: a
    /// view from below sees as many, folds that go in under the plate are next to none;
    pub underside_share: f64,
    /// and where the column is as wide as this share of the plate.
    pub wide_column: f64,
    /// Height of the slices of the pedestal in which its radius is read \[m\].
    pub slice_m: f64,
    /// Points of a slice, as shares of those that would cover a wall of its radius: of a column.
    pub wall_shares: [f64; 2],
    /// Clearance from the pedestal \[m\], and in noises.
    pub column_m: f64,
    /// See `column_m`.
    pub column_noises: f64,
    /// Cloth under the plate's top is told from cloth on it below this depth \[m\].
    pub below_top_m: f64,
    /// How far cloth reaches from the axis, in lengths from centre to corner.
    pub reach: f64,
    /// How high cloth rises over the plate \[m\].
    pub rise_m: f64,
    /// How deep it hangs, in lengths of the longest overhang.
    pub hang: f64,
    /// Neighbours that a stray is told by.
    pub stray_neighbours: usize,
    /// A stray's neighbours are farther than this many usual distances,
    pub stray_distance: f64,
    /// or stand for fewer points than this share of the usual number.
    pub stray_count: f64,
    /// Radius of the neighbourhoods that are smoothed over, in cells,
    pub smooth_cells: f64,
    /// and no less than this many times the noise
    pub smooth_noises: f64,
    /// and this \[m\].
    pub smooth_m: f64,
    /// Weight of the pull of the quadric towards a plane, for narrow neighbourhoods.
    pub smooth_pull: f64,
    /// Least residual that counts as usual, in cells.
    pub usual_residual_cells: f64,
}

/// Material coordinates (`parameterisation`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterisationTuning {
    /// The front starts within this share of the plate's radius.
    pub seed_radii: f64,
    /// Farthest that it goes, in lengths from the specimen's centre to a corner.
    pub reach: f64,
    /// Reach of the links between neighbours, in cells.
    pub link_cells: f64,
    /// Most that a link may rise out of the tangent planes at its ends, in its lengths.
    pub link_rise: f64,
    /// Least cosine between the normals at its ends.
    pub link_cosine: f64,
    /// Largest ratio of arc to chord: links whose normals are a right angle apart.
    pub largest_arc: f64,
    /// How much longer a step counts for each unit of disorder
    pub detour: f64,
    /// beyond this.
    pub detour_disorder: f64,
    /// Links whose length is off by this share of a cell lose three quarters of their weight
    /// in the relaxation.
    pub link_off_cells: f64,
    /// Rounds of the first relaxation, and of the last.
    pub rounds: usize,
    /// Rounds of each relaxation while the edges are pulled straight.
    pub straightening_rounds: usize,
    /// Times that the edges are pulled straight.
    pub straightenings: usize,
    /// Conjugate gradient steps of a round.
    pub steps: usize,
    /// The same while the plate's part is loose, whose rotation settles slowly.
    pub loose_steps: usize,
    /// A round that moves the points by less than this in the mean is the last \[m\].
    pub enough_m: f64,
    /// The same while the plate's part is loose \[m\].
    pub loose_enough_m: f64,
    /// Cell of the preconditioner's coarse grid \[m\].
    pub coarse_cell_m: f64,
    /// Half the side of that grid \[m\].
    pub coarse_half_m: f64,
    /// Points this close inside the edge are tied to the square's side \[m\],
    pub tied_inward_m: f64,
    /// and this close outside.
    pub tied_outward_m: f64,
}

/// The specimen's square in the parameter plane (`square`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareTuning {
    /// A bearing whose outline differs by more than this does not count further \[m\].
    pub bound_m: f64,
    /// The search starts from shifts of this size \[m\].
    pub start_shift_m: f64,
    /// Scale of the robust fit in its first ten rounds \[m\],
    pub first_scale_m: f64,
    /// and in the twenty after.
    pub scale_m: f64,
    /// Sides of the square that the cloth may make, shares of the specimen's side.
    pub sides: [f64; 2],
    /// A bearing of the outline this near to that square lies on it \[m\].
    pub on_outline_m: f64,
    /// Share of the bearings of each of its sides that must lie on it.
    pub least_shown: f64,
    /// Share of all bearings on which there must be cloth.
    pub least_outline: f64,
}

/// The mark that tells the warp (`mark`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkTuning {
    /// The cloth's colour is the median within this share of the plate's radius.
    pub plate_radii: f64,
    /// Of the way from the cloth's colour to the mark's, a point of the mark has come this
    /// far at least,
    pub least_way: f64,
    /// and has strayed from it by no more than this share of the way.
    pub most_astray: f64,
    /// Farther off the cloth's surface than this many cells and noises is not on it.
    pub off_cells: f64,
    /// See `off_cells`.
    pub off_noises: f64,
}

/// The first sheet (`sheet`, `fit`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SheetTuning {
    /// The map covers this many half sides.
    pub cover: f64,
    /// Knot distance \[m\]: resolves folds of that radius.
    pub knot_m: f64,
    /// Standard deviation of a surface point beside the noise \[m\].
    pub point_sigma_m: f64,
    /// The scatter across the map is measured of raw points no farther than this from a surface
    /// point \[m\].
    pub scatter_m: f64,
    /// Prior standard deviation of curvature \[1/m\].
    pub curvature_sigma_per_m: f64,
    /// Prior standard deviation of strain.
    pub strain_sigma: f64,
    /// Most fits; points slide after each.
    pub rounds: usize,
    /// Points that slide less than this in the mean have found their places \[m\].
    pub settled_m: f64,
    /// A point counts fully up to this many standard deviations off the sheet,
    pub bound_sigmas: f64,
    /// and at least up to here \[m\].
    pub bound_m: f64,
    /// Disorder beyond this makes a point's standard deviation larger.
    pub disorder: f64,
    /// A raw point this far off the sheet, and this many noises, is on it \[m\].
    pub on_sheet_m: f64,
    /// See `on_sheet_m`.
    pub on_sheet_noises: f64,
    /// A raw point belongs to the cloth within this many cells of a surface point (and
    /// `on_sheet_noises` noises).
    pub near_cells: f64,
    /// Raw points within this distance of the nominal edge are tried for the edge \[m\].
    pub near_edge_m: f64,
    /// Places slide no farther than this many half sides.
    pub slide: f64,
}

/// Registration of the sheet to the raw points (`registration`, `fit`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegistrationTuning {
    /// Raw points count as so many at most against what the sheet is held by: every 1.5 mm.
    pub most_points: usize,
    /// Those within a cell and so many noises of a surface point are taken together.
    pub near_noises: f64,
    /// Most steps after each measurement of the edge; the first is made on a sheet that
    /// still lies off.
    pub steps: [usize; 3],
    /// Prior standard deviation of the strain of a span.
    pub strain_sigma: f64,
    /// After a step longer than this the system is factorised anew \[m\]; until then the
    /// last factor preconditions well.
    pub factor_m: f64,
    /// A step this small ends them \[m\]: where nothing holds it, beyond the edge, the sheet
    /// still moves by half of it.
    pub converged_m: f64,
    /// Largest move of a control in one step \[m\].
    pub most_move_m: f64,
    /// A control is held to its place with this standard deviation \[m\].
    pub held_m: f64,
    /// Standard deviation of a strip's edge, over what the strip says itself \[m\].
    pub edge_sigma_m: f64,
    /// Mean of the cloth's weight over its stretch stiffness \[1/m\]: 0.02 (stiff) to 0.3
    /// (soft) over simulated drapes.
    pub stretch_per_m: f64,
    /// Its standard deviation \[1/m\].
    pub stretch_sigma_per_m: f64,
    /// Strain of the cloth on the plate, in lengths of cloth of the same weight that hang
    /// from its edge \[m\].
    pub on_plate_m: f64,
    /// Shear against stretch.
    pub shear: f64,
    /// Standard deviation of the shift of the edge in the fit: nothing is known \[m\].
    pub shift_sigma_m: f64,
}

/// The sensor's shift of the free edge (`shift`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShiftTuning {
    /// Standard deviation of a sensor's shift of the edge \[m\]: a pixel of a good scanner,
    pub sensor_m: f64,
    /// and this share of the noise.
    pub sensor_per_noise: f64,
    /// Half the width of a cloth is off by this \[m\],
    pub least_m: f64,
    /// with its folds, in the integral of squared curvature across it, by this \[m^2\],
    pub folds_m2: f64,
    /// what stretches in them by this times weight over stiffness \[m^3\],
    pub stretched_m3: f64,
    /// and with noise by this share \[-\] ...
    pub rough_per_noise: f64,
    /// ... of what is beyond this \[m\].
    pub smooth_noise_m: f64,
}

/// The plate under the sheet (`origin`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OriginTuning {
    /// Bearings that are looked at.
    pub bearings: usize,
    /// Fewest that make a circle.
    pub least_bearings: usize,
    /// The depths at which radii are read \[m\].
    pub depths_m: [f64; 2],
    /// The plate is flat up to this radius, in its own: its edge is rounded.
    pub face_radii: f64,
    /// The cloth lies on the plate on this share of the bearings at least, there lowest.
    pub touching: f64,
    /// Cloth that is higher on the plate's middle than where it touches, by less than the first,
    /// lies on the middle; by more than the second it arches over it \[m\].
    pub arch_m: [f64; 2],
    /// Bearings of one fold err together: so many of them count as one.
    pub together: f64,
    /// Folds err evenly about the axis: this share of their scatter is left in it,
    pub folds_share: f64,
    /// and no less than this \[m\]: 0.08 mm in the mean from soft to stiff, where the
    /// scatter says 0.05 to 0.37.
    pub least_sigma_m: f64,
}

/// The free edge from the density of points (`edge`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EdgeTuning {
    /// Distance between the strips along a side \[m\].
    pub station_m: f64,
    /// Half width of a strip \[m\].
    pub strip_half_m: f64,
    /// Most points of a strip that are used: the strip's edge is not that straight.
    pub most_points: usize,
    /// Density of strays relative to the cloth: flying pixels that lie within the noise of
    /// the sheet's plane.
    pub background: f64,
    /// Least blur of the edge \[m\].
    pub least_blur_m: f64,
    /// A strip with less than this share of the usual number of inner points shows no edge.
    pub least_inner: f64,
    /// The first look, before the edges are pulled straight: strips between folds may have
    /// swung out.
    pub first: Look,
    /// Blur of that look \[m\].
    pub first_blur_m: f64,
    /// The measurement: the parameterisation drifts slowly along a side.
    pub measure: Look,
    /// A strip off the smooth edge by this much counts half \[m\].
    pub robust_m: f64,
    /// Standard deviation of the nominal edge, which keeps an unseen side defined \[m\].
    pub nominal_sigma_m: f64,
}

/// How strips across an edge are looked at (`edge`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Strips look this far inward of the nominal edge \[m\],
    pub inward_m: f64,
    /// and this far outward.
    pub outward_m: f64,
    /// The edge bends less than this from strip to strip (second difference) \[m\].
    pub bend_m: f64,
    /// A strip's edge that differs from the smooth edge by more is no edge \[m\].
    pub off_line_m: f64,
}

/// The free edge of a mesh (`loops`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshEdgeTuning {
    /// Half width of a strip \[m\].
    pub strip_half_m: f64,
    /// How far the boundary may lie from the density's edge, inward and outward \[m\].
    pub from_density_m: f64,
    /// Shortest and longest boundary in a strip, in strip widths: a hole's edge is missing
    /// or there twice, a ragged edge is longer than the strip is wide.
    pub length_range: [f64; 2],
    /// A boundary that scatters by more about its middle is ragged \[m\].
    pub most_scatter_m: f64,
    /// Least standard deviation of a strip's edge \[m\].
    pub least_sigma_m: f64,
}

/// The uncertainty of the rim (`uncertainty`). The columns `sigma_factor` of the command
/// must be near 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UncertaintyTuning {
    /// Points farther off the sheet than this, and the noise, are not explained by it \[m\].
    pub unexplained_m: f64,
    /// Radius around a rim point in which points count \[m\].
    pub around_m: f64,
    /// Largest share of unexplained points among them.
    pub max_unexplained: f64,
    /// Principal stretches accepted: the softest knit of the paper's range stretches 7 %
    /// under its own weight; the fit adds some.
    pub stretches: [f64; 2],
    /// Least number of surface points around a rim point, in cells on the half disc of
    /// cloth there.
    pub min_support: f64,
    /// Standard deviation added where the rim is bridged: this share of the distance to the
    /// next observed point,
    pub bridged_share: f64,
    /// and this share of the noise.
    pub bridged_noise_share: f64,
    /// What folds cost in smoothing and parameterising: the standard deviation at a root
    /// mean square curvature of the rim of `folds_curvature_per_m`, growing with its square
    /// \[m\].
    pub folds_sigma_m: f64,
    /// See `folds_sigma_m` \[1/m\].
    pub folds_curvature_per_m: f64,
    /// What the cloth's rotation on the plate is off by, 0.05 degrees at the rim \[m\].
    pub rotation_sigma_m: f64,
    /// What the views disagree by does not average out over the points of a place: the
    /// standard deviation that it tends to on a straight rim \[m\],
    pub views_sigma_m: f64,
    /// by the square of noise / (noise + this) \[m\],
    pub views_noise_m: f64,
    /// and the curvature that doubles it \[1/m\]: the sharper the folds, the more a shifted
    /// view moves the sheet.
    pub doubling_curvature_per_m: f64,
    /// Standard deviation of the sheet across a cloth without folds, in parts of what noise leaves
    /// of itself on the smoothed surface over the plate.
    pub on_plate_share: f64,
    /// Share of the sheet's posterior deviation that counts: it takes downsampled points as
    /// as noisy as single ones.
    pub posterior_share: f64,
    /// Cloth hangs together over this many cells: triangles with longer edges between
    /// scanned points are not seen.
    pub seen_cells: f64,
}

/// What is refused, beyond the limits that a caller sets (`limits`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitTuning {
    /// Fewest points that can carry a rim: about one per 3 mm square.
    pub min_points: usize,
    /// Share of the rim that must lie on the cut of a closed mesh: where it does not, the
    /// false underside took a short way between two folds, and points were 6 mm off.
    pub min_clear: f64,
    /// Share of the outline that must lie on the square.
    pub min_on_square: f64,
    /// With a larger share of hidden bearings it is the view that is at fault, not the
    /// specimen.
    pub most_hidden: f64,
    /// Fewer points are no mark.
    pub least_mark_points: usize,
    /// Share of the marked points that must lie towards one side.
    pub least_mark_share: f64,
    /// How far the middle of the mark may lie from the middle of its side, as seen from the
    /// specimen's centre \[degrees\]: a mark in a corner tells no side.
    pub most_mark_off_deg: f64,
    /// Noise up to which bridges are held by the sheet's lengths \[m\].
    pub bridged_well_noise_m: f64,
    /// Shortest and longest side of the flattened cloth, shares of the specimen's: cloth
    /// does not shrink on a plate; one of 6,000 g/s^2 stretches by 2.5 %.
    pub sides: [f64; 2],
    /// The same where the scan is refused anyway: beyond, the size is the likelier reason.
    pub likely_sides: [f64; 2],
    /// Noise makes it read larger by up to this many times the noise.
    pub size_noises: f64,
    /// What the plate's radius reads in a scan, as a share of the true radius: the cloth leaves it
    /// a little inside its edge.
    pub plate_reads: f64,
    /// Coordinates stored in larger steps than this are to blame for most refusals \[m\].
    pub coarse_step_m: f64,
    /// Points farther apart than this are to blame for cloth and rim that are not seen \[m\].
    pub sparse_m: f64,
    /// Distance between points that is enough \[m\].
    pub needed_m: f64,
    /// An arc of the rim longer than this share of a side that is not seen is to blame for a sheet
    /// that does not fit.
    pub most_of_a_side: f64,
    /// With cloth seen on this share of the bearings a little beyond the plate, nothing hides it.
    pub all_round: f64,
    /// Median strain of the sheet beyond which a rim that is not seen follows from it \[-\]: cloth
    /// that hangs reads up to 0.015.
    pub most_strain: f64,
    /// Fewer surface points than this near a place of the rim that lie off the sheet are strays.
    pub unexplained_points: f64,
    /// Sides of a mesh that was cut may differ by this share of what others may \[-\].
    pub uneven_of_cut: f64,
    /// A sheet whose typical point lies off by more than this share of the misfit's limit is off
    /// everywhere.
    pub everywhere: f64,
    /// Noise blurs the folds where more than this share of the sheet's places hold half of the
    /// squared distances: of sheets that missed a fold at most 0.09 do ...
    pub blurred_places: f64,
    /// ... and then the sheet may lie off by this many times the misfit's limit ...
    pub blurred_misfit: f64,
    /// ... at less noise than this \[m\]: more was not tried.
    pub blurred_noise_m: f64,
    /// A sheet is off in many places, and not where the cloth is creased, if more than this share
    /// of its places hold half of the squared distances.
    pub many_places: f64,
    /// Passes miss each other if points scatter across the hanging cloth by this many times what
    /// they do across the plate: valid scans have up to 3.2, passes 3 mm apart from 3.7 on ...
    pub scatter: f64,
    /// ... and by more than this \[m\].
    pub least_scatter_m: f64,
    /// Where the sheet is off in many places, this many times are enough.
    pub scatter_where_off: f64,
    /// With sparse points the flattened cloth reads shorter, down to this share.
    pub sparse_reads: f64,
    /// A direction for the warp that is nearer to the vertical tells no side of the
    /// specimen \[degrees\]: an error of ten degrees in it turns its horizontal part by twenty.
    pub least_warp_off_vertical_deg: f64,
}

/// The values that ship.
const SHIPPED: Tuning = Tuning {
    scene: SceneTuning {
        smallest_m: 0.12,       // d
        largest_m: 60.0,        // c
        sample_m: 1.2e-3,       // c
        most_coarse: 250_000.0, // c
        most_fine: 1_000_000.0, // c
        around_m: 0.45,         // d
        edge_step_m: 0.25e-3,   // c
        weak_m: 8e-3,           // c
        alike: 3.0,             // c
        bridge: 6.0,            // m
        least_bridge_m: 8e-3,   // c
        fold_radius_m: 10e-3,   // m: mean knit
        most_chord_m: 0.1e-3,   // c
    },
    plate: PlateTuning {
        most_coarse: 250_000,         // c
        coarse_cell_radii: 0.1,       // c
        seed_cell_radii: 0.4,         // c
        patch_radii: 0.6,             // c
        flat_rms_m: 3e-3,             // m: arches of 2.5 mm at bending lengths up to 30 mm
        filled: 0.3,                  // c
        around_radii: 1.5,            // c
        most_level: 0.85,             // d
        patch_rounds: 6,              // c
        settled_radii: 0.01,          // c
        same_radii: 0.04,             // c
        reach_radii: 2.2,             // c
        bearings: 36,                 // c
        most_tangents: 6_000,         // c: time
        tangent_m: 15e-3,             // c
        on_wide_m: 8e-3,              // c
        along_wide: 0.9,              // c
        least_tangents: 100,          // c
        wide_trials: 100,             // l: for a plane of one in ten, a failure in 10^4
        most_wide_planes: 6,          // c
        wide_sides: 1.1,              // d
        around_sides: 0.78,           // d
        reach_sides: 0.74,            // d: corners at 0.71, stretch
        hang: 1.12,                   // d: stretch
        rise_m: 8e-3,                 // c
        level_outside_radii: 1.5,     // c
        half_a_table: 4.0,            // d: a hand level with the plate has 1 to 2
        hanging_radii: 0.5,           // d: rims hang 1.2 deep and more; tables are higher
        cells_per_area: 1.5,          // d: the mean of |cos| over three axes
        most_measured: 12,            // c: time
        most_at_one_drape: 3,         // c: the plate, and the backs of folds
        measurements: 6,              // c
        most_near: [15_000, 100_000], // c: time
        disc_radii: 0.8,              // c
        least_edges: 10,              // c
        radius_tolerance: 0.25,       // m: stiff cloth leaves the plate too gently for less
        layer_cell_radii: 0.15,       // d: one and a half voxels
        layer_gap_radii: 0.05,        // d: less than plates are thick
        fine_layer_cell_radii: 0.1,   // c
        layer_depth_radii: 0.5,       // c
        layer_within: 0.85,           // c
        layer_bin_m: 0.4e-3,          // c
        layer_share: 0.04,            // c
        layer_apart_m: 3e-3,          // m: passes of a depth camera drift by 1 to 2 mm
        layer_valley: 0.25,           // m: voxels of 3 mm make layers with 0.4 between them
        outside_higher_m: 1.2e-3,     // d: stiff cloth's arch rises outward by less
        outside_noises: 4.0,          // c
        side_radii: 1.05,             // c
        outside_m: [2e-3, 8e-3],      // c
        skirt_sectors: 120,           // c
    },
    pose: PoseTuning {
        most_points: 80_000,           // c
        at_once: 2,                    // c: time
        enough_nats: 40.0,             // m: whole drapes 46 to 65, others 28 and less
        most_beside: 4,                // c: time
        cell_m: 3.5e-3,                // c
        apart_cells: 0.75,             // c: time
        beyond: 0.01,                  // c
        edge_sigma_m: 4e-3,            // c
        near_sigmas: 2.5,              // c
        anywhere_m: 0.237,             // d
        bearings: 20.0,                // c
        off_sigma_m: 10e-3,            // c
        fallen_beyond_m: [0.03, 0.04], // c
        fallen_m: 6e-3,                // m: drapes 14 mm, boards 0 to 5
        level_drape: 0.01,             // c
        level_anything: 0.2,           // c
        level_sigma_rad: 0.026,        // c: 1.5 degrees
        least_nats: 6.0,               // m: half drapes 8.7, others 5.3 and less
        sure_nats: 15.0,               // m: boxes under cloth 11.7, parts of drapes 8.7 to 35
        less_flat_rms_m: 6e-3,         // m: arches in noise of 2 mm
        least_another_nats: 20.0,      // m: whole drapes 46 to 65, others 28 and less
        apart_sides: 0.53,             // d: rims reach 0.5, narrow corners more
        cut_wrongly: 0.2,              // c
        only_wide: 0.8,                // c
        centrings: 3,                  // c
        centred_m: 1.5e-3,             // c
    },
    underside: UndersideTuning {
        sure: 0.93,                                              // m
        beyond: 1.2,                                             // d
        down: -0.8,                                              // c
        down_cost_per_m: 50.0,                                   // c
        reach_m: 2.5e-3,                                         // c
        smooth_m: 1.5e-3,                                        // c
        cheap_dihedral_rad: 30.0 * std::f64::consts::PI / 180.0, // m
        least_cost: 2e-3,                                        // c
        inward_m: 4e-3,                                          // c
        nearer_m: 6e-3,                                          // c
        min_crease_rad: 40.0 * std::f64::consts::PI / 180.0,     // c
        whole_cut_m: 0.3,                                        // c
    },
    frame: FrameTuning {
        floor_sigma_rad: 2e-3,      // c
        plate_sigma_rad: 1e-3,      // c
        plate_error_factor: 3.0,    // c
        level_sigmas: 4.0,          // c
        most_floor_points: 250_000, // c
        floor_cell_m: 6e-3,         // c
        least_floor_cells: 300,     // c
        planes: 300,                // l: for one inlier in three, a failure in 10^5
        least_cosine: 0.966,        // c: 15 degrees
        on_floor_m: 2e-3,           // c
        on_floor_noises: 2.0,       // c
        least_wide_cells: 200,      // c
        least_around: 8,            // c
        around_radii: 1.5,          // c
        most_below: 0.2,            // c
    },
    cloth: ClothTuning {
        cell_m: 2.0e-3,             // d
        cell_spacings: 1.1,         // c
        apart_cells: 0.57,          // m: seeds 9051, 9052; 0.65 and 0.75 refuse more soft cloth
        most_points: 350_000,       // c
        above_floor_m: 5e-3,        // c
        clear_noises: 4.0,          // c
        under_plate_m: 15e-3,       // c
        inside_plate_m: 3e-3,       // c
        beside_plate_m: 1.5e-3,     // c
        wide_column: 0.75,          // c
        underside_share: 0.15,      // m: 0.02 and less of soft knits from above, 0.4 from below
        slice_m: 5e-3,              // c
        wall_shares: [0.015, 3.0],  // c
        column_m: 3e-3,             // m: with 2 mm a rim behind the column was 3 mm off
        column_noises: 3.0,         // c
        below_top_m: 2e-3,          // c
        reach: 1.05,                // d: stretch
        rise_m: 10e-3,              // c
        hang: 1.12,                 // d: stretch
        stray_neighbours: 10,       // c
        stray_distance: 2.2,        // c
        stray_count: 0.08,          // c
        smooth_cells: 2.5,          // c
        smooth_noises: 2.5,         // c
        smooth_m: 2e-3,             // c
        smooth_pull: 1e-3,          // c
        usual_residual_cells: 0.08, // c
    },
    parameterisation: ParameterisationTuning {
        seed_radii: 0.8,          // c
        reach: 1.12,              // d: stretch
        link_cells: 2.4,          // c
        link_rise: 0.6,           // c
        link_cosine: 0.4,         // c
        largest_arc: 1.12,        // d: pi / (2 sqrt 2)
        detour: 10.0,             // c
        detour_disorder: 2.5,     // c
        link_off_cells: 0.5,      // c
        rounds: 6,                // c
        straightening_rounds: 3,  // c
        straightenings: 2,        // c
        steps: 8,                 // m
        loose_steps: 12,          // m: with 8 one soft drape was rotated by 0.3 degrees
        enough_m: 0.02e-3,        // m
        loose_enough_m: 0.002e-3, // m
        coarse_cell_m: 12e-3,     // c
        coarse_half_m: 0.21,      // d
        tied_inward_m: 4e-3,      // c
        tied_outward_m: 2e-3,     // c
    },
    square: SquareTuning {
        bound_m: 10e-3,      // c
        start_shift_m: 6e-3, // c
        first_scale_m: 5e-3, // c
        scale_m: 2e-3,       // c
        sides: [0.6, 1.4],   // c
        on_outline_m: 4e-3,  // c
        least_shown: 0.5,    // c
        least_outline: 0.8,  // c
    },
    mark: MarkTuning {
        plate_radii: 0.8, // c
        least_way: 0.4,   // c
        most_astray: 0.6, // c
        off_cells: 2.0,   // c
        off_noises: 3.0,  // c
    },
    sheet: SheetTuning {
        cover: 1.1,                   // d: stretch
        knot_m: 6e-3,                 // m: 4.5 mm changed nothing
        point_sigma_m: 0.1e-3,        // c
        scatter_m: 8e-3,              // c
        curvature_sigma_per_m: 100.0, // m: weaker bending changed nothing
        strain_sigma: 0.05,           // m: 0.01 makes noisy scans worse
        rounds: 6,                    // c
        settled_m: 0.02e-3,           // m
        bound_sigmas: 4.0,            // c
        bound_m: 1.5e-3,              // c
        disorder: 1.5,                // c
        on_sheet_m: 0.4e-3,           // c
        on_sheet_noises: 3.0,         // c
        near_cells: 4.0,              // c
        near_edge_m: 20e-3,           // d: more than a strip looks inward
        slide: 1.09,                  // d: within `cover`
    },
    registration: RegistrationTuning {
        most_points: 40_000,       // c
        near_noises: 2.0,          // c
        steps: [2, 5, 5],          // m
        strain_sigma: 0.02,        // m: 0.01 too stiff, 0.05 swallows the shift
        factor_m: 0.6e-3,          // m
        converged_m: 0.25e-3,      // m
        most_move_m: 4e-3,         // c
        held_m: 8e-3,              // c
        edge_sigma_m: 0.5e-3,      // c
        stretch_per_m: 0.07,       // m
        stretch_sigma_per_m: 0.10, // m
        on_plate_m: 0.13,          // m
        shear: 2.0,                // m
        shift_sigma_m: 3e-3,       // c
    },
    shift: ShiftTuning {
        sensor_m: 0.3e-3,       // c
        sensor_per_noise: 0.2,  // c
        least_m: 0.05e-3,       // m
        folds_m2: 0.4e-6,       // m
        stretched_m3: 2.4e-6,   // m
        rough_per_noise: 0.65,  // m: rims before a stereo camera, 1.37 mm off with 0
        smooth_noise_m: 0.5e-3, // m
    },
    origin: OriginTuning {
        bearings: 72,             // c
        least_bearings: 48,       // c
        depths_m: [1e-3, 4e-3],   // m
        face_radii: 0.95,         // d
        touching: 0.25,           // c
        arch_m: [0.5e-3, 0.8e-3], // m: simulated drapes have 0 to 0.3 or 1.0 to 1.6, noise adds 0.4
        together: 4.0,            // c
        folds_share: 0.3,         // m
        least_sigma_m: 0.06e-3,   // m
    },
    edge: EdgeTuning {
        station_m: 5e-3,      // d: the boundary vector's own
        strip_half_m: 4e-3,   // c
        most_points: 400,     // c
        background: 0.01,     // m
        least_blur_m: 0.1e-3, // c
        least_inner: 0.15,    // c
        first: Look { inward_m: 16e-3, outward_m: 16e-3, bend_m: 1.0e-3, off_line_m: 3e-3 }, // c
        first_blur_m: 0.3e-3, // c
        measure: Look { inward_m: 12e-3, outward_m: 12e-3, bend_m: 0.05e-3, off_line_m: 4e-3 }, // c
        robust_m: 1.5e-3,     // c
        nominal_sigma_m: 10e-3, // c
    },
    mesh_edge: MeshEdgeTuning {
        strip_half_m: 4e-3,       // c
        from_density_m: 4e-3,     // c
        length_range: [0.7, 1.5], // c
        most_scatter_m: 0.6e-3,   // c
        least_sigma_m: 0.05e-3,   // c
    },
    uncertainty: UncertaintyTuning {
        unexplained_m: 2.0e-3,           // c
        around_m: 12e-3,                 // c
        max_unexplained: 0.2,            // c
        stretches: [0.85, 1.15],         // m
        min_support: 0.3,                // c
        bridged_share: 0.04,             // m
        bridged_noise_share: 0.15,       // m
        folds_sigma_m: 0.03e-3,          // m
        folds_curvature_per_m: 40.0,     // c
        rotation_sigma_m: 0.06e-3,       // m
        views_sigma_m: 1.04e-3,          // m
        views_noise_m: 0.6e-3,           // m
        doubling_curvature_per_m: 150.0, // m
        on_plate_share: 1.3,             // m
        posterior_share: 0.5,            // m
        seen_cells: 4.0,                 // c
    },
    limits: LimitTuning {
        min_points: 3000,                  // c
        min_clear: 0.8,                    // m
        min_on_square: 0.5,                // c
        most_hidden: 0.2,                  // c
        least_mark_points: 20,             // c
        least_mark_share: 0.8,             // c
        most_mark_off_deg: 30.0,           // c
        bridged_well_noise_m: 1e-3,        // m
        sides: [0.975, 1.045],             // m
        likely_sides: [0.98, 1.02],        // m
        size_noises: 4.0,                  // m
        plate_reads: 0.99,                 // m
        coarse_step_m: 2e-3,               // m
        sparse_m: 2.8e-3,                  // m
        needed_m: 2.5e-3,                  // m
        most_of_a_side: 0.8,               // c
        all_round: 0.95,                   // m: partial drapes 0.83 and less, boxes and balls 1
        most_strain: 0.02,                 // m
        unexplained_points: 6.0,           // c
        uneven_of_cut: 0.25,               // m
        everywhere: 0.4,                   // c
        blurred_places: 0.12,              // m
        blurred_misfit: 1.25,              // m: rims are 1.1 to 1.9 mm off there
        blurred_noise_m: 2.5e-3,           // m: of stereo cameras' scans
        many_places: 0.08,                 // m
        scatter: 3.5,                      // m
        least_scatter_m: 0.3e-3,           // c
        scatter_where_off: 1.5,            // m
        sparse_reads: 0.94,                // m
        least_warp_off_vertical_deg: 30.0, // c
    },
};

impl Default for Tuning {
    fn default() -> Self {
        SHIPPED
    }
}

/// Why a constant cannot be set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TuningError {
    /// There is none of this name.
    #[error("there is no tuned constant {key}; src/scan/tuning.rs lists them as STAGE.NAME")]
    Unknown {
        /// The name asked for.
        key: String,
    },
    /// The constant cannot have this value.
    #[error("the tuned constant {key} cannot be {value}: {reason}")]
    Value {
        /// The name.
        key: String,
        /// The value asked for.
        value: String,
        /// What is wrong.
        reason: String,
    },
}

impl Tuning {
    /// Whether all values are those that ship.
    #[must_use]
    pub fn is_shipped(&self) -> bool {
        *self == SHIPPED
    }

    /// The same with the constant `key`, written `stage.name`, set to `value`, written as in
    /// JSON.
    ///
    /// # Errors
    /// When there is no such constant, or it cannot have that value.
    pub fn with(&self, key: &str, value: &str) -> Result<Self, TuningError> {
        let refuse = |reason: String| {
            let (key, value) = (key.to_owned(), value.to_owned());
            TuningError::Value { key, value, reason }
        };
        let mut all = serde_json::to_value(self).map_err(|error| refuse(error.to_string()))?;
        let place = all.pointer_mut(&format!("/{}", key.replace('.', "/")));
        let place = place.ok_or_else(|| TuningError::Unknown { key: key.to_owned() })?;
        *place = serde_json::from_str(value).map_err(|error| refuse(error.to_string()))?;
        serde_json::from_value(all).map_err(|error| refuse(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_is_set_by_its_name_and_nothing_else_changes() {
        let tuned = Tuning::default().with("sheet.knot_m", "4.5e-3").unwrap();
        assert!(!tuned.is_shipped());
        let mut expected = Tuning::default();
        expected.sheet.knot_m = 4.5e-3;
        assert_eq!(tuned, expected);
        let steps = Tuning::default().with("registration.steps", "[1, 2, 3]").unwrap();
        assert_eq!(steps.registration.steps, [1, 2, 3]);
        assert!(tuned.with("sheet.knot_m", "6e-3").unwrap().is_shipped());
    }

    #[test]
    fn what_is_no_constant_or_no_value_is_refused() {
        let shipped = Tuning::default();
        assert!(matches!(shipped.with("sheet.knots", "1"), Err(TuningError::Unknown { .. })));
        assert!(matches!(shipped.with("", "1"), Err(TuningError::Unknown { .. })));
        for value in ["wide", "", "[1]", "null", "1e-3 "] {
            let set = shipped.with("square.bound_m", value);
            assert_eq!(set.is_ok(), value == "1e-3 ", "{value}");
        }
    }
}
