//! The quality figures of one scan, and where they come from.

use serde::Serialize;

use super::coverage;
use super::mesh_facts::MeshFacts;
use super::options::ScanOptions;
use super::rim::longest_gap;
use super::steps::{Assessed, Edged, Oriented, Registered};
use crate::base::Vector3;

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
    /// Side of the square that the flattened cloth made before it was tied to the
    /// specimen's, if it made one \[m\].
    pub outline_side_m: Option<f64>,
    /// Length of the cloth from edge to opposite edge as scanned, along warp and
    /// weft \[m\]; less than the specimen's side where the sensor erodes edges.
    pub widths_m: [Option<f64>; 2],
    /// Distance of the four edges from the specimen's centre on the flat cloth \[m\].
    pub edge_m: [f64; 4],
    /// Offset of the specimen's centre from the plate's axis on the flat cloth \[m\].
    pub centre_offset_m: f64,
    /// Longest bridged arc \[m\] and the bearing of its middle.
    pub longest_gap_m: f64,
    /// See [`super::frame::Bearing`].
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
    /// Distance between the points of the smoothed surface \[m\].
    pub surface_spacing_m: f64,
    /// Noise of single points, from the cloth on the plate \[m\].
    pub noise_m: f64,
    /// Root mean square distance of the smoothed surface to the fitted sheet \[m\].
    pub sheet_rms_m: f64,
    /// The same over the plate, where cloth is smooth: what noise leaves on the smoothed
    /// surface \[m\].
    pub sheet_rms_on_plate_m: f64,
    /// How likely the scan shows a drape there: log-likelihood ratio of the specimen against
    /// anything \[nats\].
    pub drape_nats: f64,
    /// By how much less likely the next place in the scene is a drape \[nats\]; `None` if there is
    /// no other.
    pub drape_ahead_nats: Option<f64>,
    /// Largest area of scanned cloth within 12 mm of a rim point that the sheet does
    /// not explain \[m^2\].
    pub unexplained_m2: f64,
}

impl Quality {
    /// Reads the figures off the finished steps.
    pub(super) fn of(assessed: &Assessed, options: &ScanOptions) -> Self {
        let Assessed { edged, unexplained } = assessed;
        let Edged { registered, origin, widths_m, own_edge_share, rim, .. } = edged;
        let Registered { cloth: oriented, material, misfit, .. } = registered;
        let Oriented { bench, cloth, square, .. } = oriented;
        let gap = longest_gap(&rim.points);
        let plate_up = bench.local_from_scan * bench.plate.up.into_inner();
        let longest_edge_m = options.tuning.uncertainty.seen_cells * cloth.spacing_m;
        Self {
            points: bench.points_in_file,
            mesh: bench.mesh.map(|mesh| MeshFacts { own_edge_share: *own_edge_share, ..mesh }),
            cloth_points: cloth.count,
            unit_guessed: options.unit.is_none(),
            up: bench.local_from_scan.inverse_transform_vector(&Vector3::y()).into(),
            observed_fraction: rim.observed_fraction(),
            seen_share: coverage::seen_share(material, options.specimen_side_m, longest_edge_m),
            loop_length_m: rim.side_lengths_m.iter().sum(),
            side_lengths_m: rim.side_lengths_m,
            outline_side_m: oriented.outline_side_m,
            widths_m: *widths_m,
            edge_m: rim.edge_m,
            centre_offset_m: (square.centre[0] - origin.axis[0])
                .hypot(square.centre[1] - origin.axis[1]),
            longest_gap_m: gap.length_m,
            longest_gap_bearing_deg: gap.bearing_deg,
            plate_radius_m: origin.radius_m,
            plate_radius_scatter_m: origin.radius_scatter_m,
            origin_sigma_m: origin.axis_sigma_m,
            floor_height_m: bench.floor.map(|f| f.height_m),
            floor_rms_m: bench.floor.map(|f| f.rms_m),
            floor_tilt_rad: bench.floor.map(|f| plate_up.angle(&f.normal)),
            point_spacing_m: cloth.raw_spacing_m,
            surface_spacing_m: cloth.spacing_m,
            noise_m: bench.plate.noise_m,
            sheet_rms_m: misfit.rms_m,
            sheet_rms_on_plate_m: misfit.on_plate_m,
            drape_nats: bench.likely.nats,
            drape_ahead_nats: bench.likely.ahead_nats,
            unexplained_m2: unexplained.area_m2,
        }
    }
}
