//! How drapes spread, for `evaluate physics`: over the drops of one fabric, beside the
//! repeated drops of real specimens, and over the fabrics of a prior, in both experiments.
//!
//! In: nothing, or a folder of measured data. Out: tables.

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use super::drapes::{drape_coefficient, fabric_of};
use super::{DataError, Table, text_rows};
use crate::base::Boundary;
use crate::base::frame::GRAVITY_M_S2;
use crate::base::units::M_PER_MM;
use crate::fabric::{Fabric, Mixture, MixtureError};
use crate::sim::{Drop, DropStart, Experiment, SimOptions, Stop, drape};

/// Bending lengths of [`branches`] \[mm\].
const LENGTHS_MM: [f64; 5] = [10.0, 15.0, 20.0, 25.0, 30.0];
/// Density of its fabrics \[kg/m^2\]: near the median of 618 measured ones.
const DENSITY_KG_M2: f64 = 0.18;

/// Node counts and drape coefficients of one group of drops.
#[derive(Clone, Debug, Default)]
struct Drops {
    nodes: Vec<f64>,
    coefficients: Vec<f64>,
}

impl Drops {
    /// Mean and standard deviation of the nodes, their histogram, and the same of the
    /// drape coefficient.
    fn row(&self) -> [String; 3] {
        let [mean, sd] = mean_sd(&self.nodes);
        let mut counts = BTreeMap::<u32, usize>::new();
        for &n in &self.nodes {
            *counts.entry(n as u32).or_default() += 1;
        }
        let histogram: Vec<String> = counts.iter().map(|(n, c)| format!("{n}: {c}")).collect();
        let [dc, dc_sd] = mean_sd(&self.coefficients);
        [format!("{mean:.1}, {sd:.2}"), histogram.join(" "), format!("{dc:.1}, {dc_sd:.1}")]
    }
}

/// Mean and sample standard deviation; the latter NaN for fewer than two.
fn mean_sd(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    [mean, (square / (n - 1.0)).sqrt()]
}

/// A fabric of even bending of this bending length, with Table 2's mean stretch and shear.
fn of_bending_length(length_mm: f64) -> Fabric {
    let bending_nm = (length_mm * M_PER_MM).powi(3) * DENSITY_KG_M2 * GRAVITY_M_S2;
    fabric_of(DENSITY_KG_M2, [bending_nm; 3])
}

/// Perturbed drops of standard Cusick specimens, `count` for each of five bending lengths.
#[must_use]
pub fn branches(count: u64) -> Table {
    let experiment = Experiment::standard_cusick();
    let options = SimOptions { experiment, ..SimOptions::default() };
    let row = |&length_mm: &f64| {
        let fabric = of_bending_length(length_mm);
        let drapes: Vec<(usize, f64, bool)> = (1..=count)
            .into_par_iter()
            .map(|seed| {
                let d = drape(&fabric, &Drop { start: DropStart::Perturbed(seed) }, &options);
                (d.nodes, drape_coefficient(&d, &experiment), d.stop == Stop::AtRest)
            })
            .collect();
        let rested: Vec<_> = drapes.iter().filter(|d| d.2).collect();
        let drops = Drops {
            nodes: rested.iter().map(|d| d.0 as f64).collect(),
            coefficients: rested.iter().map(|d| d.1).collect(),
        };
        let at_rest = format!("{} of {}", rested.len(), drapes.len());
        [vec![format!("{length_mm:.0}"), at_rest], drops.row().to_vec()].concat()
    };
    Table {
        title: "perturbed drops of standard Cusick specimens, 5 mm cells, 180 g/m^2".into(),
        columns: vec!["bending_length_mm", "at_rest", "nodes_mean, nodes_sd", "drops by nodes", DC],
        rows: LENGTHS_MM.iter().map(row).collect(),
    }
}

const DC: &str = "dc_mean_percent, dc_sd";

/// The measured silhouettes: drops of one specimen with one face up, where there are four or
/// more, and what is pooled over all such groups.
///
/// # Errors
/// When the folder's `cusick-silhouettes/index.csv` cannot be read.
pub fn measured_branches(data: &Path) -> Result<Table, DataError> {
    let mut groups = BTreeMap::<[String; 3], Drops>::new();
    for row in text_rows(&data.join("cusick-silhouettes/index.csv"))? {
        let key = [1, 3, 5].map(|column| row.cell(column).map(str::to_owned));
        let [fabric, specimen, face] = key;
        let group = groups.entry([fabric?, specimen?, face?]).or_default();
        group.coefficients.push(row.number(7)?);
        group.nodes.push(row.number(8)?);
    }
    groups.retain(|_, drops| drops.nodes.len() >= 4);
    let pooled = |of: fn(&Drops) -> &Vec<f64>| {
        let squares = groups.values().map(|d| {
            let [_, sd] = mean_sd(of(d));
            (sd * sd * (of(d).len() - 1) as f64, of(d).len() - 1)
        });
        let (square, freedom) = squares.fold((0.0, 0), |(a, n), (s, f)| (a + s, n + f));
        (square / freedom.max(1) as f64).sqrt()
    };
    let mut rows: Vec<Vec<String>> = groups
        .iter()
        .map(|([fabric, specimen, face], drops)| {
            let name = format!("fabric {fabric}, specimen {specimen}, {face}");
            [vec![name, drops.nodes.len().to_string()], drops.row().to_vec()].concat()
        })
        .collect();
    rows.push(vec![
        format!("pooled over {} groups", groups.len()),
        groups.values().map(|d| d.nodes.len()).sum::<usize>().to_string(),
        format!("-, {:.2}", pooled(|d| &d.nodes)),
        "-".into(),
        format!("-, {:.1}", pooled(|d| &d.coefficients)),
    ]);
    Ok(Table {
        title: "drops of one real specimen with one face up".into(),
        columns: vec!["specimen", "drops", "nodes_mean, nodes_sd", "drops by nodes", DC],
        rows,
    })
}

/// How much the rim varies over `count` fabrics of the prior `knit-2020`, in this experiment
/// and in the standard Cusick one: the variance of a coordinate, mean over the rim's, with the
/// canonical drop.
///
/// # Errors
/// When the prior gives no fabric inside its range.
pub fn variance(count: u64, seed: u64) -> Result<Table, MixtureError> {
    let prior = Mixture::knit_2020();
    let fabrics: Vec<Fabric> =
        (0..count).map(|k| prior.sample(seed, k)).collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    let mut variances = Vec::new();
    for (name, experiment) in [
        ("square of 300 mm on 100 mm", Experiment::default()),
        ("disc of 300 mm on 180 mm", Experiment::standard_cusick()),
    ] {
        let options = SimOptions { experiment, ..SimOptions::default() };
        let drapes: Vec<_> =
            fabrics.par_iter().map(|f| drape(f, &Drop::canonical(), &options)).collect();
        let rims: Vec<&Boundary> = drapes.iter().map(|d| &d.boundary).collect();
        let rested = drapes.iter().filter(|d| d.stop == Stop::AtRest).count();
        variances.push(coordinate_variance_mm2(&rims));
        let variance = variances[variances.len() - 1];
        rows.push(vec![name.into(), format!("{rested} of {count}"), format!("{variance:.1}")]);
    }
    rows.push(vec!["ratio".into(), "-".into(), format!("{:.2}", variances[0] / variances[1])]);
    Ok(Table {
        title: "variance of the rim over fabrics of knit-2020, canonical drops".into(),
        columns: vec!["experiment", "at_rest", "variance_mm2"],
        rows,
    })
}

/// Variance over rims of each coordinate of each point, mean over all \[mm^2\].
fn coordinate_variance_mm2(rims: &[&Boundary]) -> f64 {
    let coordinates: Vec<Vec<f64>> = rims
        .iter()
        .map(|rim| rim.positions_m().flat_map(|p| [p.x, p.y, p.z]).map(|c| c / M_PER_MM).collect())
        .collect();
    let of = |k: usize| {
        let column: Vec<f64> = coordinates.iter().map(|rim| rim[k]).collect();
        mean_sd(&column)[1].powi(2)
    };
    let count = coordinates.first().map_or(0, Vec::len);
    (0..count).map(of).sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::grid::Grid;

    #[test]
    fn rims_that_lie_2_mm_apart_along_one_axis_vary_by_that() {
        let grid = Grid::shared(61, 0.3);
        let flat: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
        let raised: Vec<_> = flat.iter().map(|p| p + crate::base::Vector3::y() * 2e-3).collect();
        let [a, b] = [grid.boundary(&flat), grid.boundary(&raised)];
        // two values 2 mm apart: sample variance 2 mm^2, in one of three coordinates
        assert!((coordinate_variance_mm2(&[&a, &b]) - 2.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn drops_of_a_group_are_counted_and_groups_pooled() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("cusick-silhouettes")).unwrap();
        let mut text = "file,fabric,density,sample,capture,face,obs,dc,nodes\n".to_owned();
        for (fabric, dc, nodes) in
            [(1, 40.0, 6), (1, 42.0, 6), (1, 44.0, 7), (1, 46.0, 7), (2, 70.0, 4)]
        {
            text += &format!("a.jpg,{fabric},59,1,,up,1,{dc},{nodes}\n");
        }
        std::fs::write(folder.path().join("cusick-silhouettes/index.csv"), text).unwrap();
        let table = measured_branches(folder.path()).unwrap();
        assert_eq!(table.rows.len(), 2, "fabric 2 has one drop only");
        assert_eq!(table.rows[0][2], "6.5, 0.58");
        assert_eq!(table.rows[0][3], "6: 2 7: 2");
        assert_eq!(table.rows[1][4], "-, 2.6");
    }

    #[test]
    fn fabrics_have_the_bending_length_that_was_asked_for() {
        let length_m = crate::sim::experiment::bending_length_m(&of_bending_length(20.0));
        assert!((length_m - 0.020).abs() < 1e-9);
    }
}
