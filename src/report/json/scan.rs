//! What `inspect --json` prints of a scan; params.json has its parts too.

use serde::Serialize;

use crate::base::units::M_PER_MM;
use crate::io::{ReadNotes, ViewNote};
use crate::job::verdict::Verdict;
use crate::scan::{LengthUnit, MeshFacts, ScannedBoundary};

/// What `scan2params inspect --json` found in a scan that it answers. A refused scan prints no JSON
/// and ends with exit code 4.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Inspected {
    /// What was read of the file.
    pub read: Read,
    /// What was found; its fields stand in the place of this one.
    #[serde(flatten)]
    pub quality: Quality,
    /// What the scan alone says of a result.
    pub verdict: Verdict,
}

/// What was read of a scan's file.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Read {
    /// Points in the file \[count\].
    pub points_in_file: usize,
    /// Points dropped: not a number, infinite or far away \[count\].
    pub dropped_non_finite: usize,
    /// Pixels dropped by --drop-jumps \[count\].
    pub dropped_jumps: usize,
    /// What was read by a guess or in another way than the file says, a sentence each: which
    /// columns of a text are x, y, z, decimal commas.
    pub taken: Vec<String>,
    /// What was done with each view of several that were brought together; absent for one file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<View>,
}

/// What was done with a view to bring it to the others.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct View {
    /// Name of the view's file.
    pub file: String,
    /// How far its points were moved, root mean square \[mm\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub moved_mm: f64,
    /// By what angle it was turned \[degrees\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub turned_deg: f64,
    /// How far its points lay from the other views, robustly \[mm\]; null if they share none.
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub misfit_before_mm: Option<f64>,
    /// How far its points lie from the other views, robustly \[mm\]; null if they share none.
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub misfit_mm: Option<f64>,
    /// Why it was left out; null if it was not.
    pub left_out: Option<String>,
}

/// What was found in a scan.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Quality {
    /// Points read \[count\].
    pub points: usize,
    /// How a mesh was taken as a surface; null for a cloud.
    pub mesh: Option<Mesh>,
    /// Points of the cloth \[count\].
    pub cloth_points: usize,
    /// Unit of the file's coordinates.
    pub unit: LengthUnit,
    /// Whether the unit was found from the scene.
    pub unit_guessed: bool,
    /// Direction of up in the scan's frame, of length 1 \[-\].
    pub up: [f64; 3],
    /// Share of the cloth's area that was seen \[-\].
    pub seen_share: f64,
    /// Length of the rim \[mm\].
    pub loop_length_mm: f64,
    /// Lengths of the four sides of the rim \[mm\].
    pub side_lengths_mm: [f64; 4],
    /// Side of the square that the flattened cloth makes \[mm\]; null where it makes none.
    pub outline_side_mm: Option<f64>,
    /// Cloth from edge to opposite edge, both ways \[mm\]; null where it cannot be said.
    pub widths_mm: [Option<f64>; 2],
    /// Distances of the four edges from the centre, as scanned \[mm\]; null where an edge was not
    /// seen.
    pub edges_mm: [Option<f64>; 4],
    /// Longest arc of the rim that was bridged \[mm\].
    pub longest_gap_mm: f64,
    /// Its bearing, counter-clockwise from above, from the scan's x axis \[deg\].
    pub longest_gap_bearing_deg: f64,
    /// Radius at which the cloth leaves the plate \[mm\].
    pub plate_radius_mm: f64,
    /// Standard deviation of the plate's centre \[mm\].
    pub origin_sigma_mm: f64,
    /// Distance of the cloth's centre from the plate's \[mm\].
    pub centre_offset_mm: f64,
    /// Height of the floor over the plate's top, negative \[mm\]; null without a floor.
    pub floor_height_mm: Option<f64>,
    /// Distance of neighbouring points \[mm\].
    pub point_spacing_mm: f64,
    /// Standard deviation of the points across the surface \[mm\].
    pub noise_mm: f64,
    /// Root mean square distance of the smoothed points from the fitted sheet \[mm\].
    pub sheet_rms_mm: f64,
    /// The same over the plate, where cloth is smooth: what noise leaves on the smoothed surface
    /// \[mm\].
    pub sheet_rms_on_plate_mm: f64,
    /// How likely the scan shows a drape there: log-likelihood ratio of the specimen against
    /// anything \[nats\].
    pub drape_nats: f64,
    /// By how much less likely the next place in the scene is a drape \[nats\]; null if there is no
    /// other.
    pub drape_ahead_nats: Option<f64>,
    /// Area of scanned cloth near the rim that lies off the fitted sheet \[mm^2\].
    pub unexplained_mm2: f64,
}

/// How a mesh was taken as a surface.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Mesh {
    /// Triangles \[count\].
    pub triangles: usize,
    /// Points that stand for them \[count\].
    pub samples: usize,
    /// Median length of an edge \[mm\].
    pub edge_mm: f64,
    /// Share of the rim that came from the mesh's own edge \[-\].
    pub own_edge_share: f64,
    /// Share of the area that was cut away as a false underside \[-\]; null: nothing cut.
    pub cut_share: Option<f64>,
    /// Angle of the crease along the cut \[deg\]; null: nothing cut.
    pub cut_crease_deg: Option<f64>,
}

impl Inspected {
    /// Of a scan that gave a rim.
    #[must_use]
    pub fn of(scanned: &ScannedBoundary, notes: &ReadNotes, verdict: Verdict) -> Self {
        Self { read: Read::of(notes), quality: Quality::of(scanned), verdict }
    }
}

impl Read {
    pub(super) fn of(notes: &ReadNotes) -> Self {
        Self {
            points_in_file: notes.points_in_file,
            dropped_non_finite: notes.dropped_non_finite,
            dropped_jumps: notes.dropped_jumps,
            taken: notes.taken.clone(),
            views: notes.views.iter().map(View::of).collect(),
        }
    }
}

impl View {
    fn of(view: &ViewNote) -> Self {
        let mm = |m: f64| m.is_finite().then_some(m / M_PER_MM);
        Self {
            file: view.name.clone(),
            moved_mm: view.moved_m / M_PER_MM,
            turned_deg: view.turned_rad.to_degrees(),
            misfit_before_mm: mm(view.misfit_before_m),
            misfit_mm: mm(view.misfit_m),
            left_out: view.left_out.clone(),
        }
    }
}

impl Quality {
    /// Of a scan that gave a rim.
    #[must_use]
    pub fn of(scanned: &ScannedBoundary) -> Self {
        let q = &scanned.quality;
        let mm = |metres: f64| metres / M_PER_MM;
        Self {
            points: q.points,
            mesh: q.mesh.as_ref().map(Mesh::of),
            cloth_points: q.cloth_points,
            unit: scanned.unit,
            unit_guessed: q.unit_guessed,
            up: q.up,
            seen_share: q.seen_share,
            loop_length_mm: mm(q.loop_length_m),
            side_lengths_mm: q.side_lengths_m.map(mm),
            outline_side_mm: q.outline_side_m.map(mm),
            widths_mm: q.widths_m.map(|width| width.map(mm)),
            edges_mm: q.edge_m.map(|edge| Some(mm(edge)).filter(|edge| edge.is_finite())),
            longest_gap_mm: mm(q.longest_gap_m),
            longest_gap_bearing_deg: q.longest_gap_bearing_deg,
            plate_radius_mm: mm(q.plate_radius_m),
            origin_sigma_mm: mm(q.origin_sigma_m),
            centre_offset_mm: mm(q.centre_offset_m),
            floor_height_mm: q.floor_height_m.map(mm),
            point_spacing_mm: mm(q.point_spacing_m),
            noise_mm: mm(q.noise_m),
            sheet_rms_mm: mm(q.sheet_rms_m),
            sheet_rms_on_plate_mm: mm(q.sheet_rms_on_plate_m),
            drape_nats: q.drape_nats,
            drape_ahead_nats: q.drape_ahead_nats,
            unexplained_mm2: q.unexplained_m2 / (M_PER_MM * M_PER_MM),
        }
    }
}

impl Mesh {
    fn of(mesh: &MeshFacts) -> Self {
        Self {
            triangles: mesh.triangles,
            samples: mesh.samples,
            edge_mm: mesh.edge_m / M_PER_MM,
            own_edge_share: mesh.own_edge_share,
            cut_share: mesh.cut.map(|cut| cut.removed_share),
            cut_crease_deg: mesh.cut.map(|cut| cut.crease_rad.to_degrees()),
        }
    }
}

#[cfg(test)]
#[test]
fn the_schema_of_inspect_is_that_of_the_type() {
    let of_params = ["Read", "Verdict", "LengthUnit", "Mesh"];
    crate::base::schema::holds::<Inspected>("inspect", "inspect --json", &of_params);
}
