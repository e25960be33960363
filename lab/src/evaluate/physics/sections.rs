//! The one real drape that is known in three dimensions, for `scan2params-lab physics`: four
//! horizontal sections of a Cusick drape, 15 to 25 mm below the disc.
//!
//! In: a folder of measured data. Out: how near the simulator's drape comes to all four sections,
//! and which stiffness over weight brings it there. Neither the fabric nor the specimen's size is
//! known: the test's three sizes are tried, discs of 240, 300 and 360 mm on a plate of 180 mm.
//! Stretch and shear, which hardly matter here, are the mean knit's.
//!
//! The drape is guided to the scan's branch by an outline: the cloth is taken as straight from the
//! plate's edge through the lowest section to the rim. It is released before it is compared.

use std::path::Path;

use super::drapes::fabric_of;
use super::{DataError, Table, text_rows};
use scan2params::base::frame::GRAVITY_M_S2;
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Outline, Vector3};
use scan2params::calibrate::measures::{BEARINGS, FoldRule, Measures, farthest_m, folds};
use scan2params::calibrate::prediction::outline_of;
use scan2params::geom::MeshIndex;
use scan2params::picture::chart::{Axis, COLOURS, Chart, Legend, Mark, Series};
use scan2params::sim::{Drape, Drop, DropStart, Experiment, SimOptions, Stop, drape};

/// Depths of the sections below the disc \[m\].
const DEPTHS_M: [f64; 4] = [15.0e-3, 18.3e-3, 21.7e-3, 25.0e-3];
/// Diameters of the standard's specimens \[m\].
const DIAMETERS_M: [f64; 3] = [0.24, 0.30, 0.36];
/// Side of a cell \[m\].
const CELL_M: f64 = 5e-3;
/// Bending lengths that are tried first \[m\].
const LENGTHS_M: [f64; 8] = [10e-3, 13e-3, 16e-3, 19e-3, 22e-3, 25e-3, 28e-3, 32e-3];
/// Ratios of the bending along the warp to that along the weft that are tried.
const RATIOS: [f64; 2] = [1.6, 2.6];
/// Bearings of the warp that are tried, evenly over half a circle.
const WARPS: usize = 6;
/// Areal density \[kg/m^2\]; a drape depends on stiffness over weight.
const DENSITY_KG_M2: f64 = 0.2;
/// Drops that nothing guides.
const DROPS: u64 = 5;

/// Distances of the sections from the axis: one a degree, from +x towards +z \[m\].
type Sections = [Vec<f64>; 4];

/// A fabric and how it lies.
#[derive(Clone, Copy, Debug)]
struct Cloth {
    /// Diameter of the specimen \[m\].
    diameter_m: f64,
    /// Mean bending length \[m\].
    length_m: f64,
    /// Bending along the warp over that along the weft.
    ratio: f64,
    /// Bearing of the warp on the scan, in whole degrees.
    warp: usize,
}

/// A drape next to the measured sections.
struct Compared {
    cloth: Cloth,
    /// Root mean square and mean distance along the bearing, over all sections \[m\].
    rms_m: f64,
    mean_m: f64,
    /// Mean distance of the sections from the axis less the measured one \[m\].
    farther_m: [f64; 4],
    /// Where the scan's axis is best put, from the drape's, x and z \[m\].
    shift_m: [f64; 2],
    /// Folds of the lowest section.
    folds: usize,
    drape: Drape,
}

/// Compares free and guided drapes with the measured sections.
///
/// # Errors
/// When the file of the folder cannot be read, or is no such table.
pub fn sections(data: &Path) -> Result<(Table, Chart), DataError> {
    let measured = read(&data.join("real-drape-sections/sections.csv"))?;
    let mut rows = Vec::new();
    let plain = DIAMETERS_M.map(|diameter_m| {
        let even = |&length_m: &f64| Cloth { diameter_m, length_m, ratio: 1.0, warp: 0 };
        let tried = LENGTHS_M.iter().map(|length_m| guided(&measured, even(length_m)));
        let found = closer(&measured, best(tried.collect()));
        rows.push(row("as stiff along warp and weft", &found));
        found
    });
    let plain = best(plain.into());
    let lying = RATIOS.iter().flat_map(|&ratio| {
        let step = 180 / WARPS;
        (0..WARPS).map(move |k| Cloth { ratio, warp: k * step, ..plain.cloth })
    });
    let tried = lying.map(|cloth| guided(&measured, cloth));
    let uneven = closer(&measured, best(tried.collect()));
    rows.push(row("stiffer along the warp", &uneven));
    for seed in 1..=DROPS {
        let free = turned_best(&measured, plain.cloth, DropStart::Perturbed(seed));
        rows.push(row(&format!("not guided, drop {seed}"), &free));
    }
    let rule = FoldRule::default();
    let counts: Vec<String> = measured.iter().map(|s| folds(s, &rule).to_string()).collect();
    let title = format!(
        "sections of a real Cusick drape, which has {} folds at {} mm below the disc",
        counts.join(", "),
        DEPTHS_M.map(|d| format!("{:.1}", d / M_PER_MM)).join(", ")
    );
    let chart = chart(&turned(&measured, uneven.cloth.warp), &uneven);
    Ok((Table { title, columns: COLUMNS.split(", ").collect(), rows }, chart))
}

/// The highest and the lowest section, measured and simulated, seen from above.
fn chart(measured: &Sections, compared: &Compared) -> Chart {
    let own = of_drape(&compared.drape);
    let plan = |distances: &[f64], [dx, dz]: [f64; 2]| -> Vec<[f64; 2]> {
        let at = |k: usize| {
            let (sin, cos) = (k as f64 * 360.0 / BEARINGS as f64).to_radians().sin_cos();
            let r = distances[k % BEARINGS];
            [(r * cos - dx) / M_PER_MM, (r * sin - dz) / M_PER_MM]
        };
        (0..=BEARINGS).map(at).collect()
    };
    let series = |name: &str, points, k: usize| Series {
        name: name.to_owned(),
        points,
        mark: Mark::Line,
        colour: COLOURS[k],
    };
    let (none, shift) = ([0.0; 2], compared.shift_m);
    Chart {
        title: "sections 15 and 25 mm below the disc, from above".into(),
        x: Axis { label: "mm".into(), log: false },
        y: Axis { label: "mm".into(), log: false },
        series: vec![
            series("measured, 15 mm", plan(&measured[0], none), 0),
            series("measured, 25 mm", plan(&measured[3], none), 1),
            series("simulated, 15 mm", plan(&own[0], shift), 2),
            series("simulated, 25 mm", plan(&own[3], shift), 3),
        ],
        legend: Legend::Right,
    }
}

const COLUMNS: &str = "drape, diameter_mm, bending_length_mm, warp_over_weft, warp_bearing_deg, rms_mm, mean_mm, \
     farther_15.0_mm, farther_18.3_mm, farther_21.7_mm, farther_25.0_mm, folds, \
     drape_coefficient, stop";

fn row(name: &str, compared: &Compared) -> Vec<String> {
    let Compared { cloth, drape, .. } = compared;
    let rule = FoldRule::default();
    let measures = Measures::of(&outline_of(drape), &experiment(*cloth), &rule);
    let mm = |v: f64| format!("{:.2}", v / M_PER_MM);
    let diameter = format!("{:.0}", cloth.diameter_m / M_PER_MM);
    let ratio = format!("{:.1}", cloth.ratio);
    let mut row = vec![name.to_owned(), diameter, mm(cloth.length_m), ratio];
    row.extend([cloth.warp.to_string(), mm(compared.rms_m), mm(compared.mean_m)]);
    row.extend(compared.farther_m.map(mm));
    row.push(compared.folds.to_string());
    row.extend([format!("{:.1}", measures.drape_coefficient), drape.stop.name().to_owned()]);
    row
}

/// The measured sections, one distance a degree, linear between the rows.
fn read(path: &Path) -> Result<Sections, DataError> {
    let mut rows = Vec::new();
    for line in text_rows(path)? {
        let numbers = line.numbers()?;
        let row: [f64; 5] =
            numbers.try_into().map_err(|_| line.fault("not five numbers".to_owned()))?;
        rows.push(row);
    }
    let [first, last] = [rows.first(), rows.last()].map(|row| row.map_or(f64::NAN, |row| row[0]));
    let at = |bearing: usize, section: usize| {
        let mut theta = (bearing as f64 * 360.0 / BEARINGS as f64).to_radians();
        if theta > last {
            theta -= std::f64::consts::TAU;
        }
        let theta = theta.clamp(first, last);
        let next = rows.partition_point(|row| row[0] < theta).clamp(1, rows.len() - 1);
        let (a, b) = (rows[next - 1], rows[next]);
        let part = (theta - a[0]) / (b[0] - a[0]);
        (a[section + 1] + (b[section + 1] - a[section + 1]) * part) * M_PER_MM
    };
    Ok(std::array::from_fn(|k| (0..BEARINGS).map(|bearing| at(bearing, k)).collect()))
}

/// The fabric of a cloth.
fn fabric(cloth: Cloth) -> scan2params::fabric::Fabric {
    let rigidity = cloth.length_m.powi(3) * DENSITY_KG_M2 * GRAVITY_M_S2;
    let root = cloth.ratio.sqrt();
    fabric_of(DENSITY_KG_M2, [rigidity / root, rigidity * root, rigidity])
}

/// Sections turned so that the warp lies along +x.
fn turned(sections: &Sections, by: usize) -> Sections {
    sections.each_ref().map(|section| {
        let mut own = section.clone();
        own.rotate_left(by % BEARINGS);
        own
    })
}

/// The drape of a cloth that is guided to the sections' branch.
fn guided(measured: &Sections, cloth: Cloth) -> Compared {
    let measured = turned(measured, cloth.warp);
    let start = DropStart::Outline(Box::new(rim(&measured, cloth)));
    compared(&measured, cloth, dropped(cloth, start))
}

/// The test of a cloth.
fn experiment(cloth: Cloth) -> Experiment {
    let mut experiment = Experiment::standard_cusick();
    experiment.specimen.warp_m = cloth.diameter_m;
    experiment.specimen.weft_m = cloth.diameter_m;
    experiment
}

fn dropped(cloth: Cloth, start: DropStart) -> Drape {
    let vertices = (cloth.diameter_m / CELL_M).round() as usize + 1;
    let options = SimOptions { experiment: experiment(cloth), vertices, ..SimOptions::default() };
    drape(&fabric(cloth), &Drop { start }, &options)
}

/// A drape that nothing guides, turned to where it lies best.
fn turned_best(measured: &Sections, cloth: Cloth, start: DropStart) -> Compared {
    let drape = dropped(cloth, start);
    let turns = (0..BEARINGS).step_by(2).map(|by| {
        let own = turned(measured, by);
        (by, compared(&own, cloth, drape.clone()))
    });
    let least = turns.min_by(|(_, a), (_, b)| a.rms_m.total_cmp(&b.rms_m));
    least.map_or_else(|| compared(measured, cloth, drape.clone()), |(_, own)| own)
}

/// The rim's outline, if the cloth is straight from the plate's edge through the lowest section.
fn rim(measured: &Sections, cloth: Cloth) -> Outline {
    let experiment = experiment(cloth);
    let (plate, depth) = (experiment.plate.radius_m, DEPTHS_M[3]);
    let length = 0.5 * experiment.specimen.weft_m - plate;
    let at = |(k, r): (usize, &f64)| {
        let out = r - plate;
        let reach = plate + length * out / out.hypot(depth);
        let (sin, cos) = (k as f64 * 360.0 / BEARINGS as f64).to_radians().sin_cos();
        [reach * cos, reach * sin]
    };
    let points = measured[3].iter().enumerate().map(at).collect();
    Outline::new(points).unwrap_or_else(|_| unreachable!("distances from an axis"))
}

/// A drape next to sections whose warp lies along +x; where the scan's axis was is free.
fn compared(measured: &Sections, cloth: Cloth, drape: Drape) -> Compared {
    let own = of_drape(&drape);
    let mut apart: Vec<[f64; 3]> = Vec::new();
    let mut farther_m = [0.0; 4];
    for (section, (a, b)) in own.iter().zip(measured).enumerate() {
        for (k, (own, measured)) in a.iter().zip(b).enumerate() {
            let (sin, cos) = (k as f64 * 360.0 / BEARINGS as f64).to_radians().sin_cos();
            apart.push([own - measured, cos, sin]);
            farther_m[section] += (own - measured) / BEARINGS as f64;
        }
    }
    // sines and cosines over full circles are orthogonal: the shift is twice their means
    let count = apart.len() as f64;
    let shift = [1, 2].map(|c| apart.iter().map(|row| 2.0 * row[0] * row[c]).sum::<f64>() / count);
    let left = || apart.iter().map(|[d, cos, sin]| d - shift[0] * cos - shift[1] * sin);
    Compared {
        cloth,
        rms_m: (left().map(|d| d * d).sum::<f64>() / count).sqrt(),
        mean_m: left().map(f64::abs).sum::<f64>() / count,
        farther_m,
        shift_m: shift,
        folds: folds(&own[3], &FoldRule::default()),
        drape,
    }
}

/// Farthest distance of a sheet from the axis at each depth below the cloth on the plate.
fn of_drape(drape: &Drape) -> Sections {
    let mesh = drape.mesh();
    let top = mesh.vertices.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    let index = MeshIndex::new(&mesh).ok();
    let cut = |depth: f64| {
        let plane = index.as_ref().map(|index| index.cut(&Vector3::y(), top - depth));
        plane.unwrap_or_default().into_iter().map(|ends| ends.map(|p| [p.x, p.z]))
    };
    DEPTHS_M.map(|depth| farthest_m(cut(depth), [0.0; 2]))
}

/// The best of some drapes: those at rest first, then the nearest.
fn best(tried: Vec<Compared>) -> Compared {
    let order = |c: &Compared| (c.drape.stop != Stop::AtRest, c.rms_m);
    tried
        .into_iter()
        .min_by(|a, b| {
            let ((a, ra), (b, rb)) = (order(a), order(b));
            a.cmp(&b).then(ra.total_cmp(&rb))
        })
        .unwrap_or_else(|| unreachable!("something is tried"))
}

/// Narrows the bending length down around the best so far, to 1 %.
fn closer(measured: &Sections, mut so_far: Compared) -> Compared {
    let mut step = 0.06;
    while step > 0.01 {
        let tried = [1.0 - step, 1.0 + step].map(|factor| {
            let length_m = so_far.cloth.length_m * factor;
            guided(measured, Cloth { length_m, ..so_far.cloth })
        });
        let next = best(tried.into());
        if next.drape.stop == Stop::AtRest && next.rms_m < so_far.rms_m {
            so_far = next;
        } else {
            step *= 0.5;
        }
    }
    so_far
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sections of a simulated drape, as a file has them.
    fn file_of(sections: &Sections) -> String {
        let mut text = "theta_rad,a,b,c,d\n".to_owned();
        for k in 0..=126 {
            let theta = -3.15 + 0.05 * f64::from(k);
            let degree = theta.to_degrees().round().rem_euclid(360.0) as usize % BEARINGS;
            let row = sections.each_ref().map(|s| (s[degree] / M_PER_MM).to_string());
            text += &format!("{theta:.2},{}\n", row.join(","));
        }
        text
    }

    #[test]
    fn a_drape_that_is_guided_by_its_own_sections_is_found_again() {
        let truth = Cloth { diameter_m: 0.3, length_m: 22e-3, ratio: 1.0, warp: 0 };
        let drape = dropped(truth, DropStart::Perturbed(3));
        assert_eq!(drape.stop, Stop::AtRest);
        let sections = of_drape(&drape);
        assert!(sections.iter().flatten().all(|r| (0.09..0.15).contains(r)));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sections.csv");
        std::fs::write(&path, file_of(&sections)).unwrap();
        let measured = read(&path).unwrap();
        for (own, read) in sections.iter().flatten().zip(measured.iter().flatten()) {
            assert!((own - read).abs() < 3e-3, "{own} {read}");
        }
        let [same, softer] =
            [22e-3, 17e-3].map(|length_m| guided(&measured, Cloth { length_m, ..truth }));
        println!("{:.2} and {:.2} mm", same.rms_m / M_PER_MM, softer.rms_m / M_PER_MM);
        assert!(same.rms_m < 1.2e-3 && softer.rms_m > 2.0 * same.rms_m);
        assert_eq!(same.folds, folds(&measured[3], &FoldRule::default()));
    }
}
