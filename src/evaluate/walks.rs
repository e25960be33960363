//! Branches of sheets that were continued from fabric to fabric, compared with those of dropped sheets, for
//! `evaluate walks`: whether data made by walking show other drapes than data made by falls.
//!
//! In: the rows of two folders of `generate`. Out: one [`Band`] for each range of bending length, with the
//! folds, the largest harmonic of the rim and its mean distance from the axis in either, and for the
//! fabrics that both have, how far the rims of one fabric are apart.
//!
//! Where it fails: two falls of one fabric differ as well. What that makes is seen by giving two folders of
//! falls, or one of several drops of a fabric as the first.

use std::collections::BTreeMap;

use crate::base::units::M_PER_MM;
use crate::dataset::Row;
use crate::numeric::robust;
use crate::sim::experiment::bending_length_m;
use crate::sim::rim_harmonics_m;

/// Ends of the bands of bending length \[mm\].
const ENDS_MM: [f64; 6] = [0.0, 6.0, 9.0, 13.0, 18.0, f64::INFINITY];

/// What drapes of one band look like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branches {
    /// Rows at rest.
    pub rows: usize,
    /// Mean number of folds.
    pub folds: f64,
    /// Its standard deviation over the drapes.
    pub folds_sd: f64,
    /// Mean over the drapes of the largest of the rim's harmonics 3 to 16 \[m\].
    pub amplitude_m: f64,
    /// Mean distance of the rims from the plate's axis \[m\].
    pub radius_m: f64,
}

/// Both folders within one range of bending length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Lower and upper end \[mm\].
    pub ends_mm: [f64; 2],
    /// The rows of the first folder; none where there is no row.
    pub first: Option<Branches>,
    /// The rows of the second.
    pub second: Option<Branches>,
    /// Pairs of drapes of one fabric, one of each folder.
    pub pairs: usize,
    /// Share of them with as many folds.
    pub same_folds: f64,
    /// Median of the mean distance between their rims \[m\].
    pub apart_m: f64,
}

impl Band {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str = "bending_length_mm, rows, folds, folds_sd, amplitude_mm, radius_mm, \
         rows_2, folds_2, folds_sd_2, amplitude_2_mm, radius_2_mm, pairs, same_folds, apart_mm";

    /// The band as a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let side = |branches: Option<Branches>| match branches {
            Some(Branches { rows, folds, folds_sd, amplitude_m, radius_m }) => format!(
                "{rows}, {folds:.2}, {folds_sd:.2}, {:.2}, {:.2}",
                amplitude_m / M_PER_MM,
                radius_m / M_PER_MM
            ),
            None => "0, , , , ".to_owned(),
        };
        let pairs = match self.pairs {
            0 => "0, , ".to_owned(),
            pairs => format!("{pairs}, {:.2}, {:.2}", self.same_folds, self.apart_m / M_PER_MM),
        };
        let [low, high] = self.ends_mm;
        format!("{low} to {high}, {}, {}, {pairs}", side(self.first), side(self.second))
    }
}

/// The bands of two folders, the last one of all bending lengths; only rows at rest count.
#[must_use]
pub fn compare(first: &[Row], second: &[Row]) -> Vec<Band> {
    let bands = ENDS_MM.windows(2).map(|ends| [ends[0], ends[1]]);
    bands.chain([[0.0, f64::INFINITY]]).map(|ends_mm| band(first, second, ends_mm)).collect()
}

fn band(first: &[Row], second: &[Row], ends_mm: [f64; 2]) -> Band {
    let inside = |row: &&Row| {
        let length_mm = bending_length_m(&row.fabric) / M_PER_MM;
        row.drape.at_rest && (ends_mm[0]..ends_mm[1]).contains(&length_mm)
    };
    let [first, second] =
        [first, second].map(|rows| rows.iter().filter(inside).collect::<Vec<_>>());
    let of_fabric: BTreeMap<u64, &Row> =
        second.iter().map(|row| (row.fabric_index, *row)).collect();
    let pairs: Vec<(&Row, &Row)> = first
        .iter()
        .filter_map(|row| of_fabric.get(&row.fabric_index).map(|other| (*row, *other)))
        .filter(|(a, b)| a.fabric.to_paper_units() == b.fabric.to_paper_units())
        .collect();
    let same = pairs.iter().filter(|(a, b)| a.drape.node_count == b.drape.node_count).count();
    let apart: Vec<f64> =
        pairs.iter().map(|(a, b)| a.drape.boundary.mean_distance_m(&b.drape.boundary)).collect();
    Band {
        ends_mm,
        first: branches(&first),
        second: branches(&second),
        pairs: pairs.len(),
        same_folds: same as f64 / pairs.len().max(1) as f64,
        apart_m: robust::median(apart).unwrap_or(0.0),
    }
}

fn branches(rows: &[&Row]) -> Option<Branches> {
    let count = rows.len() as f64;
    let mean = |value: fn(&Row) -> f64| rows.iter().map(|row| value(row)).sum::<f64>() / count;
    let folds = mean(|row| f64::from(row.drape.node_count));
    let squares = rows.iter().map(|row| (f64::from(row.drape.node_count) - folds).powi(2));
    let branches = Branches {
        rows: rows.len(),
        folds,
        folds_sd: (squares.sum::<f64>() / count).sqrt(),
        amplitude_m: mean(|row| {
            rim_harmonics_m(&row.drape.boundary)[2..].iter().copied().fold(0.0, f64::max)
        }),
        radius_m: mean(|row| {
            let rim = &row.drape.boundary;
            let radii = rim.positions_m().map(|p| p.x.hypot(p.z));
            radii.sum::<f64>() / rim.positions_m().count() as f64
        }),
    };
    (!rows.is_empty()).then_some(branches)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Boundary, Point3, boundary};
    use crate::dataset::SimulatedRow;
    use crate::fabric::{Fabric, Mixture};

    /// A rim with `folds` waves of 20 mm around 120 mm.
    fn row(index: u64, fabric: Fabric, folds: u32) -> Row {
        let point = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / boundary::POINTS as f64;
            let rho = 0.12 + 0.02 * (f64::from(folds) * angle).cos();
            Point3::new(rho * angle.cos(), -0.1, rho * angle.sin())
        };
        let drape = SimulatedRow {
            boundary: Boundary::exact((0..boundary::POINTS).map(point)).unwrap(),
            at_rest: true,
            stop: "at_rest".into(),
            stable: true,
            node_count: folds,
            energy_j: 0.0,
            residual_n: 0.0,
            walked: false,
        };
        Row { index, fabric_index: index, fabric, drape }
    }

    #[test]
    fn folds_harmonics_and_pairs_are_those_that_were_made_up() {
        let prior = Mixture::measured();
        let fabrics: Vec<_> = (0..40).map(|k| prior.sample(1, k).unwrap()).collect();
        let rows = |folds: fn(u64) -> u32| -> Vec<Row> {
            fabrics.iter().zip(0..).map(|(f, k)| row(k, *f, folds(k))).collect()
        };
        let (mut first, second) = (rows(|_| 5), rows(|k| if k % 4 == 0 { 5 } else { 6 }));
        first[0].drape.at_rest = false;
        let bands = compare(&first, &second);
        let all = bands.last().unwrap();
        let (a, b) = (all.first.unwrap(), all.second.unwrap());
        assert_eq!((a.rows, b.rows, all.pairs), (39, 40, 39));
        assert!((a.folds - 5.0).abs() < 1e-12 && a.folds_sd < 1e-12);
        assert!((b.folds - 5.75).abs() < 1e-12 && (b.folds_sd - 0.1875_f64.sqrt()).abs() < 1e-12);
        assert!((a.amplitude_m - 0.02).abs() < 1e-9 && (a.radius_m - 0.12).abs() < 1e-9);
        assert!((all.same_folds - 9.0 / 39.0).abs() < 1e-12 && all.apart_m > 0.01);
        let parts: usize = bands[..5].iter().filter_map(|band| band.first).map(|b| b.rows).sum();
        assert_eq!(parts, 39, "every bending length lies in one band");
        assert_eq!(all.row().split(", ").count(), Band::COLUMNS.split(", ").count());
        let empty = compare(&[], &second);
        assert!(empty.iter().all(|band| band.first.is_none() && band.pairs == 0));
        assert_eq!(empty[0].row().split(", ").count(), Band::COLUMNS.split(", ").count());
    }
}
