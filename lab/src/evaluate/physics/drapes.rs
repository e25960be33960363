//! Drapes against each other and against measured ones, for `scan2params-lab physics`.
//!
//! In: nothing, or a folder of measured data. Out: tables, charts and pictures. Meshes are
//! compared on one branch: the finer drape starts from the coarser one.

use std::path::Path;

use image::RgbImage;

use super::{DataError, Table, text_rows};
use scan2params::base::Boundary;
use scan2params::base::clock::thread_cpu_s;
use scan2params::base::frame::GRAVITY_M_S2;
use scan2params::fabric::Fabric;
use scan2params::picture::chart::{Axis, COLOURS, Chart, Legend, Mark, Series};
use scan2params::picture::shaded::picture;
use scan2params::sim::experiment::{Softening, bending_length_m};
use scan2params::sim::{Drape, Drop, DropStart, Experiment, SimOptions, drape, drape_on_finer};

/// Fabrics of the mesh study: name and the paper's units. Bending lengths of 19, 12 and
/// 8 mm: the median of 618 measured fabrics, a stiff and the mean knit.
pub(super) const MESH_FABRICS: [(&str, [f64; 7]); 3] = [
    ("woven", [131e3, 164e3, 75e3, 11_200.0, 11_200.0, 11_200.0, 180.0]),
    ("stiff knit", [240e3, 310e3, 90e3, 5200.0, 3600.0, 4100.0, 260.0]),
    ("mean knit", [131_010.96, 163_944.78, 75_064.22, 1119.74, 1370.87, 1245.30, 214.02]),
];

/// Vertices a side: cells of 10, 5 and 2.5 mm.
const MESHES: [usize; 3] = [31, 61, 121];

/// A drape and the processor time that it took \[s\].
pub(super) struct Timed {
    pub(super) drape: Drape,
    pub(super) cpu_s: f64,
}

pub(super) fn timed(make: impl FnOnce() -> Drape) -> Timed {
    let before = thread_cpu_s();
    let drape = make();
    let cpu_s = before.zip(thread_cpu_s()).map_or(f64::NAN, |(before, after)| after - before);
    Timed { drape, cpu_s }
}

/// To full rest: a cycle that raises the energy, because friction's anchors followed, does
/// not end the descent.
pub(super) fn options(experiment: Experiment) -> SimOptions {
    SimOptions { experiment, energy_drop: f64::NEG_INFINITY, ..SimOptions::default() }
}

fn again(fabric: &Fabric, from: &Drape, vertices: usize) -> Timed {
    // straight to rest: a motion could leave the branch
    let options = SimOptions { vertices, settle_steps: 0, ..options(Experiment::default()) };
    timed(|| drape_on_finer(fabric, from, &options))
}

/// Mean and largest distance of corresponding points of two rims \[mm\].
pub(super) fn rim_mm(a: &Boundary, b: &Boundary) -> [f64; 2] {
    let distances = a.positions_m().zip(b.positions_m()).map(|(p, q)| (p - q).norm());
    let largest = distances.fold(0.0, f64::max);
    [1e3 * a.mean_distance_m(b), 1e3 * largest]
}

/// The fabric with stretch and shear three times as stiff.
pub(super) fn stiffer(fabric: &Fabric) -> Fabric {
    Fabric {
        stretch_weft_n_m: 3.0 * fabric.stretch_weft_n_m,
        stretch_warp_n_m: 3.0 * fabric.stretch_warp_n_m,
        shear_n_m: 3.0 * fabric.shear_n_m,
        ..*fabric
    }
}

/// Columns of [`meshes`].
pub const MESH_COLUMNS: &str = "fabric, bending_length_mm, cell_mm, stop, folds, energy_mj, \
    moved_mean_mm, moved_largest_mm, again_mean_mm, again_largest_mm, stretch_mean_mm, \
    stretch_largest_mm, stretch_stop, cpu_s";

/// Cells of 10, 5 and 2.5 mm on one branch, for the first `fabrics` of three fabrics: how
/// far the rim moves from the coarser mesh's, how far it moves when the same drape is only
/// started again, and when stretch and shear are three times as stiff. Each drape's name,
/// row and picture go to `done` as it comes to rest: a drape on 2.5 mm takes minutes.
pub fn meshes(fabrics: usize, mut done: impl FnMut(&str, &[String], RgbImage)) {
    for (name, values) in MESH_FABRICS.into_iter().take(fabrics) {
        let fabric = Fabric::from_paper_units(values);
        let stiffer = stiffer(&fabric);
        let mut coarser: Option<Drape> = None;
        for vertices in MESHES {
            let Timed { drape: d, cpu_s } = match &coarser {
                Some(from) => again(&fabric, from, vertices),
                None => timed(|| {
                    let options = SimOptions { vertices, ..options(Experiment::default()) };
                    drape(&fabric, &Drop::canonical(), &options)
                }),
            };
            let same = again(&fabric, &d, vertices).drape;
            let stiff = again(&stiffer, &d, vertices).drape;
            let against = |other: Option<&Drape>| {
                let two = |[mean, most]: [f64; 2]| format!("{mean:.2}, {most:.2}");
                other.map_or("-, -".to_owned(), |o| two(rim_mm(&o.boundary, &d.boundary)))
            };
            let row = [
                name.to_owned(),
                format!("{:.1}", 1e3 * bending_length_m(&fabric)),
                format!("{:.1}", 1e3 * d.grid.spacing_m),
                d.stop.name().to_owned(),
                d.nodes.to_string(),
                format!("{:.4}", 1e3 * d.energy_j),
                against(coarser.as_ref()),
                against(Some(&same)),
                against(Some(&stiff)),
                stiff.stop.name().to_owned(),
                format!("{cpu_s:.1}"),
            ];
            done(&format!("{name} {vertices}"), &row, picture(&d.mesh(), 0.6, 0.6));
            coarser = Some(d);
        }
    }
}

/// Side of a pixel of a silhouette \[m\].
const PIXEL_M: f64 = 0.5e-3;

/// Drape coefficient \[%\]: the part of the specimen's overhang that is still seen from
/// above. The silhouette is the rim's projection, the sheet's and the plate's together.
#[must_use]
pub fn drape_coefficient(d: &Drape, experiment: &Experiment) -> f64 {
    let radius_m = 0.5 * experiment.specimen.weft_m;
    let half = (1.05 * radius_m / PIXEL_M).ceil() as isize;
    let width = (2 * half + 1) as usize;
    let mut seen = vec![false; width * width];
    let at = |k: usize| (k as isize - half) as f64 * PIXEL_M;
    let rim: Vec<[f64; 2]> = d.boundary.positions_m().map(|p| [p.x, p.z]).collect();
    for row in 0..width {
        let z = at(row);
        for column in 0..width {
            let x = at(column);
            let plate = x.hypot(z) <= experiment.plate.radius_m;
            seen[row * width + column] = plate || winding(&rim, [x, z]) != 0;
        }
    }
    let cells = d.grid.cells.iter().zip(&d.grid.volume_fraction);
    let full = cells.filter(|(_, fraction)| **fraction > 0.999);
    for (cell, _) in full {
        let [a, b, c, e] = cell.map(|v| d.positions_m[v as usize]).map(|p| [p.x, p.z]);
        for triangle in [[a, b, c], [b, c, e]] {
            cover(&mut seen, width, half, &triangle);
        }
    }
    let area = seen.iter().filter(|s| **s).count() as f64 * PIXEL_M * PIXEL_M;
    let disc = |radius: f64| std::f64::consts::PI * radius * radius;
    let plate = disc(experiment.plate.radius_m);
    100.0 * (area - plate) / (disc(radius_m) - plate)
}

/// How often a closed polygon goes round a point.
fn winding(polygon: &[[f64; 2]], [x, z]: [f64; 2]) -> i32 {
    let mut turns = 0;
    for (k, &[ax, az]) in polygon.iter().enumerate() {
        let [bx, bz] = polygon[(k + 1) % polygon.len()];
        if (az <= z) != (bz <= z) {
            let left = (bx - ax) * (z - az) - (x - ax) * (bz - az);
            turns += i32::from(az <= z && left > 0.0) - i32::from(az > z && left < 0.0);
        }
    }
    turns
}

fn cover(seen: &mut [bool], width: usize, half: isize, triangle: &[[f64; 2]; 3]) {
    let span = |k: usize| {
        let values = triangle.map(|p| p[k] / PIXEL_M + half as f64);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max).floor().max(-1.0);
        low..((high + 1.0) as usize).min(width)
    };
    for row in span(1) {
        for column in span(0) {
            let p = [column, row].map(|k| (k as isize - half) as f64 * PIXEL_M);
            if winding(triangle, p) != 0 {
                seen[row * width + column] = true;
            }
        }
    }
}

/// A measured fabric: its name, its seven parameters and the softening of its bending.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Where it is from.
    pub name: String,
    /// Bending and density are measured, stretch and shear are Table 2's means.
    pub fabric: Fabric,
    /// Softening, zero where it was not measured.
    pub softening: Softening,
    /// Measured drape coefficient \[%\] and nodes.
    pub drape: Option<[f64; 2]>,
}

/// A fabric of this density \[kg/m^2\] and bending \[N m\], with Table 2's mean stretch and shear.
pub(super) fn fabric_of(density: f64, [weft, warp, bias]: [f64; 3]) -> Fabric {
    let fabric = Fabric {
        bending_weft_nm: weft,
        bending_warp_nm: warp,
        bending_bias_nm: bias,
        density_kg_m2: density,
        ..Fabric::mean_knit()
    };
    fabric.project_bending().0
}

/// `count` fabrics of bending-618, evenly over the rank of their bending length.
///
/// # Errors
/// When the file cannot be read as numbers.
pub fn bending_618(data: &Path, count: usize) -> Result<Vec<Measured>, DataError> {
    let path = data.join("bending-618/fabrics618_si.csv");
    let mut fabrics = Vec::new();
    for (index, row) in text_rows(&path)?.iter().enumerate() {
        let v = row.numbers()?;
        let &[density, l_warp, l_weft, l_bias, nl_warp, nl_weft, nl_bias] = &v[..] else {
            return Err(row.fault(format!("{} columns instead of 7", v.len())));
        };
        let soft = |linear: f64, second: f64| (-second / linear).max(0.0);
        fabrics.push(Measured {
            name: format!("618/{index}"),
            fabric: fabric_of(density, [l_weft, l_warp, l_bias]),
            softening: Softening {
                weft_m: soft(l_weft, nl_weft),
                warp_m: soft(l_warp, nl_warp),
                bias_m: soft(l_bias, nl_bias),
                ..Softening::default()
            },
            drape: None,
        });
    }
    fabrics.sort_by(|a, b| mean_length_m(&a.fabric).total_cmp(&mean_length_m(&b.fabric)));
    let last = fabrics.len().saturating_sub(1) as f64;
    let at = |k: usize| (0.02 + 0.96 * k as f64 / (count - 1).max(1) as f64) * last;
    Ok((0..count).filter_map(|k| fabrics.get(at(k).round() as usize).cloned()).collect())
}

/// The four fabrics with a measured bending rigidity and drape coefficient; their three
/// bending stiffnesses are taken as equal.
///
/// # Errors
/// When the file cannot be read.
pub fn kes_drape(data: &Path) -> Result<Vec<Measured>, DataError> {
    let mut fabrics = Vec::new();
    for row in text_rows(&data.join("kes-drape-4/fabrics4.csv"))? {
        let number = |column: usize| row.number(column);
        let (rigidity, density) = (number(2)?, number(4)?);
        fabrics.push(Measured {
            name: format!("KES {}", row.cell(1)?),
            fabric: fabric_of(density, [rigidity; 3]),
            softening: Softening::default(),
            drape: Some([number(6)?, number(7)?]),
        });
    }
    Ok(fabrics)
}

/// (sqrt(B^u B^v) / (D g))^(1/3) \[m\].
pub(super) fn mean_length_m(f: &Fabric) -> f64 {
    ((f.bending_weft_nm * f.bending_warp_nm).sqrt() / (f.density_kg_m2 * GRAVITY_M_S2)).cbrt()
}

/// Standard Cusick drapes of measured fabrics beside published bands and measured
/// silhouettes.
///
/// # Errors
/// When a file of the folder cannot be read.
pub fn cusick(
    data: &Path,
    count: usize,
    mut shown: impl FnMut(&str, RgbImage),
) -> Result<(Vec<Table>, Chart), DataError> {
    let mut rows = Vec::new();
    let (mut points, mut bars): ([Vec<[f64; 2]>; 4], _) = (Default::default(), Vec::new());
    for measured in bending_618(data, count)?.into_iter().chain(kes_drape(data)?) {
        let length_mm = 1e3 * mean_length_m(&measured.fabric);
        let mut row = vec![measured.name.clone(), format!("{length_mm:.1}")];
        let mut spread = Spread::default();
        let laws = [Softening::default(), measured.softening];
        let laws = &laws[..if laws[1].is_off() { 1 } else { 2 }];
        for (law, &softening) in laws.iter().enumerate() {
            let experiment = Experiment { softening, ..Experiment::standard_cusick() };
            let Timed { drape: d, cpu_s } =
                timed(|| drape(&measured.fabric, &Drop::canonical(), &options(experiment)));
            let coefficient = drape_coefficient(&d, &experiment);
            row.push(format!("{coefficient:.1}, {}, {}, {cpu_s:.1}", d.nodes, d.stop.name()));
            if law == 0 {
                spread = drops(&measured.fabric, &experiment, &d);
            }
            points[if measured.drape.is_some() { 2 } else { law }].push([length_mm, coefficient]);
            let name = measured.name.replace(['/', ' '], "_");
            shown(
                &format!("cusick {name}{}", ["", " softening"][law]),
                picture(&d.mesh(), 0.6, 0.6),
            );
        }
        if laws.len() == 1 {
            row.push("-, -, -, -".into());
        }
        row.push(spread.to_string());
        bars.extend(spread.coefficients.map(|dc| [length_mm, dc]));
        row.push(match measured.drape {
            Some([coefficient, nodes]) => {
                points[3].push([length_mm, coefficient]);
                format!("{coefficient:.1}, {nodes:.0}")
            }
            None => "-, -".into(),
        });
        rows.push(row);
    }
    let drapes = cusick_table(rows);
    let (bands, band_bars) = published_bands(data)?;
    let (silhouettes, silhouette_bars) = silhouettes(data)?;
    let chart = cusick_chart(points, [bars, band_bars, silhouette_bars]);
    Ok((vec![drapes, bands, silhouettes], chart))
}

/// The table of [`cusick`].
fn cusick_table(rows: Vec<Vec<String>>) -> Table {
    Table {
        title:
            "standard Cusick drapes, 5 mm cells: canonical drop with linear bending and with the \
                measured softening; canonical and three perturbed drops"
                .into(),
        columns: vec![
            "fabric",
            "bending_length_mm",
            "dc_percent, nodes, stop, cpu_s",
            "soft_dc_percent, soft_nodes, soft_stop, soft_cpu_s",
            "drops_dc_least, drops_dc_most, drops_nodes",
            "measured_dc_percent, measured_nodes",
        ],
        rows,
    }
}

/// The chart of [`cusick`]: drapes by kind, and the bars of drops, bands and silhouettes.
fn cusick_chart(points: [Vec<[f64; 2]>; 4], bars: [Vec<[f64; 2]>; 3]) -> Chart {
    let names = ["simulated", "simulated, softening", "KES four, simulated", "KES four, measured"];
    let bar_names = [
        "simulated, four drops",
        "published bands (no bending length)",
        "measured silhouettes, 5 to 95 % (no bending length)",
    ];
    let of = |mark: Mark, colour: image::Rgb<u8>| {
        move |(name, points): (&str, Vec<[f64; 2]>)| Series {
            name: name.to_owned(),
            points,
            mark,
            colour,
        }
    };
    let colours = [FAINT_BAR, COLOURS[4], COLOURS[5]];
    let bars = bar_names.into_iter().zip(bars).zip(colours);
    let mut series: Vec<_> = bars.map(|(named, colour)| of(Mark::Bar, colour)(named)).collect();
    let crosses = names.into_iter().zip(points).zip(COLOURS);
    series.extend(crosses.map(|(named, colour)| of(Mark::Cross, colour)(named)));
    let axis = |label: &str| Axis { label: label.into(), log: false };
    Chart {
        title: "Standard Cusick drape".into(),
        x: axis("bending length [mm]; bars beyond 44 have none"),
        y: axis("drape coefficient [%]"),
        series,
        legend: Legend::Left,
    }
}

const FAINT_BAR: image::Rgb<u8> = image::Rgb([160, 185, 225]);

/// What different drops of one fabric give.
#[derive(Default)]
struct Spread {
    /// Least and largest drape coefficient \[%\].
    coefficients: [f64; 2],
    /// Fewest and most folds.
    nodes: [usize; 2],
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([low, high], [few, many]) = (self.coefficients, self.nodes);
        write!(f, "{low:.1}, {high:.1}, {few} to {many}")
    }
}

/// Three perturbed drops beside the canonical one `d`.
fn drops(fabric: &Fabric, experiment: &Experiment, d: &Drape) -> Spread {
    let first = drape_coefficient(d, experiment);
    let mut spread = Spread { coefficients: [first; 2], nodes: [d.nodes; 2] };
    for seed in 1..=3 {
        let drop = Drop { start: DropStart::Perturbed(seed) };
        let other = drape(fabric, &drop, &options(*experiment));
        let coefficient = drape_coefficient(&other, experiment);
        let ([low, high], [few, many]) = (spread.coefficients, spread.nodes);
        spread.coefficients = [low.min(coefficient), high.max(coefficient)];
        spread.nodes = [few.min(other.nodes), many.max(other.nodes)];
    }
    spread
}

type TableAndBars = (Table, Vec<[f64; 2]>);

fn published_bands(data: &Path) -> Result<TableAndBars, DataError> {
    let (mut rows, mut bars) = (Vec::new(), Vec::new());
    for (k, row) in text_rows(&data.join("cusick-dc-bands.csv"))?.iter().enumerate() {
        let (low, high) = (row.number(1)?, row.number(2)?);
        rows.push(vec![row.cell(0)?.to_owned(), format!("{low:.0}"), format!("{high:.0}")]);
        bars.extend([low, high].map(|dc| [45.0 + k as f64, dc]));
    }
    let columns = vec!["class", "dc_least_percent", "dc_most_percent"];
    Ok((Table { title: "published drape coefficients".into(), columns, rows }, bars))
}

fn silhouettes(data: &Path) -> Result<TableAndBars, DataError> {
    let mut by_fabric = std::collections::BTreeMap::<u32, [Vec<f64>; 2]>::new();
    for row in text_rows(&data.join("cusick-silhouettes/index.csv"))? {
        let own = by_fabric.entry(row.number(1)? as u32).or_default();
        own[0].push(row.number(7)?);
        own[1].push(row.number(8)?);
    }
    let (mut rows, mut bars) = (Vec::new(), Vec::new());
    for (k, (fabric, [mut dc, mut nodes])) in by_fabric.into_iter().enumerate() {
        dc.sort_by(f64::total_cmp);
        nodes.sort_by(f64::total_cmp);
        let at = |values: &[f64], share: f64| {
            values[((values.len() - 1) as f64 * share).round() as usize]
        };
        let [low, middle, high] = [0.05, 0.5, 0.95].map(|share| at(&dc, share));
        rows.push(vec![
            fabric.to_string(),
            dc.len().to_string(),
            format!("{middle:.1}"),
            format!("{low:.1}"),
            format!("{high:.1}"),
            format!("{:.0} to {:.0}", at(&nodes, 0.0), at(&nodes, 1.0)),
        ]);
        bars.extend([low, high].map(|v| [52.0 + k as f64, v]));
    }
    let table = Table {
        title: "measured silhouettes".into(),
        columns: vec!["fabric", "drapes", "dc_median", "dc_5_percent", "dc_95_percent", "nodes"],
        rows,
    };
    Ok((table, bars))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::sim::Stop;
    use scan2params::sim::grid::Grid;

    /// A disc that lies flat, or hangs as a cone at 60 degrees beyond the plate.
    fn disc(cone: bool) -> (Drape, Experiment) {
        let experiment = Experiment::standard_cusick();
        let grid = Grid::of(&experiment.specimen, 61);
        let fold = |v: usize| {
            let p = grid.flat(v);
            let beyond = (p.norm() - 0.09).max(0.0);
            if !cone || beyond == 0.0 {
                return p;
            }
            let radial = p / p.norm();
            radial * (0.09 + 0.5 * beyond) - scan2params::base::Vector3::y() * (0.866 * beyond)
        };
        let positions_m: Vec<_> = (0..grid.vertices()).map(fold).collect();
        let boundary = grid.boundary(&positions_m);
        let drape = Drape {
            boundary,
            positions_m,
            stop: Stop::AtRest,
            residual_n: 0.0,
            energy_j: 0.0,
            nodes: 0,
            intersections: 0,
            plate_clearance_m: 0.0,
            effort: Default::default(),
            warnings: Vec::new(),
            grid,
        };
        (drape, experiment)
    }

    #[test]
    fn the_drape_coefficient_of_a_flat_disc_is_100_and_of_a_cone_its_ring() {
        let (flat, experiment) = disc(false);
        // half a pixel on the rim and the 244 points' chords
        assert!((drape_coefficient(&flat, &experiment) - 100.0).abs() < 0.5);
        let (cone, experiment) = disc(true);
        let exact = 100.0 * (0.12_f64.powi(2) - 0.0081) / (0.0225 - 0.0081);
        let dc = drape_coefficient(&cone, &experiment);
        assert!((dc - exact).abs() < 0.5, "{dc} {exact}");
    }
}
